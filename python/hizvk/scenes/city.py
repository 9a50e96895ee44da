"""A street-level city from a seed: buildings hide cars, people, lamps, trees and balconies.

Streets run along x and y, `PITCH` metres apart.
The blocks between them are cut into lots with one building each.
All solids are boxes.
The boxes of street furniture are turned with it.
So an axis-aligned box, a sphere and an oriented box about a thing differ as they do in practice: a
lamp post is far thinner than its sphere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from .grid import on_grid
from .scene import Scene, View, box_mesh

if TYPE_CHECKING:
    import numpy.typing as npt

    from .grid import Floats

__all__ = ["city"]

#: Blocks per side, metres from street to street, and the width of a street.
BLOCKS: Final = 10
PITCH: Final = 80.0
STREET: Final = 16.0
#: Eyes are this high above the street, in metres.
EYE: Final = 1.703125


@dataclass(frozen=True)
class _Kind:
    """A kind of thing in the street: its share of all things, and its boxes.

    x runs along the thing, z is up, and the foot is at 0.
    """

    share: float
    parts: tuple[tuple[float, float, float, float, float, float], ...]


#: A car, a person, a lamp, a tree, a bin; in metres.
_STREET_KINDS: Final = (
    _Kind(0.25, ((-2.2, -0.9, 0.2, 2.2, 0.9, 0.9), (-1.1, -0.8, 0.9, 1.2, 0.8, 1.5))),
    _Kind(0.25, ((-0.15, -0.25, 0.0, 0.15, 0.25, 1.45), (-0.12, -0.1, 1.45, 0.12, 0.1, 1.72))),
    _Kind(0.10, ((-0.08, -0.08, 0.0, 0.08, 0.08, 7.0), (-0.08, -0.08, 7.0, 1.6, 0.08, 7.15))),
    _Kind(0.10, ((-0.2, -0.2, 0.0, 0.2, 0.2, 2.4), (-1.5, -1.5, 2.2, 1.5, 1.5, 6.0))),
    _Kind(0.10, ((-0.3, -0.3, 0.0, 0.3, 0.3, 1.0),)),
)
#: Along the wall, out of it, up.
_BALCONY: Final = ((-1.4, 0.0, 0.0, 1.4, 1.1, 1.1),)


@dataclass(frozen=True)
class City:
    """A scene, and how its instances are turned."""

    scene: Scene
    yaw: Floats
    """``(N,)``: the angle from the x axis to each instance's own, about z, in radians."""


