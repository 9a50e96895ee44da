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
