"""Which copies of meshes `Device.render_depth` draws."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from . import _arguments
from .naming import named
from .temporal import PassResult

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from .resources import Occluders
    from .result import CullResult

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
    name: str, only: CullResult | PassResult | npt.ArrayLike | None, occluders: Occluders
) -> npt.NDArray[np.bool_] | None:
    """The mask of the copies that `only` names; None for all of them.

    Parameters
    ----------
    name : str
        The parameter, for errors.
    only : CullResult, PassResult, (K,) bool array or integer array, optional
        What a cull kept or a pass draws, a mask, or numbers of copies.
    occluders : Occluders
        Of K copies.
    """
    if only is None:
        return None
    if isinstance(only, PassResult):
        only = only.mask
    return named(name, only, occluders.num_meshes, "copy of a mesh")


def limit(name: str, value: int | None) -> int | None:
    """A limit of `Drawing`: None, or a whole number that is not negative."""
    return None if value is None else _arguments.integer(name, value, low=0, high=2**63 - 1)
