"""All ways in turns, so that whatever disturbs the machine for a while disturbs all alike."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from hizvk.scenes.grid import Floats

__all__ = ["WARM", "in_turns"]

#: Rounds before those that count; they take compilations and page faults.
WARM: Final = 2


def in_turns(ways: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, Floats]:
    """The milliseconds of each way in each round; every round begins with another way.

    Parameters
    ----------
    ways : mapping of str to callable
        Does the work once and returns its milliseconds.
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
