"""The command line: ``python -m tools.hierarchy compare | pictures``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from hizvk.commands import pipes

from .compare import print_tables
from .pictures import draw
from .scenes import SCENES


def main() -> int:
    """Runs one command."""
    parser = argparse.ArgumentParser(prog="python -m tools.hierarchy")
    commands = parser.add_subparsers(dest="command", required=True)
    compare = commands.add_parser("compare", help="the tables of docs/methods.md")
    compare.add_argument("--scenes", nargs="+", choices=list(SCENES), default=list(SCENES))
    compare.add_argument("--millions", nargs="+", type=float, default=[0.3, 1.0, 3.0])
    compare.add_argument("--size", nargs=2, type=int, default=[360, 640], metavar=("H", "W"))
    compare.add_argument("--views", type=int, default=6)
    compare.add_argument("--rounds", type=int, default=9)
    compare.add_argument("--threshold", type=int, default=4)
    pictures = commands.add_parser("pictures", help="the text's figures as PNG files")
    pictures.add_argument("folder", type=Path)
    pictures.add_argument("--scene", choices=list(SCENES), default="building")
    pictures.add_argument("--millions", type=float, default=1.0)
    arguments = parser.parse_args()
    if arguments.command == "compare":
        return print_tables(
            arguments.scenes,
            arguments.millions,
            size=tuple(arguments.size),
            views=arguments.views,
            rounds=arguments.rounds,
            threshold=arguments.threshold,
        )
    made = SCENES[arguments.scene](round(arguments.millions * 1e6), 6)
    for path in draw(made, arguments.folder):
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(pipes.run(main))
