"""What lives on a device: instances, occluders, depth images and pyramids. `Device` makes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeAlias

import numpy as np

from . import _arguments
from .bounds import Bounds, are_points, as_arrays

if TYPE_CHECKING:
    import numpy.typing as npt

    from . import _core
    from ._arguments import FloatArray, Size
    from .camera import Camera
    from .depth import DepthKind
    from .device import Device

__all__ = ["DepthImage", "Instances", "Mesh", "Occluders", "Pyramid"]


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """A triangle mesh that hides things, placed once or many times.

    Parameters
    ----------
    vertices : (V, 3) float array
        Positions, finite.
    triangles : (T, 3) integer array
        Indices of vertices; seen from the front they run counter-clockwise.
    transforms : (K, 4, 4) or (4, 4) float array, optional
        ``world_from_mesh`` of each copy, last row 0, 0, 0, 1.
        None: one copy, where the vertices are.

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
        placed: FloatArray | None = None
        if transforms is not None:
            single = np.ndim(transforms) == 2
            placed = _arguments.finite_floats(
                "transforms", transforms, (4, 4) if single else ("K", 4, 4)
            )
            _arguments.check_affine("transforms", placed)
            placed = placed.reshape(-1, 4, 4)
        object.__setattr__(self, "transforms", placed)

    def __repr__(self) -> str:
        copies = 1 if self.transforms is None else len(self.transforms)
        return (
            f"Mesh({len(self.vertices)} vertices, {len(self.triangles)} triangles, {copies} copies)"
        )


class _HasFaces(Protocol):
    """A mesh of trimesh."""

    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...


class _HasTriangles(Protocol):
    """A mesh of Open3D; `Mesh` is one, too."""

    @property
    def vertices(self) -> Any: ...
    @property
    def triangles(self) -> Any: ...


#: A `Mesh`, or a mesh of another library: told by what it has, so that none needs to be there.
MeshLike: TypeAlias = _HasFaces | _HasTriangles


class Instances:
    """Bounds on the device, ready to be tested; made by `Device.instances`."""

    def __init__(self, device: Device, core: _core.Instances, points: bool = False) -> None:
        self._device = device
        self._inner = core
        self._points = points

    @property
    def device(self) -> Device:
        """Where they live."""
        return self._device

    @property
    def kind(self) -> str:
        """``"spheres"``, ``"boxes"`` or ``"oriented_boxes"``."""
        return self._inner.kind()

    @property
    def num_pieces(self) -> int:
        """In how many buffers the list lies; a cull writes one draw record for each."""
        return self._inner.num_pieces()

    @property
    def invalid(self) -> npt.NDArray[np.uint64]:
        """``(B,)`` uint64, ascending: the instances whose bounds are no volume, as far as the upload could see it."""
        return self._inner.invalid()

    @property
    def device_bytes(self) -> int:
        """Memory that they take on the device."""
        return self._inner.device_bytes()

    @property
    def host_bytes(self) -> int:
        """Memory that they take on the host.

        8 bytes an instance for where it is stored (none with ``order="given"``), 88 for each group
        of 64, and 48 an instance in groups of which a part was updated.
        """
        return self._inner.host_bytes()

    def update(self, first: int, bounds: Bounds, *, strict: bool = False) -> None:
        """Replaces instances ``first``, ``first + 1``, ... by new bounds of the same kind, as many as there are.

        A cull that was submitted earlier sees the old bounds, also where its result is read later;
        one that is submitted later sees the new ones.
        (`CullResult.explain` runs again, so it explains the bounds of now.)
        From several threads, updates take effect one after the other.

        Instances keep the place in storage that the upload gave them; the boxes of their groups
        follow exactly.
        So an update costs about as much as the upload of as many instances without the sort, and
        results are always right.
        But groups whose members part are large, and large boxes are hidden less often: once most
        instances have moved farther than neighbours lie apart, a new `Device.instances` (a re-sort)
        makes culls as fast as at first.
        It pays when it costs less than what the culls until the next one save by it.
        After an update that failed (for lack of memory), groups that are touched are no longer
        tested as a whole: results stay right, and new instances are fast again.

        Parameters
        ----------
        first : int
            The first instance that is replaced, ``0 <= first <= len(self)``.
        bounds : Spheres, Boxes or OrientedBoxes
            What replaces them: n volumes of the kind that they have, ``first + n <= len(self)``;
            none is allowed.
        strict : bool
            True refuses bounds that are no volume, and then nothing has changed.
            False keeps them visible, as `Device.instances` does; `invalid` follows.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        OutOfMemoryError
            If the device or the host has no room for a copy of the new bounds.

        Examples
        --------
        >>> import numpy as np, hizvk
        >>> device = hizvk.Device()
        >>> crowd = device.instances(hizvk.Spheres(np.zeros((1000, 3)), 0.5))
        >>> crowd.update(990, hizvk.Spheres(np.ones((10, 3)), 0.5))
        """
        first = _arguments.integer("first", first, low=0, high=len(self))
        kind, arrays = as_arrays("bounds", bounds)
        if kind != self.kind:
            raise TypeError(
                f"bounds: expected {self.kind} as the instances are, got {_arguments.describe(bounds)}"
            )
        if len(bounds) > len(self) - first:
            expected = f"at most {len(self) - first} from instance {first} of {len(self)} on"
            raise ValueError(f"bounds: expected {expected}, got {len(bounds)}")
        strict = _arguments.flag("strict", strict)
        self._device._engine.update(self._inner, first, kind, arrays, strict)
        self._points = self._points and (len(bounds) == 0 or are_points(bounds))

    def __len__(self) -> int:
        return self._inner.num_instances()

    def __repr__(self) -> str:
        return f"<Instances: {len(self)} {self.kind}>"


