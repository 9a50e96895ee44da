"""Renews what docs/performance.md quotes of a run: `speed_docs.py [REPORT]` (out/speed/report.md).

Each quotation stands between two marks that name the report's sections.
"""

import re
import shutil
import sys
from pathlib import Path

DOCUMENT = Path(__file__).parent.parent / "docs" / "performance.md"
QUOTATION = re.compile(r"(<!-- speed: (.*?) -->\n).*?(<!-- speed: end -->)", re.DOTALL)


def sections(report: str) -> dict[str, str]:
    """What stands below each heading, without pictures; below "head", what stands before the first one."""
    head, *parts = re.split(r"^## ", report, flags=re.MULTILINE)
    found = {"head": head[head.index("- Command") :]}
    for part in parts:
        title, _, text = part.partition("\n")
        found[title] = "\n".join(line for line in text.splitlines() if not line.startswith("!["))
    return {title: re.sub(r"\n{3,}", "\n\n", text).strip() for title, text in found.items()}


def main(report: Path) -> None:
    """Replaces every quotation, and the plot."""
    found = sections(report.read_text(encoding="utf-8"))

    def quote(mark: re.Match[str]) -> str:
        return mark[1] + "\n" + "\n\n".join(found[name] for name in mark[2].split("; ")) + "\n\n" + mark[3]

    DOCUMENT.write_text(QUOTATION.sub(quote, DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
    if (report.parent / "scale.png").exists():
        shutil.copyfile(report.parent / "scale.png", DOCUMENT.parent / "images" / "scale.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/speed/report.md"))
