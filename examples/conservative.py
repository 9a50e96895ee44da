"""Culls for a large image by a small depth image.

Between two walls is a gap of 2 cm.
The large image shows it, and a small image that was drawn plainly does not: no centre of its pixels
lies in the gap.
A conservative small image promises for every image of the same view, of any size.
"""

import numpy as np

import hizvk

LARGE, SMALL = (1080, 1920), (90, 160)


def wall(left: float, right: float) -> hizvk.Mesh:
    """A wall 10 m away, over the whole height of the view."""
    corners = [[left, -9, -10], [right, -9, -10], [right, 9, -10], [left, 9, -10]]
    return hizvk.Mesh(np.array(corners, np.float64), np.array([[0, 1, 2], [0, 2, 3]]))


def main() -> None:
    """Culls the same balls by three depth images."""
    device = hizvk.Device()
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=LARGE, near=0.1)
    walls = device.occluders([wall(-15.0, -0.01), wall(0.01, 15.0)])

    # The first ball is seen through the gap; the others are well behind the walls.
    random = np.random.default_rng(3)
    hidden = random.uniform((2.0, -5.0, -30.0), (8.0, 5.0, -15.0), (999, 3))
    hidden[::2, 0] *= -1.0
    crowd = device.instances(hizvk.Spheres(np.vstack([[0.0, 0.0, -20.0], hidden]), 0.2))

    images = {
        "large": device.render_depth(walls, camera),
        "small": device.render_depth(walls, camera, size=SMALL),
        "small and conservative": device.render_depth(walls, camera, size=SMALL, conservative=True),
    }
    told = []
    for name, depth in images.items():
        # The small camera has the same view: depth.camera is camera.resized(SMALL).
        seen = device.cull(crowd, depth.camera, device.pyramid(depth))
        print(f"{name:>22}: {depth.size[0]} x {depth.size[1]} pixels, {seen.count} of 1000 kept")
        told.append(f"{name} {'keeps' if seen.mask[0] else 'hides'}")
    print("the ball behind the gap:", ", ".join(told))


if __name__ == "__main__":
    main()
