"""The two sides of a truth, and what it leaves open; both comparisons read it so."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import _arguments, foreign
from . import reference

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["sides"]


def sides(
    truth: npt.ArrayLike, count: int, *, yes: tuple[int, ...], no: tuple[int, ...], source: str
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """For which instances the truth says yes, and for which it says no.

    It says neither for the code `reference.UNDECIDED`.

    Parameters
    ----------
    truth : (count,) bool or uint8 array
        What the caller passed as ``truth``; booleans leave nothing open.
    count : int
        Instances.
    yes, no : tuple of int
        The codes that say so.
    source : str
        Whose codes they are, for errors.

    Raises
    ------
    TypeError, ValueError
        For other dtypes, lengths or codes.
    """
    truth = foreign.as_numpy("truth", f"bool or uint8 ({count},)", truth)
    codes = np.asarray(truth)
    if not (isinstance(truth, np.ndarray) and codes.dtype == np.uint8):
        is_it = _arguments.bools("truth", truth, count)
        return is_it, ~is_it
    if codes.shape != (count,):
        raise ValueError(f"truth: expected uint8 ({count},), got {_arguments.describe(truth)}")
    known = tuple(sorted((*yes, *no, reference.UNDECIDED)))
    others = codes[~np.isin(codes, known)]
    if others.size:
        raise ValueError(f"truth: expected codes of {source} {known}, got {int(others[0])}")
    return np.isin(codes, yes), np.isin(codes, no)
