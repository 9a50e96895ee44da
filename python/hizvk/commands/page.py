"""A Markdown page, block by block."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

__all__ = ["Page", "table"]

#: Columns of the text; rows of tables may be longer.
WIDTH: Final = 100


def _wrapped(line: str, first: str = "", further: str = "") -> list[str]:
    """The line in pieces of at most `WIDTH` columns; a line with code stays whole."""
    if "`" in line:
        return [first + line]
    return textwrap.wrap(
        line,
        WIDTH,
        initial_indent=first,
        subsequent_indent=further,
        break_long_words=False,
        break_on_hyphens=False,
    )


def table(head: str, rows: Iterable[Sequence[str]], *, left: int = 1) -> list[str]:
    """The lines of a table.

    Parameters
    ----------
    head : str
        The columns' titles, with ``|`` between them.
    rows : iterable of sequence of str
        The cells.
    left : int
        How many columns are set flush left; the others hold numbers and are set flush right.
    """
    titles = [title.strip() for title in head.split("|")]
    marks = ["---" if number < left else "---:" for number in range(len(titles))]
    lines = [f"| {' | '.join(titles)} |".replace("  ", " "), f"|{'|'.join(marks)}|"]
    return [*lines, *(f"| {' | '.join(cells)} |" for cells in rows)]


class Page:
    """Collects blocks; ``str(page)`` puts one empty line between each two.

    Parameters
    ----------
    title : str
        The heading of the first level.
    """

    def __init__(self, title: str) -> None:
        self._blocks = [[f"# {title}"]]

    def heading(self, text: str) -> None:
        """A heading of the second level."""
        self._blocks.append([f"## {text}"])

    def text(self, *lines: str) -> None:
        """A paragraph; each argument begins a new line."""
        self._blocks.append([piece for line in lines for piece in _wrapped(line)])

    def items(self, *items: str) -> None:
        """A list, or nothing if there are no items; an item may have several lines."""
        block = []
        for item in items:
            for number, line in enumerate(item.split("\n")):
                block += _wrapped(line, "  " if number else "- ", "  ")
        if block:
            self._blocks.append(block)

    def table(self, head: str, rows: Iterable[Sequence[str]], *, left: int = 1) -> None:
        """A table, as in `table`."""
        self._blocks.append(table(head, rows, left=left))

    def picture(self, what: str, file: str) -> None:
        """A picture by its file's name."""
        self._blocks.append([f"![{what}]({file})"])

    def __str__(self) -> str:
        return "\n\n".join("\n".join(lines) for lines in self._blocks) + "\n"
