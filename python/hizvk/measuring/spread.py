"""Medians and quartiles of repeated times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["Spread", "over_rounds", "spread"]


@dataclass(frozen=True)
class Spread:
    """A median and the quartiles about it."""

    median: float
    q1: float
    q3: float

    def __str__(self) -> str:
        return f"{self.median:.2f} ({self.q1:.2f} to {self.q3:.2f})"

    def quartiles(self, digits: str = ".2f") -> str:
        """``"1.20..1.45"``: the quartiles, each in the format `digits`."""
        return f"{self.q1:{digits}}..{self.q3:{digits}}"


def spread(ms: npt.NDArray[np.float64], *, plus: float = 0.0) -> Spread:
    """Median and quartiles over the repetitions of each view, then the mean over the views.

    The order matters: of many views, some are disturbed in every repetition, but few are disturbed
    in most of them.

    Parameters
    ----------
    ms : (repetitions, views) float64 array
        Milliseconds.
    plus : float
        Is added to all three.
    """
    q1, median, q3 = np.quantile(ms, (0.25, 0.5, 0.75), axis=0).mean(axis=1) + plus
    return Spread(float(median), float(q1), float(q3))


def over_rounds(values: npt.NDArray[np.float64]) -> Spread:
    """Median and quartiles of one number for each round, ``(rounds,)``."""
    return spread(values[:, None])
