"""Kinds of bounds by name, and parts of bounds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ..bounds import Bounds, Boxes, OrientedBoxes, Points, Spheres

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

__all__ = ["KINDS", "part_of"]

#: The kinds of bounds, by the names of `Instances.kind`.
KINDS: Final = {
    "spheres": Spheres,
    "boxes": Boxes,
    "oriented_boxes": OrientedBoxes,
    "points": Points,
}


def part_of(bounds: Bounds, which: npt.NDArray[np.intp]) -> Bounds:
    """The bounds at the indices `which`."""
    match bounds:
        case Spheres():
            return Spheres(bounds.centers[which], bounds.radii[which])
        case Boxes():
            return Boxes(bounds.min[which], bounds.max[which])
        case Points():
            return Points(bounds.positions[which])
    return OrientedBoxes(bounds.centers[which], bounds.half_sizes[which], bounds.rotations[which])
