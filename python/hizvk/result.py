"""What a cull answers: who is visible, in a mask, a list and draw arguments, and how each verdict came about.

Nothing is read from the device before it is asked for; what was read is kept. The arrays are shared with the next one
who asks, so they are read-only: ``.copy()`` gives one to write to.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from . import _arguments
from ._processes import cached_property

if TYPE_CHECKING:
    import numpy.typing as npt

    from . import _core
    from .hints import Question

__all__ = ["DRAW_DTYPE", "CullResult", "CullStats", "DrawTemplate", "Explanation", "Verdict"]

#: One record of Vulkan's ``VkDrawIndexedIndirectCommand`` (WebGPU's ``DrawIndexedIndirect``): 20 bytes.
DRAW_DTYPE: np.dtype[np.void] = np.dtype(
    [
        ("index_count", "<u4"),
        ("instance_count", "<u4"),
        ("first_index", "<u4"),
        ("base_vertex", "<i4"),
        ("first_instance", "<u4"),
    ]
)


class Verdict(enum.IntEnum):
    """What a cull decides about one instance; the codes of `CullResult.verdicts`."""

    OUTSIDE = 0
    """Surely outside the view volume: culled."""
    OCCLUDED = 1
    """Surely behind what the depth image shows: culled."""
    VISIBLE = 2
    """Kept: visible, or not provably hidden."""
    INVALID = 3
    """Kept: its bounds are no volume (NaN, infinite, negative size, min > max, or too large to compute with)."""


@dataclass(frozen=True)
class DrawTemplate:
    """What a draw of the visible instances has in its arguments beside their count.

    Parameters
    ----------
    index_count : int
        Indices of the mesh.
    first_index : int
        Where they start in the index buffer.
    base_vertex : int
        Added to each index; may be negative.
    first_instance : int
        The first instance id of the draw.
    """

    index_count: int
    first_index: int = 0
    base_vertex: int = 0
    first_instance: int = 0

    def __post_init__(self) -> None:
        for name in ("index_count", "first_index", "first_instance"):
            value = _arguments.integer(name, getattr(self, name), low=0, high=2**32 - 1)
            object.__setattr__(self, name, value)
        value = _arguments.integer("base_vertex", self.base_vertex, low=-(2**31), high=2**31 - 1)
        object.__setattr__(self, "base_vertex", value)


@dataclass(frozen=True)
class CullStats:
    """The numbers of one cull.

    ``tested = outside + occluded + kept``, and `invalid` of those that were kept have no valid bounds.
    """

    tested: int
    """Instances."""
    outside: int
    """Culled: surely outside the view volume."""
    occluded: int
    """Culled: surely behind the depth image."""
    kept: int
    """Not culled, `invalid` ones included (also those for which `capacity` left no place)."""
    invalid: int
    """Kept because their bounds are no volume."""
    tested_groups: int
    """Groups of 64 that were tested as a whole."""
    tested_instances: int
    """Instances that were tested by themselves: all, or those of the groups that were left."""
    levels: tuple[int, ...] | None
    """How many instances were compared with the pyramid on each level; None without ``statistics=True``."""
    texels_read: int | None
    """Texels of the pyramid that were read for it; None without ``statistics=True``."""
    record_ms: float
    """Milliseconds to record and submit the commands."""
    gpu_ms: float
    """Milliseconds from the submission until the device was done, by the clock on the wall."""
    readback_ms: float
    """Milliseconds spent so far on copying results to the host."""

    @property
    def comparisons(self) -> int:
        """Tests spent, of groups and of instances; a flat cull spends `tested`."""
        return self.tested_groups + self.tested_instances

    def __str__(self) -> str:
        culled = self.outside + self.occluded
        return (
            f"{self.tested:,} tested: {self.kept:,} kept ({self.invalid:,} invalid), {culled:,} culled "
            f"({self.outside:,} outside, {self.occluded:,} occluded); {self.gpu_ms:.2f} ms on the device"
        )


@dataclass(frozen=True)
class Explanation:
    """How the verdict of one instance came about."""

    index: int
    """The instance."""
    verdict: Verdict
    """The verdict."""
    reason: str
    """Which step decided, in words."""
    rectangle: tuple[int, int, int, int] | None
    """Pixels ``(x0, y0, x1, y1)`` that its bounds can meet, both ends included, row 0 on top; None if it never came
    to that."""
    level: int | None
    """The level of the pyramid that was read."""
    texels: tuple[tuple[int, int], ...]
    """The texels ``(x, y)`` that were read there."""
    texel_depths: tuple[float, ...]
    """Their depths (NDC)."""
    farthest: float | None
    """The farthest of them."""
    nearest: float | None
    """The nearest depth (NDC) that the bounds can have."""

    def __str__(self) -> str:
        lines = [f"instance {self.index}: {self.verdict.name.lower()} ({self.reason})"]
        if self.rectangle is not None:
            x0, y0, x1, y1 = self.rectangle
            lines.append(f"  pixels    x {x0}..{x1}, y {y0}..{y1}")
        if self.level is not None:
            read = ", ".join(
                f"({x}, {y}): {depth:.9g}" for (x, y), depth in zip(self.texels, self.texel_depths, strict=True)
            )
            lines.append(f"  level     {self.level}, texels {read}")
        if self.farthest is not None:
            lines.append(f"  farthest  {self.farthest:.9g} (depth image)")
        if self.nearest is not None:
            lines.append(f"  nearest   {self.nearest:.9g} (bounds)")
        return "\n".join(lines)


def _frozen(array: npt.NDArray[np.generic]) -> npt.NDArray[np.generic]:
    array.setflags(write=False)
    return array


class CullResult:
    """The answer of `Device.cull`; reading any part of it waits for the device.

    Not made by hand. May be read from any thread.
    """

    def __init__(self, culling: _core.Culling, statistics: bool, question: Question | None = None) -> None:
        self._culling = culling
        self._statistics = statistics
        self._question = question

    def __len__(self) -> int:
        """The number of instances that were tested."""
        return self._culling.num_instances()

    @cached_property
    def verdicts(self) -> npt.NDArray[np.uint8]:
        """``(N,)`` uint8: the `Verdict` of each instance."""
        return _frozen(self._culling.verdicts())  # type: ignore[return-value]

    @cached_property
    def mask(self) -> npt.NDArray[np.bool_]:
        """``(N,)`` bool: True for what is kept. It holds every instance, whatever the capacity."""
        return _frozen(self._culling.mask())  # type: ignore[return-value]

    @cached_property
    def indices(self) -> npt.NDArray[np.uint32]:
        """``(count,)`` uint32: the instances in the draw's list; ascending for ``order="stable"``."""
        return _frozen(self._culling.indices())  # type: ignore[return-value]

    @cached_property
    def draws(self) -> npt.NDArray[np.void]:
        """``(D,)`` of `DRAW_DTYPE`: the indirect draw arguments, one record for each piece of the instances."""
        return np.frombuffer(self._culling.draws(), dtype=DRAW_DTYPE)

    @cached_property
    def _counts(self) -> _core.Counts:
        return self._culling.counts()

    @cached_property
    def _demand_and_written(self) -> tuple[int | None, int]:
        return self._culling.demand_and_written()

    @property
    def count(self) -> int:
        """Instances in the draw's list: `demand`, or less where the capacity was too small."""
        return self._demand_and_written[1]

    @property
    def demand(self) -> int:
        """Instances that were kept and belong into the list; more than `count` if the capacity was too small.

        Raises
        ------
        ValueError
            For a full list of a cull that was asked for nothing else: ask for ``"mask"`` or ``"verdicts"`` as well.
        """
        demand = self._demand_and_written[0]
        if demand is None:
            raise ValueError('outputs: expected "mask" or "verdicts" beside a list that is full, got neither')
        return demand

    @property
    def stats(self) -> CullStats:
        """Counts and milliseconds."""
        counts = self._counts
        record_ms, gpu_ms, readback_ms = self._culling.timings()
        return CullStats(
            tested=counts.tested,
            outside=counts.outside,
            occluded=counts.occluded,
            kept=counts.visible + counts.invalid,
            invalid=counts.invalid,
            tested_groups=counts.tested_groups,
            tested_instances=counts.tested_instances,
            levels=tuple(counts.levels) if self._statistics else None,
            texels_read=counts.texels_read if self._statistics else None,
            record_ms=record_ms,
            gpu_ms=gpu_ms,
            readback_ms=readback_ms,
        )

    def hints(self) -> tuple[str, ...]:
        """What looks like a mistake, in sentences; empty where nothing does.

        Everything outside of the view, points of size zero with ``coverage="sample"``, depth that is far everywhere or
        sparse. It is cheap beside a cull, but for an image that hides nothing, which may be read back.

        Raises
        ------
        ValueError
            As `stats`, where the cull was not asked for verdicts.
        """
        return () if self._question is None else self._question.hints(self.stats)

    def explain(self, index: int) -> Explanation:
        """Pixel rectangle, level, texels, depths and verdict of one instance.

        Parameters
        ----------
        index : int
            The instance, ``0 <= index < len(self)``.

        Raises
        ------
        TypeError
            If it is no integer.
        IndexError
            If there is no such instance.
        """
        count = len(self)
        try:
            index = _arguments.integer("index", index, low=0, high=count - 1)
        except ValueError:
            expected = f"an integer in 0..{count - 1}" if count else "nothing, for there are no instances"
            raise IndexError(f"index: expected {expected}, got {index}") from None
        told = self._culling.explain(index)
        rectangle = None if told.rectangle is None else tuple(told.rectangle)
        return Explanation(
            index=index,
            verdict=Verdict(told.verdict),
            reason=told.reason,
            rectangle=rectangle,  # type: ignore[arg-type]
            level=told.level,
            texels=tuple((x, y) for x, y in told.texels),
            texel_depths=tuple(told.texel_depths),
            farthest=told.farthest,
            nearest=told.nearest,
        )

    def __repr__(self) -> str:
        return f"<CullResult of {len(self)} instances>"
