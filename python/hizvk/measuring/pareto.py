"""The Pareto front: what nothing else beats in speed and error at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["front"]


def front(
    cost: npt.ArrayLike, error: npt.ArrayLike, allowed: npt.ArrayLike | None = None
) -> npt.NDArray[np.bool_]:
    """Which points no other allowed point dominates.

    A point dominates another one if it is no worse in both numbers and better in one.
    Equal points stand or fall together.

    Parameters
    ----------
    cost, error : (N,) float array
        Less is better; NaN is on no front.
    allowed : (N,) bool array, optional
        False: takes no part, such as a configuration that culls what can be seen.
        None: all take part.

    Returns
    -------
    (N,) bool array
    """
    cost, error = np.asarray(cost, np.float64), np.asarray(error, np.float64)
    takes_part = ~(np.isnan(cost) | np.isnan(error))
    if allowed is not None:
        takes_part &= np.asarray(allowed, bool)
    no_worse = (cost[:, None] <= cost) & (error[:, None] <= error)  # [i, k]: i is no worse than k
    better = (cost[:, None] < cost) | (error[:, None] < error)
    dominated = (no_worse & better & takes_part[:, None]).any(axis=0)
    on_front: npt.NDArray[np.bool_] = takes_part & ~dominated
    return on_front
