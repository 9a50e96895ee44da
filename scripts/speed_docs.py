"""Renews what docs/performance.md and guide.md quote of a run: `speed_docs.py [REPORT]`.

REPORT is out/speed/report.md unless it is given.
The plot is drawn from the tables as they are quoted; `speed_docs.py --plot` draws it again alone.
Each quotation stands between two marks.
The first mark names the report's sections, and may name which rows of their tables are wanted:
`<!-- speed: Section; Other section | part of a label | part of another -->`.
"""

import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from tools.speed import plots

DOCS = Path(__file__).parent.parent / "docs"
DOCUMENTS = (DOCS / "performance.md", DOCS / "guide.md")
QUOTATION = re.compile(r"(<!-- speed: (.*?) -->\n).*?(<!-- speed: end -->)", re.DOTALL)


def sections(report: str) -> dict[str, str]:
    """The text below each heading, without pictures; "head" is the text before the first one."""
    head, *parts = re.split(r"^## ", report, flags=re.MULTILINE)
    found = {"head": head[head.index("- Command") :]}
    for part in parts:
        title, _, text = part.partition("\n")
        found[title] = "\n".join(line for line in text.splitlines() if not line.startswith("!["))
    return {title: re.sub(r"\n{3,}", "\n\n", text).strip() for title, text in found.items()}


def quoted(found: dict[str, str], wanted: str) -> str:
    """A section, or the rows of its tables whose label contains one of the words."""
    name, *words = (part.strip() for part in wanted.split("|"))
    if not words:
        return found[name]
    table = [line for line in found[name].splitlines() if line.startswith("|")]
    rows = [line for line in table[2:] if any(word in line.split("|")[1] for word in words)]
    return "\n".join([*table[:2], *rows])


def main(report: Path) -> None:
    """Replaces every quotation, and the plot."""
    found = sections(report.read_text(encoding="utf-8"))

    def quote(mark: re.Match[str]) -> str:
        return (
            mark[1]
            + "\n"
            + "\n\n".join(quoted(found, each) for each in mark[2].split("; "))
            + "\n\n"
            + mark[3]
        )

    for document in DOCUMENTS:
        document.write_text(
            QUOTATION.sub(quote, document.read_text(encoding="utf-8")), encoding="utf-8"
        )
    plot()


def quotation(section: str) -> str:
    """What docs/performance.md quotes of a section."""
    text = DOCUMENTS[0].read_text(encoding="utf-8")
    (found,) = (mark[0] for mark in QUOTATION.finditer(text) if section in mark[2].split("; "))
    return found


def plot() -> None:
    """Draws the tables by size."""
    adapter = re.search(r"^- Adapter: (.+?) \(\w+\);", quotation("head"), re.MULTILINE)
    assert adapter
    plots.draw_tables(DOCS / "images" / "scale.png", quotation("Scale"), adapter[1])


if __name__ == "__main__":
    if sys.argv[1:] == ["--plot"]:
        plot()
    else:
        main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/speed/report.md"))
