"""Arrays and meshes of other libraries, known by what they have: none has to be installed.

- Arrays: whatever NumPy takes, and whatever has ``__dlpack__`` (PyTorch, Open3D, CuPy, JAX).
  They must lie in the memory of the host.
- Meshes: trimesh, Open3D (legacy and tensors), PyVista; and scenes of trimesh.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["Parts", "as_numpy", "described", "mesh_parts", "scene_parts", "way_to_a_mesh"]

#: What is an array already, or becomes one in a way that says what its numbers are.
_PLAIN: Final = (np.ndarray, np.generic, list, tuple, str, bytes, int, float, complex, type(None))
#: DLPack's codes of memory that the host can read: its own, and such that CUDA has pinned.
_ON_HOST: Final = (1, 3)
#: How a library's array is copied to the host.
_TO_HOST: Final = {"torch": ".cpu()", "cupy": ".get()", "open3d": ".cpu()"}


def as_numpy(name: str, expected: str, value: Any) -> Any:
    """An array of another library as NumPy's, without a copy where that is possible.

    Anything else comes back as it is, for the caller to look at.

    Raises
    ------
    TypeError
        If it lies on a device, has a gradient, or holds numbers that NumPy does not have.
    """
    if isinstance(value, _PLAIN):
        return value
    has_dlpack = hasattr(value, "__dlpack__")
    if has_dlpack and hasattr(value, "__dlpack_device__"):
        kind, _ = value.__dlpack_device__()
        # Open3D has an enumeration here that is no number.
        if getattr(kind, "value", kind) not in _ON_HOST:
            way = _TO_HOST.get(_library(value), "numpy.asarray, or as its library does it")
            raise TypeError(
                f"{name}: expected {expected} in the memory of the host, got {described(value)}; "
                f"copy it first, by {way}"
            )
    try:
        if has_dlpack and not hasattr(value, "__array__"):
            return np.from_dlpack(value)
        if any(hasattr(value, way) for way in ("__array__", "__array_interface__")) or _is_buffer(
            value
        ):
            array = np.asarray(value)
            return array if array.ndim or array.dtype != np.object_ else value
    except (TypeError, ValueError, RuntimeError, BufferError) as error:
        hint = ""
        if getattr(value, "requires_grad", False):
            hint = "; pass it without its gradient, by .detach()"
        elif "bfloat16" in str(getattr(value, "dtype", "")).lower():
            hint = "; NumPy has no bfloat16, pass .float()"
        got = f"{described(value)}, which is no array ({error})"
        raise TypeError(f"{name}: expected {expected}, got {got}{hint}") from None
    return value


def _is_buffer(value: object) -> bool:
    try:
        memoryview(value)  # type: ignore[arg-type]
    except TypeError:
        return False
    return True


def _library(value: object) -> str:
    """The package that the object's class belongs to."""
    return type(value).__module__.partition(".")[0]


def described(value: Any) -> str:
    """What an object of another library is, in a few words."""
    text = f"{_library(value)}.{type(value).__name__}"
    shape = getattr(value, "shape", None)
    if shape is not None:
        sides = tuple(shape)
        text += f" ({', '.join(map(str, sides))}{',' if len(sides) == 1 else ''})"
    dtype, device = getattr(value, "dtype", None), getattr(value, "device", None)
    if dtype is not None:
        text += f" {str(dtype).removeprefix('torch.')}"
    if device is not None and str(device).partition(":")[0].lower() != "cpu":
        text += f" on {device}"
    return text


class Parts(NamedTuple):
    """What a mesh is made of, unchecked."""

    vertices: Any
    triangles: Any
    transforms: Any = None


def mesh_parts(name: str, value: Any) -> Parts | None:
    """The parts of a mesh of another library, or None if it is none.

    Raises
    ------
    TypeError, ValueError
        For a mesh of PyVista with other faces than triangles; they say how it gets triangles.
    """
    vertices = getattr(value, "vertices", None)
    if vertices is not None:
        for word in ("faces", "triangles"):  # trimesh; Open3D, and a Mesh
            triangles = getattr(value, word, None)
            if triangles is not None and not callable(triangles):
                return Parts(vertices, triangles)
    if _is_of_tensors(value):
        return Parts(value.vertex["positions"], value.triangle["indices"])
    if _is_polydata(value):
        return Parts(np.asarray(value.points), _triangles_of(name, value))
    return None


def _is_of_tensors(value: Any) -> bool:
    """Whether it is a mesh of Open3D's ``t.geometry``."""
    vertex, triangle = getattr(value, "vertex", None), getattr(value, "triangle", None)
    try:
        return "positions" in vertex and "indices" in triangle  # type: ignore[operator]
    except TypeError:
        return False


def _is_polydata(value: Any) -> bool:
    """Whether it is a surface of PyVista."""
    names = ("points", "faces", "n_points", "triangulate")
    return all(hasattr(value, one) for one in names) and not hasattr(value, "celltypes")


def _triangles_of(name: str, value: Any) -> npt.NDArray[Any]:
    """``(T, 3)`` from PyVista's faces: for each, the number of its corners and then these."""
    faces = np.asarray(value.faces)
    counts = faces[::4] if len(faces) % 4 == 0 else faces[:1]
    strips = int(getattr(value, "n_strips", 0))
    if strips or (counts != 3).any():
        got = f"{strips} strips" if strips else "faces with other numbers of corners"
        raise ValueError(f"{name}: expected triangles, got {got}; pass mesh.triangulate()")
    return faces.reshape(-1, 4)[:, 1:]


def scene_parts(value: Any) -> list[Parts] | None:
    """The meshes of a scene of trimesh, each with a transform for each of its nodes; or None.

    They are in the order of ``scene.geometry``.
    What has no faces, such as a path or a cloud, hides nothing and is left out.
    """
    if not _is_scene(value):
        return None
    placed: dict[str, list[Any]] = {}
    for node in value.graph.nodes_geometry:
        matrix, geometry = value.graph[node]
        placed.setdefault(geometry, []).append(np.asarray(matrix, np.float64))
    found = []
    for geometry, mesh in value.geometry.items():
        parts = mesh_parts(geometry, mesh)
        if parts is not None and geometry in placed:
            found.append(Parts(parts.vertices, parts.triangles, np.stack(placed[geometry])))
    return found


def _is_scene(value: Any) -> bool:
    """Whether it is a scene of trimesh."""
    return hasattr(value, "geometry") and hasattr(getattr(value, "graph", None), "nodes_geometry")


def way_to_a_mesh(value: Any) -> str:
    """How an object that is no mesh becomes one; empty if that is not known."""
    if _is_scene(value):
        return "; of a trimesh scene pass scene.to_mesh()"
    if hasattr(value, "extract_surface"):
        return "; pass grid.extract_surface().triangulate()"
    if hasattr(value, "points") and hasattr(value, "has_points"):
        return "; a cloud has no triangles: pass hizvk.depth_from_points(hizvk.Points(...), camera)"
    return ""
