"""Makes occluders of the meshes that are there: before any view is known, without a device.

- `split`: `split_mesh` cuts a mesh into groups that fit a cube, as occluders and instances
- `inner`: `inner_boxes` finds boxes inside of a closed mesh; `voxels` and `growth` serve it
- `prisms`: `inner_prisms` raises the floors of buildings to their lowest roof
- `select`: `select_occluders` drops poor occluders, by the sizes that `silhouettes` measures
"""

from __future__ import annotations

from .inner import InnerBoxes, inner_boxes
from .prisms import InnerPrisms, inner_prisms
from .select import OccluderSelection, select_occluders
from .split import SplitMesh, split_mesh

__all__ = [
    "InnerBoxes",
    "InnerPrisms",
    "OccluderSelection",
    "SplitMesh",
    "inner_boxes",
    "inner_prisms",
    "select_occluders",
    "split_mesh",
]
