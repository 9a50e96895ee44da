"""Boxes inside of a closed mesh, as occluders of twelve triangles each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .. import _arguments
from ..bounds import Boxes
from ..check import check_proxy
from ..mesh import A_MESH, Mesh, as_mesh
from ..progress import Progress
from . import growth, voxels
from .units import unit_scale

if TYPE_CHECKING:
    import numpy.typing as npt

    from ..mesh import MeshLike
    from ..progress import ProgressLike

__all__ = ["InnerBoxes", "closed_mesh", "inner_boxes"]

#: The finest grid: its voxels and sums take 0.3 GB.
MOST_STEPS: Final = 128
#: The corners of each side of a box, outside in view counter-clockwise; corner 1 lies along x, 2
#: along y, 4 along z.
SIDES: Final = (
    (0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6),
)  # fmt: skip
#: What an open mesh can do instead.
WAY_OUT: Final = (
    "close its holes, split_mesh it and render groups of it, or render the mesh itself: any "
    "triangles may be occluders"
)


@dataclass(frozen=True, eq=False, repr=False)
class InnerBoxes:
    """Boxes inside of a mesh; made by `inner_boxes`."""

    boxes: Boxes
    """The B boxes, the most valuable first; each was proven inside by `check_proxy`."""
    mesh: Mesh
    """Their triangles, 12 for each box in order, for `Device.occluders`."""
    volume_share: float
    """The part of the inside voxels' volume that the boxes fill, 0 to 1, before the margin."""
    rejected: int
    """How many boxes could not be proven inside; they are left out."""

    def __len__(self) -> int:
        """The number of boxes."""
        return len(self.boxes)

    def __repr__(self) -> str:
        return f"InnerBoxes({len(self)} boxes, {100.0 * self.volume_share:.0f} % of the volume)"


def inner_boxes(
    vertices: npt.ArrayLike | MeshLike,
    triangles: npt.ArrayLike | None = None,
    *,
    resolution: int = 32,
    max_boxes: int = 16,
    min_share: float = 0.01,
    margin: float = 0.0,
    progress: ProgressLike = None,
) -> InnerBoxes:
    """Finds axis-aligned boxes inside of a closed mesh, to be rendered in its stead.

    The boxes hide less than the mesh, and nothing that it does not hide.
    Each of them has passed `check_proxy`, which is exact.
    What that proves, and what it does not, stands there.

    1. The mesh's box is cut into voxels; planes of axis-aligned faces are planes of the grid.
    2. A voxel is inside if no triangle touches its interior and the mesh winds about it.
    3. Boxes of such voxels grow from many seeds.
       Then those are picked whose mean silhouette times newly filled part is largest.
    4. `check_proxy` decides about each one.

    Details finer than a voxel make no boxes, such as thin walls that are not axis-aligned.
    Turned buildings are better served by `inner_prisms`.

    Parameters
    ----------
    vertices : (V, 3) float array; or a Mesh, a mesh of trimesh, Open3D or PyVista
        World positions, or those of the mesh's own space.
    triangles : (T, 3) integer array, optional
        Indices of vertices; left out for meshes.
    resolution : int
        Even steps of the grid along the longest side, 1 to 128.
    max_boxes : int
        At most so many boxes, 1 or more.
    min_share : float
        A box has at least this part of the inside volume to itself, 0 to 1.
    margin : float
        World units by which each side of a box is moved inwards.
        Leave room where boxes and mesh are rounded differently, as by a renderer's float32.
    progress : bool or function, optional
        As everywhere (`hizvk.progress`).

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
        An open mesh is refused: it has no inside.

    Examples
    --------
    >>> import hizvk
    >>> from hizvk.scenes import box_mesh
    >>> tower = box_mesh([[0, 0, 0], [0, 0, 2]], [[4, 4, 2], [2, 2, 9]])  # a low part, a high one
    >>> found = hizvk.inner_boxes(*tower)
    >>> found, found.boxes.max.tolist()
    (InnerBoxes(2 boxes, 100 % of the volume), [[2.0, 2.0, 9.0], [4.0, 4.0, 2.0]])
    """
    mesh = closed_mesh(vertices, triangles)
    resolution = _arguments.integer("resolution", resolution, low=1, high=MOST_STEPS)
    most = _arguments.integer("max_boxes", max_boxes, low=1, high=2**20)
    least = _arguments.number("min_share", min_share, at_least=0.0, at_most=1.0)
    room = _arguments.number("margin", margin, at_least=0.0)
    with Progress(progress, "finding inner boxes", 3) as steps:
        return _boxes_in(mesh, resolution, most, least, room, steps)


