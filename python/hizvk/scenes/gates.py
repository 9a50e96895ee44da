"""Long things behind a wall with gates, and roofs that stand over the eye.

These are the places where published tests go wrong:

- A long thing shows through a gate that is narrower than a texel of the level that is read.
  Four lookups at the corners of its rectangle do not meet that texel (Rakos 2010).
- A roof begins behind the eye.
  Its corners there have a negative w (Rakos 2010), and its sphere contains the eye (Darnell 2010).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from .grid import on_grid
from .scene import Scene, View, box_mesh

__all__ = ["gates"]

#: The wall's distance, height and thickness in metres, and half its length; y is forward.
WALL: Final = (10.0, 4.0, 0.25, 90.0)
#: From one gate to the next, and the least and greatest width of a gate.
PERIOD: Final = 9.0
WIDTHS: Final = (0.5, 2.0)
#: One thing in so many is a roof.
ROOFS: Final = 20
ROOF: Final = np.array([6.0, 6.0, 0.25])
EYE: Final = 1.703125


def gates(things: int = 2000, views: int = 8, *, seed: int = 2010) -> Scene:
    """A wall with twenty gates, long boxes behind it, and roofs before it.

    Boxes are the instances' real geometry.

    Parameters
    ----------
    things : int
        Instances: one in twenty is a roof of 6 by 6 m, and the others are 2 to 12 m long.
    views : int
        Eyes 10 m before the wall.
    seed : int
        Same seed, same scene.
    """
    rng = np.random.default_rng(seed)
    y, height, thickness, half = WALL
    begins = np.arange(-half, half, PERIOD)
    widths = on_grid(rng.uniform(*WIDTHS, len(begins)))
    low = np.stack([begins, np.full_like(begins, y), np.zeros_like(begins)], axis=1)
    high = np.stack([begins + PERIOD - widths, 0 * begins + y + thickness, 0 * begins + height], 1)
    ground = ([[-half, -20.0, -0.25]], [[half, 120.0, 0.0]])
    vertices, triangles = box_mesh(
        np.concatenate([low, ground[0]]), np.concatenate([high, ground[1]])
    )

    roofs = max(1, things // ROOFS)
    long = things - roofs
    near = on_grid(
        np.stack(
            [rng.uniform(-half, half, long), rng.uniform(12.0, 100.0, long), np.zeros(long)], axis=1
        )
    )
    size = on_grid(rng.uniform([2.0, 1.0, 1.0], [12.0, 3.0, 3.0], (long, 3)))
    over = on_grid(
        np.stack(
            [
                rng.uniform(-half, half, roofs),
                rng.uniform(-4.0, -2.0, roofs),
                rng.uniform(2.25, 2.75, roofs),
            ],
            axis=1,
        )
    )
    least = np.concatenate([near, over])
    greatest = np.concatenate([near + size, over + ROOF])
    shape, faces = box_mesh(least, greatest)
    eyes = []
    for number, x in enumerate(np.linspace(-0.8 * half, 0.8 * half, views)):
        eye = tuple(on_grid([x, 0.0, EYE]).tolist())
        eyes.append(View(f"place {number}", eye, (eye[0], y, EYE), 60.0, 0.125))
    return Scene(
        name="long boxes behind a wall with twenty gates, and roofs",
        origin=(0.0, 0.0, 0.0),
        vertices=vertices,
        triangles=triangles,
        instance_vertices=shape,
        instance_triangles=faces,
        owner=np.repeat(np.arange(things, dtype=np.int32), 12),
        box_min=least,
        box_max=greatest,
        views=tuple(eyes),
    )
