"""The case where ranking occluders by size and distance fails.

Moller and Haines, *Real-Time Rendering* (1999), end their section on occlusion culling with it:
many small occluders hide a scene together, and none of them would be chosen alone.

- A wall of small bricks stands in front of all instances, and hides them.
- Rocks that are larger and nearer stand beside it, with nothing behind them.
- A lattice mast with the largest box of all is seen through.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from .boulders import boulder
from .grid import on_grid
from .scene import Scene, View, box_mesh

if TYPE_CHECKING:
    import numpy.typing as npt

    from .grid import Floats

__all__ = ["Hedge", "hedge"]

#: Bricks along the wall and up, and the size of one in metres.
ROWS: Final = (48, 14)
BRICK: Final = (0.625, 0.25, 0.25)
#: The wall's distance from the eye; y is forward, z is up.
WALL: Final = 12.0
#: Middles and radii of the rocks.
ROCKS: Final = ((-6.5, 7.0, 1.0, 2.0), (6.5, 7.0, 1.0, 2.0), (-10.5, 11.0, 1.5, 2.5))
#: Where the mast stands, its side, its height, how many bays it has, and its bars' width.
MAST: Final = (0.0, 6.0, 2.0, 6.0, 16, 0.03125)
EYE: Final = 1.703125


@dataclass(frozen=True)
class Hedge:
    """A scene, and which of its occluders' triangles make one object."""

    scene: Scene
    offsets: npt.NDArray[np.intp]
    """``(O + 1,)``: object o has the triangles ``offsets[o]`` to before ``offsets[o + 1]``."""
    bricks: int
    """The first so many objects are the bricks; three rocks and the mast follow."""

    def meshes(self) -> list[tuple[Floats, npt.NDArray[np.uint32]]]:
        """Vertices and triangles of each object."""
        found = []
        for begin, end in zip(self.offsets[:-1], self.offsets[1:], strict=True):
            triangles = self.scene.triangles[begin:end]
            first, last = int(triangles.min()), int(triangles.max()) + 1
            found.append((self.scene.vertices[first:last], triangles - np.uint32(first)))
        return found


def hedge(things: int = 2000, views: int = 4, *, seed: int = 1999) -> Hedge:
    """A wall of 672 bricks hides all things; three rocks and a mast are nearer, and hide nothing.

    Parameters
    ----------
    things : int
        Instances: boxes of 0.2 to 0.6 m behind the middle of the wall.
    views : int
        Eyes in front of the wall, up to 1 m to the sides.
    seed : int
        Same seed, same things.
    """
    rng = np.random.default_rng(seed)
    along, up = np.meshgrid(np.arange(ROWS[0]), np.arange(ROWS[1]), indexing="ij")
    # Every second row is moved by half a brick, which is a multiple of 1/64 m.
    x = (along - ROWS[0] / 2 + 0.5 * (up % 2)) * BRICK[0]
    low = np.stack([x, np.full_like(x, WALL), up * BRICK[2]], axis=-1).reshape(-1, 3)
    objects = [box_mesh([one], [one + BRICK]) for one in on_grid(low)]
    bricks = len(objects)
    for *middle, radius in ROCKS:
        vertices, triangles = boulder(rng)
        objects.append((on_grid(vertices * radius + middle), triangles))
    objects.append(_mast(*MAST))
    sides = np.cumsum([0, *(len(vertices) for vertices, _ in objects)])
    triangles = np.concatenate(
        [faces + np.uint32(first) for (_, faces), first in zip(objects, sides[:-1], strict=True)]
    )
    # Within the shadow of the wall's middle half, and low enough for its height.
    y = rng.uniform(WALL + 2.0, 40.0, things)
    low = np.stack([rng.uniform(-0.4, 0.4, things) * y, y, np.zeros(things)], axis=1)
    low = on_grid(low)
    high = low + on_grid(rng.uniform(0.2, 0.6, (things, 3)))
    shape, faces = box_mesh(low, high)
    eyes = []
    for number, x0 in enumerate(np.linspace(-1.0, 1.0, views)):
        eye = tuple(on_grid([x0, 0.0, EYE]).tolist())
        eyes.append(View(f"place {number}", eye, (x0, 10.0, EYE), 60.0, 0.125))
    return Hedge(
        scene=Scene(
            name=f"a wall of {bricks} bricks, three rocks and a mast",
            origin=(0.0, WALL, 0.0),
            vertices=np.concatenate([vertices for vertices, _ in objects]),
            triangles=triangles.astype(np.uint32),
            instance_vertices=shape,
            instance_triangles=faces,
            owner=np.repeat(np.arange(things, dtype=np.int32), 12),
            box_min=low,
            box_max=high,
            views=tuple(eyes),
        ),
        offsets=np.cumsum([0, *(len(faces) for _, faces in objects)]),
        bricks=bricks,
    )


def _mast(
    x: float, y: float, side: float, height: float, bays: int, bar: float
) -> tuple[Floats, npt.NDArray[np.uint32]]:
    """Four posts, and in every bay four bars: thin boxes."""
    low, high = [], []
    ends = (-side / 2.0, side / 2.0 - bar)
    for a in ends:
        for b in ends:
            low.append((x + a, y + b, 0.0))
            high.append((x + a + bar, y + b + bar, height))
    for bay in range(1, bays + 1):
        z = bay * height / bays - bar
        for end in ends:
            low += [(x - side / 2.0, y + end, z), (x + end, y - side / 2.0, z)]
            high += [
                (x + side / 2.0, y + end + bar, z + bar),
                (x + end + bar, y + side / 2.0, z + bar),
            ]
    return box_mesh(on_grid(low), on_grid(high))
