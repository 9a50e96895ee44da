"""All ways in turns, so that what disturbs the machine for a while disturbs all alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..results import Spread

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from ...scenes import Floats

__all__ = ["WARM", "in_turns", "quartiles"]

#: Rounds before those that count: compilations and page faults.
WARM = 2


def in_turns(ways: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, Floats]:
    """Milliseconds of each way in each round; every round begins with another way.

    Parameters
    ----------
    ways : mapping of str to callable
        What does the work once and returns its milliseconds.
    rounds : int
        How often, after `WARM` rounds that are not counted.
    """
    names = list(ways)
    found = {name: np.empty(rounds) for name in names}
    for number in range(-WARM, rounds):
        first = number % len(names)
        for name in names[first:] + names[:first]:
            took = ways[name]()
            if number >= 0:
                found[name][number] = took
    return found


def quartiles(ms: Floats) -> Spread:
    """Median and quartiles."""
    q1, median, q3 = np.quantile(ms, (0.25, 0.5, 0.75))
    return Spread(float(median), float(q1), float(q3))
