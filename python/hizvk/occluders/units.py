"""Powers of two that bring coordinates near 1, where products neither overflow nor underflow."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy.typing as npt

__all__ = ["unit_scale"]

#: Its power of two and the inverse are finite.
MOST: Final = 1000


def unit_scale(arrays: Iterable[npt.NDArray[np.floating]]) -> float:
    """A power of two by which the largest finite number of the arrays lies in 0.5..1, or about."""
    largest = max((float(np.abs(array).max(initial=0.0)) for array in arrays), default=0.0)
    exponent = int(np.frexp(largest)[1])
    return float(2.0 ** -max(-MOST, min(exponent, MOST)))
