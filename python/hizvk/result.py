"""What a cull answers: who is visible, in a mask, a list and draw arguments, and how each verdict came about.

Nothing is read from the device before it is asked for; what was read is kept.
The arrays are shared with the next one who asks, so they are read-only: ``.copy()`` gives one to
write to, and DLPack (``torch.from_dlpack``) gets a copy.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

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
    """What a cull decides about one instance; the codes of `CullResult.verdicts`.

    What is outside and hidden by the depth image as well is `OUTSIDE`, also as a member of a group
    of 64 that was hidden as a whole.
    So verdicts do not depend on ``hierarchy=``, but for the few instances that a group's test hides
    and their own would keep: those are `OCCLUDED`.
    """

    OUTSIDE = 0
    """Surely outside the view volume, or for ``coverage="sample"`` between all pixel centres:
    culled."""
    OCCLUDED = 1
    """Surely behind what the depth image shows, and not surely outside: culled."""
    VISIBLE = 2
    """Kept: visible, or not provably hidden."""
    INVALID = 3
    """Kept: its bounds are no volume (NaN, infinite, negative size, min > max, or too large to
    compute with)."""


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

    ``tested = outside + occluded + kept``, and `invalid` of those that were kept have no valid
    bounds.
    They are the counts of `CullResult.verdicts`.
    The four times are told by the clock on the wall.
    """

    tested: int
    """Instances."""
    outside: int
    """Culled: `Verdict.OUTSIDE`."""
    occluded: int
    """Culled: `Verdict.OCCLUDED`."""
    kept: int
    """Not culled, `invalid` ones included (also those for which `capacity` left no place)."""
    invalid: int
    """Kept because their bounds are no volume."""
    tested_groups: int
    """Groups of 64 that were tested as a whole."""
    tested_instances: int
    """Instances that were tested by themselves: all, or those of the groups that were left."""
    levels: tuple[int, ...] | None
    """How many groups and instances were compared with the pyramid on each level; None without
    ``statistics=True``."""
    texels_read: int | None
    """Texels of the pyramid that were read for it; None without ``statistics=True``."""
    record_ms: float
    """Milliseconds to make buffers and record the commands."""
    compile_ms: float
    """Milliseconds to make the pipelines that were not there yet, the driver's own compiling
    included; 0 for a cull like an earlier one."""
    wall_ms: float
    """Milliseconds from the submission until the device was seen to be done. What was submitted
    before it and was not done yet comes first, so it counts. The device tells when it is asked: by
    each read, wait and submission. Who does something else before the first of them finds more than
    the device took."""
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
            f"({self.outside:,} outside, {self.occluded:,} occluded); "
            f"{self.wall_ms:.2f} ms until the device was done"
        )


@dataclass(frozen=True)
class Explanation:
    """How the verdict of one instance came about: the cull's own test of it, run once more.

    A member of a group of 64 that was hidden as a whole was never tested by itself.
    Its verdict is the group's (see `group`), or `Verdict.OUTSIDE` where its own test says so.
    Everything else here is its own test, which may have kept it.
    """

    index: int
    """The instance."""
    verdict: Verdict
    """The verdict."""
    reason: str
    """Which step decided, in words."""
    rectangle: tuple[int, int, int, int] | None
    """Pixels ``(x0, y0, x1, y1)`` that its bounds can meet, both ends included, row 0 on top; None
    if it never came to that."""
    level: int | None
    """The level of the pyramid that the footprint was read from."""
    texels: tuple[tuple[int, int], ...]
    """The texels ``(x, y)`` that were read, in order: those of the footprint, then those of a
    descent; at most the first 4,096."""
    texel_depths: tuple[float, ...]
    """Their depths (NDC)."""
    texel_levels: tuple[int, ...]
    """Their levels."""
    texels_read: int
    """How many were read, those that are not listed included."""
    decisive: int | None
    """Which of the listed texels decided: the farthest one that hides it, or the one that does not.
    None where no single one did or it is not listed."""
    farthest: float | None
    """The farthest depth (NDC) of those that hide it, or the depth that does not."""
    nearest: float | None
    """The nearest depth (NDC) that the bounds can have, an estimate."""
    farthest_z: float | None
    """`farthest` as view depth in world units, infinite for far. None where the camera's NDC depth
    alone does not tell it: an orthographic camera made from a bare matrix, an oblique near
    plane."""
    nearest_z: float | None
    """`nearest` as view depth in world units. None for an orthographic camera made from a bare
    matrix."""
    stale: bool
    """Whether the instance was updated since the cull. Then all this is of its new bounds, and the
    cull's verdict may be another."""
    group: Explanation | None
    """For a member of a group that was hidden as a whole: the test of the box around the group.
    None for all others."""

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
        ):
            if depth is not None:
                view = "" if z is None else f", view depth {z:.6g}"
                lines.append(f"  {name}  {depth:.9g}{view} ({what})")
        return lines

    def _reads(self) -> list[str]:
        """A line for each run of texels of one level, and one for the decisive one; of many, some."""
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


