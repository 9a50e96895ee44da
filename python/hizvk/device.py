"""The device: it uploads, renders depth, builds pyramids and culls.

Its methods keep to the order of the data: a depth image (rendered from occluders, or an array)
becomes a pyramid, and a cull tests instances against the pyramid.
The interpreter lock is released while the device works; all objects may be used from any thread,
also at the same time.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, overload

import numpy as np

from . import _arguments, _core
from ._processes import driver_is_asked
from .bounds import Bounds, are_points, as_arrays
from .camera import Camera
from .depth import checked_image
from .errors import LimitError
from .hints import Question
from .resources import DepthImage, Instances, Occluders, Pyramid, as_meshes
from .result import CullResult, DrawTemplate

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from ._arguments import Size
    from .depth import DepthArray, DepthKind
    from .resources import MeshLike

__all__ = ["Adapter", "Device", "adapters"]

# Unions of words: stubtest takes Literal["a", "b"] for something else at run time.
Order: TypeAlias = Literal["stable"] | Literal["any"]
Coverage: TypeAlias = Literal["area"] | Literal["sample"]
Fit: TypeAlias = Literal["rectangle"] | Literal["volume"]
StoredOrder: TypeAlias = Literal["morton"] | Literal["given"]
Output: TypeAlias = Literal["mask"] | Literal["verdicts"] | Literal["indices"] | Literal["draws"]
FaceCull: TypeAlias = Literal["none"] | Literal["back"] | Literal["front"]
Levels: TypeAlias = int | tuple[int, int] | None


@dataclass(frozen=True)
class Adapter:
    """A Vulkan adapter (a GPU, or a software driver)."""

    index: int
    """Its place in the list of `adapters`."""
    name: str
    """The adapter's name."""
    driver: str
    """The driver's name."""
    driver_info: str
    """The driver's version."""
    backend: str
    """The graphics interface, ``"vulkan"``."""
    device_type: str
    """``"discrete_gpu"``, ``"integrated_gpu"``, ``"virtual_gpu"``, ``"cpu"`` or ``"other"``."""

    def __str__(self) -> str:
        driver = " ".join(part for part in (self.driver, self.driver_info) if part)
        return f"{self.index}: {self.name} [{self.device_type}, {driver}]"


def adapters() -> list[Adapter]:
    """The Vulkan adapters of this machine; an empty list without a Vulkan driver."""
    with driver_is_asked():
        return [Adapter(*summary) for summary in _core.adapters()]


