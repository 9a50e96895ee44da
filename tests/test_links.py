"""Links between the documents lead somewhere: files, pictures and headings. Nothing is fetched."""

from __future__ import annotations

import re
import subprocess
from collections import Counter
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("crates/*/README.md")])
FENCE = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
LINK = re.compile(r"\[[^\]]*\]\((?P<target>[^)\s]+)\)")
OUTSIDE = ("http://", "https://", "mailto:")
#: The pages whose rooms and files are checked by name.
NAMING = ("ARCHITECTURE.md", "CONTRIBUTING.md", "STYLE.md", "README.md")


def prose(page: Path) -> str:
    """The page without fenced blocks and comments."""
    return COMMENT.sub("", FENCE.sub("", page.read_text(encoding="utf-8")))


def links(page: Path) -> list[str]:
    """Where its links lead that stay in the repository."""
    found = (link["target"] for link in LINK.finditer(prose(page)))
    return [target for target in found if not target.startswith(OUTSIDE)]


def anchors(page: Path) -> set[str]:
    """The anchors of its headings, as GitHub and MyST form them."""
    found: set[str] = set()
    seen: Counter[str] = Counter()
    for title in re.findall(r"^#{1,6} (.+)$", prose(page), re.MULTILINE):
        title = LINK.sub(lambda link: link[0][1:].partition("]")[0], title)
        slug = re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-")
        found.add(f"{slug}-{seen[slug]}" if seen[slug] else slug)
        seen[slug] += 1
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    dead = []
    for target in links(page):
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        is_there = file.is_relative_to(ROOT) and file.exists()
        if not is_there or (anchor and anchor not in anchors(file)):
            dead.append(target)
    assert not dead


def test_the_search_for_links_sees_them() -> None:
    assert sum(len(links(page)) for page in PAGES) > 50
    assert "opencv" in anchors(ROOT / "docs" / "conventions.md")
    assert any("#" in target for target in links(ROOT / "docs" / "troubleshooting.md"))


def test_every_page_is_on_the_way() -> None:
    """From docs/index.md each page can be reached."""
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    toctrees = re.findall(r"^```{toctree}$(.*?)^```$", index, re.DOTALL | re.MULTILINE)
    listed = [
        line for tree in toctrees for line in tree.split() if re.fullmatch(r"[a-z_]+\*?", line)
    ]
    for page in {page.stem for page in ROOT.glob("docs/*.md")} - {"index"}:
        assert any(fnmatch(page, pattern) for pattern in listed), page


def test_pages_begin_with_a_heading_and_prose() -> None:
    """What a page is for comes before its first section, table, picture or list."""
    others = ("#", "|", "!", "-", ">", "```", "<")
    for page in PAGES:
        text = COMMENT.sub("", page.read_text(encoding="utf-8")).strip()
        first, _, rest = text.partition("\n")
        assert first.startswith("# "), page
        assert not rest.strip().startswith(others), page


def test_files_that_are_named_exist() -> None:
    """`room/file.rs`, `file.wgsl`: in the rooms of hiz_core, or in shaders/."""
    files = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    tracked = subprocess.run(
        files, cwd=ROOT, capture_output=True, text=True, check=False
    ).stdout.split()
    if not tracked:
        pytest.skip("not a git checkout: which files are part of it is unknown")
    named = {
        (name, found)
        for name in NAMING
        for found in re.findall(r"(?<![:/\w])[a-z_]\w*(?:/\w+)*\.(?:rs|wgsl)\b", prose(ROOT / name))
    }
    gone = [
        (page, found)
        for page, found in sorted(named)
        if not any(path == found or path.endswith(f"/{found}") for path in tracked)
    ]
    assert not gone
