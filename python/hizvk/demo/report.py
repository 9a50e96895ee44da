"""The report of the demo: its numbers as plain data, and the page that tells them."""

from __future__ import annotations

import statistics
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Final

from ..commands import report
from ..commands.page import Page

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from .._arguments import Size
    from ..adapter import Adapter
    from ..scenes.truth import Check
    from ..stats import CullStats

__all__ = ["STAGES", "Report", "ViewReport"]

#: The timed stages of a view, in order, and what they are.
STAGES: Final = {
    "render": "the terrain into a depth image",
    "pyramid": "all levels",
    "cull": "every tree tested, the visible ones into list and draw arguments",
    "read": "verdicts, mask and draw arguments to the host",
}
#: The numbers that are summed over the views.
TOTALS: Final = (
    "tested",
    "outside",
    "occluded",
    "kept",
    "visible",
    "hidden",
    "false_culls",
    "hairs",
    "broken_promises",
    "false_keeps",
    "required",
)
#: How many instances a failed view names.
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
    """Culled instances that are visible only by a hair (see `hizvk.scenes.truth`)."""
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
            "versions": report.versions(),
        }

    def verdict(self) -> str:
        """The outcome of the check in one line."""
        bad = self.total("false_culls") + self.total("broken_promises")
        if self.passed:
            return (
                f"passed: 0 of {self.total('visible'):,} visible instances culled, "
                f"over {len(self.views)} views"
            )
        if bad:
            return (
                f"FAILED: {self.total('false_culls'):,} visible instances culled, "
                f"{self.total('broken_promises'):,} promises broken"
            )
        return "FAILED: the draw arguments and the mask disagree"

    def write(self, folder: Path, pictures: Iterable[tuple[str, str]]) -> None:
        """Writes report.json and report.md.

        Parameters
        ----------
        folder : Path
            Where.
        pictures : iterable of (str, str)
            File names relative to `folder`, and what they show.
        """
        report.write(folder, self.as_data(), _page(self, pictures))


def _page(found: Report, pictures: Iterable[tuple[str, str]]) -> Page:
    height, width = found.size
    first, median = found.views[0].ms, found.median_ms()
    page = Page("Occlusion culling in the mountains")
    page.text(f"**{found.verdict()}.**")
    page.items(
        f"Scene: {found.scene}; {found.occluder_triangles:,} triangles of terrain hide, "
        f"{found.instances:,} trees are tested",
        f"Views: {len(found.views)} of {width}x{height}, reversed Z, no far plane",
        report.adapter_words(found.adapter),
        f"{report.version_words()}; {found.seconds:.1f} s in all, with the check and the pictures",
    )
    page.heading("Milliseconds")
    page.text(
        "Medians over the views after the first.",
        "The first view is shown apart, because the first use of each pass also compiles it.",
        f"The device and the uploads took {found.upload_ms:.1f} ms, once, before that.",
    )
    page.table(
        "stage | | median | first view",
        (
            [stage, what, f"{median[stage]:.2f}", f"{first[stage]:.2f}"]
            for stage, what in STAGES.items()
        ),
        left=2,
    )
    page.heading("Counts")
    page.table(
        " | view | outside | behind | kept | visible | culled wrongly | kept in vain | to be kept",
        [
            *(_row(str(number), view) for number, view in enumerate(found.views)),
            _row("all", found),
        ],
        left=2,
    )
    page.items(
        "*outside*, *behind*: culled, outside the view or within it behind the depth image",
        "*visible*: owns a pixel, by the truth (see below)",
        "*kept in vain*: hidden and still kept, with its share of the hidden",
        "*to be kept*: the exact oracle cannot call the tree's box hidden by the terrain.\n"
        "These are the visible trees, and those whose box alone shows, or only between pixel\n"
        "centres, or behind other trees.",
    )
    without_need = max(found.total("kept") - found.total("required"), 0)
    page.text(
        f"So {without_need:,} trees were kept without need.",
        "That is the price of reading four texels for each.",
    )
    page.heading("Check")
    page.text(f"Truth: {found.truth}.")
    page.items(*_check(found))
    page.heading("Pictures")
    for name, what in pictures:
        page.text(f"{what}:")
        page.picture(what, name)
    return page


def _check(found: Report) -> list[str]:
    """What the check found, an item each."""
    items = [
        f"Visible trees that were culled: {found.total('false_culls')}.",
        "Culled trees that the oracle calls visible in the depth image as given: "
        f"{found.total('broken_promises')}.",
        f"Culled trees that are visible by a hair: {found.total('hairs')}.\n"
        "A ray moved by 1/16 pixel or a depth changed by 1e-6 hides them, so a rasteriser may do "
        "either.",
    ]
    known = [view.depth_difference for view in found.views if view.depth_difference is not None]
    if known:
        median = statistics.median(known)
        items.append(f"Rendered against ray-cast depth, relative: median {median:.1e}.")
    for number, view in enumerate(found.views):
        for what, culled in (("visible", view.false_culls), ("promised", view.broken_promises)):
            if culled:
                named = ", ".join(map(str, culled[:NAMED]))
                more = ", ..." if len(culled) > NAMED else ""
                items.append(f"View {number} culled {what} trees: {named}{more}")
    return items


def _row(first: str, numbers: ViewReport | Report) -> list[str]:
    """One row of the table of counts."""

    def count(name: str) -> int:
        if isinstance(numbers, Report):
            return numbers.total(name)
        value = getattr(numbers, name)
        return len(value) if isinstance(value, list) else int(value)

    share = 100.0 * count("false_keeps") / max(count("hidden"), 1)
    return [
        first,
        numbers.name if isinstance(numbers, ViewReport) else "",
        *(f"{count(each):,}" for each in ("outside", "occluded", "kept", "visible")),
        f"{count('false_culls') + count('broken_promises')}",
        f"{count('false_keeps'):,} ({share:.1f} %)",
        f"{count('required'):,}",
    ]
