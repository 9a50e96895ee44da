"""Bins by mesh and level of detail: what a cull lists is what a loop over its mask finds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hizvk

N = 3000
LODS = (3, 1, 2)
RULE = hizvk.LodByDistance([20.0, 40.0])


def _camera() -> hizvk.Camera:
    return hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(90, 160), near=0.1)


def _meshes() -> list[hizvk.MeshLods]:
    draws = [[hizvk.DrawTemplate(100 * m + k + 1) for k in range(n)] for m, n in enumerate(LODS)]
    return [hizvk.MeshLods(of_mesh, errors=np.arange(len(of_mesh)) / 10) for of_mesh in draws]


class Scene:
    """A crowd before and behind a wall at 50 m; some of it is absent."""

    def __init__(self, device: hizvk.Device) -> None:
        random = np.random.default_rng(3)
        depth = random.uniform(5, 100, N)
        at = random.uniform(-0.4, 0.4, (N, 2)) * depth[:, None]
        self.depth, self.radius = depth, 0.25
        self.bounds = hizvk.Spheres(np.column_stack([at, -depth]), self.radius)
        self.ids = random.integers(0, len(LODS), N).astype(np.uint32)
        self.ids[random.random(N) < 0.1] = hizvk.ABSENT
        self.crowd = device.instances(self.bounds, mesh_ids=self.ids)
        self.camera = _camera()
        self.pyramid = device.pyramid(np.full(self.camera.size, 50.0), self.camera, kind="z")

    def lods(self, kept: Any) -> Any:
        """By the definition: how many thresholds all of the ball is beyond."""
        w = self.depth - self.radius
        lods = (w > 20.0).astype(int) + (w > 40.0)
        most = np.array([*LODS, 1])[np.minimum(self.ids, len(LODS))]
        return np.where(kept, np.minimum(lods, most - 1), hizvk.NO_LOD)


@pytest.fixture(scope="module")
def scene(device: hizvk.Device) -> Scene:
    return Scene(device)


def _bins(scene: Scene, mask: Any) -> dict[tuple[int, int], list[int]]:
    """Indices of each bin, ascending."""
    bins: dict[tuple[int, int], list[int]] = {
        (m, k): [] for m, n in enumerate(LODS) for k in range(n)
    }
    for i, (kept, lod) in enumerate(zip(mask, scene.lods(mask), strict=True)):
        if kept:
            bins[int(scene.ids[i]), int(lod)].append(i)
    return bins


@pytest.mark.parametrize("placement", ["packed", "reserved"])
def test_bins_are_what_a_loop_finds(device: hizvk.Device, scene: Scene, placement: Any) -> None:
    plain = device.cull(scene.crowd, scene.camera, scene.pyramid)
    seen = device.cull(
        scene.crowd, scene.camera, scene.pyramid, meshes=_meshes(), placement=placement, lod=RULE
    )
    assert 0.1 < plain.mask.mean() < 0.6
    np.testing.assert_array_equal(seen.mask, plain.mask)
    np.testing.assert_array_equal(seen.verdicts, plain.verdicts)
    np.testing.assert_array_equal(seen.indices, np.flatnonzero(plain.mask))
    np.testing.assert_array_equal(seen.lods, scene.lods(plain.mask))
    bins = _bins(scene, plain.mask)
    assert all(bins.values())
    for (mesh, lod), expected in bins.items():
        np.testing.assert_array_equal(seen.bin(mesh=mesh, lod=lod), expected)
    draws = seen.draws
    assert seen.draw_count == len(bins)
    assert len(draws) == len(LODS) * max(LODS)
    used = draws[draws["instance_count"] > 0]
    assert used["index_count"].tolist() == [100 * m + k + 1 for m, k in sorted(bins)]
    assert used["instance_count"].tolist() == [len(bins[bin_]) for bin_ in sorted(bins)]
    if placement == "packed":
        assert not draws[len(bins) :].view(np.uint8).any()
        ends = used["first_instance"] + used["instance_count"]
        assert ends.max() == seen.count == plain.mask.sum()
    else:
        assert not draws["first_instance"].any()
    assert seen.explain(int(np.flatnonzero(scene.ids == hizvk.ABSENT)[0])).reason.startswith(
        "absent"
    )


def test_a_draw_for_each_instance(device: hizvk.Device, scene: Scene) -> None:
    seen = device.cull(
        scene.crowd, scene.camera, scene.pyramid, meshes=_meshes(), emit="instances", lod=RULE
    )
    kept = np.flatnonzero(seen.mask)
    assert seen.draw_count == len(kept) == seen.count
    draws, lods = seen.draws[: len(kept)], scene.lods(seen.mask)
    assert draws["first_instance"].tolist() == list(range(len(kept)))
    np.testing.assert_array_equal(draws["index_count"], 100 * scene.ids[kept] + lods[kept] + 1)
    assert not seen.draws[len(kept) :].view(np.uint8).any()
    with pytest.raises(ValueError, match='expected emit="bins", got emit="instances"'):
        seen.bin(mesh=0, lod=0)


def test_a_capacity_cuts_the_coarsest(device: hizvk.Device, scene: Scene) -> None:
    at = (scene.crowd, scene.camera, scene.pyramid)
    whole = device.cull(*at, meshes=_meshes(), lod=RULE)
    finest = int((whole.lods == 0).sum())
    seen = device.cull(*at, meshes=_meshes(), lod=RULE, capacity=finest + 5)
    assert (seen.count, seen.demand) == (finest + 5, whole.demand)
    listed = [seen.bin(mesh=m, lod=k) for m, n in enumerate(LODS) for k in range(n)]
    counts = np.bincount(seen.lods[np.concatenate(listed)], minlength=3)
    assert counts.tolist() == [finest, 5, 0]
    np.testing.assert_array_equal(seen.mask, whole.mask)


@pytest.mark.parametrize("wait", [True, False])
@pytest.mark.parametrize("outputs", [["indices"], ["indices", "mask"]])
def test_indices_are_what_the_bins_list(
    device: hizvk.Device, scene: Scene, outputs: Any, wait: bool
) -> None:
    """Also where a capacity cuts the coarsest, and where there is no mask to make them from."""
    at = (scene.crowd, scene.camera, scene.pyramid)
    for capacity in (None, 200):
        seen = device.cull(
            *at, meshes=_meshes(), lod=RULE, capacity=capacity, outputs=outputs, wait=wait
        )
        listed = [seen.bin(mesh=m, lod=k) for m, n in enumerate(LODS) for k in range(n)]
        np.testing.assert_array_equal(seen.indices, np.sort(np.concatenate(listed)))


def test_a_mask_tells_no_bins(device: hizvk.Device, scene: Scene) -> None:
    at = (scene.crowd, scene.camera, scene.pyramid)
    seen = device.cull(*at, meshes=_meshes(), lod=RULE, outputs=["mask"])
    for read in (lambda: seen.draws, lambda: seen.lods, lambda: seen.bin(mesh=0, lod=0)):
        with pytest.raises(ValueError, match="asked for draws or indices, got one with mask"):
            read()


def test_any_order_is_for_one_mesh(device: hizvk.Device, scene: Scene) -> None:
    crowd = device.instances(scene.bounds)
    at = (crowd, scene.camera, scene.pyramid)
    tree = [hizvk.MeshLods([hizvk.DrawTemplate(36)] * 3)]
    whole = device.cull(*at, meshes=tree, lod=RULE)
    seen = device.cull(*at, meshes=tree, lod=RULE, placement="reserved", order="any")
    for k in range(3):
        expected = whole.bin(mesh=0, lod=k)
        assert np.sort(seen.bin(mesh=0, lod=k)).tolist() == expected.tolist()
        assert seen.draws["instance_count"][k] == len(expected)
    with pytest.raises(ValueError, match='order: expected "stable", got "any"'):
        device.cull(*at, meshes=tree, order="any")
    at = (scene.crowd, scene.camera, scene.pyramid)
    with pytest.raises(ValueError, match='order: expected "stable", got "any"'):
        device.cull(*at, meshes=_meshes(), order="any", placement="reserved")
    with pytest.raises(ValueError, match="order: expected a cull in a stable order"):
        seen.lods  # noqa: B018


def test_absent_instances_are_counted_apart(device: hizvk.Device, scene: Scene) -> None:
    absent = scene.ids == hizvk.ABSENT
    stats = device.cull(scene.crowd, scene.camera, scene.pyramid).stats
    assert stats.absent == absent.sum()
    assert stats.tested == N - absent.sum() == stats.outside + stats.occluded + stats.kept
    without = device.instances(scene.bounds)
    mask = device.cull(without, scene.camera, scene.pyramid).mask
    seen = device.cull(scene.crowd, scene.camera, scene.pyramid)
    np.testing.assert_array_equal(seen.mask, mask & ~absent)
    assert set(seen.verdicts[absent]) == {hizvk.Verdict.OUTSIDE}


def test_scales_and_errors_choose_levels(device: hizvk.Device) -> None:
    """The error of LOD 1 is 0.1 at scale 1, and the rule is proportional to both."""
    camera = _camera()
    pyramid = device.pyramid(np.full(camera.size, 500.0), camera, kind="z")
    balls = hizvk.Spheres(np.array([[0, 0, -50.0]] * 3), 0.0)
    tree = [hizvk.MeshLods([hizvk.DrawTemplate(9)] * 2, errors=[0.0, 0.1])]
    crowd = device.instances(balls, scales=np.array([1e-3, 1.0, 1e3]))
    seen = device.cull(crowd, camera, pyramid, meshes=tree, lod=hizvk.LodByError(pixels=1.0))
    # 0.1 m at 50 m are about 0.16 pixels.
    assert seen.lods.tolist() == [1, 1, 0]


def test_a_cull_without_meshes_has_no_bins(device: hizvk.Device, scene: Scene) -> None:
    seen = device.cull(scene.crowd, scene.camera, scene.pyramid)
    for read in (lambda: seen.lods, lambda: seen.bin(mesh=0, lod=0)):
        with pytest.raises(ValueError, match="outputs: expected a cull with meshes"):
            read()
    assert seen.draw_count == 1