class Device:
    """A Vulkan device with its queue and pipelines.

    Parameters
    ----------
    adapter : str or int, optional
        Which adapter: its index in `adapters`, or a part of its or its driver's name
        (``"lavapipe"``).
        None takes what the environment variable ``HIZVK_ADAPTER`` says in the same words, else the
        best one, GPUs first.

    Raises
    ------
    NoAdapterError
        Without such an adapter; the error lists those there are and how to choose one, or where
        there is none the line that installs a software driver.
    TypeError
        If `adapter` is neither.

    Notes
    -----
    Processes: when the interpreter ends, every device is waited for and destroyed, also where
    modules still name results or where daemon threads cull.
    What asks a device after that (a function of `atexit` that was registered before this package
    was imported) gets a `HizError`.

    Forks: no device works in a forked child.
    There every object of the parent's devices raises a `HizError` when the device is needed;
    lengths, ``repr`` and arrays that were read before still work.
    Make a `Device` in the child (a call of `visible` without ``device=`` does), or use
    ``multiprocessing.get_context("spawn")``.
    A fork waits until the calls of other threads are done, so that the child finds no lock of the
    driver held.
    A forked child ends without its parent's C exit handlers: those of drivers would wait for
    threads that the child does not have.

    Threads: any number may use one device, or devices of their own.
    """

    def __init__(self, adapter: str | int | None = None) -> None:
        expected = "an adapter's index, a part of its name, or None"
        if isinstance(adapter, (bool, np.bool_)) or not isinstance(
            adapter, (str, int, np.integer, type(None))
        ):
            raise TypeError(f"adapter: expected {expected}, got {_arguments.describe(adapter)}")
        if isinstance(adapter, str) and not adapter.strip():
            raise ValueError(f"adapter: expected {expected}, got an empty string")
        if not isinstance(adapter, (str, type(None))):
            adapter = str(_arguments.integer("adapter", adapter, low=0, high=2**31 - 1))
        with driver_is_asked():
            self._engine = _core.Engine(adapter)

    @property
    def adapter(self) -> Adapter:
        """The adapter that it runs on."""
        return Adapter(*self._engine.adapter())

    @property
    def max_image_side(self) -> int:
        """The largest height or width of a depth image on this device."""
        return self._engine.max_image_side()

    def instances(
        self, bounds: Bounds, *, strict: bool = False, order: StoredOrder = "morton"
    ) -> Instances:
        """Uploads bounds, once for any number of culls.

        They are stored so that neighbours in space lie together, in groups of 64 with a box around
        each: neighbours meet the same pixels, and what hides the box hides the group.
        Masks, indices and `explain` speak of instances by the order in which they came, whatever
        the stored one.
        On the device an instance takes its record, 4 bytes for its index and its share of a group's
        box (`Instances.device_bytes`).

        Parameters
        ----------
        bounds : Spheres, Boxes or OrientedBoxes
            The volumes.
            Positions may be float64; they are split so that nothing is lost far from the origin.
        strict : bool
            True refuses bounds that are no volume (NaN, infinite, a negative size, min > max).
            False keeps them visible, and `Instances.invalid` and `CullStats.invalid` tell of them.
        order : "morton" or "given"
            How they are stored.
            ``"morton"``: sorted along a curve through space (Morton 1966), once, here.
            ``"given"``: as they come, for arrays that are in such an order already; no sort, and 8
            bytes an instance less on the host.

        Raises
        ------
        TypeError, ValueError
            For other bounds, or bad ones with ``strict=True``.
            They name the parameter, what it expects and what came.
        LimitError, OutOfMemoryError
            If the device cannot hold them.
        """
        kind, arrays = as_arrays("bounds", bounds)
        strict = _arguments.flag("strict", strict)
        stored_order = _arguments.choice("order", order, ("morton", "given"))
        uploaded = self._engine.instances(kind, arrays, strict, stored_order, None)
        return Instances(self, uploaded, points=are_points(bounds))

    @overload
    def occluders(
        self,
        vertices: npt.ArrayLike,
        triangles: npt.ArrayLike,
        *,
        transforms: npt.ArrayLike | None = None,
        cull: FaceCull = "none",
    ) -> Occluders: ...

    @overload
    def occluders(
        self,
        vertices: MeshLike | Sequence[MeshLike | tuple[npt.ArrayLike, ...]],
        triangles: None = None,
        *,
        transforms: npt.ArrayLike | None = None,
        cull: FaceCull = "none",
    ) -> Occluders: ...

    def occluders(
        self,
        vertices: Any,
        triangles: Any = None,
        *,
        transforms: Any = None,
        cull: FaceCull = "none",
    ) -> Occluders:
        """Uploads triangle meshes that hide things, once for any number of renderings.

        Parameters
        ----------
        vertices : (V, 3) float array; or a Mesh, a mesh of trimesh or Open3D, or a list of them
            World positions (or the mesh's own, with `transforms`).
            Objects of other libraries are told by their ``vertices`` and ``faces`` (trimesh) or
            ``triangles`` (Open3D).
            A list may also hold plain tuples ``(vertices, triangles)`` or ``(vertices, triangles,
            transforms)``.
        triangles : (T, 3) integer array
            Indices of vertices; left out when ``vertices`` is a mesh or a list.
        transforms : (K, 4, 4) or (4, 4) float array, optional
            ``world_from_mesh`` of each copy; not beside a Mesh or a list, which have their own.
        cull : "none", "back" or "front"
            Faces that are left out; the front is where the triangle runs counter-clockwise.
            For closed meshes that are wound so, ``"back"`` draws the same depth for less: a ray
            enters one by a front face.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        LimitError, OutOfMemoryError
            If the device cannot hold them.
        """
        meshes = as_meshes(vertices, triangles, transforms)
        cull_mode = _arguments.choice("cull", cull, ("none", "back", "front"))
        raw = [(mesh.vertices, mesh.triangles, mesh.transforms) for mesh in meshes]
        return Occluders(self, self._engine.occluders(raw, cull_mode))

    def render_depth(
        self,
        occluders: Occluders,
        camera: Camera,
        *,
        size: Size | None = None,
        conservative: bool = False,
        refinement: int = 2,
    ) -> DepthImage:
        """Renders occluders into a depth image that stays on the device.

        The plain image is rasterised: it knows the depth at the pixels' centres, up to the grid to
        which the driver moves corners (1/256 pixel on lavapipe, 1/16 at most), and a cull by it
        promises for an image of that size and those samples.
        In a larger image of the same view, or at other samples (multisampling, jitter), a gap may
        show that no centre hit, with something behind it that was culled.
        And it hides points that lie on their own occluder: of a mesh's own visible vertices nearly
        half (44 to 47 % of the meshes in ``docs/guide.md``), for between two centres the surface is
        farther than at one of them.

        The conservative image promises for every image of the same view, whatever its size, sample
        positions and jitter, and hides none of a mesh's own visible vertices: **every ray through
        the closed square of a pixel meets an occluder at the pixel's depth or nearer**; where that
        cannot be shown the pixel is far.
        So render it small, and a cull by it (``coverage="area"``, the default) never hides what can
        be seen in a large image.
        It is a proof about the exact triangles, given float64 positions included, whatever the
        mesh: open, folded, intersecting itself or wrong way round.
        Cracks between triangles that do not share their vertices' exact positions count as gaps.

        Parameters
        ----------
        occluders : Occluders
            Of this device.
        camera : Camera
            The view.
        size : (height, width), optional
            Another image size for the same view; the image's camera is then
            ``camera.resized(size)``, and the cull promises for that image, or with `conservative`
            for every image of the view.
        conservative : bool
            True makes the conservative image, on the host in float64, and uploads it.
            Its price is time (tens of milliseconds for tens of thousands of triangles in 256x144
            pixels, and more in larger images), and that pixels at silhouettes have the depth of
            what is behind.
            ``docs/occluders.md`` has the proof and what was measured.
        refinement : int
            For `conservative`, 0..8: how often a pixel is quartered where no surface covers all of
            it.
            Each step finds a little more and costs time at silhouettes; any number is right.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        LimitError, OutOfMemoryError
            If the image is larger than the device allows.

        References
        ----------
        Akenine-Moller and Aila, "Conservative and tiled rasterization using a modified triangle
        set-up" (2005): what a pixel needs to be covered by one triangle.
        The step to whole surfaces is this library's own.
        """
        _arguments.instance("occluders", occluders, Occluders, "Occluders of Device.occluders")
        self._own("occluders", occluders)
        _arguments.instance("camera", camera, Camera, "a Camera")
        conservative = _arguments.flag("conservative", conservative)
        refinement = _arguments.integer("refinement", refinement, low=0, high=8)
        if size is not None:
            camera = camera.resized(size)
        if conservative:
            drawn = self._engine.render_depth_conservative(
                occluders._inner, camera._inner, refinement
            )
            return DepthImage(self, drawn, camera)
        return DepthImage(self, self._engine.render_depth(occluders._inner, camera._inner), camera)

    @overload
    def pyramid(
        self,
        depth: DepthImage,
        camera: None = None,
        *,
        kind: None = None,
        scale: float = 1.0,
        invalid: None = None,
        levels: Levels = None,
    ) -> Pyramid: ...

    @overload
    def pyramid(
        self,
        depth: npt.ArrayLike,
        camera: Camera,
        *,
        kind: DepthKind,
        scale: float = 1.0,
        invalid: Collection[float] | None = None,
        levels: Levels = None,
    ) -> Pyramid: ...

    def pyramid(
        self,
        depth: Any,
        camera: Camera | None = None,
        *,
        kind: DepthKind | None = None,
        scale: float = 1.0,
        invalid: Collection[float] | None = None,
        levels: Levels = None,
    ) -> Pyramid:
        """Builds the depth pyramid of a depth image.

        Parameters
        ----------
        depth : DepthImage or (height, width) array
            A rendered image of this device, alone; or an array, with `camera` and `kind`.
            Arrays are float, or uint16 for the kinds ``"z"`` and ``"distance"``; row 0 is the top
            of the image.
            What rounding to float16 may have cost (2^-10 of each number, and 2^-24) is counted, and
            of the kinds ``"z"`` and ``"distance"`` what rounding to float32 may have (2^-24 of each
            number).
            Whole numbers and float64 count as exact.
            What is masked in a masked array is "no data".
        camera : Camera
            The camera that saw the array; its size is the array's shape.
        kind : {"ndc", "reversed_ndc", "z", "distance"}
            What the array's numbers are; there is no default, because a wrong guess hides things.

            ``"ndc"``: depth buffer values, 0 near and 1 far (a camera with ``reversed_z=False``);
            ``"reversed_ndc"``: 1 near and 0 far (``reversed_z=True``); ``"z"``: depth along the
            view direction in world units; ``"distance"``: distance to the eye along the pixel's ray
            in world units.

            "No data" is as far as can be: NaN, infinity, `invalid`, and what lies outside the
            camera's planes.
            For z and distance zero and negative numbers are "no data", too, but for an orthographic
            camera with ``near < 0``: it sees behind its eye, so depth of either sign is depth, and
            so is a float zero.
        scale : float
            World units of one step, for the kinds ``"z"`` and ``"distance"`` (0.001 for
            millimetres).
        invalid : collection of float, optional
            Which numbers of the array mean "no data", in its own units (before `scale`).
            None: what its dtype is written with, 0 and 65535 for uint16, 65504 (the greatest) for
            float16, no number for float32 and float64.
            ``()``: no number but those that never are depth.
        levels : int or pair of int, optional
            Which levels are built, of 1 to 15; level 0, the image itself, is always there.
            None: all.
            ``2``: level 2 and all coarser ones.
            ``(2, 5)``: levels 2 to 5; ``(4, 4)``: level 4 alone, made in one pass.
            Numbers past the coarsest level, which is one texel, mean that one.

            Fewer levels are built faster and take less memory, and nothing is hidden wrongly, but
            more is kept: a test reads the next coarser level that there is, and bounds that span
            more texels of the coarsest one than the footprint has are kept, unless a descent may
            read that many.
            Level 1 is the dearest to build; bounds of one or two pixels read the image itself.
            ``hizvk bench`` measures both sides of the price.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        LimitError, OutOfMemoryError
            If the image is larger than the device allows.
        """
        stored = stored_levels(levels)
        if isinstance(depth, DepthImage):
            for name, value in (("camera", camera), ("kind", kind), ("invalid", invalid)):
                if value is not None:
                    got = _arguments.describe(value)
                    raise TypeError(
                        f"{name}: expected nothing beside a DepthImage, which has its own, got {got}"
                    )
            if _arguments.number("scale", scale, above=0.0) != 1.0:
                raise ValueError(
                    f"scale: expected 1 beside a DepthImage, whose depth is NDC, got {scale:g}"
                )
            self._own("depth", depth)
            return Pyramid(
                self, self._engine.pyramid(depth._inner, stored), depth.camera, is_rendered=True
            )
        camera = _arguments.instance("camera", camera, Camera, "a Camera beside an array of depth")
        self._check_side(camera)
        return self._pyramid_of(
            checked_image("depth", depth, camera, kind, scale, invalid), camera, stored
        )

    def _pyramid_of(self, image: DepthArray, camera: Camera, stored: tuple[int, int]) -> Pyramid:
        """The pyramid of an image that was checked before."""
        uploaded = self._engine.upload_depth(*image, camera._inner)
        return Pyramid(self, self._engine.pyramid(uploaded, stored), camera)

    def cull(
        self,
        instances: Instances,
        camera: Camera,
        pyramid: Pyramid,
        *,
        order: Order = "stable",
        coverage: Coverage = "area",
        guard_px: float | None = None,
        depth_slack: float = 2.0**-23,
        depth_slack_abs: float = 0.0,
        transform_slack: float = 0.0,
        footprint: int = 2,
        descent: int = 0,
        fit: Fit = "rectangle",
        hierarchy: bool | None = None,
        outputs: Collection[Output] | None = None,
        capacity: int | None = None,
        draw: DrawTemplate | None = None,
        statistics: bool = False,
    ) -> CullResult:
        """Tests instances against a pyramid. What could be seen in the depth image is never culled.

        Parameters
        ----------
        instances : Instances
            Of this device.
        camera : Camera
            The camera of the pyramid (`Pyramid.camera` or one equal to it).
        pyramid : Pyramid
            Of this device.
        order : "stable" or "any"
            Whether the list of the visible ascends, or comes as the device finished (faster).
        coverage : "area" or "sample"
            ``"area"``: visible is what meets any part of a pixel.
            ``"sample"``: what covers no pixel centre counts as hidden; right for an image of one
            sample a pixel, the same viewport and no jitter.
            A plain depth image answers for its pixels' centres in either case: multisampling and
            jitter need ``"area"`` and conservative depth (`render_depth`).
        guard_px : float, optional
            Pixels by which bounds grow in the image, a multiple of 1/256 up to 16.
            None: 0 for area, 1/64 for sample.
        depth_slack : float
            Relative error of the depth image, up to 0.5; by default one ulp, for depth that was
            rounded to float32.
        depth_slack_abs : float
            Absolute error of the depth image beside that, up to 0.5, in NDC depth: a rasteriser
            errs by the same amount near and far in an orthographic view.
            Anything above 0 counts 2^-23 more.
        transform_slack : float
            For depth images of a renderer that transforms in float32: ulps that its matrix product
            may have cost (about 4), up to 1e6.
        footprint : 2, 4 or 8
            How many texels a side a test may read of one level: more mean a finer level, so less is
            kept and more read.
        descent : int
            How many texels of finer levels a test may read where the footprint cannot decide, up to
            65536; 0: none.
            With enough of them the answer is that of a test at full resolution.
        fit : "rectangle" or "volume"
            What stands for the bounds: ``"rectangle"``, the rectangle around their projection at
            their nearest depth; or, where that cannot decide, ``"volume"``: their own outline, and
            in each texel their own depth there.
            Keeps less and computes more; with a descent it comes down to single pixels.
        hierarchy : bool, optional
            Whether whole groups of 64 instances that lie together are tested first, and one by one
            only instances of the groups that are left.
            None: where there are enough of them for it to pay.
            What is kept differs by next to nothing (a group's test may read other texels);
            ``stats`` says how many tests were spent.
        outputs : collection of "mask", "verdicts", "indices", "draws"; optional
            What is computed: ask for less, pay less.
            None: all of it, where an ordered list is made when it is first asked for.
            Asking a result for what it was not asked to compute is a `ValueError`, but for indices
            and draws, which can be made from a mask.
        capacity : int, optional
            Most instances in the list.
            None: enough for all.
            Too small a capacity shows as ``count < demand``; mask and verdicts stay complete.
        draw : DrawTemplate, optional
            The other numbers of the draw arguments; None leaves them 0.
        statistics : bool
            Whether to count the tests by level and the texels that they read (slower).

        Returns
        -------
        CullResult
            Recorded and submitted; reading it waits.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came; also for a camera other than the
            pyramid's.
        LimitError, OutOfMemoryError
            If the device cannot hold the outputs.
        """
        _arguments.instance("instances", instances, Instances, "Instances of Device.instances")
        self._own("instances", instances)
        of_one = "a Camera (one a call: each camera culls with the pyramid of its own depth, Device.pyramid)"
        _arguments.instance("camera", camera, Camera, of_one)
        _arguments.instance("pyramid", pyramid, Pyramid, "a Pyramid of Device.pyramid")
        self._own("pyramid", pyramid)
        if camera != pyramid.camera:
            same_view = camera.resized(pyramid.size) == pyramid.camera
            way = "depth of one camera says nothing about another one"
            if same_view:
                way = f"pass camera.resized({pyramid.size}), the same view; the promise is about an image of that size"
            raise ValueError(
                f"camera: expected the camera of the pyramid, {pyramid.camera!r}, got {camera!r}; {way}"
            )
        options = cull_options(
            order=order, coverage=coverage, guard_px=guard_px, depth_slack=depth_slack,
            depth_slack_abs=depth_slack_abs, transform_slack=transform_slack, footprint=footprint, descent=descent,
            fit=fit, hierarchy=hierarchy, outputs=outputs, capacity=capacity, draw=draw, statistics=statistics,
        )  # fmt: skip
        culling = self._engine.cull(instances._inner, camera._inner, pyramid._inner, *options)
        question = Question(camera, pyramid, options[1], instances._points)
        return CullResult(culling, statistics=options[-1], question=question)

    def _check_side(self, camera: Camera) -> None:
        """An image that the device cannot hold is refused before its array is converted."""
        side = max(camera.size)
        if side > self.max_image_side:
            raise LimitError("image side in pixels", side, self.max_image_side)

    def wait(self) -> None:
        """Waits until everything that was submitted is done."""
        self._engine.wait()

    def _own(self, name: str, thing: Instances | Occluders | DepthImage | Pyramid) -> None:
        if thing.device is not self:
            raise ValueError(
                f"{name}: expected {type(thing).__name__} of this device, got one of another Device"
            )

    def __repr__(self) -> str:
        return f"<Device {self.adapter}>"


