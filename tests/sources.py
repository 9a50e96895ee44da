"""Reads docs/sources.md: its rows, and the commands that show them.

`wrong` says why a command could not run, without running it.
"""

from __future__ import annotations

import ast
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "sources.md"
ROW = re.compile(r"^### (?P<name>[A-Z]\d+)\. (?P<title>.+)$", re.MULTILINE)
COMMAND = re.compile(r"^- `(?P<command>[^`]+)`", re.MULTILINE)
#: The folder of a Rust target, by the option that names it.
FOLDERS = {"--test": "tests", "--example": "examples"}


@dataclass(frozen=True)
class Row:
    """One thing that a text asks for."""

    name: str
    title: str
    text: str

    @property
    def commands(self) -> list[str]:
        """The commands that show it."""
        return [found["command"] for found in COMMAND.finditer(self.text)]

    @property
    def is_open(self) -> bool:
        """Whether the page says that nothing delivers it yet."""
        return re.search(r"^Open: ", self.text, re.MULTILINE) is not None


def rows(page: str) -> list[Row]:
    """The rows of the page in its order; a row ends at the next heading."""
    heads = list(ROW.finditer(page))
    texts = [re.split(r"^#", page[head.end() :], maxsplit=1, flags=re.MULTILINE) for head in heads]
    return [
        Row(head["name"], head["title"], text[0]) for head, text in zip(heads, texts, strict=True)
    ]


def wrong(command: str) -> str | None:
    """Why the command could not run, or None."""
    words = shlex.split(command)
    checks = {
        "cargo": _wrong_cargo,
        "pytest": _wrong_pytest,
        "python": _wrong_python,
        "hizvk": lambda rest: _wrong_options(("-m", "hizvk", rest[0]), rest[1:]),
        "make": _wrong_make,
    }
    if words[0] not in checks:
        return f"{words[0]}: expected one of {', '.join(checks)}"
    try:
        return checks[words[0]](words[1:])
    except (IndexError, ValueError):
        return "it ends too early"


def _wrong_cargo(words: list[str]) -> str | None:
    if words[0] not in ("test", "run"):
        return f"cargo {words[0]}: expected test or run"
    rest = [word for word in words[1:] if word not in ("--workspace", "--release")]
    if words[0] == "test" and "--workspace" not in words:
        return "cargo test: expected --workspace, without which wgpu is compiled anew"
    kind, name, *filters = rest
    if kind == "--bin":
        files = [
            path
            for manifest in ROOT.glob("crates/*/Cargo.toml")
            if f'[[bin]]\nname = "{name}"' in manifest.read_text(encoding="utf-8")
            for path in manifest.parent.glob("src/**/*.rs")
        ]
    elif kind in FOLDERS:
        places = [
            path
            for ending in (f"{name}.rs", f"{name}/main.rs")
            for path in ROOT.glob(f"crates/*/{FOLDERS[kind]}/{ending}")
        ]
        files = [
            path
            for place in places
            # A test's modules lie in a folder of its name.
            for path in (
                place.parent.glob("*.rs")
                if place.name == "main.rs"
                else [place, *place.with_suffix("").glob("*.rs")]
            )
        ]
    else:
        return f"{kind}: expected --test, --example or --bin"
    if not files:
        return f"{kind} {name}: there is none"
    if len(filters) > 1:
        return f"cargo takes one filter, got {filters}"
    return _wrong_filter(filters[0], files) if filters else None


def _wrong_filter(wanted: str, files: list[Path]) -> str | None:
    """Whether the path of any test contains the filter; modules are files here."""
    for path in files:
        source = path.read_text(encoding="utf-8")
        names = re.findall(r"#\[test\]\n(?:\s*(?:#\[|//)[^\n]*\n)*\s*fn (\w+)", source)
        if any(wanted in f"{path.stem}::{name}" for name in names):
            return None
    return f"{wanted}: no test of that name"


def _wrong_pytest(words: list[str]) -> str | None:
    path, *rest = words
    if not (ROOT / path).is_file():
        return f"{path}: no such file"
    names = [
        node.name
        for node in ast.walk(ast.parse((ROOT / path).read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    ]
    while rest:
        option, value, *rest = rest
        if option == "-k":
            # As pytest does: a part of a name, in capitals or not.
            if not any(value.lower() in name.lower() for name in names):
                return f"-k {value}: no test of that name"
        elif (option, value) != ("-m", "not slow"):
            return f"{option} {value}: expected -k WORD or -m 'not slow'"
    return None


def _wrong_python(words: list[str]) -> str | None:
    if words[0] == "-m":
        module, rest = words[1], words[2:]
        # A first word without dashes is a command of its own.
        commands = rest[:1] if rest and not rest[0].startswith("-") else []
        return _wrong_options(("-m", module, *commands), rest[len(commands) :])
    return None if (ROOT / words[0]).is_file() else f"{words[0]}: no such file"


def _wrong_options(program: tuple[str, ...], words: list[str]) -> str | None:
    """Asks the program for its help, which has to name every option and every chosen value."""
    status, text = _help(program)
    if status != 0:
        return f"{' '.join(program)} --help: ended with {status}: {text[-300:]}"
    for option, value in zip(words, [*words, ""][1:], strict=True):
        if not option.startswith("--"):
            continue
        if not re.search(rf"{option}\b", text):
            return f"{option}: {' '.join(program)} --help does not name it"
        chosen = option in ("--scene", "--part")
        if chosen and not re.search(rf"\b{re.escape(value)}\b", text):
            return f"{option} {value}: {' '.join(program)} --help does not name it"
    return None


@cache
def _help(program: tuple[str, ...]) -> tuple[int, str]:
    run = subprocess.run(
        [sys.executable, *program, "--help"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    return run.returncode, run.stdout + run.stderr


def _wrong_make(words: list[str]) -> str | None:
    target, *rest = words
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    if not re.search(rf"^{re.escape(target)}:", makefile, re.MULTILINE):
        return f"make {target}: there is no such target"
    if not rest:
        return None
    if target not in ("view", "bench-view") or len(rest) != 1 or not rest[0].startswith("ARGS="):
        return f"{rest}: expected ARGS=..., which view and bench-view take"
    # The viewer's options and names are string literals of its sources.
    sources = (ROOT / "crates" / "hiz_viewer" / "src").rglob("*.rs")
    literals = set(
        re.findall(r'"([\w-]+)"', "".join(path.read_text(encoding="utf-8") for path in sources))
    )
    # Keys are named in capitals or not; scenes are not.
    literals |= {literal.lower() for literal in literals}
    given = shlex.split(rest[0].removeprefix("ARGS="))
    unknown = [
        word
        for part in given
        for word in part.split(",")
        if not word.isdigit() and word not in literals and word.lower() not in literals
    ]
    return f"{', '.join(unknown)}: the viewer does not know it" if unknown else None
