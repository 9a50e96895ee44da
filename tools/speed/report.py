"""The report of the speed tool: report.json to track, report.md to read.

report.json holds one object::

    passed           bool: no cull with the promise hid what can be seen; targets do not count
    command          str: prints it again
    seed             int
    extent           "quick" | "default" | "full"
    adapter          {index, name, driver, driver_info, backend, device_type}
    versions         {hizvk, python, numpy, embreex, platform}
    build            "dev" | "release": how the extension module was compiled
    cores            int: processors that this process may use
    load             [float]: the system's load average before each part and at the end, or empty
    seconds          float: the whole run
    notes            [str]: what was left out, and cliffs
    figures          [{key, part, label, value, unit, q1, q3, target, at_least, met}];
                     without a target, target and met are null
    times            [{part, label, ms {median, q1, q3}, least, most}]
    errors           [{part, label, instances, kept, sample, hidden, hidden_kept, false_culls,
                     promises}]
    first_calls      [{cache, import_s, device_s, first_s, second_s}]
    instance_counts  [{instances, pieces, upload_ms, flat_ms, groups_ms, device_bytes, texels,
                     tests}]
    whole_calls      [{bounds, rasteriser, render_ms, reduce_ms, cull_ms, read_ms,
                     whole_ms {median, q1, q3}, kept}]
    image_sizes      [{side, memcpy_ms, reduce_ms, groups_ms, device_bytes, texels}]

`figures` says what each number is; keys of figures are the same in every run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hizvk.commands import report
from hizvk.commands.page import Page

if TYPE_CHECKING:
    from pathlib import Path

    from .figures import Figure, Found

__all__ = ["judged", "targets", "value", "write"]


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
    report.write(folder, found.as_data(), _page(found, plot))


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
    bound = "at least" if figure.at_least else "at most"
    return f"{bound} {_with_unit(figure.target, figure.unit)}"


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


def _page(found: Found, plot: str | None) -> Page:
    broken = found.broken()
    met, of = judged(found)
    verdict = "no cull with the promise hid what can be seen"
    if broken:
        verdict = f"FAILED: {'; '.join(broken)}"
    load = f"; load by part {', '.join(f'{one:.1f}' for one in found.load)}" if found.load else ""
    slower = "; the host's work (uploads, calls) is slower in it than in a release build"
    page = Page("hizvk: speed against yardsticks")
    page.text(f"**{met} of {of} targets met; {verdict}.**")
    page.items(
        f"Command: `{found.command}` ({found.seconds:.0f} s; seed {found.seed})",
        report.adapter_words(found.adapter),
        f"{report.version_words()}, {found.cores} cores{load}",
        f"The extension module is a {found.build} build{slower * (found.build != 'release')}",
        *found.notes,
    )
    page.heading("Targets")
    page.text(
        "Ratios of medians within this run, with all ways in turns.",
        "Quartiles are those of the rounds' own ratios.",
        "A load of more than one at the start, or of more than the number of cores later, means "
        "that something else ran at the same time.",
    )
    page.table(" | measured | quartiles | target | ", targets(found))
    page.heading("Told, not judged")
    told = (figure for figure in found.figures if figure.target is None)
    page.table(
        " | measured | quartiles",
        ([figure.label, value(figure), _spread(figure)] for figure in told),
    )
    _errors(page, found)
    _first_calls(page, found)
    _whole_calls(page, found)
    _scale(page, found, plot)
    page.heading("Times")
    page.text("Milliseconds from a submit to the end of the wait for it, or of a whole call.")
    page.table(
        " | | median | quartiles | least | most",
        (
            [
                time.part,
                time.label,
                f"{time.ms.median:.3f}",
                time.ms.quartiles(".3f"),
                f"{time.least:.3f}",
                f"{time.most:.3f}",
            ]
            for time in found.times
        ),
        left=2,
    )
    return page


def _errors(page: Page, found: Found) -> None:
    rows = [
        [
            error.part,
            error.label if error.promises else f"*{error.label}*",
            f"{error.instances:,}",
            f"{100.0 * error.kept / max(error.instances, 1):.3f} %",
            f"{error.sample:,}",
            f"{100.0 * error.hidden_share:.1f} %",
            f"{100.0 * error.hidden_kept_share:.2f} %",
            f"{error.false_culls:,}",
        ]
        for error in found.errors
    ]
    if not rows:
        return
    page.heading("What it was bought at")
    page.text(
        "*kept*: of all instances.",
        "The columns after *sample* are of a sample, by the float64 oracle: hidden, hidden and "
        "still kept, visible and culled.",
        "*Italic*: without the promise.",
        "`hizvk bench` has scenes with ray-cast truth.",
    )
    page.table(
        " | | instances | kept | sample | hidden | of these kept | false culls", rows, left=2
    )


def _first_calls(page: Page, found: Found) -> None:
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
        return
    page.heading("The first call")
    page.text(
        "Seconds of a fresh process: importing numpy and hizvk, opening the device, the way from "
        "arrays to the first mask, and the same way once more.",
        "The interpreter's own start is not counted.",
    )
    page.table("shader cache | import | device | first mask | sum | once more", rows)


def _whole_calls(page: Page, found: Found) -> None:
    if not found.whole_calls:
        return
    page.heading("Few and many bounds")
    page.text(
        "Whole calls from occluders to a mask on the host, 512x256 pixels, 95 % hidden.",
        "Milliseconds, medians; each part is waited for.",
        "*over the fewest*: the whole call, over that with the fewest bounds.",
    )
    fewest = {
        call.rasteriser: call.whole_ms.median
        for call in reversed(found.whole_calls)  # the first one stays
    }
    page.table(
        "rasteriser | bounds | depth | pyramid | cull | mask | whole call | quartiles "
        "| over the fewest | kept",
        (
            [
                call.rasteriser,
                f"{call.bounds:,}",
                f"{call.render_ms:.2f}",
                f"{call.reduce_ms:.2f}",
                f"{call.cull_ms:.2f}",
                f"{call.read_ms:.2f}",
                f"{call.whole_ms.median:.2f}",
                call.whole_ms.quartiles(),
                f"{call.whole_ms.median / fewest[call.rasteriser]:.2f}",
                f"{call.kept:,}",
            ]
            for call in sorted(found.whole_calls, key=lambda call: call.rasteriser)
        ),
    )


def _scale(page: Page, found: Found, plot: str | None) -> None:
    if not found.instance_counts and not found.image_sizes:
        return
    page.heading("Scale")
    if plot:
        page.picture("time, memory and texels by size", plot)
    page.text(
        "95 % hidden, culls for mask, indices and draws.",
        "The first columns are milliseconds, the others nanoseconds, tests (with groups), texels "
        "(flat) and bytes on the device, per instance.",
    )
    page.table(
        "instances | pieces | upload | flat | groups | flat ns | groups ns | tests | texels "
        "| bytes",
        (
            [
                f"{row.instances:,}",
                f"{row.pieces}",
                f"{row.upload_ms:.2f}",
                f"{row.flat_ms:.2f}",
                f"{row.groups_ms:.2f}",
                f"{1e6 * row.flat_ms / row.instances:.1f}",
                f"{1e6 * row.groups_ms / row.instances:.1f}",
                f"{row.tests / row.instances:.3f}",
                f"{row.texels:.2f}",
                f"{row.device_bytes / row.instances:.1f}",
            ]
            for row in found.instance_counts
        ),
        left=0,
    )
    page.text(
        "The rendered depth image: milliseconds, and bytes per pixel with the image itself.",
        "*memcpies*: all levels divided by the memcpy.",
    )
    page.table(
        "pixels | memcpy | all levels | memcpies | cull, groups | texels per instance, flat "
        "| bytes",
        (
            [
                f"{row.side}x{row.side}",
                f"{row.memcpy_ms:.3f}",
                f"{row.reduce_ms:.3f}",
                f"{row.reduce_ms / row.memcpy_ms:.2f}",
                f"{row.groups_ms:.2f}",
                f"{row.texels:.2f}",
                f"{row.device_bytes / row.side**2:.2f}",
            ]
            for row in found.image_sizes
        ),
        left=0,
    )
