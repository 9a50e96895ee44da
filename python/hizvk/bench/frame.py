"""What the reports of ``hizvk bench`` share: the run that they tell of, and the frame of a command.

A report adds what it finds to `Run`, and measures one scene in a function of its own.
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from ..commands import arguments as args
from ..commands import report
from ..progress import Progress
from . import catalogue

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Sequence

    from ..adapter import Adapter
    from ..commands.page import Page

__all__ = ["Run", "add_castle", "execute", "parser", "print_page"]


@dataclass
class Run:
    """What every report says of its run; each has a subclass with what it found."""

    command: str
    """Prints the report again."""
    seed: int
    adapter: Adapter
    missing: list[str] = field(default_factory=list)
    """Scenes and columns that were left out, and why."""
    seconds: float = 0.0
    """All scenes together."""

    def as_data(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {**asdict(self), "versions": report.versions()}

    def opening(self, *more: str) -> list[str]:
        """The items that a page begins with; `more` stand before what was left out."""
        return [
            f"Command: `{self.command}` ({self.seconds:.0f} s; seed {self.seed})",
            report.adapter_words(self.adapter),
            report.version_words(),
            *more,
            *(f"Left out: {each}" for each in self.missing),
        ]

    def over(
        self,
        out: Path,
        keys: Sequence[str],
        measure: Callable[[str, Progress], None],
        *,
        prog: str,
        steps: int | None = None,
    ) -> None:
        """Makes the folder `out`, measures scene by scene, and adds up the seconds.

        Parameters
        ----------
        out : Path
            A folder; made if it is not there.
        keys : sequence of str
            The scenes.
        measure : callable
            Measures the scene of a key; a `catalogue.Missing` that it raises goes to `missing`.
        prog : str
            The command, for the line that shows the progress.
        steps : int, optional
            How often `measure` steps the progress, in all.
            None: it does not, and a scene is a step.
        """
        started = time.perf_counter()
        out.mkdir(parents=True, exist_ok=True)
        label, total = f"{prog}: {', '.join(keys)}", len(keys) if steps is None else steps
        with Progress(True, label, total, after_s=0.0) as shown:
            for key in keys:
                try:
                    measure(key, shown)
                except catalogue.Missing as missing:
                    self.missing.append(str(missing))
                if steps is None:
                    shown.step(key)
        self.seconds += time.perf_counter() - started


class _Paged(args.Outcome, Protocol):
    """An outcome that is told by a page."""

    def page(self) -> Page:
        """The page."""
        ...


_Found = TypeVar("_Found", bound=args.Outcome)


def parser(
    prog: str, description: str, *, out: str, holds: str, names: Sequence[str], seed: int
) -> argparse.ArgumentParser:
    """A parser with the options of every report: of `args.parser`, scenes, seed and views.

    Parameters
    ----------
    prog, description, out, holds : str
        As in `args.parser`.
    names : sequence of str
        The scenes that may be chosen.
    seed : int
        The default.
    """
    made = args.parser(prog, description, out=out, holds=holds)
    args.add_several(made, "--scene", names)
    made.add_argument("--seed", type=int, default=seed, help=f"of the scenes (default: {seed})")
    made.add_argument("--views", type=args.count, help="of every scene")
    return made


def add_castle(to: argparse.ArgumentParser) -> None:
    """Adds ``--castle`` and ``--instances``; the castle's number of instances is given."""
    to.add_argument(
        "--castle",
        type=Path,
        metavar="PATH",
        help=f"castle.npz (or the variable {catalogue.VARIABLE})",
    )
    to.add_argument("--instances", type=args.count, help="in every scene but the castle")


def execute(
    prog: str,
    run: Callable[..., _Found],
    options: dict[str, Any],
    arguments: Sequence[str],
    tell: Callable[[_Found], None],
) -> int:
    """Runs a report's command and returns the exit code, as `args.execute` does.

    Parameters
    ----------
    prog : str
        The command.
    run : callable
        Measures; its parameters are named like the options, but ``keys`` has the chosen scenes.
        Its ``command`` is the line that was typed.
    options : dict of str to object
        What a `parser` has made of the arguments.
    arguments : sequence of str
        What was typed behind `prog`.
    tell : callable
        Prints what was found, such as `print_page`.
    """
    given = {name: value for name, value in options.items() if name not in ("json", "scene")}
    given["command"] = " ".join([prog, *arguments])
    if options["scene"]:
        given["keys"] = options["scene"]
    return args.execute(prog, lambda: run(**given), tell, as_json=options["json"])


def print_page(found: _Paged) -> None:
    """Prints the whole report."""
    print(found.page())
