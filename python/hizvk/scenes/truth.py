"""What is really seen, for checking a cull: by rays at the triangles, or by pixels and boxes.

With `embreex` (the extra ``scene``) rays are cast through the pixel centres at the real triangles
of occluders and instances.
Neither the rendered depth nor any matrix of the library takes part.
Without it, the pixels' rays are intersected with the instances' boxes in float64, and compared with
the depth image as given.
That says nothing about the depth image itself, and `Sight.method` says so in the report.

An instance is visible when it owns a pixel: when the nearest thing on the ray through the pixel's
centre is one of its triangles.
An instance that is visible only by a hair may rightly be hidden by a rasteriser, for two reasons:

- Vulkan lets it move corners by 1/16 of a pixel.
- float32 depth cannot separate surfaces that are 1e-6 of their distance apart.

`firm` tells those from the others by rays alone, and a check lists them apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import reference
from ..bounds import Boxes
from ..check import Comparison, compare
from .embree import can_cast, embree_scene
from .scene import box_corners

if TYPE_CHECKING:
    from .._arguments import Size
    from .grid import Floats
    from .scene import Scene, View

__all__ = [
    "OCCLUDER",
    "SKY",
    "BoxCaster",
    "Caster",
    "Check",
    "RayCaster",
    "Sight",
    "check",
    "make_caster",
]

Indices: TypeAlias = npt.NDArray[np.intp]

#: `Sight.owner` where nothing is seen, and where an occluder is seen.
SKY: Final = -1
OCCLUDER: Final = -2
#: Pixels by which Vulkan lets a rasteriser move a corner: ``subPixelPrecisionBits`` is at least 4.
SNAP: Final = 1.0 / 16.0
#: The part of their distance within which two surfaces fight for the pixel.
TIE: Final = 1e-6


@dataclass(frozen=True, eq=False)
class Sight:
    """What is seen in each pixel of a view."""

    owner: npt.NDArray[np.int32]
    """``(height, width)``: an instance, `OCCLUDER` or `SKY`."""
    depth: Floats
    """``(height, width)``: view depth, infinite for the sky."""
    normal: npt.NDArray[np.float32]
    """``(height, width, 3)``: unit normals towards the eye, 0 for the sky."""
    method: str
    """How it was found, in words."""

    def pixels(self, count: int) -> npt.NDArray[np.intp]:
        """``(count,)``: the pixels that each instance owns."""
        return np.bincount(self.owner[self.owner >= 0], minlength=count)


class Caster(Protocol):
    """Finds out what is seen."""

    method: str
    """How, in words."""

    def look(self, view: View, size: Size, given: Floats) -> Sight:
        """What `view` shows; `given` is the occluders' view depth by the depth image under test."""
        ...

    def firm(
        self, view: View, sight: Sight, given: Floats, instances: npt.ArrayLike
    ) -> npt.NDArray[np.bool_]:
        """``(M,)``: which of the visible `instances` ``(M,)`` own a pixel by more than a hair."""
        ...


