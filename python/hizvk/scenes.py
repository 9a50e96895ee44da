"""Scenes with known geometry: the mountains of the demo, with a tree at every instance, and a small room.

A `Scene` holds the occluders, the instances with their real triangles, and the views.
Positions are float64 and lie far from the origin where the scene does (the mountains stand at
coordinates like those of a map, millions of metres out).
All of them are multiples of 1/64 m, so that ``scene.vertices - scene.origin`` is exact in float32
and the ray caster that checks a cull starts from the same numbers as the cull.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from .camera import Camera

if TYPE_CHECKING:
    from ._arguments import Size

__all__ = ["Scene", "Terrain", "View", "box_mesh", "elevation", "mountains", "room"]

Floats: TypeAlias = npt.NDArray[np.float64]

#: All positions are multiples of this, in metres.
GRID: Final = 1.0 / 64.0
#: Metres of one degree of latitude, and the middle latitude of the elevation model in degrees.
METRES_PER_DEGREE: Final = 111_200.0
#: Where the south-west corner of the mountains stands, like an easting and northing of the map (UTM zone 16).
MAP_CORNER: Final = (731_000.0, 4_036_000.0, 0.0)
#: What installs the packages that the demo uses (the extras `viz` and `scene` of pyproject.toml, by
#: name: hizvk itself is on no index, so that ``hizvk[viz]`` would not be found).
INSTALL_LINE: Final = "pip install matplotlib embreex"

#: The flight around the massif: kilometres east and north of the corner, and metres above the ground.
FLIGHT: Final = (
    (18.1, 9.3, 420.0),
    (16.9, 10.2, 170.0),
    (15.9, 10.8, 110.0),
    (15.1, 11.0, 75.0),
    (14.1, 11.6, 70.0),
    (12.9, 11.9, 90.0),
    (12.1, 10.9, 70.0),
    (11.3, 9.6, 80.0),
    (11.0, 8.3, 70.0),
    (11.7, 7.1, 70.0),
    (12.7, 6.3, 90.0),
    (14.0, 5.9, 150.0),
    (15.2, 6.5, 190.0),
    (15.6, 7.8, 110.0),
    (15.5, 9.2, 90.0),
    (15.3, 10.6, 90.0),
)
#: The disc where trees stand: kilometres east and north of the corner, and its radius.
FOREST: Final = (13.6, 8.6, 4.7)


@dataclass(frozen=True)
class View:
    """A pinhole view, apart from `hizvk.Camera` so that rays do not come from the code under test.

    Parameters
    ----------
    name : str
        For reports.
    eye, target : tuple of three float
        World positions.
    fov_y_deg : float
        The full vertical angle of view.
    near : float
        Distance of the near plane.
    up : tuple of three float
        What is up in the image.
    far : float, optional
        Distance of the far plane; None: infinitely far.
    """

    name: str
    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    fov_y_deg: float
    near: float
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    far: float | None = None

    def camera(self, size: Size) -> Camera:
        """The library's camera for this view, reversed Z."""
        return Camera.look_at(
            self.eye,
            self.target,
            up=self.up,
            fov_y_deg=self.fov_y_deg,
            size=size,
            near=self.near,
            far=self.far,
        )

    def basis(self) -> Floats:
        """``(3, 3)``: the unit vectors right, up and forward as rows."""
        forward = np.subtract(self.target, self.eye)
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(right, forward), forward])

    def rays(self, size: Size, shift: tuple[float, float] = (0.0, 0.0)) -> Floats:
        """``(height, width, 3)``: directions through the pixel centres, of view depth 1.

        `shift` moves the centres by so many pixels to the right and down.
        """
        height, width = size
        tangent = np.tan(np.radians(self.fov_y_deg) / 2.0)
        x = ((np.arange(width) + 0.5 + shift[0]) / width * 2.0 - 1.0) * tangent * width / height
        y = (1.0 - (np.arange(height) + 0.5 + shift[1]) / height * 2.0) * tangent
        right, up, forward = self.basis()
        rays: Floats = x[None, :, None] * right + y[:, None, None] * up + forward
        return rays


