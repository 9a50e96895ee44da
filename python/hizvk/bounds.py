"""The volumes that are tested: spheres, axis-aligned boxes and oriented boxes, as arrays over the instances.

The arrays are kept as they come (float32 and float64 in C order without a copy) and are read when they are uploaded
(`Device.instances`). Positions may be float64: the engine re-centres them on the eye before it rounds. Bad bounds
(NaN, infinite, a negative radius or half size, min > max) are no error here: a cull keeps them visible and counts them,
or `Device.instances(..., strict=True)` refuses them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from . import _arguments

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._arguments import FloatArray

__all__ = ["Boxes", "OrientedBoxes", "Spheres"]


@dataclass(frozen=True, eq=False, repr=False)
class Spheres:
    """Bounding spheres.

    Parameters
    ----------
    centers : (N, 3) float array
        World positions.
    radii : (N,) float array or one number
        World units; 0 is a point.

    Raises
    ------
    TypeError
        For a dtype that is not float16, float32 or float64.
    ValueError
        For another shape.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> hizvk.Spheres(np.zeros((4, 3)), 0.5)
    Spheres(4 of float64)
    """

    centers: FloatArray
    radii: FloatArray

    def __init__(self, centers: npt.ArrayLike, radii: npt.ArrayLike) -> None:
        centers = _arguments.floats("centers", centers, ("N", 3))
        object.__setattr__(self, "centers", centers)
        object.__setattr__(self, "radii", _arguments.floats_or_scalar("radii", radii, len(centers)))

    def __len__(self) -> int:
        return len(self.centers)

    def __repr__(self) -> str:
        return f"Spheres({len(self)} of {self.centers.dtype})"


@dataclass(frozen=True, eq=False, repr=False)
class Boxes:
    """Axis-aligned boxes.

    Parameters
    ----------
    min, max : (N, 3) float array
        The two corners in world units; a side may have length 0.

    Raises
    ------
    TypeError
        For a dtype that is not float16, float32 or float64.
    ValueError
        For another shape.
    """

    min: FloatArray
    max: FloatArray

    def __init__(self, min: npt.ArrayLike, max: npt.ArrayLike) -> None:
        low = _arguments.floats("min", min, ("N", 3))
        object.__setattr__(self, "min", low)
        object.__setattr__(self, "max", _arguments.floats("max", max, (len(low), 3)))

    def __len__(self) -> int:
        return len(self.min)

    def __repr__(self) -> str:
        return f"Boxes({len(self)} of {self.min.dtype})"


@dataclass(frozen=True, eq=False, repr=False)
class OrientedBoxes:
    """Boxes with axes of their own.

    Parameters
    ----------
    centers : (N, 3) float array
        World positions.
    half_sizes : (N, 3) float array
        Half the side along each of the box's own axes.
    rotations : (N, 3, 3) float array
        Column ``k`` is the world direction of the box's axis ``k``: ``world = center + rotation @ local``. Any matrix
        is allowed (scaled, sheared, mirrored, flat), not rotations alone.

    Raises
    ------
    TypeError
        For a dtype that is not float16, float32 or float64.
    ValueError
        For another shape.
    """

    centers: FloatArray
    half_sizes: FloatArray
    rotations: FloatArray

    def __init__(self, centers: npt.ArrayLike, half_sizes: npt.ArrayLike, rotations: npt.ArrayLike) -> None:
        centers = _arguments.floats("centers", centers, ("N", 3))
        count = len(centers)
        object.__setattr__(self, "centers", centers)
        object.__setattr__(self, "half_sizes", _arguments.floats("half_sizes", half_sizes, (count, 3)))
        object.__setattr__(self, "rotations", _arguments.floats("rotations", rotations, (count, 3, 3)))

    def __len__(self) -> int:
        return len(self.centers)

    def __repr__(self) -> str:
        return f"OrientedBoxes({len(self)} of {self.centers.dtype})"


Bounds: TypeAlias = Spheres | Boxes | OrientedBoxes


def as_arrays(name: str, bounds: object) -> tuple[str, tuple[FloatArray, ...]]:
    """The kind's name in the engine and its arrays; a `TypeError` for anything that is no bounds."""
    match bounds:
        case Spheres():
            return "spheres", (bounds.centers, bounds.radii)
        case Boxes():
            return "boxes", (bounds.min, bounds.max)
        case OrientedBoxes():
            return "oriented_boxes", (bounds.centers, bounds.half_sizes, bounds.rotations)
    got = _arguments.describe(bounds)
    raise TypeError(f"{name}: expected Spheres, Boxes or OrientedBoxes, got {got}")


def are_points(bounds: Bounds) -> bool:
    """Whether there are bounds, and all of them have size zero."""
    with np.errstate(invalid="ignore"):  # signalling NaN
        match bounds:
            case Spheres():
                return len(bounds) > 0 and not np.any(bounds.radii)
            case Boxes():
                return len(bounds) > 0 and bool(np.array_equal(bounds.min, bounds.max))
        return len(bounds) > 0 and not np.any(bounds.half_sizes)
