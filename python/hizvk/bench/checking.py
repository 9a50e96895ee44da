"""What `hizvk.recommend` holds its candidates against, so that none is recommended that hides what can be seen.

Occluders, where every ray counts: what conservative depth hides is proven to be hidden.
What a candidate culls beyond that is looked at by rays in float64 from the camera to points of the
bounds, at the triangles (`clear`).
It is visible, or unclear; of a bare point rays decide either.
Depth images, or pixel centres alone: the exact oracle (`hizvk.reference`) on the full image as it
is.
Where there is much to look at, a part is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import reference
from ..bounds import Bounds, Boxes, OrientedBoxes, Spheres, are_points
from ..resources import Instances
from .clear import POINTS, Blockers, points_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..camera import Camera
    from ..depth import DepthArray
    from ..resources import Occluders
    from .configurations import Configuration

__all__ = ["Check", "by_oracle", "by_rays", "hold"]

Mask: TypeAlias = npt.NDArray[np.bool_]
Indices: TypeAlias = npt.NDArray[np.intp]
#: Says which of some instances (second) of these bounds (first) are certainly visible in view k (third).
Judge: TypeAlias = Callable[[Bounds, Indices, int], Mask]

#: Rays that are cast, and instances times `POINTS` that the oracle is asked about, for each view and kind of bounds.
MOST_RAYS: Final = 60_000
MOST_ORACLE: Final = 400 * POINTS
#: How bare points before a depth image are checked.
GUARD: Final = "a guard of half a pixel, since bare points lie on what the depth image shows"
#: The part of them that goes to what the proofs say is hidden: so proofs are checked, too.
SHARE_OF_PROVEN: Final = 0.125


@dataclass(eq=False)
class Check:
    """What was looked at, and what was found."""

    method: str
    """How, in words."""
    hides: list[int]
    """By candidate: instances that it culls and that are visible."""
    unclear: list[int]
    """By candidate: those that it culls and that are neither proven to be hidden nor found visible."""
    culled: int = 0
    """Instances times cameras and kinds of bounds that some candidate culls."""
    looked: int = 0
    """How many of them were looked at."""
    visible: int = 0
    """How many of those are visible."""


def by_rays(occluders: Occluders, cameras: Sequence[Camera]) -> tuple[str, int, Judge]:
    """The method, how many points it can look at, and the judge."""
    vertices, triangles, faces = occluders._inner.surface()
    corners = vertices.reshape(-1, 3), triangles.reshape(-1, 3)
    made: dict[int, Blockers] = {}

    def judge(bounds: Bounds, which: Indices, k: int) -> Mask:
        if k not in made:
            made.clear()
            made[k] = Blockers(*corners, faces, cameras[k])
        points = points_of(bounds, which, cameras[k])
        clear = made[k].clear(points.reshape(-1, 3)).reshape(points.shape[:2])
        return np.asarray(clear.any(axis=1))

    return "rays to points of the bounds, at the occluders' triangles (float64)", MOST_RAYS, judge


def by_oracle(
    image_of: Callable[[int], DepthArray], cameras: Sequence[Camera], coverage: Any
) -> tuple[str, int, Judge]:
    """The method, how many points it can look at, and the judge."""

    def judge(bounds: Bounds, which: Indices, k: int) -> Mask:
        depth, part = image_of(k), _part(bounds, which)
        codes = reference.classify(
            part, cameras[k], depth.image, kind=depth.kind, scale=depth.scale, invalid=depth.invalid,
            coverage=coverage, own_depth="pixel",
        )  # fmt: skip
        visible: Mask = codes == reference.VISIBLE
        return visible

    what = "pixels" if coverage == "area" else "pixels' centres"
    return f"the exact oracle, at the {what} of the depth image as it is", MOST_ORACLE, judge


def hold(
    chosen: Sequence[Configuration],
    masks: Sequence[Sequence[Mask]],
    alternatives: dict[str, Bounds | Instances],
    tool: tuple[str, int, Judge],
    *,
    every_ray: bool,
) -> Check:
    """Holds every candidate against what is visible.

    Parameters
    ----------
    chosen : sequence of Configuration
        The candidates.
    masks : sequence of sequence of (N,) bool array
        What each (first index) keeps in each view (second).
    alternatives : dict
        The bounds by kind.
    tool
        Of `by_rays` or `by_oracle`.
    every_ray : bool
        Whether every ray counts, so that what conservative depth hides is proven to be hidden and
        what it keeps is not.
        Otherwise the image as it is counts; and of bare points with a guard among the candidates,
        what the guard keeps counts as visible: they lie on what the image shows, whose depth it
        knows at its pixels' centres alone.
    """
    method, most, judge = tool
    found = Check(method, [0] * len(chosen), [0] * len(chosen))
    random = np.random.default_rng(0)
    for volume, bounds in alternatives.items():
        members = [number for number, one in enumerate(chosen) if one.volume == volume]
        proven = [number for number in members if chosen[number].promises_rays] if every_ray else []
        points = bounds._points if isinstance(bounds, Instances) else are_points(bounds)
        for k in range(len(masks[members[0]])):
            culled = {number: ~masks[number][k] for number in members}
            by_some = np.logical_or.reduce(list(culled.values()))
            hidden = np.zeros_like(by_some)
            if proven:
                hidden = np.logical_or.reduce([culled[number] for number in proven])
            visible, open_ = np.zeros_like(by_some), by_some & ~hidden
            if points and not every_ray and any(chosen[number].guard_px for number in members):
                found.method = GUARD
                asked = np.flatnonzero(by_some)
                visible = np.logical_or.reduce(
                    [~culled[number] for number in members if chosen[number].guard_px]
                )
                open_[:] = False
            elif isinstance(bounds, Instances):
                asked = np.zeros(0, np.intp)
            else:
                first = open_ if proven else by_some & ~np.logical_and.reduce(list(culled.values()))
                asked = _pick(first, by_some & ~first, most if points else most // POINTS, random)
                visible[asked] = judge(bounds, asked, k)
                open_[asked] &= not points
                open_ &= ~visible
            found.culled += int(by_some.sum())
            found.looked += len(asked)
            found.visible += int((visible & by_some).sum())
            for number in members:
                found.hides[number] += int((visible & culled[number]).sum())
                found.unclear[number] += int((open_ & culled[number]).sum()) if every_ray else 0
    return found


def _pick(first: Mask, second: Mask, room: int, random: np.random.Generator) -> Indices:
    """Members of `first` and some of `second`, at most `room`, by chance where there are more."""
    one, two = np.flatnonzero(first), np.flatnonzero(second)
    share = min(len(two), max(int(SHARE_OF_PROVEN * room), room - len(one)))
    one = one if len(one) <= room - share else random.choice(one, room - share, replace=False)
    two = two if len(two) <= share else random.choice(two, share, replace=False)
    return np.sort(np.concatenate([one, two]))


def _part(bounds: Bounds, which: Indices) -> Bounds:
    match bounds:
        case Spheres():
            return Spheres(bounds.centers[which], bounds.radii[which])
        case Boxes():
            return Boxes(bounds.min[which], bounds.max[which])
    return OrientedBoxes(bounds.centers[which], bounds.half_sizes[which], bounds.rotations[which])
