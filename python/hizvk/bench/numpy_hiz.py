"""The Hi-Z that a Python user would write, with NumPy alone.

Levels are made by slicing and minimum (reversed Z), and 2x2 texels are gathered by indexing.
It is as good as such code gets: it is vectorised, pads odd sizes, chooses the level at which four
texels cover the rectangle, and keeps what crosses the near plane.
It has no margins, so nothing guarantees that float32 or coordinates far from the origin do no harm.
The bench counts the harm they do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["NumpyPyramid", "cull"]


@dataclass(frozen=True)
class NumpyPyramid:
    """All levels in one flat array; level k begins at ``first[k]``, ``width[k]`` texels wide."""

    texels: npt.NDArray[Any]
    first: npt.NDArray[np.intp]
    width: npt.NDArray[np.intp]
    height: npt.NDArray[np.intp]

    @classmethod
    def build(cls, depth: npt.NDArray[Any]) -> NumpyPyramid:
        """Makes levels of the farthest depth of every 2^k x 2^k pixels.

        Parameters
        ----------
        depth : (height, width) float array
            Reversed NDC depth: 1 near, 0 far.
        """
        levels = [depth]
        while levels[-1].size > 1:
            fine = levels[-1]
            height, width = fine.shape
            if height % 2 or width % 2:
                fine = np.pad(fine, ((0, height % 2), (0, width % 2)), mode="edge")
            rows = np.minimum(fine[0::2], fine[1::2])
            levels.append(np.minimum(rows[:, 0::2], rows[:, 1::2]))
        sizes = np.array([level.shape for level in levels])
        first = np.concatenate([[0], np.cumsum(sizes.prod(axis=1))[:-1]])
        return cls(
            np.concatenate([level.reshape(-1) for level in levels]), first, sizes[:, 1], sizes[:, 0]
        )


def cull(
    box_min: npt.NDArray[Any],
    box_max: npt.NDArray[Any],
    clip_from_world: npt.NDArray[Any],
    pyramid: NumpyPyramid,
    near: float,
) -> npt.NDArray[np.bool_]:
    """Which boxes are kept; computed in the dtype of the arguments.

    Parameters
    ----------
    box_min, box_max : (N, 3) float array
        Corners.
    clip_from_world : (4, 4) float array
        For column vectors; NDC depth is 1 near and 0 far, and w is the view depth.
    pyramid : NumpyPyramid
        Of the depth image.
    near : float
        Distance of the near plane; boxes with a corner before it are kept.

    Returns
    -------
    (N,) bool array
    """
    height, width = int(pyramid.height[0]), int(pyramid.width[0])
    bit = (np.arange(8)[:, None] >> np.arange(3)) & 1
    corner = np.where(bit, box_max[:, None], box_min[:, None])  # (N, 8, 3)
    clip = corner @ clip_from_world[:, :3].T + clip_from_world[:, 3]
    w = clip[..., 3]
    crosses = (w < near).any(axis=1)
    behind = (w < near).all(axis=1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ndc = clip[..., :3] / w[..., None]
    low, high = ndc.min(axis=1), ndc.max(axis=1)
    outside = (
        behind
        | (~crosses & ((high[:, :2] < -1) | (low[:, :2] > 1)).any(axis=1))
        | (~crosses & (high[:, 2] < 0))
    )
    kept: npt.NDArray[np.bool_] = ~outside
    test = np.flatnonzero(kept & ~crosses)
    low, high = low[test], high[test]
    x0 = np.clip(np.floor((low[:, 0] + 1) / 2 * width), 0, width - 1).astype(np.intp)
    x1 = np.clip(np.floor((high[:, 0] + 1) / 2 * width), 0, width - 1).astype(np.intp)
    y0 = np.clip(np.floor((1 - high[:, 1]) / 2 * height), 0, height - 1).astype(np.intp)
    y1 = np.clip(np.floor((1 - low[:, 1]) / 2 * height), 0, height - 1).astype(np.intp)
    side = np.maximum(np.maximum(x1 - x0, y1 - y0), 1)
    level = np.ceil(np.log2(side)).astype(np.intp)
    first, wide = pyramid.first[level], pyramid.width[level]
    farthest = np.full(len(test), np.inf, dtype=pyramid.texels.dtype)
    for x in (x0 >> level, x1 >> level):
        for y in (y0 >> level, y1 >> level):
            farthest = np.minimum(farthest, pyramid.texels[first + y * wide + x])
    kept[test[high[:, 2] < farthest]] = False
    return kept
