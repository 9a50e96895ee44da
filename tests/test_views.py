"""Answers that come by themselves, several views in one call, and the device's own times."""

import asyncio
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt
import pytest

import hizvk


def crowd(count: int, seed: int = 3) -> tuple[hizvk.Spheres, npt.NDArray[np.bool_]]:
    """Small spheres far from every border, and which of them a wall on the left leaves visible."""
    random = np.random.default_rng(seed)
    place = random.integers(0, 3, count)  # before the wall, behind it, beside it
    z = np.where(place == 0, 4.0, 16.0)
    x = np.where(place == 2, 0.5, -0.5) * z
    centers = np.stack([x, random.uniform(-0.5, 0.5, count) * z, -z], axis=1)
    return hizvk.Spheres(centers, 0.01), place != 1


def view(size: tuple[int, int] = (48, 64)) -> hizvk.Camera:
    return hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=size, near=0.1)


def wall(device: hizvk.Device, camera: hizvk.Camera) -> hizvk.Pyramid:
    """8 m away, over the left half of the image."""
    image = np.full(camera.size, np.inf)
    image[:, : camera.size[1] // 2] = 8.0
    return device.pyramid(image, camera, kind="z")


# -- answers that come by themselves ---------------------------------------------------------------


@pytest.mark.parametrize("count", [0, 1, 3000, 40_000])
def test_without_waiting_the_answer_is_the_same(device: hizvk.Device, count: int) -> None:
    spheres, expected = crowd(count)
    instances, camera = device.instances(spheres), view()
    seen = device.cull(
        instances,
        camera,
        wall(device, camera),
        outputs=["mask", "verdicts", "indices", "draws"],
        statistics=True,
        wait=False,
    )
    while not seen.ready():
        time.sleep(0)
    assert seen.result() is seen
    np.testing.assert_array_equal(seen.mask, expected)
    np.testing.assert_array_equal(seen.indices, np.flatnonzero(expected))
    np.testing.assert_array_equal(seen.verdicts >= hizvk.Verdict.VISIBLE, expected)
    assert seen.draws["instance_count"].sum() == seen.stats.kept == seen.count == expected.sum()
    assert (seen.stats.texels_read or 0) > 0 or count == 0


def test_await_gives_the_result_and_lets_the_loop_go_on(device: hizvk.Device) -> None:
    spheres, expected = crowd(200_000)
    instances, camera = device.instances(spheres), view()
    pyramid = wall(device, camera)
    ticks = 0

    async def one() -> bool:
        seen = await device.cull(instances, camera, pyramid, hierarchy=False, wait=False)
        assert seen.ready()
        return np.array_equal(seen.mask, expected)

    async def tick(stop: asyncio.Event) -> None:
        nonlocal ticks
        while not stop.is_set():
            ticks += 1
            await asyncio.sleep(0)

    async def all_of_them() -> list[bool]:
        stop = asyncio.Event()
        ticking = asyncio.create_task(tick(stop))
        told = await asyncio.gather(*(one() for _ in range(6)))
        stop.set()
        await ticking
        return told

    assert asyncio.run(all_of_them()) == [True] * 6
    assert ticks > 1


def test_a_blocking_result_may_be_awaited_too(device: hizvk.Device) -> None:
    spheres, expected = crowd(100)
    camera = view()

    async def one() -> hizvk.CullResult:
        return await device.cull(device.instances(spheres), camera, wall(device, camera))

    np.testing.assert_array_equal(asyncio.run(one()).mask, expected)


def test_results_that_nobody_reads_free_their_slots(device: hizvk.Device) -> None:
    spheres, expected = crowd(5000)
    instances, camera = device.instances(spheres), view()
    pyramid = wall(device, camera)
    for _ in range(50):
        device.cull(instances, camera, pyramid, outputs=["mask"], wait=False)
    kept = [device.cull(instances, camera, pyramid, wait=False) for _ in range(7)]
    for seen in kept[::-1]:
        np.testing.assert_array_equal(seen.mask, expected)


def test_waiting_holds_no_interpreter_lock(device: hizvk.Device) -> None:
    """Another thread counts while this one waits in `result`, and in the call of a third cull."""
    spheres, expected = crowd(1_000_000)
    instances, camera = device.instances(spheres), view()
    pyramid = wall(device, camera)

    def cull() -> hizvk.CullResult:
        return device.cull(
            instances, camera, pyramid, outputs=["mask"], hierarchy=False, wait=False
        )

    cull().result()
    counted, stop = 0, threading.Event()

    def count() -> None:
        nonlocal counted
        while not stop.is_set():
            counted += 1
            time.sleep(0)

    thread = threading.Thread(target=count)
    thread.start()
    try:
        begin, results = counted, [cull() for _ in range(6)]
        for seen in results:
            seen.result()
        assert counted > begin + 10
    finally:
        stop.set()
        thread.join()
    np.testing.assert_array_equal(results[-1].mask, expected)


def test_threads_get_their_own_answers(device: hizvk.Device) -> None:
    camera = view()
    pyramid = wall(device, camera)

    def work(seed: int) -> bool:
        spheres, expected = crowd(1000 + seed, seed)
        instances = device.instances(spheres)
        culls = [device.cull(instances, camera, pyramid, wait=False) for _ in range(5)]
        return all(np.array_equal(seen.mask, expected) for seen in culls)

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(work, range(8)))


