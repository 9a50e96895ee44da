"""Occluders that move: a corridor of rooms whose doors open and close, and a bus that drives by.

- The rooms to the south have hinged doors, and those to the north have sliding ones.
- The bus drives along the street north of the building, before people on the far pavement.

What a door or the bus hides in one frame shows in another.
So an occluder that stays behind when its mesh moves hides what can be seen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from ..mesh import Mesh
from .grid import on_grid
from .scene import Scene, View, box_mesh

if TYPE_CHECKING:
    import numpy.typing as npt

    from .grid import Floats

__all__ = ["Doors", "Mover", "doors"]

#: Rooms on each side of the corridor, and the sides of one in metres.
ROOMS: Final = 6
ROOM: Final = 4.0
#: Half the width of the corridor, the thickness of walls and door leaves, and heights, in metres.
HALF: Final = 1.0
WALL: Final = 0.25
LEAF: Final = 0.0625
HEIGHT: Final = 3.0
#: Width and height of a doorway.
DOOR: Final = (1.0, 2.25)
#: Degrees by which a hinged door opens.
SWING_DEG: Final = 100.0
#: The bus: half its length, where it drives, and its height; and where people stand behind it.
BUS: Final = (6.0, 8.0, 10.5, 3.0)
PAVEMENT: Final = (12.0, 15.0)


@dataclass(frozen=True, eq=False)
class Mover:
    """A mesh whose copies stand elsewhere in every frame."""

    vertices: Floats
    """``(V, 3)``: in the mesh's own space."""
    triangles: npt.NDArray[np.uint32]
    """``(T, 3)``."""
    transforms: Floats
    """``(F, K, 4, 4)``: ``world_from_mesh`` of each of the K copies in each of the F frames."""

    def __len__(self) -> int:
        """The number of frames."""
        return len(self.transforms)

    def placed(self, frame: int) -> tuple[Floats, npt.NDArray[np.uint32]]:
        """World vertices ``(K V, 3)`` and triangles ``(K T, 3)`` of all copies, in float64."""
        matrices = self.transforms[frame]
        turned = np.einsum("kij,vj->kvi", matrices[:, :3, :3], self.vertices)
        vertices = (turned + matrices[:, None, :3, 3]).reshape(-1, 3)
        first = len(self.vertices) * np.arange(len(matrices))[:, None, None]
        return vertices, (self.triangles + first).reshape(-1, 3).astype(np.uint32)


@dataclass(frozen=True, eq=False)
class Doors:
    """A scene whose occluders move; its views and instances stay."""

    scene: Scene
    """Its occluders are those that never move."""
    movers: tuple[Mover, ...]
    """The hinged doors, the sliding doors, and the bus."""

    def __len__(self) -> int:
        """The number of frames."""
        return len(self.movers[0])

    def meshes(self, frame: int) -> list[Mesh]:
        """What is uploaded: the mesh that never moves, and each of the movers after it."""
        return [
            Mesh(self.scene.vertices, self.scene.triangles),
            *(Mesh(one.vertices, one.triangles, one.transforms[frame]) for one in self.movers),
        ]

    def at(self, frame: int) -> Scene:
        """The scene in one frame, with the triangles of the movers among the occluders."""
        vertices, triangles = [self.scene.vertices], [self.scene.triangles]
        first = len(self.scene.vertices)
        for mover in self.movers:
            corners, faces = mover.placed(frame)
            vertices.append(corners)
            triangles.append(faces + np.uint32(first))
            first += len(corners)
        return replace(
            self.scene,
            vertices=np.concatenate(vertices),
            triangles=np.concatenate(triangles).astype(np.uint32),
        )


def doors(things: int = 600, frames: int = 60, *, seed: int = 2012) -> Doors:
    """Twelve rooms on a corridor with a door each, and a street with a bus; four views.

    Parameters
    ----------
    things : int
        Instances: two thirds are crates in the rooms, and the others stand behind the street.
    frames : int
        The doors open and close once and the bus drives by once.
    seed : int
        Same seed, same scene.
    """
    rng = np.random.default_rng(seed)
    low, high = _walls()
    vertices, triangles = box_mesh(low, high)
    least, size = _things(rng, things)
    shape, faces = box_mesh(least, least + size)
    end = ROOMS * ROOM
    views = (
        View("along the corridor", (0.5, -0.75, 1.75), (12.0, 2.0, 1.0), 60.0, 0.0625),
        View("hinged doors", (10.25, 0.75, 1.75), (9.75, -5.0, 1.0), 75.0, 0.0625),
        View("sliding doors", (13.75, -0.75, 1.75), (14.25, 5.0, 1.0), 75.0, 0.0625),
        View("the street", (12.0, 6.25, 1.75), (12.5, 14.0, 1.25), 75.0, 0.0625),
    )
    scene = Scene(
        name=f"a corridor of {2 * ROOMS} rooms with doors, and a street with a bus",
        origin=(end / 2.0, 0.0, 0.0),
        vertices=vertices,
        triangles=triangles,
        instance_vertices=shape,
        instance_triangles=faces,
        owner=np.repeat(np.arange(things, dtype=np.int32), 12),
        box_min=least,
        box_max=least + size,
        views=views,
    )
    return Doors(scene, (*_leaves(rng, frames), _bus(frames)))


