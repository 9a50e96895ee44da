"""How much of a mesh's box its silhouettes fill, seen along the three axes.

The silhouettes are sampled: `SAMPLES` times `SAMPLES` points of each side of each box.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from . import voxels
from .units import unit_scale

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from ..mesh import Mesh
    from ..progress import Progress

__all__ = ["Pieces", "measured"]

#: Points along each side of a box.
SAMPLES: Final = 16


@dataclass(frozen=True, eq=False)
class Pieces:
    """The copies of meshes in the world: P pieces, one for each transform of each mesh."""

    scale: float
    """All lengths are in world units times this power of two."""
    mesh: npt.NDArray[np.intp]
    """``(P,)``: the number of its mesh."""
    triangles: npt.NDArray[np.intp]
    """``(P,)``: how many triangles are drawn for it."""
    low: npt.NDArray[np.float64]
    """``(P, 3)``: the least corner of its box."""
    high: npt.NDArray[np.float64]
    """``(P, 3)``: the greatest corner of its box."""
    silhouette: npt.NDArray[np.float64]
    """``(P, 3)``: the area that it hides, seen along x, y and z."""

    @property
    def sides(self) -> npt.NDArray[np.float64]:
        """``(P, 3)``: the areas of the box's sides across x, y and z."""
        edge = self.high - self.low
        return np.roll(edge, 1, axis=1) * np.roll(edge, 2, axis=1)

    @property
    def area(self) -> npt.NDArray[np.float64]:
        """``(P,)``: the mean silhouette."""
        found: npt.NDArray[np.float64] = self.silhouette.mean(axis=1)
        return found


def measured(meshes: Sequence[Mesh], steps: Progress) -> Pieces:
    """Boxes and silhouettes of all copies of all meshes; a mesh without triangles has no area.

    Each axis is a step.
    """
    mesh: list[int] = []
    soups: list[npt.NDArray[np.float64]] = []
    drawn: list[int] = []
    for number, one in enumerate(meshes):
        points = one.vertices.astype(np.float64)
        for matrix in [None] if one.transforms is None else one.transforms.astype(np.float64):
            with np.errstate(over="ignore", invalid="ignore"):
                placed = points if matrix is None else points @ matrix[:3, :3].T + matrix[:3, 3]
            soup = placed[one.triangles]
            mesh.append(number)
            drawn.append(len(soup))
            # A transform may move a corner out of float64.
            soups.append(soup[np.isfinite(soup).all(axis=(1, 2))])
    scale = unit_scale(soups)
    count = np.array([len(soup) for soup in soups], np.intp)
    corners = scale * np.concatenate([*soups, np.empty((0, 3, 3))])
    owner = np.repeat(np.arange(len(soups)), count)
    low, high = np.zeros((len(soups), 3)), np.zeros((len(soups), 3))
    there = count > 0
    if there.any():
        begins = (np.cumsum(count) - count)[there]
        low[there] = np.minimum.reduceat(corners.min(axis=1), begins)
        high[there] = np.maximum.reduceat(corners.max(axis=1), begins)
    pieces = Pieces(
        scale,
        np.array(mesh, np.intp),
        np.array(drawn, np.intp),
        low,
        high,
        np.zeros(low.shape),
    )
    edge = high - low
    per_unit = np.divide(SAMPLES, edge, out=np.zeros_like(edge), where=edge > 0.0)
    unit = (corners - low[owner, None]) * per_unit[owner, None]
    for axis, side in enumerate(pieces.sides.T):
        plan = unit[:, :, [(axis + 1) % 3, (axis + 2) % 3]]
        pieces.silhouette[:, axis] = side * _covered(plan, owner, len(soups))
        steps.step()
    return pieces


def _covered(
    corners: npt.NDArray[np.float64], owner: npt.NDArray[np.intp], count: int
) -> npt.NDArray[np.float64]:
    """``(count,)``: the part of each piece's samples that lie in one of its triangles.

    Parameters
    ----------
    corners : (T, 3, 2) float64 array
        Triangles in the plane; samples are at k + 1/2.
    owner : (T,) integer array
        The piece of each triangle.
    count : int
        How many pieces there are.
    """
    found = np.zeros((count, SAMPLES, SAMPLES), dtype=bool)
    edge = np.roll(corners, -1, axis=1) - corners
    twice = edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0]
    seen = np.flatnonzero(twice)  # the others are lines
    corners, edge, owner = corners[seen], edge[seen], owner[seen]
    constant = edge[:, :, 1] * corners[:, :, 0] - edge[:, :, 0] * corners[:, :, 1]
    first = np.ceil(corners.min(axis=1) - 0.5).astype(np.intp)
    last = np.floor(corners.max(axis=1) - 0.5).astype(np.intp)
    for triangle, sample in voxels.pairs(first, last - first + 1):
        x, y = sample[:, :1] + 0.5, sample[:, 1:] + 0.5
        side = edge[triangle, :, 0] * y - edge[triangle, :, 1] * x + constant[triangle]
        hit = (side >= 0.0).all(axis=1) | (side <= 0.0).all(axis=1)
        found[owner[triangle[hit]], sample[hit, 0], sample[hit, 1]] = True
    share: npt.NDArray[np.float64] = found.mean(axis=(1, 2))
    return share
