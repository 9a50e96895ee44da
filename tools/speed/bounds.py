"""Few and many bounds: Darnell's 900 against 10,000, by the whole call from meshes to a mask."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

import numpy as np

from hizvk.measuring.spread import over_rounds

from .errors import OracleSample
from .figures import WholeCall
from .rounds import in_turns

if TYPE_CHECKING:
    from hizvk._types import Rasteriser
    from hizvk.resources import DepthImage, Instances, Occluders
    from hizvk.scenes.grid import Floats

    from .run import Run
    from .town import Town

__all__ = ["COUNTS", "SIZE", "measure"]

#: His numbers of bounds, and one that is larger.
COUNTS: Final = (900, 10_000, 100_000)
RASTERISERS: Final[tuple[Rasteriser, ...]] = ("device", "host")
#: His image, as (height, width).
SIZE: Final = (256, 512)
#: What 10,000 bounds may cost, over 900.
ABOUT_THE_SAME: Final = 1.5
#: The share of the bounds that is hidden.
HIDDEN: Final = 0.95


def measure(run: Run) -> None:
    """Measures whole calls with each number of bounds and with both rasterisers."""
    run.step("few and many bounds")
    counts = [count for count in COUNTS if count <= max(run.extent.calls, COUNTS[1])]
    calls: dict[str, _Call] = {}
    for count in counts:
        town = run.town(count, HIDDEN)
        occluders = run.device.occluders(town.vertices, town.triangles)
        crowd = run.device.instances(town.boxes)
        for rasteriser in RASTERISERS:
            name = f"{count:,} bounds, {rasteriser}"
            calls[name] = _Call(run, town, occluders, crowd, rasteriser)
    whole = in_turns(calls, run.extent.rounds)
    run.found.timed("few and many bounds", whole)
    for name, call in calls.items():
        depth, pyramid, cull, mask = np.median(call.parts[-run.extent.rounds :], axis=0).tolist()
        error = OracleSample(run, call.town.boxes, call.depth()).judge("bounds", name, call.mask)
        run.found.whole_calls.append(
            WholeCall(
                bounds=len(call.mask),
                rasteriser=call.rasteriser,
                render_ms=depth,
                reduce_ms=pyramid,
                cull_ms=cull,
                read_ms=mask,
                whole_ms=over_rounds(whole[name]),
                kept=error.kept,
            )
        )
    for rasteriser in RASTERISERS:
        few, many = (whole[f"{count:,} bounds, {rasteriser}"] for count in COUNTS[:2])
        run.found.ratio(
            f"bounds.{rasteriser}",
            f"whole call, {rasteriser}'s rasteriser: {COUNTS[1]:,} / {COUNTS[0]:,} bounds",
            many,
            few,
            ABOUT_THE_SAME,
        )


class _Call:
    """A whole call, whose parts are noted."""

    def __init__(
        self, run: Run, town: Town, occluders: Occluders, crowd: Instances, rasteriser: Rasteriser
    ) -> None:
        self.town, self._occluders, self._crowd = town, occluders, crowd
        self._device, self._camera = run.device, town.view.camera(SIZE)
        self.rasteriser: Rasteriser = rasteriser
        #: Milliseconds of depth, pyramid, cull and mask, by round.
        self.parts: list[Floats] = []
        self.mask = np.zeros(0, dtype=bool)

    def depth(self) -> DepthImage:
        """The occluders' depth."""
        return self._device.render_depth(self._occluders, self._camera, rasteriser=self.rasteriser)

    def __call__(self) -> float:
        """Milliseconds from the occluders to the mask on the host."""
        device = self._device
        times: list[float] = []

        def lap() -> None:
            device.wait()
            times.append(time.perf_counter())

        lap()
        depth = self.depth()
        lap()
        pyramid = device.pyramid(depth)
        lap()
        seen = device.cull(self._crowd, self._camera, pyramid, outputs=["mask"])
        lap()
        self.mask = seen.mask
        lap()
        self.parts.append(1e3 * np.diff(times))
        return 1e3 * (times[-1] - times[0])
