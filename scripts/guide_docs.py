"""Renews the tables of docs/guide.md from those of docs/bench.md: `guide_docs.py`.

Run it after `bench_docs.py`.
A table stands between two marks, and the first mark names it.
Every cell is a count, or a ratio of two cells, of one of the bench's tables.
So the two pages cannot disagree, and a test compares them.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

DOCS = Path(__file__).resolve().parent.parent / "docs"
QUOTATION = re.compile(r"(<!-- bench: ([\w ]+) -->\n).*?(<!-- bench: end -->)", re.DOTALL)

#: By scene, label and column: the cell's text.
Rows = dict[str, dict[str, dict[str, str]]]

DESCENT = "boxes, 2x2, descent"
BEST = "best rectangle test (float64, all pixels)"
#: Which levels of the pyramid are stored, as in the bench's labels; nothing stands for all.
LEVELS = {
    "all levels": "",
    "levels >= 2": ", levels >= 2",
    "levels >= 3": ", levels >= 3",
    "level 4 alone": ", level 4 alone",
}
#: Depth images, likewise.
IMAGES = {
    "full": "",
    "plain 1/2": ", depth 1/2",
    "plain 1/4": ", depth 1/4",
    "conservative 1/2": ", depth 1/2 conservative",
    "conservative 1/4": ", depth 1/4 conservative",
}


def rows(bench: str) -> Rows:
    """The cells of the bench's tables, without the marks of emphasis and of the Pareto front.

    A scene has several tables with the same labels; their columns are joined.

    Raises
    ------
    KeyError
        If a label is not in all tables of its scene.
    """
    found: Rows = {}
    for title, text in re.findall(
        r"^### ([\w-]+)\n(.*?)(?=^### |\Z)", bench, re.DOTALL | re.MULTILINE
    ):
        for block in re.findall(r"(?:^\|.*\n)+", text + "\n", re.MULTILINE):
            lines = [
                [cell.strip() for cell in line.strip().strip("|").split("|")]
                for line in block.splitlines()
            ]
            head = lines[0]
            if head[0] != "#":
                continue
            table = {cells[1].strip("*"): cells for cells in lines[2:]}
            scene = found.setdefault(title, {label: {} for label in table})
            for label in scene.keys() ^ table.keys():
                raise KeyError(label)
            for label, cells in table.items():
                scene[label] |= dict(zip(head, cells, strict=True))
    return found


def _number(cell: str) -> float:
    return float(cell.replace("%", "").replace(",", "").replace("..", " ").split()[0])


def _ratio(scene: dict[str, dict[str, str]], label: str, other: str, column: str = "cull") -> str:
    """One cell of a column divided by another one."""
    return f"{_number(scene[label][column]) / _number(scene[other][column]):.2f}"


def _table(
    head: list[str],
    found: Rows,
    cells: Callable[[dict[str, dict[str, str]]], Iterable[str]],
    *,
    turned: bool = False,
) -> str:
    """A table with a row for each scene; `turned`: with a column for each scene."""
    grid = [head, *([name, *cells(scene)] for name, scene in found.items())]
    if turned:
        grid = [list(column) for column in zip(*grid, strict=True)]
    marks = "|---|" + "---:|" * (len(grid[0]) - 1)
    first, *others = (f"| {' | '.join(row)} |" for row in grid)
    return "\n".join([first, marks, *others])


def tables(found: Rows) -> dict[str, str]:
    """Every table of the guide that is made from the bench's, by name."""
    kept, of_best = "of those in view", "of best rect."
    volumes = ("spheres", "boxes", "oriented")
    reads = {
        "2x2": "boxes, 2x2",
        "4x4": "boxes, 4x4",
        "8x8": "boxes, 8x8",
        "2x2 and descent": DESCENT,
    }
    fits = ("boxes, 2x2, descent", "oriented, 2x2, descent")
    others = (
        "numpy Hi-Z, float32",
        "Embree, one ray per pixel",
        "Embree, rays to 9 points of a box",
    )
    return {
        "overview": _table(
            [
                "culls, of what the best rectangle test culls",
                *(f"boxes, {name}" for name in reads),
                "spheres, 2x2 and descent",
                "oriented boxes, 2x2 and descent",
                'oriented boxes, 2x2 and descent, `fit="volume"`',
            ],
            found,
            lambda scene: [
                scene[label][of_best]
                for label in [
                    *reads.values(),
                    "spheres, 2x2, descent",
                    "oriented, 2x2, descent",
                    "oriented, 2x2, descent, volume fit",
                ]
            ],
            turned=True,
        ),
        "volumes": _table(
            [
                "footprint 2x2",
                *(f"{name}: kept" for name in volumes),
                "spheres: time / boxes",
                "oriented: time / boxes",
            ],
            found,
            lambda scene: [
                *(scene[f"{label}, 2x2"][kept] for label in volumes),
                _ratio(scene, "spheres, 2x2", "boxes, 2x2"),
                _ratio(scene, "oriented, 2x2", "boxes, 2x2"),
            ],
        ),
        "reads": _table(
            ["kept, boxes", *reads, "best rectangle test"],
            found,
            lambda scene: [scene[label][kept] for label in [*reads.values(), BEST]],
        ),
        "reads in time": _table(
            ["time of the cull, over 2x2", *list(reads)[1:]],
            found,
            lambda scene: [
                _ratio(scene, label, "boxes, 2x2") for label in list(reads.values())[1:]
            ],
        ),
        "fits": _table(
            [
                "kept, descent",
                "boxes: rectangle",
                "volume",
                "time ratio",
                "oriented: rectangle",
                "volume",
                "time ratio",
            ],
            found,
            lambda scene: [
                cell
                for label in fits
                for cell in (
                    scene[label][kept],
                    scene[f"{label}, volume fit"][kept],
                    _ratio(scene, f"{label}, volume fit", label),
                )
            ],
        ),
        "images": _table(
            ["2x2: kept (false culls)", *IMAGES],
            found,
            lambda scene: [
                f"{row[kept]} ({row['false culls']})"
                for row in (scene[f"boxes, 2x2{image}"] for image in IMAGES.values())
            ],
        ),
        "images in time": _table(
            ["time of the whole way, over full", *list(IMAGES)[1:]],
            found,
            lambda scene: [
                _ratio(scene, f"boxes, 2x2{image}", "boxes, 2x2", "sum")
                for image in list(IMAGES.values())[1:]
            ],
        ),
        "levels": _table(
            ["boxes: kept with 2x2, with a descent", *LEVELS],
            found,
            lambda scene: [
                f"{scene[f'boxes, 2x2{some}'][kept]}, {scene[f'{DESCENT}{some}'][kept]}"
                for some in LEVELS.values()
            ],
        ),
        "levels in time": _table(
            ["time of the reduction, over all levels", *list(LEVELS)[1:]],
            found,
            lambda scene: [
                _ratio(scene, f"boxes, 2x2{some}", "boxes, 2x2", "reduce")
                for some in list(LEVELS.values())[1:]
            ],
        ),
        "coverage": _table(
            ["boxes 2x2", "area: kept", "sample: kept", "stable order: time of the cull, over any"],
            found,
            lambda scene: [
                scene["boxes, 2x2"][kept],
                scene["boxes, 2x2, sample"][kept],
                _ratio(scene, "boxes, 2x2, stable", "boxes, 2x2"),
            ],
        ),
        "others": _table(
            [
                "over boxes 2x2, by the whole way",
                *(f"{label}: time" for label in others),
                *(f"{label}: visible culled" for label in others),
            ],
            found,
            lambda scene: [
                *(_ratio(scene, label, "boxes, 2x2", "sum") for label in others),
                *(scene[label]["false culls"] for label in others),
            ],
            turned=True,
        ),
    }


def renewed(guide: str, bench: str) -> str:
    """The guide with the tables that the bench's page gives."""
    made = tables(rows(bench))
    return QUOTATION.sub(lambda mark: f"{mark[1]}\n{made[mark[2]]}\n\n{mark[3]}", guide)


if __name__ == "__main__":
    page = DOCS / "guide.md"
    bench_page = (DOCS / "bench.md").read_text(encoding="utf-8")
    page.write_text(renewed(page.read_text(encoding="utf-8"), bench_page), encoding="utf-8")
