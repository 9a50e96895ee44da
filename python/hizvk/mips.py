"""Mip textures of depth for shaders of one's own: their levels as arrays, and their texels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _arguments, _core, foreign
from ._types import MipDepths, MipLookup, words

if TYPE_CHECKING:
    from ._arguments import Size

__all__ = ["mip_texel", "wgsl"]

#: The texts of `wgsl`.
_SNIPPETS = {"mip_lookup": _core.mip_lookup, "mip_cull": _core.mip_cull}


def mip_texel(
    pixel: npt.ArrayLike, level: int, size: Size, lookup: MipLookup = "normalized"
) -> npt.NDArray[np.int64]:
    """The texel of a mip texture that covers a pixel.

    A level has ``n = max(1, side >> level)`` texels along a side of the image, and lookups are:

    - ``"normalized"``: the texel at the pixel's centre in normalised coordinates,
      ``(2 p + 1) n // (2 side)``.
      A sampler with nearest filtering takes the same one there.
    - ``"edge_texel"``: ``min(p >> level, n - 1)``.

    The texture must have been made for the same lookup.

    Parameters
    ----------
    pixel : (..., 2) int array
        Row and column of one pixel or of many, within the image.
    level : int
        Counted from the image, which is level 0, up to the level of one texel.
    size : (height, width)
        The image's size in pixels.
    lookup : "normalized" or "edge_texel"
        How the texture's texels are looked up, as in `Pyramid.mips`.

    Returns
    -------
    (..., 2) int64 array
        Row and column of each texel.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    Level 1 of an image of 5 rows has two of them, and the last one covers three pixels:

    >>> import hizvk
    >>> [hizvk.mip_texel((row, 0), 1, (5, 1), "edge_texel")[0].item() for row in range(5)]
    [0, 0, 1, 1, 1]
    """
    height, width = _arguments.size("size", size)
    last = max(height, width).bit_length() - 1
    level = _arguments.integer("level", level, low=0, high=last)
    lookup = _arguments.choice("lookup", lookup, words(MipLookup))  # type: ignore[assignment]
    pixels = _pixels("pixel", pixel, (height, width))
    sides = np.array([height, width])
    texels = np.maximum(sides >> level, 1)
    if lookup == "edge_texel":
        found: npt.NDArray[np.int64] = np.minimum(pixels >> level, texels - 1)
    else:
        found = (2 * pixels + 1) * texels // (2 * sides)
    return found


def _pixels(name: str, value: object, size: Size) -> npt.NDArray[np.int64]:
    """Rows and columns of pixels of an image."""
    expected = f"(..., 2) integers, rows below {size[0]} and columns below {size[1]}"
    value = foreign.as_numpy(name, expected, value)
    try:
        array: npt.NDArray[Any] = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name}: expected {expected}, got a ragged sequence ({error})") from None
    got = _arguments.describe(array if array.ndim else value)
    if array.dtype.kind not in "iu":
        raise TypeError(f"{name}: expected {expected}, got {got}")
    if array.ndim == 0 or array.shape[-1] != 2:
        raise ValueError(f"{name}: expected {expected}, got {got}")
    if array.size and ((array < 0) | (array >= np.array(size))).any():
        raise ValueError(f"{name}: expected {expected}, got {array.min()} to {array.max()}")
    return array.astype(np.int64)


def wgsl(name: str = "mip_lookup") -> str:
    """WGSL functions for shaders of one's own.

    Parameters
    ----------
    name : "mip_lookup" or "mip_cull"
        ``"mip_lookup"`` finds sizes, texels and levels of a mip texture.
        ``"mip_cull"`` culls by one, and needs ``"mip_lookup"`` in the same shader.
        Nothing certifies its answer.

    Returns
    -------
    str
        The functions, which refer to no bindings.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import hizvk
    >>> "fn mip_edge_texel(" in hizvk.wgsl("mip_lookup")
    True
    """
    return _SNIPPETS[_arguments.choice("name", name, _SNIPPETS)]


def checked(depths: object, lookup: object) -> tuple[str, str]:
    """The arguments of `Pyramid.mips`."""
    return (
        _arguments.choice("depths", depths, words(MipDepths)),
        _arguments.choice("lookup", lookup, words(MipLookup)),
    )