class Occluders:
    """Triangle meshes on the device, ready to be rendered into depth; made by `Device.occluders`."""

    def __init__(self, device: Device, core: _core.Occluders) -> None:
        self._device = device
        self._inner = core

    @property
    def device(self) -> Device:
        """Where they live."""
        return self._device

    @property
    def num_meshes(self) -> int:
        """Meshes, counted once for each place that they stand in."""
        return self._inner.num_parts()

    @property
    def num_triangles(self) -> int:
        """Triangles in all places."""
        return self._inner.num_triangles()

    @property
    def device_bytes(self) -> int:
        """Memory that they take on the device."""
        return self._inner.device_bytes()

    @property
    def host_bytes(self) -> int:
        """Memory that they take on the host.

        The float64 mesh, 24 bytes a vertex and 12 a triangle, and what the first conservative depth
        image adds to it for good (about 42 bytes a triangle and 24 a vertex).
        """
        return self._inner.host_bytes()

    def __repr__(self) -> str:
        return f"<Occluders: {self.num_meshes} meshes, {self.num_triangles} triangles>"


class DepthImage:
    """A depth image on the device; made by `Device.render_depth`."""

    def __init__(self, device: Device, core: _core.DepthImage, camera: Camera) -> None:
        self._device = device
        self._inner = core
        self._camera = camera

    @property
    def device(self) -> Device:
        """Where it lives."""
        return self._device

    @property
    def camera(self) -> Camera:
        """The camera that sees it; its size is the image's."""
        return self._camera

    @property
    def size(self) -> Size:
        """``(height, width)`` in pixels."""
        return self._camera.size

    @property
    def kind(self) -> DepthKind:
        """``"reversed_ndc"`` or ``"ndc"``, as the camera has it."""
        return self._camera.depth_kind

    def numpy(self) -> npt.NDArray[np.float32]:
        """``(height, width)`` float32: the NDC depth, row 0 on top; a copy."""
        return self._inner.read().reshape(self.size)

    def __repr__(self) -> str:
        return f"<DepthImage {self.size[0]}x{self.size[1]} of kind {self.kind}>"


