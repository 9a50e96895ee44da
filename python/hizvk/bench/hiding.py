"""How much of the hiding is left when fewer or simpler occluders are drawn.

A row of the report is a `Way` to make a view's depth image within a budget of triangles.
`Ranked` is the way of all rankings: groups in view are drawn in the order of their worth.
`Limited` leaves the choice to the library, for each view and by clusters of triangles.
Another ranking is one more entry of `WAYS`, and so is a way that makes its images by itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, Protocol, TypeAlias

import numpy as np

from ..bounds import Boxes
from ..explanation import Verdict
from ..mesh import Mesh
from ..occluders import select_occluders

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt

    from .._arguments import Size
    from ..device import Device
    from ..resources import DepthImage
    from ..scenes import Scene, View

    _Worth: TypeAlias = npt.NDArray[np.floating]
    #: From a view's number and a budget of triangles to its depth image.
    _Draw: TypeAlias = Callable[[int, int], DepthImage]

__all__ = [
    "SHARES",
    "WAYS",
    "Groups",
    "Limited",
    "Proxies",
    "Ranked",
    "Row",
    "Stage",
    "Way",
    "cut",
    "replaced",
]

#: Parts of the triangles in view that are drawn.
SHARES: Final = (0.5, 0.25, 0.125)


@dataclass(frozen=True, eq=False)
class Groups:
    """The occluders of a scene as groups of triangles, each of which is drawn or left out."""

    vertices: npt.NDArray[np.floating]
    """``(V, 3)``."""
    triangles: npt.NDArray[np.uint32]
    """``(T, 3)``: group after group."""
    offsets: npt.NDArray[np.intp]
    """``(G + 1,)``: where each group begins in `triangles`."""
    boxes: Boxes
    """The bounds of each group."""

    def __len__(self) -> int:
        """The number of groups."""
        return len(self.offsets) - 1

    @property
    def sizes(self) -> npt.NDArray[np.intp]:
        """``(G,)``: the triangles of each group."""
        return np.diff(self.offsets)

    def mesh(self, mask: npt.NDArray[np.bool_]) -> Mesh:
        """The groups of `mask` as one mesh."""
        return Mesh(self.vertices, self.triangles[np.repeat(mask, self.sizes)])

    def meshes(self) -> list[Mesh]:
        """Each group as a mesh of its own."""
        found = []
        for begin, end in zip(self.offsets[:-1], self.offsets[1:], strict=True):
            used, corners = np.unique(self.triangles[begin:end], return_inverse=True)
            found.append(Mesh(self.vertices[used], corners.reshape(-1, 3)))
        return found


class Stage:
    """A scene on the device, with what is hidden by all of its occluders.

    Parameters
    ----------
    device : Device
        Where.
    scene : Scene
        Its instances and views.
    groups : Groups
        Its occluders.
    size : (height, width)
        Of the depth images.
    """

    def __init__(self, device: Device, scene: Scene, groups: Groups, size: Size) -> None:
        self.device, self.scene, self.groups, self.size = device, scene, groups, size
        self.cameras = [view.camera(size) for view in scene.views]
        self._instances = device.instances(Boxes(scene.box_min, scene.box_max))
        bounds = device.instances(groups.boxes)
        #: ``(G,)`` for each view: groups that are not surely outside of it.
        self.in_view = []
        for camera in self.cameras:
            far = np.zeros(size, np.float32)  # reversed Z
            seen = device.cull(bounds, camera, device.pyramid(far, camera, kind="reversed_ndc"))
            self.in_view.append(seen.verdicts != Verdict.OUTSIDE)
        whole = device.occluders([groups.mesh(np.ones(len(groups), dtype=bool))])
        self.hidden = [self.hides(device.render_depth(whole, camera)) for camera in self.cameras]

    def hides(self, depth: DepthImage) -> int:
        """How many instances a depth image hides, by the rectangle test over all of its pixels."""
        pyramid = self.device.pyramid(depth)
        seen = self.device.cull(self._instances, depth.camera, pyramid, descent=4096)
        return int((seen.verdicts == Verdict.OCCLUDED).sum())

    def drawn(self, meshes: Sequence[Mesh], k: int) -> DepthImage:
        """The depth image of view `k` with these occluders."""
        return self.device.render_depth(self.device.occluders(list(meshes)), self.cameras[k])


class Way(Protocol):
    """Makes depth images of fewer triangles."""

    @property
    def label(self) -> str:
        """The row's name."""
        ...

    def start(self, stage: Stage) -> _Draw:
        """What makes the depth image of view `k` from at most `budget` triangles."""
        ...


