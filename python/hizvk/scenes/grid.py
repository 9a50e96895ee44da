"""The grid on which all positions of the scenes lie."""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

__all__ = ["GRID", "Floats", "on_grid"]

Floats: TypeAlias = npt.NDArray[np.float64]

#: All positions are multiples of this, in metres.
GRID: Final = 1.0 / 64.0


def on_grid(values: npt.ArrayLike) -> Floats:
    """Each value rounded to the grid."""
    rounded: Floats = np.round(np.asarray(values, np.float64) / GRID) * GRID
    return rounded
