"""How fast it is, as ratios to yardsticks of the same run: the command ``hizvk bench --speed``.

===============  ===================================================================================
`town`           the synthetic scene: how much of its crowd is hidden is a parameter
`rounds`         all ways in turns, medians and quartiles
`figures`        the targets, and what was measured beside them
`run`            what the parts below share
`reduction`      the depth pyramid against a memcpy and one dispatch a level
`culling`        certified, uncertified and grouped culls; what each output costs
`errors`         what they keep, against the float64 oracle
`calls`          what Python adds; small calls; numpy and Embree
`transfers`      uploads, updates, and when a re-sort pays
`memory`         bytes on the device, and the peak on the host
`first_call`     a fresh process, with the driver's shader cache cold and warm
`scale`          time, memory and texels against the numbers of instances and pixels
`report`         report.json (its schema stands there), report.md; `plots` draws the scale
===============  ===================================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["main"]


def main(arguments: Sequence[str]) -> int:
    """Runs ``hizvk bench --speed`` with what else stands on its command line and returns its exit code."""
    from .command import main as run

    return run(arguments)
