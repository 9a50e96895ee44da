"""Points of a relief, and the images that see them (docs/jobs/points.md)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

import hizvk
from hizvk.scenes.embree import embree_scene

from .table import best_ms, print_table

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["FEW", "Job", "accuracy", "measure"]

Floats = npt.NDArray[np.float64]
SIZE = (480, 640)
#: Points and depth may disagree by so much, in metres.
ALLOWED = 0.01
#: Points whose visibility is compared with rays.
FEW = 20_000


def relief(x: Floats, y: Floats) -> Floats:
    """The height of a wall with bumps that hide one another from the side."""
    height: Floats = 0.15 * np.sin(5.0 * x) * np.cos(4.0 * y)
    return height


@dataclass(frozen=True)
class Job:
    """A wall of 8 x 4 m, points on its triangles, and views with their depth and pictures."""

    vertices: Floats
    triangles: npt.NDArray[np.uint32]
    positions: npt.NDArray[np.float32]
    views: list[tuple[hizvk.Camera, npt.NDArray[np.float32], npt.NDArray[np.uint8]]]
    eyes: Floats


def job(device: hizvk.Device, count: int) -> Job:
    """Four views of the relief, all from the side."""
    random = np.random.default_rng(count)
    x, y = np.meshgrid(np.linspace(-4, 4, 401), np.linspace(-2, 2, 201), indexing="ij")
    vertices = np.stack([x, y, relief(x, y)], axis=-1).reshape(-1, 3)
    first = (np.arange(400)[:, None] * 201 + np.arange(200)).ravel()
    triangles = np.concatenate([first[:, None] + [0, 201, 202], first[:, None] + [0, 202, 1]])
    triangles = triangles.astype(np.uint32)
    weights = random.dirichlet((1, 1, 1), count)
    corners = vertices[triangles[random.integers(len(triangles), size=count)]]
    positions = np.einsum("nk,nkj->nj", weights, corners).astype(np.float32)
    eyes = np.array([(-6, 1, 2.5), (6, 1, 2.5), (-5, -2, 3), (5, 3, 3)], float)
    mesh = device.occluders(vertices, triangles)
    views = []
    for eye in eyes:
        camera = hizvk.Camera.look_at(eye, (0, 0, 0), fov_y_deg=55, size=SIZE, near=0.1)
        picture = random.integers(0, 256, (*SIZE, 3), np.uint8)
        views.append((camera, device.render_depth(mesh, camera).numpy(), picture))
    return Job(vertices, triangles, positions, views, eyes)


def view_depth(ndc: npt.NDArray[np.float32]) -> Floats:
    """Of reversed depth whose near plane is at 0.1."""
    with np.errstate(divide="ignore"):
        return 0.1 / ndc.astype(np.float64)


def by_numpy(of: Job) -> list[npt.NDArray[np.bool_]]:
    """For each view: the depth of the pixel that a point falls into, as most scripts have it."""
    found, colours = [], np.zeros((len(of.positions), 3))
    ones = np.ones((len(of.positions), 1))
    for camera, ndc, picture in of.views:
        x, y, _, w = (np.hstack([of.positions, ones]) @ camera.clip_from_world.T).T
        with np.errstate(divide="ignore", invalid="ignore"):
            column = np.floor((x / w + 1.0) / 2.0 * SIZE[1])
            row = np.floor((1.0 - y / w) / 2.0 * SIZE[0])
        inside = (w > 0.1) & (column >= 0) & (column < SIZE[1]) & (row >= 0) & (row < SIZE[0])
        row, column = (np.where(inside, which, 0).astype(int) for which in (row, column))
        seen = inside & (w <= view_depth(ndc)[row, column] + ALLOWED)
        colours[seen] += picture[row[seen], column[seen]]
        found.append(seen)
    return found


def compiled() -> Callable[..., Any] | None:
    """`by_numpy` as a loop that numba compiles; None where it is not installed."""
    try:
        from numba import njit
    except ImportError:
        return None

    @njit
    def loop(m: Any, points: Any, z: Any, picture: Any, seen: Any, colours: Any) -> None:
        height, width = z.shape
        for i in range(len(points)):
            x, y, s = points[i]
            w = m[3, 0] * x + m[3, 1] * y + m[3, 2] * s + m[3, 3]
            if w < 0.1:
                continue
            u = (m[0, 0] * x + m[0, 1] * y + m[0, 2] * s + m[0, 3]) / w
            v = (m[1, 0] * x + m[1, 1] * y + m[1, 2] * s + m[1, 3]) / w
            column, row = int((u + 1.0) * 0.5 * width), int((1.0 - v) * 0.5 * height)
            if abs(u) < 1.0 and abs(v) < 1.0 and w <= z[row, column] + ALLOWED:
                seen[i] = True
                for k in range(3):
                    colours[i, k] += picture[row, column, k]

    kept: Callable[..., Any] = loop
    return kept


def by_rays(of: Job, scene: Any) -> list[npt.NDArray[np.bool_]]:
    """One ray from each point to each eye, begun a little before the surface."""
    found = []
    for (camera, _, _), eye in zip(of.views, of.eyes, strict=True):
        ways = eye - of.positions
        far = np.linalg.norm(ways, axis=1, keepdims=True)
        start = of.positions + ways / far * 1e-3
        hit = scene.run(start.astype(np.float32), ways.astype(np.float32), query="OCCLUDED")
        found.append((np.asarray(hit) < 0) & camera.project(of.positions).inside)
    return found


def by_hizvk(of: Job, device: hizvk.Device, conservative: bool) -> list[npt.NDArray[np.bool_]]:
    """The masks that `colour_points` takes, of the points with their default guard.

    Conservative depth holds for every ray, and plain depth for those at pixels' centres.
    """
    mesh = device.occluders(of.vertices, of.triangles)
    cloud, some = device.instances(hizvk.Points(of.positions)), hizvk.Tolerance(abs=ALLOWED)
    masks = []
    for camera, ndc, _ in of.views:
        if conservative:
            ndc = device.render_depth(mesh, camera, conservative=True).numpy()
        hiz = device.pyramid(ndc, camera, kind="reversed_ndc", tolerance=some)
        mask = device.cull(cloud, camera, hiz, outputs=["mask"]).mask
        masks.append(mask & camera.project(of.positions).inside)
    return masks


def ways(device: hizvk.Device, of: Job) -> dict[str, Callable[[], object]]:
    """Each way of colouring, by name; rays only decide."""
    some = hizvk.Tolerance(abs=ALLOWED)
    found: dict[str, Callable[[], object]] = {"depth of one pixel, NumPy": lambda: by_numpy(of)}
    loop = compiled()
    if loop is not None:
        kept: Callable[..., Any] = loop

        def numba() -> object:
            colours = np.zeros((len(of.positions), 3))
            for camera, ndc, picture in of.views:
                seen = np.zeros(len(of.positions), np.bool_)
                kept(camera.clip_from_world, of.positions, view_depth(ndc), picture, seen, colours)
            return colours

        found["depth of one pixel, numba"] = numba
    scene = embree_scene([(of.vertices, of.triangles)])
    found["rays at the mesh, Embree"] = lambda: by_rays(of, scene)
    points = hizvk.Points(of.positions)
    found["hizvk.colour_points"] = lambda: hizvk.colour_points(
        points, of.views, kind="reversed_ndc", tolerance=some, device=device
    )
    return found


def accuracy(device: hizvk.Device, count: int) -> list[list[str]]:
    """Against rays at the triangles in every view: what is missed, and kept in vain."""
    of = job(device, count)
    truth = np.array(by_rays(of, embree_scene([(of.vertices, of.triangles)])))
    rows = []
    for name, masks in (
        ("depth of one pixel, NumPy", by_numpy(of)),
        ("hizvk.colour_points", by_hizvk(of, device, False)),
        ("the same with conservative depth", by_hizvk(of, device, True)),
    ):
        found = np.array(masks)
        missed, vain = (truth & ~found).sum(), (found & ~truth).sum()
        rows.append([name, f"{missed:,}", f"{truth.sum():,}", f"{vain:,}", f"{(~truth).sum():,}"])
    return rows


def measure(device: hizvk.Device, rounds: int, counts: tuple[int, ...]) -> None:
    """Prints what is missed, and milliseconds per view."""
    head = ["way", "missed", "of visible", "kept in vain", "of hidden"]
    print_table(head, accuracy(device, FEW))
    columns = []
    for count in counts:
        of = job(device, count)
        best = best_ms(ways(device, of), rounds)
        columns.append({name: ms / len(of.views) for name, ms in best.items()})
    head = ["milliseconds per view", *(f"{count:,} points" for count in counts)]
    print_table(head, [[name, *(f"{c[name]:.1f}" for c in columns)] for name in columns[0]])
