"""Visible fractions beside ray truth, and what counts of pixels cost: ``python -m tools.counts``.

It prints the tables of ``docs/counts.md``.
Truth is by Embree (the extra ``scene``): one ray through each pixel's centre at the real triangles,
and the same rays at the triangles of each object alone.
Counts never see these triangles: they get the objects' boxes and the depth image.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

import hizvk
from hizvk.bench.catalogue import NAMES, Missing, make
from hizvk.commands import pipes
from hizvk.scenes.embree import can_cast, embree_scene
from hizvk.scenes.scene import box_corners
from hizvk.scenes.truth import RayCaster
from tools.speed.counts import SPREADS, boxes_at_720p, milliseconds
from tools.speed.rounds import in_turns

if TYPE_CHECKING:
    import numpy.typing as npt

    from hizvk.scenes import Scene, View

SIZE = (360, 640)
#: Objects with fewer pixels have no fraction to speak of.
LEAST_PIXELS = 16
#: nuScenes' levels of visibility: 0-40, 40-60, 60-80 and 80-100 %.
NUSCENES = (0.4, 0.6, 0.8)
#: The pyramids that counts are timed with.
DEPTHS: Final[tuple[Literal["farthest", "both"], ...]] = ("farthest", "both")
#: Rounds of which the least counts.
ROUNDS: Final = 25
#: Corners of a box count as visible if they are at most this much behind the image, in metres.
CORNER_DEPTH = 0.1


@dataclass
class Row:
    """What one scene shows."""

    scene: str
    objects: int = 0
    broken: int = 0
    truth: list[float] = field(default_factory=list)
    found: list[float] = field(default_factory=list)
    corners: list[float] = field(default_factory=list)
    of_boxes: list[float] = field(default_factory=list)

    def cells(self) -> list[str]:
        """The row of the table."""
        truth, found, corners = map(np.array, (self.truth, self.found, self.corners))
        levels = np.digitize(truth, NUSCENES) == np.digitize(found, NUSCENES)
        return [
            self.scene,
            f"{self.objects}",
            f"{self.broken}",
            f"{np.abs(found - truth).mean():.3f}",
            f"{levels.mean():.0%}",
            f"{np.abs(corners - truth).mean():.3f}",
            f"{np.mean(self.of_boxes):.4f}",
        ]


def alone(scene: Scene, view: View, i: int, pixels: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Which of these pixels show an object if it is alone."""
    eye = np.array(view.eye)
    triangles = scene.instance_triangles[scene.owner == i]
    embree = embree_scene([(scene.instance_vertices - eye, triangles)])
    rays = view.rays(pixels.shape)[pixels].astype(np.float32)
    hit = embree.run(np.float32(view.near) * rays, rays, query="INTERSECT")
    shown = np.zeros(pixels.shape, bool)
    shown[pixels] = hit >= 0
    return shown


def box_depth(
    low: npt.NDArray[np.float64], high: npt.NDArray[np.float64], view: View
) -> npt.NDArray[np.float64]:
    """The view depth at which each pixel's ray enters a box; inf where it misses."""
    rays, eye = view.rays(SIZE), np.array(view.eye)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.stack([(low - eye) / rays, (high - eye) / rays])
    enter, leave = at.min(axis=0).max(axis=-1), at.max(axis=0).min(axis=-1)
    return np.where((enter < leave) & (enter > view.near), enter, np.inf)


def visible_corners(
    camera: hizvk.Camera,
    depth: npt.NDArray[np.float64],
    corners: npt.NDArray[np.float64],
    view: View,
) -> float:
    """The share of a box's corners in front of the depth image, as scripts for CARLA count them."""
    at = (corners - view.eye) @ view.basis().T
    tangent = np.tan(np.radians(view.fov_y_deg) / 2)
    height, width = SIZE
    column = (at[:, 0] / at[:, 2] / tangent * height / 2 + width / 2).astype(int)
    row = (height / 2 - at[:, 1] / at[:, 2] / tangent * height / 2).astype(int)
    inside = (at[:, 2] > 0) & (column >= 0) & (column < width) & (row >= 0) & (row < height)
    surface = depth[row.clip(0, height - 1), column.clip(0, width - 1)]
    return float(np.mean(inside & (at[:, 2] < surface + CORNER_DEPTH)))


