"""The algorithms of the texts, each as its text has it, to compare with the library's own.

Nothing of the certified path uses them, and `import hizvk` does not load them.
Their names are reachable from `hizvk`, too.

- `texts`: visibility tests as they were published; they hide what can be seen
- `occlusion_map`: hierarchical occlusion maps, which hide what shows through holes
- `tiling`: triangles in BSP order, with a bit for each pixel and no depths
- `levels`: other ways to make a depth image's levels
- `turitzin`: a table of the time that each of these ways takes
"""

from .hierarchy import (
    HIDDEN,
    NODE_DTYPE,
    NOT_VISITED,
    OUTSIDE,
    VISIBLE,
    FlatFrame,
    HierarchicalVisibility,
    HierarchyFrame,
)
from .levels import MethodLevels
from .occlusion_map import MapResult, OcclusionMap
from .texts import PublishedTest
from .tiling import BspTiling, TiledCoverage

__all__ = [
    "HIDDEN",
    "NODE_DTYPE",
    "NOT_VISITED",
    "OUTSIDE",
    "VISIBLE",
    "BspTiling",
    "FlatFrame",
    "HierarchicalVisibility",
    "HierarchyFrame",
    "MapResult",
    "MethodLevels",
    "OcclusionMap",
    "PublishedTest",
    "TiledCoverage",
]
