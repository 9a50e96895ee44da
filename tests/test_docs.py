"""The code that README, docs and docstrings show runs unchanged.

The commands and files that the pages name exist.
`planted_texts.rs` of hiz_core tests the planted faults that the pages name.
"""

from __future__ import annotations

import contextlib
import doctest
import importlib
import io
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted(
    path
    for pattern in ("*.md", "docs/*.md", "docs/jobs/*.md", "crates/*/README.md")
    for path in ROOT.glob(pattern)
)
FENCE = re.compile(r"^```(?P<language>[^\n]*)\n(?P<text>.*?)^```$", re.DOTALL | re.MULTILINE)
#: Languages that are shown and not run here.
#: rustdoc runs `rust` (`crates/hiz_core/src/lib.rs`), and cargo runs the files that are included.
NOT_RUN = {"sh", "text", "rust", "toml", "wgsl", "json", "{eval-rst}", "{toctree}"}
NOT_RUN |= {"{literalinclude}"}
#: The pages whose Rust blocks rustdoc compiles and runs.
BY_RUSTDOC = ("README.md", "docs/rust.md")


def blocks() -> list[tuple[str, str, str]]:
    """For each fenced block its place, its language and its text."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for fence in FENCE.finditer(text):
            line = text.count("\n", 0, fence.start()) + 1
            language = fence["language"].split()[0] if fence["language"] else ""
            found.append((f"{page.relative_to(ROOT)}:{line}", language, fence["text"]))
    return found


BLOCKS = blocks()
PYTHON = [
    pytest.param(place, text, id=place) for place, language, text in BLOCKS if language == "python"
]


def test_every_block_says_what_it_is() -> None:
    """Nothing would run a block without a language, or with another one."""
    strange = [place for place, language, _ in BLOCKS if language not in {*NOT_RUN, "python"}]
    assert not strange
    # rustdoc runs only the pages in BY_RUSTDOC; nothing would run a Rust block on another page.
    unrun = [
        place
        for place, language, _ in BLOCKS
        if language == "rust" and place.partition(":")[0] not in BY_RUSTDOC
    ]
    assert not unrun
    assert PYTHON
    for page in BY_RUSTDOC:
        assert any(p.startswith(page) for p, language, _ in BLOCKS if language == "rust"), page


@pytest.mark.parametrize("page", BY_RUSTDOC)
def test_rustdoc_runs_the_page(page: str) -> None:
    source = (ROOT / "crates" / "hiz_core" / "src" / "lib.rs").read_text(encoding="utf-8")
    assert f'#[doc = include_str!("../../../{page}")]' in source
    # To rustdoc, indented lines outside a fence are Rust.
    outside = FENCE.sub("", (ROOT / page).read_text(encoding="utf-8"))
    assert not re.search(r"^(    |\t)\S", outside, re.MULTILINE)


@pytest.mark.parametrize(("place", "text"), PYTHON)
def test_python_runs(place: str, text: str) -> None:
    with contextlib.redirect_stdout(io.StringIO()):
        exec(compile(text, place, "exec"), {"__name__": "__main__"})


def modules() -> list[str]:
    """Modules of the package whose docstrings hold examples."""
    found = []
    for path in sorted((ROOT / "python").rglob("*.py")):
        if ">>> " in path.read_text(encoding="utf-8"):
            found.append(
                ".".join(path.relative_to(ROOT / "python").with_suffix("").parts).removesuffix(
                    ".__init__"
                )
            )
    return found


@pytest.mark.parametrize("name", modules())
def test_examples_in_docstrings_run(name: str) -> None:
    told = doctest.testmod(importlib.import_module(name), report=True)
    assert told.attempted > 0
    assert told.failed == 0


def test_no_example_is_skipped() -> None:
    """An example that is not run becomes outdated."""
    skipped = [
        path
        for path in (ROOT / "python").rglob("*.py")
        if "doctest: +SKIP" in path.read_text(encoding="utf-8")
    ]
    assert not skipped


def shown() -> str:
    """All pages as one text."""
    text = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    return re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)  # comments name other projects' sources


def test_commands_that_are_shown_exist() -> None:
    text = shown()
    targets = set(
        re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    )
    for target in set(re.findall(r"(?:^|`|    )make ([a-z-]+)", text, re.MULTILINE)):
        assert target in targets, f"make {target}"
    for kind, folder in (("test", "tests"), ("bench", "benches"), ("example", "examples")):
        for name in set(re.findall(rf"--{kind} ([a-z_]+)", text)):
            found = [
                *ROOT.glob(f"crates/*/{folder}/{name}.rs"),
                *ROOT.glob(f"crates/*/{folder}/{name}/main.rs"),
            ]
            assert found, f"--{kind} {name}"
    files = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    tracked = subprocess.run(
        files, cwd=ROOT, capture_output=True, text=True, check=False
    ).stdout.split()
    if not tracked:
        pytest.skip("not a git checkout: which files are part of it is unknown")
    for path in set(
        re.findall(
            r"(?:tests|scripts|docs|shaders|crates|python)/[\w/.-]+\.(?:py|sh|rs|wgsl|md)", text
        )
    ):
        # Modules of hiz_core are named by their file alone.
        assert any(each.endswith(path) for each in tracked), path


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    """A dead link is one; the search knows words of every page."""
    for module in ("sphinx", "furo", "myst_parser"):
        pytest.importorskip(module, reason="make docs installs it")
    command = [sys.executable, "-m", "sphinx", "--fail-on-warning", "-q", "-b", "html"]
    run = subprocess.run(
        [*command, str(ROOT / "docs"), str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "search.html").exists()
    index = (tmp_path / "searchindex.js").read_text(encoding="utf-8")
    for page in [*ROOT.glob("docs/*.md"), *ROOT.glob("docs/jobs/*.md")]:
        name = page.relative_to(ROOT / "docs").with_suffix("").as_posix()
        assert f'"{name}"' in index, name
