"""Boulders of thousands of triangles: closed meshes, in whose stead a few boxes may be drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from .grid import on_grid
from .rows import Rows

if TYPE_CHECKING:
    import numpy.typing as npt

    from .grid import Floats
    from .scene import Scene

__all__ = ["Boulders", "boulder", "boulders"]

#: Metres from boulder to boulder.
PITCH: Final = 12.0
#: Steps along each edge of the cube from which a boulder is blown up; it has 12 of their squares
#: triangles.
STEPS: Final = 20
#: Waves on a boulder's surface, and their height as a share of its radius.
WAVES: Final = 6
BUMPS: Final = 0.12


@dataclass(frozen=True)
class Boulders:
    """A scene, and where each boulder's triangles are."""

    scene: Scene
    count: int
    """How many boulders there are; each has the same number of vertices and triangles, in a row."""

    def mesh(self, k: int) -> tuple[Floats, npt.NDArray[np.uint32]]:
        """Vertices and triangles of boulder `k`."""
        side = len(self.scene.vertices) // self.count
        each = len(self.scene.triangles) // self.count
        return self.scene.vertices[k * side : (k + 1) * side], self.scene.triangles[:each]


def boulders(count: int = 64, things: int = 4000, views: int = 8, *, seed: int = 2012) -> Boulders:
    """Boulders in rows hide things between them; views are at eye height.

    Parameters
    ----------
    count : int
        Boulders, rounded up to a square number; each is closed and has 4,800 triangles.
    things : int
        Instances: boxes of 0.2 to 1 m, up to 6 m above the ground, outside of the boulders.
    views : int
        Eyes between the boulders.
    seed : int
        Same seed, same scene.
    """
    rng = np.random.default_rng(seed)
    rows = Rows.of(count, PITCH)
    shapes, faces = [], []
    for number, place in enumerate(rows.middles):
        unit, triangles = boulder(rng)
        shape = unit * rng.uniform((3.0, 3.0, 2.5), (5.0, 5.0, 5.0))
        shapes.append(on_grid(shape + np.append(place, 1.0)))
        faces.append(triangles + np.uint32(number * len(unit)))
    # The corners of the rows are 8.5 m from the nearest middle.
    scene = rows.scene(
        rng,
        f"{len(shapes)} boulders",
        (np.concatenate(shapes), np.concatenate(faces)),
        things=things,
        beside=(-1.5, 0.5),
        up_to=6.0,
        sizes=(0.2, 1.0),
        views=views,
        called="between",
    )
    return Boulders(scene, len(shapes))


def boulder(rng: np.random.Generator) -> tuple[Floats, npt.NDArray[np.uint32]]:
    """Vertices and triangles of a closed lump of radius 1, give or take `BUMPS`."""
    unit, faces = _ball()
    radius = np.ones(len(unit))
    for _ in range(WAVES):
        radius += BUMPS / WAVES * np.sin(unit @ rng.normal(0.0, 3.0, 3) + rng.uniform(0.0, 6.0))
    return unit * radius[:, None], faces.astype(np.uint32)


def _ball() -> tuple[Floats, npt.NDArray[np.intp]]:
    """A cube of `STEPS` squares to each edge, blown up to a ball; front faces look outwards."""
    along = np.arange(STEPS + 1)
    u, v = np.meshgrid(along, along, indexing="ij")
    number = np.arange((STEPS + 1) ** 2).reshape(u.shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    square = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    points: list[npt.NDArray[np.intp]] = []
    faces: list[npt.NDArray[np.intp]] = []
    for axis in range(3):
        for end in (0, STEPS):
            # u, v and the axis are a right-handed frame.
            point = np.stack([np.full_like(u, end), u, v], axis=-1).reshape(-1, 3)
            points.append(np.roll(point, axis, axis=1))
            turned = square if end else square[:, ::-1]
            faces.append(turned + len(number.ravel()) * len(faces))
    # Squares share the points of the cube's edges.
    lattice, shared = np.unique(np.concatenate(points), axis=0, return_inverse=True)
    centred = 2.0 * lattice / STEPS - 1.0
    unit = centred / np.linalg.norm(centred, axis=1, keepdims=True)
    return unit, shared.reshape(-1)[np.concatenate(faces)]
