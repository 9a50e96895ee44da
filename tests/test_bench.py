"""The bench: its report, truth, yardsticks and front, each against results worked out by hand."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import documented
import hizvk
from hizvk import cli, scenes
from hizvk.bench import (
    catalogue,
    command,
    configurations,
    numpy_hiz,
    report,
    results,
    score,
    volumes,
)
from hizvk.bench.rectangle import project, rectangle_test
from hizvk.bench.results import Row, SceneResult
from hizvk.commands.figure import can_draw
from hizvk.measuring import pareto
from hizvk.measuring.configuration import Configuration, DepthVariant
from hizvk.measuring.spread import Spread, spread
from hizvk.measuring.volumes import KINDS
from hizvk.recommendation import Candidate, choose
from hizvk.scenes import truth
from hizvk.scenes.city import city
from hizvk.scenes.embree import can_cast

ROW = {field.name for field in dataclasses.fields(Row)}
SCENE = {field.name for field in dataclasses.fields(SceneResult)}


# -- command ---------------------------------------------------------------------------------------


def run_quick(out: Path, *more: str) -> int:
    return cli.main(
        ["bench", "--quick", "--views", "2", "--instances", "300", "--out", str(out), *more]
    )


def test_a_quick_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "a" / "b"
    assert run_quick(out, "--scene", "city", "--scene", "room", "--size", "160x90", "--json") == 0
    printed = capsys.readouterr()
    told = json.loads(printed.out)
    assert told == json.loads((out / "report.json").read_text())
    assert "hizvk bench: city, 300 instances" in printed.err
    assert told["passed"] is True
    assert told["extent"] == "quick"
    assert told["seed"] == 2010
    assert told["adapter"]["name"] == hizvk.Device().adapter.name
    assert set(told["versions"]) == {"hizvk", "python", "numpy", "embreex", "platform"}
    assert [scene["key"] for scene in told["scenes"]] == ["city", "room"]
    rows = configurations.matrix("quick")
    for scene in told["scenes"]:
        assert set(scene) == SCENE
        assert scene["instances"] == 300
        assert scene["visible"] + scene["hidden"] == 600
        assert 0 < scene["visible"] <= scene["inside"] <= 600
        assert scene["size"] == [90, 160]
        assert len(scene["rows"]) > len(rows)
        for number, row in enumerate(scene["rows"]):
            assert set(row) == ROW
            assert (row["configuration"] is None) == (number >= len(rows))
            assert 0.0 <= row["hidden_kept"] <= 1.0
            assert row["kept"] >= scene["visible"] - row["false_culls"] - row["hairs"]
            hidden_kept = row["kept"] - (scene["visible"] - row["false_culls"] - row["hairs"])
            assert row["hidden_kept"] == pytest.approx(hidden_kept / scene["hidden"])
            if row["configuration"]:
                assert row["label"] == str(rows[number])
                assert row["configuration"] == dataclasses.asdict(rows[number])
                assert set(row["ms"]) == {"render", "reduce", "cull", "read"}
                for spread in (*row["ms"].values(), row["total_ms"]):
                    assert 0.0 < spread["q1"] <= spread["median"] <= spread["q3"]
                assert row["ns_per_instance"] == pytest.approx(
                    1e6 * row["ms"]["cull"]["median"] / 300
                )
                assert row["texels_per_instance"] > 0.0
                if (
                    row["configuration"]["depth"]["divisor"] == 1
                    or row["configuration"]["depth"]["conservative"]
                ):
                    assert row["false_culls"] == 0
        assert any(row["pareto"] for row in scene["rows"])
        by_label = {row["label"]: row for row in scene["rows"]}
        best = by_label["best rectangle test (float64, all pixels)"]
        assert best["share_of_rectangle"] == 1.0
        assert best["total_ms"] is None
        assert by_label["view volume alone (float64)"]["share_of_rectangle"] == 0.0
        assert by_label["boxes, 2x2"]["share_of_rectangle"] <= 1.0
        # A finished descent is a rectangle test at full resolution; margins may keep a few more.
        assert by_label["boxes, 2x2, descent"]["share_of_rectangle"] == pytest.approx(1.0, abs=0.02)
        assert by_label["numpy Hi-Z, float64"]["ms"]["render"] is not None
        assert by_label["numpy Hi-Z, float64"]["texels_per_instance"] is None
        if can_cast():
            rays = by_label["Embree, one ray per pixel"]
            assert rays["false_culls"] == rays["hairs"] == 0
            assert rays["hidden_kept"] == 0.0
    page = (out / "report.md").read_text()
    for row in rows:
        assert f" {row} |" in page or f" **{row}** |" in page
    assert "What the columns mean" in page
    way = documented.table(page, "scene", "", "once")
    assert [row["scene"] for row in way] == sorted(row["scene"] for row in way)
    assert {row[""] for row in way if row["scene"] == "room"} >= {
        "boxes, 2x2, drawn by device",
        "boxes, 2x2, drawn by host",
        "boxes, 2x2, depth 1/2 conservative",
        "numpy Hi-Z, float32",
    }
    for row in way:
        if row[""].startswith("boxes"):
            assert row["false culls"] == "0"
            assert all(
                float(row[part]) > 0.0
                for part in ("once", "render", "reduce", "cull", "read", "sum")
            )
    assert told["command"] in page
    if can_draw():
        assert (out / "city.png").read_bytes().startswith(b"\x89PNG\r\n")
        assert "(city.png)" in page


def test_an_absent_castle_is_told_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HIZVK_CASTLE", str(tmp_path / "nowhere.npz"))
    assert run_quick(tmp_path, "--scene", "castle") == 1  # nothing was measured
    assert "left out the castle is left out" in capsys.readouterr().out
    page = " ".join((tmp_path / "report.md").read_text().split())
    assert "nowhere.npz is no file" in page
    with pytest.raises(
        catalogue.Missing, match=r"here\.npz is no file; name a castle\.npz with --castle PATH"
    ):
        catalogue.find_castle(tmp_path / "here.npz")


def test_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (
        ["--scene", "moon"],
        ["--quick", "--full"],
        ["--views", "0"],
        ["--size", "4"],
    ):
        with pytest.raises(SystemExit) as caught:
            command.main(arguments)
        assert caught.value.code == 2
    assert "usage: hizvk bench" in capsys.readouterr().err


def test_speed_says_where_it_went(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        command.main(["--speed", "--quick"])
    assert caught.value.code == 2
    assert "make bench-speed" in capsys.readouterr().err


def test_recommend_is_a_function_of_the_package() -> None:
    assert callable(hizvk.recommend)
    assert hizvk.recommend.__module__ == "hizvk.recommendation.entry"


# -- configurations --------------------------------------------------------------------------------


@pytest.mark.parametrize("extent", ["quick", "default", "full"])
def test_the_matrix_has_no_row_twice_and_every_dimension(extent: str) -> None:
    rows = configurations.matrix(extent)
    assert len(set(map(str, rows))) == len(rows)
    assert {row.order for row in rows} == {"any", "stable"}
    assert {row.coverage for row in rows} == {"area", "sample"}
    assert {row.volume for row in rows} >= {"spheres", "boxes"}
    assert {row.descent > 0 for row in rows} == {True, False}
    assert not all(row.promises for row in rows), (
        "plain low resolution is what the others are compared with"
    )
    assert {row.fit for row in rows} == {"rectangle", "volume"}
    assert {row.depth.conservative for row in rows} == {True, False}


def test_which_depth_promises_for_the_view() -> None:
    depths = [DepthVariant(*one) for one in ((1, False), (1, True), (2, False), (2, True))]
    assert [Configuration(depth=depth).promises for depth in depths] == [True, True, False, True]
    assert [Configuration(depth=depth, coverage="sample").promises for depth in depths] == [
        True,
        True,
        False,
        False,
    ]
    assert DepthVariant(rasteriser="host").render_options((90, 160)) == {"rasteriser": "host"}
    assert DepthVariant(4).size((90, 161)) == (22, 40)
    assert DepthVariant(4).size((2, 1)) == (1, 1)
    assert DepthVariant().render_options((90, 160)) == {}
    assert DepthVariant(2).render_options((90, 160)) == {"size": (45, 80)}
    assert DepthVariant(2, True).render_options((90, 160)) == {
        "size": (45, 80),
        "conservative": True,
    }


# -- front -----------------------------------------------------------------------------------------


def test_the_front_of_points_by_hand() -> None:
    cost = [1.0, 2.0, 3.0, 2.0, 4.0, 1.0, np.nan]
    error = [9.0, 5.0, 5.0, 5.0, 1.0, 9.5, 0.0]
    # 2 is slower than 1 at the same error; 3 equals 1; 5 has more error than 0 at the same cost; 6
    # was not timed.
    assert pareto.front(cost, error).tolist() == [True, True, False, True, True, False, False]
    # Without 1 and 3, 2 is on it; without 4 nothing changes for the others.
    allowed = [True, False, True, False, False, True, True]
    assert pareto.front(cost, error, allowed).tolist() == [
        True,
        False,
        True,
        False,
        False,
        False,
        False,
    ]
    assert pareto.front([], []).tolist() == []


def row_of(
    ms: float, hidden_kept: float, configuration: Configuration | None, false_culls: int = 0
) -> Row:
    row = Row("", configuration, total_ms=Spread(ms, ms, ms), false_culls=false_culls)
    row.hidden_kept_in_view = hidden_kept
    return row


def test_who_competes_for_the_front() -> None:
    rows = [
        row_of(3.0, 0.3, Configuration()),
        row_of(2.0, 0.2, Configuration(coverage="sample")),  # better, but promises less
        row_of(4.0, 0.25, Configuration(coverage="sample")),
        row_of(1.0, 0.1, Configuration(depth=DepthVariant(2))),  # promises nothing for the view
        row_of(0.5, 0.0, None),  # a yardstick
        row_of(0.4, 0.0, Configuration("spheres"), false_culls=1),  # a bug
        row_of(5.0, 0.29, Configuration(depth=DepthVariant(2, True))),
        row_of(3.5, 0.3, Configuration("oriented_boxes")),
        row_of(
            6.0, 0.2896, Configuration("spheres")
        ),  # no better than the conservative one that it can be told
    ]
    cost = [row.total_ms.median for row in rows if row.total_ms]
    assert results.fronts(rows, cost) == [
        True,
        True,
        False,
        False,
        False,
        False,
        True,
        False,
        False,
    ]


def test_a_spread_is_over_the_repetitions_of_each_view() -> None:
    ms = np.array(
        [[1.0, 30.0], [20.0, 4.0], [2.0, 5.0]]
    )  # medians 2 and 5; the means of the repetitions are 15.5, 12, 3.5
    assert spread(ms) == Spread(3.5, 3.0, 14.25)
    assert spread(ms, plus=1.0) == Spread(4.5, 4.0, 15.25)


def a_report() -> tuple[report.Report, SceneResult]:
    adapter = hizvk.Adapter(0, "a", "b", "c", "vulkan", "cpu")
    scene = SceneResult(
        key="x",
        name="x",
        instances=1,
        occluder_triangles=0,
        instance_triangles=0,
        views=1,
        size=(1, 1),
        repetitions=1,
        truth="",
        visible=1,
        hidden=0,
        inside=1,
        one_instance_ms=0.0,
        upload_ms=0.0,
        way_upload_ms=0.0,
        warm_up_ms=0.0,
        rows=[row_of(1.0, 0.0, Configuration(depth=DepthVariant(2)), 7), row_of(1.0, 0.0, None, 7)],
    )
    found = report.Report("hizvk bench", 1, adapter, extent="quick")
    assert not found.passed
    found.scenes.append(scene)
    return found, scene


def test_a_broken_promise_fails_the_report() -> None:
    found, scene = a_report()
    assert found.passed
    scene.rows.append(row_of(1.0, 0.0, Configuration(), 1))
    assert not found.passed
    assert found.broken() == ["x: : 1 visible instances culled"]


def test_rasterisers_that_keep_different_numbers_fail_the_report() -> None:
    found, scene = a_report()
    for kept, depth in zip((10_000, 10_010), configurations.RASTERISERS, strict=True):
        row = row_of(1.0, 0.0, Configuration(depth=depth))
        row.label, row.kept = str(row.configuration), kept
        scene.rows.append(row)
    assert found.passed
    scene.rows[-1].kept = 9_989
    assert not found.passed
    assert found.broken() == ["x: 9,989 kept with the host's rasteriser, 10,000 with the device's"]
    scene.rows[-2].kept, scene.rows[-1].kept = 3, 4  # a single instance of few is no sign
    assert found.passed
    scene.rows[-1].kept = 5
    assert not found.passed


# -- truth -----------------------------------------------------------------------------------------


def two_boxes() -> scenes.Scene:
    """A wall at distance 10 over the left half, and four boxes.

    They are behind it, beside it, in front of it, and behind the eye.
    """
    wall, sides = scenes.box_mesh([[-40.0, 10.0, -40.0]], [[0.0, 10.5, 40.0]])
    low = np.array([[-6.0, 20.0, -1.0], [5.0, 20.0, -1.0], [-2.0, 4.0, -1.0], [-1.0, -9.0, -1.0]])
    vertices, triangles = scenes.box_mesh(low, low + 2.0)
    view = scenes.View("ahead", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 90.0, 0.25)
    return scenes.Scene(
        name="a wall",
        origin=(0.0, 0.0, 0.0),
        vertices=wall,
        triangles=sides,
        instance_vertices=vertices,
        instance_triangles=triangles,
        owner=np.repeat(np.arange(4, dtype=np.int32), 12),
        box_min=low,
        box_max=low + 2.0,
        views=(view,),
    )


def test_planted_false_culls_and_false_keeps_are_counted(device: hizvk.Device) -> None:
    scene, size = two_boxes(), (64, 64)
    view, caster = scene.views[0], truth.make_caster(scene)
    depth = device.render_depth(
        device.occluders(scene.vertices, scene.triangles), view.camera(size)
    ).numpy()
    told = score.look(scene, view, size, depth, caster)
    assert told.visible.tolist() == [False, True, True, False]
    assert told.projected.inside.tolist() == [True, True, True, False]
    assert told.rectangle.tolist() == [False, True, True, False]
    masks = [[0, 1, 1, 0], [1, 1, 1, 1], [0, 0, 1, 0], [1, 0, 0, 1]]
    rows = [Row(str(number), Configuration()) for number in range(4)]
    score.score(rows, [[np.array(mask, bool)] for mask in masks], [told], caster)
    assert [row.kept for row in rows] == [2, 4, 1, 2]
    assert [row.false_culls for row in rows] == [0, 0, 1, 2]
    assert [row.hairs for row in rows] == [0, 0, 0, 0]
    assert [row.hidden_kept for row in rows] == [0.0, 1.0, 0.0, 1.0]
    assert [row.hidden_kept_in_view for row in rows] == [0.0, 1.0, 0.0, 1.0]
    assert [row.share_of_rectangle for row in rows] == [1.0, 0.0, 2.0, 2.0]


def test_the_best_rectangle_test_by_hand() -> None:
    # 90 degrees, 8x8 pixels: at depth z a column is z / 4 wide.
    scene, size = two_boxes(), (8, 8)
    seen = project(scene, scene.views[0], size)
    # Box 1: x from 5 to 7, y from 20 to 22, z from -1 to 1.
    np.testing.assert_allclose(
        seen.rectangle[1], [4.0 + 4 * 5 / 22, 4.0 - 4 / 20, 4.0 + 4 * 7 / 20, 4.0 + 4 / 20]
    )
    assert seen.nearest.tolist() == [20.0, 20.0, 4.0, -9.0]
    assert seen.crosses.tolist() == [False, False, False, True]
    everywhere = np.full(size, 19.0)
    assert rectangle_test(seen, everywhere).tolist() == [False, False, True, False]
    assert rectangle_test(seen, np.full(size, 20.0)).tolist() == [True, True, True, False]
    hole = everywhere.copy()
    hole[3, 5] = np.inf  # box 1 covers the columns 4 and 5, box 0 the columns 2 and 3
    assert rectangle_test(seen, hole).tolist() == [False, True, True, False]
    hole[3, 5], hole[3, 6] = 19.0, np.inf
    assert rectangle_test(seen, hole).tolist() == [False, False, True, False]


def test_far_planes_cut_what_rays_see() -> None:
    pytest.importorskip("embreex")
    scene = two_boxes()
    near, far = (
        dataclasses.replace(scene.views[0], near=near, far=far)
        for near, far in ((0.25, 15.0), (15.0, 40.0))
    )
    caster = truth.RayCaster(scene)
    # The wall lies before the second view's near plane, box 1 behind the first one's far plane.
    assert (caster.look(near, (64, 64)).pixels(4) > 0).tolist() == [False, False, True, False]
    assert (caster.look(far, (64, 64)).pixels(4) > 0).tolist() == [True, True, False, False]


# -- yardsticks ------------------------------------------------------------------------------------


def test_the_numpy_pyramid_by_hand() -> None:
    depth = np.array(
        [[0.9, 0.8, 0.7], [0.6, 0.5, 0.4], [0.3, 0.2, 0.1], [0.9, 0.9, 0.9], [0.5, 0.9, 0.9]]
    )
    made = numpy_hiz.NumpyPyramid.build(depth)
    assert list(zip(made.height.tolist(), made.width.tolist(), strict=True)) == [
        (5, 3),
        (3, 2),
        (2, 1),
        (1, 1),
    ]
    assert made.texels[15:].tolist() == [0.5, 0.4, 0.2, 0.1, 0.5, 0.9, 0.1, 0.5, 0.1]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_numpy_cull_by_hand(dtype: type[Any]) -> None:
    scene, size = two_boxes(), (16, 16)
    view = scene.views[0]
    matrix = view.camera(size).clip_from_world.astype(dtype)
    low, high = scene.box_min.astype(dtype), scene.box_max.astype(dtype)

    def kept(depth: np.ndarray) -> list[bool]:
        return numpy_hiz.cull(
            low, high, matrix, numpy_hiz.NumpyPyramid.build(depth.astype(dtype)), view.near
        ).tolist()

    def at(distance: float) -> float:
        return view.near / distance

    assert kept(np.zeros(size)) == [True, True, True, False]
    assert kept(np.full(size, at(10.0))) == [False, False, True, False]
    assert kept(np.full(size, at(3.0))) == [False, False, False, False]
    left = np.zeros(size)
    left[:, :8] = at(10.0)
    assert kept(left) == [False, True, True, False]
    # A hole of one pixel in the columns 5 and 6, which box 0 covers: 8 + 8 * (-6 .. -4) / (20 ..
    # 22).
    left[8, 6] = 0.0
    assert kept(left) == [True, True, True, False]
    # Columns 1 to 4 are three texels of level 1, and a hole in the middle one shows on level 2
    # alone.
    low, high = np.array([[-6.5, 8.0, 0.1]], dtype), np.array([[-3.5, 8.0, 0.2]], dtype)
    wall = np.full(size, at(5.0))
    assert kept(wall) == [False]
    wall[7, 3] = 0.0
    assert kept(wall) == [True]


def test_rays_see_what_the_truth_sees() -> None:
    pytest.importorskip("embreex")
    from hizvk.bench.rays import Rays

    scene, size = two_boxes(), (64, 64)
    rays = Rays(scene)
    assert rays.image(scene.views[0], size).tolist() == [False, True, True, False]
    assert rays.points(scene.views[0], size).tolist() == [False, True, True, False]
    clipped = dataclasses.replace(scene.views[0], far=15.0)
    assert rays.image(clipped, size).tolist() == [False, False, True, False]


# -- scenes ----------------------------------------------------------------------------------------


def test_the_city_repeats_and_can_stand_far_away() -> None:
    near, again, other = city(200, 4, seed=1), city(200, 4, seed=1), city(200, 4, seed=2)
    far = city(200, 4, seed=1, corner=catalogue.FAR_CORNER)
    np.testing.assert_array_equal(near.scene.box_min, again.scene.box_min)
    assert not np.array_equal(near.scene.box_min, other.scene.box_min)
    np.testing.assert_array_equal(near.scene.box_min + catalogue.FAR_CORNER, far.scene.box_min)
    np.testing.assert_array_equal(near.scene.vertices + catalogue.FAR_CORNER, far.scene.vertices)
    for one in (near, far):
        assert len(one.scene) == 200 == len(one.yaw)
        assert np.array_equal(np.unique(one.scene.owner), np.arange(200))
        # Exact in float32 about the origin, for the rays.
        local = one.scene.instance_vertices - one.scene.origin
        np.testing.assert_array_equal(local.astype(np.float32).astype(np.float64), local)
        corner = one.scene.vertices[0]
        for view in one.scene.views:
            assert 1.6 < view.eye[2] - corner[2] - 1.0 < 1.8  # the ground is a slab of one metre


@pytest.mark.parametrize("kind", tuple(KINDS))
@pytest.mark.parametrize("known", [True, False])
def test_bounds_contain_their_vertices(kind: str, known: bool) -> None:
    made = city(120, 1, corner=catalogue.FAR_CORNER)
    scene = made.scene
    bounds = volumes.bounds_of(scene, kind, yaw=made.yaw if known else None)
    corner = scene.instance_vertices[scene.instance_triangles]
    owner = np.repeat(scene.owner, 3)
    point = corner.reshape(-1, 3)
    if isinstance(bounds, hizvk.Spheres):
        away = np.linalg.norm(point - bounds.centers[owner], axis=1)
        assert (away <= bounds.radii[owner]).all()
        assert away.max() > 0.99 * bounds.radii.max()
    elif isinstance(bounds, hizvk.Boxes):
        assert ((bounds.min[owner] <= point) & (point <= bounds.max[owner])).all()
    else:
        local = np.einsum("ni,nik->nk", point - bounds.centers[owner], bounds.rotations[owner])
        assert (np.abs(local) <= bounds.half_sizes[owner]).all()
        np.testing.assert_allclose(
            np.einsum("nki,nkl->nil", bounds.rotations, bounds.rotations),
            np.broadcast_to(np.eye(3), (120, 3, 3)),
            atol=1e-12,
        )
        turned = np.prod(2.0 * bounds.half_sizes, axis=1)
        straight = np.prod(scene.box_max - scene.box_min, axis=1)
        assert np.median(turned / straight) < 0.95


def castle_file(path: Path, **changes: Any) -> Path:
    """A file in the castle's format with two_boxes() in it, y up."""
    scene = two_boxes()
    turn = [0, 2, 1]  # z up to y up; mirrored, which no test minds
    first = np.arange(5) * 12
    data = {
        "name": "two boxes",
        "source": "a test",
        "license": "none",
        "up": np.array([0.0, 1.0, 0.0]),
        "occluder_vertices": scene.vertices[:, turn].astype(np.float32),
        "occluder_triangles": scene.triangles,
        "occluder_instance": np.full(12, -1, np.int32),
        "instance_aabb_min": scene.box_min[:, turn],
        "instance_aabb_max": scene.box_max[:, turn],
        "instance_vertices": scene.instance_vertices[:, turn],
        "instance_triangles": scene.instance_triangles,
        "instance_first_triangle": first,
        "camera_name": np.array(["a", "b", "c"]),
        "camera_eye": np.zeros((3, 3)),
        "camera_target": np.array([[0.0, 0.0, 1.0]] * 3),
        "camera_up": np.array([[0.0, 1.0, 0.0]] * 3),
        "camera_fov_y": np.full(3, np.pi / 2.0),
        "camera_near": np.full(3, 0.25),
        "camera_far": np.array([15.0, 50.0, 60.0]),
    } | changes
    np.savez(path, **{key: value for key, value in data.items() if value is not None})
    return path


