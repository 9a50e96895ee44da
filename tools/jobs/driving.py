"""Boxes of a driving frame: which show, and how much of each (docs/jobs/driving.md)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

import hizvk

from .table import best_ms, load, print_table

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["measure", "truth"]

Floats = npt.NDArray[np.float64]
#: What a corner or a surface may lie behind a pixel's depth, as scripts for CARLA allow it.
ALLOWED = 0.5


@dataclass(frozen=True)
class Frame:
    """Boxes and depth as the ways take them, all in the camera's axes."""

    boxes: hizvk.OrientedBoxes
    camera: hizvk.Camera
    image: npt.NDArray[np.uint16]
    z: Floats
    """View depth in metres, infinite where there is none."""
    k: Floats
    corners: Floats
    """``(N, 8, 3)``"""
    is_shown: bool
    """Whether the boxes are in the depth image."""


def frame(device: hizvk.Device, boxes: hizvk.OrientedBoxes | None = None) -> Frame:
    """The street of the example, or other boxes before its depth image."""
    example, data = load("examples/driving_boxes.py"), load("scripts/example_data.py")
    camera = example.read_camera(example.DATA / "kitti_calib.txt")
    _, _, labelled = example.read_labels(example.DATA / "kitti_label.txt")
    image = example.depth_image(device, camera, labelled)
    boxes = labelled if boxes is None else boxes
    k = data.P2[:, :3]
    eye = -np.linalg.inv(k) @ data.P2[:, 3]
    sides = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    local = sides * boxes.half_sizes[:, None]
    corners = local @ boxes.rotations.transpose(0, 2, 1) + (boxes.centers - eye)[:, None]
    z = np.where(image < 65535, image * 0.01, np.inf)
    return Frame(boxes, camera, image, z, k, corners, boxes is labelled)


def by_corners(of: Frame) -> Floats:
    """The share of each box's corners that no pixel is in front of: how scripts for CARLA do it."""
    at = of.corners @ of.k.T
    before = at[..., 2] > 0.1
    column, row = (np.rint(at[..., j] / np.where(before, at[..., 2], 1.0)) for j in (0, 1))
    height, width = of.z.shape
    inside = before & (column >= 0) & (column < width) & (row >= 0) & (row < height)
    column, row = (np.where(inside, which, 0).astype(int) for which in (column, row))
    shares: Floats = (inside & (at[..., 2] < of.z[row, column] + ALLOWED)).mean(axis=1)
    return shares


def rectangles(of: Frame) -> npt.NDArray[np.int64]:
    """First and last row and column of the pixels that each box may touch; none behind the eye."""
    at = of.corners @ of.k.T
    depth = at[..., 2]
    pixels = at[..., :2] / np.where(depth > 0.1, depth, np.nan)[..., None]
    low, high = np.floor(pixels.min(axis=1)), np.ceil(pixels.max(axis=1))
    height, width = of.z.shape
    behind = np.isnan(low).any(axis=1)
    low, high = np.nan_to_num(low), np.nan_to_num(high)
    found = np.stack([low[:, 1], high[:, 1], low[:, 0], high[:, 0]], axis=1)
    last = [height - 1, height - 1, width - 1, width - 1]
    clipped: npt.NDArray[np.int64] = np.clip(found, 0, last).astype(np.int64)
    clipped[behind] = (0, -1, 0, -1)
    return clipped


def by_pixels(of: Frame) -> Floats:
    """The share of each box's pixels that it owns, with NumPy: one crop per box."""
    fractions = np.zeros(len(of.boxes))
    inverse = np.linalg.inv(of.k)
    centers = of.corners.mean(axis=1)
    for i, (top, bottom, left, right) in enumerate(rectangles(of)):
        row, column = np.mgrid[top : bottom + 1, left : right + 1]
        turn, half = of.boxes.rotations[i], of.boxes.half_sizes[i]
        rays = np.stack([column, row, np.ones_like(row)], axis=-1) @ (inverse.T @ turn)
        start = -centers[i] @ turn
        with np.errstate(divide="ignore", invalid="ignore"):
            at = np.stack([(-half - start) / rays, (half - start) / rays])
        enter, leave = at.min(axis=0).max(axis=-1), at.max(axis=0).min(axis=-1)
        covers = (enter < leave) & (enter > 0)
        shows = covers & (enter <= of.z[top : bottom + 1, left : right + 1] + 0.005)
        fractions[i] = shows.sum() / max(covers.sum(), 1)
    return fractions


