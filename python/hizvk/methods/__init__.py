"""The algorithms of the texts, each as its text has it, to compare with the library's own.

Nothing of the certified path uses them, and `import hizvk` does not load them.
Their names are reachable from `hizvk`, too.
"""

from .occlusion_map import MapResult, OcclusionMap
from .tiling import BspTiling, TiledCoverage

__all__ = ["BspTiling", "MapResult", "OcclusionMap", "TiledCoverage"]