class Pyramid:
    """A depth pyramid on the device: on level ``k`` a texel is the farthest depth of ``2^k x 2^k`` pixels.

    Made by `Device.pyramid`.
    """

    def __init__(
        self, device: Device, core: _core.Pyramid, camera: Camera, *, is_rendered: bool = False
    ) -> None:
        self._device = device
        self._inner = core
        self._camera = camera
        self._is_rendered = is_rendered

    @property
    def device(self) -> Device:
        """Where it lives."""
        return self._device

    @property
    def camera(self) -> Camera:
        """The camera that the depth belongs to; only this one can cull with it."""
        return self._camera

    @property
    def size(self) -> Size:
        """``(height, width)`` of level 0."""
        return self._camera.size

    @property
    def num_levels(self) -> int:
        """Levels from the full size down to one texel."""
        return self._inner.num_levels()

    @property
    def levels(self) -> range:
        """The levels that can be read, but for 0, the image itself: those that ``levels=`` asked for."""
        stored = self._inner.stored_levels()
        return range(0) if stored is None else range(stored[0], stored[1] + 1)

    @property
    def device_bytes(self) -> int:
        """Memory that it takes on the device."""
        return self._inner.device_bytes()

    def level(self, k: int) -> npt.NDArray[np.float32]:
        """Level `k` as a ``(height, width)`` float32 array of NDC depth, row 0 on top; a copy.

        Parameters
        ----------
        k : int
            ``0 <= k < num_levels``; 0 is the finest.

        Raises
        ------
        TypeError
            If it is no integer.
        IndexError
            If there is no such level, or it is not stored (see `levels`).
        """
        last = self.num_levels - 1
        try:
            k = _arguments.integer("k", k, low=0, high=last)
        except ValueError:
            raise IndexError(f"k: expected a level in 0..{last}, got {k}") from None
        if k > 0 and k not in self.levels:
            raise IndexError(f"k: expected 0 or a level that is stored, {self._stored()}, got {k}")
        size, texels = self._inner.read_level(k)
        return texels.reshape(size)

    def _stored(self) -> str:
        first, last = self.levels[0], self.levels[-1]
        return f"{first}..{last}" if first < last else str(first)

    def __repr__(self) -> str:
        missing = len(self.levels) < self.num_levels - 1
        stored = f", stored {self._stored()}" if missing else ""
        return f"<Pyramid {self.size[0]}x{self.size[1]}, {self.num_levels} levels{stored}>"


def as_mesh(name: str, value: object, expected: str) -> Mesh:
    """A Mesh, a tuple of its arguments, or an object of another library that has its parts."""
    if isinstance(value, Mesh):
        return value
    parts = value if isinstance(value, tuple) and 2 <= len(value) <= 3 else _parts(value)
    if parts is None:
        # A scene of trimesh's holds meshes by name; it has none of its own.
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
    """Vertices and triangles of a mesh of trimesh (`faces`) or Open3D (`triangles`), told by what it has."""
    vertices = getattr(value, "vertices", None)
    for name in ("faces", "triangles"):
        triangles = getattr(value, name, None)
        if vertices is not None and triangles is not None:
            return vertices, triangles
    return None


#: What `as_mesh` takes, in words.
A_MESH: Final = "a Mesh, a mesh of trimesh or Open3D"


def meshes_of(name: str, value: object, expected: str) -> list[Mesh]:
    """One mesh, or a list of them in which plain tuples are welcome, too."""
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
    if transforms is not None and parts is not None:  # it has none of its own
        return [Mesh(*parts, transforms)]
    if transforms is not None:
        raise TypeError(
            "transforms: expected nothing beside a list of meshes, which have their own"
        )
    return meshes_of(
        "vertices", vertices, f"{A_MESH}, or a list of them when triangles is left out"
    )
