"""Command lines: parsers with the options that all commands have, and the way to an exit code."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from ..errors import HizError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .._arguments import Size

__all__ = ["Outcome", "add_extent", "add_several", "count", "execute", "parser", "size"]


class Outcome(Protocol):
    """What a command found."""

    @property
    def passed(self) -> bool:
        """Whether the exit code is 0."""
        ...

    def as_data(self) -> dict[str, Any]:
        """Plain data for JSON."""
        ...


Found = TypeVar("Found", bound=Outcome)


def parser(prog: str, description: str, *, out: str, holds: str) -> argparse.ArgumentParser:
    """A parser with ``--out`` and ``--json``.

    Parameters
    ----------
    prog, description : str
        As in `argparse.ArgumentParser`.
    out : str
        The folder where the command writes, unless ``--out`` names another one.
    holds : str
        What it writes there, in words.
    """
    made = argparse.ArgumentParser(prog=prog, description=description)
    made.add_argument(
        "--out", type=Path, default=Path(out), help=f"folder for {holds} (default: {out})"
    )
    made.add_argument("--json", action="store_true", help="print the report as one JSON object")
    return made


def add_extent(to: argparse.ArgumentParser, *, quick: str, full: str, seeded: str) -> None:
    """Adds ``--quick``, ``--full`` and ``--seed``; ``extent`` is "default" without the first two.

    Parameters
    ----------
    to : argparse.ArgumentParser
        Gets the options.
    quick, full : str
        What each of them means, in words.
    seeded : str
        What is made from the seed.
    """
    extent = to.add_mutually_exclusive_group()
    for name, meaning in (("quick", quick), ("full", full)):
        extent.add_argument(
            f"--{name}", action="store_const", const=name, dest="extent", help=meaning
        )
    to.set_defaults(extent="default")
    to.add_argument("--seed", type=int, default=2010, help=f"of {seeded} (default: 2010)")


def add_several(to: argparse.ArgumentParser, option: str, names: Sequence[str]) -> None:
    """Adds an option that takes one of `names` and may be given several times."""
    to.add_argument(
        option,
        action="append",
        choices=tuple(names),
        metavar="NAME",
        help=f"{', '.join(names)}; may be given several times (default: all)",
    )


def size(text: str) -> Size:
    """``"960x540"`` as ``(height, width)``, for argparse."""
    width, cross, height = text.partition("x")
    if not (
        cross and width.isdecimal() and height.isdecimal() and int(width) > 0 and int(height) > 0
    ):
        raise argparse.ArgumentTypeError(
            f"expected WIDTHxHEIGHT in pixels, like 960x540, got {text!r}"
        )
    return int(height), int(width)


def count(text: str) -> int:
    """A whole number above 0, for argparse."""
    if not (text.isdecimal() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"expected a number above 0, got {text!r}")
    return int(text)


def execute(
    prog: str,
    run: Callable[[], Found],
    tell: Callable[[Found], None],
    *,
    as_json: bool,
    refusals: tuple[type[Exception], ...] = (),
) -> int:
    """Runs a command, prints what it found, and returns the exit code.

    Parameters
    ----------
    prog : str
        Begins the line that tells an error.
    run : callable
        Does the work.
    tell : callable
        Prints the outcome in words.
    as_json : bool
        Print it as one JSON object instead.
    refusals : tuple of exception types
        Errors that end the command with one line on stderr, beside `HizError` and `OSError`.

    Returns
    -------
    int
        0: passed; 1: not passed, or it could not run.
    """
    told: tuple[type[Exception], ...] = (HizError, OSError, *refusals)
    try:
        found = run()
    except told as error:
        print(f"{prog}: {error}", file=sys.stderr)
        return 1
    if as_json:
        print(json.dumps(found.as_data(), indent=2))
    else:
        tell(found)
    return 0 if found.passed else 1
