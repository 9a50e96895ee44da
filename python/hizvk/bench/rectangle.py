"""The best that a rectangle test can do: float64, full resolution, every pixel of the rectangle.

It shares no code with the engine or with the oracle.
It culls a box in two cases:

- The box lies outside the view volume.
- Every pixel that the rectangle about its projected corners touches shows something nearer than the
  nearest of its corners.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from ..scenes.scene import box_corners

if TYPE_CHECKING:
    import numpy.typing as npt

    from .._arguments import Size
    from ..scenes import Scene, View
    from ..scenes.grid import Floats

__all__ = ["Projected", "project", "rectangle_test"]

#: Pixels by which rectangles grow; float64 rounds by about 1e-12.
PAD: Final = 1e-6
#: The part of the depth by which a box has to be farther.
SLACK: Final = 1e-9


@dataclass(frozen=True)
class Projected:
    """Boxes in the image of a view."""

    inside: npt.NDArray[np.bool_]
    """``(N,)``: not wholly outside one plane of the view volume."""
    crosses: npt.NDArray[np.bool_]
    """``(N,)``: some corner lies before the near plane, so the rectangle means nothing."""
    nearest: Floats
    """``(N,)``: the least view depth of the corners."""
    rectangle: Floats
    """``(N, 4)``: x0, y0, x1, y1 in pixels."""


def project(scene: Scene, view: View, size: Size) -> Projected:
    """The instances' boxes as `view` sees them in an image of `size`."""
    height, width = size
    world = box_corners(scene.box_min, scene.box_max)
    x, y, z = np.moveaxis((world - view.eye) @ view.basis().T, -1, 0)
    tangent = np.tan(np.radians(view.fov_y_deg) / 2.0)
    wide = tangent * width / height
    outside = [x < -wide * z, x > wide * z, y < -tangent * z, y > tangent * z, z < view.near]
    if view.far is not None:
        outside.append(z > view.far)
    inside = ~np.any([side.all(axis=1) for side in outside], axis=0)
    depth = np.where(z > 0.0, z, np.nan)
    column = (x / depth / wide + 1.0) / 2.0 * width
    row = (1.0 - y / depth / tangent) / 2.0 * height
    rectangle = np.stack([column.min(1), row.min(1), column.max(1), row.max(1)], axis=1)
    return Projected(inside, (z < view.near).any(axis=1), z.min(axis=1), rectangle)


def rectangle_test(projected: Projected, depth: Floats) -> npt.NDArray[np.bool_]:
    """What the best rectangle test keeps.

    Parameters
    ----------
    projected : Projected
        N boxes.
    depth : (height, width) float64 array
        View depth of the occluders, infinite where there is nothing.

    Returns
    -------
    (N,) bool array
        True: kept.
    """
    height, width = depth.shape
    kept = projected.inside & projected.crosses
    asked = np.flatnonzero(projected.inside & ~projected.crosses)
    low = np.floor(projected.rectangle[asked, :2] - PAD)
    high = np.floor(projected.rectangle[asked, 2:] + PAD) + 1.0
    x0, y0 = np.clip(low, 0.0, (width, height)).astype(np.intp).T
    x1, y1 = np.clip(high, 0.0, (width, height)).astype(np.intp).T
    limit = projected.nearest[asked] * (1.0 - SLACK)
    for k, instance in enumerate(asked):
        block = depth[y0[k] : y1[k], x0[k] : x1[k]]
        kept[instance] = block.size > 0 and block.max() >= limit[k]
    return kept
