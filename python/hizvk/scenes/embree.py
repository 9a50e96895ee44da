"""Embree's ray caster by the package `embreex` (the extra ``scene``)."""

from __future__ import annotations

import importlib
import importlib.util
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy.typing as npt

    from .grid import Floats

__all__ = ["MISSING", "can_cast", "embree_scene"]

#: What a report names as left out where it is not installed.
MISSING = "rays by Embree (embreex is not installed: pip install embreex)"


def can_cast() -> bool:
    """Whether `embreex` is installed."""
    return importlib.util.find_spec("embreex") is not None


def embree_scene(meshes: Iterable[tuple[Floats, npt.NDArray[np.uint32]]]) -> Any:
    """A scene that rays can be cast at; a hit's ``geomID`` is the number of its mesh.

    Raises
    ------
    ImportError
        Without `embreex`.
    """
    # Not by `import`: the package has no types, and no checker has to be told.
    scene: Any = importlib.import_module("embreex.rtcore_scene").EmbreeScene(robust=True)
    add_mesh: Any = importlib.import_module("embreex.mesh_construction").TriangleMesh
    for vertices, triangles in meshes:
        if len(triangles):
            add_mesh(scene, vertices.astype(np.float32), triangles.astype(np.int32))
    return scene
