"""What a process that runs blocks keeps from one to the next, and how it runs a block.

A process opens one device, at its first block, and uploads each scene once.
Threads of the process share both.

The scene does not come with every block.
A process that does not have it sends the block back (`Answer.rows` is None), and the block then
comes once more with the scene, or with a reference to it (`blocks`).
So nothing has to be known of the executor: which workers there are, how they start, and when.
"""

from __future__ import annotations

import threading
import uuid
from collections import OrderedDict
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .._processes import per_process
from ..device import Device
from ..oneline import default_device
from ..options import Outputs
from .spool import Reference

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    import numpy.typing as npt

    from ..camera import Camera
    from ..options import CullOptions
    from ..resources import Instances, Occluders, Pyramid
    from ..result import CullResult
    from .scene import SceneData

__all__ = ["Answer", "Block", "Task", "cull_block", "offered"]

#: Scenes that a process keeps on its device.
SCENES_KEPT: Final = 2
#: Culls whose masks are not read yet: the device works on one while the host draws the next depth.
IN_FLIGHT: Final = 2
_MASK: Final = Outputs(mask=True, verdicts=False)


@dataclass(frozen=True)
class Task:
    """What all blocks of a sweep have in common; it is small."""

    digest: str
    """Of the scene."""
    options: CullOptions
    adapter: str | int | None = None
    """Which adapter a process opens, as in `Device`."""
    render: Mapping[str, Any] = field(default_factory=dict)
    """Keywords of `Device.render_depth`."""
    meaning: Mapping[str, Any] = field(default_factory=dict)
    """Keywords of `Device.pyramid`: what the numbers of depth arrays are."""
    spool: Reference | None = None
    """Where the scene can be had on machines that see the folder; None: in this process."""
    depth_of: Callable[[int], Any] | None = None
    """Makes the depth array of a view; None if the occluders are drawn, or arrays come along."""


@dataclass(frozen=True)
class Block:
    """Some views of a sweep."""

    number: int
    views: range
    cameras: tuple[Camera, ...]
    images: tuple[Any, ...] | None = None
    """The depth arrays of these views, if they come along."""
    attempt: int = 0
    """How often it was sent before: some executors remember the answer of equal calls."""


@dataclass(frozen=True, eq=False)
class Answer:
    """What came of a block."""

    worker: str
    """Names the process."""
    number: int
    """Of the block."""
    rows: npt.NDArray[np.uint8] | None
    """``(views, ceil(N / 8))``: the bits of each view; None: the process lacks the scene."""
    sees_spool: bool = False
    """Whether a process that lacks the scene can read it from `Task.spool`."""


class _Place:
    """What one process keeps."""

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.name = uuid.uuid4().hex
        self.devices: dict[str | int, Device] = {}
        self.scenes: OrderedDict[tuple[str, str | int | None], tuple[Instances, Occluders | None]]
        self.scenes = OrderedDict()

    def device(self, adapter: str | int | None) -> Device:
        if adapter is None:
            return default_device()
        if adapter not in self.devices:
            self.devices[adapter] = Device(adapter)
        return self.devices[adapter]

    def resident(self, task: Task, scene: SceneData | Reference | None) -> _Resident | None:
        """The scene on the device, uploaded if it came along; None if it is not here."""
        key = task.digest, task.adapter
        with self.lock:
            if key not in self.scenes:
                scene = scene or _offers.get(task.digest)
                if scene is None:
                    return None
                if isinstance(scene, Reference):
                    scene = scene.load()
                device = self.device(task.adapter)
                walls = None
                if scene.meshes is not None:
                    walls = device.occluders(list(scene.meshes), cull=scene.faces)
                self.scenes[key] = device.instances(scene.bounds), walls
                while len(self.scenes) > SCENES_KEPT:
                    self.scenes.popitem(last=False)
            self.scenes.move_to_end(key)
            return _Resident(self.device(task.adapter), *self.scenes[key])


@dataclass(frozen=True)
class _Resident:
    """A scene on the device of this process."""

    device: Device
    instances: Instances
    walls: Occluders | None

    def pyramid(self, task: Task, block: Block, k: int) -> Pyramid:
        """The pyramid of the block's view k."""
        camera = block.cameras[k]
        if self.walls is not None:
            return self.device.pyramid(self.device.render_depth(self.walls, camera, **task.render))
        view = block.views[k]
        if block.images is not None:
            image = block.images[k]
        else:
            assert task.depth_of is not None
            image = task.depth_of(view)
        try:
            return self.device.pyramid(image, camera, **task.meaning)
        except (TypeError, ValueError) as error:
            raise type(error)(f"depths[{view}]: {error}") from None


_places: dict[int, _Place] = {}
#: Scenes of sweeps that run in this process: blocks in its threads need no copy of them.
_offers: dict[str, SceneData] = {}


@contextmanager
def offered(scene: SceneData) -> Iterator[None]:
    """Lets blocks that run in this process find the scene here."""
    _offers[scene.digest] = scene
    try:
        yield
    finally:
        _offers.pop(scene.digest, None)


def cull_block(task: Task, block: Block, scene: SceneData | Reference | None = None) -> Answer:
    """Culls the views of a block; this is what executors run."""
    place = per_process(_places, _Place)
    here = place.resident(task, scene)
    if here is None:
        return Answer(
            place.name, block.number, None, task.spool is not None and task.spool.is_here()
        )
    rows = np.zeros((len(block.views), -(-len(here.instances) // 8)), np.uint8)
    waiting: list[tuple[int, CullResult]] = []

    def read() -> None:
        k, seen = waiting.pop(0)
        rows[k] = np.packbits(seen.mask, bitorder="little")

    for k in range(len(block.views)):
        pyramid = here.pyramid(task, block, k)
        seen = here.device.cull(
            here.instances, pyramid.camera, pyramid, task.options, _MASK, wait=False
        )
        waiting.append((k, seen))
        if len(waiting) == IN_FLIGHT:
            read()
    while waiting:
        read()
    return Answer(place.name, block.number, rows)
