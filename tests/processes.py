"""What a process does with a device before it ends or forks.

test_processes.py runs each scene in a process of its own.
``processes.py SCENE`` prints what the test compares, and ends as the scene says.
"""

import atexit
import contextlib
import faulthandler
import gc
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor


def threads() -> int:
    """The number of threads of this process, including a driver's; Python's where none tells."""
    try:
        return len(os.listdir("/proc/self/task"))
    except OSError:
        return threading.active_count()


def early() -> None:
    """Registered before hizvk is imported, so it runs after every device has been dropped."""
    if "after_the_end" in sys.argv:
        try:
            print(cull(KEPT[0]))
        except hizvk.HizError as error:
            print(f"HizError: {error}")
        # Linux removes a joined thread from its list a moment after the join has returned.
        until = time.monotonic() + 30
        while threads() > THREADS and time.monotonic() < until:
            time.sleep(0.001)
        # A GPU's driver may keep threads.
        print("threads left:", threads() - THREADS if SOFTWARE else 0)

    if "after_the_end_for_many" in sys.argv:
        # They all arrive while the first error is being made.
        sys.setswitchinterval(1e-6)
        GO.set()
        for thread in MANY:
            thread.join()
        print("joined", len(MANY))


def before_fork() -> None:
    """Registered before hizvk is imported, so it runs after hizvk has waited for the driver.

    What the driver's threads still have to do is counted in their time on a CPU, whatever else the
    machine does.
    """
    if "while_the_driver_compiles" in sys.argv:
        began = time.process_time()
        for device in KEPT:
            device.wait()
        WORKED_MS.append(1e3 * (time.process_time() - began))


GO = threading.Event()
MANY: list[threading.Thread] = []
#: Milliseconds that all threads of this process worked between hizvk's wait and a fork.
WORKED_MS: list[float] = []
atexit.register(early)
os.register_at_fork(before=before_fork)
# The test sends it to a scene that hangs; forks inherit it.
faulthandler.register(signal.SIGUSR1, all_threads=True)

import numpy as np  # noqa: E402

import hizvk  # noqa: E402

SOFTWARE = all(adapter.device_type == "cpu" for adapter in hizvk.adapters())
THREADS = threads()
CAMERA = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(64, 64), near=0.1)
WALL = np.full(CAMERA.size, 10.0)
#: One in front of the wall, one behind it.
SPHERES = hizvk.Spheres(np.array([[0.0, 0, -5], [0, 0, -20]]), 1.0)
SEEN = [True, False]
#: Objects that the module still refers to when it ends.
KEPT: list[hizvk.Device] = []
OBJECTS: list[object] = []
FORK = multiprocessing.get_context("fork")


def cull(device: hizvk.Device) -> list[bool]:
    """Do everything from the upload on, and keep the objects."""
    pyramid, instances = device.pyramid(WALL, CAMERA, kind="z"), device.instances(SPHERES)
    result = device.cull(instances, CAMERA, pyramid)
    seen: list[bool] = result.mask.tolist()
    OBJECTS.extend((pyramid, instances, result))
    return seen


def used() -> hizvk.Device:
    """A device that has culled."""
    KEPT.append(hizvk.Device())
    assert cull(KEPT[-1]) == SEEN
    return KEPT[-1]


def by_default(_: int = 0) -> list[bool]:
    """The same with the default device."""
    seen: list[bool] = hizvk.visible(SPHERES, CAMERA, depth=WALL, kind="z").tolist()
    return seen


def in_threads(work: Callable[[], object], number: int = 2) -> None:
    """Start daemons that do `work` until the process ends; return once each has done it twice."""
    ready = threading.Barrier(number + 1)

    def repeat() -> None:
        work()
        work()
        ready.wait()
        try:
            while True:
                work()
        except hizvk.HizError as error:
            if "about to end" not in str(error):
                raise

    for _ in range(number):
        threading.Thread(target=repeat, daemon=True).start()
    ready.wait()


