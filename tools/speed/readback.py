"""Three ways to read a cull's answer in each frame: at once, after the host's work, a frame late.

The camera walks and turns, so the answer of the last frame lacks what has come into view since.
"""

from __future__ import annotations

import time
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from hizvk.camera import Camera

from .rounds import in_turns

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from hizvk.resources import Pyramid
    from hizvk.result import CullResult

    from .run import Run

__all__ = ["measure"]

#: Milliseconds of the host's own work in a frame.
WORK_MS = 6.0
#: Metres that the camera walks from frame to frame, and degrees that it turns.
STEP_M, TURN_DEG = 0.5, 1.0
#: Views of the walk, which goes to and fro.
VIEWS = 8


def measure(run: Run) -> None:
    """Measures frames of `Workload.calls` instances, 95 % hidden."""
    run.step("reading the answer at once, after other work, and a frame late")
    scene = run.town(run.extent.calls, 0.95)
    device, size = run.device, run.extent.images[0][1]
    walls = device.occluders(scene.vertices, scene.triangles)
    crowd = device.instances(scene.boxes)
    pyramids = [device.pyramid(device.render_depth(walls, view)) for view in _walk(run)]
    masks = [device.cull(crowd, p.camera, p, outputs=["mask"]).mask for p in pyramids]

    def cull(pyramid: Pyramid, *, wait: bool) -> CullResult:
        return device.cull(crowd, pyramid.camera, pyramid, outputs=["mask"], wait=wait)

    waits: dict[str, list[float]] = {"at once": [], "after the work": [], "a frame late": []}

    def frame(way: str, answer: Callable[[Pyramid], npt.NDArray[np.bool_]]) -> Callable[[], float]:
        number = 0

        def timed() -> float:
            nonlocal number
            number += 1
            pyramid = pyramids[number % VIEWS]
            device.wait()
            start = time.perf_counter()
            answer(pyramid)
            took = 1e3 * (time.perf_counter() - start)
            waits[way].append(took - WORK_MS)
            return took

        return timed

    def at_once(pyramid: Pyramid) -> npt.NDArray[np.bool_]:
        mask = cull(pyramid, wait=True).mask
        _work()
        return mask

    def after(pyramid: Pyramid) -> npt.NDArray[np.bool_]:
        seen = cull(pyramid, wait=False)
        _work()
        return seen.mask

    last = cull(pyramids[0], wait=False).result()

    def late(pyramid: Pyramid) -> npt.NDArray[np.bool_]:
        nonlocal last
        seen, mask = cull(pyramid, wait=False), last.mask
        _work()
        last = seen
        return mask

    ways = {"at once": at_once, "after the work": after, "a frame late": late}
    ms = in_turns({way: frame(way, answer) for way, answer in ways.items()}, 3 * run.extent.rounds)
    found = run.found
    found.timed("readback", ms)
    for way, key in (("after the work", "after"), ("a frame late", "late")):
        label = f"a frame with {WORK_MS:g} ms of other work, answer {way} / at once"
        found.ratio(f"readback.{key}", label, ms[way], ms["at once"])
    for way, took in waits.items():
        label = f"{len(crowd):,} instances, {size[0]}p: beyond the work, answer {way}"
        found.spread(f"readback.beyond.{way}", label, np.array(took), "ms")
    lost = [int(np.count_nonzero(now & ~before)) for before, now in pairwise(masks)]
    kept = float(np.mean([np.count_nonzero(mask) for mask in masks]))
    found.number(
        "readback.lost",
        f"kept now, and missing in the answer of the last frame (of {kept:,.0f} kept)",
        float(np.mean(lost)),
        "instances",
    )


def _walk(run: Run) -> list[Camera]:
    """The cameras: along the square, turning."""
    views = []
    for number in range(VIEWS):
        turn = np.radians(TURN_DEG * (number - VIEWS / 2))
        eye = np.array([STEP_M * (number - VIEWS / 2), 0.0, 2.0])
        views.append(
            Camera.look_at(
                eye,
                eye + np.array([100.0 * np.sin(turn), 100.0 * np.cos(turn), 0.0]),
                up=(0, 0, 1),
                fov_y_deg=60,
                size=run.extent.images[0][1],
                near=0.125,
            )
        )
    return views


def _work() -> None:
    """Keeps this thread busy for `WORK_MS`; half of it without the interpreter lock."""
    end = time.perf_counter() + 1e-3 * WORK_MS
    numbers = np.arange(20_000.0)[::-1]
    while time.perf_counter() < end:
        np.sort(numbers)
