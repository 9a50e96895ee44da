"""What a cull decides about an instance, and how it came to that verdict."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Final, Protocol

from .pictured import PicturedExplanation

if TYPE_CHECKING:
    from typing import Any

    import numpy as np
    import numpy.typing as npt

    from ._core import Explanation as CoreExplanation
    from .camera import Camera
    from .show.explained import Explained

__all__ = ["Explanation", "Verdict", "explanation_of"]


class Verdict(enum.IntEnum):
    """What a cull decides about one instance; the codes of `CullResult.verdicts`.

    An instance that is both outside and hidden by the depth image is `OUTSIDE`, also if its group
    of 64 was hidden as a whole.
    So verdicts do not depend on ``hierarchy=``, with one exception: the few instances that only the
    test of their group hides are `OCCLUDED`.
    """

    OUTSIDE = 0
    """Culled: surely outside the view volume, or for ``coverage="sample"`` between all pixel
    centres."""
    OCCLUDED = 1
    """Culled: surely behind what the depth image shows, and not surely outside."""
    VISIBLE = 2
    """Kept: visible, or not provably hidden, and not `UNOCCLUDED`."""
    INVALID = 3
    """Kept: its bounds are invalid (NaN, infinite, a negative size, min > max, or too large to
    compute with)."""
    UNOCCLUDED = 4
    """Kept: surely visible as a whole.

    All of the bounds lie inside the view volume.
    Every pixel that they touch holds a depth farther than all of them.
    So nothing in the depth image hides any part of them, and a test of each pixel may be skipped.
    Only with a pyramid of both ends, ``Device.pyramid(depths="both")``; `VISIBLE` otherwise."""


class _Levels(Protocol):
    """The `Pyramid` of an explanation, as this module knows it."""

    @property
    def camera(self) -> Camera: ...
    def level(self, k: int) -> npt.NDArray[np.float32]: ...


@dataclass(frozen=True)
class Explanation(PicturedExplanation):
    """How the verdict of one instance came about: the cull's test of it, run once more.

    A member of a group of 64 that was culled as a whole was never tested by itself.
    Its verdict is that of the group (see `group`), or `Verdict.OUTSIDE` where its own test says so.
    Everything else here is from its own test, which may have kept it.
    """

    index: int
    """The instance."""
    verdict: Verdict
    """The verdict."""
    reason: str
    """Which step decided, in words."""
    rectangle: tuple[int, int, int, int] | None
    """Pixels ``(x0, y0, x1, y1)`` that its bounds can meet, both ends included, row 0 on top.
    None if the test ended before."""
    level: int | None
    """The level of the pyramid that the footprint was read from."""
    texels: tuple[tuple[int, int], ...]
    """The texels ``(x, y)`` that were read, in order: those of the footprint, then those of a
    descent. At most the first 4,096 are listed."""
    texel_depths: tuple[float, ...]
    """Their depths (NDC)."""
    texel_levels: tuple[int, ...]
    """Their levels."""
    texels_read: int
    """How many texels were read, listed or not."""
    decisive: int | None
    """The place in the list of the texel that decided: the farthest one that hides the instance, or
    the one that does not hide it. None where no single texel did, or it is not listed."""
    farthest: float | None
    """The farthest depth (NDC) of the texels that hide it, or the depth that does not hide it."""
    nearest: float | None
    """The nearest depth (NDC) that the bounds can have, an estimate."""
    farthest_z: float | None
    """`farthest` as view depth in world units, infinite for far. None where NDC depth alone does
    not tell it: for an orthographic camera made from a bare matrix, or an oblique near plane."""
    nearest_z: float | None
    """`nearest` as view depth in world units. None for an orthographic camera made from a bare
    matrix."""
    in_front_of: float | None
    """The nearest depth (NDC) of the texels, which all of an `UNOCCLUDED` instance is nearer than.
    Of another, a depth that it is not surely nearer than, or it is not surely inside the view.
    None for a pyramid of one end, and where the texels reach the near plane."""
    in_front_of_z: float | None
    """`in_front_of` as view depth in world units; see `farthest_z`."""
    stale: bool
    """Whether the instance was updated since the cull. Then all of this is about its new bounds,
    and the verdict of the cull may be another."""
    group: Explanation | None
    """For a member of a group that was decided as a whole: the test of the box around the group.
    None for all others."""

    #: What was read, for `plot`; it is no part of the value, and copies are without it.
    _pyramid: ClassVar[_Levels | None] = None

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_pyramid"}

    def _is_drawable(self) -> bool:
        return self._pyramid is not None

    def _explained(self, unit: str) -> Explained:
        if self._pyramid is None:
            raise ValueError(
                "the explanation has lost its pyramid: it was copied or pickled; "
                "CullResult.explain gives one that can be drawn"
            )
        from .show.explained import explained_of

        return explained_of(self, self._pyramid.camera, self._pyramid.level(0), unit)

    def __str__(self) -> str:
        lines = [f"instance {self.index}: {self.verdict.name.lower()} ({self.reason})"]
        if self.stale:
            lines.append("  stale     updated since the cull: this is a test of its new bounds")
        lines += self._lines()
        if self.group is not None:
            updated = ", updated since the cull" if self.group.stale else ""
            lines.append(f"  the box around its group{updated}: {self.group.verdict.name.lower()}")
            lines += [f"  {line}" for line in self.group._lines()]
        return "\n".join(lines)

    def _lines(self) -> list[str]:
        lines = []
        if self.rectangle is not None:
            x0, y0, x1, y1 = self.rectangle
            lines.append(f"  pixels    x {x0}..{x1}, y {y0}..{y1}")
        lines += self._reads()
        for name, depth, z, what in (
            ("farthest", self.farthest, self.farthest_z, "depth image"),
            ("nearest ", self.nearest, self.nearest_z, "bounds"),
            ("in front", self.in_front_of, self.in_front_of_z, "nearest in the depth image"),
        ):
            if depth is not None:
                view = "" if z is None else f", view depth {z:.6g}"
                lines.append(f"  {name}  {depth:.9g}{view} ({what})")
        return lines

    def _reads(self) -> list[str]:
        """A line for each of the first runs of texels of one level, and one for the decisive."""
        lines = []
        count = len(self.texels)
        levels = self.texel_levels
        starts = [i for i in range(count) if i == 0 or levels[i] != levels[i - 1]]
        for start, end in zip(starts[:SHOWN_RUNS], [*starts[1:], count], strict=False):
            shown = slice(start, min(end, start + SHOWN_TEXELS))
            texels = ", ".join(
                f"({x}, {y}): {depth:.9g}"
                for (x, y), depth in zip(self.texels[shown], self.texel_depths[shown], strict=True)
            )
            more = f" and {end - shown.stop} more" if end > shown.stop else ""
            lines.append(f"  level     {self.texel_levels[start]}, texels {texels}{more}")
        left_out = self.texels_read - (starts[SHOWN_RUNS] if len(starts) > SHOWN_RUNS else count)
        if left_out > 0:
            lines.append(f"  and       {left_out:,} more texels")
        if self.decisive is not None and count > 1:
            (x, y), level = self.texels[self.decisive], self.texel_levels[self.decisive]
            lines.append(f"  decisive  ({x}, {y}) of level {level}")
        return lines


#: How many runs of texels of one level the text of an explanation shows.
SHOWN_RUNS: Final = 12
#: How many texels of a run it shows.
SHOWN_TEXELS: Final = 16


def explanation_of(index: int, told: CoreExplanation, pyramid: _Levels) -> Explanation:
    """The explanation of instance `index`, from what the compiled module tells of a pyramid."""
    rectangle = None if told.rectangle is None else tuple(told.rectangle)
    texels = told.texels
    made = Explanation(
        index=index,
        verdict=Verdict(told.verdict),
        reason=told.reason,
        rectangle=rectangle,  # type: ignore[arg-type]
        level=told.level,
        texels=tuple((x, y) for _, x, y, _ in texels),
        texel_depths=tuple(depth for *_, depth in texels),
        texel_levels=tuple(level for level, *_ in texels),
        texels_read=told.texels_read,
        decisive=told.decisive,
        farthest=told.farthest,
        nearest=told.nearest,
        farthest_z=told.farthest_z,
        nearest_z=told.nearest_z,
        in_front_of=told.in_front_of,
        in_front_of_z=told.in_front_of_z,
        stale=told.stale,
        group=None if told.group is None else explanation_of(index, told.group, pyramid),
    )
    object.__setattr__(made, "_pyramid", pyramid)
    return made