def forked(work: Callable[[], object], *, ends: str = "_exit") -> None:
    """Fork, and print the result of `work` in the child and how the child ended."""
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        print(work())
        sys.stdout.flush()
        if ends == "_exit":
            os._exit(0)
        sys.exit(5)
    print("status", os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))


def refused() -> list[str]:
    """Which of the parent's objects do not refuse to be used, or say something else."""
    device, (pyramid, instances, result) = KEPT[0], OBJECTS[:3]
    assert isinstance(pyramid, hizvk.Pyramid)
    assert isinstance(instances, hizvk.Instances)
    assert isinstance(result, hizvk.CullResult)
    image = IMAGES[0]
    asked = {
        "max_image_side": lambda: device.max_image_side,
        "instances": lambda: device.instances(SPHERES),
        "pyramid": lambda: device.pyramid(WALL, CAMERA, kind="z"),
        "pyramid of an image": lambda: device.pyramid(image),
        "cull": lambda: device.cull(instances, CAMERA, pyramid),
        "update": lambda: instances.update(0, SPHERES),
        "invalid": lambda: instances.invalid,
        "level": lambda: pyramid.level(1),
        "numpy": lambda: image.numpy(),
        "verdicts": lambda: result.verdicts,
        "indices": lambda: result.indices,
        "stats": lambda: result.stats,
        "explain": lambda: result.explain(0),
    }
    wrong = []
    for name, ask in asked.items():
        try:
            ask()
            wrong.append(f"{name}: no error")
        except hizvk.HizError as error:
            expected = f"made by process {os.getppid()}, and process {os.getpid()} is a fork of it"
            if expected not in str(error) or "spawn" not in str(error):
                wrong.append(f"{name}: {error}")
    try:
        device._engine.wait_without_guard()
        wrong.append("the engine in Rust: no error")
    except hizvk.HizError as error:
        expected = (
            f"this device was made by process {os.getppid()}, "
            f"and process {os.getpid()} is a fork of it: no device"
        )
        if not str(error).startswith(expected):
            wrong.append(f"the engine in Rust: {error}")
    # Calls that need no device.
    texts = [repr(thing) for thing in (device, pyramid, instances, result)]
    assert len(texts[0]) > 0
    assert (len(result), result.mask.tolist(), pyramid.size, pyramid.num_levels) == (
        2,
        SEEN,
        (64, 64),
        7,
    )
    assert device.adapter.name in texts[0]
    return wrong


def while_the_driver_compiles() -> None:
    """Fork right after the first submissions of two devices, for which lavapipe compiles shaders.

    It does that on a thread of each device, under locks that the child needs.
    """
    os.environ["MESA_SHADER_CACHE_DISABLE"] = "true"
    submissions: list[Callable[[hizvk.Device], object]] = [
        lambda device: device.pyramid(WALL, CAMERA, kind="z"),
        lambda device: device.render_depth(triangle(device), CAMERA),
        lambda device: device.instances(SPHERES).update(0, SPHERES),
    ]
    for submit in submissions:
        KEPT[:] = [hizvk.Device(), hizvk.Device()]
        OBJECTS[:] = [submit(device) for device in KEPT]
        forked(by_default)
    print("worked on for ms:", [round(ms) for ms in WORKED_MS if ms > 10])


IMAGES: list[hizvk.DepthImage] = []


def inherits() -> None:
    """Make a device in the parent, everything on it, and a depth image."""
    device = used()
    occluders = triangle(device)
    IMAGES.append(device.render_depth(occluders, CAMERA))
    OBJECTS.append(occluders)


def collect() -> str:
    """Drop everything of the parent."""
    KEPT.clear()
    OBJECTS.clear()
    IMAGES.clear()
    gc.collect()
    return "collected"


