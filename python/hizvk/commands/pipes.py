"""Commands whose output goes into a pipe that is closed early, as ``hizvk info | head -1`` does."""

from __future__ import annotations

import os
import select
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["CLOSED", "run"]

#: The exit code for it: that of a program which SIGPIPE ends, as shells report it.
CLOSED = 128 + 13


def run(main: Callable[[], int | None]) -> int:
    """The exit code of `main`; nothing more is printed once nobody reads its output."""
    try:
        try:
            return main() or 0
        finally:  # also where a parser has printed its help and exits
            sys.stdout.flush()
    except BrokenPipeError:
        if not _is_closed():
            raise  # another pipe, such as one to a worker
        return CLOSED


def _is_closed() -> bool:
    """Whether stdout or stderr is a pipe that nobody reads; it leads nowhere afterwards."""
    found = False
    for descriptor in (1, 2) if hasattr(select, "poll") else ():  # Windows has other errors
        poll = select.poll()
        poll.register(descriptor, 0)
        if poll.poll(0):  # an error or a hang-up: nothing else was asked for
            # What is left in the buffer is flushed again at the end of the interpreter.
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, descriptor)
            os.close(nowhere)
            found = True
    return found