@dataclass(frozen=True, eq=False)
class Terrain:
    """A height field with its south-west corner at `corner`; row 0 is the southernmost."""

    heights: Floats
    """``(rows, columns)``, metres."""
    step: tuple[float, float]
    """Metres between columns (to the east) and rows (to the north)."""
    corner: tuple[float, float, float]
    """World position of ``heights[0, 0]`` at height 0."""

    def mesh(self) -> tuple[Floats, npt.NDArray[np.uint32]]:
        """Vertices and triangles; each cell is cut from its south-west to its north-east corner."""
        rows, columns = self.heights.shape
        x, y = np.meshgrid(np.arange(columns) * self.step[0], np.arange(rows) * self.step[1])
        vertices = np.stack([x, y, self.heights], axis=-1).reshape(-1, 3) + self.corner
        number = np.arange(rows * columns, dtype=np.uint32).reshape(rows, columns)
        sw, se, nw, ne = (
            part.reshape(-1)
            for part in (number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:])
        )
        return vertices, np.concatenate(
            [np.stack([sw, se, ne], axis=1), np.stack([sw, ne, nw], axis=1)]
        )

    def _cells(
        self, x: Floats, y: Floats
    ) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp], Floats, Floats]:
        rows, columns = self.heights.shape
        u = np.clip((x - self.corner[0]) / self.step[0], 0.0, columns - 1.0)
        v = np.clip((y - self.corner[1]) / self.step[1], 0.0, rows - 1.0)
        column = np.minimum(u.astype(np.intp), columns - 2)
        row = np.minimum(v.astype(np.intp), rows - 2)
        return row, column, u - column, v - row

    def height_at(self, x: Floats, y: Floats) -> Floats:
        """The height of the mesh's surface at world positions."""
        row, column, u, v = self._cells(x, y)
        h = self.heights
        sw, se, nw, ne = (
            h[row, column],
            h[row, column + 1],
            h[row + 1, column],
            h[row + 1, column + 1],
        )
        east_first = sw + u * (se - sw) + v * (ne - se)
        north_first = sw + v * (nw - sw) + u * (ne - nw)
        surface: Floats = np.where(u >= v, east_first, north_first)
        return surface

    def normal_at(self, x: Floats, y: Floats) -> Floats:
        """Unit normals of the smoothed surface, for shading."""
        north: Floats = np.asarray(np.gradient(self.heights, self.step[1], axis=0))
        east: Floats = np.asarray(np.gradient(self.heights, self.step[0], axis=1))
        row, column, u, v = self._cells(x, y)

        def smooth(grid: Floats) -> Floats:
            south = grid[row, column] * (1.0 - u) + grid[row, column + 1] * u
            return (
                south * (1.0 - v)
                + (grid[row + 1, column] * (1.0 - u) + grid[row + 1, column + 1] * u) * v
            )

        normal = np.stack([-smooth(east), -smooth(north), np.ones_like(u)], axis=-1)
        unit: Floats = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
        return unit


@dataclass(frozen=True, eq=False)
class Scene:
    """Occluders, instances with their real triangles and exact boxes, and views."""

    name: str
    """What it is, and where its data is from."""
    origin: tuple[float, float, float]
    """A point amid the scene; positions relative to it are exact in float32."""
    vertices: Floats
    """``(V, 3)``: the occluders'."""
    triangles: npt.NDArray[np.uint32]
    """``(T, 3)``: the occluders'."""
    instance_vertices: Floats
    """``(M, 3)``: of all instances."""
    instance_triangles: npt.NDArray[np.uint32]
    """``(K, 3)``: of all instances."""
    owner: npt.NDArray[np.int32]
    """``(K,)``: the instance that a triangle belongs to."""
    box_min: Floats
    """``(N, 3)``: the least corner of each instance, exactly."""
    box_max: Floats
    """``(N, 3)``: the greatest corner of each instance, exactly."""
    views: tuple[View, ...]
    """From where to look."""
    terrain: Terrain | None = None
    """The height field of the occluders, if they are one."""

    def __len__(self) -> int:
        """The number of instances."""
        return len(self.box_min)


