"""Cuts a mesh or a polygon soup into groups that are occluders and instances at once.

A triangle goes to the cell of a lattice in which the middle of its box lies.
The lattice is coarser for larger triangles, as in a loose octree (Ulrich, *Loose octrees*, in
*Game Programming Gems*, 2000).
So no triangle is cut, and a large one does not blow up the bounds of small ones.

Cutting would move corners by a rounding, and the occluder would no longer be the surface that is
drawn.
It would also part triangles from the edges that they share, where conservative depth then sees a
crack.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .. import _arguments, foreign
from ..bounds import Boxes
from ..mesh import A_MESH, Mesh, as_mesh
from ..progress import Progress

if TYPE_CHECKING:
    import numpy.typing as npt

    from .._arguments import FloatArray
    from ..mesh import MeshLike
    from ..progress import ProgressLike

__all__ = ["SplitMesh", "split_mesh"]

#: Triangles up to ``(1 - 2**-k) * cell`` go to cells of ``2**-k * cell``, for k up to this.
#: Larger ones that still fit a cell are groups of one triangle.
FINEST: Final = 5
#: Cells are smaller by this part, so that no rounding of a division makes a group too large.
ROUNDING: Final = 1.0 - 2.0**-20


@dataclass(frozen=True, eq=False, repr=False)
class SplitMesh:
    """A mesh in groups of triangles; made by `split_mesh`.

    Group g has the triangles ``triangles[offsets[g]:offsets[g + 1]]``.
    With `triangles` as the index buffer, its draw arguments are ``first_index = 3 * offsets[g]``
    and ``index_count = 3 * (offsets[g + 1] - offsets[g])``.
    """

    vertices: FloatArray
    """``(V, 3)``: the positions as they were given."""
    triangles: npt.NDArray[np.uint32]
    """``(K, 3)``: indices of `vertices`, group after group."""
    order: npt.NDArray[np.intp]
    """``(K,)``: the caller's number of each row of `triangles`; ascending within a group."""
    offsets: npt.NDArray[np.intp]
    """``(G + 1,)``: where each group begins; the last one is K."""
    boxes: Boxes
    """The exact bounds of each group: least and greatest coordinates, without any rounding."""
    invalid: npt.NDArray[np.intp]
    """The caller's numbers of triangles with a NaN or infinite corner, ascending.

    They are in no group, because nothing bounds them."""

    def __len__(self) -> int:
        """The number of groups."""
        return len(self.boxes)

    def __repr__(self) -> str:
        return f"SplitMesh({len(self.order)} triangles in {len(self)} groups)"

    @property
    def group_of(self) -> npt.NDArray[np.intp]:
        """``(T,)``: the group of each of the caller's triangles; -1 for those in `invalid`."""
        group = np.full(len(self.order) + len(self.invalid), -1, np.intp)
        group[self.order] = np.repeat(np.arange(len(self)), np.diff(self.offsets))
        return group

    def triangle_mask(self, mask: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """``(T,)``: which of the caller's triangles lie in the groups of `mask`.

        Parameters
        ----------
        mask : (G,) bool array
            One for each group, such as `CullResult.mask`.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        chosen = _arguments.bools("mask", mask, len(self))
        triangles = np.zeros(len(self.order) + len(self.invalid), dtype=bool)
        triangles[self.order] = np.repeat(chosen, np.diff(self.offsets))
        return triangles

    def mesh(self, mask: npt.ArrayLike | None = None) -> Mesh:
        """The groups as one mesh for `Device.occluders`, without the vertices that none uses.

        Parameters
        ----------
        mask : (G,) bool array, optional
            Which groups; None: all.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        triangles = self.triangles
        if mask is not None:
            chosen = _arguments.bools("mask", mask, len(self))
            triangles = triangles[np.repeat(chosen, np.diff(self.offsets))]
        used = np.zeros(len(self.vertices), dtype=bool)
        used[triangles] = True
        number = np.cumsum(used) - 1
        return Mesh(self.vertices[used], number[triangles])

    def meshes(self) -> list[Mesh]:
        """One mesh for each group, for example for `select_occluders`."""
        found = []
        for begin, end in zip(self.offsets[:-1], self.offsets[1:], strict=True):
            used, corners = np.unique(self.triangles[begin:end], return_inverse=True)
            found.append(Mesh(self.vertices[used], corners.reshape(-1, 3)))
        return found


def split_mesh(
    vertices: npt.ArrayLike | MeshLike,
    triangles: npt.ArrayLike | None = None,
    *,
    cell: float,
    progress: ProgressLike = None,
) -> SplitMesh:
    """Cuts a mesh into groups of neighbouring triangles that fit a cube of side `cell`.

    The groups are occluders and instances at once: `SplitMesh.mesh` is rendered, and
    `SplitMesh.boxes` are culled.
    Triangles need no connectivity.
    With conservative depth no group hides a part of itself: see ``docs/occluders.md``.

    - Each triangle is in exactly one group, and none is cut.
    - A group of triangles that fit a cube of side `cell` fits one itself.
    - A triangle that is larger is grouped with others of its size.
      No side of such a group's box is above three times the longest side of any of its triangles'
      boxes.
    - A triangle without area hides nothing; it is grouped and bounded like the others.
    - A triangle with a NaN or infinite corner is in no group; `SplitMesh.invalid` lists it.

    A million triangles take about two seconds.

    Parameters
    ----------
    vertices : (V, 3) or (T, 3, 3) float array; or a Mesh, a mesh of trimesh, Open3D or PyVista
        World positions; ``(T, 3, 3)`` holds the three corners of each triangle.
        A Mesh must have no transforms.
    triangles : (T, 3) integer array, optional
        Indices of vertices; left out for ``(T, 3, 3)`` and for meshes.
    cell : float
        In world units, above 0.
        Smaller cells hide more and cost more bounds.
        Some 50 to 500 triangles to a group are a good start.
    progress : bool or function, optional
        As everywhere (`hizvk.progress`); the call is one step.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> soup = np.stack([corners, corners + 50.0, corners + 0.25])
    >>> split = hizvk.split_mesh(soup, cell=4.0)
    >>> split, split.group_of.tolist(), split.boxes.max[0].tolist()
    (SplitMesh(3 triangles in 2 groups), [0, 1, 0], [1.25, 1.25, 0.25])
    """
    side = _arguments.number("cell", cell, above=0.0)
    points, faces = _mesh_or_soup(vertices, triangles)
    with Progress(progress, "splitting a mesh", 1) as steps:
        split = _split(points, faces, side)
        steps.step()
    return split


def _split(points: FloatArray, faces: npt.NDArray[np.uint32], side: float) -> SplitMesh:
    """What `split_mesh` returns, of checked arguments."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    # NaN passes through both.
    finite = np.isfinite(low).all(axis=1) & np.isfinite(high).all(axis=1)
    numbers = np.flatnonzero(finite)
    low, high = low[numbers], high[numbers]
    size, column = _cells(low.astype(np.float64), high.astype(np.float64), side)
    # The last key of lexsort is the first to count; it keeps the order of equal ones.
    order = np.lexsort((*column.T, size))
    size, column, low, high = size[order], column[order], low[order], high[order]
    begins = np.ones(len(order), dtype=bool)
    begins[1:] = (size[1:] != size[:-1]) | (column[1:] != column[:-1]).any(axis=1)
    first = np.flatnonzero(begins)
    return SplitMesh(
        vertices=points,
        triangles=faces[numbers[order]],
        order=numbers[order],
        offsets=np.append(first, len(order)).astype(np.intp),
        boxes=_boxes(low, high, first),
        invalid=np.flatnonzero(~finite),
    )


def _mesh_or_soup(vertices: Any, triangles: Any) -> tuple[FloatArray, npt.NDArray[np.uint32]]:
    """Positions ``(V, 3)`` and triangles ``(T, 3)`` of any form that `split_mesh` takes."""
    if triangles is not None:
        points = _arguments.floats("vertices", vertices, ("V", 3))
        return points, _arguments.triangles("triangles", triangles, len(points))
    is_mesh = isinstance(vertices, tuple) or foreign.mesh_parts("vertices", vertices) is not None
    if is_mesh or foreign.way_to_a_mesh(vertices):
        mesh = as_mesh("vertices", vertices, A_MESH)
        if mesh.transforms is not None:
            raise ValueError(f"vertices: expected a mesh without transforms, got {mesh!r}")
        return mesh.vertices, mesh.triangles
    why = f" (triangles is left out), or {A_MESH}"
    soup = _arguments.floats("vertices", vertices, ("T", 3, 3), why=why)
    numbers = np.arange(3 * len(soup), dtype=np.uint32)
    return soup.reshape(-1, 3), numbers.reshape(-1, 3)


def _cells(
    low: npt.NDArray[np.float64], high: npt.NDArray[np.float64], cell: float
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """The side of each box's lattice ``(T,)``, and its cell there ``(T, 3)``; equal: one group."""
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        extent = (high - low).max(axis=1, initial=0.0)  # infinite where it leaves float64
        part = extent / cell
        # What is left of a cell beside the triangle, rounded down to a power of two.
        finer = np.ceil(-np.log2(1.0 - part))
        fitting = cell * np.exp2(-np.maximum(finer, 1.0))
        larger = np.exp2(np.ceil(np.log2(extent)) - 1.0)
        pitch = ROUNDING * np.where(part <= 1.0, fitting, larger)
        middle = 0.5 * low + 0.5 * high
        origin = low.min(axis=0, initial=np.inf)
        column = np.floor((middle - origin) / pitch[:, None])
    alone = (part <= 1.0) & ~(finer <= FINEST)
    # Negative, so they are no cell of any lattice.
    column[alone, 0] = -1.0 - np.flatnonzero(alone)
    return pitch, column


def _boxes(low: FloatArray, high: FloatArray, first: npt.NDArray[np.intp]) -> Boxes:
    if not len(first):
        return Boxes(low, high)
    return Boxes(np.minimum.reduceat(low, first), np.maximum.reduceat(high, first))
