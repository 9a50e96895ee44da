"""Time, memory and texels by size, on logarithmic axes. Needs matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from hizvk.commands import figure as figures

if TYPE_CHECKING:
    from pathlib import Path

    from .figures import Found

__all__ = ["draw", "figure_of"]

#: A quantity that grows this much less than the size does not follow it and gets no dotted line.
FOLLOWS: Final = 500.0
#: Values within this ratio of one another have an axis that begins at 0, not a logarithmic one.
ALIKE: Final = 10.0


def draw(path: Path, found: Found) -> None:
    """Writes `figure_of` the run as a PNG."""
    figure_of(found).savefig(path)


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
