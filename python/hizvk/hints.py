"""Hints at mistakes in a cull that is right as it was asked: all is outside, or nothing can hide.

No hint changes a result.
Each says something that holds for all instances or all pixels, so a scene that is as it should be
gets none.
`hizvk.visible` warns of them (`HizWarning`), and `CullResult.hints` returns them.
That everything in view is hidden is often right, so `CullResult.hints` says it, and `visible` warns
of it only where the numbers tell more (`unit_hints`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

import numpy as np

from .bounds import Boxes, Points
from .camera import Camera, made_again
from .sparse import is_sparse
from .unit_hints import all_are_hidden, none_is_hidden

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._core import Counts
    from .bounds import Bounds
    from .options import CullOptions
    from .remembered import Remembered
    from .resources import Pyramid

__all__ = ["Counted", "Question", "Tally", "middles_of", "posed_otherwise"]

#: The most instances whose middles are looked at through other poses.
MOST_MIDDLES: Final = 4096
#: The level that is looked at first: where one of its texels is not far, depth is dense somewhere.
COARSE: Final = 3
#: OpenCV's camera axes from OpenGL's, and the reverse: half a turn about x.
TURNED: Final = np.diag([1.0, -1.0, -1.0, 1.0])


class Counted(Protocol):
    """How many instances got which verdict, as in `CullStats`."""

    @property
    def tested(self) -> int:
        """Instances."""
        ...

    @property
    def outside(self) -> int:
        """Culled: outside of the view."""
        ...

    @property
    def occluded(self) -> int:
        """Culled: hidden."""
        ...

    @property
    def kept(self) -> int:
        """Not culled."""
        ...

    @property
    def invalid(self) -> int:
        """Kept because their bounds are invalid."""
        ...


class Tally(NamedTuple):
    """The fields of `CullStats` that hints look at."""

    tested: int
    outside: int
    occluded: int
    kept: int
    invalid: int

    @classmethod
    def of(cls, counts: Counts) -> Tally:
        """From the counts of a cull."""
        kept = counts.visible + counts.unoccluded + counts.invalid
        return cls(counts.tested, counts.outside, counts.occluded, kept, counts.invalid)


# Not frozen: making a frozen one takes several times as long, and each cull makes one.
@dataclass(eq=False)
class Question:
    """What a cull was asked, for hints."""

    camera: Camera
    pyramid: Pyramid
    options: CullOptions
    points: bool
    """Whether all bounds have size zero."""
    remembered: Remembered | None = None
    """What was tested, where the host still knows it; for pictures."""

    def hints(self, stats: Counted, bounds: Bounds | None = None) -> tuple[str, ...]:
        """What looks like a mistake, in whole sentences; empty if nothing does.

        Parameters
        ----------
        stats : CullStats or Tally
            The answer.
        bounds : Spheres, Boxes, OrientedBoxes or Points, optional
            What was tested, to find the pose that was meant.
        """
        if not stats.tested:
            return ()
        if self.options.coverage == "sample" and self.points:
            return (
                "bounds, coverage: all sizes are zero, and a point covers no pixel's centre, "
                'so what can be seen is culled; use coverage="area"',
            )
        if stats.outside == stats.tested:
            # With sample coverage, what lies between the pixels' centres counts as outside, too.
            if self.options.coverage == "sample" and (
                bounds is None or _in_view(self.camera, bounds)
            ):
                return (
                    "bounds, coverage: nothing covers a pixel's centre: all are too small, "
                    'or outside of the view; coverage="area" keeps small ones',
                )
            return _outside(stats.tested, self.camera, self._known_bounds(bounds))
        if 2 * stats.invalid > stats.tested:
            share = "all" if stats.invalid == stats.tested else f"{stats.invalid:,} of"
            return (
                f"bounds: {share} {stats.tested:,} are invalid, so they are kept: a number is NaN "
                "or infinite or too large for float32, a size is negative, or min is above max",
            )
        if stats.kept == stats.invalid:
            return self._all_hidden(bounds) if stats.occluded else ()
        return () if stats.occluded else self._depth(bounds)

    def _all_hidden(self, bounds: Bounds | None) -> tuple[str, ...]:
        return all_are_hidden(
            self.camera, middles_of(self._known_bounds(bounds)), self.depths, asked=True
        )

    def _known_bounds(self, bounds: Bounds | None) -> Bounds | None:
        return bounds if bounds is not None or self.remembered is None else self.remembered.bounds()

    def depths(self) -> npt.NDArray[np.float64]:
        """View depths of the coarsest level that still says much; empty if the camera has none."""
        level = max((k for k in self.pyramid.levels if k <= COARSE), default=0)
        try:
            return self.pyramid.level(level, kind="z").astype(np.float64)
        except ValueError:  # an orthographic camera made from a bare matrix
            return np.zeros((0, 0))

    def _known(self, level: int) -> npt.NDArray[np.bool_]:
        """The texels of a level that can hide something: those with a depth that is not far."""
        depth = self.pyramid.level(level)
        if self.camera.reversed_z:
            return (depth > 0.0) & (depth <= 1.0)
        return (depth >= 0.0) & (depth < 1.0)

    def _depth(self, bounds: Bounds | None) -> tuple[str, ...]:
        """Hints at an image that hid nothing of what is in view."""
        coarse = max((k for k in self.pyramid.levels if k <= COARSE), default=0)
        if self._known(coarse).any():
            if self.pyramid._is_rendered:
                return ()  # in the units of the occluders
            middles = middles_of(self._known_bounds(bounds))
            return none_is_hidden(self.camera, middles, self.depths, self.pyramid._source.given)
        known = self._known(0)
        if not known.any():
            return (
                "depth: every pixel is far, so nothing can be hidden; if something should be "
                "there, check its numbers, kind and scale: what is infinite or NaN, or does not "
                "lie between the camera's near and far planes, counts as no data",
            )
        if self.pyramid._is_rendered:
            return ()  # no depth is missing: what is far is sky
        if is_sparse(known):
            return (
                f"depth: {100.0 * known.mean():.1f} % of the pixels have a depth, and hardly any "
                "2x2 of them all four; empty ones are far, so next to nothing can be hidden; if "
                "depth is missing there (a LiDAR, not the sky), hizvk.fill_depth fills it and "
                "says what that costs the promise",
            )
        return ()


def _outside(count: int, camera: Camera, bounds: Bounds | None) -> tuple[str, ...]:
    all_ = f"all {count:,} lie" if count > 1 else "the only one lies"
    said = f"bounds, camera: {all_} outside of the view"
    if count == 1:
        return ()  # a single instance is often outside, with nothing wrong
    others = posed_otherwise(camera) if bounds is not None else []
    fits = [(what, seen) for what, other in others if (seen := _in_view(other, bounds))]
    if fits:
        # Several may fit, and nothing here tells which one is meant.
        found = ", or ".join(f"{seen:,} would be inside of it with {what}" for what, seen in fits)
        return (f"{said}, and {found}",)
    return (
        f"{said}; if that is not meant, check the pose's direction (camera_from_world or "
        "world_from_camera), its convention (from_opencv looks along +z, from_opengl along -z) "
        "and the units",
    )


def posed_otherwise(camera: Camera) -> list[tuple[str, Camera]]:
    """The camera with each pose that may have been meant, and words for it; may be empty."""
    name, recipe = camera._recipe
    arguments: dict[str, Any] = dict(recipe)
    if name == "resized":
        inner: Camera = arguments["camera"]
        return [(what, other.resized(arguments["size"])) for what, other in posed_otherwise(inner)]
    ways = ("camera_from_world", "world_from_camera")
    given = [way for way in ways if arguments.get(way) is not None]
    if len(given) != 1:
        return []
    way = given[0]
    pose = np.asarray(arguments.pop(way), np.float64)
    if pose.shape != (4, 4):
        return []
    other_way = ways[1 - ways.index(way)]
    turned = TURNED @ pose if way == ways[0] else pose @ TURNED
    axes = "the camera's y and z turned round, as between the poses of OpenCV and OpenGL"
    return [
        (axes, made_again(name, {way: turned, **arguments})),
        (f"the pose as {other_way}", made_again(name, {other_way: pose, **arguments})),
    ]


def _in_view(camera: Camera, bounds: Bounds | None) -> int:
    """How many middles of bounds lie in the view; of many bounds, some are looked at."""
    middles = middles_of(bounds)
    clip = np.c_[middles, np.ones(len(middles))] @ camera.clip_from_world.T
    x, y, z, w = clip.T
    with np.errstate(invalid="ignore"):
        return int(((np.abs(x) <= w) & (np.abs(y) <= w) & (z >= 0.0) & (z <= w) & (w > 0.0)).sum())


def middles_of(bounds: Bounds | None) -> npt.NDArray[np.float64]:
    """``(N, 3)``: the middles of bounds; of many bounds, some are looked at."""
    match bounds:
        case None:
            return np.zeros((0, 3))
        case Boxes():
            low, high = (
                np.asarray(corner[_some(bounds)], np.float64) for corner in (bounds.min, bounds.max)
            )
            return 0.5 * (low + high)
        case Points():
            return np.asarray(bounds.positions[_some(bounds)], np.float64)
    return np.asarray(bounds.centers[_some(bounds)], np.float64)


def _some(bounds: Bounds) -> slice:
    return slice(None, None, max(1, len(bounds) // MOST_MIDDLES))