def city(
    things: int = 20_000,
    views: int = 16,
    *,
    seed: int = 2010,
    corner: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> City:
    """Buildings hide street furniture and balconies; views are at eye height along the streets.

    Parameters
    ----------
    things : int
        Instances.
    views : int
        Eyes in the middle of streets.
    seed : int
        Same seed, same city.
    corner : tuple of three float
        Where the south-west corner stands; multiples of 1/64 m, such as whole metres.
    """
    rng = np.random.default_rng(seed)
    low, high = _buildings(rng)
    side = BLOCKS * PITCH + STREET
    ground = np.array([[0.0, 0.0, -1.0]]), np.array([[side, side, 0.0]])
    walls, triangles = box_mesh(np.concatenate([ground[0], low]), np.concatenate([ground[1], high]))

    meshes: list[Floats] = []
    faces: list[npt.NDArray[np.uint32]] = []
    owners: list[npt.NDArray[np.int32]] = []
    turns: list[Floats] = []
    placed = vertices = 0
    for number, kind in enumerate((*_STREET_KINDS, None)):
        if kind is None:
            count, parts = things - placed, np.array(_BALCONY)
            foot, yaw = _on_walls(rng, count, low, high)
        else:
            count, parts = int(kind.share * things), np.array(kind.parts)
            foot, yaw = _in_streets(rng, count, jitter=0.05 if number == 0 else np.pi)
        shape, one = box_mesh(parts[:, :3], parts[:, 3:])
        cos, sin = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
        solid = np.stack(
            [
                foot[:, :1] + cos * shape[:, 0] - sin * shape[:, 1],
                foot[:, 1:2] + sin * shape[:, 0] + cos * shape[:, 1],
                foot[:, 2:] + shape[:, 2] + np.zeros((count, 1)),
            ],
            axis=-1,
        )
        meshes.append(on_grid(solid))
        faces.append(
            (one + vertices + len(shape) * np.arange(count)[:, None, None])
            .reshape(-1, 3)
            .astype(np.uint32)
        )
        owners.append(np.repeat(np.arange(placed, placed + count, dtype=np.int32), len(one)))
        turns.append(yaw)
        placed += count
        vertices += count * len(shape)
    scene = Scene(
        name=f"a city of {BLOCKS}x{BLOCKS} blocks, {len(low):,} buildings",
        origin=(corner[0] + side / 2.0, corner[1] + side / 2.0, corner[2]),
        vertices=walls + corner,
        triangles=triangles,
        instance_vertices=np.concatenate([mesh.reshape(-1, 3) for mesh in meshes]) + corner,
        instance_triangles=np.concatenate(faces),
        owner=np.concatenate(owners),
        box_min=np.concatenate([mesh.min(axis=1) for mesh in meshes]) + corner,
        box_max=np.concatenate([mesh.max(axis=1) for mesh in meshes]) + corner,
        views=_eyes(rng, views, corner),
    )
    return City(scene, np.concatenate(turns))


def _buildings(rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Corners of the buildings: each block has two or three lots per side, some with a gap."""
    low, high = [], []
    for block in np.ndindex(BLOCKS, BLOCKS):
        start = np.array(block) * PITCH + STREET
        cuts = [np.linspace(0.0, PITCH - STREET, int(rng.integers(3, 5))) for _ in range(2)]
        for i in range(len(cuts[0]) - 1):
            for k in range(len(cuts[1]) - 1):
                near = start + np.array([cuts[0][i], cuts[1][k]])
                far = (
                    start
                    + np.array([cuts[0][i + 1], cuts[1][k + 1]])
                    - rng.choice([0.0, 0.0, 3.0], 2)
                )
                low.append((*near, 0.0))
                high.append((*far, rng.uniform(9.0, 30.0) + 40.0 * rng.random() ** 6))
    return on_grid(low), on_grid(high)


def _in_streets(rng: np.random.Generator, count: int, jitter: float) -> tuple[Floats, Floats]:
    """Feet between the middle of a street and its houses, and yaws turned by up to `jitter`.

    No foot stands in a crossing.
    """
    street = rng.integers(0, BLOCKS + 1, count) * PITCH + STREET / 2.0
    across = street + rng.choice([-1.0, 1.0], count) * rng.uniform(3.0, 6.0, count)
    along = (
        rng.integers(0, BLOCKS, count) * PITCH + STREET + rng.uniform(0.0, PITCH - STREET, count)
    )
    north = rng.random(count) < 0.5
    foot = np.stack(
        [np.where(north, across, along), np.where(north, along, across), np.zeros(count)], axis=1
    )
    yaw: Floats = np.where(north, np.pi / 2.0, 0.0) + rng.uniform(-jitter, jitter, count)
    return foot, yaw


def _on_walls(
    rng: np.random.Generator, count: int, low: Floats, high: Floats
) -> tuple[Floats, Floats]:
    """Feet on the fronts of buildings, at least 3 m up, and yaws; y points off the wall."""
    house, front = rng.integers(0, len(low), count), rng.integers(0, 4, count)
    place = low[house] + rng.uniform(0.1, 0.9, (count, 3)) * (high[house] - low[house])
    place[:, 2] = 3.0 * np.floor(np.maximum(place[:, 2], 3.0) / 3.0)
    for number, (axis, corner) in enumerate(((1, high), (0, low), (1, low), (0, high))):
        here = front == number
        place[here, axis] = corner[house[here], axis]
    yaw: Floats = np.float64(np.pi / 2.0) * front.astype(np.float64)
    return place, yaw


def _eyes(
    rng: np.random.Generator, count: int, corner: tuple[float, float, float]
) -> tuple[View, ...]:
    """Eyes near the middle of streets and in crossings, looking along the street or across it."""
    views = []
    for number in range(count):
        street = rng.integers(1, BLOCKS) * PITCH + STREET / 2.0
        along = rng.uniform(0.2, 0.8) * BLOCKS * PITCH
        if number % 4 == 3:  # in a crossing, where three streets show
            along = rng.integers(2, BLOCKS - 1) * PITCH + STREET / 2.0
        north = number % 2 == 0
        heading = (
            rng.uniform(-0.5, 0.5) + rng.choice([0.0, np.pi]) + (np.pi / 2.0 if north else 0.0)
        )
        x, y = (street, along) if north else (along, street)
        eye = np.array([x, y]) + rng.uniform(-1.0, 1.0, 2)
        eye = on_grid([*eye, EYE]) + corner
        target = eye + np.array(
            [10.0 * np.cos(heading), 10.0 * np.sin(heading), rng.uniform(-0.5, 1.5)]
        )
        name = f"{'crossing' if number % 4 == 3 else 'street'} {number}"
        views.append(View(name, tuple(eye.tolist()), tuple(target.tolist()), 65.0, 0.125))
    return tuple(views)
