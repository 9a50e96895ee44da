"""``hizvk bench --tiling``: coverage bits in BSP order beside the tiles with depth.

Source: Greene (1996); see `hizvk.BspTiling`.
report.json holds ``{command, seed, adapter, versions, seconds, missing, rows}``.
`Row` says what the numbers are.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .._core import DepthTiles
from ..commands import arguments as args
from ..commands import report
from ..commands.page import Page
from ..device import Device
from ..methods import BspTiling
from ..scenes import village
from ..scenes.boulders import boulders
from . import catalogue, frame

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from .._arguments import Size
    from ..progress import Progress
    from ..scenes import Scene

__all__ = ["NAMES", "Report", "Row", "image_cells", "main", "run", "tree_cells"]

PROG: Final = "hizvk bench --tiling"
NAMES: Final = ("village", "boulders", "city", "room", "mountains")
VIEWS: Final = 4
SIZE: Final = (360, 640)
REPETITIONS: Final = 5
#: An octree's leaves, beside one tree.
LEAF: Final = 64
#: One tree with more parts per triangle is given up.
MOST_PARTS: Final = 8.0


@dataclass(frozen=True)
class Row:
    """One tree on one scene."""

    key: str
    triangles: int
    tree: str
    """``"one tree"`` or ``"octree"``."""
    parts: int
    """Triangles and parts of split ones."""
    nodes: int
    tree_bytes: int
    build_s: float
    same: bool
    """Whether the coverage of each view is that of the depth tiles bit for bit."""
    visible: int
    """Triangles that are seen in a view, on the average."""
    tiled: int
    """Parts that were tiled in a view, on the average."""
    bits_ms: float
    """A view by coverage bits, one thread; the least of `REPETITIONS`."""
    depth_ms: float
    """A view by depth tiles, one thread."""
    bits_bytes: int
    """The pyramid of coverage bits."""
    depth_bytes: int
    """The depth tiles."""


@dataclass
class Report(frame.Run):
    """A run over all scenes."""

    size: Size = SIZE
    rows: list[Row] = field(default_factory=list)

    @property
    def passed(self) -> bool:
        """Whether something was measured, and all coverage is the same."""
        return bool(self.rows) and all(row.same for row in self.rows)

    def page(self) -> Page:
        """The tables."""
        page = Page(PROG)
        height, width = self.size
        page.items(*self.opening())
        page.heading("Trees")
        page.table(TREES, (tree_cells(row) for row in self.rows), left=2)
        page.heading(f"Images of {width}x{height}, one thread")
        page.table(IMAGES, (image_cells(row) for row in self.rows), left=2)
        return page


TREES: Final = "scene | tree | triangles | parts | planes | tiled | seen | MiB, tree"
IMAGES: Final = (
    "scene | tree | same coverage | ms, bits | ms, depth tiles | ratio | KiB, bits | "
    "KiB, depth tiles | seconds to build"
)


def tree_cells(row: Row) -> list[str]:
    """A row of the table of trees, whose numbers repeat with the seed."""
    return [
        row.key,
        row.tree,
        f"{row.triangles:,}",
        f"{row.parts / max(row.triangles, 1):.2f} x",
        f"{row.nodes:,}",
        f"{row.tiled:,}",
        f"{row.visible:,}",
        f"{row.tree_bytes / 2**20:.1f}",
    ]


def image_cells(row: Row) -> list[str]:
    """A row of the table of images."""
    return [
        row.key,
        row.tree,
        "yes" if row.same else "NO",
        f"{row.bits_ms:.2f}",
        f"{row.depth_ms:.2f}",
        f"{row.bits_ms / row.depth_ms:.1f}",
        f"{row.bits_bytes / 1024:.0f}",
        f"{row.depth_bytes / 1024:.0f}",
        f"{row.build_s:.2f}",
    ]


def run(
    out: Path,
    *,
    keys: Sequence[str] = NAMES,
    seed: int = 1996,
    views: int | None = None,
    size: Size | None = None,
    command: str = PROG,
) -> Report:
    """Leaves report.md and report.json in `out`.

    Parameters
    ----------
    out : Path
        A folder; made if it is not there.
    keys : sequence of str
        Of `NAMES`.
    seed : int
        Same seed, same scenes.
    views : int, optional
        For every scene.
    size : (height, width), optional
        Of the images.
    command : str
        The command that the report names.

    Raises
    ------
    hizvk.HizError
        What the device refuses.
    """
    device = Device()
    found = Report(command=command, seed=seed, adapter=device.adapter, size=size or SIZE)

    def measure(key: str, _: Progress) -> None:
        scene = _scene(key, views or VIEWS, seed)
        found.rows += _measure(device, key, scene, found.size)

    found.over(out, keys, measure, prog=PROG)
    report.write(out, found.as_data(), found.page())
    return found


def _scene(key: str, views: int, seed: int) -> Scene:
    """A scene; its instances do not matter here."""
    if key == "village":
        return village(36, 10, views, seed=seed)
    if key == "boulders":
        return boulders(25, 10, views, seed=seed).scene
    return catalogue.make(key, 10, views, seed, None).scene


def _measure(device: Device, key: str, scene: Scene, size: Size) -> list[Row]:
    """Rows for one tree, unless it splits too much, and for an octree."""
    walls = device.occluders(scene.vertices, scene.triangles)
    cameras = [view.camera(size) for view in scene.views]
    rows = []
    for leaf in (None, LEAF):
        started = time.perf_counter()
        tiling = BspTiling(walls, leaf=leaf, most_parts=MOST_PARTS)
        build = time.perf_counter() - started
        if leaf is None and tiling.is_octree:
            continue
        depth = DepthTiles(size)
        same, seen, bits_ms, depth_ms = True, [], [], []
        for camera in cameras:
            of_bits, of_depth = [], []
            # In turns, so that what else runs here slows down both.
            for _ in range(REPETITIONS):
                ms, image = _timed(partial(tiling.draw, camera))
                of_bits.append(ms)
                ms, _ = _timed(partial(depth.draw, walls._inner, camera._inner))
                of_depth.append(ms)
            same &= bool(np.array_equal(image.coverage.ravel(), depth.coverage()))
            seen.append(image)
            bits_ms.append(min(of_bits))
            depth_ms.append(min(of_depth))
        rows.append(
            Row(
                key=key,
                triangles=tiling.num_triangles,
                tree="octree" if tiling.is_octree else "one tree",
                parts=tiling.num_parts,
                nodes=tiling.num_nodes,
                tree_bytes=tiling.host_bytes,
                build_s=build,
                same=same,
                visible=round(float(np.mean([image.num_visible for image in seen]))),
                tiled=round(float(np.mean([image.parts for image in seen]))),
                bits_ms=float(np.mean(bits_ms)),
                depth_ms=float(np.mean(depth_ms)),
                bits_bytes=seen[0].image_bytes,
                depth_bytes=depth.bytes(),
            )
        )
    return rows


def _timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """The time of a call in milliseconds, and what it returned."""
    started = time.perf_counter()
    made = work()
    return 1e3 * (time.perf_counter() - started), made


def main(arguments: Sequence[str]) -> int:
    """Runs the command; exit code 1: it cannot run, or coverage differs."""
    parser = frame.parser(
        PROG,
        "Triangles in BSP order against a pyramid of coverage bits, beside the depth tiles: the "
        "same coverage, time, splits and memory (exit code 1 if a pixel differs).",
        out="out/bench-tiling",
        holds="report",
        names=NAMES,
        seed=1996,
    )
    parser.add_argument(
        "--size", type=args.size, metavar="WIDTHxHEIGHT", help="of the images (default: 640x360)"
    )
    options = vars(parser.parse_args(list(arguments)))
    return frame.execute(PROG, run, options, arguments, frame.print_page)
