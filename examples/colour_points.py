"""Colours a point cloud from posed photographs: each point by the images that see it.

A garden wall was scanned on both faces; it is red in front and blue behind.
COLMAP's text files say where ten photographs were taken.
Without their depth each point would get both colours, and be purple.

With a path, as in ``colour_points.py wall.ply``, the coloured cloud is saved for a viewer.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import hizvk

DATA = Path(__file__).parent / "data"
RED, BLUE = (200, 30, 30), (30, 30, 200)
COLUMNS = ("float x", "float y", "float z", "uchar red", "uchar green", "uchar blue")
HALF = np.array([4.0, 2.0, 0.2])  # the wall is 8 m wide, 4 m high and 40 cm thick


def read_views() -> dict[str, hizvk.Camera]:
    """The camera of each photograph, by its file's name."""
    files = [DATA / f"colmap_{name}.txt" for name in ("cameras", "images")]
    lines = [path.read_text().splitlines() for path in files]
    cameras, images = [[line.split() for line in of if line[:1] != "#"] for of in lines]
    models = {row[0]: row[1:] for row in cameras}
    views = {}
    for _, *pose, camera, name in images[::2]:  # every second line has an image's points
        model, width, height, *params = models[camera]
        turn, move = np.split(np.array(pose, float), [4])
        size = (int(height), int(width))
        views[name] = hizvk.Camera.from_colmap(
            model, np.array(params, float), qvec=turn, tvec=move, size=size, near=0.1
        )
    return views


def wall() -> hizvk.Mesh:
    """What the dense stage makes of the photographs; a scanner's mesh will do."""
    corners = HALF * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return hizvk.Mesh(corners, [[a, *two] for a, b, c, d in sides for two in ((b, c), (c, d))])


def write_ply(path: Path, positions: npt.NDArray[Any], colours: npt.NDArray[np.uint8]) -> None:
    """A coloured cloud for MeshLab, CloudCompare or Open3D."""
    rows = np.rec.fromarrays([*positions.astype("<f4").T, *colours.T])
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    head += [f"property {of}" for of in COLUMNS]
    path.write_bytes("\n".join([*head, "end_header\n"]).encode() + rows.tobytes())


def main() -> None:
    """Colours 50,000 points from ten photographs."""
    positions = HALF * np.random.default_rng(5).uniform(-0.99, 0.99, (50_000, 3))
    is_front = np.arange(len(positions)) % 2 == 0
    positions[:, 2] = np.where(is_front, HALF[2], -HALF[2])
    device = hizvk.Device()
    mesh = device.occluders(wall())
    views = []
    for name, camera in read_views().items():
        photograph = np.full((*camera.size, 3), RED if "front" in name else BLUE, np.uint8)
        views.append((camera, device.render_depth(mesh, camera).numpy(), photograph))
    some = hizvk.Tolerance(abs=0.001)  # points and depth were rounded to float32
    cloud = hizvk.Points(positions.astype(np.float32))
    seen = hizvk.colour_points(cloud, views, kind="reversed_ndc", tolerance=some, device=device)
    if len(sys.argv) > 1:
        write_ply(Path(sys.argv[1]), cloud.positions, seen.bytes())
    truth = np.where(is_front[:, None], RED, BLUE)
    right = (seen.bytes() == truth).all(axis=1)
    mixed = (seen.colours[:, 0] > 31) & (seen.colours[:, 2] > 31)
    print(f"red or blue as they are: {right.mean():.1%}; of both colours: {mixed.sum()}")


if __name__ == "__main__":
    print(__doc__) if "--help" in sys.argv else main()
