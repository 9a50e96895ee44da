"""Renews the tables and the plot of docs/bench.md: `bench_docs.py [REPORT]`.

REPORT is out/bench/report.md unless it is given.
"""

import shutil
import sys
from pathlib import Path

DOCUMENT = Path(__file__).parent.parent / "docs" / "bench.md"
MARK = "<!-- From here on"
# The scene in which configurations differ most.
PLOT = "castle.png"


def renewed(page: str, report: str) -> str:
    """The page with the report's tables below its mark; sections behind them stay.

    The report's title, pictures and legend are left out.
    """
    lines = report.splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("- Command"))
    last = lines.index("## What the columns mean")
    tables = [
        line.replace("## ", "### ", 1) for line in lines[first:last] if not line.startswith("![")
    ]
    kept = page.splitlines()
    mark = next(k for k, line in enumerate(kept) if line.startswith(MARK))
    behind = [k for k, line in enumerate(kept) if k > mark and line.startswith("## ")]
    rest = kept[behind[0] :] if behind else []
    text = "\n".join([*kept[: mark + 1], "", *tables, "", *rest])
    while "\n\n\n" in text:
        text = text.replace("\n\n\n", "\n\n")
    return text.rstrip() + "\n"


def main(report: Path) -> None:
    """Renews the page, and the plot where the report has one."""
    text = renewed(DOCUMENT.read_text(encoding="utf-8"), report.read_text(encoding="utf-8"))
    DOCUMENT.write_text(text, encoding="utf-8")
    if (report.parent / PLOT).exists():
        shutil.copyfile(report.parent / PLOT, DOCUMENT.parent / "images" / "bench.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/bench/report.md"))
