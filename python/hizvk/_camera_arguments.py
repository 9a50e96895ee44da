"""Checks of a camera's arguments that concern cameras alone."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from . import _arguments

if TYPE_CHECKING:
    import numpy.typing as npt

Vector = tuple[float, float, float]

#: OpenCV's longest list of distortion coefficients.
MOST_COEFFICIENTS = 14


def view(eye: object, target: object, up: object) -> tuple[Vector, Vector, Vector]:
    """The three vectors of a view; the engine refuses those that leave it without a direction."""
    return _arguments.vector("eye", eye), _arguments.vector("target", target), _arguments.vector("up", up)


def near_far(near: object, far: object) -> tuple[float, float | None]:
    """The planes of a perspective camera."""
    near_ = _arguments.number("near", near, above=0.0)
    if far is None or (isinstance(far, float) and far == math.inf):
        return near_, None
    return near_, _arguments.number("far", far, above=near_)


def intrinsics(k: object) -> npt.NDArray[np.float64]:
    """OpenCV's camera matrix, with the zeros where they have to be."""
    result = _arguments.numbers_of_shape("k", k, (3, 3))
    expected = "k: expected [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] with fx and fy above 0"
    if not (result[0, 0] > 0.0 and result[1, 1] > 0.0):
        raise ValueError(f"{expected}, got fx={result[0, 0]:g} and fy={result[1, 1]:g}")
    if result[1, 0] != 0.0 or result[2].tolist() != [0.0, 0.0, 1.0]:
        hint = "; it looks transposed" if result[:, 2].tolist() == [0.0, 0.0, 1.0] else ""
        raise ValueError(f"{expected}, got {result.tolist()}{hint}")
    return result


def refuse_distortion(distortion: object) -> None:
    """Only no distortion at all is a linear camera."""
    if distortion is None:
        return
    coefficients = np.asarray(distortion)
    if coefficients.size > MOST_COEFFICIENTS:
        got = _arguments.describe(coefficients)
        raise ValueError(f"distortion: expected None or at most {MOST_COEFFICIENTS} zeros, got {got}")
    if coefficients.dtype.kind not in "fiu":
        got = _arguments.describe(coefficients if coefficients.ndim else distortion)
        raise TypeError(f"distortion: expected None or an array of zeros, got {got}")
    if coefficients.any():
        raise ValueError(
            "distortion: expected None or zeros, got coefficients other than 0; undistort the depth image first by "
            "cv2.initUndistortRectifyMap and cv2.remap(..., interpolation=cv2.INTER_NEAREST), and pass the new camera "
            "matrix as k (what interpolates, as undistorting a photograph does, invents depth between near and far)"
        )


def one_pose(camera_from_world: object, world_from_camera: object) -> tuple[str, npt.NDArray[np.float64]]:
    """The name and the matrix of the one pose that came."""
    if (camera_from_world is None) == (world_from_camera is None):
        got = "neither" if camera_from_world is None else "both"
        raise ValueError(f"camera_from_world, world_from_camera: expected exactly one (4, 4) matrix, got {got}")
    if camera_from_world is not None:
        return "camera_from_world", _arguments.pose("camera_from_world", camera_from_world)
    return "world_from_camera", _arguments.pose("world_from_camera", world_from_camera)
