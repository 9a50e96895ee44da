"""Links between the documents lead somewhere: files, pictures and headings. Nothing is fetched."""

from __future__ import annotations

import re
import subprocess
from collections import Counter
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
#: The pages of the site.
DOCS = sorted([*ROOT.glob("docs/*.md"), *ROOT.glob("docs/jobs/*.md")])
PAGES = sorted([*ROOT.glob("*.md"), *DOCS, *ROOT.glob("crates/*/README.md")])
PAGES.append(ROOT / "examples" / "README.md")
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


def listed() -> list[str]:
    """The patterns of pages in the toctrees of docs/index.md."""
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    toctrees = re.findall(r"^```{toctree}$(.*?)^```$", index, re.DOTALL | re.MULTILINE)
    return [
        line
        for tree in toctrees
        for line in tree.split()
        if re.fullmatch(r"(jobs/)?[a-z_]+\*?", line)
    ]


def test_every_page_is_on_the_way() -> None:
    """From docs/index.md each page can be reached, also by a link that says what it is for."""
    index = ROOT / "docs" / "index.md"
    targets = {target.partition("#")[0] for target in links(index)}
    for page in DOCS:
        name = page.relative_to(ROOT / "docs").with_suffix("").as_posix()
        if name == "index":
            continue
        assert any(fnmatch(name, pattern) for pattern in listed()), name
        assert f"{name}.md" in targets, name


def test_pages_begin_with_a_heading_and_prose() -> None:
    """What a page is for comes before its first section, table, picture or list."""
    others = ("#", "|", "!", "-", ">", "```", "<")
    for page in PAGES:
        text = COMMENT.sub("", page.read_text(encoding="utf-8")).strip()
        first, _, rest = text.partition("\n")
        assert first.startswith("# "), page
        assert not rest.strip().startswith(others), page
        paragraph = rest.strip().split("\n\n")[0]
        assert len(paragraph.split()) >= 8, page


def test_pages_of_the_site_say_what_they_are_for() -> None:
    """The first paragraph says for whom or for what a page is, in a whole sentence."""
    for page in DOCS:
        text = COMMENT.sub("", page.read_text(encoding="utf-8")).strip()
        paragraph = text.partition("\n")[2].strip().split("\n\n")[0]
        if page.stem in ("architecture", "changelog", "contributing", "style"):
            continue  # Sphinx takes the documents of these names, which are checked above
        words = r"\b(for|says|states|tells|takes you|shows|has|keeps)\b"
        assert re.search(words, paragraph), (page, paragraph)
        assert paragraph.rstrip().endswith((".", ":")), page


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
