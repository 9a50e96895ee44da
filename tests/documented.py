"""Reads the documents' tables, for tests that print the same counts."""

from __future__ import annotations

import re
from pathlib import Path

import hizvk

DOCS = Path(__file__).resolve().parents[1] / "docs"


def page(name: str) -> str:
    """The text of docs/`name`."""
    return (DOCS / name).read_text(encoding="utf-8")


def table(text: str, *head: str) -> list[dict[str, str]]:
    """The rows of the one table that begins with these columns, by column and without emphasis.

    Raises
    ------
    LookupError
        If there is no such table, or more than one.
    """
    found = []
    for block in re.findall(r"(?:^ *\|.*\n)+", text, re.MULTILINE):
        lines = [
            [cell.strip().strip("*") for cell in line.strip().strip("|").split("|")]
            for line in block.splitlines()
        ]
        if tuple(lines[0][: len(head)]) == head:
            found.append([dict(zip(lines[0], line, strict=True)) for line in lines[2:]])
    if len(found) != 1:
        raise LookupError(f"expected one table that begins with {head}, got {len(found)}")
    return found[0]


def is_of_this_driver(text: str) -> bool:
    """Whether the page names the adapter of this run.

    On another adapter rasterised depth differs in its last bits.
    """
    adapter = hizvk.Device().adapter
    text = " ".join(text.split())  # a name may continue on the next line
    return all(part in text for part in (adapter.name, adapter.driver, adapter.driver_info))
