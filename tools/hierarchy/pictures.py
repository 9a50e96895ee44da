"""The text's figures of one frame: nodes visited, the pyramid, and the cells that tests compared.

Needs matplotlib.
The tests of boxes are repeated here with NumPy on the finished pyramid; nothing is decided by it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

import hizvk
from hizvk.commands import figure as figures
from hizvk.methods import HIDDEN, OUTSIDE, VISIBLE
from hizvk.scenes.scene import box_corners

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

    from hizvk.methods import HierarchyFrame
    from hizvk.scenes import View

    from .scenes import Crowded

__all__ = ["Cell", "Extent", "cells_of_test", "draw", "extents"]

SIZE: Final = (360, 640)
#: Nodes with meshlets get a colour of their own where they are visible.
GREY, RED, GREEN, PALE = "#d0d4d8", "#c8452e", "#2f7d4f", "#9cc5a9"


class Extent(NamedTuple):
    """What the image may show of a box: first and last column and row, and its nearest depth."""

    columns: tuple[int, int]
    rows: tuple[int, int]
    nearest: float


class Cell(NamedTuple):
    """A cell that a test compared: level, column and row, and whether it hides the box."""

    level: int
    column: int
    row: int
    hides: bool


def extents(nodes: npt.NDArray[np.void], camera: hizvk.Camera) -> list[Extent | None]:
    """By node: its rectangle in the image; None for a box that crosses the eye's plane."""
    corners = box_corners(nodes["min"], nodes["max"])
    clip = corners @ camera.clip_from_world[:, :3].T + camera.clip_from_world[:, 3]
    height, width = camera.size
    found: list[Extent | None] = []
    for one in clip:
        if (one[:, 3] <= 0.0).any():
            found.append(None)
            continue
        ndc = one[:, :3] / one[:, 3:]
        x, y = (ndc[:, 0] + 1.0) * width / 2.0, (1.0 - ndc[:, 1]) * height / 2.0
        columns = int(np.clip(x.min(), 0, width - 1)), int(np.clip(x.max(), 0, width - 1))
        rows = int(np.clip(y.min(), 0, height - 1)), int(np.clip(y.max(), 0, height - 1))
        found.append(Extent(columns, rows, float(ndc[:, 2].max())))
    return found


def cells_of_test(frame: HierarchyFrame, extent: Extent) -> list[Cell]:
    """The cells that a test of a box compares, from the smallest one that encloses it down.

    Depth is reversed Z, as for all cameras of the scenes.
    """
    differing = (extent.columns[0] ^ extent.columns[1]) | (extent.rows[0] ^ extent.rows[1])
    top = min(differing.bit_length(), len(frame.levels) - 1)
    cells: list[Cell] = []

    def hides(level: int, column: int, row: int) -> bool:
        is_hidden = bool(frame.levels[level][row, column] >= extent.nearest)
        cells.append(Cell(level, column, row, is_hidden))
        if is_hidden or level == 0:
            return is_hidden
        below = level - 1
        columns = range(
            max(extent.columns[0] >> below, 2 * column),
            min(extent.columns[1] >> below, 2 * column + 1) + 1,
        )
        rows = range(
            max(extent.rows[0] >> below, 2 * row), min(extent.rows[1] >> below, 2 * row + 1) + 1
        )
        return all(hides(below, x, y) for y in rows for x in columns)

    hides(top, extent.columns[0] >> top, extent.rows[0] >> top)
    return cells


def draw(made: Crowded, folder: Path) -> list[Path]:
    """Draws the frame with the most hidden nodes; returns the files: three PNGs.

    Raises
    ------
    SystemExit
        Without matplotlib.
    """
    if not figures.can_draw():
        raise SystemExit(f"left out: {figures.missing()}")
    folder.mkdir(parents=True, exist_ok=True)
    scene = hizvk.HierarchicalVisibility(made.meshes)
    frames = [(scene.render(view.camera(SIZE)), view) for view in made.views]
    frame, view = max(frames, key=lambda each: each[0].nodes_hidden)
    paths = [folder / f"{name}.png" for name in ("octree", "pyramid", "quadtree")]
    _octree(scene, frame, view, paths[0])
    _pyramid(frame, view, paths[1])
    _quadtree(scene, frame, view, paths[2])
    return paths


