"""``hizvk bench``: speed beside error, for every configuration, on scenes with known truth."""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import hizvk

from .. import terminal
from . import configurations, report, scenes
from .measure import measure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._arguments import Size

__all__ = ["Extent", "main", "run"]


@dataclass(frozen=True)
class Extent:
    """How much is measured."""

    instances: dict[str, int]
    """By scene; the castle has what it has."""
    views: dict[str, int]
    size: Size
    repetitions: int


EXTENTS: Final = {
    "quick": Extent(
        {"mountains": 2_000, "city": 2_000, "city-far": 2_000, "room": 500},
        {"mountains": 3, "city": 3, "city-far": 2, "room": 3, "castle": 4},
        (180, 320),
        3,
    ),
    "default": Extent(
        {"mountains": 20_000, "city": 20_000, "city-far": 20_000, "room": 2_000},
        {"mountains": 12, "city": 16, "city-far": 6, "room": 12, "castle": 20},
        (360, 640),
        5,
    ),
    "full": Extent(
        {"mountains": 100_000, "city": 100_000, "city-far": 100_000, "room": 5_000},
        {"mountains": 24, "city": 32, "city-far": 16, "room": 24, "castle": 40},
        (720, 1280),
        9,
    ),
}


def run(
    out: Path,
    *,
    extent: str = "default",
    keys: Sequence[str] = scenes.NAMES,
    castle: Path | None = None,
    seed: int = 2010,
    instances: int | None = None,
    views: int | None = None,
    size: Size | None = None,
    repetitions: int | None = None,
    command: str = "hizvk bench",
) -> report.Report:
    """Runs the bench and leaves report.md, report.json and, with matplotlib, a plot of each scene in `out`.

    Parameters
    ----------
    out : Path
        A folder; made if it is not there.
    extent : "quick", "default" or "full"
        How much, where the parameters below do not say it.
    keys : sequence of str
        Of `scenes.NAMES`.
    castle : Path, optional
        The castle's file.
    seed : int
        Same seed, same scenes.
    instances, views, repetitions : int, optional
        For every scene.
    size : (height, width), optional
        Of the views.
    command : str
        What the report says that prints it.

    Raises
    ------
    hizvk.HizError
        What the device refuses.
    """
    started = time.perf_counter()
    out.mkdir(parents=True, exist_ok=True)
    chosen = EXTENTS[extent]
    size, repetitions = size or chosen.size, repetitions or chosen.repetitions
    device = hizvk.Device()
    found = report.Report(
        command=command, seed=seed, extent=extent, adapter=device.adapter, missing=_left_out()
    )
    measured = configurations.matrix(extent)
    plots: dict[str, str] = {}
    for key in keys:
        try:
            bench = scenes.make(
                key,
                instances or chosen.instances.get(key, 1),
                views or chosen.views[key],
                seed,
                castle,
            )
        except scenes.Missing as missing:
            found.missing.append(str(missing))
            continue
        steps = terminal.Progress(
            len(bench.scene.views) + repetitions,
            f"hizvk bench: {key}, {len(bench.scene):,} instances",
        )
        try:
            result = measure(bench, size, measured, repetitions, device, steps.step)
        finally:
            steps.close()
        found.scenes.append(result)
        if importlib.util.find_spec("matplotlib"):
            from . import plots as drawing

            plots[key] = f"{key}.png"
            drawing.draw(out / plots[key], result)
    found.seconds = time.perf_counter() - started
    report.write(found, out, plots)
    return found


def _left_out() -> list[str]:
    """Rows and columns that this installation cannot have."""
    found = []
    if not importlib.util.find_spec("embreex"):
        found.append(
            "ray casting (embreex is not installed: pip install embreex); the truth is that of boxes before the "
            "rendered depth, so it says nothing about the depth image"
        )
    if not importlib.util.find_spec("matplotlib"):
        found.append("plots (matplotlib is not installed: pip install matplotlib)")
    return found


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="hizvk bench",
        description="Measures speed and error of every configuration on scenes with known truth, beside a numpy Hi-Z "
        "and ray casting (exit code 1 if a configuration with the promise culled what can be seen).",
    )
    # Told here, taken by `main`.
    parser.add_argument(
        "--speed",
        action="store_true",
        help="measure times against yardsticks instead: see --speed --help",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("out/bench"),
        help="folder for report and plots (out/bench)",
    )
    parser.add_argument(
        "--scene", action="append", choices=scenes.NAMES, metavar="NAME",
        help=f"{', '.join(scenes.NAMES)}; may come several times (all)",
    )  # fmt: skip
    extent = parser.add_mutually_exclusive_group()
    extent.add_argument(
        "--quick", action="store_const", const="quick", dest="extent", help="small scenes, few rows"
    )
    extent.add_argument(
        "--full", action="store_const", const="full", dest="extent", help="all combinations; long"
    )
    parser.add_argument(
        "--castle",
        type=Path,
        metavar="PATH",
        help=f"castle.npz (or the variable {scenes.VARIABLE})",
    )
    parser.add_argument("--seed", type=int, default=2010, help="of the scenes (2010)")
    parser.add_argument("--instances", type=terminal.count, help="in every scene but the castle")
    parser.add_argument("--views", type=terminal.count, help="of every scene")
    parser.add_argument(
        "--size", type=terminal.size, metavar="WIDTHxHEIGHT", help="of the views (640x360)"
    )
    parser.add_argument(
        "--repetitions", type=terminal.count, help="how often everything is timed (5)"
    )
    parser.add_argument("--json", action="store_true", help="print the report as one JSON object")
    parser.set_defaults(extent="default")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command and returns its exit code: 0 good, 1 a promise was broken or it cannot run."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if "--speed" in arguments:
        from . import speed

        return speed.main([argument for argument in arguments if argument != "--speed"])
    parsed = _parser().parse_args(arguments)
    try:
        found = run(
            parsed.out, extent=parsed.extent, keys=parsed.scene or scenes.NAMES, castle=parsed.castle, seed=parsed.seed,
            instances=parsed.instances, views=parsed.views, size=parsed.size, repetitions=parsed.repetitions,
            command=" ".join(["hizvk bench", *arguments]),
        )  # fmt: skip
    except (hizvk.HizError, OSError) as error:
        print(f"hizvk bench: {error}", file=sys.stderr)
        return 1
    if parsed.json:
        print(json.dumps(found.as_data(), indent=2))
    else:
        _tell(found, parsed.out)
    return 0 if found.passed else 1


def _tell(found: report.Report, out: Path) -> None:
    print(f"adapter  {found.adapter}")
    for scene in found.scenes:
        print(
            f"{scene.key}: the Pareto front of {scene.instances:,} instances, {scene.views} views"
        )
        for row in sorted(
            (row for row in scene.rows if row.pareto), key=lambda row: -row.hidden_kept
        ):
            total = row.total_ms.median if row.total_ms else float("nan")
            print(
                f"  {total:8.2f} ms a view, {row.ns_per_instance or 0.0:6.0f} ns an instance, "
                f"{100.0 * row.hidden_kept:6.2f} % of the hidden kept: {row.label}"
            )
    for each in found.missing:
        print(f"left out {each}")
    for each in found.broken():
        print(f"FAILED   {each}")
    print(f"look at  {out / 'report.md'}  ({found.seconds:.0f} s)")
