"""The jobs of docs/jobs/: their data, their pages, and their figures."""

from __future__ import annotations

import ast
import contextlib
import importlib.util
import io
import json
import re
from pathlib import Path
from typing import Any

import pytest

import hizvk

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


LESSON = ROOT / "examples" / "lesson.ipynb"


def cells(kind: str) -> list[str]:
    """The text of each cell of the lesson of one kind."""
    notebook = json.loads(LESSON.read_text(encoding="utf-8"))
    assert notebook["nbformat"] == 4
    return ["".join(each["source"]) for each in notebook["cells"] if each["cell_type"] == kind]


def run_as_a_notebook(sources: list[str]) -> tuple[str, list[object]]:
    """What cells print, and the values that they end with, as a notebook shows both."""
    names: dict[str, Any] = {"__name__": "__main__"}
    shown = []
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        for number, source in enumerate(sources):
            body = ast.parse(source).body
            last = body.pop() if isinstance(body[-1], ast.Expr) else None
            exec(compile(ast.Module(body, []), f"cell {number}", "exec"), names)
            if isinstance(last, ast.Expr):
                value = eval(compile(ast.Expression(last.value), f"cell {number}", "eval"), names)
                if value is not None:
                    shown.append(value)
    return printed.getvalue(), shown


def test_the_lesson_has_no_outputs() -> None:
    """They would be those of another version."""
    for each in json.loads(LESSON.read_text(encoding="utf-8"))["cells"]:
        assert not each.get("outputs")
        assert each.get("execution_count") is None
    assert max(len(line) for text in cells("markdown") for line in text.splitlines()) <= 100


def test_the_lesson_runs() -> None:
    """Its pyramid is the device's, its own cull has false culls, and that of hizvk has none."""
    printed, shown = run_as_a_notebook(cells("code"))
    wrong = {
        name.strip(): int(count)
        for name, count in re.findall(r"^([a-z ]+): .* (\d+) wrongly culled", printed, re.MULTILINE)
    }
    assert set(wrong) == {"by hand", "hizvk", "with means"}
    assert wrong["hizvk"] == 0
    assert 0 < wrong["by hand"] < wrong["with means"]
    assert [type(value) for value in shown] == [hizvk.Pyramid]


@pytest.mark.slow
def test_the_lesson_runs_in_jupyter() -> None:
    """As a reader runs it; `pip install nbclient ipykernel` brings what it needs."""
    pytest.importorskip("ipykernel", reason="pip install nbclient ipykernel")
    nbclient = pytest.importorskip("nbclient", reason="pip install nbclient ipykernel")
    nbformat = importlib.import_module("nbformat")
    notebook = nbformat.read(LESSON, as_version=4)
    nbformat.validate(notebook)
    nbclient.NotebookClient(notebook, timeout=300).execute()
    assert "0 wrongly culled" in json.dumps(notebook)
