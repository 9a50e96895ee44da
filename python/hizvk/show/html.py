"""What a notebook shows: a picture beside a table, without scripts or styles of the page's own."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from .png import png_url

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["document", "number"]

_CELL = "padding:1px 10px 1px 0;text-align:left"


def number(value: float) -> str:
    """A number as people write it: four digits, no exponent where it is not needed."""
    return f"{value:,.0f}" if 1e4 <= abs(value) < 1e9 else f"{value:.4g}"


def document(
    title: str,
    picture: bytes | None,
    *,
    table: tuple[Sequence[str], Sequence[Sequence[str]]] = ((), ()),
    depth_key: tuple[str, str, str, str] | None = None,
    sky: str = "",
    notes: Sequence[str] = (),
    swatches: Sequence[str] = (),
) -> str:
    """One block of HTML; every text is escaped.

    Parameters
    ----------
    title : str
        The line above.
    picture : bytes, optional
        A PNG.
    table : (head, rows)
        The cells of a table below; no table without rows.
    depth_key : (low, colours, high, what), optional
        The ends of a scale of depth, and its colours with commas between them.
    sky : str
        The colour of what is infinitely far, for the scale.
    notes : sequence of str
        Lines below.
    swatches : sequence of str
        A colour for each row of the table, drawn before its first cell.
    """
    parts = [f"<b>{escape(title)}</b>"]
    if picture is not None:
        style = "max-width:100%;image-rendering:pixelated;display:block;margin:4px 0"
        parts.append(f'<img alt="{escape(title)}" style="{style}" src="{png_url(picture)}">')
    if depth_key is not None:
        low, colours, high, what = map(escape, depth_key)
        bar = "display:inline-block;height:10px;border:1px solid #888;vertical-align:middle"
        parts.append(
            f'<div style="font-size:90%">{low} '
            f'<span style="{bar};width:160px;background:linear-gradient(to right,{colours})">'
            f"</span> {high} &nbsp;{what}; "
            f'<span style="{bar};width:10px;background:{sky}"></span> infinitely far</div>'
        )
    head, rows = table
    if rows:
        cells = "".join(f'<th style="{_CELL}">{escape(cell)}</th>' for cell in head)
        lines = [f"<tr>{cells}</tr>"] if head else []
        for place, row in enumerate(rows):
            mark = ""
            if place < len(swatches) and swatches[place]:
                box = "display:inline-block;width:10px;height:10px;border:1px solid #888"
                mark = f'<span style="{box};background:{swatches[place]}"></span> '
            cells = "".join(
                f'<td style="{_CELL}">{"" if column else mark}{escape(cell)}</td>'
                for column, cell in enumerate(row)
            )
            lines.append(f"<tr>{cells}</tr>")
        parts.append(f'<table style="border-collapse:collapse">{"".join(lines)}</table>')
    parts += [f'<div style="font-size:90%">{escape(note)}</div>' for note in notes]
    return f"<div>{''.join(parts)}</div>"
