"""Depth arrays with several samples per pixel, taken apart into an image for each sample."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import _arguments, foreign
from .depth import checked_image, whole_numbers

if TYPE_CHECKING:
    from .camera import Camera
    from .depth import DepthArray

__all__ = ["checked_samples"]

#: How many samples per pixel a renderer draws with.
COUNTS = (2, 4, 8, 16)


def checked_samples(
    name: str,
    value: Any,
    camera: Camera,
    kind: object,
    scale: object,
    invalid: object = None,
    tolerance: object = None,
) -> list[DepthArray]:
    """The image of each sample, as the engine takes them; one for an array without samples."""
    value = foreign.as_numpy(name, "(height, width) or (height, width, samples)", value)
    if not isinstance(value, np.ndarray) or value.ndim != 3 or value.shape[2] == 1:
        return [checked_image(name, value, camera, kind, scale, invalid, tolerance)]
    if value.shape[:2] != camera.size:
        # Refused there, with hints about other axes.
        return [checked_image(name, value, camera, kind, scale, invalid, tolerance)]
    if value.shape[2] not in COUNTS:
        listed = ", ".join(map(str, COUNTS[:-1]))
        raise ValueError(
            f"{name}: expected (height, width), or (height, width, samples) with {listed} or "
            f"{COUNTS[-1]} samples, got {_arguments.describe(value)}"
        )
    value = whole_numbers(name, value, kind, invalid)  # of one dtype for all samples
    planes = (value[..., k] for k in range(value.shape[2]))
    return [checked_image(name, plane, camera, kind, scale, invalid, tolerance) for plane in planes]
