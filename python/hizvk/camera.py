"""The camera: how world positions project, into which image, in which depth convention.

Conventions are named constructors, never guessed.
Matrices are C-order ``(4, 4)`` for column vectors: ``clip = M @ [x, y, z, 1]``.
Normalised device coordinates have x right, y up and z in 0..1.
Image sizes are ``(height, width)``, and row 0 is the top of the image.

The numbers are float64 from here to the engine, which subtracts the eye before it rounds to
float32.
So world positions of millions of metres are fine.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from . import _arguments, _camera_arguments, camera_hints
from ._core import Camera as CoreCamera
from ._core import frustum_matrix
from .projection import Projected, projected

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Self

    import numpy.typing as npt

    from ._arguments import Size
    from ._camera_arguments import Image, Pose
    from ._types import DepthKind, PixelCenter

__all__ = ["Camera"]


class Camera:
    """An immutable camera with an image size; made by one of its named constructors.

    ======================  ======================================================================
    `Camera.look_at`        perspective, from an eye towards a target
    `Camera.frustum`        perspective, off-centre
    `Camera.orthographic`   parallel projection
    `Camera.from_opencv`    an intrinsic matrix K; the camera looks along +z, y down
    `Camera.from_colmap`    a COLMAP model with its parameters, and the pose of an image
    `Camera.from_opengl`    the camera looks along -z, y up: an OpenGL projection, K or an angle
    `Camera.from_matrices`  matrices that already are in this library's conventions
    ======================  ======================================================================

    ``docs/conventions.md`` has the call for each of a dozen tools.
    A pose is a ``(4, 4)`` or ``(3, 4)`` matrix, or a pair ``(R, t)`` of ``(3, 3)`` and ``(3,)``,
    for column vectors.

    Cameras are equal if they project alike.
    They can be hashed, copied and pickled, and used from any thread.
    """

    __slots__ = ("_inner", "_recipe")

    _inner: CoreCamera
    _recipe: tuple[str, tuple[tuple[str, Any], ...]]

    def __init__(self) -> None:
        raise TypeError(
            "Camera() takes no arguments: use Camera.look_at, .frustum, .orthographic, "
            ".from_opencv, .from_colmap, .from_opengl or .from_matrices"
        )

    @classmethod
    def _made(cls, inner: CoreCamera, name: str, **arguments: Any) -> Self:
        """The camera around `inner`, and the call that makes it again (for `repr` and pickle)."""
        camera = cls.__new__(cls)
        object.__setattr__(camera, "_inner", inner)
        object.__setattr__(camera, "_recipe", (name, tuple(arguments.items())))
        return camera

    @classmethod
    def _posed(
        cls,
        name: str,
        seen: Mapping[str, Any],
        clip_from_camera: npt.NDArray[np.float64],
        pose: Pose,
        image: Mapping[str, Any],
        reversed_z: bool,
    ) -> Self:
        """The camera of a projection and a pose; constructor `name` takes `seen` and `image`."""
        direction, matrix = pose
        make = {
            "camera_from_world": CoreCamera.from_clip_from_camera,
            "world_from_camera": CoreCamera.from_clip_from_camera_pose,
        }[direction]
        inner = make(clip_from_camera.tolist(), matrix.tolist(), reversed_z, image["size"])
        return cls._made(inner, name, **seen, **{direction: matrix}, **image)

    # Constructors.

    @classmethod
    @_arguments.explained()
    def look_at(
        cls,
        eye: npt.ArrayLike,
        target: npt.ArrayLike,
        *,
        up: npt.ArrayLike = (0.0, 1.0, 0.0),
        fov_y_deg: float,
        size: Size,
        near: float,
        far: float | None = None,
        reversed_z: bool = True,
    ) -> Self:
        """A perspective camera at `eye` that looks at `target`.

        Parameters
        ----------
        eye, target : three numbers
            World positions.
        up : three numbers
            The direction that points to the top of the image; not parallel to the view direction.
            The default is +y.
            In a world whose z is up (Blender, CARLA, ROS, maps) pass ``(0, 0, 1)``, or the image
            comes out rolled.
            To look straight down, pass what shall be at the top, such as the heading, or north.
        fov_y_deg : float
            The full vertical angle of view in degrees, above 0 and below 180.
        size : (height, width)
            Pixels of the image; they are square.
        near, far : float
            Distances of the near and far plane along the view direction, ``0 < near < far``.
            ``far=None`` is infinitely far.
        reversed_z : bool
            True: depth 1 at the near plane and 0 at the far plane.
            False: 0 near, 1 far.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        view = _camera_arguments.view(eye, target, up)
        fov_y_deg = _camera_arguments.field_of_view("fov_y_deg", fov_y_deg)
        camera_hints.at_radians("fov_y_deg", fov_y_deg, stacklevel=3)
        image = _camera_arguments.perspective_image(size, near, far, reversed_z)
        inner = CoreCamera.perspective(**view, fov_y=math.radians(fov_y_deg), **image)
        return cls._made(inner, "look_at", **view, fov_y_deg=fov_y_deg, **image)

    @classmethod
    @_arguments.explained()
    def frustum(
        cls,
        eye: npt.ArrayLike,
        target: npt.ArrayLike,
        *,
        up: npt.ArrayLike = (0.0, 1.0, 0.0),
        left: float,
        right: float,
        bottom: float,
        top: float,
        size: Size,
        near: float,
        far: float | None = None,
        reversed_z: bool = True,
    ) -> Self:
        """An off-centre perspective camera.

        Examples are a tile of a larger image, one eye of a headset, and a shifted lens.

        Parameters
        ----------
        eye, target, up : three numbers
            As in `look_at`.
        left, right, bottom, top : float
            The borders of the image at view depth 1, ``left < right`` and ``bottom < top``.
            They are tangents of the angles to the view direction, x to the right and y up.
        size, near, far, reversed_z
            As in `look_at`.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        view = _camera_arguments.view(eye, target, up)
        left = _arguments.number("left", left)
        right = _arguments.number("right", right, above=left)
        bottom = _arguments.number("bottom", bottom)
        top = _arguments.number("top", top, above=bottom)
        image = _camera_arguments.perspective_image(size, near, far, reversed_z)
        inner = CoreCamera.frustum(**view, borders=(left, right, bottom, top), **image)
        borders = {"left": left, "right": right, "bottom": bottom, "top": top}
        return cls._made(inner, "frustum", **view, **borders, **image)

    @classmethod
    @_arguments.explained()
    def orthographic(
        cls,
        eye: npt.ArrayLike,
        target: npt.ArrayLike,
        *,
        up: npt.ArrayLike = (0.0, 1.0, 0.0),
        height: float,
        width: float | None = None,
        size: Size,
        near: float,
        far: float,
        reversed_z: bool = True,
    ) -> Self:
        """A camera with parallel rays along ``target - eye``.

        Parameters
        ----------
        eye, target, up : three numbers
            As in `look_at`.
        height, width : float
            What the image shows, in world units.
            ``width=None``: the pixels are square.
        size : (height, width)
            Pixels of the image.
        near, far : float
            The two planes, as distances from `eye` along the view direction; ``near < far``, both
            finite.
            `near` may be negative.
        reversed_z : bool
            As in `look_at`.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        view = _camera_arguments.view(eye, target, up)
        height = _arguments.number("height", height, above=0.0)
        size = _arguments.size("size", size)
        if width is None:
            width = height * size[1] / size[0]
        width = _arguments.number("width", width, above=0.0)
        near = _arguments.number("near", near)
        far = _arguments.number("far", far, above=near)
        reversed_z = _arguments.flag("reversed_z", reversed_z)
        borders = (-0.5 * width, 0.5 * width, -0.5 * height, 0.5 * height)
        image: Image = {"size": size, "near": near, "far": far, "reversed_z": reversed_z}
        inner = CoreCamera.orthographic(
            **view, borders=borders, near=near, far=far, reversed_z=reversed_z, size=size
        )
        return cls._made(inner, "orthographic", **view, height=height, width=width, **image)

    @classmethod
    @_arguments.explained(_camera_arguments.KEYWORDS)
    def from_opencv(
        cls,
        k: npt.ArrayLike,
        *,
        pixel_center: PixelCenter,
        camera_from_world: npt.ArrayLike | None = None,
        world_from_camera: npt.ArrayLike | None = None,
        size: Size,
        near: float,
        far: float | None = None,
        distortion: npt.ArrayLike | None = None,
        reversed_z: bool = True,
    ) -> Self:
        """A camera with OpenCV's axes: x right, y down, z forward.

        Parameters
        ----------
        k : (3, 3)
            ``[[fx, skew, cx], [0, fy, cy], [0, 0, 1]]`` in pixels.
        pixel_center : {"integer", "half"}
            Where `k` has the centre of the first pixel.
            There is no default: half a pixel too far hides what can be seen.

            ``"integer"``: at (0, 0), as in OpenCV, ROS, KITTI and Open3D's cameras.
            Here it is at (0.5, 0.5), so ``cx + 0.5`` and ``cy + 0.5`` are used.

            ``"half"``: at (0.5, 0.5), as in COLMAP, nerfstudio, gsplat, and wherever ``cx`` is half
            of the width (CARLA).
            `cx` and `cy` are used as they are.
        camera_from_world, world_from_camera : (4, 4), (3, 4) or a pair (R, t)
            The pose; pass exactly one.
            ``camera_from_world`` is OpenCV's ``[R | t]``: of ``solvePnP`` pass
            ``(cv2.Rodrigues(rvec)[0], tvec)``.
            ``world_from_camera`` is its inverse.
        size : (height, width)
            Pixels of the image that `k` belongs to.
            For a depth image of another resolution, take `resized` of the camera; the view stays.
        near, far, reversed_z
            As in `look_at`; view depth is the camera's z.
        distortion : array, optional
            Lens distortion coefficients: None or all zero.
            Others are refused, because a camera with distortion is not linear.
            Remap the depth image first, and pass the new camera matrix: use
            ``cv2.initUndistortRectifyMap`` and ``cv2.remap`` with ``cv2.INTER_NEAREST``.
            ``cv2.undistort`` interpolates, which makes depth that nothing has.
            A fisheye is not a pinhole, even with coefficients of 0 (``cv2.fisheye``).

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.

        Examples
        --------
        >>> import numpy as np, hizvk
        >>> k = [[500, 0, 320], [0, 500, 240], [0, 0, 1]]
        >>> hizvk.Camera.from_opencv(
        ...     k, pixel_center="half", camera_from_world=np.eye(4), size=(480, 640), near=0.1
        ... ).size
        (480, 640)
        """
        k = _camera_arguments.intrinsics(k)
        pixel_center = _camera_arguments.pixel_center(pixel_center)
        pose = _camera_arguments.one_pose(camera_from_world, world_from_camera)
        image = _camera_arguments.perspective_image(size, near, far, reversed_z)
        _camera_arguments.refuse_distortion(distortion)
        camera_hints.at_intrinsics(k, image["size"], stacklevel=3)
        projection = _pinhole(k, pixel_center, image)
        seen = {"k": k, "pixel_center": pixel_center}
        return cls._posed("from_opencv", seen, projection, pose, image, image["reversed_z"])

    @classmethod
    @_arguments.explained(_camera_arguments.COLMAP_KEYWORDS)
    def from_colmap(
        cls,
        model: str,
        params: npt.ArrayLike,
        *,
        qvec: npt.ArrayLike | None = None,
        tvec: npt.ArrayLike | None = None,
        camera_from_world: npt.ArrayLike | None = None,
        world_from_camera: npt.ArrayLike | None = None,
        size: Size,
        near: float,
        far: float | None = None,
        reversed_z: bool = True,
    ) -> Self:
        """A camera of a COLMAP model (cameras.txt and images.txt, or pycolmap).

        It has OpenCV's axes, and the first pixel's centre is at (0.5, 0.5): this is `from_opencv`
        with ``pixel_center="half"``.

        Parameters
        ----------
        model : str
            The camera's model, ``"PINHOLE"`` or ``"SIMPLE_PINHOLE"``; pycolmap's ``camera.model``
            will do.
            Models with distortion (``"SIMPLE_RADIAL"``, ``"OPENCV"``, ...) are taken if all of it
            is 0; a fisheye never is.
            The way out is COLMAP's ``image_undistorter``, whose cameras are ``PINHOLE``.
        params : (P,) numbers
            The model's parameters in COLMAP's order: ``fx, fy, cx, cy`` for ``PINHOLE``.
        qvec : (4,) numbers, optional
            The image's rotation from world to camera in the order of images.txt: **w, x, y, z**.
            pycolmap's ``rotation.quat`` is x, y, z, w: pass ``camera_from_world`` there.
            The camera has the float64 matrix that is formed from it.
        tvec : (3,) numbers, optional
            The translation that belongs to `qvec`.
            It is not the camera's position.
        camera_from_world, world_from_camera : (4, 4), (3, 4) or a pair (R, t), optional
            The pose instead of `qvec` and `tvec`; pycolmap's is
            ``camera_from_world=image.cam_from_world().matrix()``.
        size : (height, width)
            Pixels of the camera; COLMAP writes the width first.
        near, far, reversed_z
            As in `from_opencv`.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.

        Examples
        --------
        >>> import hizvk
        >>> camera = hizvk.Camera.from_colmap(
        ...     "SIMPLE_PINHOLE", [2559.81, 1536, 1152], qvec=[1, 0, 0, 0], tvec=[0, 0, 4],
        ...     size=(2304, 3072), near=0.1,
        ... )
        """
        model, params, k = _camera_arguments.colmap_intrinsics(model, params)
        pose = _camera_arguments.colmap_pose(qvec, tvec, camera_from_world, world_from_camera)
        image = _camera_arguments.perspective_image(size, near, far, reversed_z)
        camera_hints.at_intrinsics(k, image["size"], stacklevel=3)
        projection = _pinhole(k, "half", image)
        seen = {"model": model, "params": params}
        return cls._posed("from_colmap", seen, projection, pose, image, image["reversed_z"])

    @classmethod
    @_arguments.explained(_camera_arguments.POSE_KEYWORDS)
    def from_opengl(
        cls,
        projection: npt.ArrayLike | None = None,
        *,
        k: npt.ArrayLike | None = None,
        pixel_center: PixelCenter | None = None,
        fov_x_deg: float | None = None,
        fov_y_deg: float | None = None,
        camera_from_world: npt.ArrayLike | None = None,
        world_from_camera: npt.ArrayLike | None = None,
        size: Size,
        near: float | None = None,
        far: float | None = None,
        distortion: npt.ArrayLike | None = None,
        reversed_z: bool | None = None,
    ) -> Self:
        """A camera with OpenGL's axes (and Blender's, nerfstudio's, pyrender's, trimesh's).

        It has x right, y up, and looks along -z.
        Pass what it sees in one of four ways: OpenGL's `projection`; or `k`, `fov_x_deg` or
        `fov_y_deg`, each with `near` and `far`.

        With a `projection` (clip z in -w..w, mapped to 0..w here) the camera has standard depth.
        A depth buffer that was read back in 0..1 is then of kind ``"ndc"``.
        Its rows start at the bottom in OpenGL: flip them, ``depth[::-1]``.
        A projection that was made for ``glClipControl(..., GL_ZERO_TO_ONE)`` belongs into
        `from_matrices`.

        Parameters
        ----------
        projection : (4, 4)
            ``clip_from_camera`` for column vectors.
            OpenGL's and glm's memory is column by column: transpose it.
        k : (3, 3)
            As in `from_opencv`, in pixels from the top-left corner.
            Nerfstudio writes it beside poses of this kind.
        pixel_center : {"integer", "half"}
            As in `from_opencv`; needed with `k`, and with nothing else.
            Nerfstudio, pyrender and trimesh: ``"half"``.
        fov_x_deg, fov_y_deg : float
            The full horizontal or vertical angle of view in degrees, above 0 and below 180.
            The pixels are square, and the axis is in the middle of the image.
            Blender, NeRF and pyrender have radians: pass ``np.degrees(angle)``.
        camera_from_world, world_from_camera : (4, 4), (3, 4) or a pair (R, t)
            The pose; pass exactly one.
            ``camera_from_world`` is what OpenGL calls the view matrix.
            ``world_from_camera`` is Blender's ``matrix_world``, nerfstudio's ``transform_matrix``.
        size : (height, width)
            Pixels of the viewport.
            For a depth image of another resolution, take `resized` of the camera.
        near, far : float
            As in `look_at`, along -z.
            `near` is needed without a `projection`, which has its own planes.
        distortion : array, optional
            Lens distortion that belongs to `k`, as in `from_opencv`: None or all zero.
        reversed_z : bool, optional
            As in `look_at`, and not beside a `projection`.
            None is True, as in all constructors that take `near`.
            Metric depth does not depend on it; for a depth buffer of OpenGL pass False, or the
            projection.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        way = _camera_arguments.only_one(
            ("projection", "k", "fov_x_deg", "fov_y_deg"), (projection, k, fov_x_deg, fov_y_deg)
        )
        if way != "k":
            of_k = {"pixel_center": pixel_center, "distortion": distortion}
            _camera_arguments.only_beside("k", of_k, way)
        if way == "projection":
            beside = {"near": near, "far": far, "reversed_z": reversed_z}
            _camera_arguments.nothing_beside("a projection, which has its own", beside)
            clip = _camera_arguments.opengl_projection(projection)
            zero_to_one = clip.copy()
            zero_to_one[2] = 0.5 * clip[2] + 0.5 * clip[3]
            pose = _camera_arguments.one_pose(camera_from_world, world_from_camera)
            viewport = {"size": _arguments.size("size", size)}
            seen: dict[str, Any] = {"projection": clip}
            return cls._posed("from_opengl", seen, zero_to_one, pose, viewport, reversed_z=False)
        pose = _camera_arguments.one_pose(camera_from_world, world_from_camera)
        if reversed_z is None:
            reversed_z = True
        image = _camera_arguments.perspective_image(size, near, far, reversed_z)
        if way == "k":
            k = _camera_arguments.intrinsics(k)
            pixel_center = _camera_arguments.pixel_center(pixel_center)
            _camera_arguments.refuse_distortion(distortion)
            camera_hints.at_intrinsics(k, image["size"], stacklevel=3)
            seen = {"k": k, "pixel_center": pixel_center}
            clip_from_camera = _pinhole(k, pixel_center, image) @ _OPENCV_FROM_OPENGL
        else:
            given = fov_x_deg if way == "fov_x_deg" else fov_y_deg
            angle = _camera_arguments.field_of_view(way, given)
            camera_hints.at_radians(way, angle, stacklevel=3)
            seen = {way: angle}
            height, width = image["size"]
            side = width if way == "fov_x_deg" else height
            tangent = math.tan(math.radians(angle) / 2.0)
            right, top = tangent * width / side, tangent * height / side
            clip_from_camera = _frustum((-right, right, -top, top), image) @ _FORWARD_FROM_OPENGL
        return cls._posed("from_opengl", seen, clip_from_camera, pose, image, image["reversed_z"])

    @classmethod
    @_arguments.explained(_camera_arguments.POSE_KEYWORDS)
    def from_matrices(
        cls,
        clip_from_world: npt.ArrayLike | None = None,
        *,
        clip_from_camera: npt.ArrayLike | None = None,
        camera_from_world: npt.ArrayLike | None = None,
        world_from_camera: npt.ArrayLike | None = None,
        size: Size,
        reversed_z: bool,
    ) -> Self:
        """A camera from matrices in this library's conventions: Vulkan's clip volume, with y up.

        Pass `clip_from_world` alone, or `clip_from_camera` with exactly one of `camera_from_world`
        and `world_from_camera`.
        Two matrices are better far away from the origin: the eye is then known exactly.

        Parameters
        ----------
        clip_from_world, clip_from_camera : (4, 4)
            Clip space has x right, y up and ``0 <= z <= w``.
            The camera space between may be any.
        camera_from_world, world_from_camera : (4, 4), (3, 4) or a pair (R, t)
            The pose; the last row of a ``(4, 4)`` is 0, 0, 0, 1.
        size : (height, width)
            Pixels of the image.
        reversed_z : bool
            True when ``z = w`` is the near plane, False when it is the far plane.
            There is no default, because the matrices do not say it.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        size = _arguments.size("size", size)
        reversed_z = _arguments.flag("reversed_z", reversed_z)
        image = {"size": size, "reversed_z": reversed_z}
        if clip_from_world is not None:
            others = (clip_from_camera, camera_from_world, world_from_camera)
            if any(other is not None for other in others):
                raise ValueError(
                    "clip_from_world: expected alone, or clip_from_camera with one pose instead; "
                    "got both"
                )
            clip = _arguments.matrix("clip_from_world", clip_from_world)
            inner = CoreCamera.from_clip_from_world(clip.tolist(), reversed_z, size)
            return cls._made(inner, "from_matrices", clip_from_world=clip, **image)
        if clip_from_camera is None:
            raise ValueError(
                "clip_from_world: expected (4, 4), or clip_from_camera=(4, 4) with one pose "
                "instead; got neither"
            )
        clip = _arguments.matrix("clip_from_camera", clip_from_camera)
        pose = _camera_arguments.one_pose(camera_from_world, world_from_camera)
        seen = {"clip_from_camera": clip}
        return cls._posed("from_matrices", seen, clip, pose, image, reversed_z)

    # Properties.

    @property
    def size(self) -> Size:
        """``(height, width)`` of the image in pixels."""
        return self._inner.size()

    @property
    def reversed_z(self) -> bool:
        """True: depth 1 is near and 0 far; False: 0 near and 1 far."""
        return self._inner.reversed_z()

    @property
    def depth_kind(self) -> DepthKind:
        """The kind of this camera's depth images: ``"reversed_ndc"`` or ``"ndc"``."""
        return "reversed_ndc" if self.reversed_z else "ndc"

    @property
    def clip_from_world(self) -> npt.NDArray[np.float64]:
        """``(4, 4)`` float64 for column vectors, up to a positive factor; a copy."""
        return np.array(self._inner.clip_from_world(), dtype=np.float64)

    def project(self, xyz: npt.ArrayLike) -> Projected:
        """Where world positions lie in the image, in float64.

        Parameters
        ----------
        xyz : (N, 3) float array
            World positions.

        Returns
        -------
        Projected
            ``pixels`` as column and row with the first centre at (0.5, 0.5), NDC ``depth``, view
            depth ``z``, and which points are ``inside``.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.

        Examples
        --------
        >>> import hizvk
        >>> camera = hizvk.Camera.look_at(
        ...     (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(100, 100), near=0.5
        ... )
        >>> seen = camera.project([(0.0, 0.0, -2.0), (1.0, 1.0, -2.0), (0.0, 0.0, 2.0)])
        >>> seen.pixels[:2].round(6).tolist(), seen.z.tolist()
        ([[50.0, 50.0], [75.0, 25.0]], [2.0, 2.0, -2.0])
        >>> seen.inside.tolist(), float(seen.depth[0])
        ([True, True, False], 0.25)
        """
        return projected(self._inner, xyz)

    def resized(self, size: Size) -> Camera:
        """The same view in an image of another size ``(height, width)``.

        The borders of the view stay where they are: another aspect ratio makes the pixels oblong.
        So a camera of a 1080 x 1920 image becomes that of its 270 x 480 depth image; a camera
        matrix K needs no scaling for it.
        """
        size = _arguments.size("size", size)
        return self._made(self._inner.with_size(size), "resized", camera=self, size=size)

    # As a value.

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"cannot set {name!r}: a Camera is immutable")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError(f"cannot delete {name!r}: a Camera is immutable")

    def __eq__(self, other: object) -> bool:
        return self._inner == other._inner if isinstance(other, Camera) else NotImplemented

    def __hash__(self) -> int:
        rows = np.array(self._inner.rows()) + 0.0  # -0.0 equals 0.0, so it has to hash as 0.0
        origin = np.array(self._inner.origin()) + 0.0
        return hash((rows.tobytes(), origin.tobytes(), self.size, self.reversed_z))

    def __repr__(self) -> str:
        name, arguments = self._recipe
        if name == "resized":
            return f"{arguments[0][1]!r}.resized({self.size})"
        shown = ", ".join(
            f"{key}=<{'x'.join(map(str, value.shape))}>"
            if isinstance(value, np.ndarray)
            else f"{key}={value!r}"
            for key, value in arguments
        )
        return f"Camera.{name}({shown})"

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: object) -> Self:
        return self

    def __reduce__(self) -> tuple[Callable[..., Camera], tuple[str, dict[str, Any]]]:
        name, arguments = self._recipe
        return made_again, (name, dict(arguments))


