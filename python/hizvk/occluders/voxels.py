"""Which voxels of a grid lie inside of a closed mesh, surely away from its surface.

The answer is a proposal: `check_proxy` proves what is made of it.
So float64 with a tolerance suffices here.

The grid's planes are evenly spaced, and besides lie in the mesh's own axis-aligned faces.
So the walls of an axis-aligned building are met exactly.

Sources: Akenine-Moller, *Fast 3D triangle-box overlap testing* (2001), for `touched`; the winding
number by crossings along a ray, with edges evaluated in one direction for both of their triangles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy.typing as npt

__all__ = ["Grid", "inside", "pairs", "planes_of"]

#: Pairs of a triangle and a voxel or column that are looked at together.
CHUNK: Final = 1 << 18
#: The part of its size by which a triangle may miss a voxel and still count as touching.
TOLERANCE: Final = 1e-9
#: Where in a voxel its sample lies, as a share of each side: off the middle, where meshes made by
#: hand have their edges.
SAMPLE: Final = (0.4871, 0.5217, 0.5091)
#: Evenly spaced planes this near to a face's plane are left out, as a share of their distance.
CROWDED: Final = 0.25


@dataclass(frozen=True, eq=False)
class Grid:
    """Planes across x, y and z, ascending; voxel (i, j, k) lies between planes i and i + 1, etc."""

    planes: tuple[npt.NDArray[np.float64], ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """How many voxels along each axis."""
        return tuple(max(len(plane) - 1, 0) for plane in self.planes)

    def samples(self, axis: int) -> npt.NDArray[np.float64]:
        """The coordinate of the voxels' samples."""
        plane = self.planes[axis]
        return plane[:-1] + SAMPLE[axis] * np.diff(plane)

    def volumes(self) -> npt.NDArray[np.float64]:
        """``shape``: the voxels' volumes, as parts of the grid's, so that units do not matter."""
        x, y, z = (np.diff(plane) / np.ptp(plane) for plane in self.planes)
        found: npt.NDArray[np.float64] = x[:, None, None] * y[:, None] * z
        return found


def planes_of(corners: npt.NDArray[np.float64], resolution: int) -> Grid:
    """A grid about a mesh, of at most two planes per axis for each step of `resolution`.

    Parameters
    ----------
    corners : (T, 3, 3) float64 array
        The corners of the triangles.
    resolution : int
        Even steps along the longest side of the mesh's box.
    """
    if not len(corners):
        return Grid((np.empty(0),) * 3)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    step = (high - low).max() / resolution
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    planes = []
    for axis in range(3):
        flat = (corners[:, :, axis] == corners[:, :1, axis]).all(axis=1)
        faces, which = np.unique(corners[flat, 0, axis], return_inverse=True)
        largest = np.argsort(-np.bincount(which, area[flat], len(faces)), kind="stable")
        faces = np.sort(faces[largest[:resolution]])
        count = max(int(np.ceil((high[axis] - low[axis]) / step)), 1) if step > 0.0 else 1
        even = np.linspace(low[axis], high[axis], count + 1)
        if len(faces):
            above = np.searchsorted(faces, even).clip(1, max(len(faces) - 1, 1))
            gap = np.abs(even - faces[above - 1])
            if len(faces) > 1:
                gap = np.minimum(gap, np.abs(even - faces[above]))
            crowded = gap <= CROWDED * (high[axis] - low[axis]) / count
            crowded[[0, -1]] = False  # the grid holds all of the mesh
            even = even[~crowded]
        planes.append(np.unique(np.concatenate([even, faces])))
    return Grid(tuple(planes))


def inside(corners: npt.NDArray[np.float64], grid: Grid) -> npt.NDArray[np.bool_]:
    """``grid.shape``: voxels whose interior no triangle touches and that the mesh winds about."""
    if 0 in grid.shape:
        return np.zeros(grid.shape, dtype=bool)
    free: npt.NDArray[np.bool_] = ~_touched(corners, grid)
    found: npt.NDArray[np.bool_] = free & (_winding(corners, grid) != 0)
    return found


def _touched(corners: npt.NDArray[np.float64], grid: Grid) -> npt.NDArray[np.bool_]:
    """``grid.shape``: voxels whose open interior a triangle may meet."""
    found = np.zeros(grid.shape, dtype=bool)
    low, high = corners.min(axis=1), corners.max(axis=1)
    # The voxels whose open interval meets the triangle's: none for a face in a plane of the grid.
    first = np.stack(
        [np.searchsorted(p, low[:, k], "right") - 1 for k, p in enumerate(grid.planes)], axis=1
    )
    last = np.stack(
        [np.searchsorted(p, high[:, k], "left") - 1 for k, p in enumerate(grid.planes)], axis=1
    )
    for triangle, voxel in pairs(first, last - first + 1):
        at = [plane[voxel[:, k]] for k, plane in enumerate(grid.planes)]
        to = [plane[voxel[:, k] + 1] for k, plane in enumerate(grid.planes)]
        half = np.stack([0.5 * (b - a) for a, b in zip(at, to, strict=True)], axis=1)
        middle = np.stack(at, axis=1) + half
        hit = voxel[_meets(corners[triangle] - middle[:, None], half)]
        found[tuple(hit.T)] = True
    return found