def test_a_castle_is_read(tmp_path: Path) -> None:
    bench = catalogue.load_castle(castle_file(tmp_path / "castle.npz"), 2)
    assert bench.up == 1
    assert [view.name for view in bench.scene.views] == ["a", "c"]
    assert [view.far for view in bench.scene.views] == [15.0, 60.0]
    assert bench.scene.views[0].fov_y_deg == pytest.approx(90.0)
    assert bench.scene.name == "two boxes (a, none)"
    caster = truth.make_caster(bench.scene)
    given = np.full((32, 32), 10.0)
    given[:, 16:] = np.inf
    seen = [
        (caster.look(view, (32, 32), given[:, ::-1]).pixels(4) > 0).sum()
        for view in bench.scene.views
    ]
    assert seen[0] < seen[1], "the near far plane cuts the boxes behind it away"
    with pytest.raises(catalogue.Missing, match="camera_near"):
        catalogue.load_castle(castle_file(tmp_path / "b.npz", camera_near=None), 2)
    with pytest.raises(catalogue.Missing, match="occluders that are instances as well"):
        catalogue.load_castle(
            castle_file(tmp_path / "c.npz", occluder_instance=np.zeros(12, np.int32)), 2
        )


# -- recommend -------------------------------------------------------------------------------------


def candidate(ms: float, kept: int) -> Candidate:
    return Candidate(Configuration(), Spread(ms, ms, ms), Spread(ms, ms, ms), kept, False)


