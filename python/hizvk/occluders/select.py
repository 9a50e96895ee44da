"""Drops poor occluders before any view is known.

What is left out is small, has an ill-shaped bounding volume or many polygons, or is redundant.
These are the criteria of Moller and Haines, *Real-Time Rendering* (1999), for the database of
occluders.
They follow Zhang et al., *Visibility culling using hierarchical occlusion maps* (1997).

A dropped occluder never makes a cull wrong.
It is hidden behind others or seen as before; it only hides nothing itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from .. import _arguments
from ..mesh import A_MESH, meshes_of
from ..progress import Progress
from . import silhouettes

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from ..mesh import MeshLike
    from ..progress import ProgressLike
    from .silhouettes import Pieces

    _Numbers: TypeAlias = tuple[
        npt.NDArray[np.intp], npt.NDArray[np.float64], npt.NDArray[np.float64]
    ]

__all__ = ["OccluderSelection", "select_occluders"]

#: No mesh of fewer triangles is dropped for their number: drawing it costs about as much as a call.
MANY: Final = 128
#: A mesh is redundant beside one that has at least this many times its silhouette,
LARGER: Final = 4.0
#: and whose silhouettes each fill at least this part of its box's side.
SOLID: Final = 0.9
#: Pairs of boxes that are compared together.
PAIRS: Final = 1 << 22


@dataclass(frozen=True, eq=False, repr=False)
class OccluderSelection:
    """Which meshes are worth rendering as occluders; made by `select_occluders`."""

    kept: npt.NDArray[np.intp]
    """The numbers of the meshes to keep, the most silhouette per triangle first."""
    reasons: dict[int, str]
    """Why each of the other meshes was dropped, by its number.

    A reason begins with ``small``, ``ill-shaped``, ``high-polygon``, ``redundant`` or ``budget``.
    """
    triangles: npt.NDArray[np.intp]
    """``(N,)``: the triangles of each mesh, all copies together."""
    area: npt.NDArray[np.float64]
    """``(N,)``: the mean silhouette of each mesh, all copies together, in square world units."""
    fill: npt.NDArray[np.float64]
    """``(N,)``: the part of the sides of its boxes that the silhouettes fill, 0 to 1."""

    def __len__(self) -> int:
        """The number of kept meshes."""
        return len(self.kept)

    def __repr__(self) -> str:
        return (
            f"OccluderSelection({len(self)} of {len(self.triangles)} meshes, "
            f"{self.triangles[self.kept].sum()} of {self.triangles.sum()} triangles)"
        )


def select_occluders(
    meshes: Sequence[MeshLike | tuple[npt.ArrayLike, ...]] | MeshLike,
    *,
    min_size: float = 0.005,
    min_fill: float = 0.25,
    max_density: float | None = 100.0,
    max_protrusion: float | None = 0.25,
    max_triangles: int | None = None,
    progress: ProgressLike = None,
) -> OccluderSelection:
    """Drops the meshes that are poor occluders, whatever the view.

    Silhouettes are those along x, y and z, sampled by 16 x 16 points each.
    The *area* of a mesh is their mean, and its *size* is the square root of that.
    A mesh is dropped for the first of these reasons that holds:

    ==============  ===========================================================================
    small           size / diagonal of the box around all meshes < `min_size`
    ill-shaped      silhouettes / sides of the mesh's box < `min_fill`
    high-polygon    triangles / area > `max_density` * all triangles / sum of all areas, and at
                    least 128 triangles
    redundant       it sticks out of a much larger mesh by at most `max_protrusion` * its longest
                    side, as a clock on a wall
    budget          it does not fit into `max_triangles`
    ==============  ===========================================================================

    - *Much larger* means four times the area, where each silhouette fills 0.9 of its side.
    - Under a budget, meshes are taken by area / triangles as long as they fit.
    - A mesh with transforms counts as one.
      It is as large as its largest copy, and redundant if each of its copies is.

    The criteria judge each mesh alone, so a wall of bricks is dropped brick by brick.
    Join such meshes first, or `split_mesh` them together: its groups are judged as a whole.
    Split large meshes as well, so that a part of them can be kept (`SplitMesh.meshes`).

    Parameters
    ----------
    meshes : list of Mesh, of tuples, or of meshes of trimesh, Open3D or PyVista; or one Mesh
        A tuple is ``(vertices, triangles)`` or ``(vertices, triangles, transforms)``.
    min_size : float
        Part of the diagonal, 0 to 1; 0 drops only what has no area.
    min_fill : float
        0 to 1; 0 drops nothing.
    max_density : float, optional
        Above 0; None drops nothing.
    max_protrusion : float, optional
        0 or more; None drops nothing.
    max_triangles : int, optional
        The budget for all copies of all kept meshes; None: no limit.
    progress : bool or function, optional
        As everywhere (`hizvk.progress`); silhouettes take three steps, the rest one.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import hizvk
    >>> from hizvk.scenes import box_mesh
    >>> wall = box_mesh([[0, 0, 0]], [[10, 0.25, 3]])
    >>> clock = box_mesh([[4, 0.25, 2]], [[4.3, 0.3, 2.3]])
    >>> found = hizvk.select_occluders([clock, wall])
    >>> found.kept.tolist(), found.reasons[0]
    ([1], 'redundant: within 0.075 of mesh 1, which is 277 times larger')
    """
    expected = f"{A_MESH}, or a list of them or of tuples (vertices, triangles[, transforms])"
    given = meshes_of("meshes", meshes, expected)
    least_size = _arguments.number("min_size", min_size, at_least=0.0, at_most=1.0)
    least_fill = _arguments.number("min_fill", min_fill, at_least=0.0, at_most=1.0)
    density = None
    if max_density is not None:
        density = _arguments.number("max_density", max_density, above=0.0)
    protrusion = None
    if max_protrusion is not None:
        protrusion = _arguments.number("max_protrusion", max_protrusion, at_least=0.0)
    budget = None
    if max_triangles is not None:
        budget = _arguments.integer("max_triangles", max_triangles, low=0, high=2**62)
    with Progress(progress, "selecting occluders", 4) as steps:
        pieces = silhouettes.measured(given, steps)
        reasons, numbers = _poor(pieces, len(given), least_size, least_fill, density, protrusion)
        found = _within(budget, *numbers, reasons, pieces.scale)
        steps.step()
    return found


def _poor(
    pieces: Pieces,
    count: int,
    least_size: float,
    least_fill: float,
    density: float | None,
    protrusion: float | None,
) -> tuple[dict[int, str], _Numbers]:
    """Why meshes are dropped before the budget; and triangles, area and fill of each."""
    unit = pieces.scale
    triangles = _summed(pieces, pieces.triangles, count).astype(np.intp)
    area = _summed(pieces, pieces.area, count)
    sides = _summed(pieces, pieces.sides.mean(axis=1), count)
    fill = np.divide(area, sides, out=np.zeros(count), where=sides > 0.0)
    reasons: dict[int, str] = {}

    size = np.zeros(count)
    np.maximum.at(size, pieces.mesh, np.sqrt(pieces.area))
    there = size[pieces.mesh] > 0.0
    diagonal = 0.0
    if there.any():
        diagonal = float(np.linalg.norm(pieces.high[there].max(0) - pieces.low[there].min(0)))
    for k in np.flatnonzero((size == 0.0) | (size < least_size * diagonal)).tolist():
        reasons[k] = (
            f"small: its size is {size[k] / unit:.3g}, below {least_size:g} of the diagonal "
            f"{diagonal / unit:.3g}"
            if size[k] > 0.0
            else "small: it has no silhouette"
        )
    for k in np.flatnonzero(fill < least_fill).tolist():
        reasons.setdefault(
            k, f"ill-shaped: it fills {fill[k]:.2g} of its box's sides, below {least_fill:g}"
        )
    if density is not None and area.sum() > 0.0:
        usual = triangles.sum() / area.sum()
        # What has no area is small already.
        times = np.divide(triangles / usual, area, out=np.zeros(count), where=area > 0.0)
        for k in np.flatnonzero((triangles >= MANY) & (times > density)).tolist():
            reasons.setdefault(
                k,
                f"high-polygon: {triangles[k]} triangles, {times[k]:.3g} times as many for its "
                f"area as all meshes have, above {density:g}",
            )
    if protrusion is not None:
        _drop_redundant(pieces, protrusion, reasons)
    return reasons, (triangles, area, fill)


def _summed(pieces: Pieces, values: npt.NDArray[np.generic], count: int) -> npt.NDArray[np.float64]:
    """The sum over the copies of each mesh."""
    return np.bincount(pieces.mesh, values, count).astype(np.float64)


def _drop_redundant(pieces: Pieces, protrusion: float, reasons: dict[int, str]) -> None:
    """Adds the meshes of which each copy lies in the box of a much larger one, grown a little."""
    sides = pieces.sides
    fill = np.divide(pieces.silhouette, sides, out=np.ones_like(sides), where=sides > 0.0)
    alive = ~np.isin(pieces.mesh, list(reasons))
    hosts = np.flatnonzero(alive & (fill >= SOLID).all(axis=1))
    asked = np.flatnonzero(alive)
    reach = protrusion * (pieces.high - pieces.low).max(axis=1)
    host = np.full(len(pieces.mesh), -1, np.intp)
    for part in np.array_split(asked, 1 + len(asked) * len(hosts) // PAIRS):
        fits = pieces.area[hosts] >= LARGER * pieces.area[part, None]
        for k in range(3):
            fits &= pieces.low[part, None, k] >= pieces.low[hosts, k] - reach[part, None]
            fits &= pieces.high[part, None, k] <= pieces.high[hosts, k] + reach[part, None]
        if len(hosts):
            host[part] = np.where(fits.any(axis=1), hosts[fits.argmax(axis=1)], -1)
    free = np.zeros(int(pieces.mesh.max(initial=-1)) + 1, dtype=bool)
    free[pieces.mesh[host < 0]] = True
    for k in np.flatnonzero(host >= 0).tolist():
        mesh = int(pieces.mesh[k])
        if not free[mesh]:
            times = pieces.area[host[k]] / pieces.area[k]
            reasons.setdefault(
                mesh,
                f"redundant: within {reach[k] / pieces.scale:.3g} of mesh "
                f"{pieces.mesh[host[k]]}, which is {times:.3g} times larger",
            )


def _within(
    budget: int | None,
    triangles: npt.NDArray[np.intp],
    area: npt.NDArray[np.float64],
    fill: npt.NDArray[np.float64],
    reasons: dict[int, str],
    unit: float,
) -> OccluderSelection:
    """What is not dropped yet, the most area per triangle first, as far as the budget goes."""
    left = np.array([k for k in range(len(area)) if k not in reasons], np.intp)
    ranked = left[np.argsort(-area[left] / triangles[left], kind="stable")].tolist()
    kept: list[int] = []
    spent = 0
    for k in ranked:
        if budget is not None and spent + int(triangles[k]) > budget:
            reasons[k] = (
                f"budget: {triangles[k]} triangles do not fit beside the {spent} of better ones "
                f"into {budget}"
            )
            continue
        kept.append(k)
        spent += int(triangles[k])
    with np.errstate(over="ignore"):  # infinite beyond float64
        world = area / unit / unit
    return OccluderSelection(np.array(kept, np.intp), reasons, triangles, world, fill)
