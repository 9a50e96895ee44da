"""Speed against error: one picture per scene, for choosing a configuration by eye.

Needs matplotlib (the extra ``viz``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from ..commands import figure as figures
from ..commands.labels import Label, limits, place
from .results import fronts

if TYPE_CHECKING:
    from pathlib import Path

    from .results import Row, SceneResult

__all__ = ["draw", "figure_of"]

COLOURS: Final = {"spheres": "#2a78b8", "boxes": "#d9822b", "oriented_boxes": "#3a9150"}
YARDSTICK: Final = "#666666"
WRONG: Final = "#d62728"
BEST: Final = "#999999"
#: By the divisor of the depth image's sides.
MARKERS: Final = {1: "o", 2: "s", 4: "D"}
#: Points that are nearer to each other than this share one label, in pixels.
TOGETHER: Final = 8.0
#: At most so many rows are named in the legend.
MOST_NAMED: Final = 20
#: At most so many numbers are in one label.
MOST_NUMBERS: Final = 3


class Point(NamedTuple):
    """A row as a point of a panel."""

    number: int
    row: Row
    x: float
    y: float
    arrow: str
    """Where the row's own place lies if the point stands on an edge, with its value; or empty."""
    is_best: bool
    """Whether it is on the front."""


def draw(path: Path, scene: SceneResult) -> None:
    """Writes `figure_of` the scene as a PNG."""
    figure_of(scene).savefig(path)


def figure_of(scene: SceneResult) -> Any:
    """Two panels of speed against hidden instances kept.

    The left one shows milliseconds from occluders to mask, the right one nanoseconds of the cull
    alone.
    Points are the rows of the report's table, by number.
    Those on the front are joined, and the legend names them.
    A few rows that are far from all others stand on the edge, with an arrow and their number.

    Parameters
    ----------
    scene : SceneResult
        A measured scene, with its front marked.
    """
    rows = [(number, row) for number, row in enumerate(scene.rows, 1) if row.total_ms is not None]
    figure = figures.sheet(14.0, 6.4)
    left, right = figure.subplots(1, 2, sharey=True)
    # The rows of hizvk set the lower end.
    # Rays, which keep far less, stand on it.
    lowest = min(_error(row) for _, row in rows if row.configuration is not None)
    high = limits(_error(row) for _, row in rows if _error(row) >= lowest)[1]
    margin = 0.08 * (high - lowest) + 0.05
    ends = max(lowest - margin, 0.0), high + margin
    left.set_ylim(*ends)
    full = [
        (number, row)
        for number, row in rows
        if row.configuration is None or row.configuration.depth.divisor == 1
    ]
    ms = {number: row.total_ms.median for number, row in rows if row.total_ms}
    ns = {number: row.ns_per_instance or np.nan for number, row in full}
    panels = [(left, _panel(left, rows, ms, ends)), (right, _panel(right, full, ns, ends))]
    left.set_xlabel("ms per view: render, reduce, cull and read")
    left.set_ylabel("hidden instances kept, % of the hidden in the view volume")
    right.set_xlabel("ns per instance: the cull alone, depth at full resolution")
    best = next((row for row in scene.rows if row.label.startswith("best rectangle")), None)
    if best is not None:
        for axis in (left, right):
            axis.axhline(_error(best), color=BEST, linewidth=0.9, linestyle=":", zorder=0)
    _legend(figure, rows, best is not None)
    height, width = scene.size
    title = f"{scene.key}: {scene.instances:,} instances, {scene.views} views of {width}x{height}"
    figure.suptitle(f"{title}; down and left is better", fontsize=11)
    # Labels look at pixels, so everything else has its place first.
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axis, points in panels:
        place(axis, _labels(axis, points), [(point.x, point.y) for point in points])
    return figure


def _panel(
    axis: Any, rows: list[tuple[int, Row]], cost: dict[int, float], ends: tuple[float, float]
) -> list[Point]:
    """Draws the points and the fronts, and returns the points."""
    known = [cost[number] for number, _ in rows if np.isfinite(cost[number])]
    low, high = limits(known, is_log=True)
    room = 1.02 * (high / low) ** 0.06
    axis.set_xscale("log")
    axis.set_xlim(low / room, high * room)
    on = fronts([row for _, row in rows], [cost[number] for number, _ in rows])
    points = []
    for (number, row), is_best in zip(rows, on, strict=True):
        x, y, arrow = cost[number], _error(row), ""
        if not np.isfinite(x):
            continue
        if y < ends[0]:
            arrow = f"\N{DOWNWARDS ARROW} {y:.2g} %"
        elif y > ends[1]:
            arrow = f"\N{UPWARDS ARROW} {y:.3g} %"
        for is_past, sign in (
            (x > high * room, "\N{RIGHTWARDS ARROW}"),
            (x < low / room, "\N{LEFTWARDS ARROW}"),
        ):
            arrow = f"{arrow} {sign} {_short(x)}".strip() if is_past else arrow
        place_ = float(np.clip(x, low / room, high * room)), float(np.clip(y, *ends))
        points.append(Point(number, row, *place_, arrow, is_best))
        axis.scatter([place_[0]], [place_[1]], zorder=3, clip_on=False, **_style(row))
    for coverage, line in (("area", "-"), ("sample", "--")):
        front = sorted(
            (cost[point.number], _error(point.row))
            for point in points
            if point.is_best
            and point.row.configuration
            and point.row.configuration.coverage == coverage
        )
        if front:
            axis.step(
                *zip(*front, strict=True),
                where="post",
                color="black",
                linestyle=line,
                linewidth=1.1,
                zorder=2,
            )
    axis.set_xlim(low / room, high * room)
    axis.grid(True, which="both", color="#eeeeee", zorder=-1)
    # Within two decades there is room for more numbers.
    digits = "235" if high / low < 60.0 else "3"
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter(lambda x, _: f"{x:g}" if f"{x:e}"[0] in digits else "")
    axis.tick_params(which="both", labelsize=8)
    return points


