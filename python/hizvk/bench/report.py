"""The bench's report: report.json for machines, report.md to read.

report.json holds one object::

    passed        bool: no configuration with the promise culled what can be seen
    command       str: what prints it again
    seed          int
    extent        "quick" | "default" | "full"
    adapter       {index, name, driver, driver_info, backend, device_type}
    versions      {hizvk, python, numpy, embreex, platform}; embreex is null where it is not installed
    seconds       float: the whole run
    missing       [str]: scenes and columns that were left out, and why
    scenes        [scene]

    scene: key, name, instances, occluder_triangles, instance_triangles, views, size [height, width], repetitions,
           truth (how it was found out what is visible), visible, hidden, inside (instances over all
           views that own a pixel, that own none, and that are inside the view volume),
           one_instance_ms (a cull of one instance), upload_ms, warm_up_ms (first calls: they
           compile and build), rows [row]

    row:   label, configuration {volume, footprint, descent, coverage, order, fit,
           depth {divisor, conservative, levels}} or null for a yardstick, ms {render, reduce, cull,
           read: spread or null}, total_ms spread or null, ns_per_instance, first_ms,
           texels_per_instance (null where it was not measured), kept, false_culls, hairs,
           hidden_kept, hidden_kept_in_view, share_of_rectangle (shares, 0 to 1 and above), pareto
           bool

    spread: {median, q1, q3} milliseconds a view: over the repetitions of each view, then the mean
    over the views

`results.Row` and `results.SceneResult` say what each number is.
"""

from __future__ import annotations

import importlib.metadata
import json
import platform
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .._core import __version__
from .results import STAGES

if TYPE_CHECKING:
    from pathlib import Path

    from ..adapter import Adapter
    from .results import Row, SceneResult

__all__ = ["Report", "versions", "write"]

#: Shares of the best rectangle test's culls for which the report picks the fastest configuration.
SUFFICIENT: Final = (0.90, 0.95, 0.99)


def versions() -> dict[str, str | None]:
    """Of everything that takes part in the numbers."""
    try:
        embreex: str | None = importlib.metadata.version("embreex")
    except importlib.metadata.PackageNotFoundError:
        embreex = None
    return {
        "hizvk": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "embreex": embreex,
        "platform": f"{platform.system()} {platform.machine()}",
    }