def made_again(name: str, arguments: dict[str, Any]) -> Camera:
    """Makes a camera by a call that made one, such as a pickled one; without hints."""
    if name == "resized":
        camera: Camera = arguments["camera"]
        return camera.resized(arguments["size"])
    maker: Callable[..., Camera] = getattr(Camera, name)
    with camera_hints.silenced():
        return maker(**arguments)


#: OpenCV's camera axes (y down, z forward) from OpenGL's (y up, looking along -z).
_OPENCV_FROM_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
#: Axes with y up that look along +z, from OpenGL's.
_FORWARD_FROM_OPENGL = np.diag([1.0, 1.0, -1.0, 1.0])


def _frustum(borders: tuple[float, float, float, float], image: Image) -> npt.NDArray[np.float64]:
    """``clip_from_camera`` for axes with y up that look along +z."""
    matrix = frustum_matrix(
        borders, image["near"], image["far"], image["reversed_z"], image["size"]
    )
    return np.array(matrix)


def _pinhole(
    k: npt.NDArray[np.float64], pixel_center: PixelCenter, image: Image
) -> npt.NDArray[np.float64]:
    """``clip_from_camera`` of a camera matrix, for OpenCV's axes."""
    (fx, skew, cx), (_, fy, cy), _ = k.tolist()
    height, width = image["size"]
    moved = _camera_arguments.TO_HALF[pixel_center]
    cx, cy = cx + moved, cy + moved
    borders = (-cx / fx, (width - cx) / fx, (cy - height) / fy, cy / fy)
    # From OpenCV's axes to those with y up, and the skew as a shear:
    # x = fx * (X + skew / fx * Y) + cx * Z.
    upright_from_opencv = np.diag([1.0, -1.0, 1.0, 1.0])
    upright_from_opencv[0, 1] = skew / fx
    return _frustum(borders, image) @ upright_from_opencv
