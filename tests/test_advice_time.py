"""`recommend` keeps to `max_seconds`: which rows are tried, by a clock that the test moves."""

from __future__ import annotations

import math
import time
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hizvk
from hizvk.measuring.configuration import Configuration, DepthVariant
from hizvk.measuring.spread import spread
from hizvk.recommendation import (
    Candidate,
    Recommendation,
    arguments,
    budget,
    checking,
    timing,
)
from hizvk.recommendation.budget import admitted, by_use
from hizvk.recommendation.tried import promised

if TYPE_CHECKING:
    from collections.abc import Iterable

CONSERVATIVE = DepthVariant(1, True)


class Clock:
    """Seconds that pass only where work is done; an image takes them by its pixels."""

    def __init__(self, *, image_s: float, compile_s: float, cull_s: float, views: int) -> None:
        self.now = 100.0
        self._image_s, self._compile_s, self._cull_s = image_s, compile_s, cull_s
        self._compiled: set[Configuration] = set()
        self.device, self.views = None, [None] * views

    def monotonic(self) -> float:
        return self.now

    def pyramids(self, variants: Iterable[DepthVariant], _: int) -> dict[DepthVariant, Any]:
        made = {one: self._image_s / one.divisor**2 for one in variants}
        self.now += sum(made.values())
        return {one: (None, 1000.0 * took) for one, took in made.items()}

    def once(self, _: Any, __: Any, ___: Any, one: Configuration, *____: Any) -> None:
        self.now += self._cull_s + (0.0 if one in self._compiled else self._compile_s)
        self._compiled.add(one)


def rows(count: int) -> list[Configuration]:
    return [Configuration(footprint=1 + k, depth=CONSERVATIVE) for k in range(count)]


def tried(clock: Clock, chosen: list[Configuration], seconds: float) -> list[Configuration]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(budget, "time", clock)
        patch.setattr(budget, "once", clock.once)
        volumes: Any = {"boxes": None, "spheres": None}
        source: Any = clock
        return admitted(chosen, volumes, source, hizvk.CullOptions(), None, clock.now + seconds)


@pytest.mark.parametrize(("views", "image_s"), [(1, 0.0), (4, 0.125), (4, 1.0)])
def test_rows_are_tried_while_all_of_them_can_be_measured_in_time(
    views: int, image_s: float
) -> None:
    for seconds in np.arange(10.0, 40.0, 0.25).tolist():
        clock = Clock(image_s=image_s, compile_s=1.0, cull_s=0.25, views=views)
        chosen, begin = rows(40), clock.now
        found = tried(clock, chosen, seconds)
        # By hand: a row compiles once, culls twice to be tried, and twice per view to be measured.
        # An image is made once to be tried; of one below 200 ms two more per view are made.
        images = image_s * (2 * views if image_s <= 0.2 else views - 1)
        each = 1.0 + 0.25 * (2 + 2 * views)
        count = math.floor((seconds - image_s - images) / each)
        assert found == chosen[:count]
        assert clock.now - begin == pytest.approx(image_s + count * 1.5)


def test_a_larger_image_is_expected_to_take_longer() -> None:
    """A quarter of each side takes 1 s, and the whole image 16 s, which would be too late."""
    quarter, whole = (Configuration(depth=DepthVariant(n, True)) for n in (4, 1))
    for seconds, expected in ((30.0, [quarter]), (40.0, [quarter, whole])):
        clock = Clock(image_s=16.0, compile_s=1.0, cull_s=0.25, views=2)
        # By hand: 1 + 1.5 + 1 + 1 for the quarter, and 16 + 1.5 + 16 + 1 for the whole, are 39.
        begin = clock.now
        assert tried(clock, [quarter, whole], seconds) == expected
        assert clock.now - begin < seconds
    plain = Configuration()
    clock = Clock(image_s=0.125, compile_s=1.0, cull_s=0.25, views=1)
    assert tried(clock, [quarter, plain], 9.0) == [quarter, plain]


def test_the_first_row_always_runs_and_no_limit_tries_nothing() -> None:
    clock = Clock(image_s=1.0, compile_s=1.0, cull_s=1.0, views=3)
    assert tried(clock, rows(5), -1.0) == rows(1)
    begin = clock.now
    assert tried(clock, rows(5), math.inf) == rows(5)
    assert clock.now == begin


def test_the_surest_row_is_first_and_every_sort_has_its_turn() -> None:
    every = promised(("boxes", "spheres"), "area", rendered=True)
    order = by_use(every, every_ray=True, area=True)
    assert sorted(order, key=str) == sorted(every, key=str)
    assert order[0].depth == DepthVariant(4, True)  # of those that are proven, the cheapest
    assert order[0].coverage == "area"
    sorts = {(one.volume, one.depth, one.coverage, one.fit) for one in every}
    turn = order[: len(sorts)]
    assert {(one.volume, one.depth, one.coverage, one.fit) for one in turn} == sorts
    compared = [one.coverage == "sample" for one in turn]
    assert compared == sorted(compared)
    # Points before an image need the guard.
    points = promised(("spheres",), "area", rendered=False, points=True)
    assert by_use(points, every_ray=False, area=True)[0].guard_px == 0.5


