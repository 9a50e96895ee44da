"""Triangle meshes that hide things: `Mesh`, and meshes of trimesh and Open3D taken as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeAlias

import numpy as np

from . import _arguments

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


#: A `Mesh`, or a mesh of another library, known by its attributes: no library has to be there.
MeshLike: TypeAlias = _HasFaces | _HasTriangles


def as_mesh(name: str, value: object, expected: str) -> Mesh:
    """A Mesh, a tuple of its arguments, or an object of another library that has its parts."""
    if isinstance(value, Mesh):
        return value
    parts = value if isinstance(value, tuple) and 2 <= len(value) <= 3 else _parts(value)
    if parts is None:
        # A scene of trimesh holds meshes by name, and is not one itself.
        is_scene = hasattr(value, "geometry") and hasattr(value, "dump")
        hint = (
            "; of a trimesh scene pass scene.to_mesh(), or scene.dump(concatenate=True)"
            if is_scene
            else ""
        )
        raise TypeError(f"{name}: expected {expected}, got {_arguments.describe(value)}{hint}")
    try:
        return Mesh(*parts)
    except (TypeError, ValueError) as error:
        raise type(error)(f"{name}: {error}") from None


def _parts(value: Any) -> tuple[Any, Any] | None:
    """Vertices and triangles of a mesh of trimesh (`faces`) or Open3D (`triangles`), or None."""
    vertices = getattr(value, "vertices", None)
    for name in ("faces", "triangles"):
        triangles = getattr(value, name, None)
        if vertices is not None and triangles is not None:
            return vertices, triangles
    return None


#: What `as_mesh` takes, for messages.
A_MESH: Final = "a Mesh, a mesh of trimesh or Open3D"


def meshes_of(name: str, value: object, expected: str) -> list[Mesh]:
    """The meshes of a list, in which plain tuples are welcome, too; or the one mesh that came."""
    if isinstance(value, Mesh) or _parts(value) is not None:
        return [as_mesh(name, value, expected)]
    if not isinstance(value, Sequence) or isinstance(value, (str, bytes)):
        return [as_mesh(name, value, expected)]
    return [as_mesh(f"{name}[{number}]", item, expected) for number, item in enumerate(value)]


def as_meshes(vertices: Any, triangles: Any, transforms: Any) -> list[Mesh]:
    """The meshes of either form of `Device.occluders`."""
    if triangles is not None:
        return [Mesh(vertices, triangles, transforms)]
    parts = None if isinstance(vertices, Mesh) else _parts(vertices)
    if transforms is not None and parts is not None:  # a mesh of another library has none
        return [Mesh(*parts, transforms)]
    if transforms is not None:
        raise TypeError(
            "transforms: expected nothing beside a list of meshes, which have their own"
        )
    expected = f"{A_MESH}, or a list of them when triangles is left out"
    return meshes_of("vertices", vertices, expected)
