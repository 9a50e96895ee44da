"""The report of the demo: its numbers as plain data (report.json), and as a page to read (report.md)."""

from __future__ import annotations

import json
import platform
import statistics
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ._core import __version__

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from ._arguments import Size
    from .adapter import Adapter
    from .stats import CullStats
    from .truth import Check

__all__ = ["STAGES", "Report", "ViewReport", "write"]

#: The timed stages of a view, in order, and what they are.
STAGES: Final = {
    "render": "the terrain into a depth image",
    "pyramid": "all levels",
    "cull": "every tree tested, the visible ones into list and draw arguments",
    "read": "verdicts, mask and draw arguments to the host",
}
#: The numbers that are summed over the views.
TOTALS: Final = (
    "tested", "outside", "occluded", "kept", "visible", "hidden", "false_culls", "hairs", "broken_promises",
    "false_keeps", "required",
)  # fmt: skip
#: Failed views name so many instances.
NAMED: Final = 12


@dataclass
class ViewReport:
    """The numbers of one view."""

    name: str
    """Where it is."""
    tested: int
    outside: int
    """Culled: outside the view."""
    occluded: int
    """Culled: not outside, and behind the depth image."""
    kept: int
    drawn: int
    """The instance count of the indirect draws; equals `kept`."""
    visible: int
    """Instances that own a pixel, by the truth."""
    hidden: int
    """The others."""
    false_culls: list[int]
    """Visible instances that were culled: bugs."""
    hairs: list[int]
    """Culled instances that are visible by a hair only (see `truth`)."""
    broken_promises: list[int]
    """Culled instances that the exact oracle calls visible in the depth image as given: bugs."""
    false_keeps: int
    """Hidden instances that were kept."""
    required: int
    """Instances that the promise has to keep, by the oracle."""
    depth_difference: float | None
    """The median of rendered against ray-cast depth, relative; None without rays."""
    levels: list[int]
    """Tests by level of the pyramid."""
    ms: dict[str, float] = field(default_factory=dict)
    """Milliseconds of each of `STAGES`."""

    @classmethod
    def of(
        cls,
        name: str,
        stats: CullStats,
        drawn: int,
        found: Check,
        difference: float | None,
        ms: dict[str, float],
    ) -> ViewReport:
        """The report of a cull and its check."""
        return cls(
            name=name,
            tested=stats.tested,
            outside=stats.outside,
            occluded=stats.occluded,
            kept=found.comparison.kept,
            drawn=drawn,
            visible=found.comparison.visible,
            hidden=found.comparison.hidden,
            false_culls=found.false_culls,
            hairs=found.hairs,
            broken_promises=found.broken_promises,
            false_keeps=len(found.comparison.false_keeps),
            required=found.required,
            depth_difference=difference,
            levels=list(stats.levels or ()),
            ms=ms,
        )

    @property
    def passed(self) -> bool:
        """Nothing that can be seen was culled, and the draws say the same as the mask."""
        return not self.false_culls and not self.broken_promises and self.drawn == self.kept


@dataclass
class Report:
    """The numbers of a run."""

    scene: str
    instances: int
    occluder_triangles: int
    size: Size
    adapter: Adapter
    truth: str
    """How it was found out what is visible."""
    upload_ms: float
    """Device, pipelines, instances and occluders, once."""
    views: list[ViewReport] = field(default_factory=list)
    seconds: float = 0.0
    """The whole run with truth and pictures."""

    @property
    def passed(self) -> bool:
        """Whether every view passed; not without views."""
        return bool(self.views) and all(view.passed for view in self.views)

    def total(self, name: str) -> int:
        """The sum of one number over the views (of a list: its length)."""
        values = [getattr(view, name) for view in self.views]
        return sum(len(value) if isinstance(value, list) else value for value in values)

    @property
    def false_keep_share(self) -> float:
        """Of the hidden, the share that was kept."""
        return self.total("false_keeps") / max(self.total("hidden"), 1)

    def median_ms(self) -> dict[str, float]:
        """Of each stage, over the views after the first (over the first if it is the only one)."""
        timed = self.views[1:] or self.views
        return {stage: statistics.median(view.ms[stage] for view in timed) for stage in STAGES}

    def as_data(self) -> dict[str, Any]:
        """Everything as plain data for JSON."""
        return {
            "passed": self.passed,
            "totals": {name: self.total(name) for name in TOTALS}
            | {"false_keep_share": self.false_keep_share},
            "median_ms": self.median_ms(),
            "first_ms": self.views[0].ms,
            **asdict(self),
            "versions": {
                "hizvk": __version__,
                "python": platform.python_version(),
                "numpy": np.__version__,
            },
        }

    def verdict(self) -> str:
        """The outcome of the check in one line."""
        bad = self.total("false_culls") + self.total("broken_promises")
        if self.passed:
            return f"passed: 0 of {self.total('visible'):,} visible instances culled, over {len(self.views)} views"
        if bad:
            return (
                f"FAILED: {self.total('false_culls'):,} visible instances culled, "
                f"{self.total('broken_promises'):,} promises broken"
            )
        return "FAILED: the draw arguments and the mask disagree"


