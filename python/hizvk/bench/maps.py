"""``hizvk bench --maps``: hierarchical occlusion maps beside the certified cull.

Source: Zhang, Manocha, Hudson and Hoff (1997); see `hizvk.OcclusionMap`.
report.json holds ``{command, seed, adapter, versions, seconds, missing, scenes}``.
Each scene has ``{key, name, instances, views, occluders, chosen, rows}``.
`maps_results.Row` says what the numbers are.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ..bounds import Boxes
from ..commands import arguments as args
from ..commands import figure, report
from ..commands.page import Page
from ..device import Device
from ..explanation import Verdict
from ..measuring.configuration import DESCENT
from ..occluders import select_occluders
from ..scenes import embree
from ..scenes.fence import PARTS, fence
from ..scenes.truth import linear_depth, make_caster
from . import frame
from .maps_results import LIMITS, NEGLIGIBLE, PICTURE, SIDE, Found, Row
from .occluders import groups_of, made_with_groups

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    import numpy.typing as npt

    from ..camera import Camera
    from ..mesh import Mesh
    from ..methods import OcclusionMap
    from ..progress import Progress
    from ..resources import Occluders, Pyramid
    from ..scenes import Scene, View
    from ..scenes.truth import Caster

__all__ = ["NAMES", "Report", "cells", "main", "run"]

PROG: Final = "hizvk bench --maps"
NAMES: Final = ("fence", "hedge", "village", "boulders", "city", "room")
#: Instances and views of each scene.
INSTANCES: Final = {"fence": 400, "hedge": 2_000, "village": 4_000, "boulders": 4_000}
VIEWS: Final = 4
REPETITIONS: Final = 5


@dataclass
class Report(frame.Run):
    """A run over all scenes."""

    scenes: list[Found] = field(default_factory=list)
    pictures: list[str] = field(default_factory=list)

    @property
    def passed(self) -> bool:
        """Whether something was measured, and the certified cull lost nothing."""
        certified = [
            row for scene in self.scenes for row in scene.rows if row.negligible_px is None
        ]
        return bool(certified) and not any(row.lost for row in certified)

    def page(self) -> Page:
        """The tables and the pictures."""
        page = Page(PROG)
        page.items(*self.opening())
        for scene in self.scenes:
            page.heading(scene.key)
            page.text(
                f"{scene.name}: {scene.instances:,} instances, {scene.views} views, "
                f"{scene.occluders} occluders in the database, {scene.chosen} drawn per view "
                f"(limit: {scene.limit or 'none'}).",
                f"The estimated depth is {scene.farther:.2f} times the true one in the median.",
            )
            page.table(HEAD, (cells(row) for row in scene.rows), left=1)
        for each in self.pictures:
            page.picture(each.removesuffix(".png"), each)
        return page


HEAD: Final = (
    f"way | hidden kept | lost at {SIDE}x{SIDE} | pixels | "
    f"lost at {PICTURE}x{PICTURE} | pixels | ms to make | ms to cull"
)


def cells(row: Row) -> list[str]:
    """One row of the table."""
    return [
        row.label,
        f"{100.0 * row.share_kept:.1f} %",
        f"{row.lost:,}",
        f"{row.pixels:,}",
        f"{row.lost_large:,}",
        f"{row.pixels_large:,}",
        f"{row.ms_make:.2f}",
        f"{row.ms_cull:.2f}",
    ]


def run(
    out: Path,
    *,
    keys: Sequence[str] = NAMES,
    seed: int = 1997,
    instances: int | None = None,
    views: int | None = None,
    max_occluders: int | None = None,
    command: str = PROG,
) -> Report:
    """Leaves report.md, report.json, and pictures of the curve and of the maps in `out`.

    Pictures need matplotlib and are left out without it.

    Parameters
    ----------
    out : Path
        A folder; made if it is not there.
    keys : sequence of str
        Of `NAMES`.
    seed : int
        Same seed, same scenes.
    instances, views : int, optional
        For every scene.
    max_occluders : int, optional
        The limit of the maps' occluders in each view; None: the best one of `LIMITS`.
    command : str
        The command that the report names.

    Raises
    ------
    hizvk.HizError
        What the device refuses.
    """
    device = Device()
    found = Report(command=command, seed=seed, adapter=device.adapter)
    if not embree.can_cast():
        found.missing.append(
            f"{embree.missing()}; what is seen is then that of boxes before the rendered depth"
        )
    if not figure.can_draw():
        found.missing.append(figure.missing())

    def measure(key: str, steps: Progress) -> None:
        scene, meshes = _scene(key, instances, views or VIEWS, seed)
        measured = _measure(device, key, scene, meshes, max_occluders)
        found.scenes.append(measured)
        if figure.can_draw():
            from . import maps_pictures as drawing

            walls, _ = _database(device, meshes)
            view, limit = scene.views[0], measured.limit
            found.pictures.append(drawing.maps(out, key, device, walls, view, limit))

    found.over(out, keys, measure, prog=PROG)
    if figure.can_draw():
        from . import maps_pictures as drawing

        found.pictures.insert(0, drawing.curve(out, found.scenes))
    report.write(out, found.as_data(), found.page())
    return found


def _scene(key: str, instances: int | None, views: int, seed: int) -> tuple[Scene, list[Mesh]]:
    """A scene, and its occluders as objects."""
    things = instances or INSTANCES.get(key, 2_000)
    if key == "fence":
        scene = fence(things, views, seed=seed)
        each = 12 * PARTS
        return scene, groups_of(scene, np.arange(0, len(scene.triangles) + 1, each)).meshes()
    scene, groups, _ = made_with_groups(key, things, views, seed, None)
    return scene, groups.meshes()


def _database(device: Device, meshes: Sequence[Mesh]) -> tuple[Occluders, list[Mesh]]:
    """The meshes that `select_occluders` keeps, on the device and as they are."""
    kept = [meshes[k] for k in select_occluders(list(meshes)).kept]
    return device.occluders(kept), kept


def _measure(
    device: Device, key: str, scene: Scene, meshes: Sequence[Mesh], max_occluders: int | None
) -> Found:
    walls, kept = _database(device, meshes)
    stand = _Stand(device, scene, walls)
    limits = LIMITS if max_occluders is None else (max_occluders,)
    stand.limit = min(limits, key=stand.kept)
    rows = [Row(f"{hole} px negligible", hole) for hole in NEGLIGIBLE]
    rows += [Row("certified", None), Row("certified, with descent", None, descent=DESCENT)]
    # Both ways draw the occluders of the database, so what is seen counts them alone.
    caster = make_caster(_with(scene, kept))
    chosen, farther = [], []
    for view in scene.views:
        maps, ratios = stand.view(view, caster, rows)
        chosen.append(len(maps.chosen))
        farther.append(ratios)
    for row in rows:
        row.ms_make /= len(scene.views)
        row.ms_cull /= len(scene.views)
    return Found(
        key=key,
        name=scene.name,
        instances=len(scene),
        views=len(scene.views),
        occluders=len(kept),
        limit=stand.limit,
        chosen=round(float(np.mean(chosen))),
        pixels=SIDE * SIDE * len(scene.views),
        farther=float(np.median(np.concatenate(farther))),
        rows=rows,
    )


class _Stand:
    """A scene on the device."""

    def __init__(self, device: Device, scene: Scene, walls: Occluders) -> None:
        self._device, self._walls, self._views = device, walls, scene.views
        self._count = len(scene)
        self.limit: int | None = None
        self._boxes = Boxes(scene.box_min, scene.box_max)
        self._things = device.instances(self._boxes)

    def maps(self, camera: Camera, limit: int | None) -> OcclusionMap:
        """The maps of a view within a limit."""
        return self._device.occlusion_map(
            self._walls, camera, size=(SIDE, SIDE), max_occluders=limit
        )

    def kept(self, limit: int | None) -> int:
        """Instances that are kept with maps within a limit and no negligible hole, in all views."""
        cameras = [view.camera((SIDE, SIDE)) for view in self._views]
        return sum(
            self._device.cull_map(self._boxes, camera, self.maps(camera, limit)).count
            for camera in cameras
        )

    def view(
        self, view: View, caster: Caster, rows: Sequence[Row]
    ) -> tuple[OcclusionMap, npt.NDArray[np.float64]]:
        """Adds what is found in one view to the rows; its maps and the ratios of `_farther`."""
        camera = view.camera((SIDE, SIDE))

        def build() -> Pyramid:
            return self._device.pyramid(self._device.render_depth(self._walls, camera))

        ms_maps, maps = _timed(lambda: self.maps(camera, self.limit))
        ms_pyramid, pyramid = _timed(build)
        seen = [
            caster.look(view, (side, side), self._depth(view, side)).pixels(self._count)
            for side in (SIDE, PICTURE)
        ]
        outside = self._device.cull(self._things, camera, pyramid).verdicts == Verdict.OUTSIDE

        def mask(row: Row) -> npt.NDArray[np.bool_]:
            hole = row.negligible_px
            if hole is None:
                seen = self._device.cull(self._things, camera, pyramid, descent=row.descent)
                return seen.mask
            return self._device.cull_map(self._boxes, camera, maps, negligible_px=hole).mask

        for row in rows:
            ms, kept = _timed(partial(mask, row))
            row.ms_make += ms_pyramid if row.negligible_px is None else ms_maps
            row.ms_cull += ms
            _add(row, kept, seen, outside)
        return maps, _farther(maps.estimate, self._depth(view, SIDE))

    def _depth(self, view: View, side: int) -> npt.NDArray[np.float64]:
        """View depth of the occluders in a square picture; infinite where there is none."""
        depth = self._device.render_depth(self._walls, view.camera((side, side))).numpy()
        return linear_depth(depth, view.near, view.far)


def _with(scene: Scene, meshes: Sequence[Mesh]) -> Scene:
    """The scene with other occluders."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    triangles = [
        mesh.triangles.astype(np.uint32) + np.uint32(start)
        for mesh, start in zip(meshes, first[:-1], strict=True)
    ]
    return replace(
        scene,
        vertices=np.concatenate([mesh.vertices for mesh in meshes]).astype(np.float64),
        triangles=np.concatenate(triangles).astype(np.uint32),
    )


