"""Which configurations the bench compares.

All combinations would be hundreds.
So each dimension is varied about the same middle: boxes, 2x2 texels, area coverage, full
resolution, all levels, any order.
Dimensions that depend on each other are combined in full.
``--full`` takes the whole product.
"""

from __future__ import annotations

from itertools import product
from typing import Final

from ..measuring.configuration import READS, SOME_LEVELS, Configuration, DepthVariant

__all__ = ["RASTERISERS", "matrix"]

#: The plain image of full size, by either rasteriser.
RASTERISERS: Final = (DepthVariant(rasteriser="device"), DepthVariant(rasteriser="host"))


def matrix(extent: str) -> tuple[Configuration, ...]:
    """The configurations to measure, in the report's order.

    Parameters
    ----------
    extent : "quick", "default" or "full"
        How many.
    """
    if extent == "full":
        chosen = _full()
    elif extent == "quick":
        chosen = [
            Configuration(volume, *read)
            for volume in ("spheres", "boxes")
            for read in (READS[0], READS[-1])
        ]
        chosen += [Configuration(depth=depth) for depth in (DepthVariant(2), DepthVariant(2, True))]
        chosen += [
            Configuration(fit="volume"),
            Configuration(coverage="sample"),
            Configuration(order="stable"),
        ]
        chosen += [Configuration(depth=depth) for depth in RASTERISERS]
    else:
        chosen = _default()
    return tuple(dict.fromkeys(chosen))


def _default() -> list[Configuration]:
    volumes = ("spheres", "boxes", "oriented_boxes")
    ends = (READS[0], READS[-1])
    smaller = [
        DepthVariant(divisor, conservative) for divisor in (2, 4) for conservative in (False, True)
    ]
    chosen = [Configuration(volume, *read) for volume, read in product(volumes, READS)]
    chosen += [
        Configuration(volume, *read, fit="volume") for volume, read in product(volumes, ends)
    ]
    chosen += [Configuration("boxes", *read, coverage="sample") for read in ends]
    chosen += [Configuration(order="stable")]
    chosen += [Configuration("boxes", *read, depth=depth) for depth, read in product(smaller, ends)]
    chosen += [
        Configuration("boxes", *read, depth=DepthVariant(levels=some))
        for some, read in product(SOME_LEVELS, ends)
    ]
    chosen += [
        Configuration("boxes", *read, depth=depth) for depth, read in product(RASTERISERS, ends)
    ]
    return chosen


def _full() -> list[Configuration]:
    depths = [
        DepthVariant(),
        *(DepthVariant(d, c) for d in (1, 2, 4) for c in (False, True) if (d, c) != (1, False)),
    ]
    chosen = [
        Configuration(volume, *read, coverage=coverage, fit=fit, depth=depth)
        for volume, read, coverage, fit, depth in product(
            ("spheres", "boxes", "oriented_boxes"),
            READS,
            ("area", "sample"),
            ("rectangle", "volume"),
            depths,
        )
        if coverage == "area" or depth == DepthVariant()
    ]
    chosen += [
        Configuration("boxes", *read, depth=DepthVariant(levels=some))
        for some, read in product(SOME_LEVELS, READS)
    ]
    chosen += [
        Configuration("boxes", *read, depth=depth) for depth, read in product(RASTERISERS, READS)
    ]
    return [*chosen, Configuration(order="stable")]
