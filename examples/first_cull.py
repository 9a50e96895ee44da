"""Finds which of 10,000 balls the camera can see past a wall.

The wall is drawn into a depth image on the device, and the balls are tested against it.
"""

import numpy as np
import numpy.typing as npt

import hizvk

HALF = 5_000


def balls() -> npt.NDArray[np.float64]:
    """Centres: first those between the camera and the wall, then those behind the wall."""
    random = np.random.default_rng(7)
    before = random.uniform((-3.0, 0.5, -11.0), (3.0, 3.5, -5.0), (HALF, 3))
    behind = random.uniform((-6.0, 0.5, -40.0), (6.0, 5.5, -15.0), (HALF, 3))
    return np.concatenate([before, behind])


def main() -> None:
    """Uploads, draws the depth, culls, and prints what is left."""
    device = hizvk.Device()  # the best Vulkan adapter, GPUs first
    print("on", device.adapter)

    # 2 m above the ground, looking along -z. Sizes are (height, width).
    camera = hizvk.Camera.look_at((0, 2, 0), (0, 2, -1), fov_y_deg=60, size=(540, 960), near=0.1)

    # Uploaded once, then used for any number of culls.
    crowd = device.instances(hizvk.Spheres(balls(), 0.2))
    corners = [[-8.0, 0.0, -12.0], [8.0, 0.0, -12.0], [8.0, 6.0, -12.0], [-8.0, 6.0, -12.0]]
    walls = device.occluders(corners, [[0, 1, 2], [0, 2, 3]])

    # For each new view: draw the depth, build its pyramid, cull.
    hiz = device.pyramid(device.render_depth(walls, camera))
    seen = device.cull(crowd, camera, hiz)

    print(seen.stats)
    print("why not the last ball:", seen.explain(len(crowd) - 1).reason)
    in_front = int(seen.mask[:HALF].sum())
    print(f"kept {in_front:,} of {HALF:,} in front and {seen.count - in_front:,} behind the wall")


if __name__ == "__main__":
    main()
