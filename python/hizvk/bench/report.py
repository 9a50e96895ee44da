"""The bench's report: report.json for machines, report.md to read.

report.json holds one object::

    passed        bool: no configuration with the promise culled what can be seen
    command       str: prints it again
    seed          int
    extent        "quick" | "default" | "full"
    adapter       {index, name, driver, driver_info, backend, device_type}
    versions      {hizvk, python, numpy, embreex, platform}; embreex is null if not installed
    seconds       float: the whole run
    missing       [str]: scenes and columns that were left out, and why
    scenes        [scene]

    scene: key, name, instances, occluder_triangles, instance_triangles, views,
           size [height, width], repetitions, truth (how it was found what is visible),
           visible, hidden, inside (instances, summed over all views, that own a pixel, that own
           none, and that are inside the view volume),
           one_instance_ms (a cull of one instance), upload_ms (all kinds of bounds),
           way_upload_ms (occluders and boxes), warm_up_ms (first calls: they compile and build),
           rows [row]

    row:   label, configuration {volume, footprint, descent, coverage, order, fit, guard_px,
           depth {divisor, conservative, levels, rasteriser}} or null for a yardstick,
           ms {render, reduce, cull, read: spread or null}, total_ms spread or null,
           ns_per_instance, first_ms,
           texels_per_instance (null where it was not measured), kept, false_culls, hairs,
           hidden_kept, hidden_kept_in_view, share_of_rectangle (shares, 0 to 1 and above), pareto
           bool

    spread: {median, q1, q3} in milliseconds per view: over the repetitions of each view, then the
           mean over the views

`results.Row` and `results.SceneResult` say what each number is.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ..commands import report
from ..commands.page import Page
from . import frame, whole_way
from .results import STAGES

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from .results import Row, SceneResult

__all__ = ["Report"]

#: Shares of the best rectangle test's culls for which the report picks the fastest configuration.
SUFFICIENT: Final = (0.90, 0.95, 0.99)


@dataclass
class Report(frame.Run):
    """A run of the bench."""

    extent: str = "default"
    scenes: list[SceneResult] = field(default_factory=list)

    def broken(self) -> list[str]:
        """What no run may find, in words: bugs.

        - configurations with the promise that culled what can be seen
        - rasterisers whose depth makes culls keep different numbers of instances
        """
        differ = [(scene.key, whole_way.differing(scene)) for scene in self.scenes]
        return [f"{key}: {words}" for key, words in differ if words] + [
            f"{scene.key}: {row.label}: {row.false_culls} visible instances culled"
            for scene in self.scenes
            for row in scene.rows
            if row.promises and row.false_culls
        ]

    @property
    def passed(self) -> bool:
        """Whether something was measured and no promise was broken."""
        return bool(self.scenes) and not self.broken()

    def as_data(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {"passed": self.passed, **super().as_data()}

    def write(self, folder: Path, plots: dict[str, str]) -> None:
        """Writes report.json and report.md.

        Parameters
        ----------
        folder : Path
            Where.
        plots : dict of str to str
            By scene: the plot's file name relative to `folder`.
        """
        report.write(folder, self.as_data(), _page(self, plots))


def _page(found: Report, plots: dict[str, str]) -> Page:
    broken = found.broken()
    verdict = "no configuration with the promise culled what can be seen"
    page = Page("hizvk bench")
    page.text(f"**{'FAILED: ' + '; '.join(broken) if broken else verdict}.**")
    page.items(*found.opening())
    page.heading("What suffices")
    page.text(
        "For each share of what the best rectangle test culls inside the view: the fastest "
        "configuration of area coverage that culls as much, and its milliseconds from occluders to "
        "mask.",
        "The last row of a scene is the configuration that keeps least.",
        "Depth is drawn by the rasteriser that `auto` chooses, unless the label names one.",
        "On another device the order may be another one.",
    )
    page.table(
        "scene | culls | configuration | ms",
        (cells for scene in found.scenes for cells in _picks(scene)),
        left=3,
    )
    page.heading("The whole way")
    page.text(
        "From meshes to a mask: milliseconds per view, and what they were bought at.",
        "*once* is before the first view: the upload of occluders and boxes, or Embree's trees.",
        "The two rasterisers have to keep the same instances, to 0.1 %.",
        "*kept* is summed over the views; the other columns are those of the scenes below.",
    )
    page.table(
        whole_way.HEAD,
        (cells for scene in found.scenes for cells in whole_way.rows(scene)),
        left=2,
    )
    for scene in found.scenes:
        _scene(page, scene, plots.get(scene.key))
    _legend(page)
    return page


def _picks(scene: SceneResult) -> Iterator[list[str]]:
    """The rows of a scene in the table of what suffices."""
    able = [
        row
        for row in scene.rows
        if row.promises
        and row.configuration
        and row.configuration.coverage == "area"
        and not row.false_culls
    ]

    def milliseconds(row: Row) -> float:
        return row.total_ms.median if row.total_ms else np.inf

    def cells(what: str, row: Row | None) -> list[str]:
        if row is None:
            return [scene.key, what, "none", ""]
        return [scene.key, what, row.label, f"{milliseconds(row):.2f}"]

    for share in SUFFICIENT:
        enough = [row for row in able if row.share_of_rectangle >= share]
        yield cells(f"{100 * share:.0f} %", min(enough, key=milliseconds, default=None))
    least = min(able, key=lambda row: (row.hidden_kept, milliseconds(row)), default=None)
    yield cells("keeps least", least)


def _scene(page: Page, scene: SceneResult, plot: str | None) -> None:
    height, width = scene.size
    page.heading(scene.key)
    page.text(
        f"{scene.name[0].upper()}{scene.name[1:]}.",
        f"{scene.occluder_triangles:,} triangles hide, and {scene.instances:,} instances "
        f"({scene.instance_triangles:,} triangles) are tested.",
        f"{scene.views} views of {width}x{height}, {scene.repetitions} repetitions.",
        f"Over all views {scene.inside:,} instances are inside the view volume and "
        f"{scene.visible:,} are visible.",
        f"Truth: {scene.truth}.",
        f"A cull of one instance takes {scene.one_instance_ms:.2f} ms, uploads took "
        f"{scene.upload_ms:.0f} ms, and first calls, which compile new shaders, "
        f"{scene.warm_up_ms:.0f} ms.",
    )
    if plot is not None:
        page.picture(f"speed against error, {scene.key}", plot)
    numbered = list(enumerate(scene.rows, 1))
    page.table(
        f"# | | {' | '.join(STAGES)} | sum | quartiles",
        (_name(number, row) + _times(row) for number, row in numbered),
        left=2,
    )
    page.table(
        "# | | ns/inst. | texels/inst. | false culls | hidden kept | of those in view "
        "| of best rect.",
        (_name(number, row) + _counts(row) for number, row in numbered),
        left=2,
    )


def _name(number: int, row: Row) -> list[str]:
    """Number and label; on the Pareto front a P and bold, yardsticks in italics."""
    label = row.label if row.configuration else f"*{row.label}*"
    return [f"{number} P", f"**{label}**"] if row.pareto else [str(number), label]


def _times(row: Row) -> list[str]:
    stages = [row.ms.get(stage) for stage in STAGES]
    cells = [f"{stage.median:.2f}" if stage else "" for stage in stages]
    total = row.total_ms
    return [*cells, *([f"{total.median:.2f}", total.quartiles()] if total else ["", ""])]


def _counts(row: Row) -> list[str]:
    shares = (row.hidden_kept, row.hidden_kept_in_view, row.share_of_rectangle)
    return [
        "" if row.ns_per_instance is None else f"{row.ns_per_instance:,.0f}",
        "" if row.texels_per_instance is None else f"{row.texels_per_instance:.2f}",
        f"{row.false_culls:,}",
        *(f"{100.0 * share:.2f} %" for share in shares),
    ]


def _legend(page: Page) -> None:
    page.heading("What the columns mean")
    page.text(
        "A label names the bounds that are tested and the footprint: N x N texels of one level.",
        "With *descent*, finer levels follow where that level cannot decide.",
        "Then it names what differs from area coverage, any order, the rectangle's fit, and plain "
        "depth at full resolution.",
        "*Italic*: what one would otherwise do, in the same run.",
    )
    page.text(
        "**Bold** and P: on the Pareto front of sum and hidden kept, to 0.1 % of those in view.",
        "A row takes part if its promise reaches the view's pixels and it culled nothing visible.",
        "Sample coverage promises less, so it takes no row of area coverage off the front.",
        "Rows that differ by less than their quartiles are equal in practice.",
    )
    page.items(
        "*render*, *reduce*, *cull*, *read*: milliseconds per view.\n"
        "They are the occluders into depth, all levels of the pyramid, the test of all instances, "
        "and the mask to the host.\n"
        "Each stage is waited for and timed by the wall clock, Python included.\n"
        "All are medians over a view's repetitions, then the mean over the views.\n"
        "numpy reads the depth image back and builds its levels under *reduce*.",
        "*sum*: all stages together.\n"
        "*quartiles*: of the sum, with render and reduce, which the rows of a depth image share, "
        "held at their medians.",
        "*ns/inst.*: the cull divided by the number of instances.\n"
        "*texels/inst.*: depth texels read by tests of groups and instances, divided by all "
        "instances.\n"
        "What lies outside the view reads none.",
        "*false culls*: instances that own a pixel by more than a hair and were culled.\n"
        "A hair: a ray moved by 1/16 pixel, or a depth changed by 1e-6, hides them.\n"
        "A smaller image of plain samples promises nothing for the pixels of the view, so its rows "
        "may have some.",
        "*hidden kept*: kept, as a share of those that own no pixel of the view.\n"
        "*of those in view*: the same among those inside the view volume.",
        "*of best rect.*: culled inside the view volume, divided by what the best rectangle test "
        "culls there.\n"
        "That test takes boxes in float64 and all pixels; tighter bounds and a volume fit can "
        "exceed 100 %.",
        "*Embree, one ray per pixel* is how the truth is found, hence its zeros.\n"
        "It casts on one thread here, and the first ray builds its trees (`first_ms` in "
        "report.json).\n"
        "It needs the triangles of all instances, where hizvk needs their bounds.",
    )
