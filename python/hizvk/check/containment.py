"""Checks of what a cull takes for granted: proxies lie inside their mesh, meshes in their bounds.

A proxy that sticks out of its mesh hides what can be seen.
An instance that sticks out of its bounds may be hidden while it shows.

The checks decide in exact arithmetic (``crates/hiz_ref``): touching is inside, and a protrusion of
one rounding is found.
They need no device, and are meant for tools and tests, not for every frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from .._core import check_bounds as outside_of_bounds
from .._core import check_proxy as outside_of_mesh
from ..bounds import Bounds, as_arrays
from ..mesh import A_MESH, as_mesh, meshes_of
from ..progress import Progress

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from ..mesh import Mesh, MeshLike
    from ..progress import ProgressLike

__all__ = ["BoundsCheck", "ProxyCheck", "check_bounds", "check_proxy"]

#: The least triangles of a proxy, and the least instances, that are checked in one step.
PROXY_PART: Final = 256
BOUNDS_PART: Final = 256

_Pair: TypeAlias = tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]


@dataclass(frozen=True, eq=False)
class ProxyCheck:
    """What of an occluder proxy sticks out of its mesh."""

    inside: bool
    """Whether every point of the proxy's triangles lies in the closed solid of the mesh. Exact."""
    triangles: npt.NDArray[np.intp]
    """``(K,)``: the proxy's triangles that are outside somewhere, ascending. Exact."""
    witnesses: npt.NDArray[np.float64]
    """``(K, 3)``: for each of them a point of it that is outside, rounded to float64."""
    vertices: npt.NDArray[np.intp]
    """The proxy's vertices that are outside, ascending. Exact.

    It may be empty while triangles are outside."""
    protrusion: float
    """The largest distance of a witness or an outside vertex to the mesh's surface, or 0.

    It is computed in plain float64, and other points of the proxy may stick out farther."""


@dataclass(frozen=True, eq=False)
class BoundsCheck:
    """Which bounds do not contain their mesh."""

    contained: npt.NDArray[np.bool_]
    """``(N,)``: whether the instance's bounds contain all of its mesh. Exact."""
    protrusion: npt.NDArray[np.float64]
    """``(N,)``: how far a vertex lies outside, in world units, computed in plain float64.

    0 for contained meshes, infinite for invalid bounds."""
    offenders: npt.NDArray[np.intp]
    """The instances that stick out, the worst first."""

    @property
    def all_contained(self) -> bool:
        """Whether no instance sticks out."""
        return bool(self.contained.all())


def check_proxy(
    proxy: MeshLike | tuple[npt.ArrayLike, ...],
    mesh: MeshLike | tuple[npt.ArrayLike, ...],
    *,
    progress: ProgressLike = None,
) -> ProxyCheck:
    """Whether an occluder proxy may be rendered in place of its mesh.

    Inside means that every point of every proxy triangle lies in the closed solid of the mesh.
    The solid is the surface of the mesh and all points with a winding number other than 0.
    So parts of the mesh may overlap, and all of it may be wound either way.

    A ray from outside of the solid that meets the proxy then meets the mesh there or before.
    So the proxy hides nothing that the mesh does not hide.
    Touching is allowed.
    The proxy need not be closed; its triangles without area hide nothing and are passed over.

    The proof is about the numbers as given:

    - A renderer that moves or rounds proxy and mesh differently has to leave room between them.
    - It says nothing for a camera inside the solid, or a near plane that cuts it.
    - It says nothing for a mesh whose back faces are left out while those of the proxy are drawn.

    Parameters
    ----------
    proxy, mesh : Mesh, tuple, or a mesh of trimesh, Open3D or PyVista
        A tuple is ``(vertices, triangles)``.
        Both are in the same coordinates, without transforms.
        The mesh is closed and consistently oriented: each of its edges runs as often one way as the
        other, where equal positions count as one vertex.
    progress : bool or function, optional
        As everywhere (`hizvk.progress`); a step is a part of the proxy.

    Returns
    -------
    ProxyCheck

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came; also for an open mesh, which has no
        inside.

    Examples
    --------
    >>> import hizvk
    >>> from hizvk.scenes import box_mesh
    >>> mesh = box_mesh([[0, 0, 0]], [[1, 1, 1]])
    >>> proxy = box_mesh([[0.1, 0.1, 0.1]], [[0.9, 0.9, 1.0]])
    >>> hizvk.check_proxy(proxy, mesh).inside
    True
    """
    points, faces = _unplaced("proxy", proxy)
    whole = _unplaced("mesh", mesh)
    triangles: list[int] = []
    witnesses: list[list[float]] = []
    vertices: set[int] = set()
    protrusion = 0.0
    with Progress(progress, "checking a proxy") as steps:
        for part in steps.parts(len(faces), PROXY_PART):
            found = outside_of_mesh((points, faces[part]), whole)
            triangles += [part.start + number for number in found[0]]
            witnesses += found[1]
            vertices.update(found[2])
            protrusion = max(protrusion, found[3])
    return ProxyCheck(
        inside=not triangles,
        triangles=np.array(triangles, dtype=np.intp),
        witnesses=np.array(witnesses, dtype=np.float64).reshape(-1, 3),
        vertices=np.array(sorted(vertices), dtype=np.intp),
        protrusion=protrusion,
    )


