"""Hierarchical occlusion maps: Zhang, Manocha, Hudson and Hoff (1997).

Moller and Haines, *Real-Time Rendering* (1999), retell them.
`Device.occlusion_map` makes the maps of a view and `Device.cull_map` culls by them.
What they cull is not certified, so the results say that they are approximate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _arguments
from .._core import OcclusionMap as CoreOcclusionMap
from .._on_device import check_owner
from ..bounds import as_arrays
from ..camera import Camera
from ..drawing import limit
from ..explanation import Verdict
from ..other_cameras import other_camera
from ..resources import Occluders

if TYPE_CHECKING:
    import numpy.typing as npt

    from .._arguments import Size
    from .._on_device import Maker
    from ..bounds import Bounds

__all__ = ["MapResult", "OcclusionMap", "culled", "made"]

#: The largest side of a map: a pixel of a coarser one counts in 32 bits.
LARGEST_MAP = 32768


class OcclusionMap:
    """Maps of what the occluders of one view cover, made by `Device.occlusion_map`.

    Level 0 has a pixel for each centre that an occluder covers.
    A pixel of level k counts the covered ones among its ``4**k`` pixels of level 0.
    Beside the maps stands one depth for each of 64x64 regions, in place of a Z-buffer.
    They lie on the host and may be read from any thread.

    Examples
    --------
    A wall over the left half of the view, a box behind it, and one that sticks out beside it:

    >>> import numpy as np, hizvk
    >>> device = hizvk.Device()
    >>> camera = hizvk.Camera.look_at(
    ...     (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(720, 1280), near=0.1
    ... )
    >>> wall = [(-30, -30, -10), (0, -30, -10), (0, 30, -10), (-30, 30, -10)]
    >>> walls = device.occluders(wall, [(0, 1, 2), (0, 2, 3)])
    >>> maps = device.occlusion_map(walls, camera)
    >>> maps
    <OcclusionMap 256x256 to 4x4: 1 occluders, 2 triangles>
    >>> maps.opacity(6)[0].tolist()
    [1.0, 1.0, 0.0, 0.0]
    >>> boxes = hizvk.Boxes([(-6, -1, -20), (-1, -1, -20)], [(-4, 1, -15), (1, 1, -15)])
    >>> seen = device.cull_map(boxes, camera, maps)
    >>> seen.mask.tolist(), seen.approximate
    ([False, True], True)
    """

    def __init__(self, device: Maker, inner: CoreOcclusionMap, camera: Camera) -> None:
        self._device = device
        self._inner = inner
        self._camera = camera

    def __repr__(self) -> str:
        (height, width), (least_height, least_width) = self.size, self.level(-1).shape
        return (
            f"<OcclusionMap {width}x{height} to {least_width}x{least_height}: "
            f"{len(self.chosen)} occluders, {self.num_triangles} triangles>"
        )

    @property
    def device(self) -> Maker:
        """The `Device` that made it."""
        return self._device

    @property
    def camera(self) -> Camera:
        """The view, with the size of level 0."""
        return self._camera

    @property
    def size(self) -> Size:
        """``(height, width)`` of level 0."""
        return self._camera.size

    @property
    def num_levels(self) -> int:
        """The number of maps."""
        return self._inner.num_levels()

    def level(self, level: int) -> npt.NDArray[np.uint32]:
        """``(height, width)`` uint32: how many of a pixel's ``4**level`` pixels are covered.

        Parameters
        ----------
        level : int
            0 is the finest; -1 is the coarsest.

        Raises
        ------
        TypeError, ValueError
            For anything but a level of these maps.
        """
        (height, width), counts = self._inner.level(self._checked(level))
        return counts.reshape(height, width)

    def opacity(self, level: int) -> npt.NDArray[np.float64]:
        """``(height, width)`` float64: the covered share of each pixel, 0 to 1, without rounding.

        Parameters and errors are those of `level`.
        """
        opacity: npt.NDArray[np.float64] = self.level(level) / 4.0 ** self._checked(level)
        return opacity

    def _checked(self, level: int) -> int:
        count = self.num_levels
        level = _arguments.integer("level", level, low=-count, high=count - 1)
        return level % count

    def least_counts(self, negligible_px: int) -> npt.NDArray[np.uint32]:
        """``(num_levels,)`` uint32: the counts from which pixels of each level are opaque.

        The threshold of level k is ``O(k) = 1 - negligible_px / 4**k``, and so
        ``O(k + 1) = (3 + O(k)) / 4``.
        It begins at the level where the hole is at most a sixteenth of a pixel.
        For 4 pixels that is 2x2 of 8x8, the text's 0.9375; pixels of finer levels have to be full.

        Parameters
        ----------
        negligible_px : int
            The pixels of a hole that is negligible, 0 to 2^32 - 1.

        Raises
        ------
        TypeError, ValueError
            For anything else.
        """
        counts = self._inner.least_counts(_negligible(negligible_px))
        return np.array(counts, dtype=np.uint32)

    @property
    def estimate(self) -> npt.NDArray[np.float64]:
        """``(regions, regions)`` float64: the depth-estimation buffer, row 0 on top.

        A region has the view depth, in world units, of the farthest vertex of the boxes of the
        occluders that it meets; infinite without any.
        """
        (height, width), depths = self._inner.estimate()
        return depths.reshape(height, width)

    @property
    def chosen(self) -> npt.NDArray[np.uint32]:
        """``(C,)`` uint32: the copies of meshes that were drawn, the largest and nearest first."""
        return self._inner.chosen()

    @property
    def num_triangles(self) -> int:
        """The triangles of these copies."""
        return self._inner.num_triangles()


class MapResult:
    """The answer of `Device.cull_map`, which is not certified as that of `Device.cull` is.

    What it culls may show: beside an occluder in a larger image than the maps, and through holes
    that were said to be negligible.
    `OcclusionMap` has an example.
    """

    #: What tells it from a certified result, which has no such attribute.
    approximate = True

    def __init__(
        self,
        verdicts: npt.NDArray[np.uint8],
        holes: npt.NDArray[np.uint32],
        lookups: int,
        negligible_px: int,
    ) -> None:
        self._verdicts = verdicts
        self._holes = holes
        self._lookups = lookups
        self._negligible_px = negligible_px

    def __len__(self) -> int:
        """The number of instances that were tested."""
        return len(self._verdicts)

    def __repr__(self) -> str:
        return f"<MapResult of {len(self)} instances, {self.negligible_px} px negligible>"

    @property
    def negligible_px(self) -> int:
        """The pixels of a hole that counted as none."""
        return self._negligible_px

    @property
    def verdicts(self) -> npt.NDArray[np.uint8]:
        """``(N,)`` uint8: a `Verdict` for each instance; none of them is certified."""
        return self._verdicts

    @property
    def mask(self) -> npt.NDArray[np.bool_]:
        """``(N,)`` bool: True for what is kept."""
        kept: npt.NDArray[np.bool_] = self._verdicts >= Verdict.VISIBLE
        return kept

    @property
    def indices(self) -> npt.NDArray[np.uint32]:
        """``(K,)`` uint32: the list of kept instances, ascending."""
        return np.flatnonzero(self.mask).astype(np.uint32)

    @property
    def count(self) -> int:
        """Instances that are kept."""
        return int(np.count_nonzero(self.mask))

    @property
    def holes(self) -> npt.NDArray[np.uint32]:
        """``(N,)`` uint32: uncovered pixels of level 0 within what hides each culled instance.

        That is within the pixels of coarser maps that counted as opaque.
        It can show in no more of the centres of pixels.
        0 for what is kept or outside.
        """
        return self._holes

    @property
    def lookups(self) -> int:
        """Pixels of maps that were read, for all instances."""
        return self._lookups


def _negligible(value: object) -> int:
    return _arguments.integer("negligible_px", value, low=0, high=2**32 - 1)


def _power_of_two(name: str, value: object, most: int) -> int:
    number = _arguments.integer(name, value, low=1, high=most)
    if number & (number - 1):
        raise ValueError(f"{name}: expected a power of two, got {number}")
    return number


def made(
    device: Maker,
    occluders: Occluders,
    camera: Camera,
    *,
    size: Size,
    least: int,
    regions: int,
    max_triangles: int | None,
    max_occluders: int | None,
) -> OcclusionMap:
    """The body of `Device.occlusion_map`."""
    _arguments.instance("occluders", occluders, Occluders, "Occluders of Device.occluders")
    check_owner("occluders", occluders, device)
    _arguments.instance("camera", camera, Camera, "a Camera")
    height, width = _arguments.size("size", size)
    for side in (height, width):
        if side & (side - 1) or side > LARGEST_MAP:
            raise ValueError(
                f"size: expected powers of two up to {LARGEST_MAP}, got {(height, width)}"
            )
    shorter = min(height, width)
    least = _power_of_two("least", least, shorter)
    regions = _power_of_two("regions", regions, shorter)
    triangles = limit("max_triangles", max_triangles)
    copies = limit("max_occluders", max_occluders)
    own = camera.resized((height, width))
    inner = CoreOcclusionMap(occluders._inner, own._inner, least, regions, triangles, copies)
    return OcclusionMap(device, inner, own)


def culled(
    device: Maker,
    bounds: Bounds,
    camera: Camera,
    maps: OcclusionMap,
    *,
    negligible_px: int,
    copies: Any,
) -> MapResult:
    """The body of `Device.cull_map`."""
    kind, arrays = as_arrays("bounds", bounds)
    _arguments.instance("camera", camera, Camera, "a Camera")
    _arguments.instance("maps", maps, OcclusionMap, "an OcclusionMap of Device.occlusion_map")
    if maps.device is not device:
        raise ValueError("maps: expected an OcclusionMap of this device, got one of another Device")
    if camera.resized(maps.size) != maps.camera:
        raise other_camera("camera", "the view of the maps", maps.camera, camera.resized(maps.size))
    negligible = _negligible(negligible_px)
    never = None
    if copies is not None:
        numbers = _arguments.mesh_ids("copies", copies, len(bounds), "numbers of copies")
        never = np.isin(numbers, maps.chosen)
    verdicts, holes, lookups = maps._inner.cull(kind, list(arrays), negligible, never)
    return MapResult(verdicts, holes, lookups, negligible)
