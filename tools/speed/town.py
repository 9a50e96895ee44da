"""A town from a seed whose walls hide a chosen share of a crowd, coherently.

The eye stands on a square.
Two rows of houses, with lanes between them, stand across the whole view.
One part of the crowd is behind them, and the other is on the square before them.
So what is hidden lies together, as it does in towns, and its share can be chosen.
All of the crowd is inside the view volume, so nothing is culled for free.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from hizvk.bounds import Boxes, OrientedBoxes, Spheres
from hizvk.scenes import View, box_mesh

if TYPE_CHECKING:
    import numpy.typing as npt

    from hizvk.scenes.grid import Floats

__all__ = ["Town", "crowd", "make", "oriented", "spheres"]

#: The eye, in metres and degrees.
#: The crowd is inside the view of all images from square to 16:9.
VIEW: Final = View("square", (0.0, 0.0, 2.0), (0.0, 100.0, 2.0), 60.0, 0.125)
#: Distances of the two rows of houses, and of the crowd before and behind them, in metres.
ROWS: Final = (120.0, 160.0)
BEFORE: Final = (10.0, 90.0)
BEHIND: Final = (210.0, 1000.0)
#: Half the width of the crowd, divided by its distance: inside the narrowest image, the square one.
HALF_WIDTH: Final = 0.55
#: The share of the crowd behind the houses that shows through the lanes, about.
THROUGH_LANES: Final = 0.006
#: Instances that are made at once.
BATCH: Final = 1 << 20


@dataclass(frozen=True)
class Town:
    """Walls, a crowd and a view."""

    vertices: Floats
    """``(V, 3)``: of the walls and the ground."""
    triangles: npt.NDArray[np.uint32]
    """``(T, 3)``."""
    low: npt.NDArray[np.float32]
    """``(N, 3)``: the least corners of the crowd's boxes, in no order."""
    high: npt.NDArray[np.float32]
    """``(N, 3)``: the greatest corners."""
    view: View

    @property
    def boxes(self) -> Boxes:
        """The crowd."""
        return Boxes(self.low, self.high)


def make(count: int, hidden: float, seed: int) -> Town:
    """A town.

    Parameters
    ----------
    count : int
        Instances.
    hidden : float
        The share of them that the walls hide, about: 0 to 1.
    seed : int
        Same seed, same town.
    """
    rng = np.random.default_rng(seed)
    vertices, triangles = box_mesh(*_walls(rng))
    low, high = crowd(count, min(hidden / (1.0 - THROUGH_LANES), 1.0), seed)
    return Town(vertices, triangles, low, high, VIEW)


def _walls(rng: np.random.Generator) -> tuple[Floats, Floats]:
    """The ground and the houses, which are high enough to hide all that stands behind them."""
    low, high = [(-2000.0, -10.0, -1.0)], [(2000.0, 2000.0, 0.0)]
    for distance in ROWS:
        x = -1.3 * distance
        while x < 1.3 * distance:
            width, depth = rng.uniform(8.0, 24.0), rng.uniform(3.0, 5.0)
            low.append((x, distance, 0.0))
            high.append((x + width, distance + depth, rng.uniform(45.0, 70.0)))
            x += width + (rng.uniform(3.0, 10.0) if rng.random() < 0.4 else 0.0)
    return np.round(np.array(low) * 64.0) / 64.0, np.round(np.array(high) * 64.0) / 64.0


def crowd(
    count: int, behind: float, seed: int
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Float32 corners ``(N, 3)`` of boxes of 0.3 to 3 m, a share of them behind the houses."""
    low, high = np.empty((2, count, 3), np.float32)
    for batch, first in enumerate(range(0, count, BATCH)):
        rng = np.random.default_rng([seed, batch])
        part = slice(first, min(first + BATCH, count))
        u = rng.random((part.stop - first, 7), dtype=np.float32)
        back = u[:, 6:] < behind
        near, far = np.where(back, BEHIND[0], BEFORE[0]), np.where(back, BEHIND[1], BEFORE[1])
        # The same number on every square metre.
        y = np.sqrt(near**2 + u[:, 1:2] * (far**2 - near**2))
        x = (2.0 * u[:, :1] - 1.0) * HALF_WIDTH * y
        z = u[:, 2:3] * np.where(back, 25.0, 4.0)
        size = np.float32(0.3) + np.float32(2.7) * u[:, 3:6] ** 2
        low[part] = np.concatenate([x, y, z], axis=1)
        np.add(low[part], size, out=high[part])
    return low, high


def spheres(town: Town) -> Spheres:
    """Spheres around the boxes of a crowd."""
    return Spheres((town.low + town.high) / 2, np.linalg.norm(town.high - town.low, axis=1) / 2)


def oriented(town: Town, seed: int) -> OrientedBoxes:
    """Boxes with the crowd's places and sizes, turned about the vertical."""
    yaw = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(town.low)).astype(np.float32)
    rotations = np.zeros((len(yaw), 3, 3), np.float32)
    rotations[:, 0, 0] = rotations[:, 1, 1] = np.cos(yaw)
    rotations[:, 1, 0] = np.sin(yaw)
    rotations[:, 0, 1] = -rotations[:, 1, 0]
    rotations[:, 2, 2] = 1.0
    return OrientedBoxes((town.low + town.high) / 2, (town.high - town.low) / 2, rotations)
