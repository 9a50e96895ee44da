"""``python -m tools.jobs``."""

from __future__ import annotations

import argparse

import hizvk

from . import __doc__ as about
from . import cloud, driving, model


def main() -> None:
    """Prints the tables of the jobs that are named, or of all."""
    parser = argparse.ArgumentParser(prog="python -m tools.jobs", description=about)
    parser.add_argument("jobs", nargs="*", help="driving, cloud, model; none: all")
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    device = hizvk.Device()
    print(f"{device.adapter}\n")
    jobs = {
        "driving": lambda: driving.measure(device, given.rounds, (1_000, 10_000)),
        "cloud": lambda: cloud.measure(device, given.rounds, (100_000, 1_000_000)),
        "model": lambda: model.measure(given.rounds, 20_000),
    }
    for name in given.jobs or jobs:
        print(f"## {name}\n")
        jobs[name]()


if __name__ == "__main__":
    main()
