"""Which configurations `hizvk.recommend` tries."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

from ..measuring.configuration import READS, SOME_LEVELS, Configuration, DepthVariant

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["promised"]


def promised(
    volumes: Sequence[str], coverage: str, *, rendered: bool, points: bool = False
) -> list[Configuration]:
    """The configurations to try: all that can be right for some renderer.

    Parameters
    ----------
    volumes : sequence of str
        The kinds of bounds that there are.
    coverage : "area" or "sample"
        What counts: every ray of the view, or the pixels' centres alone.
    rendered : bool
        Whether depth is rendered from occluders, so that it can be conservative or smaller.
    points : bool
        Whether the bounds are bare points.
        Most of them lie on what a given image shows.
    """
    plain, full = DepthVariant(), DepthVariant(1, True)
    ends = (READS[0], READS[-1])
    fits = ("rectangle", "volume")
    chosen = []
    if coverage == "area" or not rendered:
        chosen += [
            Configuration(volume, *read, fit=fit, coverage=coverage)
            for volume, fit, read in product(volumes, fits, READS)
        ]
    if rendered:
        chosen += [
            Configuration(volume, *read, fit=fit, depth=depth)
            for depth, volume, fit, read in product(
                (full, DepthVariant(2, True), DepthVariant(4, True)), volumes, fits, READS
            )
        ]
        chosen += [
            Configuration(volume, *read, fit=fit, coverage="sample")
            for volume, fit, read in product(volumes, fits, READS if coverage == "sample" else ends)
        ]
    some = [replace(plain, levels=levels) for levels in SOME_LEVELS]
    some += [replace(full, levels=levels) for levels in SOME_LEVELS] if rendered else []
    chosen += [
        Configuration(
            volume, *read, depth=depth, coverage="area" if depth.conservative else coverage
        )
        for depth, volume, read in product(some, volumes, ends)
    ]
    if points and not rendered and coverage == "area":
        chosen += [
            Configuration(volume, *read, guard_px=0.5) for volume, read in product(volumes, READS)
        ]
    return list(dict.fromkeys(chosen))