#: What the text of an explanation shows: runs of texels of one level, and texels of a run.
SHOWN_RUNS: Final = 12
SHOWN_TEXELS: Final = 16


class SharedArray(np.ndarray):
    """A read-only array that all who ask for it share.

    What is computed from it is a plain array, and whoever imports it by DLPack gets a copy.
    An older DLPack cannot say that memory is read-only, so NumPy refuses to export such arrays, and
    consumers of the newer one need not heed it.
    """

    def __dlpack__(self, **options: Any) -> Any:
        """A capsule of a copy, to be written to; ``copy=False`` is refused as by NumPy."""
        if self.flags.writeable or options.get("copy") is False:
            return super().__dlpack__(**options)
        return np.array(self, copy=True, subok=False).__dlpack__(**options)

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        """What a ufunc makes of it is no shared array."""
        return array[()] if return_scalar or array.ndim == 0 else array.view(np.ndarray)

    def __reduce__(self) -> Any:
        return self.view(np.ndarray).__reduce__()

    def __repr__(self) -> str:
        return repr(self.view(np.ndarray))


def _shared(array: npt.NDArray[np.generic]) -> Any:
    shared = array.view(SharedArray)
    shared.setflags(write=False)
    return shared


def _explanation(index: int, told: _core.Explanation) -> Explanation:
    rectangle = None if told.rectangle is None else tuple(told.rectangle)
    texels = told.texels
    return Explanation(
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
        stale=told.stale,
        group=None if told.group is None else _explanation(index, told.group),
    )


class CullResult:
    """The answer of `Device.cull`; reading any part of it waits for the device.

    Not made by hand.
    May be read from any thread.
    """

    def __init__(
        self, culling: _core.Culling, statistics: bool, question: Question | None = None
    ) -> None:
        self._culling = culling
        self._statistics = statistics
        self._question = question

    def __len__(self) -> int:
        """The number of instances that were tested."""
        return self._culling.num_instances()

    @cached_property
    def verdicts(self) -> npt.NDArray[np.uint8]:
        """``(N,)`` uint8: the `Verdict` of each instance.

        It is of the bounds that were culled, also where they were updated before it is read.
        """
        return _shared(self._culling.verdicts())  # type: ignore[no-any-return]

    @cached_property
    def mask(self) -> npt.NDArray[np.bool_]:
        """``(N,)`` bool: True for what is kept. It holds every instance, whatever the capacity."""
        return _shared(self._culling.mask())  # type: ignore[no-any-return]

    @cached_property
    def indices(self) -> npt.NDArray[np.uint32]:
        """``(count,)`` uint32: the instances in the draw's list; ascending for ``order="stable"``."""
        return _shared(self._culling.indices())  # type: ignore[no-any-return]

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
            For a full list of a cull that was asked for nothing else: ask for ``"mask"`` or
            ``"verdicts"`` as well.
        """
        demand = self._demand_and_written[0]
        if demand is None:
            raise ValueError(
                'outputs: expected "mask" or "verdicts" beside a list that is full, got neither'
            )
        return demand

    @property
    def stats(self) -> CullStats:
        """Counts and milliseconds.

        Raises
        ------
        ValueError
            Of a cull that was not asked for verdicts.
        """
        counts = self._counts
        record_ms, compile_ms, wall_ms, readback_ms = self._culling.timings()
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
            compile_ms=compile_ms,
            wall_ms=wall_ms,
            readback_ms=readback_ms,
        )

    def hints(self) -> tuple[str, ...]:
        """What looks like a mistake, in sentences; empty where nothing does.

        Everything outside of the view, points of size zero with ``coverage="sample"``, depth that
        is far everywhere or sparse.
        It is cheap beside a cull, but for an image that hides nothing, which may be read back.

        Raises
        ------
        ValueError
            As `stats`, where the cull was not asked for verdicts.
        """
        return () if self._question is None else self._question.hints(self.stats)

    def explain(self, index: int) -> Explanation:
        """Pixel rectangle, level, texels, depths and verdict of one instance.

        The test is run again, of the bounds as they are now; `Explanation.stale` says where those
        are not the ones that were culled.

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
            expected = (
                f"an integer in 0..{count - 1}" if count else "nothing, for there are no instances"
            )
            raise IndexError(f"index: expected {expected}, got {index}") from None
        return _explanation(index, self._culling.explain(index))

    def __repr__(self) -> str:
        return f"<CullResult of {len(self)} instances>"