def _boxes_in(
    mesh: Mesh, resolution: int, most: int, least: float, room: float, steps: Progress
) -> InnerBoxes:
    """What `inner_boxes` returns, of checked arguments, in three steps."""
    points = mesh.vertices.astype(np.float64)
    scale = unit_scale([points])
    corners = (scale * points)[mesh.triangles]
    grid = voxels.planes_of(corners, resolution)
    free = voxels.inside(corners, grid)
    steps.step("growing boxes")
    found = growth.grow(free, grid, most, least)
    steps.step("proving them")
    boxes = np.stack([grid.planes[k][found[:, :, k]] for k in range(3)], axis=-1) / scale
    boxes[:, 0] += room
    boxes[:, 1] -= room
    if mesh.vertices.dtype == np.float32:
        boxes = _inwards(boxes)
    thick = (boxes[:, 0] < boxes[:, 1]).all(axis=1)
    found, boxes = found[thick], boxes[thick]
    outside = check_proxy(_box_mesh(boxes), mesh).triangles // (2 * len(SIDES))
    kept = np.setdiff1d(np.arange(len(boxes)), outside)
    steps.step()
    return InnerBoxes(
        boxes=Boxes(boxes[kept, 0], boxes[kept, 1]),
        mesh=_box_mesh(boxes[kept]),
        volume_share=growth.filled(free, grid, found[kept]),
        rejected=len(boxes) - len(kept),
    )


def closed_mesh(vertices: Any, triangles: Any) -> Mesh:
    """The mesh of either form, in float32 or float64; a `ValueError` if it is open."""
    if triangles is None:
        mesh = as_mesh("vertices", vertices, f"{A_MESH}, when triangles is left out")
        if mesh.transforms is not None:
            raise ValueError(f"vertices: expected a mesh without transforms, got {mesh!r}")
    else:
        mesh = Mesh(vertices, triangles)
    nothing = Mesh(np.empty((0, 3)), np.empty((0, 3), np.uint32))
    try:
        check_proxy(nothing, mesh, progress=False)
    except ValueError as error:
        text = str(error).removeprefix("mesh: ")
        raise ValueError(f"triangles: {text}; {WAY_OUT}") from None
    return mesh


def _inwards(boxes: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The largest boxes within whose corners are float32 numbers, as the mesh's are."""
    single = boxes.astype(np.float32)
    low = np.where(single[:, 0] < boxes[:, 0], np.nextafter(single[:, 0], np.inf), single[:, 0])
    high = np.where(single[:, 1] > boxes[:, 1], np.nextafter(single[:, 1], -np.inf), single[:, 1])
    return np.stack([low, high], axis=1).astype(np.float64)


def _box_mesh(boxes: npt.NDArray[np.float64]) -> Mesh:
    """Eight vertices and twelve triangles for each box, front faces outwards."""
    bit = (np.arange(8)[:, None] >> np.arange(3)) & 1
    vertices = np.where(bit, boxes[:, None, 1], boxes[:, None, 0]).reshape(-1, 3)
    side = np.array(SIDES)
    one = np.concatenate([side[:, [0, 1, 2]], side[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    faces = one + 8 * np.arange(len(boxes))[:, None, None]
    return Mesh(vertices, faces.reshape(-1, 3).astype(np.uint32))
