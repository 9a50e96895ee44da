"""Moves some instances from frame to frame.

A ball walks past behind a wall; 1000 others stand still.
Only what moves is uploaded again.
"""

import numpy as np

import hizvk

FRAMES = 10


def walker(frame: int) -> hizvk.Spheres:
    """The ball in a frame: 10 m away, from left to right."""
    return hizvk.Spheres([[-9.0 + 2.0 * frame, 0.0, -10.0]], 0.5)


def main() -> None:
    """Updates, culls, and reads the answers after the last frame."""
    device = hizvk.Device()
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(256, 512), near=0.1)
    # 5 m away and 4 m wide: at 10 m it hides whatever is less than 4 m from the middle.
    corners = [[-2.0, -4.0, -5.0], [2.0, -4.0, -5.0], [2.0, 4.0, -5.0], [-2.0, 4.0, -5.0]]
    walls = device.occluders(corners, [[0, 1, 2], [0, 2, 3]])
    hiz = device.pyramid(device.render_depth(walls, camera))

    random = np.random.default_rng(1)
    standing = random.uniform((-15.0, -5.0, -60.0), (15.0, 5.0, -20.0), (1000, 3))
    centers = np.vstack([walker(0).centers, standing])
    crowd = device.instances(hizvk.Spheres(centers, 0.5))

    frames = []
    for frame in range(FRAMES):
        # Instance 0 gets new bounds. Culls that were submitted before still see the old ones.
        crowd.update(0, walker(frame))
        # `cull` does not wait, so the device works on while the next frame is prepared.
        frames.append(device.cull(crowd, camera, hiz, outputs=["mask"]))

    hidden = [frame for frame, seen in enumerate(frames) if not seen.mask[0]]
    print("the walker is hidden in frames", ", ".join(map(str, hidden)))


if __name__ == "__main__":
    main()
