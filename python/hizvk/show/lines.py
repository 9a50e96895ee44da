"""Outlines of instances as lines in a camera's image, and lines drawn into a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from .shapes import box_edges

if TYPE_CHECKING:
    import numpy.typing as npt

    from ..view_depth import RayView
    from .colours import _Image
    from .shapes import Shapes

    _Doubles = npt.NDArray[np.float64]
    _Indices = npt.NDArray[np.intp]

__all__ = ["draw", "outlines"]

#: The sides of the polygon that stands for a circle.
SIDES: Final = 32
#: What reaches so many image sides past the border is cut off there, so that no line is endless.
BEYOND: Final = 2.0


def outlines(view: RayView, shapes: Shapes) -> tuple[_Doubles, _Indices]:
    """The outlines of shapes in the image.

    Returns
    -------
    lines : (L, 2, 2) float64
        Both ends as column and row in pixels; a point is a line of length 0.
    owners : (L,) int
        Whose outline each line belongs to, as a place in `shapes`.
    """
    if shapes.axes is not None:
        return _in_image(view, *box_edges(shapes))
    starts, ends, owners = _circles(view, shapes)
    return _in_image(view, starts, ends, owners)


def _circles(view: RayView, shapes: Shapes) -> tuple[_Doubles, _Doubles, _Indices]:
    """The circles in which rays touch spheres; a point stays one, from itself to itself."""
    round_ = np.flatnonzero(shapes.radii > 0.0)
    points = np.flatnonzero(shapes.radii == 0.0)
    centers, radii = shapes.centers[round_], shapes.radii[round_]
    if view.eye is None:
        towards = np.broadcast_to(-view.forward, centers.shape)
        middles, outside = centers, np.ones(len(centers), bool)
    else:
        to_eye = view.eye - centers
        far = np.linalg.norm(to_eye, axis=1)
        outside = far > radii
        centers, radii, to_eye, far = (a[outside] for a in (centers, radii, to_eye, far))
        towards = to_eye / far[:, None]
        # Tangents from the eye touch the sphere on a smaller circle, nearer to the eye.
        middles = centers + towards * (radii**2 / far)[:, None]
        radii = radii * np.sqrt(1.0 - (radii / far) ** 2)
    across = np.cross(towards, np.where(np.abs(towards[:, :1]) > 0.7, [[0, 1, 0]], [[1, 0, 0]]))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    other = np.cross(towards, across)
    angles = np.arange(SIDES + 1) * (2.0 * np.pi / SIDES)
    rim = np.cos(angles)[:, None] * across[:, None] + np.sin(angles)[:, None] * other[:, None]
    rim = middles[:, None] + radii[:, None, None] * rim
    owners = np.concatenate([np.repeat(round_[outside], SIDES), points])
    spots = shapes.centers[points]
    starts = np.concatenate([rim[:, :-1].reshape(-1, 3), spots])
    return starts, np.concatenate([rim[:, 1:].reshape(-1, 3), spots]), owners


def _in_image(
    view: RayView, starts: _Doubles, ends: _Doubles, owners: _Indices
) -> tuple[_Doubles, _Indices]:
    """Projects lines; what lies before the near plane or far beside the image is cut off."""
    first, last = view.clip_of(starts), view.clip_of(ends)
    limits = 1.0 + 2.0 * BEYOND
    planes = [
        [0.0, 0.0, -1.0, 1.0] if view.reversed_z else [0.0, 0.0, 1.0, 0.0],
        *([x, y, 0.0, limits] for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))),
    ]
    kept = np.ones(len(first), bool)
    for plane in np.array(planes, np.float64):
        a, b = first @ plane, last @ plane
        kept &= (a >= 0.0) | (b >= 0.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.clip(np.nan_to_num(a / (a - b)), 0.0, 1.0)[:, None]
        cut = first + share * (last - first)
        first, last = np.where(a[:, None] < 0.0, cut, first), np.where(b[:, None] < 0.0, cut, last)
    kept &= (first[:, 3] > 0.0) & (last[:, 3] > 0.0)
    both = np.stack([first[kept], last[kept]], axis=1)
    height, width = view.size
    ndc = both[..., :2] / both[..., 3:]
    pixels = (0.5 + 0.5 * ndc * [1.0, -1.0]) * [width, height]
    return pixels, owners[kept]


def draw(image: _Image, lines: _Doubles, colour: tuple[int, int, int]) -> None:
    """Draws lines, given as columns and rows, one pixel wide into a picture."""
    height, width = image.shape[:2]
    steps = np.ceil(np.abs(lines[:, 1] - lines[:, 0]).max(axis=1, initial=0.0)).astype(np.intp) + 1
    owner = np.repeat(np.arange(len(lines)), steps)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(steps) - steps, steps)
    share = (place / np.maximum(steps[owner] - 1, 1))[:, None]
    spots = lines[owner, 0] * (1.0 - share) + lines[owner, 1] * share
    column, row = np.floor(spots.T).astype(np.intp)
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    image[row[inside], column[inside]] = colour
