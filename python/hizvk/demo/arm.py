"""``hizvk demo --scene arm``: ARM's spheres among prisms, culled by 256x256 pixels of depth.

Each view draws the prisms twice, as a conservative image and as a plain one, and culls with both.
Rays through all pixels of the larger picture tell which spheres show.
The conservative image holds for every larger picture, so none of these may be culled with it.
The plain one is right at its own pixel centres alone, and the report says what it loses.
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import hizvk

from ..commands import report
from ..commands.page import Page
from ..progress import Progress
from ..scenes.arm import arm

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

    from .._arguments import Size
    from ..adapter import Adapter
    from ..scenes.arm import ArmScene, BallSight
    from ..scenes.scene import View
    from ..stats import CullStats

__all__ = ["ArmReport", "ArmView", "run_arm"]

#: The size of the depth images.
OCCLUDER_SIZE: Final = (256, 256)
#: The depth images, by what they are called, and whether they are conservative.
WAYS: Final = {"conservative": True, "plain": False}


@dataclass
class ArmView:
    """The numbers of one view with one depth image."""

    name: str
    """Which way the camera looks."""
    depth: str
    """One of `WAYS`."""
    tested: int
    outside: int
    """Culled: outside the view."""
    occluded: int
    """Culled: in the view, behind the prisms."""
    kept: int
    seen: int
    """Spheres that a ray meets before any prism."""
    false_culls: list[int]
    """Those of them that were culled."""


@dataclass
class ArmReport:
    """The numbers of a run."""

    size: Size
    """Of the picture whose rays are cast."""
    adapter: Adapter
    views: list[ArmView] = field(default_factory=list)
    seconds: float = 0.0
    """The whole run with rays and pictures."""

    @property
    def passed(self) -> bool:
        """Whether conservative depth has culled no sphere that shows."""
        return bool(self.views) and not self.total("conservative", "false_culls")

    def total(self, depth: str, name: str) -> int:
        """The sum of one number over the views with this depth image (of a list: its length)."""
        values = [getattr(view, name) for view in self.views if view.depth == depth]
        return sum(len(value) if isinstance(value, list) else value for value in values)

    def as_data(self) -> dict[str, Any]:
        """Everything as plain data for JSON."""
        names = ("tested", "outside", "occluded", "kept", "seen", "false_culls")
        totals = {way: {name: self.total(way, name) for name in names} for way in WAYS}
        return {
            "passed": self.passed,
            "totals": totals,
            **asdict(self),
            "versions": report.versions(),
        }

    def verdict(self) -> str:
        """The outcome of the check in one line."""
        outcome = "passed" if self.passed else "FAILED"
        wrong, seen = (self.total("conservative", name) for name in ("false_culls", "seen"))
        return f"{outcome}: {wrong:,} of {seen:,} visible spheres culled with conservative depth"

    def lost(self) -> str:
        """What the plain image culls, in one line."""
        wrong, seen = (self.total("plain", name) for name in ("false_culls", "seen"))
        return f"{wrong:,} of {seen:,} visible spheres culled with plain depth of the same size"

    def lines(self) -> list[str]:
        """The report as the command prints it."""
        tested, kept = (self.total("conservative", name) for name in ("tested", "kept"))
        return [
            f"adapter  {self.adapter}",
            f"culled   {tested - kept:,} of {tested:,} ({100.0 * (1.0 - kept / tested):.1f} %)",
            f"check    {self.verdict()}",
            f"plain    {self.lost()}",
        ]


def run_arm(
    out: Path, *, views: int, size: Size, seed: int = 2015, pictures: bool = True
) -> ArmReport:
    """Runs the demo and leaves its pictures and its report in `out`.

    Parameters
    ----------
    out : Path
        A folder; made if it is not there.
    views, size
        Directions of the camera, and ``(height, width)`` of the picture whose rays are cast.
    seed : int
        Same seed, same radii.
    pictures : bool
        Whether to draw every view; the first is always drawn.

    Raises
    ------
    ImportError
        Without matplotlib.
    hizvk.HizError
        What the device refuses.
    """
    from .arm_pictures import overview

    started = time.perf_counter()
    out.mkdir(parents=True, exist_ok=True)
    scene = arm(views, seed=seed)
    label = f"hizvk demo: {views} views of {len(scene):,} spheres, into {out}"
    device = hizvk.Device()
    prisms = device.occluders(*scene.prism_mesh())
    spheres = device.instances(hizvk.Spheres(scene.centers, scene.radii))
    found = ArmReport(size=size, adapter=device.adapter)
    shown: list[tuple[str, str]] = []
    with Progress(True, label, views, after_s=0.0) as steps:
        for number, view in enumerate(scene.views):
            steps.step(f"view {number}")
            camera = view.camera(size).resized(OCCLUDER_SIZE)
            sight = scene.look(view, size)
            kept_by: dict[str, npt.NDArray[np.uint8]] = {}
            for way, conservative in WAYS.items():
                depth = device.render_depth(prisms, camera, conservative=conservative)
                seen = device.cull(spheres, camera, device.pyramid(depth), statistics=True)
                kept_by[way] = seen.verdicts
                found.views.append(_told(view, way, seen.stats, seen.mask, sight))
            if pictures or number == 0:
                name = f"arm_{number:02}.png"
                title = _title(found.views[-2], len(scene))
                overview(out / name, scene, view, sight, kept_by["conservative"], title)
                shown.append((name, f"View {number}, {view.name}"))
        found.seconds = time.perf_counter() - started
        report.write(out, found.as_data(), _page(found, scene, shown))
    return found


def _told(
    view: View, way: str, stats: CullStats, mask: npt.NDArray[np.bool_], sight: BallSight
) -> ArmView:
    return ArmView(
        name=view.name,
        depth=way,
        tested=stats.tested,
        outside=stats.outside,
        occluded=stats.occluded,
        kept=int(mask.sum()),
        seen=int(sight.seen.sum()),
        false_culls=[int(k) for k in np.flatnonzero(sight.seen & ~mask)],
    )


def _title(told: ArmView, count: int) -> str:
    wrong = len(told.false_culls) or "none"
    return (
        f"{count:,} spheres: {told.outside + told.occluded:,} culled, {told.kept:,} kept; "
        f"of the {told.seen:,} visible ones {wrong} culled"
    )


def _page(found: ArmReport, scene: ArmScene, pictures: list[tuple[str, str]]) -> Page:
    height, width = found.size
    page = Page("Occlusion culling in ARM's scene")
    page.text(f"**{found.verdict()}.**", f"{found.lost()}.")
    page.items(
        f"Scene: {len(scene.prism_min)} prisms hide, {len(scene):,} spheres are tested",
        f"Depth images: {OCCLUDER_SIZE[1]}x{OCCLUDER_SIZE[0]}, of the prisms alone, reversed Z",
        f"Rays: through the {width}x{height} pixel centres of the picture, at prisms and spheres",
        report.adapter_words(found.adapter),
        f"{report.version_words()}; {found.seconds:.1f} s in all, with the rays and the pictures",
    )
    page.heading("Counts")
    page.table(
        "view | depth | outside | behind | kept | visible | visible, but culled",
        [
            [
                view.name,
                view.depth,
                *(f"{n:,}" for n in (view.outside, view.occluded, view.kept, view.seen)),
                f"{len(view.false_culls):,}",
            ]
            for view in found.views
        ],
        left=2,
    )
    page.items(
        "*outside*, *behind*: culled, outside the view or within it behind the depth image",
        "*visible*: a ray meets the sphere before any prism, maybe behind another sphere",
    )
    page.heading("Pictures")
    for name, what in pictures:
        page.text(f"{what}:")
        page.picture(what, name)
    return page
