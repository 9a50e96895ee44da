"""What lives on a device: instances, occluders, depth images and pyramids. `Device` makes them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, overload

from . import _arguments, mips
from ._core import DepthImage as CoreDepthImage
from ._core import Instances as CoreInstances
from ._core import Occluders as CoreOccluders
from ._core import Pyramid as CorePyramid
from ._on_device import Allocated, OnDevice, check_owner
from ._types import DepthEnd, words
from .bounds import Bounds, are_points, as_arrays
from .mesh import placed
from .pictured import PicturedDepth, PicturedPyramid
from .remembered import Remembered
from .renewal import rectangle, replacement

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from ._arguments import Size
    from ._on_device import Maker
    from ._types import DepthKind, Depths, MipDepths, MipLookup
    from .camera import Camera
    from .renewal import Source

__all__ = ["DepthImage", "Instances", "Occluders", "Pyramid"]


#: What is expected and the way to it, for messages of `_arguments.instance`.
SOME_INSTANCES: Final = (
    "Instances of Device.instances",
    "; bounds become instances by device.instances(bounds)",
)
SOME_OCCLUDERS: Final = (
    "Occluders of Device.occluders",
    "; meshes become occluders by device.occluders(mesh)",
)
A_PYRAMID: Final = (
    "a Pyramid of Device.pyramid",
    "; depth becomes one by device.pyramid(depth, camera, kind=...)",
)


class Instances(Allocated[CoreInstances]):
    """Bounds on the device, ready to be tested; made by `Device.instances`."""

    def __init__(
        self, device: Maker, inner: CoreInstances, *, points: bool, bounds: Bounds
    ) -> None:
        super().__init__(device, inner)
        self._points = points
        self._remembered: Remembered | None = Remembered(bounds)

    @property
    def kind(self) -> str:
        """``"spheres"``, ``"boxes"``, ``"oriented_boxes"`` or ``"points"``."""
        return self._inner.kind()

    @property
    def _are_sizeless(self) -> bool:
        """Whether sample coverage culls what can be seen of them, as it has no guard by default."""
        return self._points and self.kind != "points"

    @property
    def _known(self) -> tuple[bool, Remembered | None]:
        """Whether they are without size, and their bounds if no update has changed them."""
        return self._are_sizeless, self._remembered

    @property
    def num_pieces(self) -> int:
        """In how many buffers the list lies; a cull writes one draw record for each."""
        return self._inner.num_pieces()

    @property
    def invalid(self) -> npt.NDArray[np.uint64]:
        """``(B,)`` uint64, ascending: the instances whose bounds the upload found to be invalid."""
        return self._inner.invalid()

    @property
    def host_bytes(self) -> int:
        """Bytes that they take on the host.

        - 8 per instance for where it is stored; none with ``order="given"``.
        - 88 per group of 64.
        - 48 per instance in groups of which a part was updated.

        The bounds that were uploaded stay alive besides, if they are at most 65,536: pictures show
        them.
        """
        return self._inner.host_bytes()

    def update(self, first: int, bounds: Bounds, *, strict: bool = False) -> None:
        """Replaces the instances ``first``, ``first + 1``, ... by new bounds of the same kind.

        A cull that was submitted earlier sees the old bounds, even if its result is read later.
        A cull that is submitted later sees the new ones.
        `CullResult.explain` runs the test again, so it explains the current bounds.
        Updates from several threads take effect one after the other.

        Instances keep the place in storage that the upload gave them, and the boxes around their
        groups follow exactly.
        So results are always right, and an update costs about as much as the upload of as many
        instances without the sort.

        As the members of a group drift apart, its box grows and hides less often.
        Upload again with `Device.instances` once most instances have moved farther than their
        spacing: the new sort makes culls as fast as at first.
        It pays when it costs less than what it saves the culls until the next upload.

        After an update that failed for lack of memory, the groups it touched are no longer tested
        as a whole.
        Results stay right, and a new upload is fast again.

        Parameters
        ----------
        first : int
            The first instance that is replaced, ``0 <= first <= len(self)``.
        bounds : Spheres, Boxes, OrientedBoxes or Points
            The n new bounds, of the kind `kind`; ``first + n <= len(self)``, and n may be 0.
        strict : bool
            True refuses invalid bounds, and then nothing has changed.
            False keeps them visible, as `Device.instances` does; `invalid` lists them.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
            Of points that take 16 bytes each, the new positions have to be numbers of float32, too.
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
            got = _arguments.describe(bounds)
            raise TypeError(f"bounds: expected {self.kind} as the instances are, got {got}")
        if len(bounds) > len(self) - first:
            expected = f"at most {len(self) - first} from instance {first} of {len(self)} on"
            raise ValueError(f"bounds: expected {expected}, got {len(bounds)}")
        strict = _arguments.flag("strict", strict)
        self._device._engine.update(self._inner, first, kind, arrays, strict)
        self._remembered = None
        self._points = self._points and (len(bounds) == 0 or are_points(bounds))

    def __len__(self) -> int:
        return self._inner.num_instances()

    def _summary(self) -> str:
        return f": {len(self)} {self.kind}"