CullOptions: TypeAlias = tuple[
    str,
    str,
    float | None,
    float,
    float,
    float,
    int,
    int,
    str,
    bool | None,
    tuple[bool, bool, bool, bool],
    int | None,
    tuple[int, int, int, int],
    bool,
]

#: What a cull can compute, in the engine's order.
OUTPUTS = ("mask", "verdicts", "indices", "draws")


def _outputs(
    value: object, default: tuple[bool, bool, bool, bool]
) -> tuple[bool, bool, bool, bool]:
    """Which of `OUTPUTS` are asked for."""
    if value is None:
        return default
    if isinstance(value, str) or not isinstance(value, Collection):
        got = _arguments.describe(value)
        raise TypeError(
            f"outputs: expected None or a collection of {', '.join(map(repr, OUTPUTS))}, got {got}"
        )
    asked = {_arguments.choice("outputs", name, OUTPUTS) for name in value}
    mask, verdicts, indices, draws = (name in asked for name in OUTPUTS)
    return mask, verdicts, indices, draws


#: The coarsest level that the largest image has.
COARSEST = 15


def stored_levels(levels: object) -> tuple[int, int]:
    """The first and last level of ``levels=``."""
    if levels is None:
        return 1, COARSEST
    if isinstance(levels, (tuple, list)):
        if len(levels) != 2:
            raise ValueError(
                f"levels: expected None, a level or a pair (first, last), got {_arguments.describe(levels)}"
            )
        first, last = (_arguments.integer("levels", k, low=1, high=COARSEST) for k in levels)
        if first > last:
            raise ValueError(f"levels: expected first <= last, got ({first}, {last})")
        return first, last
    return _arguments.integer("levels", levels, low=1, high=COARSEST), COARSEST


