"""Threads: with a device each, with one between them, and beside Python code that wants to run."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import hizvk


def crowd(count: int, seed: int) -> hizvk.Spheres:
    random = np.random.default_rng(seed)
    centers = random.uniform([-20, -20, -40], [20, 20, 5], (count, 3)).astype(np.float32)
    return hizvk.Spheres(centers, random.uniform(0, 0.5, count).astype(np.float32))


def view(seed: int) -> hizvk.Camera:
    return hizvk.Camera.look_at(
        (seed * 0.25, 0, 0), (0, 0, -10), fov_y_deg=70, size=(45 + seed, 64), near=0.125
    )


def wall(camera: hizvk.Camera) -> np.ndarray:
    depth = np.full(camera.size, np.inf)
    depth[:, ::3] = depth[:, 1::3] = 12.0
    depth[:, camera.size[1] // 2 :] = 9.0
    return depth


def masks(device: hizvk.Device, seed: int, rounds: int) -> list[bytes]:
    """The same work `rounds` times, everything from the upload on."""
    camera = view(seed)
    found = []
    for _ in range(rounds):
        pyramid = device.pyramid(wall(camera), camera, kind="z")
        result = device.cull(device.instances(crowd(500, seed)), camera, pyramid)
        assert np.flatnonzero(result.mask).tolist() == result.indices.tolist()
        found.append(result.mask.tobytes())
    return found


def test_two_threads_share_a_device(device: hizvk.Device) -> None:
    expected = [masks(device, seed, 1)[0] for seed in range(4)]
    assert len(set(expected)) > 1
    with ThreadPoolExecutor(4) as pool:
        for seed, found in enumerate(pool.map(lambda seed: masks(device, seed, 8), range(4))):
            assert found == [expected[seed]] * 8


def test_two_threads_with_a_device_each(device: hizvk.Device) -> None:
    expected = [masks(device, seed, 1)[0] for seed in range(2)]
    with ThreadPoolExecutor(2) as pool:
        for seed, found in enumerate(
            pool.map(lambda seed: masks(hizvk.Device(), seed, 4), range(2))
        ):
            assert found == [expected[seed]] * 4


def test_one_result_read_by_many_threads(device: hizvk.Device) -> None:
    camera = view(1)
    pyramid = device.pyramid(wall(camera), camera, kind="z")
    instances = device.instances(crowd(5000, 1))
    for _ in range(4):
        result = device.cull(instances, camera, pyramid)
        barrier = threading.Barrier(4)

        def read(
            result: hizvk.CullResult = result, barrier: threading.Barrier = barrier
        ) -> tuple[bytes, int, str]:
            barrier.wait()
            return result.mask.tobytes(), result.count, str(result.explain(17))

        with ThreadPoolExecutor(4) as pool:
            futures = [pool.submit(read) for _ in range(4)]
            assert len({future.result() for future in futures}) == 1


def test_an_object_made_in_one_thread_works_in_another() -> None:
    made: list[hizvk.CullResult] = []

    def make() -> None:
        device, camera = hizvk.Device(), view(0)
        pyramid = device.pyramid(wall(camera), camera, kind="z")
        made.append(device.cull(device.instances(crowd(500, 0)), camera, pyramid))

    thread = threading.Thread(target=make)
    thread.start()
    thread.join()
    assert made[0].count == made[0].mask.sum()  # its device lives on in the result


def test_the_interpreter_runs_while_the_device_works(device: hizvk.Device) -> None:
    camera = view(0)
    pyramid = device.pyramid(wall(camera), camera, kind="z")
    bounds = crowd(1_000_000, 3)
    device.cull(device.instances(crowd(10, 0)), camera, pyramid).count  # noqa: B018 - compiles the shaders
    calls: list[tuple[float, float]] = []

    def work() -> None:
        for _ in range(3):
            # One call each between the two times; none of them comes back to Python on its way.
            start = time.perf_counter()
            instances = device._engine.instances(
                "spheres", (bounds.centers, bounds.radii), (False, "morton"), None, None
            )
            calls.append((start, time.perf_counter()))
            del instances

    thread = threading.Thread(target=work)
    ticks = []
    thread.start()
    while thread.is_alive():
        ticks.append(time.perf_counter())
        time.sleep(0.001)
    thread.join()
    start, end = max(calls, key=lambda call: call[1] - call[0])
    assert end - start > 0.01, "too fast to tell"
    inside = sum(start < tick < end for tick in ticks)
    assert inside >= 3, f"{inside} ticks of this thread in a call of {1000 * (end - start):.0f} ms"


def test_many_threads_cull_a_crowd_that_copies_the_levels(device: hizvk.Device) -> None:
    """Threads copy depth and levels into one texture; none may read it before a copy ran."""
    rng = np.random.default_rng(8)
    centers = rng.uniform((-20, -20, -30), (20, 20, -2), (40_000, 3)).astype(np.float32)
    crowd = device.instances(hizvk.Spheres(centers, np.full(len(centers), 0.1, np.float32)))
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=70, size=(64, 96), near=0.125)
    for _ in range(6):
        pyramid = device.pyramid(np.full(camera.size, 8.0), camera, kind="z")
        with ThreadPoolExecutor(8) as pool:
            seen = [pool.submit(device.cull, crowd, camera, pyramid) for _ in range(8)]
            counts = [int(result.result().mask.sum()) for result in seen]
        assert len(set(counts)) == 1
        assert counts[0] < len(centers) // 2
