"""Counts of pixels: how much of each instance a depth image hides, and visible fractions.

A cull with ``outputs=["pixels"]`` makes them (`CullResult.pixels`).
``docs/counts.md`` says what is certain about them, and compares them with data sets' measures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from . import _arguments

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["PIXELS_DTYPE", "visible_fraction"]

#: The counts of one instance, 20 bytes; each is a number of pixels.
#:
#: - ``touched``: pixels that the volume may touch, never too few.
#:   It is the sum of the next three.
#: - ``hidden``: the surface is surely in front of all of the volume there.
#: - ``inside``: the surface lies in the volume, or float32 cannot tell.
#: - ``open``: the surface is surely behind all of the volume there.
#: - ``undecided``: those of ``inside`` that were not looked at.
PIXELS_DTYPE: Final[np.dtype[np.void]] = np.dtype(
    [
        ("touched", "<u4"),
        ("hidden", "<u4"),
        ("inside", "<u4"),
        ("open", "<u4"),
        ("undecided", "<u4"),
    ]
)


def pixels_of(words: npt.NDArray[np.uint32]) -> npt.NDArray[np.void]:
    """The records of five words each."""
    return words.view(PIXELS_DTYPE)


def visible_fraction(
    pixels: npt.NDArray[np.void], *, objects_in_depth: bool = True
) -> npt.NDArray[np.float64]:
    """The share of each object that can be seen, from counts of pixels.

    Parameters
    ----------
    pixels : array of `PIXELS_DTYPE`
        `CullResult.pixels`, or a part of it.
    objects_in_depth : bool
        Whether the objects themselves are in the depth image.

        - True: ``inside / (inside + hidden)``.
          An image of a sensor, or a rendered image of everything.
        - False: ``1 - hidden / touched``.
          An image of occluders alone.

    Returns
    -------
    float64 array of the same shape, 0 to 1
        0 where a quotient would be 0 / 0: nothing of that object shows.
        It touches no pixel, or one looks through all of it.

    Raises
    ------
    TypeError
        If `pixels` is no array of these records, or `objects_in_depth` no bool.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> counts = np.array([(100, 30, 60, 10, 0)], dtype=hizvk.PIXELS_DTYPE)
    >>> hizvk.visible_fraction(counts).round(3), hizvk.visible_fraction(
    ...     counts, objects_in_depth=False
    ... )
    (array([0.667]), array([0.7]))
    """
    in_depth = _arguments.flag("objects_in_depth", objects_in_depth)
    if not isinstance(pixels, np.ndarray) or pixels.dtype != PIXELS_DTYPE:
        got = _arguments.describe(pixels)
        hint = ""
        if hasattr(pixels, "visible_fraction"):
            hint = '; pass the pixels of a cull with outputs=["pixels"]'
        raise TypeError(f"pixels: expected an array of PIXELS_DTYPE, got {got}{hint}")
    hidden = np.asarray(pixels["hidden"], np.float64)
    others = np.asarray(pixels["inside"], np.float64)
    if not in_depth:
        others = pixels["touched"] - hidden
    total = others + hidden
    return np.divide(others, total, out=np.zeros_like(total), where=total > 0)
