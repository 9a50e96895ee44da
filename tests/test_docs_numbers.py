"""Tables of counts in README and docs contain what their command prints today.

Numbers that are derived from another table agree with that table.

On one driver counts repeat with the seed.
On another driver rasterised depth differs in its last bits, and so do a few counts.
There the comparison is skipped.
"""

from __future__ import annotations

import dataclasses
import importlib.util
import sys
from pathlib import Path
from typing import Any

import pytest

import documented
import hizvk
from documented import page
from hizvk.bench import command, footprints, texts, texts_report
from tools.speed import bounds, figures, plots
from tools.speed.run import WORKLOADS, Run

ROOT = Path(__file__).resolve().parents[1]
CASTLE = ROOT.parent / "shared" / "judge" / "castle.npz"
#: The bench's columns that are counts, or shares of counts.
COUNTS = ("texels/inst.", "false culls", "hidden kept", "of those in view", "of best rect.")


def script(name: str) -> Any:
    """A module of scripts/, which is not a package."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "scripts" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


guide_docs = script("guide_docs")


def test_the_plot_by_size_is_of_the_table_above_it() -> None:
    """If this is red, run ``scripts/speed_docs.py --plot``."""
    docs = script("speed_docs")
    file = (ROOT / "docs" / "images" / "scale.png").read_bytes()
    text = docs.quotation("Scale")
    assert b"Source\0" + plots.mark_of(text).encode() in file
    found = plots.found_in(text, "x")
    assert [row.instances for row in found.instance_counts[:2]] == [1_000, 10_000]
    (row,) = (row for row in found.instance_counts if row.instances == 10_000_000)
    cells = documented.table(page("performance.md"), "instances", "pieces")[6]
    assert cells["instances"] == "10,000,000"
    assert (row.upload_ms, row.flat_ms) == (float(cells["upload"]), float(cells["flat"]))
    assert row.tests == round(1e7 * float(cells["tests"]))
    assert row.device_bytes == round(1e7 * float(cells["bytes"]))
    cells = documented.table(page("performance.md"), "pixels", "memcpy")[0]
    assert cells["pixels"] == "256x256"
    image = found.image_sizes[0]
    assert (image.side, image.reduce_ms) == (256, float(cells["all levels"]))
    assert image.groups_ms == float(cells["cull, groups"])
    assert image.texels == float(cells["texels per instance, flat"])
    # A number of another run has another mark.
    digit = text.index("| 1,000 |") + len("| 1,000 | 1 | 0.")
    assert text[digit].isdigit()
    other = f"{text[:digit]}{(int(text[digit]) + 1) % 10}{text[digit + 1 :]}"
    assert plots.mark_of(other) != plots.mark_of(text)


def test_the_guide_quotes_the_bench() -> None:
    """If this is red, run scripts/guide_docs.py."""
    guide = page("guide.md")
    assert guide_docs.QUOTATION.search(guide)
    assert guide_docs.renewed(guide, page("bench.md")) == guide


def test_a_table_that_was_edited_is_seen() -> None:
    bench = page("bench.md").replace("| boxes, 2x2 |", "| boxes, 2x2 (edited) |", 1)
    with pytest.raises(KeyError, match="boxes, 2x2"):
        guide_docs.renewed(page("guide.md"), bench)
    cells = guide_docs.rows(page("bench.md"))["room"]["boxes, 2x2"]
    bench = page("bench.md").replace(
        f"| {cells['of those in view']} | {cells['of best rect.']} |", "| 1 % | 2 % |"
    )
    assert guide_docs.renewed(page("guide.md"), bench) != page("guide.md")


@pytest.mark.parametrize(
    "scene",
    [
        "room",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in ("mountains", "city", "city-far", "castle")
        ),
    ],
)
def test_the_bench_still_counts_so(tmp_path: Path, scene: str) -> None:
    """If this is red, run `make bench` and scripts/bench_docs.py.

    Write in the log what changed the counts.
    """
    if not documented.is_of_this_driver(page("bench.md")):
        pytest.skip(f"docs/bench.md was printed on another driver than {hizvk.Device().adapter}")
    if scene == "castle" and not CASTLE.exists():
        pytest.skip("the castle is not beside this checkout (../shared/judge)")
    for module, what in (
        ("embreex", "the truth is cast"),
        ("matplotlib", "the elevation model is taken from"),
    ):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module}, by which {what}, is not installed")
    command.run(tmp_path, keys=[scene], repetitions=1, castle=CASTLE if scene == "castle" else None)
    printed = (tmp_path / "report.md").read_text(encoding="utf-8").replace("## ", "### ")
    ours, committed = guide_docs.rows(printed)[scene], guide_docs.rows(page("bench.md"))[scene]
    assert list(ours) == list(committed)
    different = [
        f"{label}, {column}: {ours[label][column]}, in docs/bench.md {committed[label][column]}"
        for label in ours
        for column in COUNTS
        if ours[label][column] != committed[label][column]
    ]
    assert not different, "\n".join(different)


def test_few_and_many_bounds_are_still_kept_so() -> None:
    """If this is red, run `make bench-speed` and scripts/speed_docs.py."""
    if not documented.is_of_this_driver(page("performance.md")):
        pytest.skip("docs/performance.md was printed on another driver")
    device = hizvk.Device()
    found = figures.Found("", 2010, "quick", device.adapter)
    extent = dataclasses.replace(WORKLOADS["default"], rounds=1)
    bounds.measure(Run(device, extent, 2010, found, lambda _: None))
    assert not found.broken()
    ours = {(one.rasteriser, f"{one.bounds:,}"): f"{one.kept:,}" for one in found.whole_calls}
    assert len(ours) == 2 * len(bounds.COUNTS)
    shown = documented.table(page("performance.md"), "rasteriser", "bounds")
    assert {(row["rasteriser"], row["bounds"]): row["kept"] for row in shown} == ours


@pytest.mark.slow
def test_the_texts_still_lose_so(tmp_path: Path) -> None:
    """If this is red, run ``hizvk bench --texts`` and put its table into docs/methods.md."""
    methods = page("methods.md")
    if not documented.is_of_this_driver(page("bench.md")):
        pytest.skip("docs/methods.md was printed on another driver")
    if importlib.util.find_spec("embreex") is None:
        pytest.skip("embreex, by which the truth is cast, is not installed")
    found = texts.run(tmp_path, keys=("room",), repetitions=1)
    shown = documented.table(methods, "scene", "test", "visible lost")
    counts = [
        {key: row[key] for key in ("test", "visible lost", "of them", "hidden kept")}
        for row in shown
        if row["scene"] == "room"
    ]
    head = ("test", "visible lost", "of them", "hidden kept")
    ours = [
        dict(zip(head, (cell.strip("*") for cell in row[1:5]), strict=True))
        for row in texts_report.table(found)
    ]
    assert counts == ours


@pytest.mark.slow
def test_footprints_still_keep_so() -> None:
    """If this is red, run ``python -m hizvk.bench.footprints``; docs/methods.md has its table."""
    if not documented.is_of_this_driver(page("bench.md")):
        pytest.skip("docs/methods.md was printed on another driver")
    lines = footprints.table(footprints.measure(hizvk.Device()))
    assert "\n".join(lines) in page("methods.md")
