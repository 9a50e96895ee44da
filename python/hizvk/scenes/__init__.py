"""Scenes with known geometry, and what is really seen in them.

The demo, the bench and the tests use them.
Positions are float64, and where a scene is far from the origin, they are large: the mountains stand
at map coordinates, millions of metres out.
All positions are multiples of 1/64 m, so ``scene.vertices - scene.origin`` is exact in float32.
The ray caster that checks a cull therefore starts from the same numbers as the cull.

- `scene`: `Scene` and `View`, and boxes as triangles
- `grid`: the multiples of 1/64 m
- `terrain`: height fields
- `massif`: `mountains`, the demo's scene: a real elevation model and trees
- `storeroom`: `room`: crates behind walls
- `city`: a street-level city from a seed
- `boulders`: lumps of thousands of triangles
- `arm`: spheres among prisms, with rays of its own
- `fence`: planks with knotholes
- `hedge`: where ranking occluders by size and distance fails
- `gates`: where published tests go wrong
- `rows`: large things in rows, and what stands between them
- `houses`: `village`: turned houses with gable roofs
- `doors`: doors that open and close and a bus that drives by
- `embree`: Embree's ray caster
- `truth`: what is seen in a view, and the check of a cull against it
"""

from __future__ import annotations

from .houses import gabled_houses, village
from .massif import elevation, mountains
from .scene import Scene, View, box_mesh
from .storeroom import room
from .terrain import Terrain

__all__ = [
    "Scene",
    "Terrain",
    "View",
    "box_mesh",
    "elevation",
    "gabled_houses",
    "mountains",
    "room",
    "village",
]
