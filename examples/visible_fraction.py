"""Annotates boxes with visible fractions, as data sets of streets have them.

The depth image is what a sensor sees: cars, and a wall that hides parts of some.
"""

import numpy as np
import numpy.typing as npt

import hizvk

#: nuScenes' four levels end here: 0-40, 40-60, 60-80 and 80-100 % visible.
LEVELS = (0.4, 0.6, 0.8)


def cars() -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Corners of eight cars in a row, 20 m away."""
    left = np.arange(8) * 3.0 - 11.5
    low = np.stack([left, np.zeros(8), np.full(8, -24.0)], axis=1)
    return low, low + np.array([2.0, 1.5, 4.0])


def main() -> None:
    """Renders the depth of everything, counts, and prints a line per car."""
    device = hizvk.Device()
    size = (540, 960)
    camera = hizvk.Camera.look_at((0, 1, 0), (0, 1, -1), fov_y_deg=60, size=size, near=0.1)
    low, high = cars()
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    box = [[side[0], side[k], side[k + 1]] for side in sides for k in (1, 2)]
    meshes = [hizvk.Mesh(a + corner * (b - a), box) for a, b in zip(low, high, strict=True)]
    # A wall between the camera and the second half of the cars, waist-high.
    wall = hizvk.Mesh(
        [(0.0, -2, -10), (9, -2, -10), (9, 0.75, -10), (0, 0.75, -10)], [[0, 1, 2], [0, 2, 3]]
    )
    depth = device.render_depth(device.occluders([*meshes, wall]), camera)

    boxes = device.instances(hizvk.Boxes(low, high))
    seen = device.cull(boxes, camera, device.pyramid(depth), outputs=["pixels"], coverage="sample")
    fractions = seen.visible_fraction()
    for number, (counts, fraction) in enumerate(zip(seen.pixels, fractions, strict=True)):
        level = 1 + np.digitize(fraction, LEVELS)
        print(f"car {number}: {counts['inside']} px show, {fraction:.0%} visible, level {level}")
    level_4 = fractions >= LEVELS[-1]
    print(
        f"level 4: {level_4[:4].sum()} of 4 in the open, {level_4[4:].sum()} of 4 behind the wall"
    )


if __name__ == "__main__":
    main()