def check_bounds(
    bounds: Bounds,
    meshes: MeshLike | Sequence[MeshLike | tuple[npt.ArrayLike, ...]],
    *,
    progress: ProgressLike = None,
) -> BoundsCheck:
    """Whether bounds contain what they bound.

    Bounds are convex, so a mesh lies in them if its vertices do.
    A vertex is ``world_from_mesh @ (x, y, z, 1)`` in exact arithmetic, not as a renderer rounds it.
    The bounds are the numbers as given.

    Parameters
    ----------
    bounds : Spheres, Boxes, OrientedBoxes or Points
        The N volumes.
    meshes : list of Mesh, of tuples, or of meshes of trimesh, Open3D or PyVista; or one Mesh
        One for each instance, in order.
        A mesh with K transforms stands for K instances in a row.
        A tuple is ``(vertices, triangles)`` or ``(vertices, triangles, transforms)``.
    progress : bool or function, optional
        As everywhere (`hizvk.progress`); a step is a part of the instances.

    Returns
    -------
    BoundsCheck
        Invalid bounds (NaN, a negative size, min > max) contain nothing.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came; also for another number of meshes
        than of bounds.
    """
    kind, arrays = as_arrays("bounds", bounds)
    pairs: list[_Pair] = []
    matrices: list[npt.NDArray[np.float64]] = []
    instances: list[tuple[int, int | None]] = []
    for mesh in _all_meshes(meshes):
        if mesh.transforms is None:
            instances.append((len(pairs), None))
        else:
            instances += [(len(pairs), len(matrices) + k) for k in range(len(mesh.transforms))]
            matrices += list(np.asarray(mesh.transforms, np.float64))
        pairs.append(_pair(mesh))
    if len(instances) != len(bounds):
        raise ValueError(
            f"meshes: expected one for each of the {len(bounds)} bounds, got {len(instances)}"
        )
    stacked = np.ascontiguousarray(np.stack(matrices) if matrices else np.empty((0, 4, 4)))
    outside = np.empty(len(instances))
    with Progress(progress, "checking bounds") as steps:
        for part in steps.parts(len(instances), BOUNDS_PART):
            some = tuple(array[part] for array in arrays)
            outside[part] = outside_of_bounds(kind, some, pairs, stacked, instances[part])
    offenders = np.flatnonzero(outside >= 0.0)
    return BoundsCheck(
        contained=outside < 0.0,
        protrusion=np.maximum(outside, 0.0),
        offenders=offenders[np.argsort(-outside[offenders], kind="stable")],
    )


def _pair(mesh: Mesh) -> _Pair:
    return np.require(mesh.vertices, np.float64, ["C", "A"]), mesh.triangles


def _unplaced(name: str, value: Any) -> _Pair:
    expected = f"{A_MESH} or a tuple (vertices, triangles)"
    mesh = as_mesh(name, value, expected)
    if mesh.transforms is not None:
        raise ValueError(f"{name}: expected {expected} without transforms, got {mesh!r}")
    return _pair(mesh)


def _all_meshes(value: Any) -> list[Mesh]:
    expected = f"{A_MESH}, or a list of them or of tuples (vertices, triangles[, transforms])"
    return meshes_of("meshes", value, expected)
