"""Checks of arguments that only cameras have."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, TypedDict

import numpy as np

from . import _arguments, _rotations, foreign

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy.typing as npt

    from ._arguments import Size
    from ._types import PixelCenter

Vector = tuple[float, float, float]
#: The name of the parameter, which says the direction of the pose, and the (4, 4) matrix.
Pose = tuple[str, "npt.NDArray[np.float64]"]

#: The length of OpenCV's longest list of distortion coefficients.
MOST_COEFFICIENTS = 14
#: What is added to cx and cy, so that the first pixel's centre comes to (0.5, 0.5).
TO_HALF: Final = {"integer": 0.5, "half": 0.0}
_CENTERS = (
    '"integer" (the first pixel\'s centre is (0, 0): OpenCV, KITTI, ROS) or '
    '"half" (it is (0.5, 0.5): COLMAP, nerfstudio, gsplat, pyrender, CARLA)'
)
_NO_DEFAULT = "there is no default, for half a pixel too far hides what can be seen"

#: Names of a pose that say no direction, or say it in the words of another library.
_POSES = (
    "R", "t", "T", "rotation", "translation", "rvec", "tvec", "pose", "extrinsic", "extrinsics",
    "viewmat", "viewmats", "view", "c2w", "w2c", "cam_from_world", "transform_matrix",
    "matrix_world",
)  # fmt: skip
_POSE_WORDS = (
    "expected no such parameter: pass camera_from_world=(R, t) where camera = R @ world + t "
    "(OpenCV, COLMAP), or world_from_camera=(R, t) where world = R @ camera + t; "
    "(3, 4) and (4, 4) matrices will do too"
)
#: What `_arguments.explained` says about other names of a pose.
POSE_KEYWORDS: Final = dict.fromkeys(_POSES, _POSE_WORDS)
#: The same for cameras of COLMAP.
COLMAP_KEYWORDS: Final = {
    "pixel_center": "expected no such parameter: COLMAP's centres are at halves, always",
    **POSE_KEYWORDS,
}
#: The same for a camera matrix, for which `pixel_center` has to be said.
KEYWORDS: Final = {
    "pixel_center": f"expected {_CENTERS}, got nothing; {_NO_DEFAULT}",
    **POSE_KEYWORDS,
}

#: COLMAP's models that are a pinhole if all parameters after cx and cy are 0.
#: The parameters are in the order of cameras.txt and pycolmap (colmap/src/colmap/sensor/models/).
COLMAP_MODELS: Final = {
    "SIMPLE_PINHOLE": "f, cx, cy",
    "PINHOLE": "fx, fy, cx, cy",
    "SIMPLE_RADIAL": "f, cx, cy, k",
    "RADIAL": "f, cx, cy, k1, k2",
    "OPENCV": "fx, fy, cx, cy, k1, k2, p1, p2",
    "FULL_OPENCV": "fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6",
    "FOV": "fx, fy, cx, cy, omega",
    "SIMPLE_DIVISION": "f, cx, cy, k",
    "DIVISION": "fx, fy, cx, cy, k",
}
#: COLMAP's models that map angles: even with zeros after cx and cy they are not a pinhole.
COLMAP_CURVED: Final = (
    "SIMPLE_FISHEYE", "FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "OPENCV_FISHEYE",
    "THIN_PRISM_FISHEYE", "RAD_TAN_THIN_PRISM_FISHEYE", "EUCM", "EQUIRECTANGULAR",
)  # fmt: skip
_UNDISTORT = (
    "run COLMAP's image_undistorter, and pass the PINHOLE camera that it writes "
    "(its depth maps belong to that camera)"
)
#: How far from 1 the length of a quaternion in a file may be.
UNIT_TOLERANCE = 1e-2


class PoseArguments(TypedDict):
    """From where a camera looks, and which way."""

    eye: Vector
    target: Vector
    up: Vector


class Image(TypedDict):
    """The image of a perspective camera, and the planes of its depth."""

    size: Size
    near: float
    far: float | None
    reversed_z: bool


def view(eye: object, target: object, up: object) -> PoseArguments:
    """The three vectors of a view; the engine refuses those that leave it without a direction."""
    return {
        "eye": _arguments.vector("eye", eye),
        "target": _arguments.vector("target", target),
        "up": _arguments.vector("up", up),
    }


def perspective_image(size: object, near: object, far: object, reversed_z: object) -> Image:
    """The arguments that all perspective constructors end with."""
    sides = _arguments.size("size", size)
    nearest = _arguments.number("near", near, above=0.0)
    farthest = None
    if far is not None and not (isinstance(far, float) and far == math.inf):
        farthest = _arguments.number("far", far, above=nearest)
    return {
        "size": sides,
        "near": nearest,
        "far": farthest,
        "reversed_z": _arguments.flag("reversed_z", reversed_z),
    }


def pixel_center(value: object) -> PixelCenter:
    """The word for where a camera matrix has the centre of the first pixel."""
    if not isinstance(value, str):
        raise TypeError(
            f"pixel_center: expected {_CENTERS}, got {_arguments.describe(value)}; {_NO_DEFAULT}"
        )
    if value not in TO_HALF:
        raise ValueError(f"pixel_center: expected {_CENTERS}, got {_arguments.describe(value)}")
    return value  # type: ignore[return-value]


def intrinsics(k: object) -> npt.NDArray[np.float64]:
    """A camera matrix, with its zeros in place."""
    # For a P of KITTI: the translation in it belongs into the pose.
    hints = {(3, 4): "; of a projection P = K [I | t] pass P[:, :3]", (4, 4): "; pass k[:3, :3]"}
    hint = hints.get(getattr(k, "shape", (3, 3)), "")
    result = _arguments.numbers_of_shape("k", k, (3, 3), hint=hint)
    expected = "k: expected [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] with fx and fy above 0"
    if not (result[0, 0] > 0.0 and result[1, 1] > 0.0):
        raise ValueError(f"{expected}, got fx={result[0, 0]:g} and fy={result[1, 1]:g}")
    if result[1, 0] != 0.0 or result[2].tolist() != [0.0, 0.0, 1.0]:
        hint = "; it looks transposed" if result[:, 2].tolist() == [0.0, 0.0, 1.0] else ""
        raise ValueError(f"{expected}, got {result.tolist()}{hint}")
    return result


def field_of_view(name: str, value: object) -> float:
    """An angle of view in degrees."""
    return _arguments.number(name, value, above=0.0, below=180.0)


def refuse_distortion(distortion: object) -> None:
    """Refuses distortion coefficients other than 0: such a camera is not linear."""
    if distortion is None:
        return
    distortion = foreign.as_numpy("distortion", "None or zeros", distortion)
    coefficients = np.asarray(distortion)
    if coefficients.size > MOST_COEFFICIENTS:
        got = _arguments.describe(coefficients)
        raise ValueError(
            f"distortion: expected None or at most {MOST_COEFFICIENTS} zeros, got {got}"
        )
    if coefficients.dtype.kind not in "fiu":
        got = _arguments.describe(coefficients if coefficients.ndim else distortion)
        raise TypeError(f"distortion: expected None or an array of zeros, got {got}")
    if coefficients.any():
        raise ValueError(
            "distortion: expected None or zeros, got coefficients other than 0; "
            "undistort the depth image first, by cv2.initUndistortRectifyMap and cv2.remap with "
            "cv2.INTER_NEAREST (cv2.undistort interpolates, and makes depth that nothing has), "
            "and pass the new camera matrix as k"
        )


def one_pose(camera_from_world: object, world_from_camera: object) -> Pose:
    """The pose, of which exactly one direction must be given."""
    if (camera_from_world is None) == (world_from_camera is None):
        got = "neither" if camera_from_world is None else "both"
        expected = "exactly one of them: (4, 4), (3, 4) or a pair (R, t)"
        raise ValueError(f"camera_from_world, world_from_camera: expected {expected}, got {got}")
    if camera_from_world is not None:
        return "camera_from_world", _arguments.pose("camera_from_world", camera_from_world)
    return "world_from_camera", _arguments.pose("world_from_camera", world_from_camera)


def colmap_pose(
    qvec: object, tvec: object, camera_from_world: object, world_from_camera: object
) -> Pose:
    """The pose of a COLMAP image: a matrix, or the quaternion and translation of images.txt."""
    if qvec is None and tvec is None:
        if camera_from_world is None and world_from_camera is None:
            expected = "both as images.txt has them, or camera_from_world"
            raise ValueError(f"qvec, tvec: expected {expected}, got no pose")
        return one_pose(camera_from_world, world_from_camera)
    if camera_from_world is not None or world_from_camera is not None:
        raise ValueError("qvec, tvec: expected alone, or camera_from_world instead; got both")
    for name, value in (("qvec", qvec), ("tvec", tvec)):
        if value is None:
            raise ValueError(
                f"{name}: expected the other half of the pose, as images.txt has it; got None"
            )
    quaternion = _arguments.numbers_of_shape("qvec", qvec, (4,))
    length = float(np.linalg.norm(quaternion))
    if not abs(length - 1.0) <= UNIT_TOLERANCE:
        expected = "a quaternion (w, x, y, z) of length 1"
        raise ValueError(
            f"qvec: expected {expected}, got {quaternion.tolist()} of length {length:g}"
        )
    result = np.eye(4)
    result[:3, :3] = _rotations.from_quaternions(*quaternion[:, None])[0]
    result[:3, 3] = _arguments.vector("tvec", tvec)
    return "camera_from_world", result


def colmap_intrinsics(
    model: object, params: object
) -> tuple[str, npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """The model's name, its parameters, and the camera matrix that they stand for."""
    expected = f"one of COLMAP's models {', '.join(COLMAP_MODELS)}"
    # In pycolmap the model is an enumeration.
    name = model if isinstance(model, str) else getattr(model, "name", None)
    if not isinstance(name, str):
        raise TypeError(f"model: expected {expected}, got {_arguments.describe(model)}")
    if name in COLMAP_CURVED:
        raise ValueError(
            f"model: expected {expected}, got {name}, which is no pinhole with any numbers; "
            f"{_UNDISTORT}"
        )
    if name not in COLMAP_MODELS:
        raise ValueError(f"model: expected {expected}, got {_arguments.describe(name)}")
    words = COLMAP_MODELS[name].split(", ")
    listed = _arguments.numbers_of_shape(
        "params", params, (len(words),), of=f"{COLMAP_MODELS[name]} of {name}, "
    )
    values = dict(zip(words, listed.tolist(), strict=True))
    fx, fy = (values["f"], values["f"]) if "f" in values else (values["fx"], values["fy"])
    if not (fx > 0.0 and fy > 0.0):
        expected = f"{COLMAP_MODELS[name]} of {name} with focal lengths above 0"
        raise ValueError(f"params: expected {expected}, got {values}")
    bent = {
        word: value
        for word, value in values.items()
        if word not in ("f", "fx", "fy", "cx", "cy") and value != 0.0
    }
    if bent:
        got = ", ".join(f"{word}={value:g}" for word, value in bent.items())
        raise ValueError(
            f"params: expected no distortion, all zeros behind cx and cy, got {got} of {name}; "
            f"{_UNDISTORT}"
        )
    return (
        name,
        listed,
        np.array([[fx, 0.0, values["cx"]], [0.0, fy, values["cy"]], [0.0, 0.0, 1.0]]),
    )