def box_mesh(low: npt.ArrayLike, high: npt.ArrayLike) -> tuple[Floats, npt.NDArray[np.uint32]]:
    """Vertices and triangles of axis-aligned boxes; their fronts are outside.

    Parameters
    ----------
    low, high : (N, 3)
        Corners.

    Returns
    -------
    vertices : (8 N, 3) float64 array triangles : (12 N, 3) uint32 array
        Twelve in a row for each box.
    """
    low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
    corner = (np.arange(8)[:, None] >> np.arange(3)) & 1
    vertices = np.where(corner, high[:, None], low[:, None]).reshape(-1, 3)
    sides = np.array(
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    )
    one = np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]])
    triangles = (one + 8 * np.arange(len(low))[:, None, None]).reshape(-1, 3)
    return vertices, triangles.astype(np.uint32)


def elevation() -> Terrain:
    """The elevation model that matplotlib ships: 30 by 32 km around the Jacksboro fault, Tennessee (public, USGS).

    Raises
    ------
    ImportError
        Without matplotlib or its sample data; the text says what to install.
    """
    try:
        from matplotlib.cbook import get_sample_data

        sample: Any = get_sample_data("jacksboro_fault_dem.npz")
        with sample as data:
            heights = np.asarray(data["elevation"], np.float64)[::-1]
            degrees = float(data["dx"]), float(data["dy"])
            latitude = (float(data["ymin"]) + float(data["ymax"])) / 2.0
    except ImportError as error:
        raise ImportError(f"the demo needs matplotlib: {INSTALL_LINE}") from error
    except FileNotFoundError as error:
        raise ImportError(
            f"this matplotlib comes without its sample data (jacksboro_fault_dem.npz), as the packages of some "
            f"distributions do; in a virtual environment: {INSTALL_LINE}"
        ) from error
    east = degrees[0] * METRES_PER_DEGREE * float(np.cos(np.radians(latitude)))
    north = degrees[1] * METRES_PER_DEGREE
    return Terrain(np.ascontiguousarray(heights), (_on_grid(east), _on_grid(north)), MAP_CORNER)


def mountains(trees: int = 20_000, views: int = 12, *, seed: int = 2010) -> Scene:
    """The terrain of `elevation` as the occluder, with conifers as instances and a flight around its highest massif.

    Parameters
    ----------
    trees : int
        Instances; they stand in groves on a disc of 9 km, feet in the ground, 14 to 40 m high.
    views : int
        Stations of the flight.
    seed : int
        Same seed, same trees.

    Raises
    ------
    ImportError
        As `elevation`.
    """
    terrain = elevation()
    rng = np.random.default_rng(seed)
    x, y = _groves(rng, trees)
    height = rng.uniform(14.0, 28.0, trees) + 12.0 * rng.random(trees) ** 4
    width = height * rng.uniform(0.34, 0.46, trees)
    shape, faces = _conifer()
    turn = rng.uniform(0.0, 2.0 * np.pi, trees)[:, None]
    local_x = width[:, None] * (np.cos(turn) * shape[:, 0] - np.sin(turn) * shape[:, 1])
    local_y = width[:, None] * (np.sin(turn) * shape[:, 0] + np.cos(turn) * shape[:, 1])
    foot = terrain.height_at(x, y) - 1.0  # in the ground, also where it slopes
    local_z = height[:, None] * shape[:, 2] + foot[:, None]
    vertices = np.stack([x[:, None] + local_x, y[:, None] + local_y, local_z], axis=-1)
    vertices = np.round(vertices / GRID) * GRID  # (trees, corners, 3)
    triangles = faces + shape.shape[0] * np.arange(trees)[:, None, None]
    ground, ground_triangles = terrain.mesh()
    return Scene(
        name="mountains around the Jacksboro fault, Tennessee (elevation model: matplotlib's sample data)",
        origin=(
            MAP_CORNER[0] + 1000.0 * round(FOREST[0]),
            MAP_CORNER[1] + 1000.0 * round(FOREST[1]),
            0.0,
        ),
        vertices=ground,
        triangles=ground_triangles,
        instance_vertices=vertices.reshape(-1, 3),
        instance_triangles=triangles.reshape(-1, 3).astype(np.uint32),
        owner=np.repeat(np.arange(trees, dtype=np.int32), len(faces)),
        box_min=vertices.min(axis=1),
        box_max=vertices.max(axis=1),
        views=_flight(terrain, views),
        terrain=terrain,
    )


