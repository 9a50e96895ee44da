"""Speed against error: one picture per scene, for choosing a configuration by eye.

Needs matplotlib (the extra ``viz``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ..commands import figure as figures
from .results import fronts

if TYPE_CHECKING:
    from pathlib import Path

    from .results import Row, SceneResult

__all__ = ["draw"]

COLOURS: Final = {"spheres": "#2a78b8", "boxes": "#d9822b", "oriented_boxes": "#3a9150"}
YARDSTICK: Final = "#666666"
WRONG: Final = "#d62728"
#: By the divisor of the depth image's sides.
MARKERS: Final = {1: "o", 2: "s", 4: "D"}


def draw(path: Path, scene: SceneResult) -> None:
    """Writes a PNG with two panels of speed against hidden instances kept.

    The left one shows milliseconds from occluders to mask, the right one nanoseconds of the cull
    alone.
    Points are the rows of the report's table, by number.
    Those on the front are joined, and the legend names them.

    Parameters
    ----------
    path : Path
        The file.
    scene : SceneResult
        A measured scene, with its front marked.
    """
    rows = [(number, row) for number, row in enumerate(scene.rows, 1) if row.total_ms is not None]
    figure = figures.sheet(14.0, 6.4)
    left, right = figure.subplots(1, 2, sharey=True)
    # The rows of hizvk set the scale. A row that keeps far less, such as rays, is drawn on the
    # lower edge with an arrow.
    errors = [_error(row) for _, row in rows if row.configuration is not None]
    margin = 0.08 * (max(errors) - min(errors)) + 0.05
    floor = max(min(errors) - margin, 0.0)
    left.set_ylim(floor, max(_error(row) for _, row in rows) + margin)
    _panel(left, rows, {number: row.total_ms.median for number, row in rows if row.total_ms}, floor)
    left.set_xlabel("ms per view: render, reduce, cull and read")
    left.set_ylabel("hidden instances kept, % of the hidden in the view volume")
    own = [
        (number, row)
        for number, row in rows
        if row.configuration is None or row.configuration.depth.divisor == 1
    ]
    _panel(right, own, {number: row.ns_per_instance or np.nan for number, row in own}, floor)
    right.set_xlabel("ns per instance: the cull alone, depth at full resolution")
    best = next((row for row in scene.rows if row.label.startswith("best rectangle")), None)
    for axis in (left, right):
        if best is not None:
            level = 100.0 * best.hidden_kept_in_view
            axis.axhline(level, color="#999999", linewidth=0.9, linestyle=":", zorder=0)
            axis.annotate(
                "best rectangle test",
                (0.995, level),
                xycoords=("axes fraction", "data"),
                fontsize=7.5,
                color="#777777",
                ha="right",
                va="bottom",
            )
    _legend(figure, rows)
    height, width = scene.size
    title = f"{scene.key}: {scene.instances:,} instances, {scene.views} views of {width}x{height}"
    figures.save(figure, f"{title}; down and left is better", path)


def _panel(axis: Any, rows: list[tuple[int, Row]], cost: dict[int, float], floor: float) -> None:
    for number, row in rows:
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
        axis.scatter([cost[number]], [max(_error(row), floor)], zorder=3, clip_on=False, **style)
    axis.set_xscale("log")
    on = fronts([row for _, row in rows], [cost[number] for number, _ in rows])
    chosen = [
        (cost[number], _error(row), row)
        for (number, row), best in zip(rows, on, strict=True)
        if best
    ]
    for coverage, line in (("area", "-"), ("sample", "--")):
        points = sorted(
            (x, y)
            for x, y, row in chosen
            if row.configuration and row.configuration.coverage == coverage
        )
        if points:
            axis.step(
                *zip(*points, strict=True),
                where="post",
                color="black",
                linestyle=line,
                linewidth=1.1,
                zorder=2,
            )
    axis.grid(True, which="both", color="#eeeeee", zorder=-1)
    axis.xaxis.set_major_formatter("{x:g}")
    axis.xaxis.set_minor_formatter(lambda x, _: f"{x:g}" if str(f"{x:e}")[0] in "235" else "")
    axis.tick_params(which="both", labelsize=8)
    _number(
        axis,
        [
            (cost[number], max(_error(row), floor), number, best, _error(row) < floor)
            for (number, row), best in zip(rows, on, strict=True)
        ],
    )


def _error(row: Row) -> float:
    return 100.0 * row.hidden_kept_in_view


def _number(axis: Any, points: list[tuple[float, float, int, bool, bool]]) -> None:
    """Writes each point's number at its side; points that nearly coincide share one label.

    An arrow after it says that the point lies below the lower edge.
    """
    place = axis.transData.transform([(x, y) for x, y, *_ in points])
    left = set(range(len(points)))
    while left:
        first = min(left, key=lambda k: points[k][2])
        group = [k for k in left if np.abs(place[k] - place[first]).max() < 13.0]
        left -= set(group)
        on_front = sorted(points[k][2] for k in group if points[k][3])
        others = sorted(points[k][2] for k in group if not points[k][3])
        below = " \N{DOWNWARDS ARROW}" if points[first][4] else ""
        if on_front:
            _label(axis, on_front, points[first][:2], (5.0, 5.0), "black", "bold")
        if others:
            _label(
                axis,
                others,
                points[first][:2],
                (5.0, -9.0 if on_front else 5.0),
                "#555555",
                "normal",
                below,
            )


def _label(
    axis: Any,
    numbers: list[int],
    point: tuple[float, float],
    shift: tuple[float, float],
    colour: str,
    weight: str,
    after: str = "",
) -> None:
    axis.annotate(
        ",".join(map(str, numbers)) + after,
        point,
        xytext=shift,
        textcoords="offset points",
        fontsize=7.5,
        fontweight=weight,
        color=colour,
        zorder=4,
    )


def _legend(figure: Any, rows: list[tuple[int, Row]]) -> None:
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
    handles += [mark("culls what can be seen", "o", WRONG, markerfacecolor="none")]
    handles += [
        Line2D([], [], linestyle="none", label=f"{number}  {row.label}")
        for number, row in rows
        if row.pareto or row.configuration is None
    ]
    figure.legend(
        handles=handles, loc="outside right upper", fontsize=8, frameon=False, handletextpad=0.3
    )