@pytest.mark.parametrize(
    ("seconds", "least", "parts"),
    [(math.inf, 0, 1), (8.5, 0, 8), (3.5, 1, 3), (0.0, 0, 0), (0.0, 1, 1), (-9.0, 0, 0)],
)
def test_instances_are_looked_at_in_parts(
    monkeypatch: pytest.MonkeyPatch, seconds: float, least: int, parts: int
) -> None:
    """A second for each part; two views are left, so this one has half of the time."""
    clock = Clock(image_s=0.0, compile_s=0.0, cull_s=0.0, views=1)
    asked = np.arange(100, 180)
    calls = []

    def visible(_: Any, which: Any, k: int) -> Any:
        clock.now += 1.0
        calls.append(which)
        assert k == 5
        return which % 3 == 0

    monkeypatch.setattr(checking, "time", clock)
    judge: Any = SimpleNamespace(visible=visible)
    bounds: Any = None
    looked, shown = checking._looked(judge, bounds, asked, 5, clock.now + 2.0 * seconds, 2, least)
    assert len(calls) == parts
    assert looked.tolist() == [number for call in calls for number in call.tolist()]
    assert (shown == (looked % 3 == 0)).all()
    assert len(looked) == len(set(looked.tolist())) == 80 * parts // 8 or seconds == math.inf


def test_a_slow_device_ends_in_time(monkeypatch: pytest.MonkeyPatch, device: hizvk.Device) -> None:
    """Each cull takes a tenth of a second more, and without a limit there are more than 250."""
    honest = timing.cull

    def slow(*arguments: Any) -> Any:
        time.sleep(0.1)
        return honest(*arguments)

    monkeypatch.setattr(timing, "cull", slow)
    wall = hizvk.Mesh(
        [[-9.0, -9, -4], [0, -9, -4], [0, 9, -4], [-9, 9, -4]], [[0, 1, 2], [0, 2, 3]]
    )
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(32, 32), near=0.5)
    balls = hizvk.Spheres([(-5.0, 0, -8), (5.0, 0, -8)], 0.5)
    began = time.monotonic()
    found = hizvk.recommend(balls, camera, occluders=wall, device=device, max_seconds=2.0)
    assert time.monotonic() - began < 15.0  # mostly 2; others may use the machine
    assert 1 <= len(found.candidates) < 20
    assert found.best.kept == 1
    assert found.best.safe
    (note,) = (note for note in found.notes if note.startswith("There was no time for "))
    assert "first candidates, " in note


@pytest.mark.parametrize(("seconds", "budgets"), [(10.0, 2), (5.0, 1), (-1.0, 1)])
def test_occluders_are_selected_while_there_is_time(
    monkeypatch: pytest.MonkeyPatch, seconds: float, budgets: int
) -> None:
    """Each budget takes 3 seconds, and a single mesh none: there is nothing to select."""
    clock = Clock(image_s=0.0, compile_s=0.0, cull_s=0.0, views=1)
    asked = []

    def select(meshes: Any, *, max_triangles: int) -> Any:
        clock.now += 3.0
        asked.append(max_triangles)
        return hizvk.select_occluders(meshes, max_triangles=max_triangles)

    monkeypatch.setattr(arguments, "time", clock)
    monkeypatch.setattr(arguments, "select_occluders", select)
    corners = np.array([(0.0, 0, 0), (9, 0, 0), (0, 9, 0)])
    meshes = [hizvk.Mesh(corners, [(0, 1, 2)]), hizvk.Mesh(corners / 900.0, [(0, 1, 2)])]
    found = arguments.selections_of(meshes, 4, clock.now + seconds)
    assert asked == [4, 1][:budgets]
    assert list(found) == asked
    assert arguments.selections_of(meshes[:1], 4, math.inf) == {}
    assert len(asked) == budgets


def made(kept: int, ms: float, **more: Any) -> Candidate:
    times = spread(np.full((1, 1), ms))
    one = Configuration(footprint=kept, hierarchy=more.pop("hierarchy", None))
    return Candidate(one, times, times, kept, more.pop("on_front", False), **more)


def test_ten_rows_are_printed_and_all_on_request() -> None:
    """The best, the best of each axis and the front come before the fastest."""
    fast = [made(100 + k, 1.0 + k) for k in range(40)]
    front = [made(40 + k, 60.0 + k, on_front=True) for k in range(3)]
    best = made(30, 90.0)
    slow, lying, better = (
        made(50 + k, 80.0 + ms, hierarchy=1, hides=hides)
        for k, (ms, hides) in enumerate([(9.0, 0), (0.0, 1), (5.0, 0)])
    )
    candidates = tuple(
        sorted([*fast, *front, best, slow, lying, better], key=lambda one: one.ms.median)
    )
    found = Recommendation(
        best, True, candidates, 1000, "no adapter", axes={"hierarchy": (best, slow, lying, better)}
    )
    printed = [line for line in str(found).splitlines() if " %  " in line]
    assert [float(line.split()[1 if "*" in line else 0]) for line in printed] == [
        1, 2, 3, 4, 5, 60, 61, 62, 85, 90,
    ]  # fmt: skip
    assert "    and 37 more rows, which Recommendation.table() shows" in str(found)
    assert len([line for line in found.table().splitlines() if " %  " in line]) == 47
    assert "more row" not in found.table()
    assert found.table(46).endswith("    and 1 more row, which Recommendation.table() shows")
    for most, error in ((0, ValueError), ("all", TypeError)):
        with pytest.raises(error, match=r"^most: expected"):
            found.table(most)  # type: ignore[arg-type]
