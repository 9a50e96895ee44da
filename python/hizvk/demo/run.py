"""All views of the demo: each is culled, checked and drawn."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

import hizvk

from .. import scenes
from ..measuring.stopwatch import Stopwatch
from ..progress import Progress
from ..scenes import truth
from .report import STAGES, Report, ViewReport

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

    from .._arguments import Size
    from ..scenes import Scene, View

__all__ = ["Culled", "cull_view", "run"]

#: Colours in the palette of overview.png, which the README shows.
PALETTE: Final = 160


@dataclass(frozen=True, eq=False)
class Culled:
    """What the library's calls gave for one view."""

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
    """Renders depth, reduces it and culls; each stage is waited for and timed by the wall clock."""
    watch = Stopwatch(device)
    ms = dict.fromkeys(STAGES, 0.0)
    depth = device.render_depth(terrain, camera)
    ms["render"] = watch.lap()
    pyramid = device.pyramid(depth)
    ms["pyramid"] = watch.lap()
    seen = device.cull(trees, camera, pyramid, statistics=True)
    ms["cull"] = watch.lap()
    verdicts, mask, drawn = seen.verdicts, seen.mask, int(seen.draws["instance_count"].sum())
    ms["read"] = watch.lap()
    return Culled(verdicts, mask, drawn, seen.stats, depth.numpy(), pyramid, ms)


def run(
    out: Path, *, views: int, size: Size, trees: int, seed: int = 2010, pictures: bool = True
) -> Report:
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
    label = f"hizvk demo: {views} views of {trees:,} trees, into {out}"
    with Progress(True, label, 2 * views + 3, after_s=0.0) as steps:
        steps.show("mountains and trees")
        scene = scenes.mountains(trees, views, seed=seed)
        steps.step("uploading")
        began = time.perf_counter()
        device = hizvk.Device()
        terrain = device.occluders(scene.vertices, scene.triangles)
        boxes = device.instances(hizvk.Boxes(scene.box_min, scene.box_max))
        device.wait()
        upload_ms = 1000.0 * (time.perf_counter() - began)
        culled = []
        for number, view in enumerate(scene.views):
            steps.step(f"culling view {number}")
            culled.append(cull_view(device, terrain, boxes, view.camera(size)))
        steps.show("preparing the check")
        caster = truth.make_caster(scene)
        found = Report(
            scene=scene.name,
            instances=len(scene),
            occluder_triangles=len(scene.triangles),
            size=size,
            adapter=device.adapter,
            truth=caster.method,
            upload_ms=upload_ms,
        )
        best = int(np.argmax([one.stats.occluded for one in culled]))
        shown: list[tuple[str, str]] = []
        for number, (view, one) in enumerate(zip(scene.views, culled, strict=True)):
            steps.step(f"checking and drawing view {number}")
            sight = caster.look(view, size, truth.linear_depth(one.depth, view.near))
            checked = truth.check(scene, view, one.mask, one.depth, sight, caster)
            difference = _depth_difference(caster, view, one.depth)
            found.views.append(
                ViewReport.of(view.name, one.stats, one.drawn, checked, difference, one.ms)
            )
            if pictures:
                shown.append(_draw_station(out, number, scene, view, sight, caster, one))
        steps.step(f"drawing view {best}")
        sight = caster.look(
            scene.views[best], size, truth.linear_depth(culled[best].depth, scene.views[best].near)
        )
        shown = _draw_best(out, best, scene, sight, caster, culled[best], found) + shown
        found.seconds = time.perf_counter() - started
        found.write(out, shown)
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
    from . import pictures as drawing
    from .shading import view_picture

    name = f"flight_{number:02}.png"
    title = f"view {number}: {view.name}"
    picture = view_picture(scene, view, sight, caster)
    drawing.overview(out / name, picture, scene, view, one.verdicts, title)
    return name, f"View {number}, {view.name}"


def _draw_best(
    out: Path,
    number: int,
    scene: Scene,
    sight: truth.Sight,
    caster: truth.Caster,
    one: Culled,
    found: Report,
) -> list[tuple[str, str]]:
    """All pictures of the view where most is hidden."""
    from . import pictures as drawing
    from .shading import view_picture

    view = scene.views[number]
    height, width = one.depth.shape
    levels = [one.pyramid.level(k) for k in range(one.pyramid.num_levels)]
    picture = view_picture(scene, view, sight, caster, samples=2)
    drawing.save(out / "view.png", picture)
    drawing.save(
        out / "depth.png",
        drawing.colour_depth(one.depth, view.near, drawing.depth_span(one.depth, view.near)),
    )
    drawing.pyramid_sheet(
        out / "pyramid.png",
        levels,
        view.near,
        f"view {number}: the farthest depth of every 2^k x 2^k pixels",
    )
    drawing.top_picture(out / "top.png", scene, view, one.verdicts, width / height)
    told = found.views[number]
    wrong = len(told.false_culls) + len(told.broken_promises)
    title = (
        f"{len(scene):,} trees: {told.outside + told.occluded:,} culled, {told.kept:,} kept; "
        f"of the {told.visible:,} visible ones {wrong or 'none'} culled"
    )
    red = drawing.with_culled(picture, scene, view, sight, one.verdicts)
    note = f"red: the {one.stats.occluded:,} trees in the view that the ridges hide"
    drawing.overview(
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
