"""The camera: which clip coordinates a world position has, in which image, in which depth convention.

Conventions are named constructors, never guessed. Matrices are C-order ``(4, 4)`` for column vectors
(``clip = M @ [x, y, z, 1]``), normalised device coordinates have x right, y up and z in 0..1, image sizes are
``(height, width)`` and row 0 is the top of the image. The numbers are float64 from here to the engine, which re-centres
everything on the eye, so that world positions of millions of metres are fine.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from . import _arguments, _camera_arguments, _core

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Self

    import numpy.typing as npt

    from ._arguments import Size

__all__ = ["Camera"]


class Camera:
    """An immutable camera with an image size; made by one of its named constructors.

    ======================  ==========================================================================
    `Camera.look_at`        perspective, from an eye towards a target
    `Camera.frustum`        perspective, off-centre
    `Camera.orthographic`   parallel projection
    `Camera.from_opencv`    an intrinsic matrix K; the camera looks along +z, y down
    `Camera.from_opengl`    a projection of OpenGL (clip z in -w..w); the camera looks along -z, y up
    `Camera.from_matrices`  matrices that already are in this library's conventions
    ======================  ==========================================================================

    Cameras compare by what they project, can be hashed, copied and pickled, and may be used from any thread.
    """

    __slots__ = ("_inner", "_recipe")

    _inner: _core.Camera
    _recipe: tuple[str, tuple[tuple[str, Any], ...]]

    def __init__(self) -> None:
        raise TypeError(
            "Camera() takes no arguments: use Camera.look_at, .frustum, .orthographic, .from_opencv, .from_opengl "
            "or .from_matrices"
        )

    @classmethod
    def _made(cls, core: _core.Camera, name: str, **arguments: Any) -> Self:
        """The camera around `core`, and how to make it again (for `repr` and pickle)."""
        camera = cls.__new__(cls)
        object.__setattr__(camera, "_inner", core)
        object.__setattr__(camera, "_recipe", (name, tuple(arguments.items())))
        return camera

    # -- constructors ------------------------------------------------------------------------------------------------

    @classmethod
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
            What is up in the image; not parallel to the view direction.
        fov_y_deg : float
            The full vertical angle of view in degrees, above 0 and below 180.
        size : (height, width)
            Pixels of the image; they are square.
        near, far : float
            Distances of the near and far plane along the view direction, ``0 < near < far``; None is infinitely far.
        reversed_z : bool
            True: depth 1 at the near plane and 0 at the far plane; False: 0 near, 1 far.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        eye, target, up = _camera_arguments.view(eye, target, up)
        fov_y_deg = _arguments.number("fov_y_deg", fov_y_deg, above=0.0, below=180.0)
        size = _arguments.size("size", size)
        near, far = _camera_arguments.near_far(near, far)
        reversed_z = _arguments.flag("reversed_z", reversed_z)
        core = _core.Camera.perspective(eye, target, up, math.radians(fov_y_deg), near, far, reversed_z, size)
        return cls._made(
            core, "look_at", eye=eye, target=target, up=up, fov_y_deg=fov_y_deg, size=size, near=near, far=far,
            reversed_z=reversed_z,
        )  # fmt: skip

    @classmethod
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
        """An off-centre perspective camera (a tile of a larger image, one eye of a headset, a shifted lens).

        Parameters
        ----------
        eye, target, up : three numbers
            As in `look_at`.
        left, right, bottom, top : float
            The image borders at view depth 1: tangents of the angles to the view direction, x to the right and y up;
            ``left < right`` and ``bottom < top``.
        size, near, far, reversed_z
            As in `look_at`.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        eye, target, up = _camera_arguments.view(eye, target, up)
        left = _arguments.number("left", left)
        right = _arguments.number("right", right, above=left)
        bottom = _arguments.number("bottom", bottom)
        top = _arguments.number("top", top, above=bottom)
        size = _arguments.size("size", size)
        near, far = _camera_arguments.near_far(near, far)
        reversed_z = _arguments.flag("reversed_z", reversed_z)
        borders = (left, right, bottom, top)
        core = _core.Camera.frustum(eye, target, up, borders, near, far, reversed_z, size)
        return cls._made(
            core, "frustum", eye=eye, target=target, up=up, left=left, right=right, bottom=bottom, top=top, size=size,
            near=near, far=far, reversed_z=reversed_z,
        )  # fmt: skip

    @classmethod
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
            What the image shows, in world units. ``width=None``: the pixels are square.
        size : (height, width)
            Pixels of the image.
        near, far : float
            The two planes, as distances from `eye` along the view direction; ``near < far``, both finite; near may be
            negative.
        reversed_z : bool
            As in `look_at`.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        eye, target, up = _camera_arguments.view(eye, target, up)
        height = _arguments.number("height", height, above=0.0)
        size = _arguments.size("size", size)
        if width is None:
            width = height * size[1] / size[0]
        width = _arguments.number("width", width, above=0.0)
        near = _arguments.number("near", near)
        far = _arguments.number("far", far, above=near)
        reversed_z = _arguments.flag("reversed_z", reversed_z)
        borders = (-0.5 * width, 0.5 * width, -0.5 * height, 0.5 * height)
        core = _core.Camera.orthographic(eye, target, up, borders, near, far, reversed_z, size)
        return cls._made(
            core, "orthographic", eye=eye, target=target, up=up, height=height, width=width, size=size, near=near,
            far=far, reversed_z=reversed_z,
        )  # fmt: skip

    @classmethod
    def from_opencv(
        cls,
        k: npt.ArrayLike,
        *,
        camera_from_world: npt.ArrayLike | None = None,
        world_from_camera: npt.ArrayLike | None = None,
        size: Size,
        near: float,
        far: float | None = None,
        distortion: npt.ArrayLike | None = None,
        reversed_z: bool = True,
    ) -> Self:
        """A camera as OpenCV, COLMAP and most calibration tools write it: x right, y down, z forward.

        Parameters
        ----------
        k : (3, 3)
            ``[[fx, skew, cx], [0, fy, cy], [0, 0, 1]]`` in pixels. OpenCV counts from the centre of the first pixel;
            here that centre is at (0.5, 0.5), so ``cx + 0.5`` and ``cy + 0.5`` are used.
        camera_from_world, world_from_camera : (4, 4)
            The pose; pass exactly one. ``camera_from_world`` is OpenCV's ``[R | t]`` (of ``solvePnP``) with a last row
            0, 0, 0, 1; ``world_from_camera`` is its inverse.
        size : (height, width)
            Pixels of the image that `k` belongs to.
        near, far, reversed_z
            As in `look_at`; view depth is the camera's z.
        distortion : array, optional
            Lens distortion coefficients; None or all zero. Others are refused: undistort the image first and pass the
            new camera matrix. Depth must not be interpolated, as ``cv2.undistort`` does: use
            ``cv2.initUndistortRectifyMap`` and ``cv2.remap`` with ``INTER_NEAREST``.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        k = _camera_arguments.intrinsics(k)
        name, pose = _camera_arguments.one_pose(camera_from_world, world_from_camera)
        size = _arguments.size("size", size)
        near, far = _camera_arguments.near_far(near, far)
        _camera_arguments.refuse_distortion(distortion)
        reversed_z = _arguments.flag("reversed_z", reversed_z)

        (fx, skew, cx), (_, fy, cy), _ = k.tolist()
        height, width = size
        cx, cy = cx + 0.5, cy + 0.5
        borders = (-cx / fx, (width - cx) / fx, (cy - height) / fy, cy / fy)
        projection = np.array(_core.frustum_matrix(borders, near, far, reversed_z, size))
        # From OpenCV's camera (y down) to one with y up, and the skew as a shear: fx (X + skew / fx Y) + cx Z.
        upright_from_opencv = np.diag([1.0, -1.0, 1.0, 1.0])
        upright_from_opencv[0, 1] = skew / fx
        core = _posed(projection @ upright_from_opencv, name, pose, reversed_z, size)
        return cls._made(core, "from_opencv", k=k, **{name: pose}, size=size, near=near, far=far, reversed_z=reversed_z)

    @classmethod
    def from_opengl(
        cls,
        projection: npt.ArrayLike,
        *,
        camera_from_world: npt.ArrayLike | None = None,
        world_from_camera: npt.ArrayLike | None = None,
        size: Size,
    ) -> Self:
        """A camera as OpenGL has it: x right, y up, looking along -z, clip z in -w..w (mapped to 0..w here).

        The result has standard depth (``reversed_z=False``), and a depth buffer that was read back in 0..1 is of kind
        ``"ndc"`` (its rows start at the bottom in OpenGL: turn them, ``depth[::-1]``). A projection that was made for
        ``glClipControl(..., GL_ZERO_TO_ONE)`` belongs into `from_matrices`.

        Parameters
        ----------
        projection : (4, 4)
            ``clip_from_camera`` for column vectors. OpenGL's and glm's memory is column by column: transpose it.
        camera_from_world, world_from_camera : (4, 4)
            The pose; pass exactly one. ``camera_from_world`` is what OpenGL calls the view matrix.
        size : (height, width)
            Pixels of the viewport.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        clip = _arguments.matrix("projection", projection)
        perspective_memory = clip[2, 3] == -1.0 and clip[3, 2] not in (-1.0, 0.0) and clip[3, 3] == 0.0
        orthographic_memory = (clip[:, 3] == (0.0, 0.0, 0.0, 1.0)).all() and clip[3, :3].any()
        if perspective_memory or orthographic_memory:
            raise ValueError(
                "projection: expected a matrix for column vectors (clip = M @ [x, y, z, 1]), got one that looks "
                "transposed; pass projection.T"
            )
        name, pose = _camera_arguments.one_pose(camera_from_world, world_from_camera)
        size = _arguments.size("size", size)
        zero_to_one = clip.copy()
        zero_to_one[2] = 0.5 * clip[2] + 0.5 * clip[3]
        core = _posed(zero_to_one, name, pose, False, size)
        return cls._made(core, "from_opengl", projection=clip, **{name: pose}, size=size)

    @classmethod
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
        """A camera from matrices in this library's conventions (those of Vulkan's clip volume, with y up).

        Pass `clip_from_world` alone, or `clip_from_camera` with exactly one of `camera_from_world` and
        `world_from_camera`. Two matrices are better far away from the origin: the eye is then known exactly.

        Parameters
        ----------
        clip_from_world, clip_from_camera : (4, 4)
            Clip space has x right, y up and ``0 <= z <= w``. The camera space between may be any.
        camera_from_world, world_from_camera : (4, 4)
            The pose, last row 0, 0, 0, 1.
        size : (height, width)
            Pixels of the image.
        reversed_z : bool
            True when ``z = w`` is the near plane, False when it is the far plane. There is no default: only you know.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        size = _arguments.size("size", size)
        reversed_z = _arguments.flag("reversed_z", reversed_z)
        if clip_from_world is not None:
            others = (clip_from_camera, camera_from_world, world_from_camera)
            if any(other is not None for other in others):
                raise ValueError("clip_from_world: expected alone, or clip_from_camera with one pose instead; got both")
            clip = _arguments.matrix("clip_from_world", clip_from_world)
            core = _core.Camera.from_clip_from_world(clip.tolist(), reversed_z, size)
            return cls._made(core, "from_matrices", clip_from_world=clip, size=size, reversed_z=reversed_z)
        if clip_from_camera is None:
            raise ValueError(
                "clip_from_world: expected (4, 4), or clip_from_camera=(4, 4) with one pose instead; got neither"
            )
        clip = _arguments.matrix("clip_from_camera", clip_from_camera)
        name, pose = _camera_arguments.one_pose(camera_from_world, world_from_camera)
        core = _posed(clip, name, pose, reversed_z, size)
        return cls._made(core, "from_matrices", clip_from_camera=clip, **{name: pose}, size=size, reversed_z=reversed_z)

    # -- what it is --------------------------------------------------------------------------------------------------

    @property
    def size(self) -> Size:
        """``(height, width)`` of the image in pixels."""
        return self._inner.size()

    @property
    def reversed_z(self) -> bool:
        """True: depth 1 is near and 0 far; False: 0 near and 1 far."""
        return self._inner.reversed_z()

    @property
    def depth_kind(self) -> str:
        """The kind of this camera's depth images: ``"reversed_ndc"`` or ``"ndc"``."""
        return "reversed_ndc" if self.reversed_z else "ndc"

    @property
    def clip_from_world(self) -> npt.NDArray[np.float64]:
        """``(4, 4)`` float64 for column vectors, up to a positive factor; a copy."""
        return np.array(self._inner.clip_from_world(), dtype=np.float64)

    def resized(self, size: Size) -> Camera:
        """The same view in an image of another size ``(height, width)``.

        The borders of the view stay where they are: another aspect ratio makes the pixels oblong.
        """
        size = _arguments.size("size", size)
        return self._made(self._inner.with_size(size), "resized", camera=self, size=size)

    # -- as a value --------------------------------------------------------------------------------------------------

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
            f"{key}=<{'x'.join(map(str, value.shape))}>" if isinstance(value, np.ndarray) else f"{key}={value!r}"
            for key, value in arguments
        )
        return f"Camera.{name}({shown})"

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: object) -> Self:
        return self

    def __reduce__(self) -> tuple[Callable[..., Camera], tuple[str, dict[str, Any]]]:
        name, arguments = self._recipe
        return _again, (name, dict(arguments))


def _again(name: str, arguments: dict[str, Any]) -> Camera:
    """Makes a pickled camera by the call that made the first one."""
    if name == "resized":
        camera: Camera = arguments["camera"]
        return camera.resized(arguments["size"])
    maker: Callable[..., Camera] = getattr(Camera, name)
    return maker(**arguments)


def _posed(
    clip_from_camera: npt.NDArray[np.float64],
    name: str,
    pose: npt.NDArray[np.float64],
    reversed_z: bool,
    size: Size,
) -> _core.Camera:
    """The engine's camera from a projection and a pose of either direction."""
    make = {
        "camera_from_world": _core.Camera.from_clip_from_camera,
        "world_from_camera": _core.Camera.from_clip_from_camera_pose,
    }[name]
    return make(clip_from_camera.tolist(), pose.tolist(), reversed_z, size)