def with_threads() -> list[bool]:
    """New threads reuse the memory of those that stayed in the parent."""
    for _ in range(4):
        threads = [threading.Thread(target=time.sleep, args=(0.001,)) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    return by_default()


def end(how: str) -> None:
    """End a process whose module still refers to everything."""
    used()
    by_default()
    if how == "daemons":
        in_threads(lambda: cull(KEPT[0]))
    elif how == "daemons_open":
        in_threads(lambda: cull(hizvk.Device()))
    elif how == "exception":
        raise ValueError("on purpose")
    elif how == "sys_exit":
        sys.exit(3)
    elif how == "unread":
        device = KEPT[0]
        OBJECTS.append(
            device.cull(device.instances(SPHERES), CAMERA, device.pyramid(WALL, CAMERA, kind="z"))
        )
    elif how == "cycle":
        ring: list[object] = [KEPT[0]]
        ring.append(ring)


def waits_for_the_end() -> None:
    """Start daemons that use a device after all devices have been dropped."""
    device = used()

    def ask() -> None:
        GO.wait()
        for _ in range(200):
            with contextlib.suppress(hizvk.HizError):
                print(device.max_image_side)

    MANY.extend(threading.Thread(target=ask, daemon=True) for _ in range(8))
    for thread in MANY:
        thread.start()


def triangle(device: hizvk.Device) -> hizvk.Occluders:
    """One triangle before the camera."""
    return device.occluders(
        np.array([[-9.0, -9, -10], [9, -9, -10], [0, 9, -10]]), np.array([[0, 1, 2]])
    )


def while_threads_cull() -> None:
    """Fork while other threads are in the middle of everything."""

    def work() -> None:
        device = hizvk.Device()
        assert cull(device) == SEEN
        assert by_default() == SEEN

    in_threads(work)
    for _ in range(5):
        forked(by_default)


def all_cores(_: int = 0) -> int:
    """Sort and cull so many spheres on a new device that all cores of the host help."""
    centers = np.random.default_rng(2010).uniform((-9, -9, -60), (9, 9, -1), (300_000, 3))
    device = hizvk.Device()
    instances = device.instances(hizvk.Spheres(centers, 0.1))
    result = device.cull(instances, CAMERA, device.pyramid(WALL, CAMERA, kind="z"))
    return int(result.mask.sum())


def all_cores_in_a_fork() -> None:
    """The threads that helped stay behind."""
    expected = all_cores()
    assert 0 < expected < 300_000
    forked(lambda: all_cores() == expected)
    assert all_cores() == expected


def pools() -> None:
    """Workers of pools, and workers of workers."""
    assert by_default() == SEEN
    with FORK.Pool(2) as pool:
        print(pool.map(by_default, range(4)))
        assert by_default() == SEEN
    with ProcessPoolExecutor(2, mp_context=FORK) as executor:
        print(list(executor.map(by_default, range(4))))
    worker = FORK.Process(target=pool_in_a_worker)
    worker.start()
    worker.join()
    print("status", worker.exitcode)


def pool_in_a_worker() -> None:
    """A fork of a fork."""
    assert by_default() == SEEN
    forked(by_default, ends="exit")
    assert by_default() == SEEN


def main(scene: str) -> None:
    """Run the scene; the module's docstring says what is printed."""
    if scene.startswith("end_") or scene == "after_the_end":
        end(scene.removeprefix("end_"))
        return
    if scene == "after_the_end_for_many":
        waits_for_the_end()
        return
    if scene == "refused":
        inherits()
        forked(refused)
        forked(collect, ends="exit")
    elif scene == "default":
        assert by_default() == SEEN
        forked(by_default, ends="exit")
        forked(by_default)
    elif scene == "no_device":
        inherits()
        forked(lambda: "nothing", ends="exit")
    elif scene == "threads_of_a_child":
        inherits()
        forked(with_threads, ends="exit")
    elif scene == "all_cores_in_a_fork":
        all_cores_in_a_fork()
    elif scene == "while_threads_cull":
        while_threads_cull()
    elif scene == "while_the_driver_compiles":
        while_the_driver_compiles()
    else:
        assert scene == "pools"
        pools()
    # The parent's devices still work.
    assert by_default() == SEEN
    assert not KEPT or cull(KEPT[0]) == SEEN


if __name__ == "__main__":
    main(sys.argv[1])
