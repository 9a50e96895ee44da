"""``hizvk bench --occluders``: what is lost when fewer or simpler occluders are drawn.

report.json holds ``{command, seed, adapter, versions, seconds, missing, scenes}``.
Each scene has ``{key, name, groups, views, size, cut, proxies}``.
`hiding.Row` and `hiding.Proxies` say what the numbers of its lists ``cut`` and ``proxies`` are.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from ..bounds import Boxes
from ..commands import report
from ..commands.page import Page
from ..device import Device
from ..mesh import Mesh
from ..occluders import inner_boxes, inner_prisms, split_mesh
from ..scenes import box_mesh, village
from ..scenes.boulders import boulders
from ..scenes.hedge import hedge
from . import catalogue, frame
from .hiding import SHARES, Groups, Proxies, Row, Stage, cut, replaced

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import numpy.typing as npt

    from .._arguments import Size
    from ..progress import Progress
    from ..scenes import Scene

__all__ = [
    "NAMES",
    "Report",
    "cuts",
    "groups_of",
    "made_with_groups",
    "main",
    "proxies",
    "run",
]

PROG: Final = "hizvk bench --occluders"
#: The scenes of this report; the first four are also the bench's.
NAMES: Final = (
    "mountains",
    "city",
    "room",
    "castle",
    "hedge",
    "village",
    "boulders",
)
#: Sides of the cubes into which a scene's occluders are split, in metres.
CELLS: Final = {"mountains": 1600.0, "city": 60.0, "room": 8.0, "castle": 8.0}
#: Instances and views of each scene; the castle's instances are given.
INSTANCES: Final = {"mountains": 20_000, "city": 20_000, "room": 2_000, "hedge": 2_000}
VIEWS: Final = {"mountains": 6, "city": 8, "room": 6, "castle": 10}
SIZE: Final = (360, 640)


@dataclass(frozen=True)
class Found:
    """What was found in one scene."""

    key: str
    name: str
    groups: int
    views: int
    size: Size
    cut: list[Row] = field(default_factory=list)
    proxies: list[Proxies] = field(default_factory=list)


@dataclass
class Report(frame.Run):
    """A run over all scenes."""

    scenes: list[Found] = field(default_factory=list)

    @property
    def passed(self) -> bool:
        """Whether something was measured."""
        return bool(self.scenes)

    def page(self) -> Page:
        """The tables."""
        page = Page(PROG)
        page.items(*self.opening())
        page.heading("Fewer occluders")
        page.text(
            "The part of the hidden instances that stay hidden when only a share of the triangles "
            "in view is drawn."
        )
        page.table(f"scene | ranking | {' | '.join(_part(s) for s in SHARES)}", cuts(self), left=2)
        page.heading("Simpler occluders")
        page.text("The same when proxies inside of the meshes are drawn in their stead.")
        page.table("scene | proxies | triangles | drawn | hiding kept", proxies(self), left=2)
        return page


def _part(share: float) -> str:
    return f"1/{1.0 / share:.0f}"


def cuts(found: Report) -> list[list[str]]:
    """The rows of the table of rankings."""
    return [
        [scene.key, row.label, *(f"{100.0 * row.share(share):.1f} %" for share in SHARES)]
        for scene in found.scenes
        for row in scene.cut
    ]


def proxies(found: Report) -> list[list[str]]:
    """The rows of the table of proxies."""
    return [
        [scene.key, one.label, f"{one.triangles:,}", f"{one.drawn:,}", f"{100.0 * one.share:.1f} %"]
        for scene in found.scenes
        for one in scene.proxies
    ]


def run(
    out: Path,
    *,
    keys: Sequence[str] = NAMES,
    castle: Path | None = None,
    seed: int = 2010,
    instances: int | None = None,
    views: int | None = None,
    command: str = PROG,
) -> Report:
    """Leaves report.md and report.json in `out`.

    Parameters
    ----------
    out : Path
        A folder; made if it is not there.
    keys : sequence of str
        Of `NAMES`.
    castle : Path, optional
        The castle's file.
    seed : int
        Same seed, same scenes.
    instances, views : int, optional
        For every scene.
    command : str
        The command that the report names.

    Raises
    ------
    hizvk.HizError
        What the device refuses.
    """
    device = Device()
    found = Report(command=command, seed=seed, adapter=device.adapter)

    def measure(key: str, _: Progress) -> None:
        found.scenes.append(_measure(device, key, castle, seed, instances, views))

    found.over(out, keys, measure, prog=PROG)
    report.write(out, found.as_data(), found.page())
    return found


def _measure(
    device: Device,
    key: str,
    castle: Path | None,
    seed: int,
    instances: int | None,
    views: int | None,
) -> Found:
    things, eyes = instances or INSTANCES.get(key, 4_000), views or VIEWS.get(key, 4)
    scene, groups, proxies = made_with_groups(key, things, eyes, seed, castle)
    stage = Stage(device, scene, groups, SIZE)
    return Found(
        key=key,
        name=scene.name,
        groups=len(groups),
        views=len(scene.views),
        size=SIZE,
        cut=cut(stage),
        proxies=[replaced(stage, label, [mesh]) for label, mesh in proxies.items()],
    )


def made_with_groups(
    key: str, things: int, eyes: int, seed: int, castle: Path | None
) -> tuple[Scene, Groups, dict[str, Mesh]]:
    """A scene, its occluders in groups, and what may be drawn in their stead."""
    if key == "hedge":
        made = hedge(things, eyes, seed=seed)
        return made.scene, groups_of(made.scene, made.offsets), {}
    if key == "village":
        scene = village(36, things, eyes, seed=seed)
        prisms = inner_prisms(scene.vertices, scene.triangles, up=(0, 0, 1))
        return scene, _alike(scene, 36), {"`inner_prisms`": prisms.mesh}
    if key == "boulders":
        rocks = boulders(25, things, eyes, seed=seed)
        inner = [inner_boxes(*rocks.mesh(k)).boxes for k in range(rocks.count)]
        boxes = box_mesh(
            np.concatenate([one.min for one in inner]), np.concatenate([one.max for one in inner])
        )
        return rocks.scene, _alike(rocks.scene, rocks.count), {"`inner_boxes`": Mesh(*boxes)}
    scene = catalogue.make(key, things, eyes, seed, castle).scene
    return scene, _split(scene, CELLS[key]), {}


def _split(scene: Scene, cell: float) -> Groups:
    """The occluders in groups that fit a cube of side `cell`."""
    found = split_mesh(scene.vertices, scene.triangles, cell=cell)
    return Groups(found.vertices, found.triangles, found.offsets, found.boxes)


def _alike(scene: Scene, count: int) -> Groups:
    """The occluders in `count` objects of the same number of triangles."""
    return groups_of(scene, np.linspace(0, len(scene.triangles), count + 1).astype(np.intp))


def groups_of(scene: Scene, offsets: npt.NDArray[np.intp]) -> Groups:
    """The occluders in objects as they come."""
    corners = scene.vertices[scene.triangles]
    low = np.minimum.reduceat(corners.min(axis=1), offsets[:-1])
    high = np.maximum.reduceat(corners.max(axis=1), offsets[:-1])
    return Groups(scene.vertices, scene.triangles, offsets, Boxes(low, high))


def main(arguments: Sequence[str]) -> int:
    """Runs the command; exit code 1: it cannot run."""
    parser = frame.parser(
        PROG,
        "What is lost when fewer or simpler occluders are drawn: rankings at 1/2, 1/4 and 1/8 of "
        "the triangles in view, and boxes and prisms inside of meshes.",
        out="out/bench-occluders",
        holds="report",
        names=NAMES,
        seed=2010,
    )
    frame.add_castle(parser)
    options = vars(parser.parse_args(list(arguments)))
    return frame.execute(PROG, run, options, arguments, frame.print_page)
