"""Figures of matplotlib in one style. Needs matplotlib (the extra ``viz``)."""

from __future__ import annotations

import importlib.util
from typing import TYPE_CHECKING, Any

from ..extras import install_line

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["can_draw", "missing", "save", "sheet"]


def missing() -> str:
    """What a report names as left out without matplotlib, and how to get it."""
    return f"plots (matplotlib is not installed: {install_line('viz')})"


def can_draw() -> bool:
    """Whether matplotlib is installed."""
    return importlib.util.find_spec("matplotlib") is not None


def sheet(width: float, height: float, *, dpi: int = 100) -> Any:
    """An empty figure; `width` and `height` are in inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    made = Figure(figsize=(width, height), dpi=dpi, layout="constrained")
    FigureCanvasAgg(made)  # it can say where its texts lie
    return made


def save(figure: Any, title: str, path: Path) -> None:
    """Sets the title and writes a PNG."""
    figure.suptitle(title, fontsize=11)
    figure.savefig(path)
