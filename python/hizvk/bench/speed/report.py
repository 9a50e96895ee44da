"""The report of ``hizvk bench --speed``: report.json to track, report.md to read.

report.json holds one object::

    passed           bool: no cull with the promise hid what can be seen (missed targets are told in `figures`)
    command          str: what prints it again
    seed             int
    extent           "quick" | "default" | "full"
    adapter          {index, name, driver, driver_info, backend, device_type}
    versions         {hizvk, python, numpy, embreex, platform}
    build            "dev" | "release": how the extension module was compiled
    cores            int: processors that this process may use
    load             [float]: the system's load average before each part and at the end; empty where it has none
    seconds          float: the whole run
    notes            [str]: what was left out, and cliffs
    figures          [{key, part, label, value, unit, q1, q3, target, at_least, met}]; no target: both null
    times            [{part, label, ms {median, q1, q3}, least, most}]
    errors           [{part, label, instances, kept, sample, hidden, hidden_kept, false_culls, promises}]
    first_calls      [{cache, import_s, device_s, first_s, second_s}]
    instance_counts  [{instances, pieces, upload_ms, flat_ms, groups_ms, device_bytes, texels, tests}]
    image_sizes      [{side, memcpy_ms, reduce_ms, groups_ms, device_bytes, texels}]

`figures` says what each number is; keys of figures are the same in every run.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from ..report import versions

if TYPE_CHECKING:
    from pathlib import Path

    from .figures import Figure, Found

__all__ = ["as_data", "judged", "targets", "value", "write"]


def as_data(found: Found) -> dict[str, Any]:
    """Plain data for JSON."""
    return {
        "passed": found.passed,
        **asdict(found),
        "versions": versions(),
        "figures": [figure.as_data() for figure in found.figures],
    }


def write(found: Found, folder: Path, plot: str | None) -> None:
    """Writes report.json and report.md.

    Parameters
    ----------
    found : Found
        The numbers.
    folder : Path
        Where.
    plot : str, optional
        The plot's file name relative to `folder`.
    """
    (folder / "report.json").write_text(
        json.dumps(as_data(found), indent=2) + "\n", encoding="utf-8"
    )
    (folder / "report.md").write_text("\n".join(_page(found, plot)) + "\n", encoding="utf-8")


def judged(found: Found) -> tuple[int, int]:
    """How many targets were met, and how many there are."""
    with_target = [figure for figure in found.figures if figure.target is not None]
    return sum(bool(figure.met) for figure in with_target), len(with_target)


def value(figure: Figure) -> str:
    """The number with its unit."""
    return _with_unit(figure.value, figure.unit)


def _with_unit(number: float, unit: str) -> str:
    if unit == "share":
        return f"{100.0 * number:.3g} %"
    digits = f"{number:.0f}" if abs(number) >= 100.0 else f"{number:.3g}"
    return digits if unit == "x" else f"{digits} {unit}"


def _target(figure: Figure) -> str:
    if figure.target is None:
        return ""
    return (
        f"{'at least' if figure.at_least else 'at most'} {_with_unit(figure.target, figure.unit)}"
    )


def _spread(figure: Figure) -> str:
    return "" if figure.q1 is None or figure.q3 is None else f"{figure.q1:.3g}..{figure.q3:.3g}"


def targets(found: Found) -> list[tuple[str, str, str, str, str]]:
    """Label, value, quartiles, target and verdict of every figure that has a target."""
    return [
        (
            figure.label,
            value(figure),
            _spread(figure),
            _target(figure),
            "met" if figure.met else "not met",
        )
        for figure in found.figures
        if figure.target is not None
    ]


def _table(head: str, right: str, rows: list[list[str]]) -> list[str]:
    return [head, right, *(f"| {' | '.join(cells)} |" for cells in rows), ""]


def _page(found: Found, plot: str | None) -> list[str]:
    known, adapter, broken = versions(), found.adapter, found.broken()
    met, of = judged(found)
    verdict = (
        f"FAILED: {'; '.join(broken)}"
        if broken
        else "no cull with the promise hid what can be seen"
    )
    load = f"; load by part {', '.join(f'{one:.1f}' for one in found.load)}" if found.load else ""
    lines = [
        "# hizvk bench --speed",
        "",
        f"**{met} of {of} targets met; {verdict}.**",
        "",
        f"- Command: `{found.command}` ({found.seconds:.0f} s; seed {found.seed})",
        f"- Adapter: {adapter.name} ({adapter.device_type}); driver: {adapter.driver} {adapter.driver_info}",
        f"- hizvk {known['hizvk']}, Python {known['python']}, NumPy {known['numpy']}, embreex "
        f"{known['embreex'] or 'not installed'}; {known['platform']}, {found.cores} cores{load}",
        f"- The extension module is a {found.build} build"
        + (
            "; what the host does (uploads, calls) is slower in it than in a release build"
            * (found.build != "release")
        ),
        *(f"- {each}" for each in found.notes),
        "",
        "## Targets",
        "",
        "Ratios of medians within this run, all ways in turns; quartiles are those of the rounds' own ratios. A load "
        "of more than one at the start, or of more than the cores later, means that others ran beside it.",
        "",
    ]
    lines += _table(
        "| | measured | quartiles | target | |",
        "|---|---:|---:|---:|---|",
        [list(row) for row in targets(found)],
    )
    lines += ["## Told, not judged", ""]
    told = [
        [figure.label, value(figure), _spread(figure)]
        for figure in found.figures
        if figure.target is None
    ]
    lines += _table("| | measured | quartiles |", "|---|---:|---:|", told)
    lines += _errors(found) + _first_calls(found) + _scale(found, plot)
    lines += [
        "## Times",
        "",
        "Milliseconds from a submit to the end of the wait for it, or of a whole call.",
        "",
    ]
    times = [
        [
            time.part,
            time.label,
            f"{time.ms.median:.3f}",
            f"{time.ms.q1:.3f}..{time.ms.q3:.3f}",
            f"{time.least:.3f}",
            f"{time.most:.3f}",
        ]
        for time in found.times
    ]
    return lines + _table(
        "| | | median | quartiles | least | most |", "|---|---|---:|---:|---:|---:|", times
    )


def _errors(found: Found) -> list[str]:
    rows = [
        [
            error.part, error.label if error.promises else f"*{error.label}*", f"{error.instances:,}",
            f"{100.0 * error.kept / max(error.instances, 1):.3f} %", f"{error.sample:,}",
            f"{100.0 * error.hidden_share:.1f} %", f"{100.0 * error.hidden_kept_share:.2f} %", f"{error.false_culls:,}",
        ]
        for error in found.errors
    ]  # fmt: skip
    if not rows:
        return []
    return [
        "## What it was bought at",
        "",
        "Kept of all instances; of a sample, by the float64 oracle: hidden, hidden and kept all the same, visible and "
        "culled. *Italic*: without the promise. (Scenes with ray-cast truth: `hizvk bench`.)",
        "",
        *_table(
            "| | | instances | kept | sample | hidden | of these kept | false culls |",
            "|---|---|" + "---:|" * 6,
            rows,
        ),
    ]


def _first_calls(found: Found) -> list[str]:
    rows = [
        [
            call.cache,
            *(
                f"{seconds:.2f}"
                for seconds in (
                    call.import_s,
                    call.device_s,
                    call.first_s,
                    call.total_s,
                    call.second_s,
                )
            ),
        ]
        for call in found.first_calls
    ]
    if not rows:
        return []
    return [
        "## The first call",
        "",
        "Seconds of a fresh process: importing numpy and hizvk, opening the device, the way from arrays to the first "
        "mask; the same way once more. The interpreter's own start is not counted.",
        "",
        *_table(
            "| shader cache | import | device | first mask | sum | once more |",
            "|---|" + "---:|" * 5,
            rows,
        ),
    ]


def _scale(found: Found, plot: str | None) -> list[str]:
    if not found.instance_counts and not found.image_sizes:
        return []
    lines = ["## Scale", ""] + ([f"![time, memory and texels by size]({plot})", ""] if plot else [])
    counts = [
        [
            f"{row.instances:,}", f"{row.pieces}", f"{row.upload_ms:.2f}", f"{row.flat_ms:.2f}", f"{row.groups_ms:.2f}",
            f"{1e6 * row.flat_ms / row.instances:.1f}", f"{1e6 * row.groups_ms / row.instances:.1f}",
            f"{row.tests / row.instances:.3f}", f"{row.texels:.2f}", f"{row.device_bytes / row.instances:.1f}",
        ]
        for row in found.instance_counts
    ]  # fmt: skip
    lines += [
        "95 % hidden, cull for mask, indices and draws; milliseconds, nanoseconds and the rest an instance.",
        "",
    ]
    lines += _table(
        "| instances | pieces | upload | flat | groups | flat, ns | groups, ns | tests, groups | texels, flat | "
        "device bytes |",
        "|" + "---:|" * 10, counts,
    )  # fmt: skip
    images = [
        [
            f"{row.side}x{row.side}", f"{row.memcpy_ms:.3f}", f"{row.reduce_ms:.3f}",
            f"{row.reduce_ms / row.memcpy_ms:.2f}",
            f"{row.groups_ms:.2f}", f"{row.texels:.2f}", f"{row.device_bytes / row.side**2:.2f}",
        ]
        for row in found.image_sizes
    ]  # fmt: skip
    lines += ["The rendered depth image: milliseconds; bytes a pixel, with the image itself.", ""]
    return lines + _table(
        "| pixels | memcpy | all levels | memcpies | cull, groups | texels an instance, flat | device bytes |",
        "|" + "---:|" * 7, images,
    )  # fmt: skip
