"""Time, memory and texels by size, on logarithmic axes. Needs matplotlib."""

from __future__ import annotations

import hashlib
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

from hizvk.commands import figure as figures

from .figures import ImageSize, InstanceCount

if TYPE_CHECKING:
    from pathlib import Path

    from .figures import Found

__all__ = ["draw", "draw_tables", "figure_of", "found_in", "mark_of"]

#: A quantity that grows this much less than the size does not follow it and gets no dotted line.
FOLLOWS: Final = 500.0
#: Values within this ratio of one another have an axis that begins at 0, not a logarithmic one.
ALIKE: Final = 10.0


def draw(path: Path, found: Found) -> None:
    """Writes `figure_of` the run as a PNG."""
    figure_of(found).savefig(path)


def draw_tables(path: Path, text: str, adapter: str) -> None:
    """Writes the same PNG from the two tables of a report's section "Scale".

    Its text says of which tables it is (`mark_of`), so that a picture of other ones is noticed.
    """
    figure_of(found_in(text, adapter)).savefig(path, metadata={"Source": mark_of(text)})


def found_in(text: str, adapter: str) -> Any:
    """What `figure_of` reads of a run, from the two tables, as rounded as these are."""
    counts, images = (
        [[cell.strip().replace(",", "") for cell in line.strip("|").split("|")] for line in table]
        for table in _tables(text)
    )
    return SimpleNamespace(
        adapter=SimpleNamespace(name=adapter),
        instance_counts=[_instance_count(row) for row in counts],
        image_sizes=[_image_size(row) for row in images],
    )


def _instance_count(row: list[str]) -> InstanceCount:
    instances = int(row[0])
    upload, flat, groups, _, _, tests, texels, size = map(float, row[2:])
    return InstanceCount(
        instances, int(row[1]), upload, flat, groups,
        device_bytes=round(size * instances), texels=texels, tests=round(tests * instances),
    )  # fmt: skip


def _image_size(row: list[str]) -> ImageSize:
    side = int(row[0].partition("x")[0])
    memcpy, reduce, _, groups, texels, size = map(float, row[1:])
    return ImageSize(
        side, memcpy, reduce, groups, device_bytes=round(size * side**2), texels=texels
    )


def mark_of(text: str) -> str:
    """A number for the tables of a section."""
    rows = "\n".join(line for table in _tables(text) for line in table)
    return hashlib.sha256(rows.encode()).hexdigest()


def _tables(text: str) -> list[list[str]]:
    """The rows of each table, without head."""
    found: list[list[str]] = []
    before = ""
    for line in text.splitlines():
        if line.startswith("|") and not before.startswith("|"):
            found.append([])
        if line.startswith("|"):
            found[-1].append(line)
        before = line
    return [table[2:] for table in found]


def figure_of(found: Found) -> Any:
    """Six panels: above by the number of instances, below by the number of pixels.

    Parameters
    ----------
    found : Found
        A run with scales.
    """
    figure = figures.sheet(14.0, 8.0)
    figure.get_layout_engine().set(w_pad=0.14, h_pad=0.06)  # inches
    axes = figure.subplots(2, 3)
    rows = found.instance_counts
    by_count = [row.instances for row in rows]
    times: dict[str, list[Any]] = {
        "upload": [row.upload_ms for row in rows],
        "flat": [row.flat_ms for row in rows],
        "groups": [row.groups_ms for row in rows],
    }
    memory: dict[str, list[Any]] = {"instances, outputs": [row.device_bytes for row in rows]}
    work: dict[str, list[Any]] = {
        "texels, flat": [row.texels * row.instances for row in rows],
        "tests, flat": by_count,
        "tests, groups": [row.tests for row in rows],
    }
    _panel(axes[0, 0], "ms", by_count, times)
    _panel(axes[0, 1], "bytes on the device", by_count, memory)
    _panel(axes[0, 2], "texels read, tests spent", by_count, work)
    images = found.image_sizes
    by_pixels = [row.side**2 for row in images]
    times = {
        "memcpy": [row.memcpy_ms for row in images],
        "all levels": [row.reduce_ms for row in images],
        "cull, groups": [row.groups_ms for row in images],
    }
    memory = {"depth and pyramid": [row.device_bytes for row in images]}
    _panel(axes[1, 0], "ms", by_pixels, times)
    _panel(axes[1, 1], "bytes on the device", by_pixels, memory)
    texels = {"flat": [row.texels for row in images]}
    _panel(axes[1, 2], "texels read per instance", by_pixels, texels)
    for axis in axes[0]:
        axis.set_xlabel("instances, 95 % hidden")
    for axis in axes[1]:
        axis.set_xlabel("pixels of the depth image")
    figure.suptitle(f"{found.adapter.name}; dotted: in proportion to the size", fontsize=11)
    return figure


def _panel(axis: Any, label: str, sizes: list[int], lines: dict[str, list[Any]]) -> None:
    every = [value for values in lines.values() for value in values if value > 0]
    are_alike = not every or max(every) < ALIKE * min(every)
    axis.set_xscale("log")
    axis.set_yscale("linear" if are_alike else "log")
    for name, values in lines.items():
        shown = [(size, value) for size, value in zip(sizes, values, strict=True) if value > 0]
        if not shown:
            continue
        axis.plot(*zip(*shown, strict=True), marker="o", markersize=4, label=name)
        (least, first), (most, last) = shown[0], shown[-1]
        if last / first > most / least / FOLLOWS and not are_alike:
            axis.plot(
                [least, most],
                [last * least / most, last],
                linestyle=":",
                linewidth=0.8,
                color="#999999",
            )
    if are_alike:
        axis.set_ylim(0.0, 1.25 * max(every, default=1.0))
    axis.set_ylabel(label)
    axis.tick_params(labelsize=8)
    axis.grid(True, which="major", color="#dddddd")
    # Above the panel, where no line runs.
    axis.legend(
        fontsize=8, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=len(lines),
        borderaxespad=0.2, handlelength=1.4, columnspacing=1.2,
    )  # fmt: skip
