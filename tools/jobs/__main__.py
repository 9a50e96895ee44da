"""``python -m tools.jobs``."""

from __future__ import annotations

import argparse
import contextlib
import io
import sys

import hizvk
from hizvk.commands import pipes

from . import __doc__ as about
from . import cloud, driving, model
from .table import ROOT

#: The page of each job, in docs/jobs/.
PAGES = {"driving": "driving", "cloud": "points", "model": "models"}


def renewed(page: str, job: str, tables: str) -> str:
    """The page with new tables between the job's comments.

    Raises
    ------
    ValueError
        If the page has no such place.
    """
    begin, end = f"<!-- jobs: {job} -->\n", "<!-- jobs: end -->"
    before, begin, rest = page.partition(begin)
    _, end, after = rest.partition(end)
    if not end:
        raise ValueError(f"expected a place for {job} in the page, got none")
    return f"{before}{begin}\n{tables.strip()}\n\n{end}{after}"


def main() -> None:
    """Prints the tables of the jobs that are named, or of all."""
    parser = argparse.ArgumentParser(prog="python -m tools.jobs", description=about)
    parser.add_argument("jobs", nargs="*", help="driving, cloud, model; none: all")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--write", action="store_true", help="put the tables into docs/jobs/")
    given = parser.parse_args()
    device = hizvk.Device()
    print(f"{device.adapter}\n")
    jobs = {
        "driving": lambda: driving.measure(device, given.rounds, (1_000, 10_000)),
        "cloud": lambda: cloud.measure(device, given.rounds, (100_000, 1_000_000)),
        "model": lambda: model.measure(given.rounds, model.MANY_RAYS),
    }
    for name in given.jobs or jobs:
        print(f"## {name}\n", flush=True)
        with contextlib.redirect_stdout(io.StringIO()) as tables:
            jobs[name]()
        print(tables.getvalue(), flush=True)
        if given.write:
            page = ROOT / "docs" / "jobs" / f"{PAGES[name]}.md"
            text = renewed(page.read_text(encoding="utf-8"), name, tables.getvalue())
            page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(pipes.run(main))
