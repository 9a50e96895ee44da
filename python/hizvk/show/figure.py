"""Figures of matplotlib (the extra ``viz``) that a notebook shows as they are returned."""

from __future__ import annotations

import io
from typing import Any

from ..commands.figure import can_draw, sheet
from ..extras import install_line

__all__ = ["figure"]


def figure(width: float, height: float) -> Any:
    """An empty figure that knows how to show itself; `width` and `height` are in inches.

    It belongs to no window: ``figure.savefig(path)`` writes it.

    Raises
    ------
    ImportError
        If matplotlib is not installed; the text has the line that installs it.
    """
    if not can_draw():
        raise ImportError(
            f"a figure needs matplotlib, which is not installed: {install_line('viz')}",
            name="matplotlib",
        )
    made = sheet(width, height)
    # IPython shows what has this method, also before pyplot has told it about figures.
    made._repr_png_ = lambda: _file(made)
    return made


def _file(made: Any) -> bytes:
    buffer = io.BytesIO()
    made.savefig(buffer, format="png")
    return buffer.getvalue()