class RayCaster:
    """Casts rays at the real triangles with Embree.

    Embree (float32, watertight) chooses the triangle; the depth is that of the triangle's plane, in
    float64.
    """

    method = (
        "rays through the pixel centres (Embree) at the real triangles of occluders and instances"
    )

    def __init__(self, scene: Scene) -> None:
        self._origin = np.array(scene.origin)
        self._owner = scene.owner
        ground = (scene.vertices - self._origin, scene.triangles)
        things = (scene.instance_vertices - self._origin, scene.instance_triangles)
        self._meshes = [ground, things]
        self._all = embree_scene(self._meshes)
        self._occluders = embree_scene(self._meshes[:1])

    def look(self, view: View, size: Size, given: Floats | None = None) -> Sight:
        """What `view` shows; the depth image under test takes no part."""
        return self.look_shifted(view, size, (0.0, 0.0))

    def look_shifted(self, view: View, size: Size, shift: tuple[float, float]) -> Sight:
        """As `look`, through points that are `shift` pixels away from the centres."""
        owner, depth, normal = self._cast(self._all, view, view.rays(size, shift).reshape(-1, 3))
        return Sight(
            owner.reshape(size), depth.reshape(size), normal.reshape(*size, 3), self.method
        )

    def occluder_depth(self, view: View, rays: Floats) -> Floats:
        """View depth of the occluders alone along `rays` ``(..., 3)``; infinite without a hit."""
        return self._cast(self._occluders, view, rays.reshape(-1, 3))[1].reshape(rays.shape[:-1])

    def firm(
        self, view: View, sight: Sight, given: Floats | None, instances: npt.ArrayLike
    ) -> npt.NDArray[np.bool_]:
        """Which own a pixel that no occluder takes if the ray moves by `SNAP` or depth by `TIE`."""
        rows, columns = np.nonzero(np.isin(sight.owner, instances))
        limit = sight.depth[rows, columns] * (1.0 + TIE)
        kept = np.ones(len(rows), dtype=bool)
        for shift in ((0.0, 0.0), (-SNAP, -SNAP), (SNAP, -SNAP), (-SNAP, SNAP), (SNAP, SNAP)):
            rays = view.rays(sight.owner.shape, shift)[rows, columns]
            kept &= self.occluder_depth(view, rays) > limit
        return np.isin(instances, sight.owner[rows, columns][kept])

    def in_light(self, points: Floats, sun: Floats) -> npt.NDArray[np.bool_]:
        """Whether the sun reaches `points` ``(P, 3)`` just off a surface; for pictures."""
        start = (points - self._origin).astype(np.float32)
        towards = np.broadcast_to(sun.astype(np.float32), start.shape).copy()
        hit: npt.NDArray[np.int32] = self._all.run(start, towards, query="INTERSECT")
        return hit < 0

    def _cast(
        self, embree: Any, view: View, rays: Floats
    ) -> tuple[npt.NDArray[np.int32], Floats, npt.NDArray[np.float32]]:
        eye = np.array(view.eye) - self._origin
        # From the near plane to the far plane: nothing outside of them is drawn either.
        start = (eye + view.near * rays).astype(np.float32)
        reach = np.full(len(rays), np.inf if view.far is None else view.far - view.near, np.float32)
        answer = embree.run(
            start, rays.astype(np.float32), dists=reach, query="INTERSECT", output=True
        )
        owner = np.full(len(rays), SKY, np.int32)
        depth = np.full(len(rays), np.inf)
        normal = np.zeros((len(rays), 3), np.float32)
        for number, (vertices, triangles) in enumerate(self._meshes):
            hit = np.flatnonzero((answer["primID"] >= 0) & (answer["geomID"] == number))
            triangle = answer["primID"][hit]
            a, b, c = (vertices[triangles[triangle, k]] - eye for k in range(3))
            across = np.cross(b - a, c - a)
            ray = rays[hit]
            with np.errstate(divide="ignore", invalid="ignore"):
                at = np.einsum("ij,ij->i", across, a) / np.einsum("ij,ij->i", across, ray)
            at = np.where(np.isfinite(at), at, view.near + answer["tfar"][hit])
            owner[hit] = self._owner[triangle] if number else OCCLUDER
            depth[hit] = at
            across *= -np.sign(np.einsum("ij,ij->i", across, ray))[:, None]
            normal[hit] = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30)
        return owner, depth, normal