def write(report: Report, folder: Path, pictures: Iterable[tuple[str, str]]) -> None:
    """Writes report.json and report.md.

    Parameters
    ----------
    report : Report
        The numbers.
    folder : Path
        Where.
    pictures : iterable of (str, str)
        File names relative to `folder`, and what they show.
    """
    (folder / "report.json").write_text(
        json.dumps(report.as_data(), indent=2) + "\n", encoding="utf-8"
    )
    (folder / "report.md").write_text("\n".join(_page(report, pictures)) + "\n", encoding="utf-8")


def _page(report: Report, pictures: Iterable[tuple[str, str]]) -> list[str]:
    height, width = report.size
    adapter, triangles, trees = report.adapter, report.occluder_triangles, report.instances
    first, median = report.views[0].ms, report.median_ms()
    versions = f"hizvk {__version__}, Python {platform.python_version()}, NumPy {np.__version__}"
    lines = [
        "# Occlusion culling in the mountains",
        "",
        f"**{report.verdict()}.**",
        "",
        f"- Scene: {report.scene}; {triangles:,} triangles of terrain hide, {trees:,} trees are tested",
        f"- Views: {len(report.views)} of {width}x{height}, reversed Z, no far plane",
        f"- Adapter: {adapter.name} ({adapter.device_type}); driver: {adapter.driver} {adapter.driver_info}",
        f"- {versions}; {report.seconds:.1f} s in all, with the check and the pictures",
        "",
        "## Milliseconds",
        "",
        "Median over the views after the first; the first use of each pass also compiles it. Before, once: device and "
        f"uploads, {report.upload_ms:.1f} ms.",
        "",
        "| stage | median | first view | |",
        "|---|---:|---:|---|",
        *(
            f"| {stage} | {median[stage]:.2f} | {first[stage]:.2f} | {what} |"
            for stage, what in STAGES.items()
        ),
        "",
        "## Counts",
        "",
        "| | view | outside | behind | kept | visible | culled wrongly | kept in vain | has to be kept |",
        "|---:|---|---:|---:|---:|---:|---:|---:|---:|",
        *(_row(str(number), view) for number, view in enumerate(report.views)),
        _row("all", report),
        "",
        "- *outside*, *behind*: culled, outside the view or within it behind the depth image",
        "- *visible*: owns a pixel, by the truth (below)",
        "- *kept in vain*: hidden and kept all the same, and its share of the hidden",
        "- *has to be kept*: the exact oracle cannot call the tree's box hidden by the terrain, the only occluder;",
        "  these are the visible trees, and those whose box alone shows, or only between pixel centres, or behind",
        "  other trees",
        "",
        f"So {max(report.total('kept') - report.total('required'), 0):,} trees were kept without need: the price of "
        "reading four texels for each.",
        "",
        "## Check",
        "",
        f"Truth: {report.truth}.",
        "",
        f"- Visible trees that were culled: {report.total('false_culls')}.",
        f"- Culled trees that the oracle calls visible in the depth image as given: {report.total('broken_promises')}.",
        f"- Culled trees that are visible by a hair: {report.total('hairs')} (the ray moved by 1/16 pixel, or the "
        "depth by 1e-6, hides them, and a rasteriser may do either).",
    ]
    differences = [
        view.depth_difference for view in report.views if view.depth_difference is not None
    ]
    if differences:
        lines.append(
            f"- Rendered against ray-cast depth, relative: median {statistics.median(differences):.1e}."
        )
    for number, view in enumerate(report.views):
        for what, culled in (("visible", view.false_culls), ("promised", view.broken_promises)):
            if culled:
                more = ", ..." if len(culled) > NAMED else ""
                lines.append(
                    f"- View {number} culled {what} trees: {', '.join(map(str, culled[:NAMED]))}{more}"
                )
    lines += ["", "## Pictures", ""]
    for name, what in pictures:
        lines += [f"{what}:", "", f"![{what}]({name})", ""]
    return lines


def _row(first: str, numbers: ViewReport | Report) -> str:
    """One row of the table of counts."""

    def count(name: str) -> int:
        if isinstance(numbers, Report):
            return numbers.total(name)
        value = getattr(numbers, name)
        return len(value) if isinstance(value, list) else int(value)

    name = numbers.name if isinstance(numbers, ViewReport) else ""
    vain = (
        f"{count('false_keeps'):,} ({100.0 * count('false_keeps') / max(count('hidden'), 1):.1f} %)"
    )
    wrong = count("false_culls") + count("broken_promises")
    plain = " | ".join(f"{count(each):,}" for each in ("outside", "occluded", "kept", "visible"))
    return f"| {first} | {name} | {plain} | {wrong} | {vain} | {count('required'):,} |"