class Occluders(Allocated[CoreOccluders]):
    """Triangle meshes on the device, ready to be rendered; made by `Device.occluders`."""

    @property
    def num_meshes(self) -> int:
        """Meshes, counted once for each place that they stand in."""
        return self._inner.num_parts()

    @property
    def num_triangles(self) -> int:
        """Triangles in all places."""
        return self._inner.num_triangles()

    def move(self, mesh: int, transforms: npt.ArrayLike | None) -> None:
        """Lets one of the meshes stand at other places from now on.

        A move costs its matrices alone: vertices and what was made of them stay.
        Depth images that were rendered before stay as they are.

        Parameters
        ----------
        mesh : int
            The mesh, by its place in the list of the upload.
        transforms : (K, 4, 4) or (4, 4) float array, or None
            ``world_from_mesh`` of each copy, as in `Mesh`; K may be another number than before.
            None: one copy, whose vertices are world positions.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came; then nothing has moved.

        Examples
        --------
        >>> import numpy as np, hizvk
        >>> device = hizvk.Device()
        >>> square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
        >>> door = device.occluders(square, [[0, 1, 2], [0, 2, 3]], transforms=np.eye(4))
        >>> aside = np.eye(4)
        >>> aside[0, 3] = 0.9
        >>> door.move(0, aside)
        """
        mesh = _arguments.integer("mesh", mesh, low=0, high=2**32 - 1)
        self._inner.move(mesh, placed("transforms", transforms))

    @property
    def host_bytes(self) -> int:
        """Bytes that they take on the host.

        - Each mesh once: 36 to 48 per vertex and about 16 per triangle.
        - Once a conservative depth image was rendered: about 24 more per vertex and 42 per
          triangle, for good.
        """
        return self._inner.host_bytes()

    def _summary(self) -> str:
        return f": {self.num_meshes} meshes, {self.num_triangles} triangles"


def _converted(
    camera: Camera, depth: npt.NDArray[np.float32], kind: DepthKind, level: int, end: DepthEnd
) -> npt.NDArray[np.float32]:
    """Depth of another kind than the camera's own."""
    from .view_depth import converted  # culls need none of it

    return converted(camera, depth, kind, level, end)


class _Seen:
    """What belongs to one camera, and has the size of its image."""

    _camera: Camera

    @property
    def camera(self) -> Camera:
        """The camera that the depth belongs to; no other one can cull with it."""
        return self._camera

    @property
    def size(self) -> Size:
        """``(height, width)`` in pixels; for a pyramid that of level 0."""
        return self._camera.size


