"""``hizvk demo``: culls trees in the mountains, draws what happened, and checks it against the truth.

Each view goes the library's way: `Device.render_depth` of the terrain, `Device.pyramid`,
`Device.cull` of the trees' boxes.
What is visible is then found out without the library (`hizvk.truth`), and the exit code is 1 if a
visible tree was culled.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

import hizvk

from . import _core, scenes, truth
from . import report as reports
from .terminal import Progress, count, size

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from ._arguments import Size
    from .scenes import Scene, View

__all__ = ["Culled", "Progress", "cull_view", "main", "run"]

DEFAULTS: Final = {"views": 12, "size": (540, 960), "trees": 20_000}
QUICK: Final = {"views": 3, "size": (180, 320), "trees": 3_000}
#: Colours in the palette of overview.png, which the README shows.
PALETTE: Final = 160


@dataclass(frozen=True, eq=False)
class Culled:
    """One view's way through the library."""

    verdicts: npt.NDArray[np.uint8]
    mask: npt.NDArray[np.bool_]
    drawn: int
    """The sum of the draws' instance counts."""
    stats: hizvk.CullStats
    depth: npt.NDArray[np.float32]
    pyramid: hizvk.Pyramid
    ms: dict[str, float]


def cull_view(
    device: hizvk.Device, terrain: hizvk.Occluders, trees: hizvk.Instances, camera: hizvk.Camera
) -> Culled:
    """Depth, pyramid, cull; each stage is waited for and timed by the clock on the wall."""
    marks = [time.perf_counter()]

    def mark() -> None:
        device.wait()
        marks.append(time.perf_counter())

    depth = device.render_depth(terrain, camera)
    mark()
    pyramid = device.pyramid(depth)
    mark()
    seen = device.cull(trees, camera, pyramid, statistics=True)
    mark()
    verdicts, mask, drawn = seen.verdicts, seen.mask, int(seen.draws["instance_count"].sum())
    mark()
    ms = {
        stage: 1000.0 * float(took)
        for stage, took in zip(reports.STAGES, np.diff(marks), strict=True)
    }
    return Culled(verdicts, mask, drawn, seen.stats, depth.numpy(), pyramid, ms)


def run(
    out: Path, *, views: int, size: Size, trees: int, seed: int = 2010, pictures: bool = True
) -> reports.Report:
    """Runs the demo and leaves its pictures and its report in `out`.

    Parameters
    ----------
    out : Path
        A folder; made if it is not there.
    views, size, trees
        Stations of the flight, ``(height, width)`` of each image, number of instances.
    seed : int
        Same seed, same trees.
    pictures : bool
        Whether to draw each view of the flight; the pictures of one view are always drawn.

    Raises
    ------
    ImportError
        Without matplotlib; the text says what to install.
    hizvk.HizError
        What the device refuses.
    """
    started = time.perf_counter()
    out.mkdir(parents=True, exist_ok=True)
    steps = Progress(2 * views + 3, f"hizvk demo: {views} views of {trees:,} trees, into {out}")
    try:
        steps.show("mountains and trees")
        scene = scenes.mountains(trees, views, seed=seed)
        steps.step("uploading")
        mark = time.perf_counter()
        device = hizvk.Device()
        terrain = device.occluders(scene.vertices, scene.triangles)
        boxes = device.instances(hizvk.Boxes(scene.box_min, scene.box_max))
        device.wait()
        upload_ms = 1000.0 * (time.perf_counter() - mark)
        culled = []
        for number, view in enumerate(scene.views):
            steps.step(f"culling view {number}")
            culled.append(cull_view(device, terrain, boxes, view.camera(size)))
        steps.show("preparing the check")
        caster = truth.make_caster(scene)
        found = reports.Report(
            scene=scene.name, instances=len(scene), occluder_triangles=len(scene.triangles), size=size,
            adapter=device.adapter, truth=caster.method, upload_ms=upload_ms,
        )  # fmt: skip
        best = int(np.argmax([one.stats.occluded for one in culled]))
        shown: list[tuple[str, str]] = []
        for number, (view, one) in enumerate(zip(scene.views, culled, strict=True)):
            steps.step(f"checking and drawing view {number}")
            sight = caster.look(view, size, truth.linear_depth(one.depth, view.near))
            checked = truth.check(scene, view, one.mask, one.depth, sight, caster)
            difference = _depth_difference(caster, view, one.depth)
            found.views.append(
                reports.ViewReport.of(view.name, one.stats, one.drawn, checked, difference, one.ms)
            )
            if pictures:
                shown.append(_draw_station(out, number, scene, view, sight, caster, one))
        steps.step(f"drawing view {best}")
        sight = caster.look(
            scene.views[best], size, truth.linear_depth(culled[best].depth, scene.views[best].near)
        )
        shown = _draw_best(out, best, scene, sight, caster, culled[best], found) + shown
        found.seconds = time.perf_counter() - started
        reports.write(found, out, shown)
    finally:
        steps.close()
    return found


