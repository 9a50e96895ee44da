"""Reports: report.md to read, report.json for machines, and what both say about the machine."""

from __future__ import annotations

import importlib.metadata
import json
import platform
from typing import TYPE_CHECKING, Any

import numpy as np

from .._core import __version__

if TYPE_CHECKING:
    from pathlib import Path

    from ..adapter import Adapter
    from .page import Page

__all__ = ["adapter_words", "version_words", "versions", "write"]


def versions() -> dict[str, str | None]:
    """Versions of everything that takes part in the numbers; `embreex` is None if not installed."""
    try:
        embreex: str | None = importlib.metadata.version("embreex")
    except importlib.metadata.PackageNotFoundError:
        embreex = None
    return {
        "hizvk": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "embreex": embreex,
        "platform": f"{platform.system()} {platform.machine()}",
    }


def version_words() -> str:
    """The versions in one line."""
    known = versions()
    embreex = known["embreex"] or "not installed"
    return (
        f"hizvk {known['hizvk']}, Python {known['python']}, NumPy {known['numpy']}, "
        f"embreex {embreex}; {known['platform']}"
    )


def adapter_words(adapter: Adapter) -> str:
    """The adapter and its driver in one line."""
    return (
        f"Adapter: {adapter.name} ({adapter.device_type}); "
        f"driver: {adapter.driver} {adapter.driver_info}"
    )


def write(folder: Path, data: dict[str, Any], page: Page) -> None:
    """Writes report.json and report.md into `folder`."""
    (folder / "report.json").write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
    (folder / "report.md").write_text(str(page), encoding="utf-8")
