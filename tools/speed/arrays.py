"""Arrays in: metric depth beside NDC depth, and single calls beside numba's test of points.

The uploads of instances are in `transfers`.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import hizvk
from hizvk.bounds import Points, Spheres

from .numba_tests import MISSING, z_test
from .rounds import in_turns

if TYPE_CHECKING:
    from collections.abc import Callable

    from hizvk._arguments import Size
    from hizvk._types import DepthKind

    from .run import Run

__all__ = ["measure"]

#: World units of one step of the uint16 images.
STEP: Final = 1.0 / 64.0


def measure(run: Run) -> None:
    """Measures float32 and uint16 images of every size of the workload, and single calls."""
    for name, size in (("720p", run.extent.small_image), *run.extent.images):
        run.step(f"depth of every kind, {name}")
        _kinds(run, name, size)
    run.step("single calls")
    _single(run)


def _timed(run: Run, work: Callable[[], object]) -> Callable[[], float]:
    """Milliseconds of work whose results are not released within them."""

    def timed() -> float:
        run.device.wait()
        start = time.perf_counter()
        made = work()
        run.device.wait()
        took = 1e3 * (time.perf_counter() - start)
        del made
        return took

    return timed


def _kinds(run: Run, name: str, size: Size) -> None:
    camera = run.town(1, 0.0).view.camera(size)
    depths = np.random.default_rng(run.seed).uniform(1.0, 900.0, size)
    ndc = (0.125 / depths).astype(np.float32)  # the town's near plane over view depth
    images: dict[str, tuple[Any, DepthKind, float]] = {
        "ndc": (ndc, camera.depth_kind, 1.0),
        "z, float32": (depths.astype(np.float32), "z", 1.0),
        "z, float64": (depths, "z", 1.0),
        "z, float16": (depths.astype(np.float16), "z", 1.0),
        "z, uint16": ((depths / STEP).astype(np.uint16), "z", STEP),
        "distance, float32": (depths.astype(np.float32), "distance", 1.0),
        "distance, float64": (depths, "distance", 1.0),
        "distance, uint16": ((depths / STEP).astype(np.uint16), "distance", STEP),
    }

    def way(image: Any, kind: DepthKind, scale: float) -> Callable[[], float]:
        return _timed(run, lambda: run.device.pyramid(image, camera, kind=kind, scale=scale))

    ms = in_turns({label: way(*one) for label, one in images.items()}, run.extent.rounds)
    run.found.timed(f"depth kinds, {name}", ms)
    for label, times in ms.items():
        if label != "ndc":
            target = None if "float64" in label else 1.5
            run.found.ratio(
                f"arrays.{name}.{label}", f"{name}: {label} / ndc", times, ms["ndc"], target
            )


def _single(run: Run) -> None:
    scene, device = run.town(run.extent.crowd, 0.95), run.device
    depth = run.depth(scene, run.extent.images[0][1])
    camera, image, boxes = depth.camera, depth.numpy(), scene.boxes
    kind: DepthKind = camera.depth_kind

    def uploaded() -> object:
        pyramid = device.pyramid(image, camera, kind=kind)
        return device.cull(device.instances(boxes), camera, pyramid).mask

    points = Points(np.repeat((scene.low + scene.high) / 2, 4, axis=0))
    spheres = Spheres(points.positions, 0.0)
    ways: dict[str, Callable[[], float]] = {
        "visible": _timed(
            run, lambda: hizvk.visible(boxes, camera, depth=image, kind=kind, device=device)
        ),
        "upload, sort and cull": _timed(run, uploaded),
        "visible, points": _timed(
            run, lambda: hizvk.visible(points, camera, depth=image, kind=kind, device=device)
        ),
        "visible, spheres of radius 0": _timed(
            run, lambda: hizvk.visible(spheres, camera, depth=image, kind=kind, device=device)
        ),
    }
    test = z_test()
    if test is None:
        run.found.notes.append(f"left out: {MISSING}")
    else:
        matrix = camera.clip_from_world
        ways["numba, points"] = _timed(run, lambda: test(points.positions, matrix, image))
    ms = in_turns(ways, max(3, run.extent.rounds // 3))
    run.found.timed("single calls", ms)
    count = f"{len(boxes):,}"
    run.found.ratio(
        "arrays.visible",
        f"visible of {count} boxes / upload, sort and cull",
        ms["visible"],
        ms["upload, sort and cull"],
    )
    if test is not None:
        run.found.ratio(
            "arrays.points",
            f"visible of {len(points):,} points / numba's z-test on one thread",
            ms["visible, points"],
            ms["numba, points"],
            3.0,
        )
        run.found.ratio(
            "arrays.spheres",
            f"visible of {len(points):,} spheres of radius 0 / numba's z-test on one thread",
            ms["visible, spheres of radius 0"],
            ms["numba, points"],
            3.0,
        )
