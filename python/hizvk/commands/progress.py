"""A progress bar for the terminal."""

from __future__ import annotations

import sys
import time
from typing import TextIO

__all__ = ["Progress"]


class Progress:
    """A bar on a terminal; elsewhere one line at the start.

    Parameters
    ----------
    total : int
        Number of steps.
    label : str
        What is being done.
    stream : file, optional
        None: stderr.
    """

    WIDTH = 30

    def __init__(self, total: int, label: str, stream: TextIO | None = None) -> None:
        self._stream = sys.stderr if stream is None else stream
        self._total = total
        self._done = 0
        self._live = self._stream.isatty()
        self._started = time.monotonic()
        if not self._live:
            print(label, file=self._stream, flush=True)

    def step(self, doing: str) -> None:
        """Counts one step as done; `doing` is the next one."""
        self._done += 1
        self.show(doing)

    def show(self, doing: str) -> None:
        """Draws the bar."""
        if self._live:
            full = self.WIDTH * self._done // self._total
            seconds = time.monotonic() - self._started
            bar = "#" * full + "-" * (self.WIDTH - full)
            self._stream.write(
                f"\r\x1b[K[{bar}] {self._done}/{self._total}  {seconds:3.0f} s  {doing}"
            )
            self._stream.flush()

    def close(self) -> None:
        """Removes the bar."""
        if self._live:
            self._stream.write("\r\x1b[K")
            self._stream.flush()
