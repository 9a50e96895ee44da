"""The jobs of docs/jobs/: their data, their pages, and their figures."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT / "examples" / "data"


def load(path: Path) -> Any:
    """A module of a folder that is no package."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_data_are_what_their_script_makes() -> None:
    """If this is red, run scripts/example_data.py."""
    made = load(ROOT / "scripts" / "example_data.py").files()
    assert {path.name: path.read_text(encoding="utf-8") for path in DATA.iterdir()} == made
