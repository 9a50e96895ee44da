"""Bounds of a scene's instances from their real vertices: boxes, spheres, and turned boxes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from ..bounds import Boxes, OrientedBoxes, Spheres

if TYPE_CHECKING:
    import numpy.typing as npt

    from ..bounds import Bounds
    from ..scenes import Scene
    from ..scenes.grid import Floats

__all__ = ["bounds_of"]

#: Angles that are tried where the angle of a thing is not known.
TURNS: Final = np.arange(24) * (np.pi / 48.0)
#: Bound of the rounding of a position in float64, relative to its coordinates.
ROUNDING: Final = 2.0**-50


def bounds_of(scene: Scene, kind: str, *, up: int = 2, yaw: Floats | None = None) -> Bounds:
    """The instances' bounds.

    Parameters
    ----------
    scene : Scene
        Every instance has at least one triangle.
    kind : "spheres", "boxes" or "oriented_boxes"
        Spheres are centred on the box and reach the farthest vertex.
    up : 0, 1 or 2
        The vertical axis, about which oriented boxes are turned.
    yaw : (N,) float64 array, optional
        The angle of each instance, in radians.
        None: the angle of `TURNS` that gives the smallest box.

    Returns
    -------
    Spheres, Boxes or OrientedBoxes
        Float64, grown by the rounding of float64, so they contain all vertices.
    """
    if kind == "boxes":
        return Boxes(scene.box_min, scene.box_max)
    middle = (scene.box_min + scene.box_max) / 2.0
    local, first = _by_instance(scene, middle)
    grow = ROUNDING * np.abs(middle).max(axis=1)
    if kind == "spheres":
        radius = np.sqrt(np.maximum.reduceat((local**2).sum(axis=1), first))
        return Spheres(middle, radius * (1.0 + ROUNDING) + 2.0 * grow)
    count = np.diff(np.append(first, len(local)))
    best = np.full(len(scene), np.inf)
    centers, halves = np.empty_like(middle), np.empty_like(middle)
    rotations = np.empty((len(scene), 3, 3))
    for angle in TURNS if yaw is None else [yaw]:
        rotation = _about(up, np.broadcast_to(angle, len(scene)))
        turned = np.einsum("ni,nik->nk", local, np.repeat(rotation, count, axis=0))
        low, high = np.minimum.reduceat(turned, first), np.maximum.reduceat(turned, first)
        volume = np.prod(high - low, axis=1)
        better = volume < best
        best[better] = volume[better]
        rotations[better] = rotation[better]
        centers[better] = (middle + np.einsum("nik,nk->ni", rotation, (low + high) / 2.0))[better]
        halves[better] = ((high - low) / 2.0)[better]
    return OrientedBoxes(centers, halves * (1.0 + ROUNDING) + 4.0 * grow[:, None], rotations)


def _by_instance(scene: Scene, middle: Floats) -> tuple[Floats, npt.NDArray[np.intp]]:
    """Vertices relative to their instance's middle, sorted by instance; where each one begins."""
    owner = np.full(len(scene.instance_vertices), -1, np.int32)
    owner[scene.instance_triangles] = scene.owner[:, None]
    used = np.flatnonzero(owner >= 0)
    used = used[np.argsort(owner[used], kind="stable")]
    first = np.searchsorted(owner[used], np.arange(len(scene)))
    return scene.instance_vertices[used] - middle[owner[used]], first


def _about(up: int, angle: npt.NDArray[np.float64]) -> Floats:
    """``(N, 3, 3)``: rotations about an axis; column k is the box's axis k in the world."""
    one, two = (up + 1) % 3, (up + 2) % 3
    rotation = np.zeros((len(angle), 3, 3))
    rotation[:, up, up] = 1.0
    rotation[:, one, one] = rotation[:, two, two] = np.cos(angle)
    rotation[:, two, one] = np.sin(angle)
    rotation[:, one, two] = -rotation[:, two, one]
    return rotation