@dataclass
class Report:
    """A run of the bench."""

    command: str
    seed: int
    extent: str
    adapter: Adapter
    scenes: list[SceneResult] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    seconds: float = 0.0

    def broken(self) -> list[str]:
        """Configurations with the promise that culled what can be seen, in words: bugs."""
        return [
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
        return {
            "passed": self.passed,
            "command": self.command,
            "seed": self.seed,
            "extent": self.extent,
            "adapter": asdict(self.adapter),
            "versions": versions(),
            "seconds": self.seconds,
            "missing": self.missing,
            "scenes": [scene.as_data() for scene in self.scenes],
        }


def write(report: Report, folder: Path, plots: dict[str, str]) -> None:
    """Writes report.json and report.md.

    Parameters
    ----------
    report : Report
        The numbers.
    folder : Path
        Where.
    plots : dict of str to str
        By scene: the plot's file name relative to `folder`.
    """
    (folder / "report.json").write_text(
        json.dumps(report.as_data(), indent=2) + "\n", encoding="utf-8"
    )
    (folder / "report.md").write_text("\n".join(_page(report, plots)) + "\n", encoding="utf-8")


def _page(report: Report, plots: dict[str, str]) -> list[str]:
    known = versions()
    adapter = report.adapter
    broken = report.broken()
    verdict = (
        f"FAILED: {'; '.join(broken)}"
        if broken
        else "no configuration with the promise culled what can be seen"
    )
    lines = [
        "# hizvk bench",
        "",
        f"**{verdict}.**",
        "",
        f"- Command: `{report.command}` ({report.seconds:.0f} s; seed {report.seed})",
        f"- Adapter: {adapter.name} ({adapter.device_type}); driver: {adapter.driver} {adapter.driver_info}",
        f"- hizvk {known['hizvk']}, Python {known['python']}, NumPy {known['numpy']}, embreex "
        f"{known['embreex'] or 'not installed'}; {known['platform']}",
        *(f"- Left out: {each}" for each in report.missing),
        "",
        "## What suffices",
        "",
        "The fastest configuration of area coverage that culls so much of what the best rectangle test culls inside "
        "the view, and its milliseconds from occluders to mask; what keeps least. On another device the order may be "
        "another one.",
        "",
        f"| scene | {' | '.join(f'{100 * share:.0f} %' for share in SUFFICIENT)} | keeps least |",
        f"|---|{'---|' * (len(SUFFICIENT) + 1)}",
        *(_picks(scene) for scene in report.scenes),
        "",
    ]
    for scene in report.scenes:
        lines += _scene(scene, plots.get(scene.key))
    return lines + _legend()


def _picks(scene: SceneResult) -> str:
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

    found = []
    for share in SUFFICIENT:
        enough = [row for row in able if row.share_of_rectangle >= share]
        found.append(min(enough, key=milliseconds, default=None))
    found.append(min(able, key=lambda row: (row.hidden_kept, milliseconds(row)), default=None))
    cells = " | ".join(
        "none" if row is None else f"{row.label}: {milliseconds(row):.2f} ms" for row in found
    )
    return f"| {scene.key} | {cells} |"


def _scene(scene: SceneResult, plot: str | None) -> list[str]:
    height, width = scene.size
    lines = [
        f"## {scene.key}",
        "",
        f"{scene.name[0].upper()}{scene.name[1:]}: {scene.occluder_triangles:,} triangles hide, {scene.instances:,} "
        f"instances ({scene.instance_triangles:,} triangles) are tested, from {scene.views} views of {width}x{height}; "
        f"{scene.repetitions} repetitions. Over all views {scene.inside:,} instances are inside the view volume and "
        f"{scene.visible:,} are visible ({scene.truth}). A cull of one instance takes {scene.one_instance_ms:.2f} ms, "
        f"uploads took {scene.upload_ms:.0f} ms, first calls (compiling the shaders that are new) "
        f"{scene.warm_up_ms:.0f} ms.",
        "",
    ]
    if plot is not None:
        lines += [f"![speed against error, {scene.key}]({plot})", ""]
    head = "| # | | render | reduce | cull | read | sum | quartiles | ns/inst. | texels/inst. | false culls | "
    lines += [
        head + "hidden kept | of those in view | of best rect. |",
        f"|---:|---|{'---:|' * 12}",
    ]
    for number, row in enumerate(scene.rows, 1):
        lines.append(_row(number, row))
    return [*lines, ""]


def _row(number: int, row: Row) -> str:
    stages = [row.ms.get(stage) for stage in STAGES]
    times = [f"{stage.median:.2f}" if stage else "" for stage in stages]
    total = row.total_ms
    times += [f"{total.median:.2f}", f"{total.q1:.2f}..{total.q3:.2f}"] if total else ["", ""]
    each = "" if row.ns_per_instance is None else f"{row.ns_per_instance:,.0f}"
    texels = "" if row.texels_per_instance is None else f"{row.texels_per_instance:.2f}"
    label = row.label if row.configuration else f"*{row.label}*"
    label = f"**{label}**" if row.pareto else label
    shares = (row.hidden_kept, row.hidden_kept_in_view, row.share_of_rectangle)
    cells = [
        f"{number}{' P' if row.pareto else ''}",
        label,
        *times,
        each,
        texels,
        f"{row.false_culls:,}",
    ]
    cells += [f"{100.0 * share:.2f} %" for share in shares]
    return f"| {' | '.join(cells)} |"


def _legend() -> list[str]:
    return [
        "## What the columns mean",
        "",
        "Rows: the volume that is tested, the footprint (N x N texels of one level; *descent*: then finer levels where "
        "that cannot decide), and what differs from area coverage, any order, the rectangle's fit and plain depth at "
        "full resolution. *Italic*: what one would otherwise do, in the same run. **Bold** and P: on the Pareto front "
        "of sum and hidden kept (to 0.1 % of those in the view), among those whose promise reaches to the view's "
        "pixels and that culled nothing visible; sample coverage promises less, so it takes no area coverage off the "
        "front. Rows that differ by less than their quartiles are equal in practice.",
        "",
        "- *render*, *reduce*, *cull*, *read*: milliseconds a view of the occluders into depth, of all levels of the "
        "pyramid, of the test of all instances, and of the mask to the host; by the clock on the wall, each waited "
        "for, Python included. All are medians over a view's repetitions, and the mean over the views. *sum*: all of "
        "them; *quartiles*: of the sum, where render and reduce, which the rows of a depth image share, stand still. "
        "numpy reads the depth image back and builds its levels under *reduce*.",
        "- *ns/inst.*: the cull by the number of instances; *texels/inst.*: depth texels read, by tests of groups "
        "and of instances, over all instances; what lies outside the view reads none.",
        "- *false culls*: instances that own a pixel by more than a hair and were culled (visible by a hair: the ray "
        "moved by 1/16 pixel, or the depth by 1e-6, hides it). A smaller image of plain samples promises nothing for "
        "the pixels of the view, so its rows may have some.",
        "- *hidden kept*: kept, of those in no pixel of the view; *of those in view*: the same among those inside the "
        "view volume.",
        "- *of best rect.*: culled inside the view volume, over what a rectangle test of boxes in float64 over all "
        "pixels culls there; tighter volumes and a volume fit can exceed 100 %.",
        "- *Embree, one ray a pixel* is how the truth is found out, hence its zeros. It casts on one thread here, and "
        "the first ray builds its trees (`first_ms` in report.json). It needs the triangles of all instances, hizvk "
        "their bounds.",
    ]
