"""Which points of a scene no occluder hides: rays in float64 at the triangles themselves.

This is the check of `hizvk.recommend`.
It shares nothing with the engine but the camera's rows, and it reads no depth image.
A point that it calls clear is in view and has no triangle before it.
In doubt (a hit on an edge, a triangle seen edge-on) it says blocked.
So rounding never makes it accuse a candidate, and it proves nothing about points that it was not
asked about.

Triangle and point are compared in homogeneous coordinates, so that triangles which cross the eye's
plane need no clipping (Olano and Greer, "Triangle scan conversion using 2D homogeneous
coordinates", 1997, section 3).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from ..bounds import Boxes, OrientedBoxes, Points, Spheres

if TYPE_CHECKING:
    from ..bounds import Bounds
    from ..camera import Camera

__all__ = ["POINTS", "Blockers", "points_of"]

Floats: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.intp]
Mask: TypeAlias = npt.NDArray[np.bool_]

#: Points of a volume in `points_of`; a volume of size zero has one.
POINTS: Final = 27
#: Part of a distance, or of a triangle's size, below which two things count as touching.
#: float64 rounds by about 1e-12 here.
HAIR: Final = 1e-9
#: Tiles per side into which triangles are sorted: small ones, larger ones, and the rest.
TILES: Final = (256, 32, 1)
#: Tiles that a triangle may meet before it goes to the coarser ones.
MOST_TILES: Final = 64
#: Pairs of a point and a triangle that are looked at in one go.
CHUNK: Final = 400_000


class Blockers:
    """The occluders' triangles as one camera sees them.

    Parameters
    ----------
    vertices : (V, 3) float64 array
        World positions.
    triangles : (T, 3) integer array
        Indices of vertices.
    faces : "none", "back" or "front"
        Which faces hide nothing, as in `Device.occluders`.
    camera : Camera
        Who looks.
    """

    def __init__(
        self, vertices: Floats, triangles: npt.NDArray[np.uint32], faces: str, camera: Camera
    ) -> None:
        self._rows = np.array(camera._inner.rows(), np.float64)
        self._origin = np.array(camera._inner.origin(), np.float64)
        self._reversed = camera.reversed_z
        self._parallel = not self._rows[3, :3].any()
        corners = self._clip(vertices)[triangles]
        x, y, z, w = np.moveaxis(corners, -1, 0)
        beside = [x > w, x < -w, y > w, y < -w, z > w, z < 0.0, w <= 0.0]
        corners = corners[~np.any([side.all(axis=1) for side in beside], axis=0)]
        self._corners = corners
        # Front faces run counter-clockwise: their sign in the image is that of `-handed`.
        handed = np.sign(np.linalg.det(self._rows[[0, 1, 2 if self._parallel else 3], :3]))
        if self._parallel and self._reversed:
            handed = -handed
        self._hidden_sign = {"none": 0.0, "back": handed, "front": -handed}[faces]
        self._lists = self._sorted(corners)

    def clear(self, points: Floats) -> Mask:
        """``(P,)``: which points ``(P, 3)`` are in the view volume with nothing before them."""
        clip = self._clip(points)
        x, y, z, w = clip.T
        clear: Mask = (
            (w > 0.0)
            & (np.abs(x) <= w)
            & (np.abs(y) <= w)
            & (z >= 0.0)
            & (z <= w)
            & np.isfinite(clip).all(axis=1)
        )
        for tiles, (members, first) in zip(TILES, self._lists, strict=True):
            asked = np.flatnonzero(clear)
            cell = _cell(clip[asked], tiles)
            count = first[cell + 1] - first[cell]
            ends = np.cumsum(count)
            cuts = np.searchsorted(
                ends, np.arange(CHUNK, max(int(ends[-1]) if len(ends) else 0, 1), CHUNK)
            )
            for part in np.split(np.arange(len(asked)), np.unique(cuts)):
                turn = np.repeat(part, count[part])
                within = np.arange(len(turn)) - np.repeat(
                    np.cumsum(count[part]) - count[part], count[part]
                )
                triangle = members[np.repeat(first[cell[part]], count[part]) + within]
                blocked = self._before(clip[asked[turn]], self._corners[triangle])
                clear[asked[turn[blocked]]] = False
        return clear

    def _clip(self, points: Floats) -> Floats:
        with np.errstate(invalid="ignore", over="ignore"):
            clip: Floats = (np.asarray(points, np.float64) - self._origin) @ self._rows[
                :, :3
            ].T + self._rows[:, 3]
        return clip

    def _sorted(self, corners: Floats) -> list[tuple[Indices, Indices]]:
        """For each of `TILES`: the triangles by tile, and where those of each tile begin."""
        x, y, _, w = np.moveaxis(corners, -1, 0)
        crosses = (w <= 0.0).any(axis=1)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            at = np.stack([x / w, y / w], axis=-1)
        low, high = at.min(axis=1) - HAIR, at.max(axis=1) + HAIR
        low[crosses], high[crosses] = -1.0, 1.0
        left = np.ones(len(corners), dtype=bool)
        lists = []
        for tiles in TILES:
            x0, y0 = _tile(low, tiles).T
            x1, y1 = _tile(high, tiles).T
            number = (x1 - x0 + 1) * (y1 - y0 + 1)
            chosen = np.flatnonzero(left & ((number <= MOST_TILES) & ~crosses | (tiles == 1)))
            left[chosen] = False
            count, wide = number[chosen], (x1 - x0 + 1)[chosen]
            member = np.repeat(chosen, count)
            within = np.arange(len(member)) - np.repeat(np.cumsum(count) - count, count)
            wide = np.repeat(wide, count)
            cell = (y0[member] + within // wide) * tiles + x0[member] + within % wide
            order = np.argsort(cell, kind="stable")
            first = np.searchsorted(cell[order], np.arange(tiles * tiles + 1))
            lists.append((member[order], first))
        return lists

    def _before(self, point: Floats, corners: Floats) -> Mask:
        """``(M,)``: whether each triangle ``(M, 3, 4)`` blocks the ray to its point ``(M, 4)``."""
        w = point[:, 3]
        at = point[:, :2] / w[:, None]
        u = corners[:, :, :2] - at[:, None] * corners[:, :, 3:]
        a, b, c = u[:, 0], u[:, 1], u[:, 2]
        weights = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], axis=1)
        total = weights.sum(axis=1)
        size = (u * u).sum(axis=2).max(axis=1)
        tolerance = HAIR * size
        meets = (weights.min(axis=1) >= -tolerance) | (weights.max(axis=1) <= tolerance)
        if self._hidden_sign:
            meets &= np.sign(total) != self._hidden_sign
        edge_on = np.abs(total) <= tolerance
        with np.errstate(divide="ignore", invalid="ignore"):
            share = weights / total[:, None]
        z, depth = (np.einsum("ij,ij->i", share, corners[:, :, k]) for k in (2, 3))
        drawn = (depth > 0.0) & (z <= depth * (1.0 + HAIR)) & (z >= -HAIR * depth)
        if self._parallel:
            ahead = z / depth - point[:, 2] / w
            nearer = ahead > HAIR if self._reversed else ahead < -HAIR
            own = (corners[:, :, 2] / corners[:, :, 3] - (point[:, 2] / w)[:, None]) * (
                1 if self._reversed else -1
            )
            touches = (own > HAIR).any(axis=1)
        else:
            nearer = depth < w * (1.0 - HAIR)
            touches = (corners[:, :, 3] < (w * (1.0 - HAIR))[:, None]).any(axis=1)
        # The depth of a triangle seen edge-on is anything between those of its corners.
        before: Mask = meets & np.where(edge_on, touches, drawn & nearer)
        return before


def _cross(a: Floats, b: Floats) -> Floats:
    area: Floats = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return area


def _tile(at: Floats, tiles: int) -> Indices:
    """The tile of each normalised coordinate; NaN goes to the first."""
    tile: Indices = np.nan_to_num(
        np.clip(np.floor((at + 1.0) * 0.5 * tiles), 0.0, tiles - 1.0)
    ).astype(np.intp)
    return tile


def _cell(clip: Floats, tiles: int) -> Indices:
    x, y = _tile(clip[:, :2] / clip[:, 3:], tiles).T
    cell: Indices = y * tiles + x
    return cell


def points_of(bounds: Bounds, which: Indices, camera: Camera) -> Floats:
    """The points of some bounds that a check looks at, ``(len(which), K, 3)``.

    K is 1 if all are bare points, else `POINTS`.

    - Box: corners, middles of edges and faces, and the centre.
    - Sphere: its centre, its nearest and farthest point, and two rings of its disc across the view.
    """
    if isinstance(bounds, Points):
        return np.asarray(bounds.positions, np.float64)[which][:, None]
    if isinstance(bounds, Spheres):
        centers = np.asarray(bounds.centers, np.float64)[which]
        radii = np.asarray(bounds.radii, np.float64)[which]
        if not radii.any():
            return centers[:, None]
        return centers[:, None] + radii[:, None, None] * _disc(centers, camera)
    if isinstance(bounds, Boxes):
        low, high = (np.asarray(corner, np.float64)[which] for corner in (bounds.min, bounds.max))
        if (low == high).all():
            return low[:, None]
        corner = LATTICE[None] > 0.0
        return np.where(
            LATTICE[None] == 0.0,
            0.5 * (low + high)[:, None],
            np.where(corner, high[:, None], low[:, None]),
        )
    assert isinstance(bounds, OrientedBoxes)
    centers, half, turn = (
        np.asarray(part, np.float64)[which]
        for part in (bounds.centers, bounds.half_sizes, bounds.rotations)
    )
    if not half.any():
        return centers[:, None]
    world: Floats = centers[:, None] + np.einsum(
        "nij,nkj->nki", turn, LATTICE[None] * half[:, None]
    )
    return world


#: A box's 27 points in units of half its sides.
LATTICE: Final[Floats] = np.stack(
    np.meshgrid(*[(-1.0, 0.0, 1.0)] * 3, indexing="ij"), axis=-1
).reshape(-1, 3)


def _disc(centers: Floats, camera: Camera) -> Floats:
    """``(n, K, 3)``: points of the unit ball whose images are spread over the ball's image."""
    rows = np.array(camera._inner.rows(), np.float64)
    clip = (centers - np.array(camera._inner.origin())) @ rows[:, :3].T + rows[:, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        at = clip[:, :2] / clip[:, 3:]
    # Across the view: the ways in which the image's x and y grow fastest.
    right, up = (rows[k, :3] - at[:, k, None] * rows[3, :3] for k in (0, 1))
    right = right / np.linalg.norm(right, axis=1, keepdims=True)
    up = up - (up * right).sum(axis=1, keepdims=True) * right
    up = up / np.linalg.norm(up, axis=1, keepdims=True)
    along = np.cross(right, up)
    angle = np.arange(16) * (np.pi / 8.0)
    ring = np.cos(angle)[:, None] * right[:, None] + np.sin(angle)[:, None] * up[:, None]
    both = np.stack([along, -along], axis=1)
    inside = 1.0 - 1e-12  # so that rounding leaves no point outside of the ball
    return np.concatenate(
        [np.zeros((len(centers), 1, 3)), inside * both, inside * ring, 0.5 * ring[:, ::2]], axis=1
    )