#: Texels a side that a test may read of one level.
FOOTPRINTS = (2, 4, 8)


def cull_options(
    *,
    order: object,
    coverage: object,
    guard_px: object,
    depth_slack: object,
    depth_slack_abs: object,
    transform_slack: object,
    footprint: object,
    descent: object,
    fit: object,
    hierarchy: object = None,
    outputs: object = None,
    capacity: object = None,
    draw: object = None,
    statistics: object = False,
) -> CullOptions:
    """The checked options of a cull, in the engine's order."""
    order = _arguments.choice("order", order, ("stable", "any"))
    if hierarchy is not None and not isinstance(hierarchy, (bool, np.bool_)):
        raise TypeError(
            f"hierarchy: expected True, False or None, got {_arguments.describe(hierarchy)}"
        )
    hierarchy = None if hierarchy is None else bool(hierarchy)
    # An ordered list can be made later, one in the order of the device cannot.
    computed = _outputs(outputs, (True, True, order == "any", order == "any"))
    if guard_px is not None:
        guard_px = _arguments.number("guard_px", guard_px, at_least=0.0, at_most=16.0)
        if guard_px * 256.0 != round(guard_px * 256.0):
            raise ValueError(f"guard_px: expected a multiple of 1/256, got {guard_px}")
    footprint = _arguments.integer("footprint", footprint, low=2, high=8)
    if footprint not in FOOTPRINTS:
        raise ValueError(f"footprint: expected one of 2, 4, 8, got {footprint}")
    if capacity is not None:
        capacity = _arguments.integer("capacity", capacity, low=0, high=2**32 - 1)
    if draw is None:
        template = (0, 0, 0, 0)
    else:
        draw = _arguments.instance("draw", draw, DrawTemplate, "a DrawTemplate or None")
        template = (draw.index_count, draw.first_index, draw.base_vertex, draw.first_instance)
    return (
        order,
        _arguments.choice("coverage", coverage, ("area", "sample")),
        guard_px,
        _arguments.number("depth_slack", depth_slack, at_least=0.0, at_most=0.5),
        _arguments.number("depth_slack_abs", depth_slack_abs, at_least=0.0, at_most=0.5),
        _arguments.number("transform_slack", transform_slack, at_least=0.0, at_most=1e6),
        footprint,
        _arguments.integer("descent", descent, low=0, high=65536),
        _arguments.choice("fit", fit, ("rectangle", "volume")),
        hierarchy,
        computed,
        capacity,
        template,
        _arguments.flag("statistics", statistics),
    )
