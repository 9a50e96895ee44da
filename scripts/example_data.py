#!/usr/bin/env python3
"""Writes the files in examples/data: a street of KITTI, cameras of COLMAP, a town in CityJSON.

The street's levels of occlusion are by rays in float64, which share nothing with the library.
`tests/test_jobs.py` compares the files with what this script makes.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt

DATA = Path(__file__).resolve().parents[1] / "examples" / "data"

# -- the street ------------------------------------------------------------------------------------

SIZE = (375, 1242)
#: Of the left colour camera; the last column is K times the offset to camera 0.
P2 = np.array([[718.0, 0.0, 609.5, 43.9], [0.0, 718.0, 173.0, 0.2], [0.0, 0.0, 1.0, 0.003]])
#: The camera is this high above the road.
EYE = 1.65
#: Height, width and length of each type, in metres.
TYPES = {
    "Car": (1.5, 1.65, 4.1),
    "Van": (2.2, 1.9, 5.2),
    "Truck": (3.4, 2.6, 10.0),
    "Pedestrian": (1.75, 0.65, 0.8),
    "Cyclist": (1.75, 0.6, 1.8),
}
Floats = npt.NDArray[np.float64]


def objects(random: np.random.Generator) -> list[tuple[str, Floats]]:
    """Types, and height, width, length, x, y, z, rotation_y as the file rounds them."""
    along, across = -np.pi / 2, 0.0  # lengths point along z, or along x
    placed = [("Truck", -3.6, 24.0, along), ("Van", 3.4, 17.0, along), ("Car", 0.4, 30.0, along)]
    placed += [("Car", -9.5, 36.0, across), ("Cyclist", -2.0, 14.0, along)]
    for side in (-1, 1):
        for k in range(9):
            kind = "Van" if random.random() < 0.25 else "Car"
            # Parked in a row with gaps, each a little askew.
            placed.append((kind, side * 5.6, 9.0 + 6.4 * k, along + random.normal(0, 0.03)))
        for _ in range(8):
            place = side * random.uniform(7.4, 8.6), random.uniform(10.0, 55.0)
            placed.append(("Pedestrian", *place, random.uniform(-np.pi, np.pi)))
    rows = []
    for kind, x, z, turn in placed:
        size = np.array(TYPES[kind]) * random.uniform(0.94, 1.06)
        place = [x + random.normal(0, 0.1), EYE, z + random.normal(0, 0.3)]
        rows.append((kind, np.round([*size, *place, turn], 2)))
    return rows


def corners_of(row: Floats) -> Floats:
    """``(8, 3)``: KITTI's location is the middle of the lower face, and y is down."""
    height, width, length, x, y, z, turn = row
    sides = np.array([(a, b, c) for a in (-0.5, 0.5) for b in (-1, 0) for c in (-0.5, 0.5)])
    local = sides * (length, height, width)
    cos, sin = np.cos(turn), np.sin(turn)
    return local @ np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]).T + (x, y, z)


def entry(row: Floats) -> tuple[tuple[slice, slice], Floats]:
    """The pixels around a box, and where each one's ray enters it: inf where it misses."""
    height, width, length, *place, turn = row
    at_image = corners_of(row) @ P2[:, :3].T + P2[:, 3]
    pixels = at_image[:, :2] / at_image[:, 2:]
    first = np.clip(np.floor(pixels.min(axis=0)) - 2, 0, (SIZE[1], SIZE[0])).astype(int)
    last = np.clip(np.ceil(pixels.max(axis=0)) + 3, 0, (SIZE[1], SIZE[0])).astype(int)
    part = slice(first[1], last[1]), slice(first[0], last[0])
    v, u = np.mgrid[part]
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(P2[:, :3]).T
    eye = -np.linalg.inv(P2[:, :3]) @ P2[:, 3]
    cos, sin = np.cos(turn), np.sin(turn)
    box_from_world = np.array([[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]])
    low = np.array([-length / 2, -height, -width / 2])
    local, start = rays @ box_from_world.T, box_from_world @ (eye - place)
    with np.errstate(divide="ignore"):
        at = np.stack([(low - start) / local, (low * (-1, 0, -1) - start) / local])
    enter, leave = at.min(axis=0).max(axis=-1), at.max(axis=0).min(axis=-1)
    return part, np.where((enter < leave) & (enter > 0), enter, np.inf)


def fractions(rows: list[Floats]) -> list[tuple[float, int]]:
    """Of each box, the share of its pixels that it owns, and how many it would have alone."""
    nearest = np.full(SIZE, np.inf)
    for part, enter in (entry(row) for row in rows):
        nearest[part] = np.minimum(nearest[part], enter)
    found = []
    for part, enter in (entry(row) for row in rows):
        alone = np.isfinite(enter)
        owned = (alone & (enter == nearest[part])).sum()
        found.append((float(owned / max(alone.sum(), 1)), int(alone.sum())))
    return found


