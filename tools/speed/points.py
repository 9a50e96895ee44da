"""Points on the device beside numba's and NumPy's tests, and the colours of a view beside NumPy's.

All ways take the same points in float32, the same camera and the same depth image.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import hizvk

from .arrays import MISSING, numba_test
from .rounds import in_turns

if TYPE_CHECKING:
    from collections.abc import Callable

    from .run import Run

__all__ = ["measure"]

#: How many times as many points the larger cloud has.
LARGER: Final = 4
#: Against numba's z-test on one thread: at most a quarter of its time.
TARGET: Final = 0.25


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

    ways: dict[str, Callable[[], object]] = {
        "points, resident": resident,
        "points, uploaded and coloured": colours,
        "numpy": lambda: _numpy_test(positions, camera, image),
        "numpy, project and gather": lambda: _numpy_colours(positions, camera, picture),
    }
    test = numba_test()
    if test is None:
        run.found.notes.append(f"left out: {MISSING}")
    else:
        matrix = camera.clip_from_world
        ways["numba"] = lambda: test(positions, matrix, image)
    rounds = max(3, run.extent.rounds // 3)
    ms = in_turns({name: _timed(run, way) for name, way in ways.items()}, rounds)
    run.found.timed(f"points, {count:,}", ms)
    others = {"numpy": "NumPy's z-test"}
    if test is not None:
        others = {"numba": "numba's z-test on one thread", **others}
    for way, said in others.items():
        run.found.ratio(
            f"points.{way}.{key}",
            f"cull of {count:,} resident points, mask read / {said}",
            ms["points, resident"],
            ms[way],
            TARGET if way == "numba" else None,
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


def _timed(run: Run, work: Callable[[], object]) -> Callable[[], float]:
    def timed() -> float:
        run.device.wait()
        start = time.perf_counter()
        work()
        return 1e3 * (time.perf_counter() - start)

    return timed
