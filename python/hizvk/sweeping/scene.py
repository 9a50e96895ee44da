"""Bounds and occluders as they travel to a worker, and the digest that names them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from .._processes import cached_property
from ..bounds import as_arrays
from ..mesh import Mesh

if TYPE_CHECKING:
    from collections.abc import Iterable

    from .._types import FaceCull
    from ..bounds import Bounds
    from ..camera import Camera

__all__ = ["SceneData", "digest_of", "words_of"]


@dataclass(frozen=True, eq=False)
class SceneData:
    """All that a worker uploads once: it can be pickled."""

    bounds: Bounds
    meshes: tuple[Mesh, ...] | None
    """The occluders; None where depth images come with the views."""
    faces: FaceCull = "none"
    """Which faces of the occluders are left out."""

    @cached_property
    def digest(self) -> str:
        """The name of these numbers: equal scenes have equal digests, whoever computes them."""
        kind, arrays = as_arrays("bounds", self.bounds)
        parts: list[object] = [kind, *arrays, self.faces]
        for mesh in self.meshes or ():
            parts += ["mesh", mesh.vertices, mesh.triangles, mesh.transforms]
        return digest_of(parts)

    def __reduce__(self) -> tuple[Any, ...]:
        # Made by their constructors again, since engines hand out arrays that are not aligned.
        bounds = type(self.bounds), [getattr(self.bounds, one.name) for one in fields(self.bounds)]
        meshes = None
        if self.meshes is not None:
            meshes = [(one.vertices, one.triangles, one.transforms) for one in self.meshes]
        return _again, (bounds, meshes, self.faces)


def _again(
    bounds: tuple[type[Bounds], list[Any]], meshes: list[tuple[Any, ...]] | None, faces: FaceCull
) -> SceneData:
    made = None if meshes is None else tuple(Mesh(*parts) for parts in meshes)
    return SceneData(bounds[0](*bounds[1]), made, faces)


def digest_of(parts: Iterable[object]) -> str:
    """SHA-256 over arrays, with their shapes and dtypes, and over the `repr` of everything else."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.shape} {part.dtype.str};".encode())
            digest.update(np.ascontiguousarray(part).reshape(-1).view(np.uint8).data)
        else:
            digest.update(f"{part!r};".encode())
    return digest.hexdigest()


def words_of(camera: Camera) -> tuple[object, ...]:
    """What `digest_of` takes of a camera: equal cameras have equal words."""
    rows = np.array(camera._inner.rows()) + 0.0  # -0.0 equals 0.0
    return rows, np.array(camera._inner.origin()) + 0.0, camera.size, camera.reversed_z