def street() -> dict[str, str]:
    """Calibration and labels, as the files of KITTI's object benchmark."""
    things = objects(np.random.default_rng(59))
    lines = []
    seen = fractions([row for _, row in things])
    for (kind, row), (fraction, alone) in zip(things, seen, strict=True):
        if alone < 40:
            continue  # it lies outside of the image
        level = sum(fraction < end for end in (0.95, 0.5, 1e-9))
        at_image = corners_of(row) @ P2[:, :3].T + P2[:, 3]
        pixels = at_image[:, :2] / at_image[:, 2:]
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        kept_low, kept_high = np.maximum(low, 0), np.minimum(high, (SIZE[1] - 1, SIZE[0] - 1))
        truncated = 1 - np.prod(kept_high - kept_low) / np.prod(high - low)
        alpha = (row[6] - np.arctan2(row[3], row[5]) + np.pi) % (2 * np.pi) - np.pi
        numbers = [alpha, *kept_low, *kept_high, *row]
        lines.append(f"{kind} {truncated:.2f} {level} " + " ".join(f"{n:.2f}" for n in numbers))
    lines.append("DontCare -1 -1 -10 590.00 168.00 640.00 184.00 -1 -1 -1 -1000 -1000 -1000 -10")
    row = " ".join(f"{n:.12e}" for n in P2.ravel())
    other = " ".join(f"{n:.12e}" for n in np.c_[P2[:, :3], np.zeros(3)].ravel())
    turn = " ".join(f"{n:.12e}" for n in np.eye(3).ravel())
    velodyne = " ".join(f"{n:.12e}" for n in (0, -1, 0, -0.004, 0, 0, -1, -0.076, 1, 0, 0, -0.272))
    unit = " ".join(f"{n:.12e}" for n in np.eye(4)[:3].ravel())
    calibration = [f"P{k}: {row if k == 2 else other}" for k in range(4)]
    calibration += [f"R0_rect: {turn}", f"Tr_velo_to_cam: {velodyne}", f"Tr_imu_to_velo: {unit}"]
    return {
        "kitti_calib.txt": "\n".join(calibration) + "\n",
        "kitti_label.txt": "\n".join(lines) + "\n",
    }


# -- the garden wall -------------------------------------------------------------------------------


def quaternion(turn: Floats) -> Floats:
    """w, x, y, z of a matrix whose w is not 0."""
    w = np.sqrt(1.0 + np.trace(turn)) / 2
    x, y, z = turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]
    return np.array([w, *np.array([x, y, z]) / (4 * w)])


def wall_photographs() -> dict[str, str]:
    """Ten posed photographs of a wall, five from each side: COLMAP's text files."""
    cameras = [
        "# Camera list with one line of data per camera:",
        "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]",
        "# Number of cameras: 1",
        "1 PINHOLE 320 240 208.0 208.0 160.0 120.0",
    ]
    images = [
        "# Image list with two lines of data per image:",
        "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME",
        "#   POINTS2D[] as (X, Y, POINT3D_ID)",
        "# Number of images: 10, mean observations per image: 0",
    ]
    for side, z in (("front", 7.0), ("back", -7.0)):
        for k, x in enumerate((-6.0, -3.0, 0.1, 3.0, 6.0)):
            eye = np.array([x, 1.0, z])
            forward = -eye / np.linalg.norm(eye)
            right = np.cross(forward, (0.0, 1.0, 0.0))
            right /= np.linalg.norm(right)
            turn = np.array([right, np.cross(forward, right), forward])  # right, down, forward
            pose = [*quaternion(turn), *(-turn @ eye)]
            numbers = " ".join(f"{n:.9f}" for n in pose)
            images += [f"{len(images) // 2 - 1} {numbers} 1 {side}_{k}.jpg", ""]
    return {
        "colmap_cameras.txt": "\n".join(cameras) + "\n",
        "colmap_images.txt": "\n".join(images) + "\n",
    }


# -- the town --------------------------------------------------------------------------------------

#: Metres in a national grid; z is up.
ORIGIN = (85_000.0, 446_500.0, 2.0)
#: Vertices are whole millimetres.
STEP = 0.001
Surface = tuple[str, list[list[tuple[float, float, float]]]]


def walls(ring: list[tuple[float, float]], top: float) -> list[Surface]:
    """The ground below a counter-clockwise ring, and a wall above each of its sides."""
    ground = [(x, y, 0.0) for x, y in reversed(ring)]
    found: list[Surface] = [("GroundSurface", [ground])]
    for (ax, ay), (bx, by) in zip(ring, [*ring[1:], ring[0]], strict=True):
        sides = [(ax, ay, 0.0), (bx, by, 0.0), (bx, by, top), (ax, ay, top)]
        found.append(("WallSurface", [sides]))
    return found


