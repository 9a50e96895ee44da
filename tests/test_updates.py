"""The stored order of instances, and their update.

Results are those of fresh instances in the caller's order.
"""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import hizvk

Bounds = hizvk.Spheres | hizvk.Boxes | hizvk.OrientedBoxes


def spheres(centers: np.ndarray, sizes: np.ndarray) -> Bounds:
    return hizvk.Spheres(centers, sizes[:, 0])


def boxes(centers: np.ndarray, sizes: np.ndarray) -> Bounds:
    return hizvk.Boxes(centers - sizes, centers + sizes)


def oriented_boxes(centers: np.ndarray, sizes: np.ndarray) -> Bounds:
    turned = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]], dtype=sizes.dtype)
    return hizvk.OrientedBoxes(centers, np.abs(sizes), np.broadcast_to(turned, (len(sizes), 3, 3)))


KINDS = [spheres, boxes, oriented_boxes]


def crowd(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    centers = random.uniform([-20, -20, -40], [20, 20, 5], (count, 3)).astype(np.float32)
    return centers, random.uniform(0, 0.5, (count, 3)).astype(np.float32)


@pytest.fixture(scope="module")
def pyramid(device: hizvk.Device) -> hizvk.Pyramid:
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -10), fov_y_deg=70, size=(45, 64), near=0.125)
    depth = np.full(camera.size, np.inf)
    depth[:, :40] = 12.0
    return device.pyramid(depth, camera, kind="z")


@pytest.mark.parametrize("make", KINDS)
def test_a_cull_sees_the_bounds_that_were_there(
    device: hizvk.Device, pyramid: hizvk.Pyramid, make: Callable[..., Bounds]
) -> None:
    """Verdicts of the members of hidden groups are worked out when they are read.

    An update in between does not change them.
    """
    (centers, sizes), (elsewhere, _) = crowd(3000, 1), crowd(3000, 2)
    instances = device.instances(make(centers, sizes))
    flat = verdicts(device, instances, pyramid)
    seen, counted = (
        device.cull(instances, pyramid.camera, pyramid, hierarchy=True) for _ in range(2)
    )
    instances.update(0, make(elsewhere, sizes))
    expected = [flat.count(code) for code in range(2)]
    differs = sum(a != b for a, b in zip(flat, seen.verdicts.tolist(), strict=True))
    assert differs <= 3  # a group may hide a few more
    assert [counted.stats.outside, counted.stats.occluded] == pytest.approx(expected, abs=3)
    assert verdicts(device, instances, pyramid) != flat


def verdicts(device: hizvk.Device, instances: hizvk.Instances, pyramid: hizvk.Pyramid) -> list[int]:
    return device.cull(instances, pyramid.camera, pyramid, hierarchy=False).verdicts.tolist()


@pytest.mark.parametrize("make", KINDS)
@pytest.mark.parametrize("order", ["morton", "given"])
def test_after_updates_the_answers_are_those_of_fresh_instances(
    device: hizvk.Device,
    pyramid: hizvk.Pyramid,
    make: Callable[..., Bounds],
    order: hizvk._types.StoredOrder,
) -> None:
    centers, sizes = crowd(3000, 1)
    centers[77] = np.nan
    instances = device.instances(make(centers, sizes), order=order)
    for seed, (first, count) in enumerate(
        [(0, 0), (77, 1), (5, 900), (2999, 1), (0, 3000), (64, 64), (3000, 0)]
    ):
        new_centers, new_sizes = crowd(count, 10 + seed)
        new_centers[3:4] = np.inf
        instances.update(first, make(new_centers, new_sizes))
        centers[first : first + count], sizes[first : first + count] = new_centers, new_sizes
        bad = np.flatnonzero(~np.isfinite(centers).all(axis=1))
        assert instances.invalid.tolist() == bad.tolist()
        fresh = device.cull(
            device.instances(make(centers, sizes), order="given"), pyramid.camera, pyramid
        )
        result = device.cull(instances, pyramid.camera, pyramid)
        assert result.verdicts.tolist() == fresh.verdicts.tolist()
        assert result.mask.tolist() == fresh.mask.tolist()
        assert result.indices.tolist() == fresh.indices.tolist()
        assert result.stats.invalid == len(bad)
        assert set(result.verdicts.tolist()) >= {0, 1, 2}
        unordered = device.cull(instances, pyramid.camera, pyramid, order="any")
        assert sorted(unordered.indices.tolist()) == fresh.indices.tolist()
        assert str(result.explain(1234)) == str(fresh.explain(1234))