# -- several views in one call ---------------------------------------------------------------------


def eyes(device: hizvk.Device) -> tuple[list[hizvk.Camera], list[hizvk.Pyramid]]:
    """Three views of different sizes and conventions: wall on the left, on the right, nowhere."""
    cameras = [
        hizvk.Camera.look_at(
            (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=size, near=0.1, reversed_z=reversed_z
        )
        for size, reversed_z in (((48, 64), True), ((33, 40), False), ((20, 90), True))
    ]
    pyramids = []
    for number, one in enumerate(cameras):
        image = np.full(one.size, np.inf)
        half = one.size[1] // 2
        if number == 0:
            image[:, :half] = 8.0
        elif number == 1:
            image[:, half:] = 8.0
        pyramids.append(device.pyramid(image, one, kind="z"))
    return cameras, pyramids


def seen_by(spheres: hizvk.Spheres) -> npt.NDArray[np.bool_]:
    """Which spheres of `crowd` each of the `eyes` sees, worked out without a cull."""
    x, _, z = np.asarray(spheres.centers).T
    far = z == -16.0
    return np.stack([~(far & (x < 0)), ~(far & (x > 0)), np.ones(len(x), bool)])


@pytest.mark.parametrize("count", [0, 1, 777, 40_000])
@pytest.mark.parametrize("wait", [True, False])
def test_each_view_decides_for_itself(device: hizvk.Device, count: int, wait: bool) -> None:
    spheres, _ = crowd(count)
    cameras, pyramids = eyes(device)
    expected = seen_by(spheres)
    seen = device.cull(device.instances(spheres), cameras, pyramids, wait=wait)
    assert (len(seen), seen.num_instances) == (3, count)
    np.testing.assert_array_equal(seen.mask, expected)
    np.testing.assert_array_equal(seen.any, expected.any(axis=0))
    np.testing.assert_array_equal(seen.counts, expected.sum(axis=1))
    for number, one in enumerate(seen):
        np.testing.assert_array_equal(one.mask, expected[number])
        np.testing.assert_array_equal(one.indices, np.flatnonzero(expected[number]))
        assert one.stats.kept == expected[number].sum()
    assert seen[-1] is seen[2]
    two = device.cull(
        device.instances(spheres),
        cameras[:2],
        pyramids[:2],
        outputs=["indices", "draws"],
        draw=hizvk.DrawTemplate(36),
        wait=wait,
    )
    np.testing.assert_array_equal(two.indices, np.flatnonzero(expected[:2].any(axis=0)))
    assert two.draws["instance_count"].sum() == expected[:2].any(axis=0).sum()
    assert (two.draws["index_count"] == 36).all()


def test_lists_of_views_that_were_not_asked_for(device: hizvk.Device) -> None:
    cameras, pyramids = eyes(device)
    seen = device.cull(device.instances(crowd(10)[0]), cameras, pyramids)
    with pytest.raises(ValueError, match="outputs: expected a cull that was asked for indices"):
        _ = seen.indices
    with pytest.raises(ValueError, match="outputs: expected a cull that was asked for draws"):
        _ = seen.draws
    with pytest.raises(IndexError, match=r"view: expected an integer in -3\.\.2, got 3"):
        _ = seen[3]
    assert repr(seen) == "<ViewsResult: 3 views of 10 instances>"


def test_views_may_be_awaited(device: hizvk.Device) -> None:
    spheres, _ = crowd(3000)
    cameras, pyramids = eyes(device)
    instances = device.instances(spheres)

    async def all_of_them() -> list[hizvk.ViewsResult]:
        async def one() -> hizvk.ViewsResult:
            return await device.cull(instances, cameras, pyramids, wait=False)

        return await asyncio.gather(*(one() for _ in range(5)))

    for seen in asyncio.run(all_of_them()):
        assert seen.ready()
        np.testing.assert_array_equal(seen.mask, seen_by(spheres))


def test_among_is_a_mask_or_an_earlier_result(device: hizvk.Device) -> None:
    spheres, _ = crowd(30_000)
    cameras, pyramids = eyes(device)
    expected, instances = seen_by(spheres), device.instances(spheres)
    asked = np.random.default_rng(9).random(30_000) < 0.1
    asked[:8000] = False  # whole groups of the caller's order, if not of the stored one
    one = device.cull(instances, cameras[0], pyramids[0], among=asked, statistics=True)
    np.testing.assert_array_equal(one.mask, expected[0] & asked)
    np.testing.assert_array_equal(one.verdicts[~asked], hizvk.Verdict.OUTSIDE)
    all_of_them = device.cull(instances, cameras[0], pyramids[0], statistics=True)
    assert (one.stats.texels_read or 0) < (all_of_them.stats.texels_read or 0) / 4
    hidden = int(np.flatnonzero(~asked & expected[0])[0])
    told = one.explain(hidden)
    assert told.verdict == hizvk.Verdict.OUTSIDE
    assert told.reason.startswith("not among the instances that were asked for")

    # Verdict of the first view AND verdict of the second: a cascade of the first one's answer.
    both = device.cull(instances, cameras[1], pyramids[1], among=one)
    np.testing.assert_array_equal(both.mask, expected[0] & expected[1] & asked)
    views = device.cull(instances, cameras, pyramids, among=both, wait=False)
    np.testing.assert_array_equal(views.mask, expected & both.mask)
    any_of = device.cull(instances, cameras[2], pyramids[2], among=views)
    np.testing.assert_array_equal(any_of.mask, both.mask)
    half = device.cull(instances, cameras[2], pyramids[2], among=np.repeat(asked, 2)[::2])
    np.testing.assert_array_equal(half.mask, asked)


def test_what_does_not_belong_together_is_refused(device: hizvk.Device) -> None:
    cameras, pyramids = eyes(device)
    instances, fewer = device.instances(crowd(10)[0]), device.instances(crowd(9)[0])
    with pytest.raises(ValueError, match="pyramid: expected 3, one for each camera, got 2"):
        device.cull(instances, cameras, pyramids[:2])
    with pytest.raises(ValueError, match=r"camera\[1\]: expected the camera of the pyramid"):
        device.cull(instances, [cameras[0], cameras[2]], pyramids[:2])
    with pytest.raises(TypeError, match=r"pyramid\[1\]: expected a Pyramid, got Camera"):
        device.cull(instances, cameras[:2], [pyramids[0], cameras[1]])  # type: ignore[list-item]
    with pytest.raises(ValueError, match="among: expected a result of 10 instances, got one of 9"):
        device.cull(
            instances,
            cameras[0],
            pyramids[0],
            among=device.cull(fewer, cameras[0], pyramids[0]),
        )
    no_mask = device.cull(instances, cameras[0], pyramids[0], outputs=["draws"])
    with pytest.raises(ValueError, match="among: expected a cull that was asked for mask"):
        device.cull(instances, cameras[0], pyramids[0], among=no_mask)
    other = hizvk.Device()
    others, its = eyes(other)
    with pytest.raises(ValueError, match=r"pyramid\[0\]: expected Pyramid of this device"):
        device.cull(instances, others, its)
