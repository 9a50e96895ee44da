"""Which copies of meshes `Device.render_depth` draws."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from . import _arguments
from .result import CullResult

if TYPE_CHECKING:
    import numpy.typing as npt

    from .resources import Occluders

__all__ = ["Drawing", "chosen", "limit"]


class Drawing(NamedTuple):
    """The choice and the limits of one drawing, as the compiled module takes them."""

    only: npt.NDArray[np.bool_] | None = None
    """``(K,)``: which copies are drawn; None: all."""
    max_triangles: int | None = None
    """At most so many triangles."""
    max_occluders: int | None = None
    """At most so many copies."""


def chosen(
    name: str, only: CullResult | npt.ArrayLike | None, occluders: Occluders
) -> npt.NDArray[np.bool_] | None:
    """The mask of the copies that `only` names; None for all of them.

    Parameters
    ----------
    name : str
        The parameter, for errors.
    only : CullResult, (K,) bool array or integer array, optional
        What a cull kept, a mask, or numbers of copies.
    occluders : Occluders
        Of K copies.
    """
    if only is None:
        return None
    copies = occluders.num_meshes
    if isinstance(only, CullResult):
        if len(only) != copies:
            raise ValueError(
                f"{name}: expected a result of {copies} instances, one for each copy of a mesh, "
                f"got {len(only)} instances"
            )
        return only.mask
    expected = f"a CullResult, a bool ({copies},) array or an array of integers"
    if _arguments.is_masked(only):
        raise TypeError(
            f"{name}: expected {expected}, got a masked array; "
            "fill it first, with .filled(False) or (True)"
        )
    if isinstance(only, (str, bytes)):
        raise TypeError(f"{name}: expected {expected}, got {_arguments.describe(only)}")
    try:
        array = np.asarray(only)
    except ValueError as error:
        raise ValueError(
            f"{name}: expected {expected}, got a sequence that is no array ({error})"
        ) from None
    if array.dtype.kind == "b":
        return _arguments.bools(name, only, copies)
    if array.size == 0 and not hasattr(only, "dtype"):
        array = array.astype(np.intp)
    if array.dtype.kind not in "iu" or array.ndim != 1:
        got = _arguments.describe(array if array.ndim else only)
        raise TypeError(f"{name}: expected {expected}, got {got}")
    if array.size and not (int(array.min()) >= 0 and int(array.max()) < copies):
        wrong = int(array.min()) if int(array.min()) < 0 else int(array.max())
        raise ValueError(f"{name}: expected numbers of copies in 0..{copies - 1}, got {wrong}")
    mask = np.zeros(copies, np.bool_)
    mask[array] = True
    return mask


def limit(name: str, value: int | None) -> int | None:
    """A limit of `Drawing`: None, or a whole number that is not negative."""
    return None if value is None else _arguments.integer(name, value, low=0, high=2**63 - 1)
