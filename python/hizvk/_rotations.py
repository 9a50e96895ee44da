"""Rotation matrices from angles and quaternions, in float64.

From here on, the rotation is the float64 matrix that was formed.
A camera or a box has exactly this matrix, so a cull need not cover the roundings here, about 1e-16.
"""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .errors import HizWarning

if TYPE_CHECKING:
    import numpy.typing as npt


#: Data sets write angles with two digits, so 1.56 to 1.58 are a quarter turn in radians.
QUARTER_ROOM: Final = 0.015


def warn_of_radians(name: str, degrees: npt.NDArray[Any], *, stacklevel: int = 4) -> None:
    """Warns of angles that are turns of boxes in radians: most are quarter or half turns.

    Nobody turns most boxes by 1.57 or 3.14 degrees.
    """
    size = np.abs(np.asarray(degrees, np.float64))
    turned = size[np.isfinite(size) & (size > 0.0)]
    quarters = np.round(turned / (math.pi / 2.0))
    is_near = (quarters >= 1.0) & (np.abs(turned - quarters * (math.pi / 2.0)) < QUARTER_ROOM)
    if turned.size and turned.max() < math.pi + QUARTER_ROOM and 2 * is_near.sum() > turned.size:
        warnings.warn(
            f"{name}: most of the {turned.size:,} turned boxes are turned by 1.57 or 3.14 degrees, "
            "which are a quarter and half a turn in radians; if that is meant, pass "
            "np.degrees(yaw)",
            HizWarning,
            stacklevel=stacklevel,
        )


def from_quaternions(w: Any, x: Any, y: Any, z: Any) -> npt.NDArray[np.float64]:
    """``(N, 3, 3)`` from the four parts, ``(N,)`` each, of Hamilton quaternions.

    They may have any length; one of length 0, or one that is not finite, becomes a matrix of NaN.
    """
    parts = np.stack([np.asarray(part, np.float64) for part in (w, x, y, z)])
    with np.errstate(all="ignore"):
        parts = parts / np.abs(parts).max(axis=0)  # so that no square overflows or underflows
        w, x, y, z = parts / np.sqrt((parts * parts).sum(axis=0))
        rows = (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
        )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def about(axis: tuple[float, float, float], degrees: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    """``(N, 3, 3)``: turns about one axis by the right-hand rule (Rodrigues's formula).

    Whole quarter turns are exact; an angle that is not finite becomes a matrix of NaN.
    """
    direction = np.asarray(axis, np.float64)
    direction = direction / np.abs(direction).max()
    direction = direction / np.linalg.norm(direction)
    with np.errstate(all="ignore"):
        angle = np.mod(np.asarray(degrees, np.float64), 360.0)
        quarters = np.round(angle / 90.0)
        rest = np.radians(angle - 90.0 * quarters)
        sine, cosine = np.sin(rest), np.cos(rest)
        turn = np.mod(quarters, 4.0)
        sine, cosine = (
            np.select(
                [turn == 0, turn == 1, turn == 2, turn == 3], [sine, cosine, -sine, -cosine], np.nan
            ),
            np.select(
                [turn == 0, turn == 1, turn == 2, turn == 3], [cosine, -sine, -cosine, sine], np.nan
            ),
        )
    x, y, z = direction
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    along = np.outer(direction, direction)
    sine, cosine = sine[:, None, None], cosine[:, None, None]
    turned: npt.NDArray[np.float64] = cosine * np.eye(3) + sine * across + (1.0 - cosine) * along
    return turned