def _octree(
    scene: hizvk.HierarchicalVisibility, frame: HierarchyFrame, view: View, path: Path
) -> None:
    """The boxes of the tree from above, at the height of the eye."""
    from matplotlib.collections import PolyCollection

    nodes = scene.nodes
    up = int(np.argmax(np.abs(view.up)))
    plan = [axis for axis in range(3) if axis != up]
    at_eye = (nodes["min"][:, up] <= view.eye[up]) & (nodes["max"][:, up] >= view.eye[up])
    leaf = np.zeros(len(nodes), bool)
    leaf[frame.visible_leaves] = True
    groups = (
        (frame.states == OUTSIDE, "outside of the view", GREY, "none"),
        ((frame.states == VISIBLE) & ~leaf, "visited", PALE, "none"),
        (leaf, "visible leaves", GREEN, GREEN + "60"),
        (frame.states == HIDDEN, "hidden, with all below", RED, "none"),
    )
    figure = figures.sheet(8.0, 8.0, dpi=110)
    axes = figure.add_subplot()
    for chosen, label, edge, face in groups:
        x0, y0 = nodes["min"][chosen & at_eye][:, plan].T
        x1, y1 = nodes["max"][chosen & at_eye][:, plan].T
        boxes = np.stack([x0, y0, x1, y0, x1, y1, x0, y1], axis=-1).reshape(-1, 4, 2)
        axes.add_collection(
            PolyCollection(list(boxes), edgecolors=edge, facecolors=face, linewidths=0.7)
        )
        axes.plot([], [], color=edge, label=f"{label}: {int(chosen.sum()):,}")
    eye = np.array(view.eye)[plan]
    axes.plot(*eye, marker="o", color="black", markersize=5)
    forward = np.subtract(view.target, view.eye)[plan]
    half = np.arctan(np.tan(np.radians(view.fov_y_deg) / 2.0) * SIZE[1] / SIZE[0])
    reach = float(np.linalg.norm(nodes["max"][0] - nodes["min"][0]))
    for angle in (-half, half):
        cos, sin = np.cos(angle), np.sin(angle)
        side = np.array([cos * forward[0] - sin * forward[1], sin * forward[0] + cos * forward[1]])
        end = eye + side / np.linalg.norm(side) * reach
        axes.plot(*np.stack([eye, end]).T, color="black", linewidth=0.8)
    axes.set_aspect("equal")
    axes.set_xlim(nodes["min"][0][plan[0]], nodes["max"][0][plan[0]])
    axes.set_ylim(nodes["min"][0][plan[1]], nodes["max"][0][plan[1]])
    axes.legend(loc="upper right", fontsize=9)
    figures.save(figure, f"{frame.nodes_visited} of {len(nodes):,} nodes visited", path)


def _grey(level: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Reversed NDC depth as a grey: near is bright, on a logarithmic scale."""
    with np.errstate(divide="ignore"):
        logs = np.log(level)
    finite = logs[np.isfinite(logs)]
    low, high = (finite.min(), finite.max()) if finite.size else (0.0, 1.0)
    scaled = (np.nan_to_num(logs, neginf=low) - low) / max(high - low, 1e-6)
    return np.where(level > 0.0, 0.1 + 0.9 * scaled, 0.0).astype(np.float32)


def _pyramid(frame: HierarchyFrame, view: View, path: Path) -> None:
    """Every level, from the image to the single cell."""
    figure = figures.sheet(11.0, 5.4, dpi=110)
    shown = len(frame.levels)
    columns = (shown + 1) // 2
    top = _grey(frame.levels[0]).max()
    for k, level in enumerate(frame.levels):
        axes = figure.add_subplot(2, columns, k + 1)
        axes.imshow(_grey(level), cmap="gray", vmin=0.0, vmax=top, interpolation="nearest")
        axes.set_title(f"level {k}: {level.shape[1]}x{level.shape[0]}", fontsize=9)
        axes.set_axis_off()
    figures.save(figure, f"The farthest depths that were kept ({view.name})", path)


def _quadtree(
    scene: hizvk.HierarchicalVisibility, frame: HierarchyFrame, view: View, path: Path
) -> None:
    """The cells that the tests of one hidden and of one visible node compare."""
    boxes = extents(scene.nodes, frame.camera)
    figure = figures.sheet(11.0, 3.8, dpi=110)
    for place, (state, word) in enumerate(((HIDDEN, "hidden"), (VISIBLE, "visible")), 1):
        axes = figure.add_subplot(1, 2, place)
        axes.imshow(_grey(frame.levels[0]), cmap="gray", interpolation="nearest")
        axes.set_axis_off()
        chosen = _telling(frame, boxes, state)
        if chosen is None:
            axes.set_title(f"no {word} node in the image", fontsize=9)
            continue
        extent, cells = chosen
        for cell in cells:
            _outline(axes, cell)
        (x0, x1), (y0, y1) = extent.columns, extent.rows
        axes.plot(
            [x0 - 0.5, x1 + 0.5, x1 + 0.5, x0 - 0.5, x0 - 0.5],
            [y0 - 0.5, y0 - 0.5, y1 + 0.5, y1 + 0.5, y0 - 0.5],
            color="#f2c230",
            linewidth=1.6,
        )
        levels = sorted({cell.level for cell in cells}, reverse=True)
        text = f"a {word} node: {len(cells)} cells of levels {levels[0]} to {levels[-1]}"
        axes.set_title(text, fontsize=9)
    figures.save(figure, f"Cells compared: red hides, blue does not ({view.name})", path)


def _outline(axes: Any, cell: Cell) -> None:
    side = 1 << cell.level
    height, width = SIZE
    x0, y0 = cell.column * side - 0.5, cell.row * side - 0.5
    x1, y1 = min(x0 + side, width - 0.5), min(y0 + side, height - 0.5)
    colour = RED if cell.hides else "#4a7fc1"
    axes.plot([x0, x1, x1, x0, x0], [y0, y0, y1, y1, y0], color=colour, linewidth=0.9)


def _telling(
    frame: HierarchyFrame, boxes: list[Extent | None], state: int
) -> tuple[Extent, list[Cell]] | None:
    """Of the nodes in this state: the one whose test compares the most cells, up to 200."""
    best: tuple[Extent, list[Cell]] | None = None
    for node in np.flatnonzero(frame.states == state):
        extent = boxes[node]
        if extent is None:
            continue
        cells = cells_of_test(frame, extent)
        if len(cells) <= 200 and (best is None or len(cells) > len(best[1])):
            best = extent, cells
    return best
