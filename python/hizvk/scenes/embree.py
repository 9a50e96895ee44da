"""Embree's ray caster by the package `embreex` (the extra ``scene``)."""

from __future__ import annotations

import importlib
import importlib.util
from typing import TYPE_CHECKING, Any

import numpy as np

from ..extras import install_line

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy.typing as npt

    from .grid import Floats

__all__ = ["can_cast", "embree_scene", "missing"]


def missing() -> str:
    """What a report names as left out without `embreex`, and how to get it."""
    return f"rays by Embree (embreex is not installed: {install_line('scene')})"


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
