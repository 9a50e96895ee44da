"""Hints at units that differ: depth in millimetres before positions in metres, and the like.

Nothing tells such numbers apart by themselves.
What tells is the answer: everything in view is hidden, or nothing is, and the depth image is
hundreds of times as far away as all that was tested, or as near.
A factor of 100 counts if without it most of what was tested lies at the depth of its pixels.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from .depth import METRIC
from .view_depth import RayView

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from .camera import Camera
    from .depth import DepthArray

    _Doubles = npt.NDArray[np.float64]

__all__ = [
    "all_are_hidden",
    "is_at_the_near_plane",
    "none_is_hidden",
    "sampled",
    "whole_without_scale",
]

#: Units differ where the medians do by so much: millimetres and metres by 1,000.
APART: Final = 200.0
#: For whole numbers without a scale: they are rarely metres.
WHOLE_APART: Final = 50.0
#: Centimetres and metres differ by so much, which scenes do that are as they should be;
CENTI: Final = 100.0
#: it is a mistake if, without this factor, as large a share of at least so many instances
LIKELY: Final = 0.5
ENOUGH: Final = 8
#: lies at the depth of its pixel, up to this share of it.
AT_DEPTH: Final = 0.25
#: One instance says little about a scene.
LEAST: Final = 2
#: About so many pixels of an image are looked at.
PIXELS: Final = 40_000
#: What a depth of the near plane may differ from it by, relative to it.
AT_NEAR: Final = 1e-6

_CLEARED: Final = (
    "depth: every pixel is at the near plane, so everything in view is hidden; a depth buffer that "
    'was cleared for the other direction looks so: 1 is near for "reversed_ndc" and far for "ndc"'
)


def sampled(image: DepthArray, camera: Camera) -> Callable[[], _Doubles]:
    """View depths of some pixels of an image that was checked, far ones infinite, on request.

    Of the kind ``"distance"`` they are distances, which is near enough for the median.
    """

    def read() -> _Doubles:
        step = max(1, int(np.sqrt(image.image.size / PIXELS)))
        part = image._replace(image=image.image[::step, ::step]).floats().astype(np.float64)
        known = np.isfinite(part) & ~np.isin(part, image.invalid)
        if image.kind in METRIC:
            return np.where(known & (part > 0.0), image.scale * part, np.inf)
        return np.where(known, RayView(camera).depth_of(part), np.inf)

    return read


def is_at_the_near_plane(camera: Camera, depth: _Doubles) -> bool:
    """Whether all of these view depths are that of the near plane."""
    view = RayView(camera)
    if view.is_bare or not depth.size:
        return False
    near = view.depth_of(np.array([[1.0 if camera.reversed_z else 0.0]])).item()
    return bool((np.abs(depth - near) <= AT_NEAR * abs(near)).all())


def all_are_hidden(
    camera: Camera, middles: _Doubles, read: Callable[[], _Doubles], *, asked: bool
) -> tuple[str, ...]:
    """Hints where everything in view is hidden.

    Parameters
    ----------
    camera : Camera
        Who looks.
    middles : (N, 3) float64 array
        Middles of what was tested, or of some of it; empty if they are not known.
    read : function
        View depths of the image.
    asked : bool
        Whether someone asks for hints.
        Then it is also said where nothing tells that it is a mistake.
    """
    depth = read()
    if is_at_the_near_plane(camera, depth):
        return (_CLEARED,)
    found = _medians(camera, middles, depth)
    if found is None:
        return ()
    count, instances, image = found
    both = _both(found, "everywhere" if (depth == image).all() else "in the median")
    if instances >= APART * image:
        return (
            f"bounds, depth: all {count:,} in view are hidden, and they are "
            f"{instances / image:,.0f} times as far away as the depth image ({both}); if "
            "that is not meant, bring both to the same units, by scale or by the positions",
        )
    if _are_at_depth(camera, middles / CENTI, depth):
        return (
            f"bounds, depth: all {count:,} in view are hidden, and most middles / {CENTI:g} lie at "
            f"the depth of their pixels ({both}); if positions are in centimetres and depth is in "
            f"metres, pass scale={CENTI:g}, or positions / {CENTI:g}",
        )
    if not asked:
        return ()
    return (
        f"bounds, depth: all {count:,} in view are hidden ({both}); if that is not meant, "
        "check kind, scale and the units of the positions",
    )


def none_is_hidden(
    camera: Camera, middles: _Doubles, read: Callable[[], _Doubles], given: DepthArray | None
) -> tuple[str, ...]:
    """Hints where nothing in view is hidden, and the image is not empty.

    Parameters
    ----------
    camera, middles, read
        As for `all_are_hidden`.
    given : DepthArray, optional
        The checked image, where it came as an array.
    """
    if not len(middles):
        return ()
    depth = read()
    found = _medians(camera, middles, depth)
    if found is None:
        return ()
    count, instances, image = found
    is_whole = whole_without_scale(given)
    unit, scale = "millimetres", 0.001
    if _are_at_depth(camera, middles, depth / CENTI):
        unit, scale = "centimetres", 1.0 / CENTI
    elif image < (WHOLE_APART if is_whole else APART) * instances:
        return ()
    way = f"if it is in {unit} and positions are in metres, pass scale={scale:g}"
    if given is not None and given.kind not in METRIC:
        way = "if near and far of the camera are in other units than positions, bring them to those"
    what = "whole numbers without scale count as world units, and " if is_whole else ""
    return (
        f"depth, scale: {what}nothing is hidden, because the depth image is "
        f"{image / instances:,.0f} times as far away as the {count:,} in view "
        f"({_both(found, 'in the median')}); {way}",
    )


def _are_at_depth(camera: Camera, middles: _Doubles, depth: _Doubles) -> bool:
    """Whether most middles in view lie at about the depth that the image has there.

    `depth` may be of any size: its pixels divide the view evenly.
    """
    view = RayView(camera)
    if view.is_parallel or not depth.size:
        return False
    x, y, _, w = view.clip_of(middles).T
    with np.errstate(invalid="ignore"):
        seen = (np.abs(x) < w) & (np.abs(y) < w) & (w > 0.0)
    if seen.sum() < ENOUGH:
        return False
    x, y, w = x[seen], y[seen], w[seen]
    rows, columns = depth.shape
    row = (0.5 * (1.0 - y / w) * rows).astype(np.intp).clip(0, rows - 1)
    column = (0.5 * (1.0 + x / w) * columns).astype(np.intp).clip(0, columns - 1)
    there = depth[row, column]
    with np.errstate(invalid="ignore"):
        return bool((np.abs(w - there) <= AT_DEPTH * there).mean() >= LIKELY)


def _medians(camera: Camera, middles: _Doubles, depth: _Doubles) -> tuple[int, float, float] | None:
    """How many middles are in view, their view depth and that of the image, in the median."""
    view = RayView(camera)
    known = depth[np.isfinite(depth) & (depth > 0.0)]
    if view.is_parallel or not known.size:
        return None  # parallel rays begin anywhere, so ratios say nothing
    x, y, _, w = view.clip_of(middles).T
    with np.errstate(invalid="ignore"):
        seen = w[(np.abs(x) <= w) & (np.abs(y) <= w) & (w > 0.0)]
    if len(seen) < LEAST:
        return None
    return len(seen), float(np.median(seen)), float(np.median(known))


def _both(found: tuple[int, float, float], where: str) -> str:
    _, instances, image = found
    return (
        f"their middles at a view depth of {instances:.4g} in the median, the image at "
        f"{image:.4g} {where}"
    )


def whole_without_scale(given: DepthArray | None) -> bool:
    """Whether a checked image holds a sensor's whole numbers as world units."""
    return bool(
        given is not None
        and given.image.dtype == np.uint16
        and given.rounding != "half"
        and given.scale == 1.0
    )
