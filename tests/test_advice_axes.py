"""What `recommend` tries one after the other: a measured row for each, and a right choice.

The scene is small, and all that shows is known by hand.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hizvk
from hizvk.measuring.configuration import Configuration, DepthVariant
from hizvk.recommendation import entry, timing

if TYPE_CHECKING:
    import numpy.typing as npt

CAMERA = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(32, 32), near=0.5)


def screen(cells: int = 8) -> hizvk.Mesh:
    """The left half of the view at depth 4, as 2 x 8 x 8 triangles."""
    x = np.linspace(-9.0, 0.0, cells + 1)
    y = np.linspace(-9.0, 9.0, cells + 1)
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    vertices = np.c_[grid, np.full(len(grid), -4.0)]
    number = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    return hizvk.Mesh(vertices, np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3))


#: Too small to hide anything, so `select_occluders` drops it.
SPECK = hizvk.Mesh([(5.0, 5, -9), (5.01, 5, -9), (5, 5.01, -9)], [[0, 1, 2]])
#: 40 balls behind the screen and 60 beside it, all of them in the view.
BEHIND, BESIDE = 40, 60
MIDDLES = np.concatenate(
    [
        np.random.default_rng(1).uniform((-5.0, -5, -8), (-1.5, 5, -7), (BEHIND, 3)),
        np.random.default_rng(2).uniform((0.5, -5, -8), (5.0, 5, -7), (BESIDE, 3)),
    ]
)
BALLS = hizvk.Spheres(MIDDLES, 0.5)


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few first candidates: each needs its own pipeline, and compiling takes the time."""
    monkeypatch.setattr(entry, "promised", first)


def first(volumes: Any, coverage: str, *, rendered: bool, **_: Any) -> list[Configuration]:
    proven = DepthVariant(1, rendered and coverage == "area")
    return [
        Configuration(volume, coverage=coverage, depth=depth)
        for volume in volumes
        for depth in (DepthVariant(), replace(proven, levels=2))
    ]


def advice(bounds: Any = BALLS, **more: Any) -> hizvk.Recommendation:
    given = {"occluders": [screen(), SPECK], "repetitions": 1, "coverage": "sample", **more}
    return hizvk.recommend(bounds, CAMERA, **given)


def say(found: hizvk.Recommendation, axis: str, *words: str) -> bool:
    """Whether the rows of an axis say these words, each its own."""
    rows = found.axes[axis][1:]
    return len(rows) == len(words) and all(
        word in str(one) for one, word in zip(rows, words, strict=True)
    )


def test_every_axis_has_measured_rows(device: hizvk.Device) -> None:
    fine, coarse = hizvk.DrawTemplate(300), hizvk.DrawTemplate(30, first_index=300)
    told: list[tuple[int, int | None]] = []
    found = advice(
        device=device,
        meshes=[hizvk.MeshLods([fine, coarse], errors=[0.0, 0.2])],
        lods=[hizvk.LodByError(1.0), hizvk.LodByError(16.0)],
        progress=lambda *step: told.append(step),
    )
    assert list(found.axes) == [
        "rasteriser",
        "max_triangles",
        "select_occluders",
        "depths",
        "hierarchy",
        "lod",
    ]
    assert say(found, "rasteriser", "drawn by device", "drawn by host")
    # Of 129 triangles.
    budgets = ("at most 64 triangles", "at most 16 triangles", "at most 4 triangles")
    assert say(found, "max_triangles", *budgets)
    # With a quarter of the triangles nothing is left.
    assert say(found, "select_occluders", "at most 129 triangles selected")
    assert say(found, "depths", "both ends")
    # A hundred balls have no box around 64 groups.
    assert say(found, "hierarchy", "flat", "groups")
    for rows in found.axes.values():
        for one in rows:
            assert one.ms.median > 0.0
            assert one.kept >= BESIDE
            assert (one.hides, one.unclear) == (0, 0)
            assert one.configuration in {each.configuration for each in found.candidates}
    # Fewer triangles hide less, and never more.
    kept = [one.kept for one in found.axes["max_triangles"]]
    assert kept[0] <= kept[1] <= kept[2] <= kept[3]
    # By hand: a ball 7 m away is 0.2 m / 7 m * 16 pixels off with an error of 0.2 m, below one
    # pixel, so the coarse level is drawn wherever an error of one pixel may show.
    for one in found.axes["lod"][1:]:
        assert one.triangles == one.kept * 10
    assert found.best.triangles == found.best.kept * 10
    assert found.best.options.lod in (hizvk.LodByError(1.0), hizvk.LodByError(16.0))
    assert told[-1][0] == told[-1][1]
    table = str(found).splitlines()
    rows = [line for line in table if " %  " in line]
    assert len(rows) == 10
    left = f"    and {len(found.candidates) - 10} more rows, which Recommendation.table() shows"
    assert left in table
    assert "one after the other, from the best so far: rasteriser (2), max_triangles (3)" in str(
        found
    )
    # The whole call is the one that was measured.
    walls = device.occluders([screen(), SPECK])
    crowd = device.instances(BALLS)
    for one in found.candidates:
        if one.selection is None and one.configuration.depth.max_triangles is None:
            assert one.cull(crowd, CAMERA, walls).count == one.kept, str(one)
    selected = found.axes["select_occluders"][1]
    assert selected.selection is not None
    assert selected.selection.kept.tolist() == [0]
    alone = device.occluders([screen()])
    assert selected.cull(crowd, CAMERA, alone).count == selected.kept