def _style(row: Row) -> dict[str, Any]:
    """How a row's marker looks."""
    if row.configuration is None:
        style: dict[str, Any] = {"marker": "X", "color": YARDSTICK, "s": 46}
    else:
        marker = MARKERS.get(row.configuration.depth.divisor, "v")
        style = {"marker": marker, "color": COLOURS[row.configuration.volume], "s": 42}
    if row.configuration is not None and row.configuration.coverage == "sample":
        style |= {"edgecolors": "black", "linewidths": 0.9}
    if row.false_culls or (row.configuration is not None and not row.promises):
        colour = WRONG if row.false_culls else style["color"]
        style |= {"facecolors": "none", "edgecolors": colour, "linewidths": 1.4}
        style.pop("color")
    return style


def _short(value: float) -> str:
    """Three digits, and no exponent."""
    return f"{value:,.0f}" if value >= 100.0 else f"{value:.3g}"


def _error(row: Row) -> float:
    return 100.0 * row.hidden_kept_in_view


def _labels(axis: Any, points: list[Point]) -> list[Label]:
    """The numbers of the points, those of the front first; points that coincide share one."""
    if not points:
        return []
    places = axis.transData.transform([(point.x, point.y) for point in points])
    left = sorted(range(len(points)), key=lambda k: (not points[k].is_best, points[k].number))
    labels = []
    while left:
        first = left[0]
        near = [
            k
            for k in left
            if np.abs(places[k] - places[first]).max() < TOGETHER
            and points[k].is_best == points[first].is_best
            and points[k].arrow == points[first].arrow
        ][:MOST_NUMBERS]
        left = [k for k in left if k not in near]
        point = points[first]
        numbers = ",".join(str(points[k].number) for k in sorted(near))
        style = {
            "fontsize": 7.5,
            "fontweight": "bold" if point.is_best else "normal",
            "color": "black" if point.is_best else "#555555",
            "zorder": 4,
        }
        labels.append(Label(point.x, point.y, f"{numbers} {point.arrow}".strip(), style))
    return labels


def _legend(figure: Any, rows: list[tuple[int, Row]], has_best: bool) -> None:
    from matplotlib.lines import Line2D

    def mark(label: str, marker: str, colour: str, **more: Any) -> Any:
        return Line2D(
            [], [], linestyle="none", marker=marker, color=colour, label=label, markersize=6, **more
        )

    handles = [mark(kind.replace("_", " "), "o", colour) for kind, colour in COLOURS.items()]
    handles += [mark("depth 1/2", "s", "#bbbbbb"), mark("depth 1/4", "D", "#bbbbbb")]
    handles += [mark("no promise for the view", "o", "#888888", markerfacecolor="none")]
    handles += [mark("sample coverage", "o", "#dddddd", markeredgecolor="black")]
    handles += [mark("not by hizvk", "X", YARDSTICK)]
    handles += [Line2D([], [], color="black", label="Pareto front, area coverage")]
    handles += [
        Line2D([], [], color="black", linestyle="--", label="Pareto front, sample coverage")
    ]
    if has_best:
        handles += [Line2D([], [], color=BEST, linestyle=":", label="best rectangle test")]
    handles += [mark("culls what can be seen", "o", WRONG, markerfacecolor="none")]
    handles += [Line2D([], [], linestyle="none", label="\N{RIGHTWARDS ARROW} 41: beyond the axis")]
    names = [
        f"{number}  {row.label}" for number, row in rows if row.pareto or row.configuration is None
    ]
    if len(names) > MOST_NAMED:
        names[MOST_NAMED:] = [f"and {len(names) - MOST_NAMED} more in the table"]
    handles += [Line2D([], [], linestyle="none", label=name) for name in names]
    figure.legend(
        handles=handles, loc="outside right upper", fontsize=8, frameon=False, handletextpad=0.3
    )
