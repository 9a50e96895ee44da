"""The report of ``hizvk bench --texts``.

report.json holds ``{command, seed, adapter, versions, seconds, missing, scenes}``.
Each scene has ``{key, name, instances, views, size, repetitions, visible, hidden, truth, rows}``.
A row has ``{label, promises, lost, hairs, hidden_kept_in_view, ms}``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from ..commands.page import Page
from . import frame

if TYPE_CHECKING:
    from .._arguments import Size
    from ..measuring.spread import Spread

__all__ = ["PROG", "Found", "Method", "Report", "table"]

PROG: Final = "hizvk bench --texts"


@dataclass(frozen=True)
class Method:
    """One way to cull, summed over the views of a scene."""

    label: str
    promises: bool
    """Whether it promises that nothing visible is lost."""
    lost: int
    """Visible instances that it culled."""
    hairs: int
    """Culled ones that are visible only by a hair, so a rasteriser may hide them."""
    hidden_kept_in_view: float
    """Kept but not visible, as a share of what is in the view and not visible."""
    ms: Spread
    """Of one view."""


@dataclass(frozen=True)
class Found:
    """What was found in one scene."""

    key: str
    name: str
    instances: int
    views: int
    size: Size
    repetitions: int
    visible: int
    """Instances that own a pixel, over all views."""
    hidden: int
    truth: str
    rows: list[Method]

    def lost_share(self, row: Method) -> float:
        """The part of the visible instances that a row loses, 0 to 1."""
        return row.lost / max(self.visible, 1)


@dataclass
class Report(frame.Run):
    """A run over all scenes."""

    scenes: list[Found] = field(default_factory=list)

    @property
    def passed(self) -> bool:
        """Whether something was measured, and no row with the promise lost anything."""
        kept = all(row.lost == 0 for one in self.scenes for row in one.rows if row.promises)
        return bool(self.scenes) and kept

    def page(self) -> Page:
        """The table."""
        page = Page(PROG)
        page.items(*self.opening(*(f"Truth of {one.key}: {one.truth}" for one in self.scenes)))
        page.heading("Published tests beside certified culls")
        page.text(
            "Visible lost: instances that own a pixel and were culled, over all views.",
            "Hidden kept: of the instances in the view volume that own no pixel.",
            "Time: milliseconds of one cull on the device; rows in bold promise that 0 are lost.",
        )
        page.table("scene | test | visible lost | of them | hidden kept | ms", table(self), left=2)
        return page


def table(found: Report) -> list[list[str]]:
    """The rows of the table."""
    return [
        [
            one.key,
            f"**{row.label}**" if row.promises else row.label,
            f"{row.lost:,}",
            f"{100.0 * one.lost_share(row):.2f} %",
            f"{100.0 * row.hidden_kept_in_view:.1f} %",
            f"{row.ms.median:.2f}",
        ]
        for one in found.scenes
        for row in one.rows
    ]
