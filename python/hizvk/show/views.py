"""The result of several views as one picture, one table and one figure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from .colours import BACKGROUND, CLASS_COLOURS, INK, rgb
from .html import document
from .png import png
from .seen import seen_of
from .seen_plot import draw_view
from .shapes import CLASSES

if TYPE_CHECKING:
    from .seen import Seen

__all__ = ["Views", "views_of"]

#: The most views that are drawn; of more some are drawn, evenly chosen.
MOST_VIEWS: Final = 12
#: The most rows of a table.
MOST_ROWS: Final = 24
#: The longer side of a view in a notebook's picture, and the gap between views, in pixels.
SIDE, GAP = 240, 4
#: The most views beside one another.
COLUMNS: Final = 4
#: The width of a view in a figure, in inches.
PANEL: Final = 3.2


class Views(NamedTuple):
    """What is shown of a result of V views."""

    title: str
    num_views: int
    """V."""
    seen: list[tuple[int, Seen]]
    """The views that are drawn, with their numbers."""
    rows: list[list[str]]
    """Of the table: number and counts of some views."""
    head: list[str]

    @property
    def columns(self) -> int:
        """How many views stand beside one another."""
        return min(COLUMNS, math.ceil(math.sqrt(len(self.seen))))

    @property
    def numbers(self) -> str:
        """Which views are drawn, in words."""
        drawn = ", ".join(str(number) for number, _ in self.seen)
        return (
            f"views {drawn} of 0 to {self.num_views - 1}"
            if len(self.seen) < self.num_views
            else "views"
        )

    def picture(self) -> bytes:
        """A PNG: the views in rows, each as that of one result is."""
        images = [seen.image(SIDE) for _, seen in self.seen]
        tall, wide = (max(image.shape[axis] for image in images) for axis in (0, 1))
        rows = math.ceil(len(images) / self.columns)
        sheet = np.full(
            (rows * (tall + GAP) - GAP, self.columns * (wide + GAP) - GAP, 3), 255, np.uint8
        )
        for place, image in enumerate(images):
            top, left = (
                (tall + GAP) * (place // self.columns),
                (wide + GAP) * (place % self.columns),
            )
            sheet[top : top + tall, left : left + wide] = rgb(BACKGROUND)
            sheet[top : top + image.shape[0], left : left + image.shape[1]] = image
        return png(sheet)

    def html(self) -> str:
        """The picture, and a table of the views."""
        notes = [f"Shown, in rows from the top left: {self.numbers}."]
        if len(self.rows) < self.num_views:
            notes.append(f"The table has {len(self.rows)} of {self.num_views} views.")
        if self.seen[0][1].bounds is None:
            notes.append("The bounds are not known any more; .plot(bounds) draws them.")
        return document(self.title, self.picture(), table=(self.head, self.rows), notes=notes)

    def plot(self, most: int) -> Any:
        """A figure with a panel per view; at most `most` instances are drawn in each."""
        from matplotlib.lines import Line2D

        from .figure import figure

        columns, rows = self.columns, math.ceil(len(self.seen) / self.columns)
        height, width = self.seen[0][1].camera.size
        tall = float(np.clip(PANEL * height / width, 1.0, 2.0 * PANEL))
        sheet = figure(PANEL * columns + 0.8, (tall + 0.6) * rows + 1.0)
        axes = sheet.subplots(rows, columns, squeeze=False)
        for axis in axes.flat[len(self.seen) :]:
            axis.set_axis_off()
        for axis, (number, seen) in zip(axes.flat, self.seen, strict=False):
            draw_view(axis, seen, seen.shapes(most))
            kept, *culled = seen.counts()
            axis.set_title(f"view {number}: {kept:,} kept, {sum(culled):,} culled", size=9)
            axis.locator_params(nbins=5)
        names = self.seen[0][1].names
        sheet.legend(
            handles=[
                Line2D([], [], color=colour, linewidth=2.5, label=name)
                for name, colour in zip(names, CLASS_COLOURS, strict=True)
                if name
            ],
            loc="outside lower center", ncols=3, fontsize=9, labelcolor=INK, frameon=True,
            facecolor=BACKGROUND, framealpha=1.0, edgecolor="none",
        )  # fmt: skip
        some = f"; {self.numbers}" if len(self.seen) < self.num_views else ""
        sheet.suptitle(f"{self.title}{some}", size=11)
        return sheet


def views_of(result: Any, bounds: object, unit: str = "m", *, must_know: bool = True) -> Views:
    """What is shown of a `ViewsResult`; the parameters are those of `seen.seen_of`."""
    count = len(result)
    seen = [
        (number, seen_of(result[number], bounds, unit, must_know=must_know))
        for number in _some(count, MOST_VIEWS)
    ]
    counts = _counts(result, _some(count, MOST_ROWS))
    names = seen[0][1].names if counts and len(counts[0]) > 2 else CLASSES[:1]
    head = ["view", *(name for name in names if name)]
    rows = [[f"{cell:,}" for cell in row] for row in counts]
    return Views(repr(result).strip("<>"), count, seen, rows, head if rows else [])


def _some(count: int, most: int) -> list[int]:
    """All numbers below `count`, or `most` of them, evenly chosen, with the first and the last."""
    if count <= most:
        return list(range(count))
    return [int(number) for number in np.rint(np.linspace(0, count - 1, most))]


def _counts(result: Any, numbers: list[int]) -> list[list[int]]:
    """Number, and how many instances are kept, hidden and outside, or the first of these alone."""
    try:
        stats = [(number, result[number].stats) for number in numbers]
    except ValueError:  # without verdicts
        try:
            return [[number, int(result.counts[number])] for number in numbers]
        except ValueError:  # without masks
            return []
    return [[number, one.kept, one.occluded, one.outside] for number, one in stats]
