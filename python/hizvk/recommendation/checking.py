"""Checks that no candidate of `hizvk.recommend` hides what is visible.

With occluders and area coverage every ray counts, and what conservative depth hides is proven to be
hidden.
What a candidate culls beyond that is checked by rays in float64, from the camera to points of the
bounds, at the triangles (`blockers`).
It is visible or unclear; of a bare point a ray decides either way.

With depth images, or where only pixel centres count, the exact oracle (`hizvk.reference`) decides
on the full image as it is.
Where there is much to look at, a random part is looked at.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import reference
from ..bounds import are_points
from ..measuring.volumes import part_of
from ..resources import Instances
from .blockers import POINTS, Blockers, points_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ..bounds import Bounds
    from ..camera import Camera
    from ..depth import DepthArray
    from ..measuring.configuration import Configuration
    from ..progress import Progress
    from ..resources import Occluders

__all__ = ["CheckedCandidates", "Judge", "by_oracle", "by_rays", "hold"]

Mask: TypeAlias = npt.NDArray[np.bool_]
Indices: TypeAlias = npt.NDArray[np.intp]

#: Rays that are cast for each view and kind of bounds.
MOST_RAYS: Final = 60_000
#: Instances times `POINTS` that the oracle is asked about, likewise.
MOST_ORACLE: Final = 400 * POINTS
#: How bare points before a depth image are checked.
GUARD: Final = "a guard of half a pixel, since bare points lie on what the depth image shows"
#: In how many parts instances are looked at, where the time is limited.
PARTS: Final = 8
#: The part of them that goes to instances proven hidden, so that the proofs are checked, too.
SHARE_OF_PROVEN: Final = 0.125


@dataclass(frozen=True, eq=False)
class Judge:
    """Finds out which instances are certainly visible."""

    method: str
    """How, in words."""
    most: int
    """How many points it can look at, for each view and kind of bounds."""
    visible: Callable[[Bounds, Indices, int], Mask]
    """Of these bounds, the instances at these indices, in this view: which are visible."""


@dataclass(eq=False)
class CheckedCandidates:
    """What was looked at, and what was found."""

    method: str
    """How, in words."""
    hides: list[int]
    """By candidate: instances that it culls and that are visible."""
    unclear: list[int]
    """By candidate: instances that it culls, neither proven hidden nor found visible."""
    culled: int = 0
    """Instances that some candidate culls, summed over cameras and kinds of bounds."""
    looked: int = 0
    """How many of them were looked at."""
    visible: int = 0
    """How many of those are visible."""

    def words(self) -> str:
        """The method and the counts in one line."""
        return (
            f"{self.method}: {self.looked:,} of {self.culled:,} that some candidate culls, "
            f"{self.visible:,} visible"
        )


def by_rays(occluders: Occluders, cameras: Sequence[Camera]) -> Judge:
    """A judge that casts rays at the occluders' triangles."""
    vertices, triangles, faces = occluders._inner.surface()
    corners = vertices.reshape(-1, 3), triangles.reshape(-1, 3)
    made: dict[int, Blockers] = {}

    def visible(bounds: Bounds, which: Indices, k: int) -> Mask:
        if k not in made:
            made.clear()
            made[k] = Blockers(*corners, faces, cameras[k])
        points = points_of(bounds, which, cameras[k])
        clear = made[k].clear(points.reshape(-1, 3)).reshape(points.shape[:2])
        return np.asarray(clear.any(axis=1))

    return Judge(
        "rays to points of the bounds, at the occluders' triangles (float64)", MOST_RAYS, visible
    )


def by_oracle(
    image_of: Callable[[int], DepthArray], cameras: Sequence[Camera], coverage: Any
) -> Judge:
    """A judge that asks the oracle about the full image of a view."""

    def visible(bounds: Bounds, which: Indices, k: int) -> Mask:
        depth = image_of(k)
        codes = reference.classify(
            part_of(bounds, which),
            cameras[k],
            depth.numbers(),
            kind=depth.kind,
            scale=depth.scale,
            invalid=depth.invalid,
            coverage=coverage,
            own_depth="pixel",
        )
        mask: Mask = codes == reference.VISIBLE
        return mask

    what = "pixels" if coverage == "area" else "pixels' centres"
    return Judge(
        f"the exact oracle, at the {what} of the depth image as it is", MOST_ORACLE, visible
    )


