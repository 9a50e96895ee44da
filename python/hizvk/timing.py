"""What the stages of a frame take on the device, beside the clock on the wall."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable
    from types import TracebackType
    from typing import Self

    from ._on_device import Maker

__all__ = ["StageTime", "StageTimes", "sum_of", "table_of"]


@dataclass(frozen=True)
class StageTime:
    """What one stage took."""

    stage: str
    """``"raster"``, ``"resolve"`` (of samples), ``"reduce"``, ``"cull groups"``,
    ``"cull members"``, ``"cull"`` (without groups), ``"list"``, ``"join"`` (of views), ``"among"``,
    ``"update"`` or ``"refine"``.

    The host's rasteriser has no stage, nor has a reduction that copies the levels which it made:
    their time is the host's own."""
    passes: int
    """How many passes it had."""
    gpu_ms: float | None
    """Milliseconds on the device, all passes together; None where the device has no timestamps that
    can be trusted."""


def table_of(raw: Iterable[tuple[str, int, float | None]]) -> tuple[StageTime, ...]:
    """The stages as the compiled module gives them."""
    return tuple(StageTime(*stage) for stage in raw)


def sum_of(stages: Iterable[StageTime]) -> float | None:
    """The milliseconds of all stages; None if there are none, or if one of them is None."""
    times = [stage.gpu_ms for stage in stages]
    known = [one for one in times if one is not None]
    return sum(known) if times and len(known) == len(times) else None


class StageTimes:
    """What the stages took that ran in a ``with`` block of `Device.timed`."""

    def __init__(self, device: Maker) -> None:
        self._device = device
        self._stages: tuple[StageTime, ...] = ()
        self._wall_ms = 0.0

    def __enter__(self) -> Self:
        """Begins; what was submitted before is waited for."""
        self._device._engine.start_timing()
        self._device.wait()
        self._begun = time.perf_counter()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Waits for the device, and reads the times."""
        raw = self._device._engine.stop_timing()
        self._wall_ms = 1e3 * (time.perf_counter() - self._begun)
        self._stages = table_of(raw)

    @property
    def stages(self) -> tuple[StageTime, ...]:
        """The stages in the order in which they began; empty before the end of the block."""
        return self._stages

    @property
    def gpu_ms(self) -> float | None:
        """Milliseconds of all stages; None without trustworthy timestamps, and without stages."""
        return sum_of(self._stages)

    @property
    def wall_ms(self) -> float:
        """Milliseconds on the wall from the begin of the block until the device was done."""
        return self._wall_ms

    def __str__(self) -> str:
        """A table: a stage a line, then what the clock on the wall says."""

        def told(ms: float | None) -> str:
            return "   no clock" if ms is None else f"{ms:8.3f} ms"

        lines = [f"{one.stage:14}{one.passes:4} x {told(one.gpu_ms)}" for one in self._stages]
        lines.append(f"{'all on device':21}{told(self.gpu_ms)}")
        lines.append(f"{'on the wall':21}{told(self._wall_ms)}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"<StageTimes: {len(self._stages)} stages>"