def compiled() -> Callable[..., Any] | None:
    """`by_pixels` as loops that numba compiles; None where it is not installed."""
    try:
        from numba import njit
    except ImportError:
        return None

    @njit
    def loops(rectangles: Any, starts: Any, to_box: Any, halves: Any, z: Any, out: Any) -> None:
        for i in range(len(rectangles)):
            top, bottom, left, right = rectangles[i]
            covers = shows = 0
            for row in range(top, bottom + 1):
                for column in range(left, right + 1):
                    enter, leave = 0.0, np.inf
                    for axis in range(3):
                        m = to_box[i, axis]
                        along = m[0] * column + m[1] * row + m[2]
                        if along == 0.0:
                            along = 1e-300
                        a = (-halves[i, axis] - starts[i, axis]) / along
                        b = (halves[i, axis] - starts[i, axis]) / along
                        enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
                    if enter < leave and enter > 0.0:
                        covers += 1
                        shows += enter <= z[row, column] + 0.005
            out[i] = shows / max(covers, 1)

    kept: Callable[..., Any] = loops
    return kept


def truth() -> Floats:
    """Visible fractions of the labelled boxes, by rays in float64 and without a depth image."""
    example, data = load("examples/driving_boxes.py"), load("scripts/example_data.py")
    lines = (example.DATA / "kitti_label.txt").read_text(encoding="utf-8").splitlines()
    rows = [np.array(line.split()[8:15], float) for line in lines if line[:4] != "Dont"]
    fractions: Floats = np.array([fraction for fraction, _ in data.fractions(rows)])
    return fractions


def ways(device: hizvk.Device, of: Frame) -> dict[str, Callable[[], Floats]]:
    """Each way of getting visible fractions, by name."""
    half, options = hizvk.Tolerance(abs=0.005), hizvk.CullOptions(coverage="sample")
    exactly = hizvk.CullOptions(coverage="sample", descent=4096, fit="volume")
    resident = device.instances(of.boxes)
    pyramid = device.pyramid(of.image, of.camera, kind="z", scale=0.01, tolerance=half)

    def call() -> Floats:
        hiz = device.pyramid(of.image, of.camera, kind="z", scale=0.01, tolerance=half)
        seen = device.cull(device.instances(of.boxes), of.camera, hiz, exactly, ["pixels"])
        return seen.visible_fraction(objects_in_depth=of.is_shown)

    def counts() -> Floats:
        seen = device.cull(resident, of.camera, pyramid, exactly, ["pixels"])
        return seen.visible_fraction(objects_in_depth=of.is_shown)

    def mask(how: hizvk.CullOptions) -> Floats:
        return device.cull(resident, of.camera, pyramid, how, ["mask"]).mask.astype(float)

    found: dict[str, Callable[[], Floats]] = {
        "corners, NumPy": lambda: by_corners(of),
        "every pixel, NumPy": lambda: by_pixels(of),
    }
    loops = compiled()
    if loops is not None:
        kept: Callable[..., Any] = loops

        def numba() -> Floats:
            out = np.zeros(len(of.boxes))
            from_world = of.boxes.rotations.transpose(0, 2, 1)
            starts = (from_world @ -of.corners.mean(axis=1)[..., None])[..., 0]
            to_box = from_world @ np.linalg.inv(of.k)
            kept(rectangles(of), starts, to_box, of.boxes.half_sizes, of.z, out)
            return out

        found["every pixel, numba"] = numba
    return found | {
        "hizvk, one call with uploads": call,
        "hizvk, counts of what is uploaded": counts,
        "hizvk, mask by every pixel": lambda: mask(exactly),
        "hizvk, mask by 2x2 texels": lambda: mask(options),
    }


def crowd(count: int) -> hizvk.OrientedBoxes:
    """Boxes as large as cars and people, all over the street."""
    random = np.random.default_rng(count)
    centers = random.uniform((-30.0, 0.0, 4.0), (30.0, 1.6, 120.0), (count, 3))
    halves = random.uniform((0.3, 0.5, 0.3), (2.2, 1.0, 1.0), (count, 3))
    return hizvk.OrientedBoxes.from_yaw(
        centers, halves, random.uniform(0.0, 360.0, count), up=(0, 1, 0)
    )


def accuracy(device: hizvk.Device) -> list[list[str]]:
    """What each way says of the labelled boxes, beside the truth: a row per way."""
    exact, of = truth(), frame(device)
    rows = []
    for name, way in ways(device, of).items():
        found = way()
        missed = ((exact > 0) & (found == 0)).sum()
        vain = ((exact == 0) & (found > 0)).sum()
        has_fractions = "mask" not in name
        error = f"{np.abs(found - exact).mean():.3f}" if has_fractions else ""
        rows.append([name, f"{missed}", f"{vain}", error])
    return rows


def measure(device: hizvk.Device, rounds: int, counts: tuple[int, ...]) -> None:
    """Prints what is found, and what it costs for the frame and for crowds."""
    exact = truth()
    print(f"{len(exact)} boxes, of which {(exact > 0).sum()} show:\n")
    print_table(["way", "missed", "kept in vain", "error of fraction"], accuracy(device))
    columns = [best_ms(ways(device, frame(device)), rounds)]
    columns += [best_ms(ways(device, frame(device, crowd(n))), rounds) for n in counts]
    head = ["milliseconds", f"{len(exact)} boxes", *(f"{n:,} boxes" for n in counts)]
    print_table(head, [[name, *(f"{c[name]:.1f}" for c in columns)] for name in columns[0]])