def room(seed: int = 1999, crates: int = 240) -> Scene:
    """A floor of 16 by 12 m whose two walls with a door each hide much of the crates on it; four views.

    Walls, floor and crates are axis-aligned boxes, so that boxes are the instances' real geometry.
    The world is the origin's surroundings, up is z, and all coordinates are multiples of 1/64 m.

    Parameters
    ----------
    seed : int
        Same seed, same crates.
    crates : int
        Instances; more than 240 are smaller, so that they stand no closer.
    """
    walls = np.array(
        [
            [0.0, 0.0, -0.25, 16.0, 12.0, 0.0],
            [0.0, -0.25, 0.0, 16.0, 0.0, 3.0],
            [0.0, 12.0, 0.0, 16.0, 12.25, 3.0],
            [-0.25, 0.0, 0.0, 0.0, 12.0, 3.0],
            [16.0, 0.0, 0.0, 16.25, 12.0, 3.0],
            [5.0, 0.0, 0.0, 5.25, 7.0, 3.0],
            [5.0, 8.0, 0.0, 5.25, 12.0, 3.0],
            [5.0, 7.0, 2.0, 5.25, 8.0, 3.0],
            [10.0, 0.0, 0.0, 10.25, 3.0, 3.0],
            [10.0, 4.0, 0.0, 10.25, 12.0, 3.0],
            [10.0, 3.0, 2.0, 10.25, 4.0, 3.0],
        ]
    )
    rng = np.random.default_rng(seed)
    scale = min(1.0, float(np.sqrt(240.0 / crates)))
    size = (
        np.round(scale * rng.uniform([0.1, 0.1, 0.1], [0.7, 0.7, 1.1], (crates, 3)) / GRID) * GRID
    )
    size = np.maximum(size, GRID)
    bay = rng.choice([0.1, 5.35, 10.35], crates)
    low = np.stack(
        [bay + rng.uniform(0.0, 3.8, crates), rng.uniform(0.1, 11.1, crates), np.zeros(crates)],
        axis=1,
    )
    low = np.round(low / GRID) * GRID
    vertices, triangles = box_mesh(walls[:, :3], walls[:, 3:])
    crate_vertices, crate_triangles = box_mesh(low, low + size)
    views = (
        View("first bay, through the door", (1.0, 7.5, 1.625), (5.0, 7.5, 1.25), 70.0, 0.0625),
        View("first bay, along the wall", (2.5, 11.5, 1.75), (3.5, 0.5, 0.5), 60.0, 0.0625),
        View("middle bay", (5.75, 11.5, 1.75), (10.0, 2.5, 1.0), 75.0, 0.0625),
        View("last bay", (15.5, 11.5, 2.5), (10.5, 1.0, 0.5), 65.0, 0.0625),
    )
    return Scene(
        name="three bays of a storeroom",
        origin=(0.0, 0.0, 0.0),
        vertices=vertices,
        triangles=triangles,
        instance_vertices=crate_vertices,
        instance_triangles=crate_triangles,
        owner=np.repeat(np.arange(crates, dtype=np.int32), 12),
        box_min=low,
        box_max=low + size,
        views=views,
    )


def _on_grid(value: float) -> float:
    return round(value / GRID) * GRID


