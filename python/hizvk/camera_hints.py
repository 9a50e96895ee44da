"""Hints at cameras that are right as they were asked for, and look like a mistake.

- an angle of view in radians
- a camera matrix of an image of another size, in other units, or with `cx` and `cy` swapped
"""

from __future__ import annotations

import math
import warnings
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Final

from .errors import HizWarning

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    import numpy.typing as npt

    from ._arguments import Size

__all__ = ["at_intrinsics", "at_radians", "silenced"]

#: Angles of view are usually multiples of so many degrees,
ROUND_DEG: Final = 5
#: and 1.0472, which is 60 degrees in radians with four digits, is off by half of this.
ANGLE_ROOM: Final = 3e-4
#: Narrower views are meant: in radians they would still be narrow ones.
NARROWEST: Final = 0.2
#: An image as wide as so many focal lengths shows 169 degrees: no lens without distortion does.
WIDEST: Final = 20.0
#: Two principal points are alike if they differ by less than this share of the image's side,
ALIKE: Final = 0.05
#: and apart if they differ by more than this share.
APART: Final = 0.1

_silent: ContextVar[bool] = ContextVar("silent", default=False)


@contextmanager
def silenced() -> Iterator[None]:
    """While cameras are made again, of which the caller was told already."""
    token = _silent.set(True)
    try:
        yield
    finally:
        _silent.reset(token)


def _warn(text: str, stacklevel: int) -> None:
    if not _silent.get():
        warnings.warn(text, HizWarning, stacklevel=stacklevel + 1)


def at_radians(name: str, angle: float, *, stacklevel: int) -> None:
    """Warns of an angle of view in degrees that is a usual one in radians.

    `stacklevel` is that of the constructor's caller, from the function that calls this one.
    """
    meant = math.degrees(angle)
    usual: float = ROUND_DEG * round(meant / ROUND_DEG)
    if not 0.0 < usual < 180.0 or abs(meant - usual) >= ANGLE_ROOM:
        if not NARROWEST <= angle < math.pi:
            return
        usual = float(f"{meant:.4g}")
    _warn(
        f"{name}: {angle:.6g} degrees are as narrow as a telescope's view, and {angle:.6g} "
        f"radians are {usual:g} degrees; if that is meant, pass {usual:g}",
        stacklevel + 1,
    )


def at_intrinsics(k: npt.NDArray[np.float64], size: Size, *, stacklevel: int) -> None:
    """Warns of a camera matrix that does not look like that of this image.

    `stacklevel` is that of the constructor's caller, from the function that calls this one.
    """
    (fx, _, cx), (_, fy, cy), _ = k.tolist()
    height, width = size
    text = ""
    if width > WIDEST * fx and height > WIDEST * fy:
        degrees = 2.0 * math.degrees(math.atan(width / (2.0 * fx)))
        way = "pass the focal length in pixels: millimetres * width / the sensor's width"
        if 0.0 <= cx <= 1.0 and 0.0 <= cy <= 1.0:
            way = f"of numbers from 0 to 1 pass k * [[{width}], [{height}], [1]]"
        text = (
            f"k, size: fx={fx:g} in an image of {size} pixels is a view of {degrees:.1f} degrees, "
            f"wider than a lens without distortion; {way}"
        )
    elif cx > width and cy > height:
        text = (
            f"k, size: the principal point ({cx:g}, {cy:g}) lies below and beside the image of "
            f"{size} pixels; if k belongs to a larger image, pass the size of that image, and take "
            f"camera.resized({size})"
        )
    elif _is_middle(cx, cy, (width, height)) and (
        max(abs(cx / width - 0.5), abs(cy / height - 0.5)) > APART
    ):
        text = (
            f"k, size: the principal point ({cx:g}, {cy:g}) is the middle of an image of "
            f"{(width, height)} pixels, and not of {size}; size is (height, width), and k has cx "
            "above cy, so one of the two may be swapped"
        )
    if text:
        _warn(text, stacklevel + 1)


def _is_middle(cx: float, cy: float, size: Size) -> bool:
    height, width = size
    return abs(cx / width - 0.5) < ALIKE and abs(cy / height - 0.5) < ALIKE
