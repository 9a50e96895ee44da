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


def main(report: Path) -> None:
    """Puts the report, without title, pictures and legend, in place of what is below the mark."""
    lines = report.read_text(encoding="utf-8").splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("- Command"))
    last = lines.index("## What the columns mean")
    tables = [
        line.replace("## ", "### ", 1) for line in lines[first:last] if not line.startswith("![")
    ]
    kept = DOCUMENT.read_text(encoding="utf-8").splitlines()
    mark = next(k for k, line in enumerate(kept) if line.startswith(MARK))
    text = "\n".join([*kept[: mark + 1], "", *tables]).replace("\n\n\n", "\n\n").rstrip()
    DOCUMENT.write_text(text + "\n", encoding="utf-8")
    if (report.parent / PLOT).exists():
        shutil.copyfile(report.parent / PLOT, DOCUMENT.parent / "images" / "bench.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/bench/report.md"))
