"""Scripts that renew a page keep what is not theirs."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "scripts"))

import bench_docs  # noqa: E402 - scripts are no package

REPORT = """# hizvk bench

- Command: `hizvk bench`

## mountains

| a | b |
![plot](mountains.png)

## What the columns mean

- a: a letter
"""


def test_new_tables_leave_the_sections_behind_them() -> None:
    """Whole frames come from another command."""
    page = bench_docs.DOCUMENT.read_text(encoding="utf-8")
    behind = page[page.index("\n## Whole frames with and without culling") :]
    before = page[: page.index(bench_docs.MARK)]
    new = bench_docs.renewed(page, REPORT)
    assert new.startswith(before)
    assert new.endswith(behind)
    middle = new[len(before) : -len(behind)].splitlines()[1:]
    expected = ["- Command: `hizvk bench`", "", "### mountains", "", "| a | b |"]
    assert [*filter(None, middle)] == [*filter(None, expected)]
    assert bench_docs.renewed(new, REPORT) == new
