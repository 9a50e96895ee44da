"""The numbers of a cull."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .timing import StageTime

__all__ = ["CullStats"]


@dataclass(frozen=True)
class CullStats:
    """The numbers of one cull.

    ``tested = outside + occluded + kept``.
    Of the kept ones, `invalid` have invalid bounds, and `unoccluded` surely show as a whole.
    These are the counts of `CullResult.verdicts`.
    The times are wall-clock times, except `gpu_ms`.
    """

    tested: int
    """Instances."""
    outside: int
    """Culled: `Verdict.OUTSIDE`."""
    occluded: int
    """Culled: `Verdict.OCCLUDED`."""
    kept: int
    """Not culled, `invalid` ones included, and those for which `capacity` left no place."""
    invalid: int
    """Kept because their bounds are invalid."""
    tested_groups: int
    """Groups of 64 that were tested as a whole: the first of `tested_boxes`."""
    tested_instances: int
    """Instances that were tested by themselves: all, or those of the groups that remained."""
    levels: tuple[int, ...] | None
    """How many groups and instances were compared with the pyramid on each level; None without
    ``statistics=True``."""
    texels_read: int | None
    """Texels of the pyramid that were read for it: one for each comparison with a depth.
    None without ``statistics=True``.

    A footprint of 2 x 2 counts as 4, and each step of a descent as 1.
    A comparison with the nearest depths counts as well."""
    record_ms: float
    """Milliseconds to make buffers and record the commands."""
    compile_ms: float
    """Milliseconds to make pipelines that did not exist yet, compiling by the driver included; 0
    for a cull like an earlier one."""
    wall_ms: float
    """Milliseconds from the submission until the device was seen to be done.

    Work that was submitted before and was not done yet counts, because it comes first.
    The device is asked by each read, wait and submission.
    So time that passes before the first of these counts, too."""
    readback_ms: float
    """Milliseconds spent so far on copying results to the host."""
    gpu_ms: float | None
    """Milliseconds of all stages on the device; None outside of a block of `Device.timed`.
    Also None where the device has no timestamps that can be trusted."""
    stages: tuple[StageTime, ...]
    """The stages of the cull; empty outside of a block of `Device.timed`."""
    unoccluded: int = 0
    """Kept and surely visible as a whole: `Verdict.UNOCCLUDED`.
    0 unless the pyramid has both ends."""
    absent: int = 0
    """Instances that are absent (`hizvk.ABSENT`); no other number counts them."""
    tested_boxes: tuple[int, ...] = (0, 0, 0)
    """Boxes that were tested, per tier: around 64, around 4,096 and around 262,144 instances."""
    accepted_instances: int = 0
    """Instances of groups that were kept as a whole, untested, because their box surely shows."""

    @property
    def comparisons(self) -> int:
        """Tests of boxes and of instances together; a cull without groups spends `tested`."""
        boxes = (self.tested_groups, *self.tested_boxes[1:])
        return sum(boxes) + self.tested_instances

    def __str__(self) -> str:
        culled = self.outside + self.occluded
        sure = f"{self.unoccluded:,} unoccluded, " if self.unoccluded else ""
        return (
            f"{self.tested:,} tested: {self.kept:,} kept ({sure}{self.invalid:,} invalid), "
            f"{culled:,} culled ({self.outside:,} outside, {self.occluded:,} occluded); "
            f"{self.wall_ms:.2f} ms until the device was done"
        )
