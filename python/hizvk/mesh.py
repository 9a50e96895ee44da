"""Triangle meshes that hide things: `Mesh`, and meshes of other libraries taken as one."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeAlias

import numpy as np

from . import _arguments, foreign

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._arguments import FloatArray

__all__ = ["A_MESH", "Mesh", "MeshLike", "as_mesh", "as_meshes", "meshes_of", "placed"]


def placed(name: str, transforms: npt.ArrayLike | None) -> FloatArray | None:
    """``(K, 4, 4)``: affine matrices, of which a single one may come as ``(4, 4)``; or None."""
    if transforms is None:
        return None
    single = np.ndim(transforms) == 2
    checked = _arguments.finite_floats(name, transforms, (4, 4) if single else ("K", 4, 4))
    _arguments.check_affine(name, checked)
    return checked.reshape(-1, 4, 4)


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """A triangle mesh that hides things, placed once or many times.

    Parameters
    ----------
    vertices : (V, 3) float array
        Positions, finite.
    triangles : (T, 3) integer array
        Indices of vertices, counter-clockwise as seen from the front.
    transforms : (K, 4, 4) or (4, 4) float array, optional
        ``world_from_mesh`` of each copy; the last row is 0, 0, 0, 1.
        None: one copy, whose vertices are world positions.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    """

    vertices: FloatArray
    triangles: npt.NDArray[np.uint32]
    transforms: FloatArray | None

    @_arguments.explained()
    def __init__(
        self,
        vertices: npt.ArrayLike,
        triangles: npt.ArrayLike,
        transforms: npt.ArrayLike | None = None,
    ) -> None:
        checked = _arguments.finite_floats("vertices", vertices, ("V", 3))
        object.__setattr__(self, "vertices", checked)
        object.__setattr__(
            self, "triangles", _arguments.triangles("triangles", triangles, len(checked))
        )
        object.__setattr__(self, "transforms", placed("transforms", transforms))

    @classmethod
    def of(cls, mesh: MeshLike, transforms: npt.ArrayLike | None = None) -> Mesh:
        """A mesh of another library as a `Mesh`, with its numbers as they are.

        Every parameter that takes a mesh takes these objects directly.
        Use this where the numbers are wanted, or for a whole scene in one mesh.

        Parameters
        ----------
        mesh : object
            - trimesh: a ``Trimesh``, or a ``Scene``, whose meshes are placed by its graph.
              What has no faces is left out.
            - Open3D: a legacy ``TriangleMesh``, or one of ``o3d.t.geometry`` on the CPU.
            - PyVista: a ``PolyData`` of triangles.
              Others are refused with ``.triangulate()`` as the way out.
        transforms : (K, 4, 4) or (4, 4) float array, optional
            As of a `Mesh`.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.

        Examples
        --------
        >>> import hizvk
        >>> from types import SimpleNamespace
        >>> loaded = SimpleNamespace(vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces=[[0, 1, 2]])
        >>> hizvk.Mesh.of(loaded)
        Mesh(3 vertices, 1 triangles, 1 copies)
        """
        expected = f"{A_MESH}, or a scene of trimesh"
        if foreign.scene_parts(mesh) is None:
            one = as_mesh("mesh", mesh, expected)
            return one if transforms is None else cls(one.vertices, one.triangles, transforms)
        vertices, triangles, count = [np.empty((0, 3))], [np.empty((0, 3), np.uint32)], 0
        for one in meshes_of("mesh", mesh, expected):
            points = one.vertices.astype(np.float64)
            assert one.transforms is not None
            for matrix in one.transforms.astype(np.float64):
                vertices.append(points @ matrix[:3, :3].T + matrix[:3, 3])
                triangles.append(one.triangles + np.uint32(count))
                count += len(points)
        return cls(np.concatenate(vertices), np.concatenate(triangles), transforms)

    def __repr__(self) -> str:
        copies = 1 if self.transforms is None else len(self.transforms)
        return (
            f"Mesh({len(self.vertices)} vertices, {len(self.triangles)} triangles, {copies} copies)"
        )


class _HasFaces(Protocol):
    """What a mesh of trimesh has."""

    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...


class _HasTriangles(Protocol):
    """What a mesh of Open3D has, and a `Mesh`."""

    @property
    def vertices(self) -> Any: ...
    @property
    def triangles(self) -> Any: ...


class _HasTensors(Protocol):
    """What a mesh of Open3D's tensors has."""

    @property
    def vertex(self) -> Any: ...
    @property
    def triangle(self) -> Any: ...


class _HasPoints(Protocol):
    """What a surface of PyVista has."""

    @property
    def points(self) -> Any: ...
    @property
    def faces(self) -> Any: ...


class _HasGeometry(Protocol):
    """What a scene of trimesh has."""

    @property
    def geometry(self) -> Any: ...
    @property
    def graph(self) -> Any: ...


#: A `Mesh`, or a mesh of another library, known by its attributes: no library has to be there.
MeshLike: TypeAlias = _HasFaces | _HasTriangles | _HasTensors | _HasPoints | _HasGeometry
#: What `as_mesh` takes, for messages.
A_MESH: Final = "a Mesh, a mesh of trimesh, Open3D or PyVista"


def as_mesh(name: str, value: object, expected: str) -> Mesh:
    """A Mesh, a tuple of its arguments, or an object of another library that has its parts."""
    if isinstance(value, Mesh):
        return value
    is_tuple = isinstance(value, tuple) and 2 <= len(value) <= 3
    parts = value if is_tuple else foreign.mesh_parts(name, value)
    if parts is None:
        hint = foreign.way_to_a_mesh(value)
        if isinstance(value, (str, os.PathLike)):
            hint = "; read the file first, for instance with trimesh.load"
        elif isinstance(value, (list, np.ndarray)):
            hint = "; of arrays pass hizvk.Mesh(vertices, triangles)"
        raise TypeError(f"{name}: expected {expected}, got {_arguments.describe(value)}{hint}")
    return _made(name, *parts)  # type: ignore[misc]


def _made(name: str, *parts: Any) -> Mesh:
    try:
        return Mesh(*parts)
    except (TypeError, ValueError) as error:
        raise type(error)(f"{name}: {error}") from None


def meshes_of(name: str, value: object, expected: str) -> list[Mesh]:
    """The meshes of a list, in which plain tuples are welcome, too; or the one mesh that came.

    A scene of trimesh stands for its meshes.
    """
    scene = foreign.scene_parts(value)
    if scene is not None:
        return [_made(name, *parts) for parts in scene]
    if isinstance(value, Sequence) and not isinstance(value, (str, bytes)):
        found = []
        for number, item in enumerate(value):
            one = f"{name}[{number}]"
            scene = foreign.scene_parts(item)
            if scene is None:
                found.append(as_mesh(one, item, expected))
            else:
                found += [_made(one, *parts) for parts in scene]
        return found
    return [as_mesh(name, value, expected)]


def as_meshes(vertices: Any, triangles: Any, transforms: Any) -> list[Mesh]:
    """The meshes of either form of `Device.occluders`."""
    if triangles is not None:
        return [Mesh(vertices, triangles, transforms)]
    if transforms is not None:
        parts = None if isinstance(vertices, Mesh) else foreign.mesh_parts("vertices", vertices)
        if parts is None:
            raise TypeError(
                "transforms: expected nothing beside a list of meshes, a Mesh or a scene, "
                "which have their own"
            )
        return [Mesh(parts.vertices, parts.triangles, transforms)]
    expected = f"{A_MESH}, or a list of them when triangles is left out"
    return meshes_of("vertices", vertices, expected)
