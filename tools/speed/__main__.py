"""``python -m tools.speed``."""

import sys

from hizvk.commands import pipes

from .command import main

if __name__ == "__main__":
    sys.exit(pipes.run(main))