def _timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """The least time of some calls in milliseconds, and what the last one returned."""
    times = []
    for _ in range(REPETITIONS):
        started = time.perf_counter()
        made = work()
        times.append(1e3 * (time.perf_counter() - started))
    return min(times), made


def _add(
    row: Row,
    mask: npt.NDArray[np.bool_],
    seen: Sequence[npt.NDArray[np.intp]],
    outside: npt.NDArray[np.bool_],
) -> None:
    """Counts what is kept and what is lost in one view."""
    small, large = seen
    hidden = (small == 0) & (large == 0) & ~outside
    row.hidden += int(hidden.sum())
    row.hidden_kept += int((hidden & mask).sum())
    row.lost += int(((small > 0) & ~mask).sum())
    row.pixels += int(small[~mask].sum())
    row.lost_large += int(((large > 0) & ~mask).sum())
    row.pixels_large += int(large[~mask].sum())


def _farther(
    estimate: npt.NDArray[np.float64], depth: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Estimated by true farthest depth, of the regions that are covered."""
    side = len(estimate)
    blocks = depth.reshape(side, len(depth) // side, side, -1)
    true = blocks.max(axis=(1, 3))
    covered = np.isfinite(true) & np.isfinite(estimate)
    ratio: npt.NDArray[np.float64] = estimate[covered] / true[covered]
    return ratio


def main(arguments: Sequence[str]) -> int:
    """Runs the command; exit code 1: it cannot run, or the certified cull lost something."""
    parser = frame.parser(
        PROG,
        "Hierarchical occlusion maps with holes of 0 to 64 negligible pixels beside the certified "
        "cull: hidden instances kept, visible ones lost, pixels lost, time. "
        "Draws the maps and the depth-estimation buffer of the first view of each scene, too.",
        out="out/bench-maps",
        holds="report and pictures",
        names=NAMES,
        seed=1997,
    )
    parser.add_argument("--instances", type=args.count, help="in every scene")
    parser.add_argument(
        "--max-occluders",
        type=args.count,
        help="that maps draw in a view (default: the best of 4, 16, 64 and all)",
    )
    options = vars(parser.parse_args(list(arguments)))
    return frame.execute(PROG, run, options, arguments, frame.print_page)
