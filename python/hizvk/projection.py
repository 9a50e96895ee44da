"""Where points lie in an image, and what an image shows there: `Camera.project` and `gather`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from . import _arguments, foreign
from ._types import Sampling, words

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._core import Camera as CoreCamera

__all__ = ["Projected", "gather", "projected"]


class Projected(NamedTuple):
    """Points in the image of a camera; made by `Camera.project`."""

    pixels: npt.NDArray[np.float64]
    """``(N, 2)`` float64: column and row, in pixels.

    The first pixel covers 0 to 1 and has its centre at (0.5, 0.5); rows count downwards.
    NaN behind the plane of the eye, and for positions that are not finite."""
    depth: npt.NDArray[np.float64]
    """``(N,)`` float64: NDC depth in the camera's own convention; NaN as in `pixels`."""
    z: npt.NDArray[np.float64]
    """``(N,)`` float64: view depth, in world units along the view; also behind the eye.

    NaN for an orthographic camera that was made from a bare matrix, which does not say where view
    depth starts."""
    inside: npt.NDArray[np.bool_]
    """``(N,)`` bool: whether a pixel contains the point, and NDC depth is within 0..1."""

    def rounded(self) -> npt.NDArray[np.int64]:
        """``(K, 2)`` int64: column and row of the pixel of each point that is `inside`."""
        return self.pixels[self.inside].astype(np.int64)


def projected(inner: CoreCamera, xyz: npt.ArrayLike) -> Projected:
    """`Camera.project` of the camera that is `inner`."""
    positions = np.asarray(_arguments.floats("xyz", xyz, ("N", 3)), np.float64)
    height, width = inner.size()
    rows = np.array(inner.rows(), np.float64)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        # The eye is subtracted first, so nothing is lost far from the origin.
        clip = (positions - np.array(inner.origin())) @ rows[:, :3].T + rows[:, 3]
        w = clip[:, 3]
        known = (w > 0.0) & np.isfinite(clip).all(axis=1)
        ndc = np.where(known[:, None], clip[:, :3] / w[:, None], np.nan)
        pixels = np.stack(
            [(0.5 + 0.5 * ndc[:, 0]) * width, (0.5 - 0.5 * ndc[:, 1]) * height], axis=1
        )
        depth = ndc[:, 2]
        inside = ((pixels >= 0.0) & (pixels < (width, height))).all(axis=1)
        inside &= (depth >= 0.0) & (depth <= 1.0)
        z = _view_depth(inner, rows, clip)
    return Projected(pixels, depth, z, inside)


def _view_depth(
    inner: CoreCamera, rows: npt.NDArray[np.float64], clip: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """View depth of clip coordinates about the camera's own origin."""
    along = np.linalg.norm(rows[3, :3])
    if along > 0.0:
        depth: npt.NDArray[np.float64] = clip[:, 3] / along
        return depth
    if not inner.is_posed():
        return np.full(len(clip), np.nan)
    # Parallel rays: z grows or falls along the view, and the constant belongs to the eye.
    slope = np.linalg.norm(rows[2, :3]) * (-1.0 if inner.reversed_z() else 1.0)
    parallel: npt.NDArray[np.float64] = (clip[:, 2] - rows[2, 3]) / slope
    return parallel


#: What `gather` does where there is no pixel.
_NO_PIXEL: Final = 0


def gather(
    image: npt.ArrayLike, pixels: npt.ArrayLike, *, sampling: Sampling = "nearest"
) -> npt.NDArray[Any]:
    """What an image shows at some places: colours, labels, or anything else per pixel.

    Parameters
    ----------
    image : (height, width) or (height, width, channels) array
        Row 0 is the top.
    pixels : (N, 2) float array
        Columns and rows as `Projected.pixels` has them: the first pixel's centre is (0.5, 0.5).
    sampling : "nearest" or "bilinear"
        ``"nearest"``: the pixel that the place lies in; labels, and depth, are never mixed.
        ``"bilinear"``: between the four pixels around the place; at the image's edge its pixels
        repeat.

    Returns
    -------
    (N,) or (N, channels) array
        Of the image's dtype for ``"nearest"``, else float64.
        0 where the place is outside of the image or NaN.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> image = np.array([[10, 20], [30, 40]], np.uint8)
    >>> hizvk.gather(image, [(0.5, 0.5), (1.9, 0.1), (5.0, 0.0)]).tolist()
    [10, 20, 0]
    >>> hizvk.gather(image, [(1.0, 1.0)], sampling="bilinear").tolist()
    [25.0]
    """
    sampling = _arguments.choice("sampling", sampling, words(Sampling))  # type: ignore[assignment]
    image = foreign.as_numpy("image", "(height, width) or (height, width, channels) numbers", image)
    array = np.asarray(image)
    if array.ndim not in (2, 3) or 0 in array.shape or array.dtype.kind not in "biuf":
        expected = "(height, width) or (height, width, channels) numbers"
        raise ValueError(f"image: expected {expected}, got {_arguments.describe(image)}")
    places = np.asarray(_arguments.floats("pixels", pixels, ("N", 2)), np.float64)
    height, width = array.shape[:2]
    inside = ((places >= 0.0) & (places < (width, height))).all(axis=1)
    dtype = array.dtype if sampling == "nearest" else np.dtype(np.float64)
    found = np.full((len(places), *array.shape[2:]), _NO_PIXEL, dtype)
    column, row = places[inside].T
    if sampling == "nearest":
        found[inside] = array[row.astype(np.intp), column.astype(np.intp)]
        return found
    x0, x1, u = _between(column, width)
    y0, y1, v = _between(row, height)
    if array.ndim == 3:
        u, v = u[:, None], v[:, None]
    values = array.astype(np.float64)
    top = values[y0, x0] * (1.0 - u) + values[y0, x1] * u
    bottom = values[y1, x0] * (1.0 - u) + values[y1, x1] * u
    found[inside] = top * (1.0 - v) + bottom * v
    return found


def _between(
    places: npt.NDArray[np.float64], side: int
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp], npt.NDArray[np.float64]]:
    """The pixels before and after each place along an axis, and the share of the latter."""
    from_centre = np.clip(places - 0.5, 0.0, side - 1)
    first = from_centre.astype(np.intp)
    return first, np.minimum(first + 1, side - 1), from_centre - first
