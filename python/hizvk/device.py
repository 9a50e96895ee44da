"""The device: it uploads, renders depth, builds pyramids and culls.

Its methods stand in the order of the data.
A depth image, rendered from occluders or an array, becomes a pyramid, and a cull tests instances
against the pyramid.
This file has their documentation; what takes more than a few lines is in `rendering`, `building`
and `culling`.
The interpreter lock is released while the device works.
All objects may be used from any thread, also at the same time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

import numpy as np

from . import _arguments
from ._core import Engine as CoreEngine
from ._core import MeshTable as CoreMeshTable
from ._core import TwoPasses as CoreTwoPasses
from ._on_device import StaysInProcess, check_owner, owned
from ._processes import driver_is_asked
from ._types import Depths, FaceCull, Rasteriser, StoredOrder, words
from .adapter import Adapter
from .approximate import ApproximateResult
from .bounds import Bounds, are_points, as_arrays
from .building import check_side, of_arrays, of_image, receivers
from .camera import Camera
from .culling import check_coverage, checked_pyramid, culled, culled_views
from .mesh import as_meshes
from .options import Outputs, cull_options, cull_request
from .rendering import rendered
from .resources import (
    SOME_INSTANCES,
    DepthImage,
    Instances,
    Occluders,
    Pyramid,
)
from .samples import checked_samples
from .temporal import PassResult, Temporal
from .timing import StageTimes
from .views import ViewsResult, among_of
from .warming import checked_more

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence
    from typing import Unpack

    import numpy.typing as npt

    from ._arguments import Size
    from ._on_device import OnDevice
    from ._types import DepthKind, Levels, Output
    from .mesh import MeshLike
    from .methods.occlusion_map import MapResult, OcclusionMap
    from .options import CullKeywords, CullOptions, MeshLods, OptionKeywords
    from .progress import ProgressLike
    from .result import CullResult
    from .tolerance import Tolerance
    from .views import _AmongLike

__all__ = ["Device"]

#: How many tables of meshes a device keeps for further culls.
_TABLES_KEPT = 4


class Device(StaysInProcess):
    """A device of the GPU, or of a software driver, with its queue and pipelines.

    Parameters
    ----------
    adapter : str or int, optional
        Which adapter: its index in `adapters`, or a part of its name or of its driver's
        (``"lavapipe"``).
        None takes the environment variable ``HIZVK_ADAPTER``, which says it in the same way.
        Without the variable it is the best adapter, GPUs first.

    Raises
    ------
    NoAdapterError
        Without such an adapter.
        The error lists the adapters and says how to choose one.
        If there is none, it has the line that installs a software driver.
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Notes
    -----
    **Processes.** When the interpreter ends, every device is waited for and destroyed.
    That holds also where modules still hold results, or where daemon threads cull.
    A later call gets a `HizError`, such as one in a function of `atexit` that was registered before
    this package was imported.

    **Forks.** No device works in a forked child.
    There every object of the parent's devices raises a `HizError` when it needs the device.
    Lengths, ``repr`` and arrays that were read before still work.
    Make a `Device` in the child, as `visible` without ``device=`` does, or use
    ``multiprocessing.get_context("spawn")``.

    A fork waits until the calls of other threads are done, so that no lock of the driver is held in
    the child.
    A forked child ends without its parent's C exit handlers, because those of drivers would wait
    for threads that the child does not have.

    **Threads.** Any number may use one device, or devices of their own.
    """

    @_arguments.explained()
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
            self._engine = CoreEngine(adapter)
        self._tables: list[tuple[Sequence[MeshLods], CoreMeshTable]] = []

    @property
    def adapter(self) -> Adapter:
        """The adapter that it runs on."""
        return Adapter(*self._engine.adapter())

    @property
    def max_image_side(self) -> int:
        """The largest height or width of a depth image on this device."""
        return self._engine.max_image_side()

    @_arguments.explained()
    def instances(
        self,
        bounds: Bounds,
        *,
        strict: bool = False,
        order: StoredOrder = "morton",
        mesh_ids: npt.ArrayLike | None = None,
        scales: npt.ArrayLike | None = None,
    ) -> Instances:
        """Uploads bounds, once for any number of culls.

        Neighbours in space are stored together, in groups of 64 with a box around each.
        Neighbours meet the same pixels, and what hides the box hides the group.
        Masks, indices and `CullResult.explain` number the instances as they came, whatever the
        stored order.
        On the device an instance takes its record and its share of the box of its group
        (`Instances.device_bytes`).
        The record has 32 bytes for a sphere, 48 for a box and 64 for an oriented box.
        That of a point has 16, or 32 if float32 does not hold every position.

        Parameters
        ----------
        bounds : Spheres, Boxes, OrientedBoxes or Points
            The bounds of the instances.
            Positions may be float64; they are split so that nothing is lost far from the origin.
        strict : bool
            True refuses invalid bounds (NaN, infinite, a negative size, min > max).
            False keeps them visible; `Instances.invalid` lists and `CullStats.invalid` counts them.
        order : "morton" or "given"
            How they are stored.
            ``"morton"``: sorted along a curve through space (Morton 1966); the upload sorts once.
            ``"given"``: as they come, for arrays that are in such an order already.
            This needs no sort, and 8 bytes less per instance on the host.
        mesh_ids : (N,) integer array, optional
            The mesh of each instance, 0 to 65535, or `hizvk.ABSENT`.
            A cull with ``meshes=`` sorts what it keeps by them.
            An absent instance is never kept, and the box of its group does not contain it.
            Updates replace bounds alone: upload again to change a mesh id.
            None: all have mesh 0.
        scales : (N,) float array, or a number; optional
            By how much the mesh of each instance is scaled, along the axis where it is most.
            `hizvk.LodByError` multiplies the errors of levels of detail by it.
            None: 1 for each.

        Raises
        ------
        TypeError, ValueError
            For other objects, or invalid bounds with ``strict=True``.
            They name the parameter, what it expects and what came.
        LimitError, OutOfMemoryError
            If the device cannot hold them.
        """
        kind, arrays = as_arrays("bounds", bounds)
        strict = _arguments.flag("strict", strict)
        stored_order = _arguments.choice("order", order, words(StoredOrder))
        ids = None if mesh_ids is None else _arguments.mesh_ids("mesh_ids", mesh_ids, len(bounds))
        sizes = (
            None if scales is None else _arguments.floats_or_scalar("scales", scales, len(bounds))
        )
        uploaded = self._engine.instances(kind, arrays, (strict, stored_order), ids, sizes)
        return Instances(self, uploaded, points=are_points(bounds), bounds=bounds)

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

    @_arguments.explained()
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
        vertices : (V, 3) float array; or a Mesh, or a list of them
            World positions, or with `transforms` those of the mesh's own space.
            A mesh of trimesh, Open3D or PyVista will do as a `Mesh` does (`Mesh.of`).
            A scene of trimesh stands for its meshes, placed by its transforms.
            A list may also hold tuples ``(vertices, triangles)`` or
            ``(vertices, triangles, transforms)``.
        triangles : (T, 3) integer array
            Indices of vertices; left out when `vertices` is a mesh or a list.
        transforms : (K, 4, 4) or (4, 4) float array, optional
            ``world_from_mesh`` of each copy; not beside a Mesh or a list, which have their own.
        cull : "none", "back" or "front"
            Which faces are left out; a front face runs counter-clockwise in the image.
            For closed meshes that are wound so, ``"back"`` draws the same depth for less, because a
            ray enters such a mesh by a front face.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        LimitError, OutOfMemoryError
            If the device cannot hold them.
        """
        meshes = as_meshes(vertices, triangles, transforms)
        cull_mode = _arguments.choice("cull", cull, words(FaceCull))
        raw = [(mesh.vertices, mesh.triangles, mesh.transforms) for mesh in meshes]
        return Occluders(self, self._engine.occluders(raw, cull_mode))

    @overload
    def render_depth(
        self,
        occluders: Occluders,
        camera: Camera,
        *,
        size: Size | None = None,
        conservative: bool = False,
        refinement: int = 2,
        rasteriser: Rasteriser = "auto",
        into: None = None,
        only: CullResult | PassResult | npt.ArrayLike | None = None,
        max_triangles: int | None = None,
        max_occluders: int | None = None,
        progress: ProgressLike = None,
    ) -> DepthImage: ...

    @overload
    def render_depth(
        self,
        occluders: Occluders,
        camera: Camera | None = None,
        *,
        into: DepthImage,
        only: CullResult | PassResult | npt.ArrayLike | None = None,
        max_triangles: int | None = None,
        max_occluders: int | None = None,
    ) -> tuple[int, int, int, int] | None: ...

    @_arguments.explained()
    def render_depth(
        self,
        occluders: Occluders,
        camera: Camera | None = None,
        *,
        size: Size | None = None,
        conservative: bool = False,
        refinement: int = 2,
        rasteriser: Rasteriser = "auto",
        into: DepthImage | None = None,
        only: CullResult | PassResult | npt.ArrayLike | None = None,
        max_triangles: int | None = None,
        max_occluders: int | None = None,
        progress: ProgressLike = None,
    ) -> DepthImage | tuple[int, int, int, int] | None:
        """Renders occluders into a depth image that stays on the device.

        **The plain image** is rasterised: it knows the depth at the pixels' centres.
        Rasterisers move corners to a grid: the host's and lavapipe's to 1/256 pixel, and no driver
        to more than 1/16.
        A cull by it promises for an image of that size and those samples, with two limits:

        - A larger image of the same view, multisampling or jitter may show a gap that no centre
          hit, with something behind it that was culled.
        - It hides points that lie on their own occluder, because between two centres the surface
          may be farther than at one of them: of the visible vertices of the meshes in
          ``docs/guide.md``, 44 to 47 %.

        **The conservative image** promises for every image of the same view, whatever its size,
        sample positions and jitter, and hides none of a mesh's own visible vertices.
        Every ray through the closed square of a pixel meets an occluder at the pixel's depth or
        nearer.
        Where that cannot be shown, the pixel is far.

        So it can be small: a cull by it with ``coverage="area"``, the default, never hides what can
        be seen in a large image.
        The proof is about the exact triangles, float64 positions included, for any mesh: open,
        folded, intersecting itself or wound the wrong way.
        Cracks between triangles that do not share exact positions of vertices count as gaps.

        Parameters
        ----------
        occluders : Occluders
            Of this device.
        camera : Camera
            The view; left out with `into`, which has its own.
        size : (height, width), optional
            Another image size for the same view.
            The image's camera is then ``camera.resized(size)``.
            The cull promises for that image, or with `conservative` for every image of the view.
        conservative : bool
            True makes the conservative image, on the host in float64, and uploads it.
            It takes time: tens of milliseconds for tens of thousands of triangles in 256x144
            pixels, and more in larger images.
            Pixels at silhouettes have the depth of what is behind.
            ``docs/occluders.md`` has the proof and measurements.
        refinement : int
            For `conservative`, 0..8: how often a pixel is quartered where no surface covers all of
            it.
            Each step finds a little more and costs time at silhouettes; any number is safe.

        rasteriser : "auto", "device" or "host"
            What draws the plain image.
            ``"device"`` is the device's own render pass.
            ``"host"`` draws on all cores and uploads; software drivers take 4 to 12 times as long.
            ``"auto"`` takes the host's for devices that are processors, and the device's for GPUs.
            ``docs/occluders.md`` says what each promises.
        into : DepthImage, optional
            Draws more occluders into this image, which `render_depth` has made, and returns the
            rectangle that was touched.
            Build its pyramid again afterwards.
        only : CullResult, PassResult, (K,) bool array or integer array, optional
            Which of the K copies of meshes are drawn: all that a cull kept or a pass of `Temporal`
            names, a mask, or numbers.
            Copies are numbered through all meshes, in the order of the upload.
            So upload the copies' bounds as instances in that order.
        max_triangles : int, optional
            At most so many triangles are drawn.
            Clusters of neighbouring triangles are chosen by their solid angle per triangle.
            The host's rasteriser remembers the last drawing of these occluders with a limit.
            It begins with those that were not hidden then, and those that were come last.
            Each occluder that is left out costs hiding, and hidden ones cost little time anyway.
        max_occluders : int, optional
            At most so many copies of meshes are drawn: those that are largest in the image.
        progress : bool or function, optional
            As everywhere (`hizvk.progress`), for `conservative`; the image is one step.

        Returns
        -------
        DepthImage
            A new image; with `into` none.
        (x0, y0, x1, y1) : tuple of four int, or None
            With `into`: the rectangle around what was drawn, both ends included, row 0 on top.
            No pixel outside of it has changed.
            None if nothing was drawn.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        LimitError, OutOfMemoryError
            If the image is larger than the device allows.

        References
        ----------
        Akenine-Moller and Aila, "Conservative and tiled rasterization using a modified triangle
        set-up" (2005): when one triangle covers a pixel.
        The step to whole surfaces is this library's own.
        """
        return rendered(
            self,
            occluders,
            camera,
            size=size,
            conservative=conservative,
            refinement=refinement,
            rasteriser=rasteriser,
            into=into,
            drawing=(only, max_triangles, max_occluders),
            progress=progress,
        )

    @overload
    def pyramid(
        self,
        depth: DepthImage,
        camera: None = None,
        *,
        kind: None = None,
        scale: float = 1.0,
        invalid: None = None,
        tolerance: None = None,
        levels: Levels = None,
        depths: Depths = "farthest",
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
        tolerance: Tolerance | None = None,
        levels: Levels = None,
        depths: Depths = "farthest",
    ) -> Pyramid: ...

    @_arguments.explained()
    def pyramid(
        self,
        depth: Any,
        camera: Camera | None = None,
        *,
        kind: DepthKind | None = None,
        scale: float = 1.0,
        invalid: Collection[float] | None = None,
        tolerance: Tolerance | None = None,
        levels: Levels = None,
        depths: Depths = "farthest",
    ) -> Pyramid:
        """Builds the depth pyramid of a depth image.

        Parameters
        ----------
        depth : DepthImage or (height, width) array, or (height, width, samples)
            A rendered image of this device, alone; or an array, with `camera` and `kind`.
            Arrays are float, or uint16 for the kinds ``"z"`` and ``"distance"``.
            Row 0 is the top of the image.
            With 2, 4, 8 or 16 samples per pixel the farthest one counts, and the nearest in the
            nearest end.
            A sample with "no data" makes its pixel far, and a cull takes ``coverage="area"`` alone.
            What is masked in a masked array is "no data".

            A cull allows for what the dtype may have rounded:

            - float16: 2^-10 of each number, and 2^-24.
            - float32 of the kinds ``"z"`` and ``"distance"``: 2^-24 of each number.
            - Whole numbers and float64 count as exact.
        camera : Camera
            The camera that saw the array; its size is the array's shape.
        kind : {"ndc", "reversed_ndc", "z", "distance"}
            What the array's numbers are; there is no default, because a wrong guess hides things.

            - ``"ndc"``: depth buffer values, 0 near and 1 far (a camera with ``reversed_z=False``).
            - ``"reversed_ndc"``: depth buffer values, 1 near and 0 far (``reversed_z=True``).
            - ``"z"``: depth along the view direction in world units.
            - ``"distance"``: distance to the eye along the pixel's ray in world units.

            "No data" counts as infinitely far.
            It is NaN, the numbers of `invalid`, and what lies outside the camera's planes.
            For ``"z"`` and ``"distance"`` it is zero and negative numbers, too.
            An orthographic camera with ``near < 0`` is the exception: it sees behind its eye, so
            negative numbers and a float zero are depth.

            Infinity is far, too: for ``"z"`` and ``"distance"`` it means that nothing is there.
            List it in `invalid` where it means "no data".
        scale : float
            World units of one step, for the kinds ``"z"`` and ``"distance"``: 0.001 for
            millimetres.
        invalid : collection of float, optional
            Which numbers of the array mean "no data", in its own units, before `scale`.
            None: those that are usual for its dtype, which are 0 and 65535 for uint16, 65504 (the
            greatest) for float16, and none for float32 and float64.
            ``()``: none beside those that never are depth.
        tolerance : Tolerance, optional
            How far the depths of the array may be off, in the world.
            The upload moves them away from the eye by so much, and the promise holds for the moved
            image.
            None: they stay where they are.
        levels : int or pair of int, optional
            Which levels are built, of 1 to 15; level 0, the image itself, is always there.

            - None: all.
            - ``2``: level 2 and all coarser ones.
            - ``(2, 5)``: levels 2 to 5.
            - ``(4, 4)``: level 4 alone, made in one pass.

            Numbers past the coarsest level, which is one texel, mean that level.

            Fewer levels are built faster and take less memory.
            Nothing is hidden wrongly, but more is kept, because a test reads the next coarser level
            that is stored.
            Bounds that span more texels of the coarsest level than the footprint has are kept,
            unless a descent may read that many.
            Level 1 costs most to build; bounds of one or two pixels read the image itself.
            ``hizvk bench`` measures both sides.
        depths : {"farthest", "nearest", "both", "receivers"}
            Which depths of each block are stored, beside level 0.

            - ``"farthest"``: what a cull needs to hide.
            - ``"both"``: the nearest, too, in the same pass.
              A cull then also tells what surely shows (`UNOCCLUDED`).
            - ``"nearest"``: these alone; no cull takes such a pyramid.
            - ``"receivers"``: both, of the pixels that show a receiver of shadows.
              Culls of shadow casters take it, and no others do.

            The ends differ in what "no data" counts as: far in the farthest, near in the nearest.
            For ``"z"`` and ``"distance"`` infinity and what lies beyond the far plane are far in
            both: they are farther than all that is in the view.

            For ``"receivers"`` background is left out: pixels with exactly the depth of far, which
            is what a depth buffer is cleared to.
            "No data" is no background: its block has far as farthest and near as nearest depth.
            A block without any receiver has near as farthest and far as nearest depth.
            Depths of the kinds ``"z"`` and ``"distance"`` never are background.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        LimitError, OutOfMemoryError
            If the image is larger than the device allows.

        Examples
        --------
        >>> import numpy as np, hizvk
        >>> device = hizvk.Device()
        >>> camera = hizvk.Camera.look_at(
        ...     (0, 0, 9), (0, 0, 0), fov_y_deg=60, size=(2, 4), near=1.0, reversed_z=True
        ... )
        >>> depth = np.float32([[0.5, 0.25, 0, np.nan], [0.25, 0.25, 0.125, 0.125]])
        >>> hiz = device.pyramid(depth, camera, kind="reversed_ndc", depths="both")
        >>> hiz.level(1, end="farthest").tolist()
        [[0.25, 0.0]]
        >>> hiz.level(1, end="nearest").tolist()
        [[0.5, 1.0]]
        """
        stored = _arguments.stored_levels("levels", levels)
        _arguments.choice("depths", depths, words(Depths))
        if isinstance(depth, DepthImage):
            given = {"camera": camera, "kind": kind, "invalid": invalid, "tolerance": tolerance}
            return of_image(self, depth, stored, depths, scale=scale, **given)
        camera = _arguments.instance("camera", camera, Camera, "a Camera beside an array of depth")
        check_side(self, camera)
        samples = checked_samples("depth", depth, camera, kind, scale, invalid, tolerance)
        return of_arrays(self, samples, camera, stored, invalid, depths)

    def receiver_mask(
        self,
        depth: DepthImage | npt.ArrayLike,
        camera: Camera,
        light_camera: Camera,
        *,
        kind: DepthKind | None = None,
        filter_radius: float = 0.0,
        reach_px: float = 0.5,
        depth_slack: float = 2.0**-21,
        depth_slack_abs: float = 0.0,
    ) -> DepthImage:
        """The farthest receivers that a camera sees, as a depth image of a light.

        It is for spot lights and for the faces of point lights.
        A pyramid of the result is what casters are culled by, as anything is:
        ``device.cull(casters, light_camera, device.pyramid(mask))``.
        A culled caster shadows nothing that the camera sees (``docs/shadows.md``).

        Parameters
        ----------
        depth : DepthImage, or (height, width) array
            The depth of all that receives shadows, with one sample per pixel.
            Exactly far means background; a pixel without a valid depth keeps every caster.
        camera : Camera
            The camera that saw it.
        light_camera : Camera
            Of the shadow map, or with another size: the finer, the more is culled.
        kind : {"ndc", "reversed_ndc", "z", "distance"}
            What an array's numbers are; None beside a DepthImage.
        filter_radius : float
            How far from a point the lookup of its shadow reaches, in world units: the radius of the
            filter's kernel, the diagonal of a texel of the shadow map, and the bias, added.
        reach_px : float
            How far from its pixel's centre a receiver may lie along each axis, at the pixel's
            depth: a multiple of 1/256 from 0 to 16.
            0.5 covers the whole pixel.
        depth_slack, depth_slack_abs : float
            How far depths may be off, relative to them and in units of NDC depth, 0 to 0.5.

        Returns
        -------
        DepthImage
            Of the light's camera.
            A texel without a receiver is at the near plane.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        LimitError, OutOfMemoryError
            If the image is larger than the device allows.

        Examples
        --------
        A camera and a spot light look at a wall at z = -10.
        A box before the wall shadows it, and a box behind the wall does not.

        >>> import numpy as np, hizvk
        >>> device = hizvk.Device()
        >>> view = {"fov_y_deg": 60, "near": 0.1}
        >>> camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), size=(32, 32), **view)
        >>> light = hizvk.Camera.look_at((3, 0, 0), (0, 0, -10), size=(64, 64), **view)
        >>> wall = np.full((32, 32), 10.0, np.float32)
        >>> mask = device.receiver_mask(wall, camera, light, kind="z", filter_radius=0.1)
        >>> casters = device.instances(hizvk.Spheres([[2, 0, -5], [0, 0, -15]], [0.5, 0.5]))
        >>> device.cull(casters, light, device.pyramid(mask)).mask
        array([ True, False])
        """
        return receivers(
            self,
            depth,
            camera,
            light_camera,
            kind=kind,
            filter_radius=filter_radius,
            reach_px=reach_px,
            slacks=(depth_slack, depth_slack_abs),
        )

    @overload
    def cull(
        self,
        instances: Instances,
        camera: Camera,
        pyramid: Pyramid,
        options: CullOptions | None = None,
        outputs: Outputs | Collection[Output] | None = None,
        *,
        among: _AmongLike | None = None,
        wait: bool = True,
        **keywords: Unpack[CullKeywords],
    ) -> CullResult: ...

    @overload
    def cull(
        self,
        instances: Instances,
        camera: Sequence[Camera],
        pyramid: Sequence[Pyramid],
        options: CullOptions | None = None,
        outputs: Outputs | Collection[Output] | None = None,
        *,
        among: _AmongLike | None = None,
        wait: bool = True,
        **keywords: Unpack[CullKeywords],
    ) -> ViewsResult: ...

    def cull(
        self,
        instances: Instances,
        camera: Camera | Sequence[Camera],
        pyramid: Pyramid | Sequence[Pyramid],
        options: CullOptions | None = None,
        outputs: Outputs | Collection[Output] | None = None,
        *,
        among: _AmongLike | None = None,
        wait: bool = True,
        **keywords: Unpack[CullKeywords],
    ) -> CullResult | ViewsResult:
        """Tests instances against a pyramid. What could be seen in the depth image is never culled.

        Parameters
        ----------
        instances : Instances
            Of this device.
        camera : Camera, or a sequence of V cameras
            The camera of the pyramid: `Pyramid.camera`, or one equal to it.
            Several cameras cull in one submission, with one readback: the eyes of a headset, the
            faces of a cube map, the cascades of a shadow.
        pyramid : Pyramid, or a sequence of V pyramids
            Of this device; one for each camera, of its own depth.
            Sizes and conventions may differ.
        options : CullOptions, optional
            How the cull decides; None takes the defaults.
        outputs : Outputs, or a collection of names, optional
            What the cull makes: less costs less.
            A collection names all that is made: "mask", "verdicts", "indices", "draws", "pixels".
            None makes mask and verdicts, and the list and the draw arguments by the time that they
            are read.
            For several cameras indices and draws are those of what any of them keeps, and made only
            if they are named here.
        among : (N,) bool array, CullResult, ViewsResult or PassResult; optional
            The instances that are asked for: a mask, what an earlier cull of them has kept, what
            any of its views has kept, or what a pass of `Temporal` draws.
            The result of an earlier cull stays on the device, and it must have a mask.
            All others are not kept, their verdict is `Verdict.OUTSIDE`, and they cost no test.
            None: all.
        wait : bool
            How the answer comes to the host; the call itself does not wait for it in either case.

            - True: each read waits for the device, then copies.
            - False: the cull's own submission copies all that `outputs` names.
              `CullResult.ready` says whether it has arrived, and then no read waits.
              ``await result`` lets an event loop go on meanwhile.

            At most two culls with ``wait=False`` are unfinished at a time.
            A third one waits in this call, without the interpreter lock, until the oldest is done.
            A result that was dropped counts no more.
        **keywords
            Any field of `CullOptions`, and of `Outputs` `pixel_budget`, `capacity`, `draw`,
            `meshes`, `emit` and `placement`.
            They take the place of those fields of `options` and `outputs`:
            ``cull(crowd, camera, hiz, order="any", capacity=1000)``.

        Returns
        -------
        CullResult, or ViewsResult for several cameras
            The cull is recorded and submitted; reading the result waits for it.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came; also for a camera other than the
            pyramid's.
        LimitError, OutOfMemoryError
            If the device cannot hold the outputs.
        """
        owned("instances", instances, Instances, *SOME_INSTANCES, device=self)
        options, outputs = cull_request(options, outputs, keywords, self.cull)
        wait = wait is True or _arguments.flag("wait", wait)
        restriction = None if among is None else among_of(among, instances, self)
        request = options, outputs, restriction, wait
        if isinstance(camera, Camera):
            table = None if outputs.meshes is None else self._mesh_table(outputs.meshes)
            return culled(self, instances, camera, pyramid, *request, table)
        return culled_views(self, instances, camera, pyramid, *request)

    def cull_approximate(
        self,
        instances: Instances,
        camera: Camera,
        pyramid: Pyramid,
        options: CullOptions | None = None,
        *,
        negligible_px: int,
        **keywords: Unpack[OptionKeywords],
    ) -> ApproximateResult:
        """Culls what is hidden, and what can show in at most a few pixels.

        It counts the pixels of every instance first, so it takes longer than `cull`.
        It pays where what is kept is expensive to draw.

        Parameters
        ----------
        instances : Instances
            Of this device.
        camera : Camera
            The camera of the pyramid.
        pyramid : Pyramid
            Of this device.
        options : CullOptions, optional
            How the cull decides; None takes the defaults.
        negligible_px : int
            An instance is culled if it can show in at most so many pixels, 0 to 2^32 - 1.
        **keywords
            Any field of `CullOptions`; they take the place of those fields of `options`.

        Returns
        -------
        ApproximateResult
            `ApproximateResult.pixels_lost` bounds the pixels by which a picture can differ.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        LimitError, OutOfMemoryError
            If the device cannot hold the counts.
        """
        owned("instances", instances, Instances, *SOME_INSTANCES, device=self)
        _arguments.instance("camera", camera, Camera, "a Camera")
        checked_pyramid(self, camera, pyramid)
        options = cull_options(options, keywords, self.cull_approximate)
        negligible = _arguments.integer("negligible_px", negligible_px, low=0, high=2**32 - 1)
        check_coverage(options, pyramid)
        culling = self._engine.cull_approximate(
            instances._inner,
            camera._inner,
            pyramid._inner,
            options,
            Outputs(verdicts=False),
            negligible,
        )
        return ApproximateResult(self, culling, negligible)

    def occlusion_map(
        self,
        occluders: Occluders,
        camera: Camera,
        *,
        size: Size = (256, 256),
        least: int = 4,
        regions: int = 64,
        max_triangles: int | None = None,
        max_occluders: int | None = None,
    ) -> OcclusionMap:
        """Makes hierarchical occlusion maps, for comparison with a pyramid; on all cores.

        Nothing that they hide is certified: `cull_map` says what it may lose.
        ``docs/methods.md`` compares both.

        Of the occluders in the frustum the largest and nearest are drawn, as far as the limits go.
        `select_occluders` makes a database of occluders out of all meshes, before any view.

        Parameters
        ----------
        occluders : Occluders
            Of this device.
        camera : Camera
            The view; its own image size does not matter.
        size : (height, width)
            Of the finest map: powers of two.
        least : int
            The shorter side of the coarsest map: a power of two.
        regions : int
            Regions along each side of the depth-estimation buffer: a power of two.
        max_triangles : int, optional
            At most so many triangles are drawn; None: all in the frustum.
        max_occluders : int, optional
            At most so many copies of meshes are drawn.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.

        References
        ----------
        Zhang, Manocha, Hudson and Hoff, "Visibility culling using hierarchical occlusion maps"
        (1997).
        """
        from .methods.occlusion_map import made

        return made(
            self,
            occluders,
            camera,
            size=size,
            least=least,
            regions=regions,
            max_triangles=max_triangles,
            max_occluders=max_occluders,
        )

    def cull_map(
        self,
        bounds: Bounds,
        camera: Camera,
        maps: OcclusionMap,
        *,
        negligible_px: int = 0,
        copies: npt.ArrayLike | None = None,
    ) -> MapResult:
        """Culls by hierarchical occlusion maps; what it culls is not certified.

        An instance is culled if the maps cover its rectangle, and it lies behind the boxes of all
        occluders in the regions that it meets.
        With ``negligible_px=0`` no centre of the maps' pixels shows it.
        A larger image may still show it beside an occluder, and holes that are called negligible
        may show it, too.

        Parameters
        ----------
        bounds : Spheres, Boxes, OrientedBoxes or Points
            The bounds of the instances.
            A sphere is tested as the box around it.
        camera : Camera
            The view of the maps, in any size.
        maps : OcclusionMap
            Of this device.
        negligible_px : int
            A hole of so many pixels of the finest map counts as covered, 0 to 2^32 - 1.
        copies : (N,) integer array, optional
            Which copy of an occluding mesh each instance is, or `hizvk.ABSENT`.
            Those that the maps have drawn are kept without a test.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        from .methods.occlusion_map import culled

        return culled(self, bounds, camera, maps, negligible_px=negligible_px, copies=copies)

    def temporal(self, instances: Instances, *, early_capacity: int | None = None) -> Temporal:
        """Makes the two passes of a view, which draw each frame what was visible, then the rest.

        Make one for each view; `Temporal` says how a frame goes, and has an example.

        Parameters
        ----------
        instances : Instances
            Of this device.
            They may be updated between frames.
        early_capacity : int, optional
            The most instances that an early pass draws, 0 to 2^32 - 1; None: all that it names.
            What exceeds it is drawn by the late pass, if it is visible.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        OutOfMemoryError
            If the device cannot hold the masks.
        """
        _arguments.instance("instances", instances, Instances, *SOME_INSTANCES)
        check_owner("instances", instances, self)
        if early_capacity is not None:
            high = 2**32 - 1
            early_capacity = _arguments.integer("early_capacity", early_capacity, low=0, high=high)
        passes = CoreTwoPasses(self._engine, instances._inner, early_capacity)
        return Temporal(self, passes, instances)

    def warm_up(
        self,
        instances: Instances,
        camera: Camera,
        options: CullOptions | None = None,
        outputs: Outputs | Collection[Output] | None = None,
        *,
        occluders: Occluders | None = None,
        levels: Levels = None,
        depths: Depths = "farthest",
        two_passes: bool = False,
        samples: int = 1,
        views: int = 1,
        **keywords: Unpack[CullKeywords],
    ) -> None:
        """Compiles what frames with these options need, before the first of them.

        Without it the first frame compiles: that takes tenths of a second, or milliseconds where
        the driver finds its compiled shaders on disk.
        Afterwards the first frame takes as long as the later ones, and its
        `CullStats.compile_ms` is 0.

        The call runs a whole frame and waits for it: a depth image, its pyramid, a cull, and the
        reads of what it makes.
        It also compiles `Instances.update`, and changes no instance.
        Call it once for each set of options, for each kind of bounds and for depth from either
        source.
        What matters of the numbers is compiled as well: how many instances there are decides
        whether groups are tested, and the image size how a pyramid is built.

        Parameters
        ----------
        instances : Instances
            Of this device: those of the frames, or as many of the same kind.
        camera : Camera
            One like those of the frames: with their image size and their direction of depth
            (``reversed_z``), and left-handed if they are.
        options, outputs, **keywords
            As for `cull`.
        occluders : Occluders, optional
            Of this device; then the depth of the frames is rendered (`render_depth`).
            None: it comes from arrays.
        levels, depths
            As for `pyramid`.
        two_passes : bool
            Whether frames have two passes (`temporal`), with `options` in the late one.
        samples : int
            How many samples per pixel the arrays of depth have: 1, 2, 4, 8 or 16.
        views : int
            How many cameras one call of `cull` has, 1 to 256.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        LimitError, OutOfMemoryError
            If the device cannot hold such a frame.

        Examples
        --------
        >>> import numpy as np, hizvk
        >>> device = hizvk.Device()
        >>> crowd = device.instances(hizvk.Spheres(np.zeros((1000, 3)), 0.5))
        >>> camera = hizvk.Camera.look_at(
        ...     (0, 0, 9), (0, 0, 0), fov_y_deg=60, size=(90, 160), near=0.1
        ... )
        >>> device.warm_up(crowd, camera, outputs=["mask"])
        >>> pyramid = device.pyramid(np.full(camera.size, 20.0), camera, kind="z")
        >>> device.cull(crowd, camera, pyramid, outputs=["mask"]).count
        1000
        """
        _arguments.instance("instances", instances, Instances, *SOME_INSTANCES)
        check_owner("instances", instances, self)
        _arguments.instance("camera", camera, Camera, "a Camera")
        check_side(self, camera)
        if occluders is not None:
            expected = "Occluders of Device.occluders or None"
            _arguments.instance("occluders", occluders, Occluders, expected)
            check_owner("occluders", occluders, self)
        stored = _arguments.stored_levels("levels", levels)
        _arguments.choice("depths", depths, words(Depths))
        drawn = None if occluders is None else occluders._inner
        more = checked_more(two_passes, samples, views, is_drawn=drawn is not None)
        options, outputs = cull_request(options, outputs, keywords, self.warm_up)
        self._engine.warm_up(
            instances._inner,
            camera._inner,
            drawn,
            (stored, depths),
            options,
            outputs,
            self._mesh_table(outputs.meshes),
            more,
        )

    def _mesh_table(self, meshes: Sequence[MeshLods] | None) -> CoreMeshTable | None:
        """The table of these meshes on this device, made anew if it is not among the last ones."""
        if meshes is None:
            return None
        # Equal tuples of the same objects are found without a look at their numbers.
        for known, table in self._tables:
            if known == meshes:
                return table
        table = self._engine.mesh_table([mesh._raw() for mesh in meshes])
        self._tables = [*self._tables[1 - _TABLES_KEPT :], (meshes, table)]
        return table

    def timed(self) -> StageTimes:
        """Times the stages that run in a ``with`` block: raster, reduction, cull, list, update.

        Each stage then has a pass of its own, so a frame takes a little longer.
        Without the block nothing is timed, and nothing is paid.

        The first block checks the device's timestamps against known work and the host's clock.
        Where they cannot be trusted, `StageTime.gpu_ms` is None; `StageTimes.wall_ms` is always
        there.
        So it is on Mesa's llvmpipe 22: it stamps a render pass, and what follows, when it flushes.

        Only one block of a device may be open at a time; it counts what other threads submit, too.
        `CullStats` of a cull in the block has ``gpu_ms`` and ``stages`` of this cull.

        Returns
        -------
        StageTimes
            To be used in ``with``; the numbers are there after the block.

        Raises
        ------
        ValueError
            On entry, if another block is open.

        Examples
        --------
        >>> import numpy as np, hizvk
        >>> device = hizvk.Device()
        >>> crowd = device.instances(hizvk.Spheres(np.zeros((1000, 3)), 0.5))
        >>> camera = hizvk.Camera.look_at(
        ...     (0, 0, 9), (0, 0, 0), fov_y_deg=60, size=(90, 160), near=0.1
        ... )
        >>> with device.timed() as times:
        ...     pyramid = device.pyramid(np.full(camera.size, 20.0), camera, kind="z")
        ...     seen = device.cull(crowd, camera, pyramid, outputs=["mask"])
        >>> [one.stage for one in times.stages]
        ['reduce', 'cull']
        >>> times.wall_ms > 0.0, times.gpu_ms is None or times.gpu_ms > 0.0
        (True, True)
        """
        return StageTimes(self)

    def wait(self) -> None:
        """Waits until everything that was submitted is done."""
        self._engine.wait()

    def __repr__(self) -> str:
        return f"<Device {self.adapter}>"


def maker_of(thing: OnDevice[Any]) -> Device:
    """The device that made an object, by its full type."""
    device = thing.device
    assert isinstance(device, Device)
    return device