def _depth_difference(
    caster: truth.Caster, view: View, depth: npt.NDArray[np.float32]
) -> float | None:
    """The median relative difference of rendered and ray-cast depth, where both see the ground."""
    if not isinstance(caster, truth.RayCaster):
        return None
    size: Size = depth.shape
    cast = caster.occluder_depth(view, view.rays(size))
    both = np.isfinite(cast) & (depth > 0.0)
    if not both.any():
        return None
    return float(np.median(np.abs(truth.linear_depth(depth[both], view.near) / cast[both] - 1.0)))


def _draw_station(
    out: Path,
    number: int,
    scene: Scene,
    view: View,
    sight: truth.Sight,
    caster: truth.Caster,
    one: Culled,
) -> tuple[str, str]:
    """One view of the flight, beside the scene from above."""
    from . import plots

    name = f"flight_{number:02}.png"
    title = f"view {number}: {view.name}"
    picture = plots.view_picture(scene, view, sight, caster)
    plots.overview(out / name, picture, scene, view, one.verdicts, title)
    return name, f"View {number}, {view.name}"


def _draw_best(
    out: Path,
    number: int,
    scene: Scene,
    sight: truth.Sight,
    caster: truth.Caster,
    one: Culled,
    found: reports.Report,
) -> list[tuple[str, str]]:
    """All pictures of the view where most is hidden."""
    from . import plots

    view = scene.views[number]
    height, width = one.depth.shape
    levels = [one.pyramid.level(k) for k in range(one.pyramid.num_levels)]
    picture = plots.view_picture(scene, view, sight, caster, samples=2)
    plots.save(out / "view.png", picture)
    plots.save(
        out / "depth.png",
        plots.colour_depth(one.depth, view.near, plots.depth_span(one.depth, view.near)),
    )
    plots.pyramid_sheet(
        out / "pyramid.png",
        levels,
        view.near,
        f"view {number}: the farthest depth of every 2^k x 2^k pixels",
    )
    plots.top_picture(out / "top.png", scene, view, one.verdicts, width / height)
    told = found.views[number]
    wrong = len(told.false_culls) + len(told.broken_promises)
    title = (
        f"{len(scene):,} trees: {told.outside + told.occluded:,} culled, {told.kept:,} kept; "
        f"of the {told.visible:,} visible ones {wrong or 'none'} culled"
    )
    red = plots.with_culled(picture, scene, view, sight, one.verdicts)
    note = f"red: the {one.stats.occluded:,} trees in the view that the ridges hide"
    plots.overview(
        out / "overview.png", red, scene, view, one.verdicts, title, note=note, colours=PALETTE
    )
    return [
        (
            "overview.png",
            "Where most is hidden: the view with the culled trees in red, and the scene from above",
        ),
        ("view.png", "The same view as it is drawn"),
        ("depth.png", "Its depth image, the terrain alone (bright is near)"),
        ("pyramid.png", "Its depth pyramid, the depth linearised"),
        ("top.png", "From above: culled red, kept white"),
    ]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="hizvk demo",
        description="Culls trees in the mountains of a real elevation model, draws it, and checks that no visible tree "
        "was culled (exit code 1 otherwise).",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out"), help="folder for pictures and report (out)"
    )
    parser.add_argument("--views", type=count, help=f"stations of the flight ({DEFAULTS['views']})")
    parser.add_argument("--size", type=size, metavar="WIDTHxHEIGHT", help="of the images (960x540)")
    parser.add_argument("--trees", type=count, help=f"instances ({DEFAULTS['trees']})")
    parser.add_argument(
        "--quick", action="store_true", help="few trees and views, small images, fewer pictures"
    )
    parser.add_argument("--json", action="store_true", help="print the report as one JSON object")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command and returns its exit code: 0 good, 1 a visible tree was culled or it cannot run."""
    parsed = _parser().parse_args(arguments)
    chosen = {**DEFAULTS, **(QUICK if parsed.quick else {})}
    chosen.update(
        {name: getattr(parsed, name) for name in DEFAULTS if getattr(parsed, name) is not None}
    )
    try:
        found = run(parsed.out, pictures=not parsed.quick, **chosen)  # type: ignore[arg-type]
    except (ImportError, hizvk.HizError, OSError) as error:
        print(f"hizvk demo: {error}", file=sys.stderr)
        return 1
    if parsed.json:
        print(json.dumps(found.as_data(), indent=2))
    else:
        _tell(found, parsed.out)
    return 0 if found.passed else 1


def _tell(found: reports.Report, out: Path) -> None:
    tested, kept = found.total("tested"), found.total("kept")
    times = ", ".join(f"{stage} {took:.2f}" for stage, took in found.median_ms().items())
    print(f"adapter  {found.adapter}")
    if _core.__build__ != "release":
        print(
            "build    development: what runs on the host is not optimised; `make wheel` makes a release build"
        )
    print(
        f"culled   {tested - kept:,} of {tested:,} ({100.0 * (1.0 - kept / tested):.1f} %) in {len(found.views)} views"
    )
    print(f"median   {times} ms a view")
    print(
        f"hidden   {found.total('false_keeps'):,} kept in vain ({100.0 * found.false_keep_share:.1f} % of the hidden)"
    )
    print(f"check    {found.verdict()}")
    print(f"look at  {out / 'overview.png'} and {out / 'report.md'}  ({found.seconds:.0f} s)")


if __name__ == "__main__":
    sys.exit(main())
