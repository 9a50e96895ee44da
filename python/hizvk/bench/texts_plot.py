"""The plot of ``hizvk bench --texts``: visible lost against time, a panel per scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from ..commands import figure
from ..commands.labels import Label, place

if TYPE_CHECKING:
    from pathlib import Path

    from .texts_report import Found, Report

__all__ = ["draw", "figure_of"]

PROMISED: Final = "#1a7f37"
UNCERTIFIED: Final = "#c0392b"
#: Percent below which the vertical axis is linear, so that it has a 0.
LINEAR_BELOW: Final = 0.01
#: Above what is lost, a factor of room; and at least this many percent.
ROOM: Final = 3.0
LEAST_TOP: Final = 1.0
#: Panels side by side.
COLUMNS: Final = 3


def draw(path: Path, found: Report) -> None:
    """Writes the plot as a PNG."""
    figure_of(found).savefig(path)


def figure_of(found: Report) -> Any:
    """The plot as a figure of matplotlib."""
    count = len(found.scenes)
    columns = min(COLUMNS, count + 1)
    # One cell more, for the legend.
    rows = -(-(count + 1) // columns)
    sheet = figure.sheet(3.9 * columns, 3.6 * rows)
    cells = sheet.subplots(rows, columns, sharey=True, squeeze=False).reshape(-1)
    axes = cells[:count]
    most = max(100.0 * one.lost_share(row) for one in found.scenes for row in one.rows)
    panels = [
        (axis, _panel(axis, one, max(ROOM * most, LEAST_TOP)))
        for axis, one in zip(axes, found.scenes, strict=True)
    ]
    for axis in axes[::columns]:
        axis.set_ylabel("visible instances lost [%]")
    for cell in cells[count:]:
        cell.set_axis_off()
    _legend(cells[count], found.scenes[0])
    sheet.suptitle(
        f"Published tests and certified culls: what is lost, and the time ({found.adapter.name})",
        fontsize=11,
    )
    # Labels keep clear of one another in pixels, so the layout comes first and then stays.
    sheet.draw_without_rendering()
    sheet.set_layout_engine("none")
    for axis, labels in panels:
        place(axis, labels, [(label.x, label.y) for label in labels])
    return sheet


def _panel(axis: Any, one: Found, top: float) -> list[Label]:
    """Draws the points, and returns their numbers."""
    axis.axhspan(-0.3 * LINEAR_BELOW, 0.3 * LINEAR_BELOW, color=PROMISED, alpha=0.15, zorder=0)
    labels = []
    for number, row in enumerate(one.rows, 1):
        colour = PROMISED if row.promises else UNCERTIFIED
        x, y = row.ms.median, 100.0 * one.lost_share(row)
        style = {"color": colour} if row.promises else {"facecolors": "none", "edgecolors": colour}
        axis.scatter([x], [y], s=42, zorder=3, clip_on=False, **style)
        labels.append(Label(x, y, str(number), {"fontsize": 8, "color": colour, "zorder": 4}))
    axis.set_xscale("log")
    axis.set_yscale("symlog", linthresh=LINEAR_BELOW)
    axis.set_ylim(-0.9 * LINEAR_BELOW, top)
    ticks = [0.0, 0.01, 0.1, 1.0, 10.0, 100.0]
    axis.set_yticks([tick for tick in ticks if tick <= top])
    axis.yaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter(lambda x, _: f"{x:g}" if str(f"{x:e}")[0] in "235" else "")
    axis.tick_params(which="both", labelsize=8)
    axis.grid(True, which="major", color="#eeeeee", zorder=-1)
    axis.set_xlabel("one cull [ms]")
    axis.set_title(f"{one.key}: {one.instances:,} instances, {one.views} views", fontsize=10)
    return labels


def _legend(cell: Any, one: Found) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [Patch(color=PROMISED, alpha=0.15, label="the promise: 0 lost")]
    for number, row in enumerate(one.rows, 1):
        colour = PROMISED if row.promises else UNCERTIFIED
        handles.append(
            Line2D(
                [],
                [],
                linestyle="none",
                marker="o",
                color=colour,
                markerfacecolor=colour if row.promises else "none",
                label=f"{number}  {row.label}",
            )
        )
    cell.legend(handles=handles, loc="center left", fontsize=8, frameon=False)
