"""A town in the sun: 1,600 houses and 4,000 small things that cast shadows on the ground."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from .grid import Floats

__all__ = ["SunView", "Sunlit", "sunlit"]

#: Houses along a side, and metres from one to the next.
SIDE: Final = 40
STEP: Final = 14.0
#: How far the ground reaches beyond the houses, in metres.
MARGIN: Final = 300.0


@dataclass(frozen=True)
class SunView:
    """Where a camera stands, and how the light travels; y is up."""

    name: str
    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    light: tuple[float, float, float]


@dataclass(frozen=True)
class Sunlit:
    """The casters' boxes, and the views."""

    low: Floats
    high: Floats
    views: tuple[SunView, ...]

    @property
    def ground(self) -> tuple[Floats, Floats]:
        """Opposite corners of the ground, at y = 0."""
        end = SIDE * STEP + MARGIN
        return np.array([-MARGIN, 0.0, -MARGIN]), np.array([end, 0.0, end])

    @property
    def receivers(self) -> tuple[Floats, Floats]:
        """The box around all that receives: the ground, and the casters themselves."""
        low, high = self.ground
        return low, np.array([high[0], self.high[:, 1].max(), high[2]])


def sunlit(*, small: int = 4000, seed: int = 5) -> Sunlit:
    """The town, which is the same for the same seed.

    Parameters
    ----------
    small : int
        How many small things lie about.
    seed : int
        Same seed, same town.
    """
    random = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(SIDE), np.arange(SIDE)), -1).reshape(-1, 2) * STEP
    count = len(grid)
    where = grid + random.uniform(-1, 1, (count, 2))
    half = random.uniform((2.5, 3.0, 2.5), (4.0, 14.0, 4.0), (count, 3))
    houses = np.stack([where[:, 0], half[:, 1], where[:, 1]], 1)
    of_small = random.uniform(0.15, 0.6, (small, 3))
    end = SIDE * STEP
    at = random.uniform((0.0, 0.0, 0.0), (end, 2.0, end), (small, 3))
    middles = np.concatenate([houses, at + of_small * (0.0, 1.0, 0.0)])
    halves = np.concatenate([half, of_small])
    # Between two rows of houses, above the town, and along a street towards its edge.
    row, high, low_sun = (0.5, -1.0, 0.3), 60.0, (1.0, -0.35, 0.4)
    street = (STEP * 5.5, 1.7, STEP * 4.5)
    square = (STEP * 20.5, 1.7, STEP * 20.5)
    views = (
        SunView("street", street, (300.0, 1.5, STEP * 4.5 + 3.0), row),
        SunView("air", (100.0, high, high), (300.0, 0.0, 300.0), row),
        SunView("square, low sun", square, (STEP * 20.5, 1.7, 600.0), low_sun),
    )
    return Sunlit(middles - halves, middles + halves, views)
