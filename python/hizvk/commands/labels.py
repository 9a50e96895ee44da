"""Labels beside the points of a plot that cover neither one another nor the points.

Each label takes the nearest free place around its point (greedy, as in Christensen, Marks and
Shieber 1995, section 4.1), and a thin line joins the two where they are apart.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy.typing as npt

    _Boxes = npt.NDArray[np.float64]

__all__ = ["Label", "limits", "place"]

#: Half the side of the box that a marker is taken for, in pixels.
MARKER: Final = 5.0
#: The gap around a label, in pixels.
GAP: Final = 1.5
#: Where a label may stand: directions, best first, and distances from its point in pixels.
DIRECTIONS: Final = np.radians([45, 135, -45, -135, 90, -90, 0, 180, 22, 158, -22, -158, 67, 113])
DISTANCES: Final = (7.0, 12.0, 18.0, 25.0, 33.0, 42.0, 52.0, 64.0, 78.0, 94.0, 112.0, 140.0, 180.0)
#: From this distance on a line joins a label to its point.
LINED: Final = 12.0
#: A label that covers a marker counts as so many pixels farther away.
COST_OF_MARKER: Final = 30.0

#: At most this many points at an end of an axis are outliers,
MOST_OUTLIERS: Final = 3
#: one in so many values,
FEW: Final = 10
#: and without them the axis spans this much less.
SQUEEZE: Final = 1.35


class Label(NamedTuple):
    """A text at a point of the data."""

    x: float
    y: float
    text: str
    style: dict[str, Any]
    """Arguments of ``Axes.annotate``."""


def limits(values: Iterable[float], *, is_log: bool = False) -> tuple[float, float]:
    """The ends of an axis for most of the values.

    Up to three values at each end are left out, if without them the axis spans much less.
    The caller draws those on the edge, with an arrow.

    Parameters
    ----------
    values : iterable of float
        What is drawn, at least one.
    is_log : bool
        Whether the axis is logarithmic; the values are then positive.
    """
    ordered = np.sort([float(value) for value in values])
    shown = np.log(ordered) if is_log else ordered
    last = len(shown) - 1 - _outliers(-shown[::-1])
    first = _outliers(shown[: last + 1])
    return float(ordered[first]), float(ordered[last])


def _outliers(ascending: npt.NDArray[np.float64]) -> int:
    """How many of the first values are far from all others; the fewest that explain it."""
    found = 0
    most = min(MOST_OUTLIERS, len(ascending) // FEW)
    for more in range(1, most + 1):
        rest = ascending[more:]
        if ascending[-1] - ascending[found] > SQUEEZE * (rest[-1] - rest[0]):
            found = more
    return found


def place(axis: Any, labels: Sequence[Label], points: Iterable[tuple[float, float]]) -> list[Any]:
    """Writes the labels, and returns their texts.

    A label that finds no free place is left out.
    The figure's layout has to be final: this looks at pixels.

    Parameters
    ----------
    axis : matplotlib.axes.Axes
        Where the points are drawn.
    labels : sequence of Label
        What is written; the first ones choose first.
    points : iterable of (x, y)
        All markers, in data coordinates.
    """
    from matplotlib.patheffects import withStroke

    renderer = axis.figure.canvas.get_renderer()
    per_point = axis.figure.dpi / 72.0
    markers = axis.transData.transform(np.reshape(list(points), (-1, 2)))
    taken = np.concatenate([markers - MARKER, markers + MARKER], axis=1)
    frame = axis.get_window_extent(renderer)
    inside = np.array([frame.x0 + GAP, frame.y0 + GAP, frame.x1 - GAP, frame.y1 - GAP])
    placed = np.zeros((0, 4))
    written = []
    for label in labels:
        text = axis.annotate(
            label.text, (label.x, label.y), xytext=(0.0, 0.0), textcoords="offset points",
            ha="center", va="center", annotation_clip=False,
            path_effects=[withStroke(linewidth=2.0, foreground="white")], **label.style,
        )  # fmt: skip
        text.set_in_layout(False)
        box = text.get_window_extent(renderer)
        half = np.array([box.width, box.height]) / 2.0 + GAP
        point = axis.transData.transform((label.x, label.y))
        middle = _best(point, half, placed, taken, inside)
        if middle is None:
            text.remove()
            continue
        offset = tuple((middle - point) / per_point)
        text.xyann = offset
        # How far the label's border is from the point.
        if np.linalg.norm(np.maximum(np.abs(middle - point) - half, 0.0)) >= LINED:
            axis.annotate(
                "", (label.x, label.y), xytext=offset, textcoords="offset points",
                annotation_clip=False, zorder=1,
                arrowprops={
                    "arrowstyle": "-", "color": "#999999", "linewidth": 0.6,
                    "shrinkA": min(half) / per_point, "shrinkB": MARKER / per_point,
                },
            ).set_in_layout(False)  # fmt: skip
        placed = np.concatenate([placed, [[*(middle - half), *(middle + half)]]])
        written.append(text)
    return written


def _best(
    point: _Boxes, half: _Boxes, placed: _Boxes, taken: _Boxes, inside: _Boxes
) -> _Boxes | None:
    """The middle of a label at its best place, or None if there is no free one."""
    towards = np.stack([np.cos(DIRECTIONS), np.sin(DIRECTIONS)], axis=1)
    # The label's own border lies at that distance.
    near = np.concatenate(
        [point + towards * (far + np.abs(towards) @ half * 0.9)[:, None] for far in DISTANCES]
    )
    for middles in (near, _grid(inside, half)):
        boxes = np.concatenate([middles - half, middles + half], axis=1)
        free = (boxes[:, :2] >= inside[:2]).all(axis=1) & (boxes[:, 2:] <= inside[2:]).all(axis=1)
        free &= ~_overlaps(boxes, placed).any(axis=1)
        if free.any():
            cost = np.linalg.norm(middles - point, axis=1)
            cost += COST_OF_MARKER * _overlaps(boxes, taken).sum(axis=1)
            best: _Boxes = middles[np.argmin(np.where(free, cost, np.inf))]
            return best
    return None


def _grid(inside: _Boxes, half: _Boxes) -> _Boxes:
    """Places all over the axes."""
    x, y = (
        np.arange(inside[axis] + half[axis], inside[axis + 2] - half[axis], half[axis] + 1.0)
        for axis in range(2)
    )
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def _overlaps(boxes: _Boxes, others: _Boxes) -> npt.NDArray[np.bool_]:
    """``(N, M)``: which boxes overlap which others."""
    lower = np.maximum(boxes[:, None, :2], others[None, :, :2])
    upper = np.minimum(boxes[:, None, 2:], others[None, :, 2:])
    overlap: npt.NDArray[np.bool_] = np.all(lower < upper, axis=2)
    return overlap
