"""How `hizvk.recommend` keeps to `max_seconds`: which rows come first, and for which is time.

Each row needs a pipeline of its own, and compiling it takes most of the time.
So each row is tried in the first view, and what it will take in all views is known by then.
"""

from __future__ import annotations

import math
import time
from itertools import zip_longest
from typing import TYPE_CHECKING

from .timing import SLOW_MS, once

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ..measuring.configuration import Configuration, DepthVariant
    from ..options import CullOptions, MeshLods
    from ..resources import Instances, Pyramid
    from .timing import DepthSource

__all__ = ["admitted", "by_use"]

#: Culls of each view that a row needs at least: one gives the masks, and one is timed.
LEAST_ROUNDS = 2


def by_use(rows: Sequence[Configuration], *, every_ray: bool, area: bool) -> list[Configuration]:
    """The rows in the order in which they are tried, should there be no time for all.

    The first is one that may surely be recommended, the cheapest of these, and each sort has its
    turn.
    What is there for comparison alone comes last.

    Parameters
    ----------
    rows : sequence of Configuration
        The candidates.
    every_ray : bool
        Whether conservative depth alone is proven.
    area : bool
        Whether what covers no pixel's centre counts, so that sample coverage is for comparison.
    """
    sorts: dict[object, list[Configuration]] = {}
    for one in rows:
        key = (one.volume, one.depth, one.coverage, one.fit, one.guard_px)
        sorts.setdefault(key, []).append(one)

    def rank(sort: list[Configuration]) -> tuple[bool, bool, bool, int]:
        one = sort[0]
        is_compared = area and one.coverage == "sample"
        is_sure = one.promises_rays if every_ray else bool(one.guard_px)
        # Other images differ more than another fit does.
        return is_compared, one.fit != "rectangle", not is_sure, -one.depth.divisor

    turns = zip_longest(*sorted(sorts.values(), key=rank))
    return [one for turn in turns for one in turn if one is not None]


def admitted(
    chosen: Sequence[Configuration],
    volumes: Mapping[str, Instances],
    source: DepthSource,
    base: CullOptions,
    meshes: Sequence[MeshLods] | None,
    until: float,
) -> list[Configuration]:
    """The rows that can be measured in all views by `until`, a time of `time.monotonic`.

    A row is tried if the last row of its sort would still be in time.
    The first is always admitted.
    """
    if until == math.inf:
        return list(chosen)
    views = len(source.views)
    pyramids: dict[DepthVariant, Pyramid] = {}
    image_s: dict[bool, tuple[float, int]] = {}  # of the last image, and its divisor
    trial_s: dict[str, float] = {}  # of the last row, by fit
    row_s = 0.0  # of the last row, once it is compiled
    rest_s = 0.0  # what the rows that are in will need
    found: list[Configuration] = []
    for one in chosen:
        variant = one.depth
        new_s = 0.0 if variant in pyramids else _expected(image_s, variant)
        tried_s = trial_s.get(one.fit, max(trial_s.values(), default=0.0))
        needs_s = new_s + tried_s + rest_s + _later(new_s, views)
        needs_s += LEAST_ROUNDS * views * row_s
        if found and time.monotonic() + needs_s > until:
            continue
        found.append(one)
        if variant not in pyramids:
            pyramids[variant], took = source.pyramids([variant], 0)[variant]
            image_s[variant.conservative] = took / 1000.0, variant.divisor
            rest_s += _later(took / 1000.0, views)
        began = time.monotonic()
        for _ in range(2):  # the first one compiles
            start = time.monotonic()
            once(source.device, volumes[one.volume], pyramids[variant], one, base, meshes)
            row_s = time.monotonic() - start
        trial_s[one.fit] = time.monotonic() - began
        rest_s += LEAST_ROUNDS * views * row_s
    return found


def _expected(image_s: Mapping[bool, tuple[float, int]], variant: DepthVariant) -> float:
    """Seconds for an image that was not made yet: as the last of its sort, by its pixels.

    Plain ones are cheaper than conservative ones, which come first.
    """
    if not image_s:
        return 0.0
    last = image_s.get(variant.conservative)
    if last is None:
        return max(took for took, _ in image_s.values())
    took, divisor = last
    return took * max(1.0, (divisor / variant.divisor) ** 2)


def _later(image_s: float, views: int) -> float:
    """Seconds for an image in all views, once it is made in the first; slow ones are kept."""
    if 1000.0 * image_s > SLOW_MS:
        return (views - 1) * image_s
    return LEAST_ROUNDS * views * image_s
