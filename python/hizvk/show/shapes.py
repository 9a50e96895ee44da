"""Bounds of any kind as shapes to draw: which of them, their corners and edges.

Nothing here decides what is visible.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from ..bounds import Boxes, OrientedBoxes, Points, Spheres

if TYPE_CHECKING:
    import numpy.typing as npt

    from ..bounds import Bounds

    _Doubles = npt.NDArray[np.float64]
    _Indices = npt.NDArray[np.intp]

__all__ = ["CLASSES", "HIDDEN", "KEPT", "OUTSIDE", "Shapes", "box_edges", "chosen", "shapes_of"]

#: The classes of instances, as places in `colours.CLASS_COLOURS`.
KEPT, HIDDEN, OUTSIDE = 0, 1, 2
#: Their names in legends.
CLASSES: Final = ("kept", "culled: hidden", "culled: outside the view")
#: Each class gets at least this share of what is drawn, if it has so many members.
LEAST_SHARE: Final = 0.1

#: The corners of a box, as signs along its three axes.
SIGNS: Final = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
#: Its 12 edges, as pairs of corners that differ in one sign.
EDGES: Final = np.array(
    [[i, j] for i in range(8) for j in range(i + 1, 8) if abs(SIGNS[i] - SIGNS[j]).sum() == 2]
)


class Shapes(NamedTuple):
    """M instances that are drawn; ``boxes``, or else spheres, of radius 0 for points."""

    indices: _Indices
    """``(M,)``: their numbers."""
    classes: npt.NDArray[np.uint8]
    """``(M,)``: `KEPT`, `HIDDEN` or `OUTSIDE`."""
    centers: _Doubles
    """``(M, 3)``: world positions."""
    axes: _Doubles | None
    """``(M, 3, 3)``: of boxes the vector from the centre to the middle of a face, per axis."""
    radii: _Doubles
    """``(M,)``: of spheres; of boxes that of the sphere around them."""


def chosen(classes: npt.NDArray[np.uint8], most: int) -> _Indices:
    """At most `most` instances, evenly spread over the numbers of each class; ascending.

    Classes have their share of the instances, but no class gets less than `LEAST_SHARE` if it has
    as many members.
    """
    if len(classes) <= most:
        return np.arange(len(classes))
    members = [np.flatnonzero(classes == one) for one in (KEPT, HIDDEN, OUTSIDE)]
    least = [min(len(of), int(LEAST_SHARE * most)) for of in members]
    rest = most - sum(least)
    more = sum(len(of) - at_least for of, at_least in zip(members, least, strict=True))
    found = []
    for of, at_least in zip(members, least, strict=True):
        count = at_least + (len(of) - at_least) * rest // max(more, 1)
        found.append(of[np.arange(count) * len(of) // max(count, 1)])
    return np.sort(np.concatenate(found))


def shapes_of(bounds: Bounds, classes: npt.NDArray[np.uint8], indices: _Indices) -> Shapes:
    """The shapes of some instances; those that are not finite are left out."""
    axes: _Doubles | None = None
    match bounds:
        case Boxes():
            low = np.asarray(bounds.min[indices], np.float64)
            high = np.asarray(bounds.max[indices], np.float64)
            with np.errstate(invalid="ignore", over="ignore"):
                centers = 0.5 * low + 0.5 * high
                axes = np.eye(3) * (0.5 * high - 0.5 * low)[:, None, :]
        case OrientedBoxes():
            centers = np.asarray(bounds.centers[indices], np.float64)
            turned = np.asarray(bounds.rotations[indices], np.float64).transpose(0, 2, 1)
            axes = turned * np.asarray(bounds.half_sizes[indices], np.float64)[:, :, None]
        case Spheres():
            centers = np.asarray(bounds.centers[indices], np.float64)
        case Points():
            centers = np.asarray(bounds.positions[indices], np.float64)
    radii = np.zeros(len(indices))
    if axes is not None:
        radii = np.sqrt((axes**2).sum(axis=(1, 2)))
    elif isinstance(bounds, Spheres):
        radii = np.asarray(bounds.radii[indices], np.float64)
    finite = np.isfinite(centers).all(axis=1) & np.isfinite(radii) & (radii >= 0.0)
    return Shapes(
        indices[finite],
        classes[indices][finite],
        centers[finite],
        None if axes is None else axes[finite],
        radii[finite],
    )


def box_edges(shapes: Shapes) -> tuple[_Doubles, _Doubles, _Indices]:
    """Both ends of the edges of boxes, ``(12 M, 3)`` each, and whose edges they are."""
    assert shapes.axes is not None
    corners = shapes.centers[:, None, :] + SIGNS @ shapes.axes
    starts, ends = corners[:, EDGES[:, 0]], corners[:, EDGES[:, 1]]
    owners = np.repeat(np.arange(len(shapes.centers)), len(EDGES))
    return starts.reshape(-1, 3), ends.reshape(-1, 3), owners