def gabled(
    x: float, y: float, width: float, depth: float, top: float, rise: float
) -> list[Surface]:
    """A house whose ridge runs along y."""
    ring = [(x, y), (x + width, y), (x + width, y + depth), (x, y + depth)]
    found = walls(ring, top)
    ridge = [(x + width / 2, at, top + rise) for at in (y, y + depth)]
    # The walls at both ends of the ridge are pentagons.
    for number, end in ((1, 0), (3, 1)):
        (a, b, c, d) = found[number][1][0]
        found[number] = ("WallSurface", [[a, b, c, ridge[end], d]])
    low = [(px, py, top) for px, py in ring]
    found.append(("RoofSurface", [[low[1], low[2], ridge[1], ridge[0]]]))
    found.append(("RoofSurface", [[low[3], low[0], ridge[0], ridge[1]]]))
    return found


def angled(x: float, y: float, size: float, top: float) -> list[Surface]:
    """A hall like an L, with a flat roof: ground and roof are not convex."""
    half = size / 2
    ring = [(x, y), (x + size, y), (x + size, y + half), (x + half, y + half)]
    ring += [(x + half, y + size), (x, y + size)]
    return [*walls(ring, top), ("RoofSurface", [[(px, py, top) for px, py in ring]])]


def tower(x: float, y: float, size: float, top: float, rise: float) -> list[Surface]:
    """A tower with a pointed roof."""
    ring = [(x, y), (x + size, y), (x + size, y + size), (x, y + size)]
    point = (x + size / 2, y + size / 2, top + rise)
    roof: list[Surface] = [
        ("RoofSurface", [[(*a, top), (*b, top), point]])
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)
    ]
    return [*walls(ring, top), *roof]


def gate(x: float, y: float, width: float, top: float) -> list[Surface]:
    """A wall of 1 m with an opening, which is an inner ring of both of its faces."""
    found = walls([(x, y), (x + width, y), (x + width, y + 1), (x, y + 1)], top)
    left, right = x + width / 2 - 2, x + width / 2 + 2
    for number, at in ((1, y), (3, y + 1)):
        hole = [(left, at, 0.5), (left, at, 3.5), (right, at, 3.5), (right, at, 0.5)]
        found[number][1].append(hole if number == 1 else hole[::-1])
    roof = [(px, py, top) for px, py in ((x, y), (x + width, y), (x + width, y + 1), (x, y + 1))]
    return [*found, ("RoofSurface", [roof])]


def town() -> dict[str, str]:
    """Streets of houses about a square of 40 m, with a church, halls and a gate: CityJSON 2.0."""
    random = np.random.default_rng(3)
    buildings: dict[str, list[Surface]] = {
        "church-tower": tower(-5.0, 24.0, 8.0, 32.0, 14.0),
        "church-nave": gabled(-6.0, 32.0, 10.0, 24.0, 11.0, 7.0),
        "gate": gate(-8.0, -46.0, 16.0, 6.0),
    }
    for row, at in enumerate((-90.0, -70.0, -42.0, 22.0, 62.0, 82.0)):
        for column, left in enumerate(range(-90, 90, 15)):
            blocks_church = -21 < left < 9 and 20 < at < 60
            blocks_gate = -22 < left < 9 and at == -42.0
            if blocks_church or blocks_gate:
                continue
            name = f"house-{row}{column:02d}"
            x, y = left + random.uniform(0, 2), at + random.uniform(0, 2)
            if random.random() < 0.15:
                buildings[name.replace("house", "hall")] = angled(x, y, 12.0, random.uniform(5, 8))
            else:
                width, depth = random.uniform(9, 12), random.uniform(10, 14)
                top, rise = random.uniform(5, 9), random.uniform(2, 4)
                buildings[name] = gabled(x, y, width, depth, top, rise)
    numbers: dict[tuple[int, ...], int] = {}
    kinds = ("GroundSurface", "WallSurface", "RoofSurface")
    things = {}
    for name, surfaces in buildings.items():
        shell = []
        for _, rings in surfaces:
            at_step = [[tuple(round(v / STEP) for v in p) for p in ring] for ring in rings]
            shell.append([[numbers.setdefault(p, len(numbers)) for p in ring] for ring in at_step])
        values = [kinds.index(kind) for kind, _ in surfaces]
        semantics = {"surfaces": [{"type": kind} for kind in kinds], "values": [values]}
        geometry = {"type": "Solid", "lod": "2.2", "boundaries": [shell], "semantics": semantics}
        things[name] = {
            "type": "Building",
            "attributes": {"function": name.partition("-")[0]},
            "geometry": [geometry],
        }
    found = {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [STEP] * 3, "translate": list(ORIGIN)},
        "metadata": {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/7415"},
        "CityObjects": things,
        "vertices": [list(p) for p in numbers],
    }
    return {"town.city.json": json.dumps(found, separators=(",", ":")) + "\n"}


def files() -> dict[str, str]:
    """Every file of the folder, by name."""
    return street() | wall_photographs() | town()


def main() -> int:
    """Writes them."""
    DATA.mkdir(exist_ok=True)
    for name, text in files().items():
        (DATA / name).write_text(text, encoding="utf-8")
        print(f"{DATA / name}: {len(text)} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
