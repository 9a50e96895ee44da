"""Visibility by ray casting, as a user without Hi-Z would find it: Embree on the real triangles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from ..scenes.embree import embree_scene

if TYPE_CHECKING:
    import numpy.typing as npt

    from .._arguments import Size
    from ..scenes import Scene, View

__all__ = ["SAMPLES", "Rays"]

#: Points of a box that `Rays.points` looks at: its corners and its middle.
SAMPLES: Final = 9
#: The part of the way to a point that has to be free; the point itself lies on its own box.
REACH: Final = 1.0 - 1e-4


class Rays:
    """Embree's trees over a scene; the first ray builds them.

    Parameters
    ----------
    scene : Scene
        Occluders and instances with their triangles.

    Raises
    ------
    ImportError
        Without `embreex`.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._origin = np.array(scene.origin)
        occluders = scene.vertices - self._origin
        things = scene.instance_vertices - self._origin
        vertices = np.concatenate([occluders, things])
        triangles = np.concatenate(
            [scene.triangles, scene.instance_triangles + np.uint32(len(occluders))]
        )
        self._all = embree_scene([(vertices, triangles)])
        self._occluders = embree_scene([(occluders, scene.triangles)])
        self._owner = np.concatenate([np.full(len(scene.triangles), -1, np.int32), scene.owner])

    def image(self, view: View, size: Size) -> npt.NDArray[np.bool_]:
        """``(N,)``: which instances own a pixel; one ray per pixel, and the first hit counts."""
        rays = view.rays(size).reshape(-1, 3)
        start = ((np.array(view.eye) - self._origin) + view.near * rays).astype(np.float32)
        reach = np.full(len(rays), np.inf if view.far is None else view.far - view.near, np.float32)
        hit = self._all.run(start, rays.astype(np.float32), dists=reach, query="INTERSECT")
        owner = self._owner[hit[hit >= 0]]
        visible = np.zeros(len(self._scene), dtype=bool)
        visible[owner[owner >= 0]] = True
        return visible

    def points(self, view: View, size: Size) -> npt.NDArray[np.bool_]:
        """``(N,)``: which instances in view have a corner or middle that no occluder hides."""
        scene, eye = self._scene, np.array(view.eye)
        bit = ((np.arange(8)[:, None] >> np.arange(3)) & 1).astype(np.float32)
        where = np.concatenate([bit, np.full((1, 3), 0.5, np.float32)])
        low, high = (
            (scene.box_min - eye).astype(np.float32),
            (scene.box_max - eye).astype(np.float32),
        )
        point = low[:, None] + where * (high - low)[:, None]  # (N, SAMPLES, 3), about the eye
        asked = np.flatnonzero(_in_view(point, view, size))
        towards = point[asked].reshape(-1, 3)
        start = np.broadcast_to((eye - self._origin).astype(np.float32), towards.shape).copy()
        hit = self._occluders.run(
            start, towards, dists=np.full(len(towards), REACH, np.float32), query="INTERSECT"
        )
        visible = np.zeros(len(scene), dtype=bool)
        visible[asked[(hit.reshape(-1, SAMPLES) < 0).any(axis=1)]] = True
        return visible


def _in_view(point: npt.NDArray[np.float32], view: View, size: Size) -> npt.NDArray[np.bool_]:
    """``(N,)``: whether no plane of the view volume has all points ``(N, SAMPLES, 3)`` outside."""
    x, y, z = np.moveaxis(point @ view.basis().T.astype(np.float32), -1, 0)
    tangent = np.float32(np.tan(np.radians(view.fov_y_deg) / 2.0))
    tall, wide = tangent * z, tangent * np.float32(size[1] / size[0]) * z
    outside = [x < -wide, x > wide, y < -tall, y > tall, z < view.near]
    if view.far is not None:
        outside.append(z > view.far)
    inside: npt.NDArray[np.bool_] = ~np.any([side.all(axis=1) for side in outside], axis=0)
    return inside
