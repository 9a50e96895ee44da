"""A village of turned houses with gable roofs: closed meshes that no axis-aligned box fills."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from .grid import on_grid
from .rows import Rows

if TYPE_CHECKING:
    import numpy.typing as npt

    from .grid import Floats
    from .scene import Scene

__all__ = ["gabled_houses", "village"]

#: Metres from house to house.
PITCH: Final = 18.0
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
    rows = Rows.of(houses, PITCH)
    count = len(rows.middles)
    sizes = on_grid(rng.uniform((9.0, 6.0, 3.0, 6.0), (13.0, 9.0, 6.0, 10.0), (count, 4)))
    # No house reaches as far as the corners of the rows, where things and eyes stand.
    return rows.scene(
        rng,
        f"a village of {count} turned houses",
        gabled_houses(rows.middles, sizes, rng.uniform(0.0, 180.0, count)),
        things=things,
        beside=(-1.5, 1.5),
        up_to=9.0,
        sizes=(0.3, 1.5),
        views=views,
        called="corner",
    )
