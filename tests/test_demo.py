"""The demo, its scenes, and its check, which has to find planted faults."""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest

import hizvk
from hizvk import cli, demo, scenes
from hizvk.demo import run as demo_run
from hizvk.demo.run import Culled, cull_view
from hizvk.scenes import truth

PICTURES = ("overview.png", "view.png", "depth.png", "pyramid.png", "top.png")


@pytest.fixture(scope="module")
def small_mountains() -> scenes.Scene:
    pytest.importorskip("matplotlib")
    return scenes.mountains(500, 4)


def cull(
    device: hizvk.Device, scene: scenes.Scene, view: scenes.View, size: tuple[int, int]
) -> Culled:
    terrain = device.occluders(scene.vertices, scene.triangles)
    boxes = device.instances(hizvk.Boxes(scene.box_min, scene.box_max))
    return cull_view(device, terrain, boxes, view.camera(size))


def test_trees_outside_the_view_are_counted_as_such(device: hizvk.Device) -> None:
    """With groups, many of which straddle the border of the view; float64 planes decide."""
    pytest.importorskip("matplotlib")
    scene, size = scenes.mountains(2000, 4), (90, 160)
    terrain = device.occluders(scene.vertices, scene.triangles)
    boxes = device.instances(hizvk.Boxes(scene.box_min, scene.box_max))
    changed = 0
    for view in scene.views:
        camera = view.camera(size)
        pyramid = device.pyramid(device.render_depth(terrain, camera))
        flat, grouped = (
            device.cull(boxes, camera, pyramid, hierarchy=hierarchy) for hierarchy in (False, True)
        )
        assert grouped.stats.tested_instances < len(scene)
        differs = flat.verdicts != grouped.verdicts
        assert (grouped.verdicts[differs] == hizvk.Verdict.OCCLUDED).all()
        assert (flat.verdicts[differs] == hizvk.Verdict.VISIBLE).all()
        changed += int(differs.sum())
        outside = truth._outside(scene, view, size)
        assert (grouped.verdicts[outside] == hizvk.Verdict.OUTSIDE).all()
        assert (
            grouped.stats.outside
            == int((grouped.verdicts == hizvk.Verdict.OUTSIDE).sum())
            >= outside.sum()
        )
        assert grouped.stats.occluded + grouped.stats.outside == int((~grouped.mask).sum())
    assert changed <= 8


# -- command ---------------------------------------------------------------------------------------