def hold(
    chosen: Sequence[Configuration],
    masks: Sequence[Sequence[Mask]],
    alternatives: dict[str, Bounds | Instances],
    judge: Judge,
    *,
    every_ray: bool,
    steps: Progress,
    until: float = math.inf,
) -> CheckedCandidates:
    """Compares every candidate with what is visible.

    Parameters
    ----------
    chosen : sequence of Configuration
        The candidates.
    masks : sequence of sequence of (N,) bool array
        What each candidate (first index) keeps in each view (second index).
    alternatives : dict
        The bounds by kind.
    judge : Judge
        From `by_rays` or `by_oracle`.
    every_ray : bool
        True: every ray counts, so what conservative depth hides is proven to be hidden, and what it
        keeps is not.
        False: the image as it is counts.
        With bare points and a guard among the candidates, what the guard keeps then counts as
        visible.
        Such points lie on what the image shows, and it knows the depth only at its pixels' centres.
    steps : Progress
        Told of each view of each kind of bounds.
    until : float
        When to look at no further instances, by `time.monotonic`.
        What was not looked at stays unclear where every ray counts.
    """
    turns = len({one.volume for one in chosen} & set(alternatives)) * len(masks[0])
    found = CheckedCandidates(judge.method, [0] * len(chosen), [0] * len(chosen))
    random = np.random.default_rng(0)
    for volume in alternatives:
        members = [number for number, one in enumerate(chosen) if one.volume == volume]
        if not members:
            continue
        # Points beside volumes stand for these, so they may not hide what shows of a volume.
        judged = _judged(volume, list(alternatives))
        bounds = alternatives[judged]
        proven = [
            number
            for number, one in enumerate(chosen)
            if every_ray and one.volume == judged and one.promises_rays
        ]
        points = bounds._points if isinstance(bounds, Instances) else are_points(bounds)
        for k in range(len(masks[members[0]])):
            culled = {number: ~masks[number][k] for number in members}
            by_some = np.logical_or.reduce(list(culled.values()))
            hidden = np.zeros_like(by_some)
            if proven:
                hidden = np.logical_or.reduce([~masks[number][k] for number in proven])
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
                room = judge.most if points else judge.most // POINTS
                asked = _pick(first, by_some & ~first, room, random)
                # Without a look all stays unclear where every ray counts; the oracle looks at some.
                least = 0 if every_ray else 1
                asked, shown = _looked(judge, bounds, asked, k, until, turns, least)
                visible[asked] = shown
                open_[asked] &= not points
                open_ &= ~visible
            found.culled += int(by_some.sum())
            found.looked += len(asked)
            found.visible += int((visible & by_some).sum())
            for number in members:
                found.hides[number] += int((visible & culled[number]).sum())
                found.unclear[number] += int((open_ & culled[number]).sum()) if every_ray else 0
            turns -= 1
            steps.step("checking")
    return found


def _looked(
    judge: Judge, bounds: Bounds, asked: Indices, k: int, until: float, turns: int, least: int
) -> tuple[Indices, Mask]:
    """Those that were looked at, and which of them are visible, if `turns` share the time left.

    At least `least` parts of them are looked at.
    """
    if until == math.inf:
        return asked, judge.visible(bounds, asked, k)
    last = time.monotonic()
    until = last + (until - last) / turns
    looked, visible, took = [asked[:0]], [np.zeros(0, np.bool_)], 0.0
    for part in range(PARTS):
        if part >= least and last + took >= until:
            break
        looked.append(asked[part::PARTS])
        visible.append(judge.visible(bounds, looked[-1], k))
        now = time.monotonic()
        last, took = now, now - last
    return np.concatenate(looked), np.concatenate(visible)


def _judged(volume: str, given: Sequence[str]) -> str:
    """The kind of bounds by which candidates of a kind are checked."""
    others = [name for name in given if name != "points"]
    return others[0] if volume == "points" and others else volume


def _pick(first: Mask, second: Mask, room: int, random: np.random.Generator) -> Indices:
    """Members of `first` and some of `second`, at most `room`; a random part if there are more."""
    one, two = np.flatnonzero(first), np.flatnonzero(second)
    share = min(len(two), max(int(SHARE_OF_PROVEN * room), room - len(one)))
    one = one if len(one) <= room - share else random.choice(one, room - share, replace=False)
    two = two if len(two) <= share else random.choice(two, share, replace=False)
    return np.sort(np.concatenate([one, two]))
