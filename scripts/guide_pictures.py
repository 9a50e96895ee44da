"""Draws the pictures of docs/guide.md by the code that the page shows: `guide_pictures.py`.

The block below "Pictures of a cull" is run, and its figures are written to docs/images.
"""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOCS: Final = Path(__file__).resolve().parents[1] / "docs"
#: The figures by the names that they have in the block.
FIGURES: Final = ("levels", "overview", "why")


def block() -> str:
    """The code of the section."""
    text = (DOCS / "guide.md").read_text(encoding="utf-8")
    section = text.partition("\n## Pictures of a cull\n")[2]
    found = re.search(r"```python\n(.*?)```", section, re.DOTALL)
    assert found is not None
    return found[1]


def save(figure: Figure, path: Path) -> None:
    """Writes a figure with a palette, which takes half of the bytes."""
    from PIL import Image  # matplotlib brings it

    file = io.BytesIO()
    figure.savefig(file, dpi=80)
    picture = Image.open(file).convert("RGB")
    picture.quantize(256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
        path, optimize=True
    )


def main() -> None:
    """Runs the block and writes its figures."""
    names: dict[str, Any] = {"__name__": "__main__"}
    exec(compile(block(), "docs/guide.md", "exec"), names)
    for name in FIGURES:
        save(names[name], DOCS / "images" / f"{name}.png")


if __name__ == "__main__":
    main()