def measure(device: hizvk.Device, key: str, objects: int, views: int, castle: Path | None) -> Row:
    """One scene: every count against its bounds, and the fractions beside the truth."""
    bench = make(key, objects, views, 7, castle)
    scene, row = bench.scene, Row(key)
    caster = RayCaster(scene)
    boxes = device.instances(hizvk.Boxes(scene.box_min, scene.box_max))
    all_corners = box_corners(scene.box_min, scene.box_max)
    for view in scene.views:
        camera = view.camera(SIZE)
        sight = caster.look(view, SIZE)
        occluders = caster.occluder_depth(view, view.rays(SIZE))

        def counted(
            depth: npt.NDArray[np.float64], camera: hizvk.Camera = camera
        ) -> hizvk.CullResult:
            pyramid = device.pyramid(depth, camera, kind="z")
            return device.cull(
                boxes, camera, pyramid, outputs=["mask", "pixels"], coverage="sample", descent=65536
            )

        own, others = counted(sight.depth), counted(occluders)
        fractions = own.visible_fraction()
        of_others = others.visible_fraction(objects_in_depth=False)
        touched = np.flatnonzero(own.pixels["touched"])
        # Of the castle, which has all its instances, some.
        for i in touched[:: max(len(touched) // objects, 1)]:
            one, other = own.pixels[i], others.pixels[i]
            if one["undecided"]:
                continue
            shows = sight.owner == i
            enter = box_depth(scene.box_min[i], scene.box_max[i], view)
            box = np.isfinite(enter)
            whole = alone(scene, view, i, box)
            row.objects += 1
            # What is exactly touched, and what surely shows, is never more than is counted.
            slack = 1 - 1e-5
            row.broken += int(
                one["touched"] < whole.sum()
                or one["inside"] < shows.sum()
                or other["touched"] - other["hidden"] < (box & (enter < occluders * slack)).sum()
            )
            if whole.sum() >= LEAST_PIXELS:
                row.truth.append(shows.sum() / whole.sum())
                row.found.append(float(fractions[i]))
                row.corners.append(visible_corners(camera, sight.depth, all_corners[i], view))
                exact = (box & (enter < occluders)).sum() / max(box.sum(), 1)
                row.of_boxes.append(abs(float(of_others[i]) - exact))
    return row


def cost(
    device: hizvk.Device, spread: float, depths: Literal["farthest", "both"] = "farthest"
) -> list[str]:
    """2,000 boxes at 720p: CPU time of a cull with and without counts, in turns."""
    bounds, depth = boxes_at_720p(device, spread)
    boxes, pyramid = device.instances(bounds), device.pyramid(depth, depths=depths)
    cells = []
    for name, options in (
        ("plain", hizvk.CullOptions()),
        ("exact", hizvk.CullOptions(fit="volume", descent=4096)),
    ):

        def call(
            outputs: list[Literal["mask", "pixels"]], options: hizvk.CullOptions = options
        ) -> object:
            seen = device.cull(boxes, depth.camera, pyramid, options, outputs)
            return seen.pixels if "pixels" in outputs else seen.mask

        ms = in_turns(
            {
                "without": partial(milliseconds, partial(call, ["mask"])),
                "with": partial(milliseconds, partial(call, ["mask", "pixels"])),
            },
            ROUNDS,
        )
        least, most = ms["without"].min(), ms["with"].min()
        cells.append(f"{name}: {least:.2f} ms, {most:.2f} ms, {most / least:.1f}")
    touched = device.cull(boxes, depth.camera, pyramid, outputs=["pixels"]).pixels["touched"].sum()
    return [f"{touched / len(bounds.min):,.0f} px per box, {depths}", *cells]


def main() -> None:
    """Prints both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--objects", type=int, default=300)
    parser.add_argument("--views", type=int, default=2)
    parser.add_argument("--castle", type=Path)
    parser.add_argument("--scenes", nargs="*", default=list(NAMES))
    given = parser.parse_args()
    device = hizvk.Device()
    print(device.adapter)
    if can_cast():
        print("| scene | objects | broken | error | levels | corners' error | boxes' error |")
        print("|---|---|---|---|---|---|---|")
        for key in given.scenes:
            try:
                row = measure(device, key, given.objects, given.views, given.castle)
            except Missing as why:
                print(f"{key}: {why}")
                continue
            print("| " + " | ".join(row.cells()) + " |", flush=True)
    else:
        print("no truth: embreex is not installed (pip install embreex)")
    for spread in SPREADS:
        for depths in DEPTHS:
            print(*cost(device, spread, depths), sep="; ", flush=True)


if __name__ == "__main__":
    sys.exit(pipes.run(main))
