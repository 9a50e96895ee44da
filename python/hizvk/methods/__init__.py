"""The algorithms of the texts, each as its text has it, to compare with the library's own.

Nothing of the certified path uses them, and `import hizvk` does not load them.
Their names are reachable from `hizvk`, too.
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

__all__ = [
    "HIDDEN",
    "NODE_DTYPE",
    "NOT_VISITED",
    "OUTSIDE",
    "VISIBLE",
    "FlatFrame",
    "HierarchicalVisibility",
    "HierarchyFrame",
]
