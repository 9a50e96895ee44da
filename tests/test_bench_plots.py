"""Plots of the bench and of the speed tool: labels cover nothing, and one value squeezes no axis.

Boxes of texts are asked of matplotlib's renderer, after the picture was drawn.
"""

from __future__ import annotations

import importlib.util
import itertools
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hizvk
from hizvk.bench import configurations
from hizvk.bench.results import Row, SceneResult
from hizvk.commands.figure import can_draw
from hizvk.commands.labels import limits
from hizvk.measuring.spread import Spread
from tools.speed import figures

if not can_draw():
    pytest.skip("matplotlib is not installed", allow_module_level=True)

from hizvk.bench import plots, texts_plot
from hizvk.bench.texts_report import Found, Method, Report
from tools.speed import plots as speed_plots

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "bench.md").read_text(encoding="utf-8")

Box = tuple[float, float, float, float]


def script(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(name, ROOT / "scripts" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


bench_plot = script("bench_plot")


def boxes(texts: Any, renderer: Any) -> dict[str, Box]:
    """The box of each text that is shown, by its words and a number."""
    found = {}
    for number, text in enumerate(texts):
        if text.get_visible() and text.get_text().strip():
            box = text.get_window_extent(renderer)
            found[f"{text.get_text()} #{number}"] = (box.x0, box.y0, box.x1, box.y1)
    return found


def overlaps(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def within(box: Box, frame: Box) -> bool:
    low, high = np.array(box[:2]) >= frame[:2], np.array(box[2:]) <= frame[2:]
    return bool(low.all() and high.all())


def clashes(some: dict[str, Box]) -> list[tuple[str, str]]:
    """The pairs that overlap."""
    return [
        (one, other)
        for (one, a), (other, b) in itertools.combinations(some.items(), 2)
        if overlaps(a, b)
    ]


def ticks(axis: Any, renderer: Any) -> dict[str, Box]:
    """Tick labels within the axes' limits, which matplotlib draws."""
    found = {}
    for which in (axis.xaxis, axis.yaxis):
        low, high = sorted(which.get_view_interval())
        for tick in [*which.get_major_ticks(), *which.get_minor_ticks()]:
            if low <= tick.get_loc() <= high:
                found |= boxes([tick.label1], renderer)
    return {f"{name} {box[0]:.0f}": box for name, box in found.items()}


def check(figure: Any, panels: int = 2) -> dict[str, Box]:
    """No text of the figure covers another one; returns the labels of points."""
    figure.draw_without_rendering()
    renderer = figure.canvas.get_renderer()
    width, height = figure.bbox.width, figure.bbox.height
    labels: dict[str, Box] = {}
    around = boxes(figure.texts, renderer)
    for legend in figure.legends:
        around |= boxes(legend.get_texts(), renderer)
    for place, axis in enumerate(figure.axes[:panels]):
        inner = {f"panel {place}: {k}": v for k, v in boxes(axis.texts, renderer).items()}
        if axis.get_legend() is not None:
            inner |= boxes(axis.get_legend().get_texts(), renderer)
        frame = axis.get_window_extent(renderer)
        for name, box in inner.items():
            assert within(box, (frame.x0, frame.y0, frame.x1, frame.y1)), name
        around |= {f"panel {place}: {k}": v for k, v in ticks(axis, renderer).items()}
        around |= {
            f"panel {place}: {k}": v
            for k, v in boxes([axis.title, axis.xaxis.label, axis.yaxis.label], renderer).items()
        }
        labels |= inner
    everything = around | labels
    assert clashes(everything) == []
    for name, box in everything.items():
        assert within(box, (0.0, 0.0, width, height)), name
    return labels


# -- the bench -------------------------------------------------------------------------------------


SCENES = ("mountains", "city", "city-far", "room", "castle")


@pytest.mark.parametrize(
    "key", [pytest.param(key, marks=() if key == "castle" else pytest.mark.slow) for key in SCENES]
)
def test_documented_results(key: str) -> None:
    scene = bench_plot.scene_of(PAGE, key)
    figure = plots.figure_of(scene)
    labels = check(figure)
    timed = {number for number, row in enumerate(scene.rows, 1) if row.total_ms is not None}
    left = [name for name in labels if name.startswith("panel 0")]
    numbers = [int(n) for name in left for n in name.split(": ")[1].split(" ")[0].split(",")]
    assert sorted(numbers) == sorted(timed)  # every row has its number, once
    # No outlier squeezes the rest: the middle half of hizvk's rows has its share of the height.
    own = [100 * row.hidden_kept_in_view for row in scene.rows if row.configuration]
    low, high = figure.axes[0].get_ylim()
    q1, q3 = np.quantile(own, (0.1, 0.9))
    assert (q3 - q1) / (high - low) > 0.25


def random_scene(seed: int, rows: int, spread: float) -> SceneResult:
    """Rows that crowd about a few places, with one far away."""
    rng = np.random.default_rng(seed)
    known = configurations.matrix("default" if rows < 40 else "full")
    made = []
    middles = rng.uniform(0.05, 0.3, 4)
    for k in range(rows):
        error = abs(rng.choice(middles) + spread * rng.normal())
        ms = float(np.exp(rng.normal() * 0.3 + (4.0 if k == 3 else 0.0)))
        made.append(
            Row(
                f"row {k}",
                None if k % 11 == 7 else known[k % len(known)],
                total_ms=Spread(ms, ms, ms),
                ns_per_instance=100.0 * ms,
                hidden_kept_in_view=0.95 if k == 5 else float(error),
                pareto=k % 9 == 0,
            )
        )
    numbers = dict.fromkeys(
        ("instances", "occluder_triangles", "instance_triangles", "views", "repetitions", "visible",
         "hidden", "inside"), 1,
    )  # fmt: skip
    ms_of = dict.fromkeys(("one_instance_ms", "upload_ms", "way_upload_ms", "warm_up_ms"), 0.0)
    return SceneResult("random", "random", truth="", size=(9, 16), rows=made, **numbers, **ms_of)


@pytest.mark.parametrize(
    ("seed", "rows", "spread"),
    [
        (1, 8, 0.1),
        pytest.param(2, 38, 0.02, marks=pytest.mark.slow),
        pytest.param(3, 90, 0.002, marks=pytest.mark.slow),
        pytest.param(5, 250, 0.02, marks=pytest.mark.slow),
    ],
)
def test_random_results(seed: int, rows: int, spread: float) -> None:
    figure = plots.figure_of(random_scene(seed, rows, spread))
    labels = check(figure)
    assert any("\N{UPWARDS ARROW} 95 %" in name for name in labels) == (rows > 8)
    assert figure.axes[0].get_ylim()[1] < 60.0 or rows == 8


@pytest.mark.slow
def test_all_in_one_place() -> None:
    scene = random_scene(4, 30, 0.0)
    for row in scene.rows:
        row.hidden_kept_in_view = 0.1
        row.total_ms, row.ns_per_instance = Spread(2.0, 2.0, 2.0), 200.0
    check(plots.figure_of(scene))


@pytest.mark.parametrize(
    ("values", "is_log", "expected"),
    [
        ([5.0], False, (5.0, 5.0)),
        ([1.0, 2.0, 3.0, 4.0], False, (1.0, 4.0)),
        ([*range(1, 20), 90.0], False, (1.0, 19.0)),
        ([-70.0, *range(1, 20), 90.0], False, (1.0, 19.0)),
        ([*range(1, 32), 188.0, 190.0, 191.0], False, (1.0, 31.0)),
        # Four are no outliers any more.
        ([*range(1, 52), 288.0, 289.0, 290.0, 291.0], False, (1.0, 291.0)),
        ([*np.geomspace(1, 100, 20), 1e6], True, (1.0, 100.0)),
        ([*np.geomspace(1, 100, 20), 150.0], True, (1.0, 150.0)),
    ],
)
def test_limits(values: list[float], is_log: bool, expected: tuple[float, float]) -> None:
    assert limits(values, is_log=is_log) == pytest.approx(expected)


def test_overlaps_are_seen() -> None:
    """A label that is moved onto another one is found."""
    figure = plots.figure_of(random_scene(2, 38, 0.02))
    check(figure)
    one, other = [text for text in figure.axes[0].texts if text.get_text()][:2]
    other.xy, other.xyann = one.xy, one.xyann
    with pytest.raises(AssertionError):
        check(figure)


def published(seed: int, scenes: int) -> Report:
    """Made-up results of published tests, whose points crowd at 0 lost."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(scenes):
        rows = []
        for number in range(10):
            ms = float(0.2 * rng.choice([1.0, 1.01, 1.2, 5.0]))
            lost = 0 if number > 4 else int(rng.choice([0, 0, 3, 80]))
            rows.append(Method(f"test {number}", number > 4, lost, 0, 0.1, Spread(ms, ms, ms)))
        found.append(Found(f"scene {k}", "x", 20_000, 12, (9, 16), 1, 400, 400, "", rows))
    adapter = hizvk.Adapter(0, "a", "b", "c", "vulkan", "cpu")
    return Report("x", 1, adapter, scenes=found)


@pytest.mark.parametrize(("seed", "scenes"), [(1, 5), pytest.param(2, 1, marks=pytest.mark.slow)])
def test_published_tests_crowd_at_none_lost(seed: int, scenes: int) -> None:
    figure = texts_plot.figure_of(published(seed, scenes))
    labels = check(figure, panels=scenes)
    shown = [name for name in labels if name.split(": ")[1].split(" ")[0].isdigit()]
    assert len(shown) == 10 * scenes


# -- the speed tool --------------------------------------------------------------------------------


def measured(sizes: int) -> figures.Found:
    """A run of made-up times: in proportion to the size, and texels that hardly grow."""
    found = figures.Found("x", 1, "quick", hizvk.Adapter(0, "a", "b", "c", "vulkan", "cpu"))
    for k in range(sizes):
        count, side = 10 ** (3 + k), 256 << k
        found.instance_counts.append(
            figures.InstanceCount(
                count, 1, count / 1e4, count / 1e5, 0.2 + count / 1e6, 52 * count, 3.0, count // 12
            )
        )
        found.image_sizes.append(
            figures.ImageSize(side, side**2 / 4e6, side**2 / 1e6, 0.5, 5 * side**2, 2.2 + k / 10)
        )
    return found


@pytest.mark.slow
@pytest.mark.parametrize("sizes", [1, 5])
def test_panels_of_the_speed_tool(sizes: int) -> None:
    figure = speed_plots.figure_of(measured(sizes))
    figure.draw_without_rendering()
    renderer = figure.canvas.get_renderer()
    texts = boxes([figure._suptitle], renderer)
    for place, axis in enumerate(figure.axes):
        named = {
            **ticks(axis, renderer),
            **boxes([axis.xaxis.label, axis.yaxis.label], renderer),
            **boxes(axis.get_legend().get_texts(), renderer),
        }
        texts |= {f"{place}: {name}": box for name, box in named.items()}
        # The lines lie within the panel, and fill a good part of it.
        low, high = axis.get_ylim()
        drawn = np.concatenate(
            [line.get_ydata() for line in axis.lines if line.get_marker() == "o"]
        )
        assert low <= drawn.min()
        assert drawn.max() < high
    assert clashes(texts) == []
    assert figure.axes[5].get_yscale() == "linear"
    assert figure.axes[0].get_yscale() == "log"
