"""``hizvk bench --speed``: every target's figure as a ratio within one run."""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Final

import hizvk

from ... import _core, terminal
from . import calls, culling, first_call, memory, reduction, report, scale, transfers
from .figures import Found
from .run import EXTENTS, Run

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["PARTS", "main", "run"]

#: By name, in the order in which they are measured: fresh processes first, before this one has filled the memory.
PARTS: Final[dict[str, Callable[[Run], None]]] = {
    "first-call": first_call.measure,
    "memory": memory.measure,
    "reduction": reduction.measure,
    "cull": culling.measure,
    "calls": calls.measure,
    "transfers": transfers.measure,
    "scale": scale.measure,
}


def run(
    out: Path,
    *,
    extent: str = "default",
    parts: Sequence[str] = tuple(PARTS),
    seed: int = 2010,
    command: str = "hizvk bench --speed",
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
        What the report says that prints it.

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
        "Intel's culler, which some targets are ratios to, is no part of this run: see ns an instance"
    )
    shown = terminal.Progress(len(parts), f"hizvk bench --speed, {extent}")
    measured = Run(device, EXTENTS[extent], seed, found, shown.show)
    try:
        for part in parts:
            found.load += _load()
            PARTS[part](measured)
            shown.step(part)
    finally:
        shown.close()
    plot = None
    if importlib.util.find_spec("matplotlib") is None:
        found.notes.append(
            "plots were left out: matplotlib is not installed (pip install matplotlib)"
        )
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
    """The system's load of the last minute; nothing where it has none."""
    try:
        return [os.getloadavg()[0]]
    except OSError:
        return []


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="hizvk bench --speed",
        description="Measures how fast reduction, cull and calls are, as ratios to yardsticks of the same run, beside "
        "their targets and the error that they were bought at (exit code 1 if a cull with the promise hid what can be "
        "seen; a missed target is told, no more).",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out/speed"), help="folder for report and plot (out/speed)"
    )
    parser.add_argument(
        "--part", action="append", choices=tuple(PARTS), metavar="NAME",
        help=f"{', '.join(PARTS)}; may come several times (all)",
    )  # fmt: skip
    extent = parser.add_mutually_exclusive_group()
    extent.add_argument(
        "--quick",
        action="store_const",
        const="quick",
        dest="extent",
        help="few rounds, small sizes",
    )
    extent.add_argument(
        "--full",
        action="store_const",
        const="full",
        dest="extent",
        help="up to 50 million instances and 8192x8192 pixels",
    )
    parser.add_argument("--seed", type=int, default=2010, help="of the town (2010)")
    parser.add_argument("--json", action="store_true", help="print the report as one JSON object")
    parser.set_defaults(extent="default")
    return parser


def main(arguments: Sequence[str]) -> int:
    """Runs the command, whose ``--speed`` was taken off, and returns its exit code.

    0: good; 1: a promise was broken, or it cannot run.
    """
    parsed = _parser().parse_args(arguments)
    try:
        found = run(
            parsed.out, extent=parsed.extent, parts=parsed.part or tuple(PARTS), seed=parsed.seed,
            command=" ".join(["hizvk bench --speed", *arguments]),
        )  # fmt: skip
    except (hizvk.HizError, OSError, subprocess.CalledProcessError) as error:
        print(f"hizvk bench --speed: {error}", file=sys.stderr)
        return 1
    if parsed.json:
        print(json.dumps(report.as_data(found), indent=2))
    else:
        _tell(found, parsed.out)
    return 0 if found.passed else 1


def _tell(found: Found, out: Path) -> None:
    print(f"adapter  {found.adapter}")
    rows = report.targets(found)
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(4)]
    for label, measured, spread, target, verdict in rows:
        print(
            f"  {label:{widths[0]}}  {measured:>{widths[1]}}  {spread:>{widths[2]}}  {target:>{widths[3]}}  {verdict}"
        )
    met, of = report.judged(found)
    print(f"{met} of {of} targets met")
    for each in found.notes:
        print(f"note     {each}")
    for each in found.broken():
        print(f"FAILED   {each}")
    print(f"look at  {out / 'report.md'}  ({found.seconds:.0f} s)")