def _groves(rng: np.random.Generator, count: int) -> tuple[Floats, Floats]:
    """World positions on the disc of `FOREST`: dense in groves, thin between them."""
    wavelength = rng.uniform(350.0, 1800.0, 40)
    heading, phase = rng.uniform(0.0, 2.0 * np.pi, (2, 40))
    along = np.stack([np.cos(heading), np.sin(heading)]) * (2.0 * np.pi / wavelength)
    placed = [np.empty((0, 2))]
    while sum(map(len, placed)) < count:
        spot = rng.uniform(-1.0, 1.0, (4 * count + 64, 2))
        spot = 1000.0 * FOREST[2] * spot[(spot**2).sum(axis=1) < 1.0]
        wave = np.cos(spot @ along + phase).sum(axis=1) / np.sqrt(20.0)
        density = 0.04 + 0.96 / (1.0 + np.exp(-6.0 * (wave - 0.9)))
        placed.append(spot[rng.random(len(spot)) < density])
    x, y = np.concatenate(placed)[:count].T
    return x + MAP_CORNER[0] + 1000.0 * FOREST[0], y + MAP_CORNER[1] + 1000.0 * FOREST[1]


def _conifer() -> tuple[Floats, npt.NDArray[np.intp]]:
    """A unit tree (width 1, height 1, its foot at 0): a three-sided trunk and three cones of seven sides."""
    corners: list[tuple[float, float, float]] = []
    faces: list[tuple[int, int, int]] = []
    for sides, bottom, top, radius in (
        (3, 0.0, 0.4, 0.05),
        (7, 0.14, 0.56, 0.5),
        (7, 0.36, 0.78, 0.37),
        (7, 0.6, 1.0, 0.24),
    ):
        first = len(corners)
        angles = 2.0 * np.pi * np.arange(sides) / sides + bottom
        corners += [(radius * float(np.cos(a)), radius * float(np.sin(a)), bottom) for a in angles]
        corners += [(0.0, 0.0, top), (0.0, 0.0, bottom + 0.03)]
        for k in range(sides):
            a, b = first + k, first + (k + 1) % sides
            faces += [(a, b, first + sides), (b, a, first + sides + 1)]
    return np.array(corners), np.array(faces)


def _flight(terrain: Terrain, count: int) -> tuple[View, ...]:
    """Stations at equal distances along `FLIGHT`, each looking along the path and a little down."""
    path = np.array(FLIGHT)
    path[:, :2] *= 1000.0
    fine = np.linspace(0.0, len(path) - 1.0, 1201)
    curve = _catmull_rom(path, fine)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve[:, :2], axis=0).T))])
    views = []
    for number in range(count):
        # The last tenth is kept for looking ahead.
        here = 0.9 * length[-1] * (number / max(count - 1, 1))
        east, north, above = (np.interp(here, length, curve[:, k]) for k in range(3))
        ahead_east, ahead_north = (
            np.interp(here + 0.09 * length[-1], length, curve[:, k]) for k in range(2)
        )
        x, y = MAP_CORNER[0] + east, MAP_CORNER[1] + north
        z = float(terrain.height_at(np.array([x]), np.array([y]))[0]) + above
        reach = float(np.hypot(ahead_east - east, ahead_north - north))
        eye = (_on_grid(x), _on_grid(y), _on_grid(z))
        target = (
            x + ahead_east - east,
            y + ahead_north - north,
            z - reach * (0.07 + 0.0006 * min(above, 300.0)),
        )
        views.append(
            View(
                f"{east / 1000:.1f} km E, {north / 1000:.1f} km N, {above:.0f} m up",
                eye,
                target,
                46.0,
                1.0,
            )
        )
    return tuple(views)


def _catmull_rom(points: Floats, where: Floats) -> Floats:
    """The smooth curve through `points` at the parameters `where` (0 is the first point, 1 the second, ...)."""
    padded = np.concatenate(
        [2.0 * points[:1] - points[1:2], points, 2.0 * points[-1:] - points[-2:-1]]
    )
    start = np.minimum(where.astype(np.intp), len(points) - 2)
    t = (where - start)[:, None]
    a, b, c, d = (padded[start + k] for k in range(4))
    curve: Floats = b + 0.5 * t * (
        c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a))
    )
    return curve
