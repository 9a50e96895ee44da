"""Turitzin's table of timings: ways to make levels of two eyes of 1648 x 1776 pixels.

Source: Mike Turitzin, *Hierarchical Depth Buffers*, 2020.
He times a chain of fragment passes against one dispatch for level 4 alone, in six shapes.

``python -m hizvk.methods.turitzin`` prints the table.
Each row is compared bit for bit with NumPy, and timed in turns with the others.
The time is that of one submission for both eyes, by the clock on the wall, less a wait for nothing.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from ..device import Device
from .levels import SHAPES, MethodLevels

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt

    from .._arguments import Size

    _Image: TypeAlias = npt.NDArray[np.float32]

__all__ = ["SIZE", "Row", "main", "measure", "table"]

#: Height and width of an eye.
SIZE: Final = (1776, 1648)
REPETITIONS: Final = 9
#: The level that he needs, and pixels along a side of its texels.
LEVEL: Final = 4
TILE: Final = 1 << LEVEL
#: What lies between the eyes, and in front of them, in metres.
EYES: Final = 0.064
NEAR: Final = 0.1


@dataclass(frozen=True)
class Row:
    """One way."""

    label: str
    levels: str
    """Which ones it makes."""
    loads: int | None
    """Pixels that an invocation loads, where level 4 is made alone."""
    is_exact: bool
    """Whether every texel of every level has the bits that NumPy finds."""
    ms: float
    """The median, for both eyes."""


def eyes(size: Size = SIZE) -> list[_Image]:
    """Two depth images of waves over a plane, in reversed depth, with sky at the top."""
    height, width = size
    x, y = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
    found = []
    for shift in (-EYES / 2, EYES / 2):
        distance = 3.0 + 2.0 * np.sin(9.0 * (x + shift)) * np.cos(7.0 * y) + 4.0 * np.abs(y)
        found.append(np.where(y < -0.8, 0.0, NEAR / distance).astype(np.float32))
    return found


def farthest_blocks(image: _Image, level: int) -> _Image:
    """The least depth of each block of ``2^level`` pixels a side; the last ones may be cut off."""
    step = 1 << level
    rows, columns = np.arange(0, image.shape[0], step), np.arange(0, image.shape[1], step)
    return np.asarray(np.minimum.reduceat(np.minimum.reduceat(image, rows), columns, axis=1))


def floor_chain(image: _Image) -> list[_Image]:
    """All levels, with sides halved and rounded down; a texel of an odd side takes three."""
    levels = [image]
    while levels[-1].size > 1:
        fine = levels[-1]
        for axis in (0, 1):
            side = fine.shape[axis]
            count = max(side // 2, 1)
            taps = [
                np.take(fine, np.minimum(2 * np.arange(count) + k, side - 1), axis=axis)
                for k in range(2 + side % 2)
            ]
            fine = np.minimum.reduce(taps)
        levels.append(fine)
    return levels


def _same(a: _Image, b: _Image) -> bool:
    return a.shape == b.shape and bool((a.view(np.uint32) == b.view(np.uint32)).all())


def measure(device: Device, *, size: Size = SIZE, repetitions: int = REPETITIONS) -> list[Row]:
    """All ways, each compared with NumPy and timed in turns.

    Parameters
    ----------
    device : Device
        Where.
    size : (height, width)
        Of an eye.
    repetitions : int
        How often each is timed.
    """
    images = eyes(size)
    floors = [floor_chain(image) for image in images]
    blocks = [
        [farthest_blocks(image, k) for k in range(max(size).bit_length() + 1)] for image in images
    ]
    made: list[tuple[MethodLevels, str, str, int | None, bool]] = []

    def add(
        label: str,
        levels: range,
        way: MethodLevels,
        expected: Sequence[Sequence[_Image]],
        loads: int | None = None,
    ) -> None:
        way.run()
        exact = all(
            _same(way.level(eye, k), of_eye[k])
            for eye, of_eye in enumerate(expected)
            for k in levels
        )
        told = str(levels[0]) if len(levels) == 1 else f"{levels[0]} to {levels[-1]}"
        made.append((way, label, told, loads, exact))

    all_floors, alone = range(1, len(floors[0])), range(LEVEL, LEVEL + 1)
    last = (max(size) - 1).bit_length()
    add("fragment passes", all_floors, MethodLevels(device, "fragment", images), floors)
    add("compute chain (hizvk, mips)", all_floors, MethodLevels(device, "mips", images), floors)
    for label, first, end in (
        ("compute chain (hizvk, pyramid)", 1, last),
        ("levels 1 to 4 (hizvk)", 1, LEVEL),
        ("level 4 alone (hizvk)", LEVEL, LEVEL),
    ):
        way = MethodLevels(device, "pyramid", images, levels=(first, end))
        add(label, range(first, end + 1), way, blocks)
    for shape in SHAPES:
        loads = TILE * TILE // (shape[0] * shape[1])
        way = MethodLevels(device, "atomic", images, shape=shape)
        add(f"level 4 alone, atomic, {shape[0]}x{shape[1]}", alone, way, blocks, loads)
    add("level 4 alone, tree, 16x16", alone, MethodLevels(device, "tree", images), blocks, 1)

    ms = np.empty((len(made), repetitions))
    empty = np.empty(repetitions)
    for repetition in range(repetitions):
        empty[repetition] = _took(device.wait)
        for turn in range(len(made)):
            number = (turn + repetition) % len(made)
            ms[number, repetition] = _took(made[number][0].run)
    return [
        Row(label, levels, loads, exact, float(np.median(of_way - empty)))
        for (_, label, levels, loads, exact), of_way in zip(made, ms, strict=True)
    ]


def _took(run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    return 1000.0 * (time.perf_counter() - start)


def table(rows: Sequence[Row]) -> list[str]:
    """The rows as lines of Markdown."""
    lines = ["| way | levels | loads | bit-exact | ms for two eyes |", "|---|---|---:|---|---:|"]
    for row in rows:
        loads = "" if row.loads is None else str(row.loads)
        exact = "yes" if row.is_exact else "no"
        lines.append(f"| {row.label} | {row.levels} | {loads} | {exact} | {row.ms:.2f} |")
    return [line.replace("|  |", "| |") for line in lines]


def main(arguments: Sequence[str] | None = None) -> int:
    """Prints the table; exit code 1: a row was not exact."""
    parser = argparse.ArgumentParser(
        prog="python -m hizvk.methods.turitzin",
        description="Times the ways to make levels of two depth images, and checks their bits.",
    )
    parser.add_argument("--repetitions", type=int, default=REPETITIONS, help="of each time")
    parser.add_argument("--quick", action="store_true", help="images of a quarter of the sides")
    parsed = parser.parse_args(arguments)
    device = Device()
    size = (SIZE[0] // 4, SIZE[1] // 4) if parsed.quick else SIZE
    rows = measure(device, size=size, repetitions=parsed.repetitions)
    print(f"two images of {size[1]} x {size[0]} on {device.adapter}")
    print("\n".join(table(rows)))
    return 0 if all(row.is_exact for row in rows) else 1


if __name__ == "__main__":
    from ..commands import pipes

    sys.exit(pipes.run(main))
