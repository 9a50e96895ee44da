"""Scenes of about a chosen number of triangles: an office building, boulders and mountains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

import hizvk
from hizvk.scenes import Terrain, elevation, mountains
from hizvk.scenes.boulders import boulders
from hizvk.scenes.scene import View, box_mesh

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from hizvk.scenes.grid import Floats

__all__ = ["SCENES", "Crowded", "building", "rocks", "terrain"]

#: A module of the building: side and height in metres, and what stands in it.
SIDE: Final = 6.0
HEIGHT: Final = 3.0
DESKS: Final = 8
#: Steps along each edge of a desk's top: finely cut, as models of the text's kind are.
STEPS: Final = 5


@dataclass(frozen=True)
class Crowded:
    """Meshes, and eyes among them."""

    name: str
    meshes: list[hizvk.Mesh]
    views: tuple[View, ...]


def building(triangles: int, views: int = 6, *, seed: int = 1993) -> Crowded:
    """One furnished module, repeated along three axes like that of the text.

    Walls have doors, so that a view goes through a few rooms and no further.
    """
    rng = np.random.default_rng(seed)
    vertices, faces = _module(rng)
    count = max(triangles // len(faces), 1)
    floors = max(round((count / 4.0) ** (1.0 / 3.0)), 1)
    across = max(round((count / floors) ** 0.5), 1)
    # Every module is turned by a multiple of 90 degrees about its middle.
    cells = np.stack(np.meshgrid(*map(np.arange, (across, across, floors)), indexing="ij"), -1)
    places = cells.reshape(-1, 3) * (SIDE, SIDE, HEIGHT)
    quarter = rng.integers(0, 4, len(places))
    turned = np.zeros((len(places), 4, 4))
    cos, sin = np.array([1, 0, -1, 0])[quarter], np.array([0, 1, 0, -1])[quarter]
    turned[:, 0, 0], turned[:, 0, 1], turned[:, 1, 0], turned[:, 1, 1] = cos, -sin, sin, cos
    turned[:, 2, 2] = turned[:, 3, 3] = 1.0
    turned[:, :3, 3] = places
    eyes = []
    for number in range(views):
        cell = rng.integers(0, (across, across, floors))
        eye = cell * (SIDE, SIDE, HEIGHT) + np.array([0.3, 0.2, 1.7])
        heading = rng.uniform(0.0, 2.0 * np.pi)
        target = eye + np.array([np.cos(heading), np.sin(heading), 0.0])
        eyes.append(View(f"room {number}", tuple(eye), tuple(target), 70.0, 0.05))
    return Crowded("building", [hizvk.Mesh(vertices, faces, turned)], tuple(eyes))


def _module(rng: np.random.Generator) -> tuple[Floats, npt.NDArray[np.uint32]]:
    """Floor, four walls with a door in each, and desks, about the middle of the floor."""
    half, thin = SIDE / 2.0, 0.1
    low, high = [[-half, -half, -0.1]], [[half, half, 0.0]]
    for along in (-1, 1):
        # A door of 1 m in the middle of the wall at x = +-half, and of the one at y = +-half.
        for first, last in ((-half, -0.5), (0.5, half)):
            low.append([along * half - thin, first, 0.0])
            high.append([along * half + thin, last, HEIGHT - 0.1])
            low.append([first, along * half - thin, 0.0])
            high.append([last, along * half + thin, HEIGHT - 0.1])
    vertices, faces = box_mesh(np.array(low), np.array(high))
    parts, numbers = [vertices], [faces]
    for _ in range(DESKS):
        shape, one = _desk()
        middle = rng.uniform(-half + 0.8, half - 0.8, 2)
        numbers.append(one + np.uint32(sum(map(len, parts))))
        parts.append(shape + np.append(middle, 0.0))
    return np.concatenate(parts), np.concatenate(numbers)


def _desk() -> tuple[Floats, npt.NDArray[np.uint32]]:
    """A box whose faces are cut into squares."""
    along = np.arange(STEPS + 1) / STEPS - 0.5
    u, v = np.meshgrid(along, along, indexing="ij")
    number = np.arange(u.size).reshape(u.shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    square = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    parts: list[Floats] = []
    faces: list[npt.NDArray[np.intp]] = []
    for axis in range(3):
        for side in (-0.5, 0.5):
            point = np.stack([np.full_like(u, side), u, v], axis=-1).reshape(-1, 3)
            faces.append((square if side > 0 else square[:, ::-1]) + u.size * len(parts))
            parts.append(np.roll(point, axis, axis=1))
    shape = (np.concatenate(parts) + np.array([0.0, 0.0, 0.5])) * (1.2, 0.8, 0.75)
    return shape, np.concatenate(faces).astype(np.uint32)


def rocks(triangles: int, views: int = 6) -> Crowded:
    """Boulders of 4,800 triangles each in rows."""
    made = boulders(max(triangles // 4800, 1), 16, views).scene
    return Crowded("boulders", [hizvk.Mesh(made.vertices, made.triangles)], made.views)


def terrain(triangles: int, views: int = 6) -> Crowded:
    """The mountains of the demo; more triangles come from cutting the squares of the model."""
    given = elevation()
    scene = mountains(1, views)
    heights = given.heights
    rows, columns = heights.shape
    factor = max((triangles / (2.0 * (rows - 1) * (columns - 1))) ** 0.5, 1.0)
    new_rows, new_columns = round((rows - 1) * factor) + 1, round((columns - 1) * factor) + 1
    y, x = np.linspace(0, rows - 1, new_rows), np.linspace(0, columns - 1, new_columns)
    finer = np.stack([np.interp(x, np.arange(columns), row) for row in heights])
    finer = np.stack([np.interp(y, np.arange(rows), column) for column in finer.T], axis=1)
    step = given.step[0] * x[1], given.step[1] * y[1]
    vertices, faces = Terrain(finer, step, given.corner).mesh()
    return Crowded("mountains", [hizvk.Mesh(vertices, faces)], scene.views)


#: By name: a function of the number of triangles and of views.
SCENES: Final[dict[str, Callable[[int, int], Crowded]]] = {
    "building": building,
    "boulders": rocks,
    "mountains": terrain,
}
