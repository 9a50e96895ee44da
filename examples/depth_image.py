"""Culls by a depth image of one's own, here that of a depth camera.

Five things have to be said, because a wrong guess would hide what can be seen:

- the camera matrix, and where the tool has the first pixel's centre;
- the direction of the pose;
- what the numbers are (``kind``), and in which unit (``scale``);
- which numbers mean "no data".
"""

import numpy as np
import numpy.typing as npt

import hizvk

SIZE = (480, 640)  # (height, width)


def sensor() -> npt.NDArray[np.uint16]:
    """Millimetres of view depth: a wall 4 m away, and no data in the right half."""
    image = np.full(SIZE, 4_000, np.uint16)
    image[:, SIZE[1] // 2 :] = 0
    return image


def boxes() -> hizvk.Boxes:
    """Ten boxes each: before the wall, behind it, and where the sensor has no data."""
    random = np.random.default_rng(11)
    low = np.concatenate(
        [
            random.uniform((-0.8, -0.5, 2.0), (0.8, 0.5, 3.0), (10, 3)),
            random.uniform((-2.0, -1.0, 5.0), (-0.6, 1.0, 8.0), (10, 3)),
            random.uniform((0.2, -1.0, 5.0), (2.0, 1.0, 8.0), (10, 3)),
        ]
    )
    return hizvk.Boxes(low, low + 0.2)


def main() -> None:
    """One call: bounds and a depth image in, a mask out."""
    focal = 525.0
    k = [[focal, 0.0, 319.5], [0.0, focal, 239.5], [0.0, 0.0, 1.0]]
    camera = hizvk.Camera.from_opencv(
        k,
        pixel_center="integer",  # OpenCV: the first pixel's centre is (0, 0)
        world_from_camera=np.eye(4),  # the pose; x right, y down, z forward
        size=SIZE,
        near=0.1,
    )
    # Whole numbers count as exact, but the sensor has rounded to millimetres.
    # So a wall may be up to half a millimetre farther than it says.
    image = sensor()
    metres = np.where(image > 0, (image + 0.5) * 0.001, 0.0)  # 0 is no data: it hides nothing

    mask = hizvk.visible(boxes(), camera, depth=metres, kind="z")
    # As it came, the image takes `scale`; for uint16, 0 and 65535 are no data.
    exact = hizvk.visible(boxes(), camera, depth=image, kind="z", scale=0.001)
    assert np.array_equal(mask, exact)

    before, behind, unknown = mask.reshape(3, 10).sum(axis=1)
    print(f"kept {before} before the wall, {behind} behind it, {unknown} without data")


if __name__ == "__main__":
    main()