def test_choosing_by_hand() -> None:
    fast, middle, slow = candidate(1.0, 200), candidate(2.0, 104), candidate(3.0, 100)
    several = [slow, fast, middle]
    assert choose(several) == (middle, True)  # 104 is within 5 % of 100
    assert choose(several, kept_within=1.0) == (slow, True)
    assert choose(several, kept_within=2.0) == (fast, True)
    assert choose(several, max_ms=2.5, kept_within=1.0) == (middle, True)
    assert choose(several, max_ms=1.5) == (fast, True)
    assert choose(several, max_ms=0.5) == (fast, False)


def test_recommend_on_a_scene(device: hizvk.Device) -> None:
    scene = two_boxes()
    cameras = [view.camera((48, 64)) for view in scene.views]
    boxes = hizvk.Boxes(scene.box_min, scene.box_max)
    spheres = device.instances(hizvk.Spheres((scene.box_min + scene.box_max) / 2.0, np.sqrt(3.0)))
    wall = hizvk.Mesh(scene.vertices, scene.triangles)
    found = hizvk.recommend([boxes, spheres], cameras, occluders=wall, device=device, repetitions=2)
    assert isinstance(found, hizvk.Recommendation)
    assert found.tested == 4
    assert {one.volume for one in found.candidates} == {"boxes", "spheres"}
    assert [one.ms.median for one in found.candidates] == sorted(
        one.ms.median for one in found.candidates
    )
    assert all(one.configuration.promises for one in found.candidates)
    assert all(2 <= one.kept <= 3 for one in found.candidates), "boxes 1 and 2 are visible"
    assert min(one.kept for one in found.candidates) == 2
    assert found.best.kept == 2
    assert found.best in found.front or found.best.ms.median > found.front[0].ms.median
    assert found.within_budget
    assert str(found).startswith(f"on {device.adapter}: {found.best}\n")
    # What it recommends can be passed on as it is.
    depth = device.render_depth(
        device.occluders([wall]), cameras[0], **found.best.render_options(cameras[0].size)
    )
    bounds = spheres if found.best.volume == "spheres" else device.instances(boxes)
    assert (
        device.cull(bounds, depth.camera, device.pyramid(depth), **found.best.cull_options).count
        == 2
    )

    image = device.render_depth(device.occluders([wall]), cameras[0]).numpy()
    by_image = hizvk.recommend(
        boxes,
        cameras[0],
        depths=[image],
        kind="reversed_ndc",
        device=device,
        repetitions=1,
        max_ms=1e-6,
        coverage="sample",
    )
    assert not by_image.within_budget
    assert "over the budget" in str(by_image)
    assert by_image.best is by_image.candidates[0]
    assert {one.configuration.coverage for one in by_image.candidates} == {"sample"}
    assert {one.configuration.depth.image() for one in by_image.candidates} == {DepthVariant()}