def _meets(
    corners: npt.NDArray[np.float64], half: npt.NDArray[np.float64]
) -> npt.NDArray[np.bool_]:
    """Whether triangles ``(P, 3, 3)`` may meet boxes about the origin; their ranges overlap."""
    edges = np.roll(corners, -1, axis=1) - corners
    size = np.abs(corners).max(axis=(1, 2))
    normal = np.cross(edges[:, 0], edges[:, 1])
    reach = (half * np.abs(normal)).sum(axis=1)
    off = np.abs((normal * corners[:, 0]).sum(axis=1))
    meets: npt.NDArray[np.bool_] = off <= reach + TOLERANCE * size * np.abs(normal).sum(axis=1)
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        for k in range(3):
            # The cross product of the axis with the edge.
            u, v = -edges[:, k, j], edges[:, k, i]
            along = corners[:, :, i] * u[:, None] + corners[:, :, j] * v[:, None]
            reach = half[:, i] * np.abs(u) + half[:, j] * np.abs(v)
            reach += TOLERANCE * size * (np.abs(u) + np.abs(v))
            meets &= (along.min(axis=1) <= reach) & (along.max(axis=1) >= -reach)
    return meets


def _winding(corners: npt.NDArray[np.float64], grid: Grid) -> npt.NDArray[np.int64]:
    """``grid.shape``: how often the mesh winds about each sample, by a ray along +z."""
    shape = grid.shape
    x, y, z = (grid.samples(axis) for axis in range(3))
    low, high = corners.min(axis=1), corners.max(axis=1)
    first = np.stack(
        [np.searchsorted(x, low[:, 0], "left"), np.searchsorted(y, low[:, 1], "left")], axis=1
    )
    last = np.stack(
        [np.searchsorted(x, high[:, 0], "right"), np.searchsorted(y, high[:, 1], "right")], axis=1
    )
    # Crossings by column and by the number of samples below them.
    crossings = np.zeros((shape[0] * shape[1], shape[2] + 1), np.int64)
    for triangle, column in pairs(first, last - first):
        p = corners[triangle]
        px, py = x[column[:, 0]], y[column[:, 1]]
        sides = np.stack([_left_of(p[:, k], p[:, (k + 1) % 3], px, py) for k in range(3)], axis=1)
        hit = np.flatnonzero((sides == sides[:, :1]).all(axis=1))
        p, px, py = p[hit], px[hit], py[hit]
        normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
        with np.errstate(divide="ignore", invalid="ignore"):
            height = (
                p[:, 0, 2]
                - (normal[:, 0] * (px - p[:, 0, 0]) + normal[:, 1] * (py - p[:, 0, 1]))
                / normal[:, 2]
            )
        height = np.clip(height, p[:, :, 2].min(axis=1), p[:, :, 2].max(axis=1))
        below = np.searchsorted(z, height)
        place = column[hit, 0] * shape[1] + column[hit, 1]
        np.add.at(crossings, (place, below), np.where(sides[hit, 0], 1, -1))
    # A sample is wound about by the crossings above it.
    above = np.cumsum(crossings[:, ::-1], axis=1)[:, ::-1][:, 1:]
    return above.reshape(shape)


def _left_of(
    a: npt.NDArray[np.float64],
    b: npt.NDArray[np.float64],
    x: npt.NDArray[np.float64],
    y: npt.NDArray[np.float64],
) -> npt.NDArray[np.bool_]:
    """Whether (x, y) is left of the edges from a to b; exactly the opposite from b to a."""
    turned = (a[:, 0] > b[:, 0]) | ((a[:, 0] == b[:, 0]) & (a[:, 1] > b[:, 1]))
    start, end = np.where(turned[:, None], b, a), np.where(turned[:, None], a, b)
    left = (end[:, 0] - start[:, 0]) * (y - start[:, 1]) - (end[:, 1] - start[:, 1]) * (
        x - start[:, 0]
    )
    found: npt.NDArray[np.bool_] = (left >= 0.0) ^ turned
    return found


def pairs(
    first: npt.NDArray[np.intp], count: npt.NDArray[np.intp]
) -> Iterator[tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]]:
    """All cells of the blocks of each row, in parts: the row's number, and the cell ``(P, D)``.

    Parameters
    ----------
    first, count : (T, D) integer array
        Where each block begins, and how many cells it has along each axis.
    """
    total = count.clip(0).prod(axis=1)
    ends = np.cumsum(total)
    for begin in range(0, int(ends[-1]) if len(ends) else 0, CHUNK):
        flat = np.arange(begin, min(begin + CHUNK, int(ends[-1])))
        row = np.searchsorted(ends, flat, "right")
        rest = flat - (ends[row] - total[row])
        cell = np.empty((len(flat), first.shape[1]), np.intp)
        for axis in reversed(range(first.shape[1])):
            cell[:, axis] = first[row, axis] + rest % count[row, axis]
            rest = rest // count[row, axis]
        yield row, cell
