"""Points on the device beside numba's and NumPy's tests, and the colours of a view beside NumPy's.

All ways take the same points in float32, the same camera and the same depth image.

numba has two tests: one reads the pixel that a point lies in, the other those within the guard, as
the cull does.
A cull and the second test also run several times in a row, as they do over many views.
Alone, each begins with the caches as the way before has left them.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import hizvk

from .numba_tests import MISSING, guarded_test, z_test
from .rounds import in_turns

if TYPE_CHECKING:
    from collections.abc import Callable

    from .run import Run

__all__ = ["measure"]

#: How many times as many points the larger cloud has.
LARGER: Final = 4
#: Calls in a row.
IN_A_ROW: Final = 8
#: Against numba's tests on one thread: at most a quarter of their time.
TARGET: Final = 0.25
#: What a cull is compared with.
OTHERS: Final = {
    "numba": "numba's z-test on one thread",
    "numba, with the guard": "numba's z-test with the guard",
    "numpy": "NumPy's z-test",
}


def measure(run: Run) -> None:
    """Measures `Workload.crowd` points, and four times as many."""
    for key, count in (("crowd", run.extent.crowd), ("four", LARGER * run.extent.crowd)):
        run.step(f"{count:,} points")
        _clouds(run, key, count)


def _clouds(run: Run, key: str, count: int) -> None:
    scene, device = run.town(run.extent.crowd, 0.95), run.device
    depth = run.depth(scene, run.extent.images[0][1])
    camera, image = depth.camera, depth.numpy()
    random = np.random.default_rng(run.seed)
    which = random.integers(0, len(scene.low), count)
    low, high = np.asarray(scene.low)[which], np.asarray(scene.high)[which]
    positions = (low + random.random((count, 3)) * (high - low)).astype(np.float32)
    points = hizvk.Points(positions)
    cloud, hiz = device.instances(points), device.pyramid(depth)
    picture = np.zeros((*camera.size, 3), np.uint8)

    def resident() -> object:
        return device.cull(cloud, camera, hiz, outputs=["mask"]).mask

    def colours() -> object:
        return hizvk.colour_points(points, [(camera, depth, picture)], device=device)

    ways: dict[str, Callable[[], float]] = {
        "points, resident": _timed(run, resident),
        "points, resident, in a row": _timed(run, resident, IN_A_ROW),
        "points, uploaded and coloured": _timed(run, colours),
        "numpy": _timed(run, lambda: _numpy_test(positions, camera, image)),
        "numpy, project and gather": _timed(
            run, lambda: _numpy_colours(positions, camera, picture)
        ),
    }
    plain, guarded = z_test(), guarded_test()
    if plain is None or guarded is None:
        run.found.notes.append(f"left out: {MISSING}")
    else:
        matrix = camera.clip_from_world
        ways["numba"] = _timed(run, lambda: plain(positions, matrix, image))

        def with_guard() -> object:
            return guarded(positions, matrix, image)

        ways["numba, with the guard"] = _timed(run, with_guard)
        ways["numba, with the guard, in a row"] = _timed(run, with_guard, IN_A_ROW)
    rounds = max(3, run.extent.rounds // 3)
    ms = in_turns(ways, rounds)
    run.found.timed(f"points, {count:,}", ms)
    one_cull = f"cull of {count:,} resident points, mask read"
    for way, said in OTHERS.items():
        if way in ms:
            run.found.ratio(
                f"points.{way}.{key}",
                f"{one_cull} / {said}",
                ms["points, resident"],
                ms[way],
                None if way == "numpy" else TARGET,
            )
    if guarded is not None:
        run.found.ratio(
            f"points.row.{key}",
            f"{one_cull} / {OTHERS['numba, with the guard']}, {IN_A_ROW} in a row",
            ms["points, resident, in a row"],
            ms["numba, with the guard, in a row"],
            TARGET,
        )
    run.found.ratio(
        f"points.colours.{key}",
        f"{count:,} points uploaded, culled and coloured / NumPy's projection and gather alone",
        ms["points, uploaded and coloured"],
        ms["numpy, project and gather"],
    )


def _numpy_test(positions: Any, camera: hizvk.Camera, image: Any) -> Any:
    """A plain z-test by reversed depth."""
    seen = camera.project(positions)
    kept = seen.inside.copy()
    column, row = seen.rounded().T
    kept[kept] = seen.depth[kept] >= image[row, column]
    return kept


def _numpy_colours(positions: Any, camera: hizvk.Camera, picture: Any) -> Any:
    """The colour of each point, whether it is hidden or not."""
    return hizvk.gather(picture, camera.project(positions).pixels)


def _timed(run: Run, work: Callable[[], object], times: int = 1) -> Callable[[], float]:
    """Milliseconds of one call among `times` in a row."""

    def timed() -> float:
        run.device.wait()
        start = time.perf_counter()
        for _ in range(times):
            work()
        return 1e3 * (time.perf_counter() - start) / times

    return timed
