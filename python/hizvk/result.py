"""What a cull answers: who is visible, in a mask, a list and draw arguments, and how each verdict came about.

Nothing is read from the device before it is asked for; what was read is kept.
The arrays are shared with the next one who asks, so they are read-only: ``.copy()`` gives one to
write to, and DLPack (``torch.from_dlpack``) gets a copy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import _arguments, _core
from ._on_device import OnDevice
from ._processes import cached_property
from .explanation import explanation_of
from .stats import CullStats

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._on_device import Maker
    from .explanation import Explanation
    from .hints import Question

__all__ = ["DRAW_DTYPE", "CullResult"]

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


class CullResult(OnDevice[_core.Culling]):
    """The answer of `Device.cull`; reading any part of it waits for the device.

    Not made by hand.
    May be read from any thread.
    """

    def __init__(self, device: Maker, culling: _core.Culling, question: Question) -> None:
        super().__init__(device, culling)
        self._question = question

    def __len__(self) -> int:
        """The number of instances that were tested."""
        return self._inner.num_instances()

    @cached_property
    def verdicts(self) -> npt.NDArray[np.uint8]:
        """``(N,)`` uint8: the `Verdict` of each instance.

        It is of the bounds that were culled, also where they were updated before it is read.
        """
        return _shared(self._inner.verdicts())  # type: ignore[no-any-return]

    @cached_property
    def mask(self) -> npt.NDArray[np.bool_]:
        """``(N,)`` bool: True for what is kept. It holds every instance, whatever the capacity."""
        return _shared(self._inner.mask())  # type: ignore[no-any-return]

    @cached_property
    def indices(self) -> npt.NDArray[np.uint32]:
        """``(count,)`` uint32: the instances in the draw's list; ascending for ``order="stable"``."""
        return _shared(self._inner.indices())  # type: ignore[no-any-return]

    @cached_property
    def draws(self) -> npt.NDArray[np.void]:
        """``(D,)`` of `DRAW_DTYPE`: the indirect draw arguments, one record for each piece of the instances."""
        return np.frombuffer(self._inner.draws(), dtype=DRAW_DTYPE)

    @cached_property
    def _counts(self) -> _core.Counts:
        return self._inner.counts()

    @cached_property
    def _demand_and_written(self) -> tuple[int | None, int]:
        return self._inner.demand_and_written()

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
        counted = self._question.options.statistics
        record_ms, compile_ms, wall_ms, readback_ms = self._inner.timings()
        return CullStats(
            tested=counts.tested,
            outside=counts.outside,
            occluded=counts.occluded,
            kept=counts.visible + counts.invalid,
            invalid=counts.invalid,
            tested_groups=counts.tested_groups,
            tested_instances=counts.tested_instances,
            levels=tuple(counts.levels) if counted else None,
            texels_read=counts.texels_read if counted else None,
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
        return self._question.hints(self.stats)

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
        return explanation_of(index, self._inner.explain(index))

    def _summary(self) -> str:
        return f" of {len(self)} instances"
