"""A storeroom whose walls hide crates."""

from __future__ import annotations

import numpy as np

from .grid import GRID, on_grid
from .scene import Scene, View, box_mesh

__all__ = ["room"]


def room(seed: int = 1999, crates: int = 240) -> Scene:
    """A floor of 16 by 12 m with crates, hidden by two walls with a door each; four views.

    Walls, floor and crates are axis-aligned boxes, so boxes are the instances' real geometry.
    The room stands at the origin, and z is up.

    Parameters
    ----------
    seed : int
        Same seed, same crates.
    crates : int
        Instances; if they are more than 240, they are smaller, so that they stand no closer.
    """
    walls = np.array(
        [
            [0.0, 0.0, -0.25, 16.0, 12.0, 0.0],
            [0.0, -0.25, 0.0, 16.0, 0.0, 3.0],
            [0.0, 12.0, 0.0, 16.0, 12.25, 3.0],
            [-0.25, 0.0, 0.0, 0.0, 12.0, 3.0],
            [16.0, 0.0, 0.0, 16.25, 12.0, 3.0],
            [5.0, 0.0, 0.0, 5.25, 7.0, 3.0],
            [5.0, 8.0, 0.0, 5.25, 12.0, 3.0],
            [5.0, 7.0, 2.0, 5.25, 8.0, 3.0],
            [10.0, 0.0, 0.0, 10.25, 3.0, 3.0],
            [10.0, 4.0, 0.0, 10.25, 12.0, 3.0],
            [10.0, 3.0, 2.0, 10.25, 4.0, 3.0],
        ]
    )
    rng = np.random.default_rng(seed)
    scale = min(1.0, float(np.sqrt(240.0 / crates)))
    size = on_grid(scale * rng.uniform([0.1, 0.1, 0.1], [0.7, 0.7, 1.1], (crates, 3)))
    size = np.maximum(size, GRID)
    bay = rng.choice([0.1, 5.35, 10.35], crates)
    low = np.stack(
        [bay + rng.uniform(0.0, 3.8, crates), rng.uniform(0.1, 11.1, crates), np.zeros(crates)],
        axis=1,
    )
    low = on_grid(low)
    vertices, triangles = box_mesh(walls[:, :3], walls[:, 3:])
    crate_vertices, crate_triangles = box_mesh(low, low + size)
    views = (
        View("first bay, through the door", (1.0, 7.5, 1.625), (5.0, 7.5, 1.25), 70.0, 0.0625),
        View("first bay, along the wall", (2.5, 11.5, 1.75), (3.5, 0.5, 0.5), 60.0, 0.0625),
        View("middle bay", (5.75, 11.5, 1.75), (10.0, 2.5, 1.0), 75.0, 0.0625),
        View("last bay", (15.5, 11.5, 2.5), (10.5, 1.0, 0.5), 65.0, 0.0625),
    )
    return Scene(
        name="three bays of a storeroom",
        origin=(0.0, 0.0, 0.0),
        vertices=vertices,
        triangles=triangles,
        instance_vertices=crate_vertices,
        instance_triangles=crate_triangles,
        owner=np.repeat(np.arange(crates, dtype=np.int32), 12),
        box_min=low,
        box_max=low + size,
        views=views,
    )
