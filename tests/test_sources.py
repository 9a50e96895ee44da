"""docs/sources.md has every row of the texts, and each row's commands can run.

`make test` checks that what a command names is there; `make soak` runs them all.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import hizvk
from sources import PAGE, ROOT, rows, wrong

#: How many rows each text has.
COUNTS = {"R": 16, "A": 10, "D": 7, "T": 7, "M": 15, "B": 13}
WANTED = [f"{letter}{k}" for letter, count in COUNTS.items() for k in range(1, count + 1)]
#: Rows that nothing delivers yet.
OPEN: set[str] = set()
#: Superseded ways: the words that name each, and those that name what replaces it.
SUPERSEDED = {
    "Geometry shader and transform feedback": "compute pass",
    "Chains for even and odd sizes": "one reduction",
    "Results drawn as pixels": "storage buffers",
    "reprojected": "two passes",
    "Conditional rendering": "indirect draws",
    "Averaged mip maps": "farthest depth",
    "Tessellation": "LODs",
    "BSP tree": "meshlets",
    "occlusion queries": "culling pass",
}
TEXT = PAGE.read_text(encoding="utf-8")
ROWS = {row.name: row for row in rows(TEXT)}
COMMANDS = sorted({command for row in ROWS.values() for command in row.commands})
#: Commands that build for release, open many windows or take longer than this need room.
LIMIT_S = 3600


def test_every_row_is_there_once_and_in_order() -> None:
    assert [row.name for row in rows(TEXT)] == WANTED


@pytest.mark.parametrize("name", WANTED)
def test_a_row_says_what_delivers_it_and_what_shows_it(name: str) -> None:
    row = ROWS[name]
    assert row.is_open == (name in OPEN)
    if not row.is_open:
        assert re.search(r"^Delivered ", row.text, re.MULTILINE)
        assert row.commands
    # What the text asks stands before it.
    assert len(row.text.split("\n\n")[1].split()) >= 5


@pytest.mark.parametrize("command", COMMANDS)
def test_what_a_command_names_is_there(command: str) -> None:
    assert wrong(command) is None


@pytest.mark.parametrize(
    ("command", "why"),
    [
        ("cargo test --workspace --test no_such", "there is none"),
        ("cargo test --workspace --test pyramid no_such_test", "no test of that name"),
        # A helper's name is no test's.
        ("cargo test --workspace --test arm rays::nothing", "no test of that name"),
        ("cargo test --test pyramid", "--workspace"),
        ("cargo run --example no_such", "there is none"),
        ("cargo bench --bench cull", "expected test or run"),
        ("pytest tests/test_no_such.py", "no such file"),
        ("pytest tests/test_lod.py -k no_such", "no test of that name"),
        ("pytest tests/test_lod.py --lf now", "expected -k"),
        ("python examples/no_such.py", "no such file"),
        ("python -m hizvk.no_such", "ended with 1"),
        ("python -m tools.speed --part no-such", "does not name it"),
        ("python -m tools.hierarchy no-such", "ended with 2"),
        ("python -m tools.hierarchy compare --no-such", "does not name it"),
        ("hizvk bench --no-such", "does not name it"),
        ("hizvk demo --scene city", "does not name it"),
        ("make no-such", "no such target"),
        ("make view ARGS='--scene nowhere'", "nowhere: the viewer"),
        ("make view ARGS='--no-such'", "--no-such: the viewer"),
        ("make wheel ARGS='--quick'", "which view"),
        ("rm -r docs", "expected one of"),
        ("make", "ends too early"),
    ],
)
def test_commands_that_could_not_run_are_found(command: str, why: str) -> None:
    assert why in (wrong(command) or "")


def test_a_row_that_is_missing_is_found() -> None:
    planted = TEXT.replace("### R7. ", "### R77. ")
    assert [row.name for row in rows(planted)] != WANTED


def names_of_python() -> list[str]:
    """Names that the page gives as `hizvk.name` or as `Class.name` of the package."""
    spans = set(re.findall(r"`(?:hizvk\.)?([A-Z]\w+(?:\.\w+)?|(?<=hizvk\.)\w+)`", TEXT))
    return sorted(
        span for span in spans if "::" not in span and hasattr(hizvk, span.partition(".")[0])
    )


def test_what_python_delivers_is_there() -> None:
    found = names_of_python()
    assert len(found) > 20
    for name in found:
        target: object = hizvk
        for part in name.split("."):
            target = getattr(target, part)
    for module, name in re.findall(r"`(hizvk(?:\.\w+)*)\.(\w+)`", TEXT):
        is_module = importlib.util.find_spec(f"{module}.{name}") is not None
        assert is_module or hasattr(importlib.import_module(module), name), f"{module}.{name}"


def test_what_rust_delivers_is_there() -> None:
    sources = "\n".join(
        path.read_text(encoding="utf-8") for path in ROOT.glob("crates/hiz_core/src/**/*.rs")
    )
    face = (ROOT / "crates" / "hiz_core" / "src" / "lib.rs").read_text(encoding="utf-8")
    spans = re.findall(r"`([A-Z]\w+)::(\w+)`", TEXT)
    assert len(spans) > 20
    for owner, name in spans:
        assert re.search(rf"\b{owner}\b", face), f"{owner} is not public"
        assert re.search(rf"\b(?:pub (?:const )?fn )?{name}\b", sources), f"{owner}::{name}"


def test_superseded_ways_say_by_what_and_why() -> None:
    section = TEXT.partition("## Superseded ways\n")[2]
    sentences = [" ".join(each.split()) for each in section.split("\n- ")[1:]]
    for way, by in SUPERSEDED.items():
        [sentence] = [each for each in sentences if way in each.partition(":")[0]]
        assert by in sentence, sentence
        assert "because" in sentence, sentence
    assert len(sentences) == len(SUPERSEDED)


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_runs(command: str, tmp_path: Path) -> None:
    """As the page says: in a checkout, with the environment's programs on PATH."""
    programs = str(Path(sys.executable).parent)
    environment = os.environ | {"PATH": os.pathsep.join([programs, os.environ["PATH"]])}
    if command == "make test-swiftshader":
        pytest.skip("it takes as long as `make test`; the daily workflow runs it")
    run = subprocess.run(
        ["bash", "-c", command.replace("out/sources", str(tmp_path))],
        cwd=ROOT,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    said = run.stdout + run.stderr
    assert run.returncode == 0, said[-4000:]
    # A filter that matches nothing succeeds, too.
    counts = [int(count) for count in re.findall(r"test result: ok\. (\d+) passed", said)]
    assert not counts or sum(counts) > 0, said[-4000:]
