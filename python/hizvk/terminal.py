"""What the commands share on a terminal: a progress bar, and arguments of the command line."""

from __future__ import annotations

import argparse
import sys
import time
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from ._arguments import Size

__all__ = ["Progress", "count", "size"]


class Progress:
    """A bar on a terminal; elsewhere one line when it begins.

    Parameters
    ----------
    total : int
        Steps.
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
        """One more step is done; `doing` is the next."""
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
