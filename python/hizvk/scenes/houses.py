"""A village of turned houses with gable roofs: closed meshes that no axis-aligned box fills."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from .grid import apart, on_grid
from .scene import Scene, View, box_mesh

if TYPE_CHECKING:
    import numpy.typing as npt

    from .grid import Floats

__all__ = ["gabled_houses", "village"]

#: Metres from house to house, and the height of eyes.
PITCH: Final = 18.0
EYE: Final = 1.703125
#: Corners of a house: the floor (0 to 3), the eaves (4 to 7), the ridge (8, 9) along x.
FACES: Final = (
    (0, 2, 1), (0, 3, 2),  # floor
    (0, 1, 5), (0, 5, 4), (2, 3, 7), (2, 7, 6),  # long walls
    (1, 2, 6), (1, 6, 5), (3, 0, 4), (3, 4, 7),  # end walls
    (5, 6, 9), (7, 4, 8),  # gables
    (4, 5, 9), (4, 9, 8), (6, 7, 8), (6, 8, 9),  # roof
)  # fmt: skip


def gabled_houses(
    places: npt.ArrayLike, sizes: npt.ArrayLike, yaw_deg: npt.ArrayLike
) -> tuple[Floats, npt.NDArray[np.uint32]]:
    """Vertices and triangles of houses; each is closed, z is up, and front faces look outwards.

    Parameters
    ----------
    places : (N, 2)
        x and y of their middles.
    sizes : (N, 4)
        Length, width, height of the eaves, height of the ridge.
    yaw_deg : (N,)
        The angle from the x axis to the ridge.

    Returns
    -------
    vertices : (10 N, 3) float64 array
        Ten in a row for each house, on the grid of 1/64 m.
    triangles : (16 N, 3) uint32 array
        Sixteen in a row for each house.
    """
    places, sizes = np.asarray(places, np.float64), np.asarray(sizes, np.float64)
    turn = np.radians(np.asarray(yaw_deg, np.float64))[:, None]
    x = np.array([-0.5, 0.5, 0.5, -0.5, -0.5, 0.5, 0.5, -0.5, -0.5, 0.5]) * sizes[:, :1]
    y = np.array([-0.5, -0.5, 0.5, 0.5, -0.5, -0.5, 0.5, 0.5, 0.0, 0.0]) * sizes[:, 1:2]
    z = np.concatenate([np.zeros((len(sizes), 4)), np.repeat(sizes[:, 2:], (4, 2), axis=1)], axis=1)
    vertices = np.stack(
        [
            places[:, :1] + np.cos(turn) * x - np.sin(turn) * y,
            places[:, 1:] + np.sin(turn) * x + np.cos(turn) * y,
            z,
        ],
        axis=-1,
    )
    triangles = np.array(FACES) + 10 * np.arange(len(sizes))[:, None, None]
    return on_grid(vertices).reshape(-1, 3), triangles.reshape(-1, 3).astype(np.uint32)


def village(houses: int = 64, things: int = 4000, views: int = 8, *, seed: int = 2011) -> Scene:
    """Turned houses in rows hide things between them; views are at eye height.

    Parameters
    ----------
    houses : int
        Rounded up to a square number.
    things : int
        Instances: boxes of 0.3 to 1.5 m, up to 9 m above the ground, outside of the houses.
    views : int
        Eyes between the houses.
    seed : int
        Same seed, same village.
    """
    rng = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(houses)))
    cell = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="ij"), -1).reshape(-1, 2)
    count = len(cell)
    sizes = on_grid(rng.uniform((9.0, 6.0, 3.0, 6.0), (13.0, 9.0, 6.0, 10.0), (count, 4)))
    vertices, triangles = gabled_houses(cell * PITCH, sizes, rng.uniform(0.0, 180.0, count))
    # Things and eyes stand where the rows' corners are, so that no house holds them.
    places, corners = apart(rng, side, views, things)
    corner = on_grid((corners + 0.5) * PITCH)
    low = np.zeros((things, 3))
    low[:, :2] = on_grid(corner + rng.uniform(-1.5, 1.5, (things, 2)))
    low[:, 2] = on_grid(rng.uniform(0.0, 9.0, things))
    high = low + on_grid(rng.uniform(0.3, 1.5, (things, 3)))
    shape, faces = box_mesh(low, high)
    eyes = []
    for number, place in enumerate((places + 0.5) * PITCH):
        eye = on_grid([*place, EYE])
        heading = rng.uniform(0.0, 2.0 * np.pi)
        target = eye + np.array([10.0 * np.cos(heading), 10.0 * np.sin(heading), 0.0])
        eyes.append(
            View(f"corner {number}", tuple(eye.tolist()), tuple(target.tolist()), 60.0, 0.125)
        )
    middle = 0.5 * (side - 1) * PITCH
    return Scene(
        name=f"a village of {count} turned houses",
        origin=(middle, middle, 0.0),
        vertices=vertices,
        triangles=triangles,
        instance_vertices=shape,
        instance_triangles=faces,
        owner=np.repeat(np.arange(things, dtype=np.int32), 12),
        box_min=low,
        box_max=high,
        views=tuple(eyes),
    )