def _doorways() -> Floats:
    """``(ROOMS,)``: where each doorway begins along the corridor."""
    begins: Floats = np.arange(ROOMS, dtype=np.float64) * ROOM + (ROOM - DOOR[0]) / 2.0
    return begins


def _walls() -> tuple[Floats, Floats]:
    """Corners of the boxes that never move: floor, ceiling, walls, and lintels above the doors."""
    end, outer = ROOMS * ROOM, HALF + WALL + ROOM
    boxes = [
        (-40.0, -outer - WALL, -WALL, end + 40.0, 20.0, 0.0),  # the ground
        (0.0, -outer, HEIGHT, end, outer, HEIGHT + WALL),
        (-WALL, -outer, 0.0, 0.0, outer, HEIGHT),
        (end, -outer, 0.0, end + WALL, outer, HEIGHT),
        (-WALL, outer, 0.0, end + WALL, outer + WALL, HEIGHT),
        (-WALL, -outer - WALL, 0.0, end + WALL, -outer, HEIGHT),
    ]
    for near, far in ((HALF, HALF + WALL), (-HALF - WALL, -HALF)):
        left = 0.0
        for x in _doorways():
            boxes.append((left, near, 0.0, x, far, HEIGHT))
            boxes.append((x, near, DOOR[1], x + DOOR[0], far, HEIGHT))
            left = x + DOOR[0]
        boxes.append((left, near, 0.0, end, far, HEIGHT))
    for x in ROOM * np.arange(1, ROOMS):
        boxes.append((x - WALL / 2.0, HALF + WALL, 0.0, x + WALL / 2.0, outer, HEIGHT))
        boxes.append((x - WALL / 2.0, -outer, 0.0, x + WALL / 2.0, -HALF - WALL, HEIGHT))
    corners = on_grid(boxes)
    return corners[:, :3], corners[:, 3:]


def _things(rng: np.random.Generator, count: int) -> tuple[Floats, Floats]:
    """The least corners and the sizes of the instances, none of which meets a wall or a door."""
    inside = 2 * count // 3
    size = on_grid(rng.uniform(0.2, 0.6, (count, 3)))
    least = np.zeros((count, 3))
    side = rng.choice([-1.0, 1.0], inside)
    # A hinged door, in the south, sweeps 1 m of its room.
    door = np.where(side > 0.0, LEAF + 0.0625, DOOR[0] + 2.0 * LEAF)
    away = rng.uniform(HALF + WALL + door, HALF + WALL + ROOM - 0.7)
    room = rng.integers(0, ROOMS, inside)
    least[:inside, 0] = room * ROOM + rng.uniform(WALL, ROOM - WALL - 0.7, inside)
    least[:inside, 1] = np.where(side > 0.0, away, -away - 0.6)
    least[inside:, 0] = rng.uniform(-4.0, ROOMS * ROOM + 4.0, count - inside)
    least[inside:, 1] = rng.uniform(*PAVEMENT, count - inside)
    least[:, 2] = rng.uniform(0.0, 1.5, count)
    return on_grid(least), size


def _leaves(rng: np.random.Generator, frames: int) -> tuple[Mover, Mover]:
    """The hinged doors and the sliding doors; closed ones fill their doorways exactly."""
    begins = _doorways()
    time = np.arange(frames)[:, None] / frames
    # Each door is shut for about half of the time, at times of its own.
    turn = 2.0 * np.pi * (time + rng.uniform(0.0, 1.0, (2, 1, ROOMS)))
    hinged, sliding = np.clip(1.5 * np.sin(turn), 0.0, 1.0)
    shape, faces = box_mesh([[0.0, -LEAF, 0.0]], [[DOOR[0], 0.0, DOOR[1]]])
    swung = np.tile(np.eye(4), (frames, ROOMS, 1, 1))
    angle = np.radians(-SWING_DEG * hinged)
    swung[..., 0, 0] = swung[..., 1, 1] = np.cos(angle)
    swung[..., 0, 1], swung[..., 1, 0] = -np.sin(angle), np.sin(angle)
    swung[..., 0, 3], swung[..., 1, 3] = begins, -HALF
    slid = np.tile(np.eye(4), (frames, ROOMS, 1, 1))
    slid[..., 0, 3], slid[..., 1, 3] = begins + DOOR[0] * sliding, HALF + WALL + LEAF
    return Mover(shape, faces, swung), Mover(shape, faces, slid)


def _bus(frames: int) -> Mover:
    """The bus, which comes from the left of the street's view and leaves to the right."""
    half, near, far, height = BUS
    shape, faces = box_mesh([[-half, near, 0.0]], [[half, far, height]])
    places = np.tile(np.eye(4), (frames, 1, 1, 1))
    places[:, 0, 0, 3] = on_grid(np.linspace(-12.0, ROOMS * ROOM + 12.0, frames))
    return Mover(shape, faces, places)
