"""What can be seen in a city model, from places on a square (docs/jobs/models.md)."""

from __future__ import annotations

import importlib
import importlib.util
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

import hizvk
from hizvk.scenes.embree import embree_scene

from .table import best_ms, load, print_table

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["MANY_RAYS", "Town", "accuracy", "measure", "town"]

Floats = npt.NDArray[np.float64]
#: Pixels per side of each of six faces.
SIDE = 512
#: Rays per triangle where rays go to the surfaces.
RAYS = 50
#: Rays per triangle that stand for the truth.
MANY_RAYS = 1_000


@dataclass(frozen=True)
class Town:
    """The surfaces of the example's town about its places."""

    boxes: hizvk.Boxes
    meshes: list[hizvk.Mesh]
    vertices: Floats
    triangles: npt.NDArray[np.uint32]
    owner: npt.NDArray[np.int64]
    """The surface of each triangle."""
    places: Floats


def town() -> Town:
    """As `examples/model_visibility.py` reads it, with one list of triangles beside the meshes."""
    example = load("examples/model_visibility.py")
    _, surfaces = example.read_surfaces(example.TOWN)
    corners = [np.concatenate(rings) for rings in surfaces]
    boxes = hizvk.Boxes([c.min(axis=0) for c in corners], [c.max(axis=0) for c in corners])
    meshes, vertices, triangles, owner, first = [], [], [], [], 0
    for number, rings in enumerate(surfaces):
        fan = example.fan(rings)
        if fan:
            meshes.append(hizvk.Mesh(rings[0], fan))
            vertices.append(rings[0])
            triangles += [[first + k for k in each] for each in fan]
            owner += [number] * len(fan)
            first += len(rings[0])
    return Town(
        boxes,
        meshes,
        np.concatenate(vertices),
        np.array(triangles, np.uint32),
        np.array(owner),
        np.array(example.PLACES),
    )


def rays_of_pixels() -> npt.NDArray[np.float32]:
    """``(6 * SIDE * SIDE, 3)``: rays through the pixels' centres of six faces."""
    across = (np.arange(SIDE) + 0.5) / SIDE * 2.0 - 1.0
    u, v = np.meshgrid(across, across)
    one = np.ones_like(u)
    faces = [(one, u, v), (-one, u, v), (u, one, v), (u, -one, v), (u, v, one), (u, v, -one)]
    rays = np.concatenate([np.stack(face, axis=-1).reshape(-1, 3) for face in faces])
    return rays.astype(np.float32)


def seen_by_pixels(of: Town, scene: Any, origin: Floats) -> npt.NDArray[np.bool_]:
    """What a ray per pixel hits, for each place."""
    rays = rays_of_pixels()
    found = np.zeros((len(of.places), len(of.boxes)), bool)
    for row, place in zip(found, of.places - origin, strict=True):
        start = np.broadcast_to(place.astype(np.float32), rays.shape)
        hit = np.asarray(scene.run(np.ascontiguousarray(start), rays))
        row[of.owner[np.unique(hit[hit >= 0])]] = True
    return found


def by_open3d(of: Town, origin: Floats) -> Callable[[], npt.NDArray[np.bool_]] | None:
    """The same rays by Open3D, on all processors; None where it is not installed."""
    if importlib.util.find_spec("open3d") is None:
        return None
    open3d: Any = importlib.import_module("open3d")
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles((of.vertices - origin).astype(np.float32), of.triangles)
    rays = rays_of_pixels()

    def cast() -> npt.NDArray[np.bool_]:
        found = np.zeros((len(of.places), len(of.boxes)), bool)
        for row, place in zip(found, of.places - origin, strict=True):
            start = np.broadcast_to(place.astype(np.float32), rays.shape)
            hits = scene.cast_rays(open3d.core.Tensor(np.hstack([start, rays])))
            hit = hits["primitive_ids"].numpy()
            row[of.owner[np.unique(hit[hit < len(of.triangles)])]] = True
        return found

    return cast


def seen_by_targets(of: Town, scene: Any, origin: Floats, rays: int) -> npt.NDArray[np.bool_]:
    """What rays to random points of each surface hit, for each place: as sight lines are done."""
    random = np.random.default_rng(1)
    which = np.repeat(np.arange(len(of.triangles)), rays)
    weights = random.dirichlet((1, 1, 1), len(which))
    points = np.einsum("nk,nkj->nj", weights, of.vertices[of.triangles[which]])
    found = np.zeros((len(of.places), len(of.boxes)), bool)
    for row, place in zip(found, of.places, strict=True):
        start = np.broadcast_to((place - origin).astype(np.float32), points.shape)
        ways = (points - place).astype(np.float32)
        hit = np.asarray(scene.run(np.ascontiguousarray(start), ways))
        row[np.unique(of.owner[hit[hit >= 0]])] = True
    return found


def ways(of: Town) -> dict[str, Callable[[], npt.NDArray[np.bool_]]]:
    """Each way of getting the ``(places, surfaces)`` matrix, by name."""
    # Embree has float32 alone, so the grid's large numbers are taken off.
    origin = of.places.mean(axis=0)
    scene = embree_scene([(of.vertices - origin, of.triangles)])
    found: dict[str, Callable[[], npt.NDArray[np.bool_]]] = {
        f"Embree, {RAYS} rays per triangle": lambda: seen_by_targets(of, scene, origin, RAYS),
        "Embree, a ray per pixel": lambda: seen_by_pixels(of, scene, origin),
    }
    opened = by_open3d(of, origin)
    if opened is not None:
        found["Open3D, a ray per pixel"] = opened
    cameras = [camera for place in of.places for camera in hizvk.cube(place, size=SIDE, near=0.2)]
    groups = np.arange(len(cameras)) // 6

    def swept(**options: Any) -> npt.NDArray[np.bool_]:
        seen = hizvk.sweep(of.boxes, cameras, occluders=of.meshes, groups=groups, **options)
        return np.array([seen.mask(k) for k in range(len(seen))])

    exactly: dict[str, Any] = {"descent": 4096, "fit": "volume"}
    return found | {
        "hizvk, for pixels' centres": lambda: swept(coverage="sample", **exactly),
        "hizvk, conservative": lambda: swept(conservative=True, **exactly),
    }


def accuracy(of: Town, rays: int) -> list[list[str]]:
    """Surfaces found per place, and those that many more rays see and a way does not find."""
    origin = of.places.mean(axis=0)
    scene = embree_scene([(of.vertices - origin, of.triangles)])
    visible = seen_by_targets(of, scene, origin, rays) | seen_by_pixels(of, scene, origin)
    rows = []
    for name, way in ways(of).items():
        found = way()
        missed, vain = (visible & ~found).sum(), (found & ~visible).sum()
        rows.append([name, f"{found.sum()}", f"{missed}", f"{vain}"])
    return rows


def measure(rounds: int, rays: int) -> None:
    """Prints what is found, missed and what it costs per place."""
    of = town()
    print(f"{len(of.boxes)} surfaces, {len(of.places)} places; {rays:,} rays per triangle:\n")
    head: Sequence[str] = ["way", "found", "missed", "kept in vain", "milliseconds per place"]
    best = best_ms(ways(of), rounds)
    rows = [[*row, f"{best[row[0]] / len(of.places):.1f}"] for row in accuracy(of, rays)]
    print_table(head, rows)
