"""Which boxes of a driving frame show, and how much of each: labels and camera as KITTI has them.

The label file lists every object of a simulated frame, hidden ones too, as simulators do.
The depth image is dense, in whole centimetres of uint16, as that of Virtual KITTI 2.
"""

from pathlib import Path

import numpy as np
import numpy.typing as npt

import hizvk

DATA = Path(__file__).parent / "data"
SIZE = (375, 1242)
#: Visible fractions that end KITTI's levels: 0 is fully visible, 1 partly, 2 largely occluded.
LEVELS = (0.95, 0.5, 1e-9)


def read_camera(path: Path) -> hizvk.Camera:
    """The left colour camera, number 2; the world is the rectified camera 0."""
    lines = (line.partition(":") for line in path.read_text().splitlines() if line)
    p2 = np.array({name: row for name, _, row in lines}["P2"].split(), float).reshape(3, 4)
    k = p2[:, :3]
    pose = (np.eye(3), np.linalg.inv(k) @ p2[:, 3])
    return hizvk.Camera.from_opencv(
        k, pixel_center="integer", camera_from_world=pose, size=SIZE, near=0.1
    )


def read_labels(path: Path) -> tuple[list[str], npt.NDArray[np.int64], hizvk.OrientedBoxes]:
    """Types, levels of occlusion and boxes; regions without labels (DontCare) are left out."""
    lines = path.read_text().splitlines()
    rows = [line.split() for line in lines if not line.startswith("DontCare")]
    table = np.array([row[1:15] for row in rows], float).reshape(-1, 14)
    half = table[:, [9, 7, 8]] / 2  # length, height, width
    centers = table[:, 10:13] - half * (0, 1, 0)  # y is down; a location is at the lower face
    boxes = hizvk.OrientedBoxes.from_yaw(centers, half, np.degrees(table[:, 13]), up=(0, 1, 0))
    return [row[0] for row in rows], table[:, 1].astype(int), boxes


def depth_image(
    device: hizvk.Device, camera: hizvk.Camera, boxes: hizvk.OrientedBoxes
) -> npt.NDArray[np.uint16]:
    """Stands for ``cv2.imread("depth_00000.png", cv2.IMREAD_ANYDEPTH)``."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [[a, *two] for a, b, c, d in sides for two in ((b, c), (c, d))]
    world_from_box = np.tile(np.eye(4), (len(boxes), 1, 1))
    world_from_box[:, :3, :3] = boxes.rotations * boxes.half_sizes[:, None]
    world_from_box[:, :3, 3] = boxes.centers
    occluders = device.occluders(hizvk.Mesh(corners, triangles, world_from_box))
    z = device.render_depth(occluders, camera).numpy(kind="z")
    image: npt.NDArray[np.uint16] = np.minimum(np.rint(100.0 * z), 65535.0).astype(np.uint16)
    return image  # the sky is 65535


def main() -> None:
    """Reads a frame, culls its boxes, and compares levels with the labels'."""
    device = hizvk.Device()
    camera = read_camera(DATA / "kitti_calib.txt")
    names, levels, boxes = read_labels(DATA / "kitti_label.txt")
    image = depth_image(device, camera, boxes)
    # Rounding moves a depth by half a centimetre at most.
    half = hizvk.Tolerance(abs=0.005)
    hiz = device.pyramid(image, camera, kind="z", scale=0.01, tolerance=half)
    # Data sets count pixels' centres; a box is asked pixel by pixel, with its depth in each.
    exactly = hizvk.CullOptions(coverage="sample", descent=4096, fit="volume")
    seen = device.cull(device.instances(boxes), camera, hiz, exactly, ["mask", "pixels"])
    fractions = seen.visible_fraction()
    found = (fractions[:, None] < LEVELS).sum(axis=1)
    for name, level, fraction in zip(names, found, fractions, strict=True):
        print(f"{name:10} {fraction:4.0%} visible, occluded {level}")
    print(f"kept {seen.count} of {len(boxes)}; {(found == levels).sum()} levels as labelled")


if __name__ == "__main__":
    main()
