"""What a cull takes for granted, checked exactly: occluder proxies lie inside their mesh, bounds contain theirs.

A proxy that sticks out hides what can be seen, and an instance that sticks out of its bounds is
hidden while it shows.
The checks decide in exact arithmetic (``crates/hiz_ref``), so that touching is inside and a
protrusion of one rounding is found.
They need no device, and are for tools and tests, not for every frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import _core
from ..bounds import Bounds, as_arrays
from ..mesh import A_MESH, as_mesh, meshes_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from ..mesh import Mesh, MeshLike

__all__ = ["BoundsCheck", "ProxyCheck", "check_bounds", "check_proxy"]

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
    """The proxy's vertices that are outside, ascending; may be empty while triangles are outside. Exact."""
    protrusion: float
    """The largest distance of a witness or an outside vertex to the mesh's surface, in plain float64; what really
    sticks out may be more. 0 if nothing does."""


@dataclass(frozen=True, eq=False)
class BoundsCheck:
    """Which bounds do not contain their mesh."""

    contained: npt.NDArray[np.bool_]
    """``(N,)``: whether the instance's bounds contain all of its mesh. Exact."""
    protrusion: npt.NDArray[np.float64]
    """``(N,)``: how far a vertex lies outside, in world units and plain float64; 0 for what is contained, infinite for
    bounds that are no volume."""
    offenders: npt.NDArray[np.intp]
    """The instances that stick out, the worst first."""

    @property
    def all_contained(self) -> bool:
        """Whether no instance sticks out."""
        return bool(self.contained.all())


def check_proxy(
    proxy: MeshLike | tuple[npt.ArrayLike, ...], mesh: MeshLike | tuple[npt.ArrayLike, ...]
) -> ProxyCheck:
    """Whether an occluder proxy may be rendered in its mesh's stead.

    Inside means: every point of every proxy triangle lies in the closed solid of the mesh, which is
    its surface and all points that it winds about (so parts may overlap, and the whole may run
    either way round).
    Then every ray from outside of the solid that meets the proxy has met the mesh before, or meets
    it there, and the proxy hides nothing that the mesh does not hide.
    Touching is allowed.
    The proxy need not be closed; its triangles without area hide nothing and are passed over.

    What is proved is about the numbers as given.
    A renderer that moves or rounds the two differently has to leave room.
    For a camera inside of the mesh's solid, or a near plane that cuts it, nothing is said; nor for
    a mesh of which a renderer leaves out the back faces while it keeps those of the proxy.

    Parameters
    ----------
    proxy, mesh : Mesh, tuple, or a mesh of trimesh or Open3D
        A tuple is ``(vertices, triangles)``.
        In the same coordinates, without transforms.
        The mesh is closed and consistently oriented: each of its edges runs as often one way as the
        other, where equal positions count as one vertex.

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
    >>> hizvk.check_proxy(box_mesh([[0.1, 0.1, 0.1]], [[0.9, 0.9, 1.0]]), box_mesh([[0, 0, 0]], [[1, 1, 1]])).inside
    True
    """
    found = _core.check_proxy(_unplaced("proxy", proxy), _unplaced("mesh", mesh))
    triangles, witnesses, vertices, protrusion = found
    return ProxyCheck(
        inside=not triangles,
        triangles=np.array(triangles, dtype=np.intp),
        witnesses=np.array(witnesses, dtype=np.float64).reshape(-1, 3),
        vertices=np.array(vertices, dtype=np.intp),
        protrusion=protrusion,
    )


def check_bounds(
    bounds: Bounds, meshes: MeshLike | Sequence[MeshLike | tuple[npt.ArrayLike, ...]]
) -> BoundsCheck:
    """Whether bounds contain what they bound.

    Bounds are convex, so a mesh lies in them if its vertices do.
    Each vertex is ``world_from_mesh @ (x, y, z, 1)`` in exact arithmetic, not as some renderer
    rounds it; the bounds are the numbers as given.

    Parameters
    ----------
    bounds : Spheres, Boxes or OrientedBoxes
        The N volumes.
    meshes : list of Mesh, of tuples, or of meshes of trimesh or Open3D; or one Mesh
        One for each instance in order; a mesh with K transforms stands for K instances in a row.
        A tuple is ``(vertices, triangles)`` or ``(vertices, triangles, transforms)``.

    Returns
    -------
    BoundsCheck
        Bounds that are no volume (NaN, a negative size, min > max) contain nothing.

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
    stacked = np.stack(matrices) if matrices else np.empty((0, 4, 4))
    outside = _core.check_bounds(kind, arrays, pairs, np.ascontiguousarray(stacked), instances)
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
