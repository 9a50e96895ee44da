"""`cube`: six cameras that see every direction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from .. import _arguments
from ..camera import Camera

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["FACES", "cube"]

#: Name, view direction and up of each face, in the order and with the axes of cube maps.
FACES: Final = (
    ("+x", (1.0, 0.0, 0.0), (0.0, -1.0, 0.0)),
    ("-x", (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)),
    ("+y", (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    ("-y", (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)),
    ("+z", (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)),
    ("-z", (0.0, 0.0, -1.0), (0.0, -1.0, 0.0)),
)


@_arguments.explained()
def cube(
    eye: npt.ArrayLike,
    *,
    size: int,
    near: float,
    far: float | None = None,
    seam_px: float = 0.5,
    reversed_z: bool = True,
) -> tuple[Camera, Camera, Camera, Camera, Camera, Camera]:
    """Six cameras at one place that see every direction, for `sweep` and `Device.cull`.

    They look along +x, -x, +y, -y, +z and -z, and are turned as the faces of a cube map are.
    Each sees a little more than its face: a seam of `seam_px` pixels on every side.
    So no direction is lost between two faces, however numbers are rounded.

    With the default of half a pixel, the outermost centres of pixels lie on the edges of the cube,
    and those of neighbours meet there.
    For cube maps that are drawn by others, with exactly 90 degrees, pass 0.

    Parameters
    ----------
    eye : three numbers
        World position.
    size : int
        Pixels per side of each face.
    near, far : float
        As in `Camera.look_at`, from the eye along each axis.
        What lies within the cube of half a side `near` around the eye is outside of all views.
    seam_px : float
        Pixels that each face shows beyond its edges, 0 to a quarter of `size`.
    reversed_z : bool
        As in `Camera.look_at`.

    Returns
    -------
    six Camera
        +x, -x, +y, -y, +z, -z.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import hizvk
    >>> cameras = hizvk.cube((0, 1.7, 0), size=256, near=0.1)
    >>> [bool(one.project([(3.0, 3.0, -3.0)]).inside[0]) for one in cameras]
    [True, False, False, False, False, True]
    """
    x, y, z = _arguments.numbers_of_shape("eye", eye, (3,), hint=_several(eye)).tolist()
    if isinstance(size, (tuple, list)):
        got = _arguments.describe(size)
        raise TypeError(f"size: expected an integer, the pixels per side of a square, got {got}")
    size = _arguments.integer("size", size, low=1, high=_arguments.LARGEST_SIDE)
    seam = _arguments.number("seam_px", seam_px, at_least=0.0, at_most=size / 4.0)
    # `size` pixels show the face, 2 wide at depth 1, and the seam on both sides.
    side = size / (size - 2.0 * seam)
    # So far that the sum with the eye is another number, and rounds along the axis alone.
    reach = max(1.0, float(np.abs((x, y, z)).max()))
    made = [
        Camera.frustum(
            (x, y, z),
            (x + reach * to[0], y + reach * to[1], z + reach * to[2]),
            up=up,
            left=-side,
            right=side,
            bottom=-side,
            top=side,
            size=(size, size),
            near=near,
            far=far,
            reversed_z=reversed_z,
        )
        for _, to, up in FACES
    ]
    a, b, c, d, e, f = made
    return a, b, c, d, e, f


def _several(eye: object) -> str:
    """The way out for several places in the place of one."""
    many = len(getattr(eye, "shape", ())) == 2 and eye.shape[1] == 3  # type: ignore[attr-defined]
    if isinstance(eye, (list, tuple)) and eye:
        many = all(hasattr(one, "__len__") and len(one) == 3 for one in eye)
    call = "[camera for one in eye for camera in hizvk.cube(one, ...)]"
    return f"; one call is for one eye, and sweep takes them all: {call}" if many else ""