def test_recommend_refuses_what_does_not_fit(device: hizvk.Device) -> None:
    view = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(6, 8), near=0.1)
    spheres, image = hizvk.Spheres(np.zeros((2, 3)), 1.0), np.ones((6, 8))
    wall = hizvk.Mesh(np.eye(3), [[0, 1, 2]])
    foreign = hizvk.Device().instances(spheres)

    def refused(error: type[Exception], text: str, *arguments: Any, **more: Any) -> None:
        with pytest.raises(error) as caught:
            hizvk.recommend(*arguments, **{"device": device, **more})
        assert text in str(caught.value)

    refused(
        TypeError, "occluders, depths: expected exactly one of them, got neither", spheres, view
    )
    refused(
        TypeError,
        "kind: expected nothing beside occluders, got str 'z'",
        spheres,
        view,
        occluders=wall,
        kind="z",
    )
    refused(
        TypeError,
        "occluders: expected Occluders, a Mesh, a mesh of trimesh",
        spheres,
        view,
        occluders="wall",
    )
    refused(ValueError, "bounds: expected Instances of this device", foreign, view, occluders=wall)
    refused(
        ValueError,
        "occluders: expected Occluders of this device",
        spheres,
        view,
        occluders=hizvk.Device().occluders([wall]),
    )
    refused(
        ValueError,
        "depths: expected 1 images, one for each camera, got 2",
        spheres,
        view,
        depths=[image, image],
        kind="z",
    )
