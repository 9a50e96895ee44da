"""Prisms inside of buildings: from the footprint to the lowest height of the roof.

Turned buildings have no large axis-aligned boxes inside, and their footprint is known exactly: it
is the floor, the faces that look straight down.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from .. import _arguments
from ..check import check_proxy
from ..mesh import Mesh
from ..progress import Progress
from .inner import closed_mesh
from .units import unit_scale

if TYPE_CHECKING:
    import numpy.typing as npt

    from ..mesh import MeshLike
    from ..progress import ProgressLike

__all__ = ["InnerPrisms", "inner_prisms"]

#: What `up` may be.
UP: Final = "a vector along one axis, such as (0, 0, 1)"


@dataclass(frozen=True, eq=False, repr=False)
class InnerPrisms:
    """Prisms inside of a mesh; made by `inner_prisms`."""

    mesh: Mesh
    """The triangles of all prisms, for `Device.occluders`; each was proven by `check_proxy`.

    The prism of the largest volume is the first."""
    offsets: npt.NDArray[np.intp]
    """``(P + 1,)``: prism p has the triangles ``offsets[p]`` to before ``offsets[p + 1]``."""
    floor: npt.NDArray[np.float64]
    """``(P,)``: the coordinate along `up` at which each prism begins."""
    top: npt.NDArray[np.float64]
    """``(P,)``: the coordinate along `up` at which it ends."""
    rejected: int
    """How many floors bear no prism: no height of a vertex above them could be proven."""

    def __len__(self) -> int:
        """The number of prisms."""
        return len(self.floor)

    def __repr__(self) -> str:
        return f"InnerPrisms({len(self)} prisms, {len(self.mesh.triangles)} triangles)"


def inner_prisms(
    vertices: npt.ArrayLike | MeshLike,
    triangles: npt.ArrayLike | None = None,
    *,
    up: npt.ArrayLike,
    max_prisms: int = 1024,
    progress: ProgressLike = None,
) -> InnerPrisms:
    """Finds upright prisms inside of closed buildings, to be rendered in their stead.

    A floor is a set of faces that look straight down and are connected by edges.
    On each floor stands one prism, up to the highest vertex of the mesh for which `check_proxy`
    proves it inside.
    For a building with vertical walls that is the lowest height of the roof, its eaves.
    Walls of any direction are met exactly, where `inner_boxes` needs axis-aligned ones.

    A tower with a step stands on one floor, so its prism ends at the step.
    Take `inner_boxes` for it, or give its parts as closed meshes.

    Parameters
    ----------
    vertices : (V, 3) float array; or a Mesh, a mesh of trimesh, Open3D or PyVista
        World positions, or those of the mesh's own space.
    triangles : (T, 3) integer array, optional
        Indices of vertices; left out for meshes.
    up : (3,) vector
        The direction of the walls, along an axis: (0, 0, 1) or (0, 1, 0), for example.
    max_prisms : int
        At most so many, the largest by volume.
    progress : bool or function, optional
        As everywhere (`hizvk.progress`); a step is a round of checks.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
        An open mesh is refused: it has no inside.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> from hizvk.scenes import gabled_houses
    >>> house = gabled_houses([[0.0, 0.0]], [[8.0, 6.0, 5.0, 8.0]], [30.0])  # eaves 5, ridge 8
    >>> found = hizvk.inner_prisms(*house, up=(0, 0, 1))
    >>> found, found.floor.tolist(), found.top.tolist()
    (InnerPrisms(1 prisms, 12 triangles), [0.0], [5.0])
    """
    mesh = closed_mesh(vertices, triangles)
    axis, sign = _axis(up)
    most = _arguments.integer("max_prisms", max_prisms, low=1, high=2**31)
    points = mesh.vertices.astype(np.float64)
    scale = unit_scale([points])
    points *= scale
    floors = [
        _Floor(triangles, axis, sign) for triangles in _floors(points[mesh.triangles], axis, sign)
    ]
    heights = [floor.heights(points) for floor in floors]
    # The highest proven and the lowest open place among each floor's heights; -1: none.
    proven, open_ = [-1] * len(floors), [len(found) for found in heights]
    # Each round halves what is between them.
    rounds = max(open_, default=0).bit_length()
    with Progress(progress, "finding inner prisms", rounds) as steps:
        while asked := [k for k in range(len(floors)) if proven[k] + 1 < open_[k]]:
            tried = {k: (proven[k] + open_[k]) // 2 for k in asked}
            prisms, owner = _joined([floors[k].prism(heights[k][tried[k]]) / scale for k in asked])
            outside = {asked[k] for k in np.unique(owner[check_proxy(prisms, mesh).triangles])}
            for k in asked:
                if k in outside:
                    open_[k] = tried[k]
                else:
                    proven[k] = tried[k]
            steps.step()
    found = [
        (floors[k].area * abs(heights[k][place] - floors[k].height), k)
        for k, place in enumerate(proven)
        if place >= 0
    ]
    found = sorted(found, key=lambda pair: -pair[0])
    chosen = [k for _, k in found[:most]]
    joined, owner = _joined([floors[k].prism(heights[k][proven[k]]) / scale for k in chosen])
    return InnerPrisms(
        mesh=joined,
        offsets=np.searchsorted(owner, np.arange(len(chosen) + 1)),
        floor=np.array([floors[k].height for k in chosen]) / scale,
        top=np.array([heights[k][proven[k]] for k in chosen]) / scale,
        rejected=len(floors) - len(found),
    )


def _axis(up: npt.ArrayLike) -> tuple[int, float]:
    """The axis of `up`, and whether it points along it or against it."""
    direction = _arguments.vector("up", up)
    axes = [k for k in range(3) if direction[k] != 0.0]
    if len(axes) != 1:
        raise ValueError(
            f"up: expected {UP}, got {_arguments.describe(direction)}; turn the mesh for others"
        )
    return axes[0], float(np.sign(direction[axes[0]]))


def _floors(
    corners: npt.NDArray[np.float64], axis: int, sign: float
) -> list[npt.NDArray[np.float64]]:
    """The corners ``(F, 3, 3)`` of each connected set of triangles that look straight down."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # A mesh that is wound inside out has its floors on top of its normals.
    turn = np.sign((normal * (corners[:, 0] - corners[:1, 0])).sum()) or 1.0
    level = (corners[:, :, axis] == corners[:, :1, axis]).all(axis=1)
    floor = corners[level & (turn * sign * normal[:, axis] < 0.0)]
    if turn < 0.0:
        floor = floor[:, ::-1]
    if not len(floor):
        return []
    _, edge = np.unique(
        np.sort(_numbered(floor)[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2),
        axis=0,
        return_inverse=True,
    )
    edge = edge.reshape(-1, 3)
    # Each triangle takes the least number among its edges, until none changes any more.
    label = np.arange(edge.max() + 1)
    while True:
        least = label[edge].min(axis=1)
        before = label.copy()
        np.minimum.at(label, edge, least[:, None])
        if (label == before).all():
            return [floor[least == number] for number in np.unique(least)]


def _numbered(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.intp]:
    """``(F, 3)``: a number for each position."""
    _, number = np.unique(corners.reshape(-1, 3) + 0.0, axis=0, return_inverse=True)
    return number.reshape(-1, 3)


class _Floor:
    """One floor, and the prisms that stand on it."""

    def __init__(self, corners: npt.NDArray[np.float64], axis: int, sign: float) -> None:
        self._corners, self._axis, self._sign = corners, axis, sign
        self.height = float(corners[0, 0, axis])
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self.area = 0.5 * float(np.abs(normal[:, axis]).sum())
        number = _numbered(corners)
        runs = np.stack([number, np.roll(number, -1, axis=1)], axis=2).reshape(-1, 2)
        starts, ends = corners.reshape(-1, 3), np.roll(corners, -1, axis=1).reshape(-1, 3)
        across = {(b, a) for a, b in runs.tolist()}
        border = np.array([(a, b) not in across for a, b in runs.tolist()])
        self._starts, self._ends = starts[border], ends[border]

    def heights(self, points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """The coordinates along the axis of the vertices above the floor's box, upwards."""
        plan = [k for k in range(3) if k != self._axis]
        low, high = self._corners.min(axis=(0, 1))[plan], self._corners.max(axis=(0, 1))[plan]
        over = ((points[:, plan] >= low) & (points[:, plan] <= high)).all(axis=1)
        over &= self._sign * points[:, self._axis] > self._sign * self.height
        found = np.unique(points[over, self._axis])
        return found if self._sign > 0.0 else found[::-1]

    def prism(self, top: float) -> npt.NDArray[np.float64]:
        """The corners ``(K, 3, 3)`` of the prism from the floor to `top`, front faces outwards."""

        def raised(points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
            moved = points.copy()
            moved[..., self._axis] = top
            return moved

        a, b = self._starts, self._ends
        return np.concatenate(
            [
                self._corners,
                raised(self._corners)[:, ::-1],
                np.stack([b, a, raised(a)], axis=1),
                np.stack([b, raised(a), raised(b)], axis=1),
            ]
        )


def _joined(prisms: list[npt.NDArray[np.float64]]) -> tuple[Mesh, npt.NDArray[np.intp]]:
    """The prisms as one mesh with each position once, and the prism of each triangle."""
    corners = np.concatenate([*prisms, np.empty((0, 3, 3))])
    vertices, number = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    owner = np.repeat(np.arange(len(prisms)), [len(prism) for prism in prisms])
    return Mesh(vertices, number.reshape(-1, 3)), owner
