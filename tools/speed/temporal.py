"""Two passes beside one: early, reduction and late, against one reduction and one cull."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from hizvk.camera import Camera

from .rounds import in_turns

if TYPE_CHECKING:
    from collections.abc import Callable

    from .run import Run

__all__ = ["measure"]


def measure(run: Run) -> None:
    """Measures frames of `Workload.crowd` instances, 95 % hidden, whose camera turns a little."""
    run.step("two passes and one")
    scene = run.town(run.extent.crowd, 0.95)
    device, size = run.device, run.extent.images[0][1]
    walls = device.occluders(scene.vertices, scene.triangles)
    crowd = device.instances(scene.boxes)
    views = [
        Camera.look_at(
            (0, 0, 2), (0.05 * k, 1, 2), up=(0, 0, 1), fov_y_deg=60, size=size, near=0.125
        )
        for k in range(4)
    ]
    depths = [device.render_depth(walls, view) for view in views]
    culler = device.temporal(crowd)

    def timed(frame: Callable[[int], object]) -> Callable[[], float]:
        number = 0

        def once() -> float:
            nonlocal number
            number += 1
            device.wait()
            start = time.perf_counter()
            frame(number % len(views))
            return 1e3 * (time.perf_counter() - start)

        return once

    def one(k: int) -> object:
        pyramid = device.pyramid(depths[k])
        return device.cull(crowd, views[k], pyramid, outputs=["mask"]).mask

    def two(k: int) -> object:
        # A renderer does not read the early answer, and neither does this.
        culler.early(views[k])
        return culler.late(views[k], depths[k]).mask

    ms = in_turns({"one": timed(one), "two": timed(two)}, 3 * run.extent.rounds)
    run.found.timed("temporal", ms)
    label = f"{len(crowd):,} instances, {size[0]}p: early, reduction, late / reduction, cull"
    run.found.ratio("temporal.two", label, ms["two"], ms["one"], target=1.3)
    early = culler.early(views[0])
    late = culler.late(views[0], depths[0])
    kept = device.cull(crowd, views[0], device.pyramid(depths[0])).mask
    missing = int(np.count_nonzero(kept & ~(early.mask | late.mask)))
    run.found.number("temporal.missing", "kept by one pass, and in neither of two", missing, "")