@dataclass(frozen=True)
class Ranked:
    """Draws the groups in view in the order of their worth, as far as the budget goes."""

    label: str
    rank: Callable[[Stage], Callable[[View], _Worth]]
    """Is called once for a stage, and what it returns once for an image.

    The worth ``(G,)`` is larger for what is drawn first, and minus infinity for what never is."""

    def start(self, stage: Stage) -> _Draw:
        """What makes the depth image of view `k` from at most `budget` triangles."""
        worth_of = self.rank(stage)

        def draw(k: int, budget: int) -> DepthImage:
            worth = np.where(stage.in_view[k], worth_of(stage.scene.views[k]), -np.inf)
            ranked = np.argsort(-worth, kind="stable")
            spent = np.cumsum(stage.groups.sizes[ranked])
            chosen = np.zeros(len(worth), dtype=bool)
            chosen[ranked[(spent <= budget) & (worth[ranked] > -np.inf)]] = True
            return stage.drawn([stage.groups.mesh(chosen)], k)

        return draw


@dataclass(frozen=True)
class Limited:
    """Draws within `max_triangles` of `Device.render_depth`, by the rasteriser on the host.

    The view stands still, and each image is the last of `frames`.
    Clusters that were hidden in one frame make room for others in the next one.
    """

    label: str
    frames: int

    def start(self, stage: Stage) -> _Draw:
        """What makes the depth image of view `k` from at most `budget` triangles."""
        meshes = stage.groups.meshes()

        def draw(k: int, budget: int) -> DepthImage:
            # Occluders remember what was hidden, and no view and budget may learn from another.
            occluders = stage.device.occluders(meshes)
            for _ in range(self.frames):
                depth = stage.device.render_depth(
                    occluders, stage.cameras[k], rasteriser="host", max_triangles=budget
                )
            return depth

        return draw


def _world_area(stage: Stage) -> Callable[[View], _Worth]:
    """The area of all triangles of each group."""
    a, b, c = (stage.groups.vertices[stage.groups.triangles[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    worth: _Worth = np.add.reduceat(area, stage.groups.offsets[:-1])
    return lambda _: worth


def _selection(stage: Stage) -> Callable[[View], _Worth]:
    """The silhouette per triangle, without what `select_occluders` drops."""
    found = select_occluders(stage.groups.meshes())
    worth = np.full(len(stage.groups), -np.inf)
    worth[found.kept] = found.area[found.kept] / found.triangles[found.kept]
    return lambda _: worth


def _size_and_distance(stage: Stage) -> Callable[[View], _Worth]:
    """The diagonal of each group's box over its distance from the eye."""
    boxes = stage.groups.boxes
    low, high = (np.asarray(corner, np.float64) for corner in (boxes.min, boxes.max))
    diagonal = np.linalg.norm(high - low, axis=1)

    def worth(view: View) -> _Worth:
        outside = np.maximum(0.0, np.maximum(low - view.eye, view.eye - high))
        found: _Worth = diagonal / np.maximum(np.linalg.norm(outside, axis=1), view.near)
        return found

    return worth


#: The rows of the report.
WAYS: Final[tuple[Way, ...]] = (
    Ranked("world area, static", _world_area),
    Ranked("`select_occluders`, static", _selection),
    Ranked("size and distance of the box, per view", _size_and_distance),
    Limited("`max_triangles`, first frame", 1),
    Limited("`max_triangles`, second frame", 2),
)


@dataclass(frozen=True)
class Row:
    """What is left of the hiding with one way, summed over the views."""

    label: str
    triangles: int
    """In view, all occluders."""
    hidden: int
    """Instances that all occluders hide."""
    left: dict[float, int] = field(default_factory=dict)
    """By the share of the triangles that is drawn: instances that are still hidden."""

    def share(self, of_triangles: float) -> float:
        """The part of the hiding that is left, 0 to 1."""
        return self.left[of_triangles] / max(self.hidden, 1)


def cut(stage: Stage, ways: Sequence[Way] = WAYS, shares: Sequence[float] = SHARES) -> list[Row]:
    """What each way leaves of the hiding when only a share of the triangles in view is drawn."""
    sizes = stage.groups.sizes
    seen = [int(sizes[mask].sum()) for mask in stage.in_view]
    rows = []
    for way in ways:
        draw = way.start(stage)
        left = {
            share: sum(
                stage.hides(draw(k, int(share * triangles))) for k, triangles in enumerate(seen)
            )
            for share in shares
        }
        rows.append(Row(way.label, sum(seen), sum(stage.hidden), left))
    return rows


@dataclass(frozen=True)
class Proxies:
    """What is left of the hiding when proxies are drawn in the occluders' stead."""

    label: str
    triangles: int
    """Of all occluders."""
    drawn: int
    """Of all proxies."""
    hidden: int
    """Instances that the occluders hide, summed over the views."""
    left: int
    """Instances that the proxies hide."""

    @property
    def share(self) -> float:
        """The part of the hiding that is left, 0 to 1."""
        return self.left / max(self.hidden, 1)


def replaced(stage: Stage, label: str, proxies: Sequence[Mesh]) -> Proxies:
    """What `proxies` leave of the hiding."""
    views = range(len(stage.cameras))
    return Proxies(
        label=label,
        triangles=len(stage.groups.triangles),
        drawn=sum(len(one.triangles) for one in proxies),
        hidden=sum(stage.hidden),
        left=sum(stage.hides(stage.drawn(proxies, k)) for k in views),
    )
