"""Counts of pixels against the same cull without them, by CPU time.

Both are whole calls, in turns: what they cull is the same, and each reads back what it asked for.
A busy machine changes CPU time less than time on the wall.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

import numpy as np

import hizvk
from hizvk.scenes.scene import box_corners

from .rounds import in_turns

if TYPE_CHECKING:
    from collections.abc import Callable

    from hizvk.resources import DepthImage

    from .run import Run

__all__ = ["COUNT", "SIZE", "SPREADS", "boxes_at_720p", "measure", "milliseconds"]

#: Boxes, and the depth image that is culled against.
COUNT: Final = 2000
SIZE: Final = (720, 1280)
#: Factors of the boxes' sizes: 77 and 1,088 pixels per box.
SPREADS: Final = (0.25, 1.0)
#: Culls without counts that one with them may take.
TARGET: Final = 5.0


def measure(run: Run) -> None:
    """Times culls with and without counts, of small boxes and of large ones."""
    for spread in SPREADS:
        run.step(f"counts of pixels, boxes of size {spread:g}")
        _of_size(run, spread)


def _of_size(run: Run, spread: float) -> None:
    boxes, depth = boxes_at_720p(run.device, spread)
    what = run.device.instances(boxes), depth.camera, run.device.pyramid(depth)
    cull = run.device.cull
    touched = cull(*what, outputs=["pixels"]).pixels["touched"].sum() / COUNT
    name = f"{COUNT:,} boxes at 720p, {touched:,.0f} pixels per box"
    without, counted = "cull, mask read", "with counts of pixels"
    ms = in_turns(
        {
            without: lambda: milliseconds(lambda: cull(*what, outputs=["mask"]).mask),
            counted: lambda: milliseconds(lambda: cull(*what, outputs=["mask", "pixels"]).pixels),
        },
        # They are short, so more rounds cost little.
        3 * run.extent.rounds,
    )
    run.found.timed(f"{name}, CPU time", ms)
    key = f"counts.{spread:g}"
    run.found.ratio(key, f"{name}: {counted} / {without}", ms[counted], ms[without], TARGET)


def milliseconds(call: Callable[[], object]) -> float:
    """CPU time of one call, of all threads."""
    start = time.process_time()
    call()
    return 1e3 * (time.process_time() - start)


def boxes_at_720p(device: hizvk.Device, spread: float) -> tuple[hizvk.Boxes, DepthImage]:
    """Boxes all over the view, and the depth image of every fourth of them."""
    random = np.random.default_rng(0)
    camera = hizvk.Camera.look_at((0, 2, 0), (0, 2, -1), fov_y_deg=60, size=SIZE, near=0.1)
    center = np.c_[
        random.uniform(-40, 40, COUNT), random.uniform(0, 3, COUNT), random.uniform(-80, -5, COUNT)
    ]
    half = spread * random.uniform(0.3, 1.2, (COUNT, 3))
    corners = box_corners(center[::4] - half[::4], center[::4] + half[::4])
    faces = np.array([[0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5], [4, 5, 7], [4, 7, 6]])
    triangles = (faces + 8 * np.arange(len(corners))[:, None, None]).reshape(-1, 3)
    depth = device.render_depth(device.occluders(corners.reshape(-1, 3), triangles), camera)
    return hizvk.Boxes(center - half, center + half), depth
