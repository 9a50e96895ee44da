"""Sparse depth, such as a LiDAR's in the image of a camera: filling what lies between."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from . import _arguments, foreign
from .depth import METRIC, no_data_of, whole_numbers

if TYPE_CHECKING:
    from collections.abc import Collection
    from typing import Literal

    import numpy.typing as npt

__all__ = ["fill_depth", "is_sparse"]

#: More would take the depth of another part of the scene.
LARGEST_RADIUS = 1024
#: Depth is sparse if a smaller share of the pixels than this has any,
SPARSE_PIXELS: Final = 0.25
#: and a smaller share of those than this begins a full block of 2x2.
SPARSE_BLOCKS: Final = 0.1


@_arguments.explained()
def fill_depth(
    depth: npt.ArrayLike,
    radius_px: int,
    *,
    kind: Literal["z", "distance"],
    invalid: Collection[float] | None = None,
) -> npt.NDArray[Any]:
    """Gives pixels without depth the farthest depth that was measured around them.

    Each pixel, measured or not, gets the farthest depth that is known within `radius_px` columns
    and rows.
    It needs a measured pixel in each of the four quarters of this window, where a pixel of its own
    row or column counts for both sides.
    So nothing grows past the outermost measurements: what lies beyond them, as the sky does, stays
    without data.

    **What it costs is the promise.**
    It holds for the filled image, no longer for the world: a gap that no measured pixel shows is
    closed, and what can be seen through it is culled.
    Larger windows close fewer gaps, since any far pixel in them counts, and hide less.
    "Sparse depth" in ``docs/guide.md`` has measurements.

    Parameters
    ----------
    depth : (height, width) array
        Float, or whole numbers of 16 bits or more; what is masked is no data.
    radius_px : int
        0 to 1024.
        The window has to hold a few measured pixels everywhere.
        If a share s of the pixels is measured, about ``1.5 / sqrt(s)`` where they stand in rows
        and columns, and ``3 / sqrt(s)`` where they are scattered.
    kind : "z" or "distance"
        What the numbers are, as in `Device.pyramid`.
    invalid : collection of float, optional
        Which numbers mean "no data", as in `Device.pyramid`.

    Returns
    -------
    (height, width) array
        Of the same dtype, for `Device.pyramid` and `visible`; 0, which is no data, where too little
        was measured.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> sparse = np.array([[5.0, 0, 6, 0], [0, 0, 0, 0], [7.0, 0, 5, 0]])
    >>> hizvk.fill_depth(sparse, 2, kind="z").tolist()
    [[7.0, 7.0, 7.0, 0.0], [7.0, 7.0, 7.0, 0.0], [7.0, 7.0, 7.0, 0.0]]
    """
    radius = _arguments.integer("radius_px", radius_px, low=0, high=LARGEST_RADIUS)
    kind = _arguments.choice("kind", kind, METRIC)  # type: ignore[assignment]
    expected = "float (height, width), or whole numbers of 16 bits or more"
    mask = None
    if _arguments.is_masked(depth):
        depth = np.ma.array(depth)  # numpy.asarray would drop the masks of rows
        mask = None if depth.mask is np.ma.nomask else np.asarray(depth.mask)
        depth = depth.data
    depth = foreign.as_numpy("depth", expected, depth)
    try:
        array = np.asarray(depth)
    except ValueError as error:
        raise ValueError(f"depth: expected {expected}, got no array ({error})") from None
    if array.ndim == 3 and array.shape[2] == 1:
        array, mask = array[..., 0], None if mask is None else mask[..., 0]
    if array.dtype.kind not in "iuf" or array.dtype.itemsize == 1:
        raise TypeError(f"depth: expected {expected}, got {_arguments.describe(array)}")
    if array.ndim != 2:
        raise ValueError(f"depth: expected {expected}, got {_arguments.describe(array)}")
    array = _arguments.copied("depth", array, array.dtype.newbyteorder("="))
    array = whole_numbers("depth", array, kind, invalid)
    known = np.isfinite(array) & (array > 0)
    for number in no_data_of(invalid, array.dtype):
        known &= array != number
    if mask is not None:
        known &= ~mask
    nothing = array.dtype.type(0)
    measured = np.where(known, array, nothing)
    farthest, surrounded = np.zeros_like(measured), np.ones(measured.shape, np.bool_)
    for rows in (1, -1):
        half = _farthest_after(measured[::rows], radius)[::rows]
        for columns in (1, -1):
            quarter = _farthest_after(half.T[::columns], radius)[::columns].T
            np.maximum(farthest, quarter, out=farthest)
            surrounded &= quarter > 0
    return np.where(surrounded, farthest, nothing)


def is_sparse(known: npt.NDArray[np.bool_]) -> bool:
    """Whether few pixels have a depth, and hardly any of them are beside another."""
    full = known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]
    return bool(known.mean() < SPARSE_PIXELS and full.sum() < SPARSE_BLOCKS * known.sum())


def _farthest_after(depth: npt.NDArray[Any], radius: int) -> npt.NDArray[Any]:
    """The farthest depth of each row and the `radius` rows after it; windows double each time."""
    found = depth.copy(order="K")
    rows = 1
    while rows <= radius:
        shift = min(rows, radius + 1 - rows)
        np.maximum(found[:-shift], found[shift:], out=found[:-shift])
        rows += shift
    return found