def only_one(names: Sequence[str], values: Sequence[object]) -> str:
    """The name of the one parameter that is given."""
    came = [name for name, value in zip(names, values, strict=True) if value is not None]
    if len(came) != 1:
        got = " and ".join(came) if came else "none"
        raise ValueError(f"{', '.join(names)}: expected exactly one of them, got {got}")
    return came[0]


def nothing_beside(what: str, values: Mapping[str, object]) -> None:
    """Refuses parameters that have no meaning beside `what`."""
    for name, value in values.items():
        if value is not None:
            raise TypeError(
                f"{name}: expected nothing beside {what}, got {_arguments.describe(value)}"
            )


def only_beside(what: str, values: Mapping[str, object], came: str) -> None:
    """Refuses parameters that have a meaning beside `what` alone."""
    for name, value in values.items():
        if value is not None:
            got = f"{_arguments.describe(value)} beside {came}"
            raise TypeError(f"{name}: expected beside {what} alone, got {got}")


def opengl_projection(projection: object) -> npt.NDArray[np.float64]:
    """A projection of OpenGL for column vectors; one that looks transposed is refused."""
    clip = _arguments.matrix("projection", projection)
    perspective_memory = clip[2, 3] == -1.0 and clip[3, 2] not in (-1.0, 0.0) and clip[3, 3] == 0.0
    orthographic_memory = (clip[:, 3] == (0.0, 0.0, 0.0, 1.0)).all() and clip[3, :3].any()
    if perspective_memory or orthographic_memory:
        raise ValueError(
            "projection: expected a matrix for column vectors (clip = M @ [x, y, z, 1]), "
            "got one that looks transposed; pass projection.T"
        )
    return clip
