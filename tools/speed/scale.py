"""Time, memory and texels against the number of instances and of pixels."""

from __future__ import annotations

import time
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from hizvk.errors import HizError
from hizvk.measuring.spread import over_rounds

from .figures import ImageSize, InstanceCount
from .rounds import in_turns
from .run import ALL_LEVELS

if TYPE_CHECKING:
    from .run import Run

__all__ = ["cliffs", "measure"]

#: What a cull makes here: mask, indices and draws.
OUTPUTS: Final = (True, False, True, True)
#: About how many instances, or pixels, all rounds of one size take together.
WORK: Final = 40_000_000
#: A cliff: an instance, or a pixel, costs more than this times what it cost at the size before.
CLIFF: Final = 1.3
#: Below this number the fixed cost of a call shows.
LARGE: Final = 100_000


def measure(run: Run) -> None:
    """Measures all sizes; what the machine cannot hold is noted and left out."""
    for count in run.extent.counts:
        run.step(f"{count:,} instances")
        try:
            run.found.instance_counts.append(_instances(run, count))
        except (HizError, MemoryError) as error:
            run.found.notes.append(f"{count:,} instances were left out: {error}")
    for side in run.extent.sides:
        run.step(f"{side}x{side} pixels")
        try:
            run.found.image_sizes.append(_image(run, side))
        except (HizError, MemoryError) as error:
            run.found.notes.append(f"an image of {side}x{side} was left out: {error}")
    run.found.notes += cliffs(run)


def _rounds(run: Run, count: int) -> int:
    return max(3, min(run.extent.rounds, WORK // count))


def _instances(run: Run, count: int) -> InstanceCount:
    scene = run.town(count, 0.95)
    depth = run.depth(scene, run.extent.images[0][1])
    pyramid = run.device.pyramid(depth)
    run.device.wait()
    start = time.perf_counter()
    boxes = run.device.instances(scene.boxes)
    run.device.wait()
    upload = 1e3 * (time.perf_counter() - start)
    del scene
    stats = run.device.cull(
        boxes, depth.camera, pyramid, hierarchy=False, outputs=["verdicts"], statistics=True
    ).stats
    tests = run.device.cull(
        boxes, depth.camera, pyramid, hierarchy=True, outputs=["verdicts"]
    ).stats.comparisons
    cull = {
        way: run.cull(boxes, depth.camera, pyramid, groups=groups, outputs=OUTPUTS)
        for way, groups in (("flat", False), ("groups", True))
    }
    ms = in_turns({way: one.ms for way, one in cull.items()}, _rounds(run, count))
    run.found.timed(f"{count:,} instances", ms)
    return InstanceCount(
        instances=count,
        pieces=boxes._inner.num_pieces(),
        upload_ms=upload,
        flat_ms=over_rounds(ms["flat"]).median,
        groups_ms=over_rounds(ms["groups"]).median,
        device_bytes=boxes.device_bytes + cull["flat"].device_bytes(),
        texels=(stats.texels_read or 0) / count,
        tests=tests,
    )


def _image(run: Run, side: int) -> ImageSize:
    scene = run.town(run.extent.calls, 0.95)
    depth = run.depth(scene, (side, side))
    pyramid = run.device.pyramid(depth)
    boxes = run.device.instances(scene.boxes)
    stats = run.device.cull(
        boxes, depth.camera, pyramid, hierarchy=False, outputs=["verdicts"], statistics=True
    ).stats
    numbers = depth.numpy()
    target = np.empty_like(numbers)
    ways: dict[str, Any] = {
        "memcpy": lambda: run.yardstick.memcpy_ms(numbers, target),
        "all levels": run.yardstick.reduction(depth._inner, "own", ALL_LEVELS).ms,
        "groups": run.cull(boxes, depth.camera, pyramid, groups=True).ms,
    }
    ms = in_turns(ways, _rounds(run, side * side))
    run.found.timed(f"{side}x{side} pixels", ms)
    median = {way: over_rounds(times).median for way, times in ms.items()}
    return ImageSize(
        side=side,
        memcpy_ms=median["memcpy"],
        reduce_ms=median["all levels"],
        groups_ms=median["groups"],
        device_bytes=pyramid.device_bytes + numbers.nbytes,
        texels=(stats.texels_read or 0) / len(boxes),
    )


def cliffs(run: Run) -> list[str]:
    """Where an instance, or a pixel, costs more than `CLIFF` times what it did one size before."""
    found = []
    counts = [row for row in run.found.instance_counts if row.instances >= LARGE]
    for way in ("flat_ms", "groups_ms", "upload_ms"):
        for before, row in pairwise(counts):
            jump = (getattr(row, way) / row.instances) / (getattr(before, way) / before.instances)
            if jump > CLIFF:
                now, then = f"{row.instances:,}", f"{before.instances:,}"
                found.append(
                    f"cliff: {way.removesuffix('_ms')}, an instance of {now} ({row.pieces} pieces) "
                    f"costs {jump:.2f} times one of {then} ({before.pieces})"
                )
    images = [row for row in run.found.image_sizes if row.side**2 >= LARGE]
    for before_image, image in pairwise(images):
        jump = (image.reduce_ms / image.side**2) / (before_image.reduce_ms / before_image.side**2)
        copied = (image.memcpy_ms / image.side**2) / (before_image.memcpy_ms / before_image.side**2)
        if jump > CLIFF:
            now, then = f"{image.side}x{image.side}", f"{before_image.side}x{before_image.side}"
            found.append(
                f"cliff: the reduction, a pixel of {now} costs {jump:.2f} times one of {then} "
                f"(a memcpy {copied:.2f} times)"
            )
    return found
