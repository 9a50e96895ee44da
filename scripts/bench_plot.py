"""Draws docs/images/bench.png from the tables of docs/bench.md: `bench_plot.py [SCENE] [PNG]`.

The castle is drawn, unless another scene is named.
It needs matplotlib.
A run of the bench draws the same picture from its own results, which are not rounded.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from hizvk.bench import configurations, plots
from hizvk.bench.results import Row, SceneResult
from hizvk.measuring.spread import Spread

DOCS = Path(__file__).resolve().parents[1] / "docs"


def scenes(text: str) -> list[str]:
    """The scenes that have tables."""
    return re.findall(r"^### ([\w-]+)$", text, re.MULTILINE)


def scene_of(text: str, key: str) -> SceneResult:
    """The rows of a scene's two tables, as the bench has them.

    Raises
    ------
    ValueError
        If the page has no such scene.
    """
    found = re.search(rf"^### {re.escape(key)}\n(.*?)(?=^### |\Z)", text, re.DOTALL | re.MULTILINE)
    if found is None:
        raise ValueError(f"scene: expected one of {', '.join(scenes(text))}, got {key!r}")
    known = {str(one): one for one in configurations.matrix("default")}
    rows = []
    for times, errors in zip(*_tables(found[1]), strict=True):
        label = times[1].strip("*")
        assert label == errors[1].strip("*")
        if label not in known and not times[1].startswith("*"):
            raise ValueError(f"docs/bench.md: expected a configuration of the bench, got {label!r}")
        quartiles = times[7].split("..")
        total = (
            Spread(_number(quartiles[0]), _number(times[6]), _number(quartiles[1]))
            if (times[6])
            else None
        )
        rows.append(
            Row(
                label,
                known.get(label),
                total_ms=total,
                ns_per_instance=_number(errors[2]) if errors[2] else None,
                false_culls=int(_number(errors[4])) if errors[4] else 0,
                hidden_kept_in_view=_number(errors[6]) / 100.0,
                pareto="P" in times[0],
            )
        )
    told = re.search(r"(\d+) views of (\d+x\d+)", found[1])
    assert told is not None
    views, size = told.groups()
    instances = re.search(r"([\d,]+)\s+instances\s+\(", found[1])
    width, height = size.split("x")
    numbers = dict.fromkeys(
        ("occluder_triangles", "instance_triangles", "repetitions", "visible", "hidden", "inside"),
        0,
    )
    ms = dict.fromkeys(("one_instance_ms", "upload_ms", "way_upload_ms", "warm_up_ms"), 0.0)
    return SceneResult(
        key=key, name=key, instances=int(_number(instances[1])) if instances else 0,
        views=int(views), size=(int(height), int(width)), truth="", rows=rows, **numbers, **ms,
    )  # fmt: skip


def _tables(text: str) -> list[list[list[str]]]:
    """The cells below the heads of the two numbered tables."""
    blocks = re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE)
    cells = [
        [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines]
        for block in blocks
        if (lines := block.splitlines())[0].startswith("| # |")
    ]
    return [table[2:] for table in cells]


def _number(text: str) -> float:
    return float(text.replace(",", "").removesuffix("%"))


def main(key: str, path: Path) -> None:
    """Draws a scene."""
    plots.draw(path, scene_of((DOCS / "bench.md").read_text(encoding="utf-8"), key))


if __name__ == "__main__":
    main(
        sys.argv[1] if len(sys.argv) > 1 else "castle",
        Path(sys.argv[2]) if len(sys.argv) > 2 else DOCS / "images" / "bench.png",
    )
