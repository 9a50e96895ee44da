"""Which of N things a caller names: by a mask, by numbers, or by what a cull kept."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import _arguments, foreign
from .result import CullResult

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["named"]


def named(
    name: str, only: CullResult | npt.ArrayLike, count: int, thing: str
) -> npt.NDArray[np.bool_]:
    """The mask of what `only` names.

    Parameters
    ----------
    name : str
        The parameter, for errors.
    only : CullResult, (count,) bool array or integer array
        What a cull kept, a mask, or numbers.
    count : int
        How many things there are.
    thing : str
        What one of them is, for errors: ``"copy of a mesh"``.
    """
    if isinstance(only, CullResult):
        if len(only) != count:
            raise ValueError(
                f"{name}: expected a result of {count} instances, one for each {thing}, "
                f"got {len(only)} instances"
            )
        return only.mask
    expected = f"a CullResult, a bool ({count},) array or an array of integers"
    if _arguments.is_masked(only):
        raise TypeError(
            f"{name}: expected {expected}, got a masked array; "
            "fill it first, with .filled(False) or (True)"
        )
    if isinstance(only, (str, bytes)):
        raise TypeError(f"{name}: expected {expected}, got {_arguments.describe(only)}")
    only = foreign.as_numpy(name, expected, only)
    try:
        array = np.asarray(only)
    except ValueError as error:
        raise ValueError(
            f"{name}: expected {expected}, got a sequence that is no array ({error})"
        ) from None
    if array.dtype.kind == "b":
        return _arguments.bools(name, only, count)
    if array.size == 0 and not hasattr(only, "dtype"):
        array = array.astype(np.intp)
    if array.dtype.kind not in "iu" or array.ndim != 1:
        got = _arguments.describe(array if array.ndim else only)
        raise TypeError(f"{name}: expected {expected}, got {got}")
    if array.size and not (int(array.min()) >= 0 and int(array.max()) < count):
        wrong = int(array.min()) if int(array.min()) < 0 else int(array.max())
        plural = {"copy of a mesh": "copies"}.get(thing, f"{thing}s")
        raise ValueError(f"{name}: expected numbers of {plural} in 0..{count - 1}, got {wrong}")
    mask = np.zeros(count, np.bool_)
    mask[array] = True
    return mask