class DepthImage(PicturedDepth, _Seen, OnDevice[CoreDepthImage]):
    """A depth image on the device; made by `Device.render_depth`."""

    def __init__(self, device: Maker, inner: CoreDepthImage, camera: Camera) -> None:
        super().__init__(device, inner)
        self._camera = camera

    @property
    def kind(self) -> DepthKind:
        """``"reversed_ndc"`` or ``"ndc"``, as for its camera."""
        return self._camera.depth_kind

    @property
    def rasteriser(self) -> str | None:
        """What drew it: ``"device"`` or ``"host"``; None for conservative and uploaded depth."""
        return self._inner.rasteriser()

    def numpy(self, *, kind: DepthKind | None = None) -> npt.NDArray[np.float32]:
        """``(height, width)`` float32: the depth, row 0 on top; a copy.

        Parameters
        ----------
        kind : {"ndc", "reversed_ndc", "z", "distance"}, optional
            As for `Pyramid.level`; None: NDC, as `kind` says.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        depth = self._inner.read().reshape(self.size)
        return depth if kind is None else _converted(self._camera, depth, kind, 0, "farthest")

    def _summary(self) -> str:
        return f" {self.size[0]}x{self.size[1]} of kind {self.kind}"


class Pyramid(PicturedPyramid, _Seen, Allocated[CorePyramid]):
    """A depth pyramid on the device; made by `Device.pyramid`.

    On level ``k`` a texel holds the farthest depth of a block of ``2^k x 2^k`` pixels.
    With ``depths=`` it has the nearest depth, too, or instead.
    """

    def __init__(
        self,
        device: Maker,
        inner: CorePyramid,
        camera: Camera,
        source: Source,
        *,
        is_rendered: bool = False,
        depths: Depths = "farthest",
    ) -> None:
        super().__init__(device, inner)
        self._camera = camera
        self._source = source
        self._depths = depths
        self._is_rendered = is_rendered

    @property
    def num_levels(self) -> int:
        """Levels from the full size down to one texel."""
        return self._inner.num_levels()

    @property
    def levels(self) -> range:
        """The stored levels, as ``levels=`` asked for; level 0, the image, can always be read."""
        stored = self._inner.stored_levels()
        return range(0) if stored is None else range(stored[0], stored[1] + 1)

    @property
    def depths(self) -> Depths:
        """Which depths of each block are stored, as ``depths=`` of `Device.pyramid` asked for."""
        return self._depths

    def level(
        self, k: int, end: DepthEnd | None = None, *, kind: DepthKind | None = None
    ) -> npt.NDArray[np.float32]:
        """Level `k` as a ``(height, width)`` float32 array of depth, row 0 on top; a copy.

        Parameters
        ----------
        k : int
            ``0 <= k < num_levels``; 0 is the finest.
        end : {"farthest", "nearest"}, optional
            Which end of each block's depths.
            Level 0 has the pixels as that end counts them: "no data" is far in the farthest and
            near in the nearest.
            None: the farthest, or the nearest of a pyramid that has nothing else.
        kind : {"ndc", "reversed_ndc", "z", "distance"}, optional
            What the numbers are, as for `Device.pyramid`.
            ``"z"`` and ``"distance"`` are in world units, infinite for an infinite far plane.
            The distance of a texel bounds those of its pixels: none is farther, or for the nearest
            end none is nearer.
            They are computed in float64 and rounded to float32; no cull reads them.
            None: NDC depth of the kind `Camera.depth_kind`, as culls read it.

        Raises
        ------
        TypeError
            If `k` is no integer, or `end` or `kind` no word.
        ValueError
            If `end` is not stored (see `depths`), or if the camera does not say where view depth
            starts: an orthographic one made from a bare matrix.
        IndexError
            If there is no such level, or it is not stored (see `levels`).

        Examples
        --------
        >>> import numpy as np, hizvk
        >>> device = hizvk.Device()
        >>> camera = hizvk.Camera.look_at(
        ...     (0, 0, 9), (0, 0, 0), fov_y_deg=60, size=(90, 160), near=0.125
        ... )
        >>> hiz = device.pyramid(np.full(camera.size, 2.0), camera, kind="z")
        >>> texels = hiz.level(3)[0, 0], hiz.level(3, kind="z")[0, 0]
        >>> [round(float(texel), 4) for texel in texels]
        [0.0625, 2.0]
        """
        alone = self._depths if self._depths in words(DepthEnd) else None
        if end is None:
            end = "nearest" if alone == "nearest" else "farthest"
        _arguments.choice("end", end, words(DepthEnd) if alone is None else (alone,))
        k = _arguments.index("k", k, self.num_levels, what="a level", none="there is none")
        if k > 0 and k not in self.levels:
            raise IndexError(f"k: expected 0 or a level that is stored, {self._stored()}, got {k}")
        size, texels = self._inner.read_level(k, end == "nearest")
        texels = texels.reshape(size)
        return texels if kind is None else _converted(self._camera, texels, kind, k, end)

    def mips(
        self, *, depths: MipDepths = "farthest", lookup: MipLookup = "normalized"
    ) -> list[npt.NDArray[np.float32]]:
        """The levels of a mip texture of the depth image, as shaders of one's own read them.

        Unlike the pyramid's own levels they are halved and rounded down, as mip levels are.
        Level k has ``max(1, height >> k)`` rows and ``max(1, width >> k)`` columns, and level 0 is
        the image.
        In Rust the same levels are a texture: ``HizContext::create_mip_texture``.

        Parameters
        ----------
        depths : "farthest", "nearest" or "both"
            Which depths of its pixels a texel holds.
            Pixels without a depth (NaN, outside of 0..1) count as far for the farthest depth, and
            as near for the nearest one.
        lookup : "normalized" or "edge_texel"
            How a shader finds the texel that covers a pixel; `hizvk.mip_texel` computes it.

            - ``"normalized"``: by normalised coordinates u, at texel ``floor(u n)``.
              A texel covers every pixel that its part of the image touches.
            - ``"edge_texel"``: by the pixel's number p, at texel ``min(p >> k, n - 1)``.
              Texels share no pixels.

        Returns
        -------
        list of arrays
            For each level ``(height, width)`` float32 of NDC depth, row 0 on top.
            With ``"both"`` it is ``(height, width, 2)``: the farthest depth, then the nearest.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        LimitError
            If the levels exceed one storage binding of the device.
        OutOfMemoryError
            If the device or the host has no room for them.

        Examples
        --------
        >>> import numpy as np, hizvk
        >>> device = hizvk.Device()
        >>> camera = hizvk.Camera.look_at(
        ...     (0, 0, 9), (0, 0, 0), fov_y_deg=60, size=(90, 161), near=0.1
        ... )
        >>> hiz = device.pyramid(np.full(camera.size, 20.0), camera, kind="z")
        >>> [level.shape for level in hiz.mips(depths="nearest")][:3]
        [(90, 161), (45, 80), (22, 40)]
        """
        depths_, lookup_ = mips.checked(depths, lookup)
        levels = self._inner.mips(depths_, lookup_)
        ends = (2,) if depths_ == "both" else ()
        return [texels.reshape(size + ends) for size, texels in levels]

    @overload
    def update(self, row: int, column: int, array: npt.NDArray[Any]) -> None: ...

    @overload
    def update(
        self, row: DepthImage, column: tuple[int, int, int, int] | None, array: None = None
    ) -> None: ...

    def update(self, row: Any, column: Any, array: Any = None) -> None:
        """Renews the levels where the depth image has changed, and nowhere else.

        Afterwards the levels are those of a pyramid that is built anew, bit for bit.
        A cull that was submitted before keeps its answer.
        Its `CullResult.explain` reads the depth as it is now.

        There are two forms:

        - ``hiz.update(row, column, array)`` puts an array into the depth image.
          It is for a pyramid that was built from an array.
        - ``hiz.update(depth, rectangle)`` is for a pyramid of a `DepthImage` that was drawn into
          since (``render_depth(..., into=depth)`` returns the rectangle).
          Outside of the rectangle nothing may have changed.

        Parameters
        ----------
        row : int; or DepthImage
            The row of the image where the array begins; or the image that the pyramid was built
            from.
        column : int; or (x0, y0, x1, y1) or None
            The column where the array begins; or the rectangle that was touched, both ends
            included.
            None: nothing was touched.
        array : (height, width) array, or (height, width, samples)
            The new depth, which ends within the image.
            Its numbers mean what those of the pyramid's own array mean: `kind`, `scale` and
            `invalid` are the same, and so is the dtype.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.

        Examples
        --------
        >>> import numpy as np, hizvk
        >>> device = hizvk.Device()
        >>> camera = hizvk.Camera.look_at(
        ...     (0, 0, 9), (0, 0, 0), fov_y_deg=60, size=(90, 160), near=0.1
        ... )
        >>> depth = np.full(camera.size, 20.0)
        >>> hiz = device.pyramid(depth, camera, kind="z")
        >>> hiz.update(10, 30, np.full((5, 8), 3.0))
        >>> depth[10:15, 30:38] = 3.0
        >>> anew = device.pyramid(depth, camera, kind="z")
        >>> all(np.array_equal(hiz.level(k), anew.level(k)) for k in range(hiz.num_levels))
        True
        """
        engine = self._device._engine
        if isinstance(row, DepthImage):
            if array is not None:
                got = _arguments.describe(array)
                raise TypeError(f"array: expected nothing beside a DepthImage, got {got}")
            check_owner("depth", row, self._device)
            if row._inner is not self._source.image:
                raise ValueError(
                    f"depth: expected the DepthImage that the pyramid was built from, got {row!r}; "
                    "Device.pyramid builds one from it"
                )
            touched = rectangle("rectangle", column, self.size)
            if touched is not None:
                engine.renew(self._inner, row._inner, touched)
            return
        touched, rows = replacement(self._source, self._camera, row, column, array)
        images = [plane.image for plane in rows]
        meaning = rows[0][1:]
        engine.replace_depth(self._inner, self._source.image, touched, images, *meaning)

    def _stored(self) -> str:
        first, last = self.levels[0], self.levels[-1]
        return f"{first}..{last}" if first < last else str(first)

    def _summary(self) -> str:
        missing = len(self.levels) < self.num_levels - 1
        stored = f", stored {self._stored()}" if missing else ""
        ends = "" if self._depths == "farthest" else f", depths {self._depths}"
        return f" {self.size[0]}x{self.size[1]}, {self.num_levels} levels{stored}{ends}"
