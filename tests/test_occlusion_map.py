"""Hierarchical occlusion maps: sums by numpy, exact fractions, and a fence of small occluders."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import documented
import hizvk
from hizvk.bench import maps as bench
from hizvk.scenes.fence import PARTS, fence

if TYPE_CHECKING:
    from pathlib import Path

CAMERA = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(480, 640), near=0.1)


def planks(hole: float) -> tuple[Any, list[hizvk.Mesh]]:
    """The scene of the fence, and a mesh for each plank."""
    scene = fence(200, 1, hole=hole)
    each = 12 * PARTS
    count = len(scene.triangles) // each
    meshes = [
        hizvk.Mesh(scene.vertices, scene.triangles[each * k : each * (k + 1)]) for k in range(count)
    ]
    return scene, meshes


def blobs(seed: int, count: int = 60) -> list[hizvk.Mesh]:
    """Tetrahedra before the camera."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        z = rng.uniform(3.0, 30.0)
        middle = [rng.uniform(-1.3, 1.3) * z, rng.uniform(-1.0, 1.0) * z, -z]
        corners = rng.normal(0.0, 0.08 * z, (4, 3)) + middle
        found.append(hizvk.Mesh(corners, [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]))
    return found


@pytest.mark.parametrize(
    ("size", "least", "levels"), [((256, 256), 4, 7), ((64, 256), 1, 7), ((32, 8), 8, 1)]
)
def test_opacities_are_exact(
    device: hizvk.Device, size: tuple[int, int], least: int, levels: int
) -> None:
    walls = device.occluders(blobs(3))
    maps = device.occlusion_map(walls, CAMERA, size=size, least=least, regions=8)
    depth = device.render_depth(walls, CAMERA, size=size, rasteriser="host").numpy()
    covered = (depth > 0).astype(np.uint32)
    assert 0 < covered.sum() < covered.size
    assert (maps.num_levels, maps.size) == (levels, size)
    for level in range(levels):
        side = 2**level
        blocks = covered.reshape(size[0] // side, side, size[1] // side, side)
        expected = blocks.sum(axis=(1, 3))
        assert maps.level(level).dtype == np.uint32
        np.testing.assert_array_equal(maps.level(level), expected)
        np.testing.assert_array_equal(maps.opacity(level), expected / side**2)
    np.testing.assert_array_equal(maps.level(-1), maps.level(levels - 1))


@pytest.mark.parametrize("hole", [0, 1, 4, 16, 64, 100])
def test_thresholds_are_exact_fractions(device: hizvk.Device, hole: int) -> None:
    maps = device.occlusion_map(device.occluders(blobs(4)), CAMERA)
    opacity = None
    for level, least in enumerate(maps.least_counts(hole).tolist()):
        if opacity is not None:
            opacity = (3 + opacity) / 4
        elif Fraction(hole, 4**level) <= Fraction(1, 16):
            opacity = 1 - Fraction(hole, 4**level)
        wanted = Fraction(1) if opacity is None else opacity
        assert Fraction(least, 4**level) >= wanted > Fraction(least - 1, 4**level)
    if hole == 4:  # the text's example: 2x2 of 8x8, and the level above
        assert [Fraction(15, 16), Fraction(63, 64)] == [
            Fraction(int(least), 4**level)
            for level, least in enumerate(maps.least_counts(4))
            if level in (3, 4)
        ]


def test_a_fence_hides_what_no_plank_hides(device: hizvk.Device) -> None:
    scene, meshes = planks(hole=0.0)
    camera = scene.views[0].camera((256, 256))
    boxes = hizvk.Boxes(scene.box_min, scene.box_max)

    def hidden(which: list[hizvk.Mesh], **more: Any) -> int:
        maps = device.occlusion_map(device.occluders(which), camera, **more)
        return int((device.cull_map(boxes, camera, maps).verdicts == hizvk.Verdict.OCCLUDED).sum())

    assert all(hidden([mesh]) == 0 for mesh in meshes)
    together = hidden(meshes)
    assert together > 150
    # The database keeps the planks, and a limit takes the middle ones first.
    kept = hizvk.select_occluders(meshes).kept
    assert len(kept) == len(meshes)
    assert hidden([meshes[k] for k in kept]) == together
    assert 0 < hidden(meshes, max_occluders=14) < together


def test_negligible_holes_trade_hidden_for_visible(device: hizvk.Device) -> None:
    scene, meshes = planks(hole=0.046875)
    camera = scene.views[0].camera((256, 256))
    boxes = hizvk.Boxes(scene.box_min, scene.box_max)
    maps = device.occlusion_map(device.occluders(meshes), camera)
    answers = [device.cull_map(boxes, camera, maps, negligible_px=n) for n in (0, 1, 4, 16)]
    counts = [seen.count for seen in answers]
    assert counts[0] > counts[1] > counts[2]
    assert answers[0].holes.sum() == 0
    assert answers[0].lookups > answers[2].lookups > 0
    for seen in answers:
        assert seen.approximate
        assert not seen.holes[seen.mask].any()
        np.testing.assert_array_equal(np.flatnonzero(seen.mask), seen.indices)
    assert answers[2].holes.max() > 0
    assert repr(answers[2]) == "<MapResult of 200 instances, 4 px negligible>"


def test_the_estimate_is_the_farthest_vertex_of_boxes(device: hizvk.Device) -> None:
    """Two slanted walls in the middle, the larger one farther away."""
    low, high = hizvk.scenes.box_mesh([[-1, -1, -6]], [[1, 1, -4]])
    near = hizvk.Mesh(low, high)
    far = hizvk.Mesh(*hizvk.scenes.box_mesh([[-2, -2, -30]], [[2, 2, -20]]))
    maps = device.occlusion_map(device.occluders([near, far]), CAMERA)
    assert maps.chosen.tolist() == [0, 1]
    estimate = maps.estimate
    assert estimate.shape == (64, 64)
    assert estimate[32, 32] == pytest.approx(30.0)
    # At 1/5 of the half width the near box is alone: the far one ends at 2/20.
    assert estimate[32, 32 + 6] == pytest.approx(6.0)
    assert np.isinf(estimate[0, 0])


def test_drawn_occluders_are_never_culled(device: hizvk.Device) -> None:
    """Three boxes in a row: the first hides the others, which are occluders as well."""
    ends = [([-2, -2, -4], [2, 2, -3]), ([-0.5, -0.5, -8], [0.5, 0.5, -7])]
    ends.append(([-0.5, -0.5, -12], [0.5, 0.5, -11]))
    meshes = [hizvk.Mesh(*hizvk.scenes.box_mesh([low], [high])) for low, high in ends]
    boxes = hizvk.Boxes([low for low, _ in ends], [high for _, high in ends])
    walls = device.occluders(meshes[:2])
    maps = device.occlusion_map(walls, CAMERA, max_occluders=1)
    assert maps.chosen.tolist() == [0]
    assert device.cull_map(boxes, CAMERA, maps).mask.tolist() == [True, False, False]
    both = device.occlusion_map(walls, CAMERA)
    copies = np.array([0, 1, hizvk.ABSENT])
    assert device.cull_map(boxes, CAMERA, both, copies=copies).mask.tolist() == [True, True, False]
    spheres = hizvk.Spheres([(0, 0, -20), (0, 0, 20), (np.nan, 0, 0)], 0.5)
    assert device.cull_map(spheres, CAMERA, both).verdicts.tolist() == [
        hizvk.Verdict.OCCLUDED,
        hizvk.Verdict.OUTSIDE,
        hizvk.Verdict.INVALID,
    ]


def test_nothing_certified_takes_a_map(device: hizvk.Device) -> None:
    maps = device.occlusion_map(device.occluders(blobs(5)), CAMERA)
    things = device.instances(hizvk.Spheres([(0, 0, -5)], 0.5))
    with pytest.raises(TypeError, match="pyramid: expected a Pyramid"):
        device.cull(things, CAMERA, maps)  # type: ignore[call-overload]
    assert not hasattr(hizvk.CullResult, "approximate")
    with pytest.raises(ValueError, match="maps: expected an OcclusionMap of this device"):
        hizvk.Device().cull_map(hizvk.Points([(0.0, 0.0, -5.0)]), CAMERA, maps)


def test_the_bench_leaves_curve_maps_and_buffer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib", reason="pictures need matplotlib (pip install matplotlib)")
    monkeypatch.setattr(bench, "PICTURE", 256)  # the larger picture takes seconds
    found = bench.run(tmp_path, keys=["fence"], instances=40, views=1)
    assert found.passed
    (scene,) = found.scenes
    assert [row.negligible_px for row in scene.rows] == [0, 1, 4, 16, 64, None, None]
    exact = scene.rows[0]
    assert (exact.lost, exact.pixels) == (0, 0)
    assert scene.rows[2].hidden_kept < exact.hidden_kept
    sides = [256, 128, 64, 32, 16, 8, 4]
    names = [f"fence-map-{side}.png" for side in sides]
    for name in [*names, "fence-maps.png", "fence-estimate.png", "curve.png", "report.md"]:
        assert (tmp_path / name).stat().st_size > 60


@pytest.mark.slow
@pytest.mark.parametrize("scene", bench.NAMES)
def test_the_page_quotes_the_command(tmp_path: Path, scene: str) -> None:
    """If this is red, put the numbers of ``hizvk bench --maps`` into docs/methods.md."""
    text = documented.page("methods.md")
    if not documented.is_of_this_driver(text):
        pytest.skip(f"docs/methods.md was printed on another driver than {hizvk.Device().adapter}")
    (found,) = bench.run(tmp_path, keys=[scene]).scenes
    printed = {(scene, *bench.cells(row)[:6]) for row in found.rows}
    shown = {
        tuple(row.values())
        for row in documented.table(text, "scene", "way")
        if row["scene"] == scene
    }
    assert len(shown) >= 4
    assert shown <= printed
