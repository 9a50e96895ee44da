"""What the numbers of a depth image mean, and the checks of an image against its camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from . import _arguments

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._arguments import FloatArray
    from .camera import Camera

__all__ = ["DEPTH_KINDS", "DepthKind"]

# Unions of words: stubtest takes Literal["a", "b"] for something else at run time.
DepthKind: TypeAlias = Literal["ndc"] | Literal["reversed_ndc"] | Literal["z"] | Literal["distance"]

#: The kinds of depth that an array can hold; see `Device.pyramid`.
DEPTH_KINDS: tuple[DepthKind, ...] = ("ndc", "reversed_ndc", "z", "distance")

_METRIC = ("z", "distance")

if TYPE_CHECKING:
    _DepthArray: TypeAlias = FloatArray | npt.NDArray[np.float16]


def checked_image(
    name: str, value: object, camera: Camera, kind: object, scale: object
) -> tuple[_DepthArray, DepthKind, float]:
    """The image in the camera's shape, its kind and scale, or an error that says why not.

    The image is float32 or float64. Half floats stay half floats: whoever uploads them counts what they
    round.
    """
    if kind is None:
        words = ", ".join(f'"{word}"' for word in DEPTH_KINDS)
        raise TypeError(f"kind: expected one of {words}, got None; there is no default, a wrong guess hides things")
    kind_: DepthKind = _arguments.choice("kind", kind, DEPTH_KINDS)  # type: ignore[assignment]
    if kind_ not in _METRIC and kind_ != camera.depth_kind:
        meaning = {"ndc": "0 near and 1 far", "reversed_ndc": "1 near and 0 far"}
        raise ValueError(
            f'kind: expected "{camera.depth_kind}" ({meaning[camera.depth_kind]}) for a camera with '
            f'reversed_z={camera.reversed_z}, got "{kind_}" ({meaning[kind_]})'
        )
    scale_ = _arguments.number("scale", scale, above=0.0)
    if scale_ != 1.0 and kind_ not in _METRIC:
        raise ValueError(
            f'scale: expected 1 for the kind "{kind_}", got {scale_:g}; only "z" and "distance" have units'
        )
    if isinstance(value, np.ndarray) and value.dtype.kind == "u" and not isinstance(value, np.ma.MaskedArray):
        if value.dtype.itemsize != 2 or kind_ not in _METRIC:
            raise TypeError(
                f'{name}: expected float (height, width), or uint16 for the kinds "z" and "distance", got '
                f'{_arguments.describe(value)} of kind "{kind_}"'
            )
        if value.shape != camera.size:
            got = _arguments.describe(value)
            raise ValueError(f"{name}: expected uint16 {camera.size} (the camera's size), got {got}")
        value = _arguments.copied(name, value, np.float32)  # exact: 16 bits
    image = _arguments.floats(name, value, camera.size, why=" (the camera's size)")
    is_half = np.asarray(value).dtype == np.float16
    return (image.astype(np.float16) if is_half else image), kind_, scale_


def widened(image: _DepthArray) -> tuple[FloatArray, bool]:
    """A checked image as float32 or float64, and whether it came in half floats."""
    if image.dtype == np.float16:
        return image.astype(np.float32), True  # exact
    return image, False  # type: ignore[return-value]
