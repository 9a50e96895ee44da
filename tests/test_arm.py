"""ARM's scene in the demo: its rays by hand and by brute force, and what its check finds."""

import json
from pathlib import Path

import numpy as np
import pytest

from hizvk import demo
from hizvk.demo import arm as arm_demo
from hizvk.demo.arm_pictures import with_boxes
from hizvk.explanation import Verdict
from hizvk.scenes.arm import ArmScene, arm
from hizvk.scenes.scene import View
from hizvk.scenes.truth import SKY

#: Straight ahead from the middle of the clearing: -z.
AHEAD = View("ahead", (0.0, 2.0, 0.0), (0.0, 2.0, -1.0), 60.0, 1.0, up=(0.0, 1.0, 0.0), far=500.0)


def with_spheres(*spheres: tuple[float, float, float, float]) -> ArmScene:
    scene, numbers = arm(1), np.array(spheres, np.float32)
    return ArmScene(scene.prism_min, scene.prism_max, numbers[:, :3], numbers[:, 3], scene.views)


def test_the_scene_is_arms() -> None:
    scene = arm()
    assert (len(scene.prism_min), len(scene)) == (160, 13_824)
    np.testing.assert_array_equal(scene.prism_max - scene.prism_min, [[2.0, 8.0, 2.0]] * 160)
    assert 0.149 < scene.radii.min() < 0.16 < 0.29 < scene.radii.max() <= 0.3
    assert len(np.unique(scene.centers, axis=0)) == 13_824
    np.testing.assert_allclose(scene.centers.min(axis=0), [-11.35, 0.5, -11.45], rtol=1e-6)
    np.testing.assert_allclose(scene.centers.max(axis=0), [11.65, 2.8, 11.55], rtol=1e-6)
    # 64 that are stored together are neighbours.
    blocks = scene.centers.reshape(-1, 64, 3)
    np.testing.assert_allclose(np.ptp(blocks, axis=1), [[3.0, 0.3, 3.0]] * 216, rtol=1e-4)
    assert [view.name for view in arm(2).views] == ["32.5 degrees", "212.5 degrees"]


@pytest.mark.parametrize(
    ("sphere", "seen"),
    [
        ((0.0, 2.0, -4.0, 0.2), True),
        ((0.0, 2.0, -6.0, 0.2), False),  # within the prism whose face is at z = -5
        ((0.0, 2.0, -5.0, 0.2), True),
        ((0.0, 2.0, 4.0, 0.2), False),
        ((0.0, 2.0, -0.7, 0.2), False),  # before the near plane
        ((0.0, 2.0, -0.9, 0.2), True),
        ((1.8, 2.0, -7.6, 0.2), True),  # through the gap beside the prism
        ((12.0, 2.0, -4.0, 0.3), False),  # beside the picture
    ],
)
def test_rays_by_hand(sphere: tuple[float, float, float, float], seen: bool) -> None:
    assert with_spheres(sphere).look(AHEAD, (180, 320)).seen.tolist() == [seen]


def test_rays_by_brute_force() -> None:
    """Each pixel against each prism and sphere."""
    size, scene = (23, 31), arm()
    chosen = np.random.default_rng(1).permutation(len(scene))[:900]
    scene = ArmScene(
        scene.prism_min, scene.prism_max, scene.centers[chosen], scene.radii[chosen], scene.views
    )
    for view in scene.views[:3]:
        sight = scene.look(view, size)
        seen = np.zeros(len(scene), bool)
        for row, column in np.ndindex(size):
            ray, eye = view.rays(size)[row, column], np.array(view.eye)
            with np.errstate(divide="ignore"):
                a, b = (scene.prism_min - eye) / ray, (scene.prism_max - eye) / ray
            enter = np.maximum(np.minimum(a, b).max(axis=1), view.near)
            hit = enter <= np.maximum(a, b).min(axis=1)
            wall = enter[hit].min(initial=np.inf)
            assert sight.prism_depth[row, column] == pytest.approx(wall, rel=1e-12)
            # A sphere is met where |t ray - away| is its radius.
            away = scene.centers.astype(np.float64) - eye
            along = away @ ray / (ray @ ray)
            beside = np.linalg.norm(away - along[:, None] * ray, axis=1)
            reach = np.sqrt(np.maximum(scene.radii**2 - beside**2, 0.0)) / np.linalg.norm(ray)
            at = np.where(reach > 0.0, np.maximum(along - reach, view.near), np.inf)
            at[along + reach <= view.near] = np.inf
            seen |= at < wall
            owner = int(at.argmin()) if at.min() < wall else SKY
            nearest = min(at.min(), wall)
            assert sight.owner[row, column] == owner
            assert sight.depth[row, column] == pytest.approx(nearest, rel=1e-6)
        np.testing.assert_array_equal(sight.seen, seen)
        assert 0 < seen.sum() < len(scene)


def test_quick_demo(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib")
    assert demo.main(["--scene", "arm", "--quick", "--json", "--out", str(tmp_path)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told == json.loads((tmp_path / "report.json").read_text())
    assert told["passed"] is True
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "arm_00.png",
        "report.json",
        "report.md",
    ]
    conservative, plain = told["totals"]["conservative"], told["totals"]["plain"]
    assert conservative["false_culls"] == 0
    assert conservative["tested"] == plain["tested"] == 2 * 13_824
    assert conservative["seen"] == plain["seen"] > 1000
    assert conservative["seen"] < conservative["kept"] < 2 * conservative["seen"]
    # What a plain image of that size loses in the gaps between its pixels is told.
    assert 0 < plain["false_culls"] < 20
    page = (tmp_path / "report.md").read_text()
    assert f"{plain['false_culls']} of {plain['seen']:,} visible spheres culled with plain" in page


def test_a_plain_image_in_place_of_the_conservative_one_fails(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(arm_demo, "WAYS", {"plain": False, "conservative": False})
    arguments = ["--scene", "arm", "--quick", "--views", "1", "--out", str(tmp_path)]
    assert demo.main(arguments) == 1
    assert "check    FAILED: " in capsys.readouterr().out


def test_boxes_are_drawn_where_the_spheres_are() -> None:
    pytest.importorskip("PIL")
    scene = with_spheres((0.5, 2.0, -4.0, 0.2), (-0.5, 2.0, -4.0, 0.2), (0.0, 2.0, 4.0, 0.2))
    verdicts = np.array([Verdict.OCCLUDED, Verdict.VISIBLE, Verdict.OUTSIDE], np.uint8)
    black = np.zeros((90, 160, 3), np.uint8)
    red, green, blue = np.moveaxis(with_boxes(black, scene, AHEAD, verdicts), -1, 0)
    is_red, is_white = (red > 0) & (green < red), (red > 0) & (green == red) & (blue == red)
    assert is_red[:, :80].sum() == 0 < is_red[:, 80:].sum()
    assert is_white[:, 80:].sum() == 0 < is_white[:, :80].sum()


def test_trees_of_arms_scene_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        demo.main(["--scene", "arm", "--trees", "5"])
    assert caught.value.code == 2
    assert "argument --trees: the scene arm has spheres, always 13,824" in capsys.readouterr().err
