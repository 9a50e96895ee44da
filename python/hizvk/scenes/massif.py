"""The mountains of the demo: a real terrain hides trees."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ..extras import install_line
from .grid import on_grid
from .scene import Scene, View
from .terrain import Terrain

if TYPE_CHECKING:
    import numpy.typing as npt

    from .grid import Floats

__all__ = ["MAP_CORNER", "elevation", "mountains"]

#: Metres of one degree of latitude.
METRES_PER_DEGREE: Final = 111_200.0
#: The south-west corner of the mountains, like an easting and northing of the map (UTM zone 16).
MAP_CORNER: Final = (731_000.0, 4_036_000.0, 0.0)

#: The flight around the massif: kilometres east and north of the corner, metres above the ground.
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


def elevation() -> Terrain:
    """The elevation model that matplotlib ships: 30 by 32 km around the Jacksboro fault.

    The fault is in Tennessee; the data is the USGS's, and public.

    Raises
    ------
    ImportError
        Without matplotlib or its sample data; the text says what to install.
    """
    install = install_line("viz", "scene")
    try:
        from matplotlib.cbook import get_sample_data

        sample: Any = get_sample_data("jacksboro_fault_dem.npz")
        with sample as data:
            heights = np.asarray(data["elevation"], np.float64)[::-1]
            degrees = float(data["dx"]), float(data["dy"])
            latitude = (float(data["ymin"]) + float(data["ymax"])) / 2.0
    except ImportError as error:
        raise ImportError(f"the demo needs matplotlib: {install}") from error
    except FileNotFoundError as error:
        raise ImportError(
            "this matplotlib comes without its sample data (jacksboro_fault_dem.npz), as the "
            f"packages of some distributions do; in a virtual environment: {install}"
        ) from error
    east = degrees[0] * METRES_PER_DEGREE * float(np.cos(np.radians(latitude)))
    north = degrees[1] * METRES_PER_DEGREE
    step: tuple[float, float] = tuple(on_grid([east, north]).tolist())
    return Terrain(np.ascontiguousarray(heights), step, MAP_CORNER)


def mountains(trees: int = 20_000, views: int = 12, *, seed: int = 2010) -> Scene:
    """The terrain of `elevation` hides conifers, seen on a flight around its highest massif.

    Parameters
    ----------
    trees : int
        Instances: 14 to 40 m high, in groves on a disc of 9 km, with their feet in the ground.
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
    vertices = on_grid(vertices)  # (trees, corners, 3)
    triangles = faces + shape.shape[0] * np.arange(trees)[:, None, None]
    ground, ground_triangles = terrain.mesh()
    return Scene(
        name="mountains around the Jacksboro fault, Tennessee "
        "(elevation model: matplotlib's sample data)",
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
    """A tree of width 1 and height 1 with its foot at 0: a three-sided trunk and three cones."""
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
        eye: tuple[float, float, float] = tuple(on_grid([x, y, z]).tolist())
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
    """The smooth curve through `points` at the parameters `where`; 0 is the first point."""
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
