"""A height field as triangles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from .grid import Floats

__all__ = ["Terrain"]


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
        """Vertices and triangles; cells are split from the south-west to the north-east."""
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
