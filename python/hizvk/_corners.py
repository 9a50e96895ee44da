"""Oriented boxes from their eight corners, in float64."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from . import _arguments
from ._types import CornerOrder, words

if TYPE_CHECKING:
    import numpy.typing as npt

    _Floats = npt.NDArray[np.float64]

#: Where each corner lies along the box's own axes, by the order's name.
#:
#: - KITTI: devkit_object, matlab/computeBox3D.m: x along the length, y down, z along the width.
#: - nuScenes: nuscenes-devkit, utils/data_classes.py, Box.corners: x forward, y left, z up.
#: - CARLA: LibCarla, carla/geom/BoundingBox.h, GetLocalVertices.
#: - Open3D: geometry/BoundingVolume.cpp, OrientedBoundingBox::GetBoxPoints.
SIGNS: Final[dict[str, tuple[str, str, str]]] = {
    "kitti": ("++--++--", "++++----", "+--++--+"),
    "nuscenes": ("++++----", "+--++--+", "++--++--"),
    "carla": ("----++++", "--++--++", "-+-+-+-+"),
    "open3d": ("-+--+-++", "--+-++-+", "---++++-"),
}
#: For messages.
ORDERS: Final = (
    '"kitti" (also PyTorch3D: a face, then the one opposite, each one after the other), "nuscenes" '
    '(Box.corners().T), "carla" (get_world_vertices) or "open3d" (get_box_points)'
)
#: How far a corner may lie from where a box has it, as a share of the longest side.
MOST_OFF: Final = 1e-3
#: Edges that are shorter than this share of the longest one have no direction of their own.
NOTHING: Final = 1e-9


def hint(corners: Any) -> str:
    """What to do about corners of another shape."""
    sides = tuple(getattr(corners, "shape", ()))
    if sides[-2:] == (3, 8):
        return "; pass corners.swapaxes(-1, -2)"
    return "; of one box pass [corners]" if sides == (8, 3) else ""


def boxes(corners: object, order: object) -> tuple[_Floats, _Floats, _Floats]:
    """Centres, half sizes and rotations of boxes with these corners; what is no box is refused."""
    if not isinstance(order, str):
        raise TypeError(f"order: expected {ORDERS}, got {_arguments.describe(order)}")
    if order not in words(CornerOrder):
        raise ValueError(f"order: expected {ORDERS}, got {_arguments.describe(order)}")
    checked = _arguments.floats("corners", corners, ("N", 8, 3), hint=hint(corners))
    points = checked.astype(np.float64)
    # What float32 has rounded far from the origin.
    rounding = 4.0 * np.finfo(checked.dtype).eps * np.abs(points).max(axis=(1, 2), initial=0.0)
    centers, half_sizes, axes, off = _fitted(points, order)
    allowed = MOST_OFF * 2.0 * half_sizes.max(axis=1, initial=0.0) + rounding
    wrong = np.flatnonzero(off > allowed)
    if len(wrong):
        box = int(wrong[0])
        fits = [one for one in SIGNS if _fitted(points[box : box + 1], one)[3] <= allowed[box]]
        way = f'; they fit order="{fits[0]}"' if fits else ", nor in another that is known"
        raise ValueError(
            f'corners: expected the corners of boxes in the order "{order}", got {len(wrong)} of '
            f"{len(points)} that are no box in it, the first of them box {box}{way}"
        )
    return centers, half_sizes, axes


def _fitted(points: _Floats, order: str) -> tuple[_Floats, _Floats, _Floats, _Floats]:
    """Centres, half sizes and axes ``(N, 3, 3)`` in columns, and how far a corner is off ``(N,)``.

    NaN, which no comparison finds too large, where a corner is not finite.
    """
    signs = np.array([[1.0 if sign == "+" else -1.0 for sign in axis] for axis in SIGNS[order]])
    with np.errstate(all="ignore"):
        centers = points.mean(axis=1)
        spokes = points - centers[:, None]
        # Half of each of the three edges, as the mean of four.
        edges = np.einsum("kc,ncj->nkj", signs, spokes) / 8.0
        axes = _orthonormal(edges)
        along = np.einsum("nkj,ncj->nck", axes, spokes)
        half_sizes = np.abs(along).max(axis=1)
        off = np.abs(along - signs.T * np.linalg.norm(edges, axis=2)[:, None]).max(axis=(1, 2))
    return centers, half_sizes, axes.swapaxes(1, 2), off


def _orthonormal(edges: _Floats) -> _Floats:
    """``(N, 3, 3)``: axes in rows along the edges, the longest ones first to count (Gram-Schmidt).

    Edges without a length get an axis across the others.
    """
    order = np.argsort(-np.linalg.norm(edges, axis=2), axis=1, kind="stable")[:, :, None]
    sorted_ = np.take_along_axis(edges, order, axis=1)
    # Where an edge has no length, the world's axis that is least along those before.
    longest = np.abs(sorted_[:, 0]).max(axis=1, keepdims=True)
    first = _unit(sorted_[:, 0], np.broadcast_to([1.0, 0.0, 0.0], (*longest.shape[:1], 3)), 0.0)
    across = np.cross(first, np.eye(3)[np.abs(first).argmin(axis=1)])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    second = _unit(_beside(sorted_[:, 1], first), across, NOTHING * longest)
    second = _unit(_beside(second, first), across, 0.0)  # what the first time has rounded
    third = np.cross(first, second)
    third *= np.where((third * sorted_[:, 2]).sum(axis=1, keepdims=True) < 0.0, -1.0, 1.0)
    found = np.empty_like(edges)
    np.put_along_axis(found, order, np.stack([first, second, third], axis=1), axis=1)
    return found


def _beside(vectors: _Floats, axis: _Floats) -> _Floats:
    """What is left of vectors without their part along an axis of length 1."""
    found: _Floats = vectors - (vectors * axis).sum(axis=1, keepdims=True) * axis
    return found


def _unit(vectors: _Floats, otherwise: _Floats, nothing: _Floats | float) -> _Floats:
    """The directions of vectors; `otherwise` for those that are no longer than `nothing`."""
    largest = np.abs(vectors).max(axis=1, keepdims=True)
    scaled = vectors / largest  # so that no square underflows
    lengths = np.linalg.norm(scaled, axis=1, keepdims=True)
    return np.where(largest <= nothing, otherwise, scaled / lengths)
