"""The command line of ``python -m tools.speed``, and the run over all parts."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Final

import hizvk
from hizvk import _core
from hizvk.commands import arguments as args
from hizvk.commands import figure
from hizvk.progress import Progress

from . import (
    arrays,
    bounds,
    calls,
    counts,
    culling,
    depth_in,
    emit,
    first_call,
    memory,
    mips,
    occluders,
    points,
    readback,
    reduction,
    report,
    scale,
    temporal,
    tiers,
    transfers,
    views,
)
from .figures import Found
from .run import WORKLOADS, Run

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Sequence
    from pathlib import Path

__all__ = ["PARTS", "main", "run"]

PROG: Final = "python -m tools.speed"
#: The parts by name, in the order in which they are measured.
#: Fresh processes come first, before this one has filled the memory.
PARTS: Final[dict[str, Callable[[Run], None]]] = {
    "first-call": first_call.measure,
    "memory": memory.measure,
    "reduction": reduction.measure,
    "depth-in": depth_in.measure,
    "mips": mips.measure,
    "cull": culling.measure,
    "tiers": tiers.measure,
    "emit": emit.measure,
    "calls": calls.measure,
    "temporal": temporal.measure,
    "readback": readback.measure,
    "views": views.measure,
    "points": points.measure,
    "counts": counts.measure,
    "occluders": occluders.measure,
    "bounds": bounds.measure,
    "transfers": transfers.measure,
    "arrays": arrays.measure,
    "scale": scale.measure,
}


def run(
    out: Path,
    *,
    extent: str = "default",
    parts: Sequence[str] = tuple(PARTS),
    seed: int = 2010,
    command: str = PROG,
) -> Found:
    """Measures, and leaves report.md, report.json and, with matplotlib, scale.png in `out`.

    Parameters
    ----------
    out : Path
        A folder; made if it is not there.
    extent : "quick", "default" or "full"
        How much.
    parts : sequence of str
        Of `PARTS`.
    seed : int
        Same seed, same town.
    command : str
        The command that the report names.

    Raises
    ------
    hizvk.HizError
        What the device refuses.
    """
    started = time.perf_counter()
    out.mkdir(parents=True, exist_ok=True)
    device = hizvk.Device()
    found = Found(
        command, seed, extent, device.adapter, build=_core.Yardstick.profile(), cores=_cores()
    )
    found.notes.append(
        "Intel's culler, which some targets are ratios to, is no part of this run: "
        "see the nanoseconds per instance"
    )
    with Progress(True, f"{PROG}, {extent}", len(parts), after_s=0.0) as shown:
        measured = Run(device, WORKLOADS[extent], seed, found, shown.show)
        for part in parts:
            found.load += _load()
            PARTS[part](measured)
            shown.step(part)
    plot = None
    if not figure.can_draw():
        found.notes.append(f"left out: {figure.missing()}")
    elif found.instance_counts and found.image_sizes:
        from . import plots

        plot = "scale.png"
        plots.draw(out / plot, found)
    found.load += _load()
    found.seconds = time.perf_counter() - started
    report.write(found, out, plot)
    return found


def _cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _load() -> list[float]:
    """The system's load average of the last minute; nothing where the system has none."""
    try:
        return [os.getloadavg()[0]]
    except (AttributeError, OSError):  # Windows has no such function
        return []


def _parser() -> argparse.ArgumentParser:
    parser = args.parser(
        PROG,
        "Measures how fast reduction, cull and calls are, as ratios to yardsticks of the same run, "
        "beside their targets and the error that they were bought at (exit code 1 if a cull with "
        "the promise hid what can be seen; a missed target does not fail).",
        out="out/speed",
        holds="report and plot",
    )
    args.add_several(parser, "--part", tuple(PARTS))
    args.add_extent(
        parser,
        quick="few rounds, small sizes",
        full="up to 50 million instances and 8192x8192 pixels",
        seeded="the town",
    )
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; exit code 1: a promise was broken, or it cannot run."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    parsed = _parser().parse_args(arguments)
    return args.execute(
        PROG,
        lambda: run(
            parsed.out,
            extent=parsed.extent,
            parts=parsed.part or tuple(PARTS),
            seed=parsed.seed,
            command=" ".join([PROG, *arguments]),
        ),
        lambda found: _tell(found, parsed.out),
        as_json=parsed.json,
        refusals=(subprocess.CalledProcessError,),
    )


def _tell(found: Found, out: Path) -> None:
    print(f"adapter  {found.adapter}")
    rows = report.targets(found)
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(4)]
    for label, measured, spread, target, verdict in rows:
        print(
            f"  {label:{widths[0]}}  {measured:>{widths[1]}}  {spread:>{widths[2]}}  "
            f"{target:>{widths[3]}}  {verdict}"
        )
    met, of = report.judged(found)
    print(f"{met} of {of} targets met")
    for each in found.notes:
        print(f"note     {each}")
    for each in found.broken():
        print(f"FAILED   {each}")
    print(f"look at  {out / 'report.md'}  ({found.seconds:.0f} s)")