def test_a_liar_on_an_axis_is_never_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    honest, tiers = timing.cull, 1

    def lying(
        device: hizvk.Device, instances: Any, pyramid: Any, one: Configuration, base: Any
    ) -> tuple[npt.NDArray[np.bool_], float, float]:
        mask, *took = honest(device, instances, pyramid, one, base)
        if one.hierarchy == tiers:
            mask, took = mask.copy(), [0.0, 0.0]
            mask[BEHIND + 3] = False
        return mask, took[0], took[1]

    monkeypatch.setattr(timing, "cull", lying)
    found = advice()
    (liar,) = (one for one in found.axes["hierarchy"] if one.configuration.hierarchy == tiers)
    assert liar.hides == 1
    assert found.best.safe
    assert found.best.configuration.hierarchy != tiers


def test_points_that_stand_for_volumes_are_checked_by_these() -> None:
    """By hand: the ball's middle is behind the screen's edge, and half of the ball is not."""
    edge = np.array([[-0.1, 0.0, -8.0], [-4.0, 0.0, -8.0]])
    bounds = [hizvk.Spheres(edge, 0.8), hizvk.Points(edge)]
    found = advice(bounds, coverage="area", occluders=screen())
    points = [one for one in found.candidates if one.volume == "points"]
    assert points
    assert all(one.hides or one.unclear for one in points if one.kept == 0)
    assert found.best.volume == "spheres" or found.best.kept == 1


def test_bare_spheres_are_tried_as_points() -> None:
    found = advice(hizvk.Spheres(MIDDLES, 0.0), coverage="area")
    rows = found.axes["points"]
    # Conservative depth may do without the guard, so it has a row more.
    assert [one.volume for one in rows[:2]] == ["spheres", "points"]
    assert isinstance(rows[1].bounds, hizvk.Points)
    assert rows[1].kept >= BESIDE


def test_time_that_is_over_leaves_axes_out() -> None:
    began = time.monotonic()
    found = advice(max_seconds=0.0, repetitions=10_000)
    assert time.monotonic() - began < 60.0
    assert found.axes == {}
    assert len(found.candidates) == 1
    left_out = "1 of 2 first candidates, rasteriser, max_triangles, select_occluders"
    assert f"There was no time for {left_out}" in str(found)


def test_images_have_the_axes_that_need_no_occluders(device: hizvk.Device) -> None:
    image = np.full((32, 32), 50.0)
    image[:, :16] = 4.0
    found = hizvk.recommend(BALLS, CAMERA, depths=[image], kind="z", device=device, repetitions=1)
    assert list(found.axes) == ["depths", "hierarchy"]
    assert found.best.kept == BESIDE
    seen = found.best.cull(device.instances(BALLS), CAMERA, depth=image, kind="z")
    assert np.flatnonzero(seen.mask).tolist() == list(range(BEHIND, BEHIND + BESIDE))
