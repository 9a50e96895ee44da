"""Depth as renderers have it: multisampled, and changed in places.

The resolve of four samples is compared with a memcpy of them, and the reduction of a rectangle with
that of the whole image.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from .rounds import in_turns
from .run import ALL_LEVELS

if TYPE_CHECKING:
    from .run import Run

__all__ = ["measure"]

#: Samples per pixel, which every device has.
SAMPLES: Final = 4
#: Memcpies of all samples that a resolve may take.
TARGET: Final = 4.0
#: The side of the square that has changed, in pixels.
SIDE: Final = 300


def measure(run: Run) -> None:
    """Times the resolve and the reduction of a rectangle, for each size of image."""
    for name, size in run.extent.images:
        run.step(f"multisampled depth and changed rectangles, {name}")
        _resolve(run, name, size)
        _region(run, name, size)


def _resolve(run: Run, name: str, size: tuple[int, int]) -> None:
    camera = run.depth(run.town(1, 0.0), size).camera
    samples = np.full((*size, SAMPLES), 0.5, np.float32)
    target = np.empty_like(samples)
    copy, resolve = "memcpy of all samples", f"resolve of {SAMPLES} samples"
    ms = in_turns(
        {
            copy: lambda: run.yardstick.memcpy_ms(samples, target),
            "empty submit": run.yardstick.empty_submit_ms,
            resolve: run.yardstick.resolve(camera._inner, SAMPLES).ms,
        },
        run.extent.rounds,
    )
    run.found.timed(f"multisampled depth, {name}", ms)
    run.found.ratio(
        f"depth_in.{name}.resolve",
        f"{name}: {resolve} / {copy}",
        ms[resolve],
        ms[copy],
        TARGET,
    )


def _region(run: Run, name: str, size: tuple[int, int]) -> None:
    rendered = run.depth(run.town(1, 0.0), size)
    camera = rendered.camera
    uploaded = run.device._engine.upload_depth(
        rendered.numpy(), camera.depth_kind, 1.0, (), "none", (0.0, 0.0), camera._inner
    )
    # The tests' images are smaller than that.
    height, width = (min(side, SIDE) for side in size)
    top, left = (size[0] - height) // 2, (size[1] - width) // 2
    rectangle = (left, top, left + width - 1, top + height - 1)
    for source, depth in (("rendered", rendered._inner), ("uploaded", uploaded)):
        everything, part = "all of the image", f"{width}x{height} pixels"
        ms = in_turns(
            {
                "empty submit": run.yardstick.empty_submit_ms,
                everything: run.yardstick.reduction(depth, "own", ALL_LEVELS).ms,
                part: run.yardstick.region(depth, rectangle).ms,
            },
            run.extent.rounds,
        )
        run.found.timed(f"reduction of a rectangle, {name} {source}", ms)
        run.found.ratio(
            f"depth_in.{name}.{source}.region",
            f"{name}, {source}: reduction of {part} / {everything}",
            ms[part],
            ms[everything],
            None,
        )
