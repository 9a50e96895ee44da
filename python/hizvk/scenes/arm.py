"""ARM's scene: spheres among prisms around a clearing, and what rays see of them.

Source: ARM's sample "Occlusion Culling with Hierarchical-Z" (Mali SDK for OpenGL ES).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from .scene import Scene, View, box_mesh
from .truth import SKY, BoxCaster

if TYPE_CHECKING:
    import numpy.typing as npt

    from .._arguments import Size
    from .grid import Floats

__all__ = ["ArmScene", "BallSight", "arm"]

#: Spheres along each axis, and along each axis of a block that is stored together.
SIDE: Final = 24
BLOCK: Final = 4
#: Pairs of a sphere and a pixel that are looked at in one batch.
CHUNK: Final = 1_000_000


@dataclass(frozen=True, eq=False)
class BallSight:
    """What a view shows."""

    prism_depth: Floats
    """``(height, width)``: view depth of the nearest prism, infinite without one."""
    owner: npt.NDArray[np.int32]
    """``(height, width)``: the nearest sphere before all prisms; `truth.SKY` without one."""
    depth: Floats
    """``(height, width)``: view depth of what is seen, infinite for the sky."""
    normal: Floats
    """``(height, width, 3)``: unit normals of what is seen, 0 for the sky."""
    seen: npt.NDArray[np.bool_]
    """``(N,)``: the spheres that a ray meets before any prism, also behind other spheres."""


@dataclass(frozen=True, eq=False)
class ArmScene:
    """160 prisms that hide, and 24^3 spheres; y is up."""

    prism_min: Floats
    """``(160, 3)``: least corners."""
    prism_max: Floats
    """``(160, 3)``: greatest corners."""
    centers: npt.NDArray[np.float32]
    """``(13824, 3)``: of the spheres, in blocks of 64 neighbours."""
    radii: npt.NDArray[np.float32]
    """``(13824,)``: 0.15 to 0.30."""
    views: tuple[View, ...]
    """From the middle of the clearing."""

    def __len__(self) -> int:
        """The number of spheres."""
        return len(self.radii)

    def prism_mesh(self) -> tuple[Floats, npt.NDArray[np.uint32]]:
        """Vertices and triangles of all prisms."""
        return box_mesh(self.prism_min, self.prism_max)

    def look(self, view: View, size: Size) -> BallSight:
        """What rays through the pixel centres of `view` meet, in float64.

        The prisms and the spheres are taken as they are, without triangles or a depth image.
        """
        vertices, triangles = self.prism_mesh()
        prisms = Scene(
            name="prisms",
            origin=(0.0, 0.0, 0.0),
            vertices=vertices[:0],
            triangles=triangles[:0],
            instance_vertices=vertices,
            instance_triangles=triangles,
            owner=np.repeat(np.arange(len(self.prism_min), dtype=np.int32), 12),
            box_min=self.prism_min,
            box_max=self.prism_max,
            views=(view,),
        )
        sight = BoxCaster(prisms).look(view, size, np.full(size, np.inf))
        return self._before(view, size, sight.depth, sight.normal.astype(np.float64))

    def _before(self, view: View, size: Size, prism_depth: Floats, normal: Floats) -> BallSight:
        rays = view.rays(size).reshape(-1, 3)
        before, normal = prism_depth.reshape(-1), normal.reshape(-1, 3).copy()
        owner, depth = np.full(len(rays), SKY, np.int32), before.copy()
        seen = np.zeros(len(self), bool)
        away = self.centers.astype(np.float64) - view.eye
        radii = self.radii.astype(np.float64)
        balls, x0, y0, x1, y1 = _rectangles(view, size, away, radii)
        area = (x1 - x0) * (y1 - y0)
        edges = np.searchsorted(np.cumsum(area), np.arange(CHUNK, max(int(area.sum()), 1), CHUNK))
        for part in np.split(np.arange(len(balls)), np.unique(edges)):
            turn = np.repeat(part, area[part])
            within = np.arange(len(turn)) - np.repeat(
                np.cumsum(area[part]) - area[part], area[part]
            )
            wide = (x1 - x0)[turn]
            pixel = (y0[turn] + within // wide) * size[1] + x0[turn] + within % wide
            ball = balls[turn]
            ray = rays[pixel]
            a, b = (ray * ray).sum(axis=1), (ray * away[ball]).sum(axis=1)
            root = b * b - a * ((away[ball] ** 2).sum(axis=1) - radii[ball] ** 2)
            reach = np.sqrt(np.maximum(root, 0.0))
            enter, leave = np.maximum((b - reach) / a, view.near), (b + reach) / a
            met = (root > 0.0) & (leave > view.near) & (enter < before[pixel])
            seen[ball[met]] = True
            met &= enter < depth[pixel]
            pixel, ball, enter = pixel[met], ball[met], enter[met]
            # Of several spheres on one pixel, the nearest is written last.
            last = np.argsort(-enter, kind="stable")
            pixel, ball, enter = pixel[last], ball[last], enter[last]
            owner[pixel], depth[pixel] = ball, enter
            normal[pixel] = (rays[pixel] * enter[:, None] - away[ball]) / radii[ball][:, None]
        return BallSight(
            prism_depth, owner.reshape(size), depth.reshape(size), normal.reshape(*size, 3), seen
        )


def arm(views: int = 8, *, seed: int = 2015) -> ArmScene:
    """Prisms of 2 x 8 x 2 m, 3 m apart, with nine missing around the eye, and small spheres.

    Parameters
    ----------
    views : int
        Directions of the camera, all around, beginning at a turn of 32.5 degrees.
    seed : int
        Same seed, same radii.
    """
    places = [(x, z) for x in range(13) for z in range(13) if not (5 <= x <= 7 and 5 <= z <= 7)]
    middle = 3.0 * (np.array(places, np.float64) - 6.0)
    prism_min = np.stack([middle[:, 0] - 1.0, np.zeros(len(middle)), middle[:, 1] - 1.0], axis=1)
    steps = np.arange(SIDE).reshape(-1, BLOCK)
    order = [
        (x, y, z)
        for block_x in steps
        for block_y in steps
        for block_z in steps
        for x in block_x
        for y in block_y
        for z in block_z
    ]
    centers = np.array(order) * [1.0, 0.1, 1.0] + [-11.35, 0.5, -11.45]
    radii = 0.3 * (1.0 - 0.5 * np.random.default_rng(seed).random(len(centers)))
    looks = []
    for number in range(views):
        turn = 32.5 + 360.0 * number / views
        x, z = np.sin(np.radians(turn)), -np.cos(np.radians(turn))
        looks.append(
            View(
                f"{turn % 360.0:.1f} degrees",
                (0.0, 2.0, 0.0),
                (float(x), 2.0, float(z)),
                60.0,
                1.0,
                up=(0.0, 1.0, 0.0),
                far=500.0,
            )
        )
    return ArmScene(
        prism_min=prism_min,
        prism_max=prism_min + np.array([2.0, 8.0, 2.0]),
        centers=centers.astype(np.float32),
        radii=radii.astype(np.float32),
        views=tuple(looks),
    )


def _rectangles(
    view: View, size: Size, away: Floats, radii: Floats
) -> tuple[npt.NDArray[np.intp], ...]:
    """Spheres that may be seen, and the pixels that they can meet: from x0, y0 to before x1, y1."""
    height, width = size
    x, y, z = (away @ view.basis().T).T
    tangent = np.tan(np.radians(view.fov_y_deg) / 2.0)
    near, far = z - radii, z + radii
    crosses = near <= 0.01
    near = np.where(crosses, 1.0, near)
    edges = []
    for middle, half, count in ((x, tangent * width / height, width), (-y, tangent, height)):
        low, high = middle - radii, middle + radii
        least = np.minimum(low / near, low / np.where(crosses, 1.0, far))
        most = np.maximum(high / near, high / np.where(crosses, 1.0, far))
        first = np.floor((least / half + 1.0) / 2.0 * count)
        last = np.ceil((most / half + 1.0) / 2.0 * count)
        edges.append(np.where(crosses, 0, np.clip(first, 0, count)))
        edges.append(np.where(crosses, count, np.clip(last, 0, count)))
    x0, x1, y0, y1 = edges
    balls = np.flatnonzero((x1 > x0) & (y1 > y0) & (far > view.near))
    return balls, *(edge[balls].astype(np.intp) for edge in (x0, y0, x1, y1))