def test_quick_demo(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib")
    out = tmp_path / "a" / "b"
    assert cli.main(["demo", "--quick", "--json", "--out", str(out)]) == 0
    printed = capsys.readouterr()
    told = json.loads(printed.out)
    assert printed.err == f"hizvk demo: 3 views of 3,000 trees, into {out}\n"
    assert told == json.loads((out / "report.json").read_text())
    for name in PICTURES:
        assert (out / name).read_bytes().startswith(b"\x89PNG\r\n"), name
    assert sorted(path.name for path in out.iterdir()) == sorted(
        [*PICTURES, "report.json", "report.md"]
    )

    assert told["passed"] is True
    assert told["adapter"]["name"] == hizvk.Device().adapter.name
    totals = told["totals"]
    assert totals["false_culls"] == totals["broken_promises"] == 0
    assert totals["tested"] == 9000 == totals["outside"] + totals["occluded"] + totals["kept"]
    assert totals["occluded"] > 1000
    assert 0 < totals["visible"] <= totals["kept"] + totals["hairs"]
    assert totals["required"] <= totals["kept"]
    assert totals["visible"] + totals["hidden"] == 9000
    assert totals["false_keeps"] == totals["kept"] - totals["visible"] + totals["hairs"]
    assert set(told["median_ms"]) == {"render", "pyramid", "cull", "read"}
    assert all(took > 0.0 for view in told["views"] for took in view["ms"].values())
    for view in told["views"]:
        assert view["drawn"] == view["kept"]
        assert view["depth_difference"] < 1e-3  # 1e-7 on most drivers, 1e-4 on SwiftShader
        assert sum(view["levels"]) > 0
    page = (out / "report.md").read_text()
    assert "**passed: 0 of" in page
    assert told["adapter"]["name"] in page
    assert all(f"({name})" in page for name in PICTURES)


def test_the_flight_is_drawn_and_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib")
    assert (
        demo.main(["--out", str(tmp_path), "--views", "2", "--size", "96x64", "--trees", "300"])
        == 0
    )
    text = capsys.readouterr().out
    assert "of 600 (" in text
    assert "check    passed: 0 of" in text
    assert (tmp_path / "flight_00.png").exists()
    assert (tmp_path / "flight_01.png").exists()
    assert not (tmp_path / "flight_02.png").exists()


@pytest.mark.parametrize("caster", [truth.RayCaster, truth.BoxCaster])
def test_a_wrong_mask_fails(
    caster: type[truth.Caster],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("matplotlib")
    if caster is truth.RayCaster:
        pytest.importorskip("embreex")
    right = cull_view

    def wrong(*arguments: object) -> Culled:
        one = right(*arguments)  # type: ignore[arg-type]
        culled = np.zeros_like(one.mask)
        return dataclasses.replace(one, mask=culled, drawn=0)

    monkeypatch.setattr(demo_run, "cull_view", wrong)
    monkeypatch.setattr(truth, "make_caster", caster)
    assert demo.main(["--quick", "--out", str(tmp_path)]) == 1
    assert "check    FAILED: " in capsys.readouterr().out
    told = json.loads((tmp_path / "report.json").read_text())
    assert told["passed"] is False
    assert told["totals"]["false_culls"] > 0.9 * told["totals"]["visible"] > 0
    assert told["totals"]["broken_promises"] > 0
    page = (tmp_path / "report.md").read_text()
    assert "**FAILED: " in page
    assert "- View 0 culled visible trees: " in page


def test_draw_arguments_that_disagree_fail(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    right = cull_view

    def wrong(*arguments: object) -> Culled:
        one = right(*arguments)  # type: ignore[arg-type]
        return dataclasses.replace(one, drawn=one.drawn + 1)

    monkeypatch.setattr(demo_run, "cull_view", wrong)
    assert demo.main(["--quick", "--views", "1", "--out", str(tmp_path)]) == 1
    assert "FAILED: the draw arguments and the mask disagree" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--size", "960"], "expected WIDTHxHEIGHT in pixels, like 960x540, got '960'"),
        (["--size", "0x5"], "expected WIDTHxHEIGHT in pixels, like 960x540, got '0x5'"),
        (["--views", "0"], "expected a number above 0, got '0'"),
        (["--trees", "-4"], "expected a number above 0, got '-4'"),
    ],
)
def test_wrong_usage(arguments: list[str], text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        demo.main(arguments)
    assert caught.value.code == 2
    assert text in capsys.readouterr().err


@pytest.mark.parametrize("reason", ["no matplotlib", "no sample data"])
def test_without_the_elevation_model(
    reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    if reason == "no matplotlib":
        monkeypatch.setitem(sys.modules, "matplotlib.cbook", None)
    else:
        cbook = pytest.importorskip("matplotlib.cbook")

        def missing(_: str) -> None:
            raise FileNotFoundError

        monkeypatch.setattr(cbook, "get_sample_data", missing)
    assert demo.main(["--out", str(tmp_path)]) == 1
    text = capsys.readouterr().err
    assert "pip install matplotlib embreex" in text
    assert ("sample data" in text) == (reason == "no sample data")


def test_an_unusable_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    assert demo.main(["--out", str(tmp_path / "file")]) == 1
    assert capsys.readouterr().err.startswith("hizvk demo: ")


# -- scenes ----------------------------------------------------------------------------------------


def test_mountains(small_mountains: scenes.Scene) -> None:
    scene = small_mountains
    terrain = scene.terrain
    assert terrain is not None
    assert terrain.heights.shape == (344, 403)
    assert (terrain.heights.min(), terrain.heights.max()) == (236.0, 1076.0)
    assert terrain.step == pytest.approx((74.4, 92.67), rel=0.001)
    assert len(scene) == 500
    assert len(scene.triangles) == 2 * 343 * 402
    for positions in (
        scene.vertices,
        scene.instance_vertices,
        np.array([view.eye for view in scene.views]),
    ):
        relative = positions - scene.origin
        np.testing.assert_array_equal(relative, relative.astype(np.float32))
    assert (np.abs(scene.instance_vertices[:, 1]) > 4e6).all()  # where float32 has steps of 0.25 m

    trees = scene.instance_vertices.reshape(500, -1, 3)
    np.testing.assert_array_equal(scene.box_min, trees.min(axis=1))
    np.testing.assert_array_equal(scene.box_max, trees.max(axis=1))
    assert set(np.unique(scene.owner)) == set(range(500))
    middle = (scene.box_min + scene.box_max) / 2.0
    ground = terrain.height_at(middle[:, 0], middle[:, 1])
    assert (scene.box_min[:, 2] < ground).all()
    assert (scene.box_max[:, 2] > ground + 10.0).all()
    for view in scene.views:
        above = view.eye[2] - terrain.height_at(np.array(view.eye[:1]), np.array(view.eye[1:2]))[0]
        assert above > 60.0  # above every tree


def test_the_ground_between_the_corners_is_the_mesh(small_mountains: scenes.Scene) -> None:
    terrain = small_mountains.terrain
    assert terrain is not None
    vertices, triangles = terrain.mesh()
    corners = vertices[triangles[np.random.default_rng(1).integers(0, len(triangles), 2000)]]
    share = np.random.default_rng(2).dirichlet([1.0, 1.0, 1.0], 2000)
    points = np.einsum("tk,tkx->tx", share, corners)
    np.testing.assert_allclose(
        terrain.height_at(points[:, 0], points[:, 1]), points[:, 2], atol=1e-6
    )
    a, b, c = (corners[:, k] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0.0).all()  # fronts are above


def test_scenes_repeat() -> None:
    pytest.importorskip("matplotlib")
    first, again, other = (scenes.mountains(50, 2, seed=seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(first.instance_vertices, again.instance_vertices)
    assert first.views == again.views
    assert (first.box_min != other.box_min).any()
    np.testing.assert_array_equal(scenes.room(3).box_min, scenes.room(3).box_min)


def test_box_mesh() -> None:
    vertices, triangles = scenes.box_mesh(
        [[0.0, 0.0, 0.0], [5.0, 5.0, 5.0]], [[1.0, 2.0, 3.0], [6.0, 6.0, 6.0]]
    )
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    outwards = np.cross(b - a, c - a)
    centre = np.repeat([[0.5, 1.0, 1.5], [5.5, 5.5, 5.5]], 12, axis=0)
    assert (np.einsum("ij,ij->i", outwards, a - centre) > 0.0).all()
    volume = np.einsum("ij,ij->i", a, outwards).reshape(2, 12).sum(axis=1) / 6.0
    np.testing.assert_allclose(volume, [6.0, 1.0])


def test_rays_go_through_the_cameras_pixel_centres() -> None:
    size = (7, 12)
    for view in scenes.room().views:
        points = np.array(view.eye) + view.rays(size) * 4.0
        x, y, z, w = np.moveaxis(
            np.concatenate([points, np.ones((*size, 1))], axis=-1)
            @ view.camera(size).clip_from_world.T,
            -1,
            0,
        )
        np.testing.assert_allclose(
            (x / w + 1.0) / 2.0 * 12.0, np.broadcast_to(np.arange(12) + 0.5, size), atol=1e-9
        )
        np.testing.assert_allclose(
            (1.0 - y / w) / 2.0 * 7.0, np.broadcast_to(np.arange(7)[:, None] + 0.5, size), atol=1e-9
        )
        np.testing.assert_allclose(
            truth.linear_depth((z / w).astype(np.float32), view.near), 4.0, rtol=1e-6
        )


# -- check -----------------------------------------------------------------------------------------


def test_the_room_by_rays_and_by_boxes(device: hizvk.Device) -> None:
    pytest.importorskip("embreex")
    scene, size = scenes.room(), (181, 320)
    rays, boxes = truth.RayCaster(scene), truth.BoxCaster(scene)
    hidden = 0
    for view in scene.views:
        one = cull(device, scene, view, size)
        given = truth.linear_depth(one.depth, view.near)
        by_rays, by_boxes = rays.look(view, size), boxes.look(view, size, given)
        assert (by_rays.owner == by_boxes.owner).mean() > 0.999
        same = (by_rays.owner == by_boxes.owner) & (by_rays.owner >= 0)
        np.testing.assert_allclose(by_rays.depth[same], by_boxes.depth[same], rtol=1e-5)
        for sight, caster in ((by_rays, rays), (by_boxes, boxes)):
            found = truth.check(scene, view, one.mask, one.depth, sight, caster)
            assert found.passed
            assert found.comparison.visible > 20
        hidden += int((one.verdicts == hizvk.Verdict.OCCLUDED).sum())
    assert hidden > 300


@pytest.mark.parametrize("make", [truth.RayCaster, truth.BoxCaster])
def test_each_planted_fault_is_found(make: type[truth.Caster], device: hizvk.Device) -> None:
    if make is truth.RayCaster:
        pytest.importorskip("embreex")
    scene, size = scenes.room(), (90, 160)
    caster, view = make(scene), scene.views[0]
    one = cull(device, scene, view, size)
    sight = caster.look(view, size, truth.linear_depth(one.depth, view.near))
    visible = np.flatnonzero(sight.pixels(len(scene)) > 2)
    assert len(visible) > 15
    for instance in visible:
        mask = one.mask.copy()
        mask[instance] = False
        found = truth.check(scene, view, mask, one.depth, sight, caster)
        assert not found.passed
        assert found.false_culls == [instance]
        assert found.broken_promises == [instance]


def test_what_shows_by_a_hair_is_told_apart() -> None:
    pytest.importorskip("embreex")
    # Pixel (1, 1) of 3x3 looks straight ahead; a wall covers the left up to `edge` pixels beside
    # its centre.
    view = scenes.View("ahead", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 90.0, 0.25)
    size = (3, 3)
    pixel = 2.0 / 3.0  # at distance 1
    for edge, expected in ((-0.01, "hair"), (-0.2, "seen"), (0.01, "hidden")):
        wall, sides = scenes.box_mesh([[-9.0, 1.0, -9.0]], [[edge * pixel, 1.0, 9.0]])
        low, high = np.array([[-0.02, 2.0, -0.02]]), np.array([[0.02, 3.0, 0.02]])
        vertices, triangles = scenes.box_mesh(low, high)
        scene = scenes.Scene(
            name="a wall's edge",
            origin=(0.0, 0.0, 0.0),
            vertices=wall,
            triangles=sides,
            instance_vertices=vertices,
            instance_triangles=triangles,
            owner=np.zeros(12, np.int32),
            box_min=low,
            box_max=high,
            views=(view,),
        )
        caster = truth.RayCaster(scene)
        sight = caster.look(view, size)
        depth = np.zeros(size, np.float32)
        found = truth.check(scene, view, np.array([False]), depth, sight, caster)
        assert (found.false_culls, found.hairs) == {
            "hair": ([], [0]),
            "seen": ([0], []),
            "hidden": ([], []),
        }[expected]


def test_the_caster_follows_what_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scenes.room()
    monkeypatch.setattr(truth, "can_cast", lambda: False)
    assert isinstance(truth.make_caster(scene), truth.BoxCaster)
    monkeypatch.undo()
    pytest.importorskip("embreex")
    assert isinstance(truth.make_caster(scene), truth.RayCaster)


def test_boxes_in_small_parts_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, size = scenes.room(), (45, 80)
    caster, view = truth.BoxCaster(scene), scene.views[2]
    nothing = np.full(size, np.inf)
    whole = caster.look(view, size, nothing)
    monkeypatch.setattr(truth.BoxCaster, "CHUNK", 1000)
    parts = caster.look(view, size, nothing)
    np.testing.assert_array_equal(whole.owner, parts.owner)
    np.testing.assert_array_equal(whole.depth, parts.depth)
