"""The command line of ``hizvk bench``, and the run over all scenes."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Final

import hizvk

from ..commands import arguments as args
from ..commands import figure
from ..progress import Progress
from ..scenes import embree
from . import catalogue, configurations, frame, whole_way
from .measure import measure
from .report import Report

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence
    from pathlib import Path

    from .._arguments import Size

__all__ = ["Extent", "main", "run"]

PROG: Final = "hizvk bench"
#: Reports of their own: option and module, and what each is about.
REPORTS: Final = {
    "occluders": "what is lost with fewer or simpler occluders",
    "maps": "hierarchical occlusion maps beside the cull",
    "tiling": "coverage bits in BSP order beside depth tiles",
    "shadows": "shadow casters that are needed, and that a cull keeps",
    "texts": "what published tests lose, and their time",
}


@dataclass(frozen=True)
class Extent:
    """How much is measured."""

    instances: dict[str, int]
    """By scene; the castle's number is given."""
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
    keys: Sequence[str] = catalogue.NAMES,
    castle: Path | None = None,
    seed: int = 2010,
    instances: int | None = None,
    views: int | None = None,
    size: Size | None = None,
    repetitions: int | None = None,
    command: str = PROG,
) -> Report:
    """Runs the bench and leaves report.md, report.json and plots of all scenes in `out`.

    Plots need matplotlib and are left out without it.

    Parameters
    ----------
    out : Path
        A folder; made if it is not there.
    extent : "quick", "default" or "full"
        How much is measured, unless the parameters below say otherwise.
    keys : sequence of str
        Of `catalogue.NAMES`.
    castle : Path, optional
        The castle's file.
    seed : int
        Same seed, same scenes.
    instances, views, repetitions : int, optional
        For every scene.
    size : (height, width), optional
        Of the views.
    command : str
        The command that the report names.

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
    found = Report(
        command=command, seed=seed, extent=extent, adapter=device.adapter, missing=_left_out()
    )
    measured = configurations.matrix(extent)
    plots: dict[str, str] = {}
    for key in keys:
        count, stations = instances or chosen.instances.get(key, 1), views or chosen.views[key]
        try:
            bench = catalogue.make(key, count, stations, seed, castle)
        except catalogue.Missing as missing:
            found.missing.append(str(missing))
            continue
        label = f"hizvk bench: {key}, {len(bench.scene):,} instances"
        with Progress(True, label, len(bench.scene.views) + repetitions, after_s=0.0) as steps:
            result = measure(bench, size, measured, repetitions, device, steps.step)
        found.scenes.append(result)
        if figure.can_draw():
            from . import plots as drawing

            plots[key] = f"{key}.png"
            drawing.draw(out / plots[key], result)
    found.seconds = time.perf_counter() - started
    found.write(out, plots)
    return found


def _left_out() -> list[str]:
    """Rows and columns that this installation cannot have."""
    found = []
    if not embree.can_cast():
        found.append(
            f"{embree.missing()}; the truth is that of boxes before the rendered depth, so it says "
            "nothing about the depth image"
        )
    if not figure.can_draw():
        found.append(figure.missing())
    return found


def _parser() -> argparse.ArgumentParser:
    parser = args.parser(
        PROG,
        "Measures speed and error of every configuration on scenes with known truth, beside a "
        "numpy Hi-Z and ray casting (exit code 1 if a configuration with the promise culled what "
        "can be seen).",
        out="out/bench",
        holds="report and plots",
    )
    args.add_several(parser, "--scene", catalogue.NAMES)
    args.add_extent(
        parser, quick="small scenes, few rows", full="all combinations; long", seeded="the scenes"
    )
    frame.add_castle(parser)
    for name, meaning in REPORTS.items():
        parser.add_argument(
            f"--{name}", action="store_true", help=f"instead: {meaning}; --{name} --help tells more"
        )
    parser.add_argument("--views", type=args.count, help="of every scene")
    parser.add_argument(
        "--size", type=args.size, metavar="WIDTHxHEIGHT", help="of the views (default: 640x360)"
    )
    parser.add_argument(
        "--repetitions", type=args.count, help="how often everything is timed (default: 5)"
    )
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; exit code 1: a promise was broken, or it cannot run."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    parser = _parser()
    if "--speed" in arguments:
        parser.error(
            "--speed is no part of the package any more; in a checkout run `make bench-speed` "
            "or `python -m tools.speed`"
        )
    for name in REPORTS:
        if f"--{name}" in arguments:
            rest = [each for each in arguments if each != f"--{name}"]
            code: int = import_module(f".{name}", __package__).main(rest)
            return code
    options = vars(parser.parse_args(arguments))
    out = options["out"]
    of_run = {name: value for name, value in options.items() if name not in REPORTS}
    return frame.execute(PROG, run, of_run, arguments, lambda found: _tell(found, out))


def _tell(found: Report, out: Path) -> None:
    print(f"adapter  {found.adapter}")
    for scene in found.scenes:
        print(
            f"{scene.key}: the Pareto front of {scene.instances:,} instances, {scene.views} views"
        )
        best = (row for row in scene.rows if row.pareto)
        for row in sorted(best, key=lambda row: -row.hidden_kept):
            total = row.total_ms.median if row.total_ms else float("nan")
            print(
                f"  {total:8.2f} ms per view, {row.ns_per_instance or 0.0:6.0f} ns per instance, "
                f"{100.0 * row.hidden_kept:6.2f} % of the hidden kept: {row.label}"
            )
    print("the whole way, from meshes to a mask: ms per view, kept, false culls")
    for scene in found.scenes:
        for key, label, *_, ms, kept, false_culls, _ in whole_way.rows(scene):
            print(f"  {key:9}  {ms:>8}  {kept:>9}  {false_culls:>5}  {label.strip('*')}")
    for each in found.missing:
        print(f"left out {each}")
    for each in found.broken():
        print(f"FAILED   {each}")
    print(f"look at  {out / 'report.md'}  ({found.seconds:.0f} s)")
