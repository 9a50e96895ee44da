"""The command line of ``hizvk demo``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from .. import _core
from ..commands import arguments as args
from .arm import run_arm
from .run import run

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence
    from pathlib import Path

    from .arm import ArmReport
    from .report import Report

__all__ = ["main"]

PROG: Final = "hizvk demo"
DEFAULTS: Final = {"views": 12, "size": (540, 960), "trees": 20_000}
QUICK: Final = {"views": 3, "size": (180, 320), "trees": 3_000}
ARM_DEFAULTS: Final = {"views": 8, "size": (720, 1280)}
ARM_QUICK: Final = {"views": 2, "size": (360, 640)}


def _parser() -> argparse.ArgumentParser:
    parser = args.parser(
        PROG,
        "Culls trees in the mountains of a real elevation model, or the spheres of ARM's scene, "
        "draws the result, and checks that nothing visible was culled (exit code 1 otherwise).",
        out="out",
        holds="pictures and report",
    )
    parser.add_argument(
        "--scene",
        choices=("mountains", "arm"),
        default="mountains",
        help="mountains: trees behind ridges; arm: spheres among prisms, depth of 256x256 pixels "
        "(default: mountains)",
    )
    parser.add_argument(
        "--views",
        type=args.count,
        help=f"stations of the flight (default: {DEFAULTS['views']}), or with arm: directions "
        f"({ARM_DEFAULTS['views']})",
    )
    parser.add_argument(
        "--size",
        type=args.size,
        metavar="WIDTHxHEIGHT",
        help="of the images (default: 960x540, with arm: 1280x720)",
    )
    parser.add_argument(
        "--trees",
        type=args.count,
        help=f"instances of the mountains (default: {DEFAULTS['trees']})",
    )
    parser.add_argument(
        "--quick", action="store_true", help="few trees and views, small images, fewer pictures"
    )
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command; exit code 1: a visible tree was culled, or it cannot run."""
    parser = _parser()
    parsed = parser.parse_args(arguments)
    is_arm = parsed.scene == "arm"
    if is_arm and parsed.trees is not None:
        parser.error("argument --trees: the scene arm has spheres, always 13,824")
    defaults, quick = (ARM_DEFAULTS, ARM_QUICK) if is_arm else (DEFAULTS, QUICK)
    chosen = {**defaults, **(quick if parsed.quick else {})}
    given = {name: getattr(parsed, name) for name in defaults}
    chosen.update({name: value for name, value in given.items() if value is not None})
    if is_arm:
        return args.execute(
            PROG,
            lambda: run_arm(parsed.out, pictures=not parsed.quick, **chosen),  # type: ignore[arg-type]
            lambda found: _tell_arm(found, parsed.out),
            as_json=parsed.json,
            refusals=(ImportError,),
        )
    return args.execute(
        PROG,
        lambda: run(parsed.out, pictures=not parsed.quick, **chosen),  # type: ignore[arg-type]
        lambda found: _tell(found, parsed.out),
        as_json=parsed.json,
        refusals=(ImportError,),
    )


def _tell_arm(found: ArmReport, out: Path) -> None:
    print(*found.lines(), sep="\n")
    print(f"look at  {out / 'arm_00.png'} and {out / 'report.md'}  ({found.seconds:.0f} s)")


def _tell(found: Report, out: Path) -> None:
    tested, kept = found.total("tested"), found.total("kept")
    culled = f"{tested - kept:,} of {tested:,} ({100.0 * (1.0 - kept / tested):.1f} %)"
    times = ", ".join(f"{stage} {took:.2f}" for stage, took in found.median_ms().items())
    share = f"{100.0 * found.false_keep_share:.1f} % of the hidden"
    print(f"adapter  {found.adapter}")
    if _core.__build__ != "release":
        print(
            "build    development: what runs on the host is not optimised; "
            "`make wheel` makes a release build"
        )
    print(f"culled   {culled} in {len(found.views)} views")
    print(f"median   {times} ms per view")
    print(f"hidden   {found.total('false_keeps'):,} kept in vain ({share})")
    print(f"check    {found.verdict()}")
    print(f"look at  {out / 'overview.png'} and {out / 'report.md'}  ({found.seconds:.0f} s)")
