"""A fence: planks that hide together what none of them hides alone, with small knotholes.

Moller and Haines, *Real-Time Rendering* (1999), call such fusion of small occluders what occlusion
maps are good at.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from .grid import on_grid
from .scene import Scene, View, box_mesh

__all__ = ["PARTS", "fence"]

#: Boxes of a plank: around a knothole, to the left, to the right, below and above.
PARTS: Final = 4
#: Planks, the width and thickness of one, how far it reaches behind the next, and its height.
PLANKS: Final = 44
PLANK: Final = (0.40625, 0.03125)
LAP: Final = 0.03125
HEIGHT: Final = 4.0
#: The fence's distance from the eye; y is forward, z is up.
DISTANCE: Final = 6.0
EYE: Final = 1.703125


def fence(things: int = 400, views: int = 4, *, hole: float = 0.046875, seed: int = 1997) -> Scene:
    """A fence of 44 planks, each with a knothole, before boxes that are wider than a plank.

    Plank k has the triangles ``12 * PARTS * k`` to before ``12 * PARTS * (k + 1)``.

    Parameters
    ----------
    things : int
        Instances: boxes behind the fence, wider than a plank looks from the eye.
    views : int
        Eyes before the fence, up to 0.5 m to the sides.
    hole : float
        The side of a knothole in metres; 0: none.
    seed : int
        Same seed, same scene.
    """
    rng = np.random.default_rng(seed)
    width, thick = PLANK
    left = on_grid((np.arange(PLANKS) - PLANKS / 2.0) * (width - LAP))
    front = DISTANCE + thick * (np.arange(PLANKS) % 2)
    x = on_grid(left + rng.uniform(0.25, 0.6, PLANKS) * width)
    z = on_grid(rng.uniform(0.6, 2.4, PLANKS))
    side = float(on_grid(hole))
    low = np.stack(
        [
            np.stack([left, front, np.zeros(PLANKS)], 1),
            np.stack([x + side, front, np.zeros(PLANKS)], 1),
            np.stack([x, front, np.zeros(PLANKS)], 1),
            np.stack([x, front, z + side], 1),
        ],
        axis=1,
    )
    top = np.full(PLANKS, HEIGHT)
    high = np.stack(
        [
            np.stack([x, front + thick, top], 1),
            np.stack([left + width, front + thick, top], 1),
            np.stack([x + side, front + thick, z], 1),
            np.stack([x + side, front + thick, top], 1),
        ],
        axis=1,
    )
    vertices, triangles = box_mesh(low.reshape(-1, 3), high.reshape(-1, 3))
    y = rng.uniform(DISTANCE + 1.0, 20.0, things)
    # Within the shadow of the fence's middle.
    corner = on_grid(np.stack([rng.uniform(-0.4, 0.3, things) * y, y, np.zeros(things)], axis=1))
    # Wider than the shadow of a plank.
    extent = on_grid(rng.uniform(0.6, 1.5, (things, 3)))
    extent[:, 0] = on_grid(rng.uniform(0.5, 0.9, things) * y / DISTANCE)
    shape, faces = box_mesh(corner, corner + extent)
    eyes = []
    for number, x0 in enumerate(np.linspace(-0.5, 0.5, views)):
        eye = tuple(on_grid([x0, 0.0, EYE]).tolist())
        eyes.append(View(f"place {number}", eye, (x0, 10.0, EYE), 60.0, 0.125))
    return Scene(
        name=f"a fence of {PLANKS} planks with knotholes of {side:g} m",
        origin=(0.0, DISTANCE, 0.0),
        vertices=vertices,
        triangles=triangles,
        instance_vertices=shape,
        instance_triangles=faces,
        owner=np.repeat(np.arange(things, dtype=np.int32), 12),
        box_min=corner,
        box_max=corner + extent,
        views=tuple(eyes),
    )
