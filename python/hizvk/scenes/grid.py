"""The grid on which all positions of the scenes lie."""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

__all__ = ["GRID", "Floats", "apart", "on_grid"]

Floats: TypeAlias = npt.NDArray[np.float64]

#: All positions are multiples of this, in metres.
GRID: Final = 1.0 / 64.0


def on_grid(values: npt.ArrayLike) -> Floats:
    """Each value rounded to the grid."""
    rounded: Floats = np.round(np.asarray(values, np.float64) / GRID) * GRID
    return rounded


def apart(
    rng: np.random.Generator, side: int, eyes: int, things: int
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Corners of a grid of `side` cells for eyes and for things, none for both.

    Returns
    -------
    eyes : (eyes, 2) integer array
        Corners between four cells: 0 to `side` - 2.
    things : (things, 2) integer array
        The other corners, with the grid's border: -1 to `side` - 1.
    """
    inner = rng.integers(0, max(side - 1, 1), (eyes, 2))
    corners = np.stack(np.meshgrid(*2 * [np.arange(-1, side)], indexing="ij"), -1).reshape(-1, 2)
    taken = (corners[:, None] == inner).all(axis=2).any(axis=1)
    return inner, rng.choice(corners[~taken], things)