def test_strict_refuses_and_changes_nothing(device: hizvk.Device, pyramid: hizvk.Pyramid) -> None:
    centers, sizes = crowd(500, 2)
    instances = device.instances(boxes(centers, sizes), strict=True)
    before = verdicts(device, instances, pyramid)
    bad = np.stack([np.full(3, np.nan), np.zeros(3)])
    with pytest.raises(
        ValueError,
        match=r"^bounds: expected finite numbers .*, got 1 bad of 2, the first at index 0$",
    ):
        instances.update(7, hizvk.Boxes(bad, bad), strict=True)
    assert verdicts(device, instances, pyramid) == before
    assert len(instances.invalid) == 0
    instances.update(7, hizvk.Boxes(bad, bad))
    assert instances.invalid.tolist() == [7]
    instances.update(7, boxes(centers[7:9], sizes[7:9]), strict=True)
    assert verdicts(device, instances, pyramid) == before


def test_float64_far_away_and_other_dtypes_than_before(device: hizvk.Device) -> None:
    eye = np.array([1e7, 2e7, -3e7])
    camera = hizvk.Camera.look_at(
        eye, eye - np.array([0, 0, 10]), fov_y_deg=70, size=(45, 64), near=0.125
    )
    pyramid = device.pyramid(np.full(camera.size, 12.0), camera, kind="z")
    centers, sizes = crowd(200, 3)
    instances = device.instances(spheres(np.zeros_like(centers), sizes))
    instances.update(0, spheres(eye + centers, sizes))
    fresh = device.instances(spheres(eye + centers, sizes))
    assert verdicts(device, instances, pyramid) == verdicts(device, fresh, pyramid)
    assert set(verdicts(device, instances, pyramid)) == {0, 1, 2}


def test_a_cull_in_flight_sees_the_old_bounds(device: hizvk.Device, pyramid: hizvk.Pyramid) -> None:
    old, new = crowd(20_000, 4), crowd(20_000, 5)
    # Culled flat: a group of moved members is not the group that new ones would form.
    # Its test may read other texels.
    expected = [verdicts(device, device.instances(spheres(*each)), pyramid) for each in (old, new)]
    assert expected[0] != expected[1]
    instances = device.instances(spheres(*old))
    results = []
    for turn in range(6):
        results.append(device.cull(instances, pyramid.camera, pyramid, hierarchy=False))
        instances.update(0, spheres(*(new, old)[turn % 2]))
    for turn, result in enumerate(results):
        assert result.verdicts.tolist() == expected[turn % 2]


def test_updates_of_many_threads(device: hizvk.Device, pyramid: hizvk.Pyramid) -> None:
    """Each thread has its own instances in a shared list, and culls while the others update."""
    start, end = crowd(4000, 6), crowd(4000, 7)
    instances = device.instances(boxes(*start))
    barrier = threading.Barrier(4)

    def work(number: int) -> None:
        barrier.wait()
        for i in range(number * 1000, number * 1000 + 1000, 50):
            instances.update(i, boxes(end[0][i : i + 50], end[1][i : i + 50]))
            assert len(device.cull(instances, pyramid.camera, pyramid).mask) == 4000

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(work, range(4)))
    assert verdicts(device, instances, pyramid) == verdicts(
        device, device.instances(boxes(*end)), pyramid
    )


def test_memory(device: hizvk.Device) -> None:
    centers, sizes = crowd(64_000, 8)
    sorted_, given = (
        device.instances(spheres(centers, sizes), order=order) for order in ("morton", "given")
    )
    assert sorted_.device_bytes == given.device_bytes
    assert sorted_.host_bytes - given.host_bytes == 8 * 64_000
    assert given.host_bytes == 88 * 1000
    before = given.host_bytes
    given.update(0, spheres(centers, sizes))
    assert given.host_bytes == before, "nothing is kept of what moves as a whole"
    given.update(1, spheres(centers[:1], sizes[:1]))
    assert given.host_bytes == before + 48 * 64