class BoxCaster:
    """Intersects rays with the instances' boxes in float64, before the depth image as given."""

    method = (
        "pixel centres against the instances' boxes (numpy, float64) in front of the depth image "
        "as given; the image itself is not checked without embreex (the extra `scene`)"
    )
    #: Pairs of a box and a pixel that are looked at in one batch.
    CHUNK = 2_000_000

    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    def look(self, view: View, size: Size, given: Floats) -> Sight:
        """What `view` shows, with boxes in place of the real triangles."""
        rays = view.rays(size).reshape(-1, 3)
        owner = np.where(np.isfinite(given), OCCLUDER, SKY).astype(np.int32).reshape(-1)
        depth = given.astype(np.float64).reshape(-1)
        normal = np.zeros((len(rays), 3), np.float32)
        normal[owner == OCCLUDER] = (0.0, 0.0, 1.0)
        boxes, x0, y0, x1, y1 = _pixel_rectangles(self._scene, view, size)
        area = (x1 - x0) * (y1 - y0)
        edges = np.searchsorted(
            np.cumsum(area), np.arange(self.CHUNK, max(int(area.sum()), 1), self.CHUNK)
        )
        for part in np.split(np.arange(len(boxes)), np.unique(edges)):
            turn = np.repeat(part, area[part])
            within = np.arange(len(turn)) - np.repeat(
                np.cumsum(area[part]) - area[part], area[part]
            )
            wide = (x1 - x0)[turn]
            pixel = (y0[turn] + within // wide) * size[1] + x0[turn] + within % wide
            enter, side = self._enter(view, boxes[turn], rays[pixel])
            seen = enter < depth[pixel]
            pixel, box, enter, side = pixel[seen], boxes[turn[seen]], enter[seen], side[seen]
            # Of several boxes on one pixel, the nearest is written last.
            last = np.argsort(-enter, kind="stable")
            pixel, box, enter, side = pixel[last], box[last], enter[last], side[last]
            depth[pixel] = enter
            owner[pixel] = box
            normal[pixel] = np.eye(3, dtype=np.float32)[side] * -np.sign(
                np.take_along_axis(rays[pixel], side[:, None], 1)
            )
        return Sight(
            owner.reshape(size), depth.reshape(size), normal.reshape(*size, 3), self.method
        )

    def firm(
        self, view: View, sight: Sight, given: Floats, instances: npt.ArrayLike
    ) -> npt.NDArray[np.bool_]:
        """Which own a pixel where they are nearer than the depth image by more than `TIE`."""
        return np.isin(instances, sight.owner[given > sight.depth * (1.0 + TIE)])

    def _enter(self, view: View, box: Indices, rays: Floats) -> tuple[Floats, Indices]:
        """Where rays enter their boxes: view depth (infinite: a miss), and which pair of sides."""
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / rays
            a = (self._scene.box_min[box] - view.eye) * inverse
            b = (self._scene.box_max[box] - view.eye) * inverse
        first, last = np.fmin(a, b), np.fmax(a, b)
        side = first.argmax(axis=1)
        enter, leave = np.maximum(first.max(axis=1), view.near), last.min(axis=1)
        last = leave if view.far is None else np.minimum(leave, view.far)
        return np.where(enter <= last, enter, np.inf), side


def make_caster(scene: Scene) -> Caster:
    """Rays if `embreex` is installed, else boxes against the given depth."""
    return RayCaster(scene) if can_cast() else BoxCaster(scene)


@dataclass(frozen=True, eq=False)
class Check:
    """One cull beside the truth."""

    comparison: Comparison
    """Kept against visible."""
    false_culls: list[int]
    """Visible instances that were culled; each one is a bug of the library."""
    hairs: list[int]
    """Culled instances that are visible by a hair only, which the depth image may rightly hide."""
    broken_promises: list[int]
    """Culled instances that the oracle calls visible in the depth image as given; bugs as well."""
    required: int
    """Instances that the promise has to keep: the oracle does not call their boxes hidden.

    A box may show where its tree does not, or between two pixel centres, or behind another tree.
    """

    @property
    def passed(self) -> bool:
        """Nothing that is visible was culled."""
        return not self.false_culls and not self.broken_promises


def check(
    scene: Scene,
    view: View,
    mask: npt.NDArray[np.bool_],
    depth: npt.NDArray[np.float32],
    sight: Sight,
    caster: Caster,
) -> Check:
    """Compares a cull with what is seen, and with the oracle.

    Parameters
    ----------
    scene, view
        What was culled, from where.
    mask : (N,) bool array
        What the cull kept.
    depth : (height, width) float32 array
        The depth image that it culled with, as NDC of ``view.camera(size)``.
    sight, caster
        What is seen in `view`, and the caster that found it out.
    """
    size: Size = depth.shape
    given = linear_depth(depth, view.near, view.far)
    comparison = compare(mask, sight.pixels(len(scene)) > 0)
    firm = caster.firm(view, sight, given, comparison.false_culls)
    # The oracle is slow for boxes that are outside, so float64 sorts most of them out.
    asked = np.flatnonzero(~_outside(scene, view, size))
    boxes = Boxes(scene.box_min[asked], scene.box_max[asked])
    codes = reference.classify(boxes, view.camera(size), depth, kind="reversed_ndc")
    return Check(
        comparison=comparison,
        false_culls=[int(k) for k, real in zip(comparison.false_culls, firm, strict=True) if real],
        hairs=[int(k) for k, real in zip(comparison.false_culls, firm, strict=True) if not real],
        broken_promises=[int(k) for k in asked[(codes == reference.VISIBLE) & ~mask[asked]]],
        required=int((codes != reference.HIDDEN).sum()),
    )


def linear_depth(depth: npt.NDArray[np.float32], near: float, far: float | None = None) -> Floats:
    """View depth of reversed NDC depth; infinite where nothing is. `far` None: infinitely far."""
    ndc = depth.astype(np.float64)
    with np.errstate(divide="ignore"):
        linear: Floats = near / ndc if far is None else near * far / (near + ndc * (far - near))
    linear[ndc == 0.0] = np.inf
    return linear


def _corners(scene: Scene, view: View) -> Floats:
    """``(N, 8, 3)``: the boxes' corners along right, up and forward of the view."""
    corners: Floats = (box_corners(scene.box_min, scene.box_max) - view.eye) @ view.basis().T
    return corners


def _outside(scene: Scene, view: View, size: Size) -> npt.NDArray[np.bool_]:
    """Boxes wholly outside one plane of the view volume, by a margin that float64 cannot miss."""
    x, y, z = np.moveaxis(_corners(scene, view), -1, 0)
    tangent = np.tan(np.radians(view.fov_y_deg) / 2.0)
    wide, tall = tangent * size[1] / size[0] * z, tangent * z
    margin = 1e-6 * (np.abs(x) + np.abs(y) + np.abs(z))
    sides = (
        x < -wide - margin,
        x > wide + margin,
        y < -tall - margin,
        y > tall + margin,
        z < view.near - margin,
    )
    outside: npt.NDArray[np.bool_] = np.any([side.all(axis=1) for side in sides], axis=0)
    return outside


def _pixel_rectangles(
    scene: Scene, view: View, size: Size
) -> tuple[Indices, Indices, Indices, Indices, Indices]:
    """Boxes that may be seen, and the pixels that they can meet: from x0, y0 to before x1, y1."""
    height, width = size
    x, y, z = np.moveaxis(_corners(scene, view), -1, 0)
    tangent = np.tan(np.radians(view.fov_y_deg) / 2.0)
    crosses = z.min(axis=1) <= view.near
    depth = np.where(z > view.near, z, view.near)
    column = (x / depth / (tangent * width / height) + 1.0) / 2.0 * width
    row = (1.0 - y / depth / tangent) / 2.0 * height
    x0, x1 = (np.clip(edge, 0, width) for edge in (np.floor(column.min(1)), np.ceil(column.max(1))))
    y0, y1 = (np.clip(edge, 0, height) for edge in (np.floor(row.min(1)), np.ceil(row.max(1))))
    x0, y0, x1, y1 = (
        np.where(crosses, whole, edge)
        for whole, edge in ((0, x0), (0, y0), (width, x1), (height, y1))
    )
    boxes = np.flatnonzero((x1 > x0) & (y1 > y0) & (z.max(axis=1) > view.near))
    left, top, right, bottom = (edge[boxes].astype(np.intp) for edge in (x0, y0, x1, y1))
    return boxes, left, top, right, bottom
