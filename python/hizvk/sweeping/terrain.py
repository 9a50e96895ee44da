"""`viewshed`: which cells of a height field can be seen from a place."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .. import _arguments
from ..bounds import OrientedBoxes
from ..errors import HizWarning
from ..mesh import Mesh
from .cubes import cube
from .entry import sweep

if TYPE_CHECKING:
    from collections.abc import Sequence
    from concurrent.futures import Executor
    from typing import Unpack

    import numpy.typing as npt

    from ..options import CullOptions, OptionKeywords
    from ..progress import ProgressLike

    _Floats = npt.NDArray[np.float64]

__all__ = ["viewshed"]

#: What files of heights write where there is no data: ESRI's grids, and SRTM.
NO_DATA: Final = (-9999.0, -32768.0)
#: No position may be as far away as this; GDAL writes -3.4e38 where there is no data.
TOO_FAR: Final = 1e30


def viewshed(
    heights: npt.ArrayLike,
    cell_size: float | Sequence[float],
    eye: npt.ArrayLike,
    *,
    eye_height: float = 1.7,
    target_height: float = 0.0,
    size: int = 512,
    conservative: bool = True,
    executor: Executor | int | None = None,
    adapter: str | int | None = None,
    progress: ProgressLike = None,
    options: CullOptions | None = None,
    **keywords: Unpack[OptionKeywords],
) -> npt.NDArray[np.bool_]:
    """Which cells of a height field can be seen from a place above it.

    The heights are joined to triangles: each square of four is split from its first corner
    ``heights[i, j]`` to the opposite one, ``heights[i + 1, j + 1]``.
    The cell of a height is the square around it, as wide as the distance to its neighbours.

    **What it promises.**
    A cell that is False is hidden: no ray from the eye meets its part of these triangles, nor
    anything within `target_height` above it, before it meets another of the triangles.
    That needs `conservative` depth.
    Some hidden cells are True, because a cell counts as a whole.

    Parameters
    ----------
    heights : (rows, columns) float array
        At least 2 x 2; NaN where there is no data.
        Nothing is there, so it hides nothing and is False.
    cell_size : float, or a pair of float
        World units between neighbours; a pair is for rows and for columns.
    eye : (row, column)
        Where the eye stands, also between heights.
    eye_height : float
        World units of the eye above the triangles, above 0.
    target_height : float
        How high what is looked at stands above the triangles.
    size : int
        Pixels per side of each of the six depth images around the eye.
        More pixels hide more, and take longer.
    conservative : bool
        True: conservative depth.
        False: plain depth, which is faster, and may hide what shows between centres of pixels.
    executor, adapter, progress, options, **keywords
        As in `sweep`.
        None of `options` and `keywords`: ``descent=4096`` and ``fit="volume"``.

    Returns
    -------
    (rows, columns) bool array
        True for the cells that may be seen.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    SweepInterrupted
        As in `sweep`.

    Warns
    -----
    HizWarning
        If heights are a number that files use for "no data", such as -9999.

    References
    ----------
    The parameters are those of GDAL's ``gdal_viewshed``, which looks at one line of sight per cell.

    Examples
    --------
    A ridge: what lies behind it is hidden, until it is taller than the ridge.

    >>> import numpy as np, hizvk
    >>> heights = np.zeros((9, 40))
    >>> heights[:, 12] = 8.0
    >>> low = hizvk.viewshed(heights, 10.0, (4, 2))
    >>> tall = hizvk.viewshed(heights, 10.0, (4, 2), target_height=50.0)
    >>> bool(low[4, 8]), bool(low[4, 30]), bool(tall[4, 30])
    (True, False, True)
    """
    grid = _heights("heights", heights)
    _hint_at_no_data(grid)
    steps = _steps("cell_size", cell_size)
    row, column = _arguments.numbers_of_shape("eye", eye, (2,)).tolist()
    eye_height = _arguments.number("eye_height", eye_height, above=0.0)
    target_height = _arguments.number("target_height", target_height, at_least=0.0)
    ground = _ground(grid, row, column)
    place = np.array([column * steps[1], row * steps[0], ground + eye_height])
    if options is None and not keywords:
        keywords = {"descent": 4096, "fit": "volume"}

    there = np.isfinite(grid)
    # What is nearer than this along all axes is in no view; no cell is so small.
    near = min(eye_height, *steps) / 16.0
    seen = sweep(
        _boxes(grid, there, steps, target_height),
        cube(place, size=size, near=near),
        occluders=_mesh(grid, steps),
        conservative=conservative,
        executor=executor,
        adapter=adapter,
        block=1,
        progress=progress,
        options=options,
        **keywords,
    ).union()
    result = np.zeros(grid.shape, np.bool_)
    result[there] = seen
    return result


def _heights(name: str, value: Any) -> _Floats:
    grid = np.asarray(_arguments.floats(name, value, ("rows", "columns")), np.float64)
    if min(grid.shape) < 2:
        raise ValueError(f"{name}: expected at least 2 x 2 heights, got {grid.shape}")
    if np.isinf(grid).any():
        raise ValueError(f"{name}: expected finite heights, or NaN for no data, got infinite ones")
    far = np.abs(grid) >= TOO_FAR
    if far.any():
        raise ValueError(
            f"{name}: expected heights below 1e30, or NaN for no data, got {grid[far][0]:g}; if "
            f"that is no data, pass np.where(np.abs({name}) < 1e30, {name}, np.nan)"
        )
    return grid


def _hint_at_no_data(grid: _Floats) -> None:
    for number in NO_DATA:
        count = int(np.count_nonzero(grid == number))
        if count:
            warnings.warn(
                f"heights: {count:,} are {number:g}, which files of heights use for no data, and "
                f"count as deep holes here; pass np.where(heights == {number:g}, np.nan, heights)",
                HizWarning,
                stacklevel=3,  # the caller of viewshed
            )


def _steps(name: str, value: Any) -> tuple[float, float]:
    if np.ndim(value) == 0:
        step = _arguments.number(name, value, above=0.0)
        return step, step
    rows, columns = _arguments.numbers_of_shape(name, value, (2,)).tolist()
    return _arguments.number(name, rows, above=0.0), _arguments.number(name, columns, above=0.0)


def _ground(grid: _Floats, row: float, column: float) -> float:
    """The height of the triangles at a place."""
    rows, columns = grid.shape
    if not (0.0 <= row <= rows - 1 and 0.0 <= column <= columns - 1):
        raise ValueError(
            f"eye: expected a row in 0..{rows - 1} and a column in 0..{columns - 1}, "
            f"got {row:g}, {column:g}"
        )
    i, j = min(int(row), rows - 2), min(int(column), columns - 2)
    u, v = row - i, column - j
    first, last = grid[i, j], grid[i + 1, j + 1]
    # Of the two triangles of a square, the one on the side of the diagonal.
    third, most, least = (grid[i + 1, j], u, v) if u >= v else (grid[i, j + 1], v, u)
    parts = ((first, 1.0 - most), (third, most - least), (last, least))
    ground = sum(weight * height for height, weight in parts if weight > 0.0)
    if not np.isfinite(ground):
        raise ValueError(
            f"eye: expected a place with data, got {row:g}, {column:g}, which has none"
        )
    return float(ground)


def _mesh(grid: _Floats, steps: tuple[float, float]) -> Mesh:
    """The triangles of the height field; x runs along columns and y along rows."""
    rows, columns = grid.shape
    y, x = np.meshgrid(np.arange(rows) * steps[0], np.arange(columns) * steps[1], indexing="ij")
    there = np.isfinite(grid).reshape(-1)
    vertices = np.stack([x, y, np.nan_to_num(grid)], axis=-1).reshape(-1, 3)
    number = np.arange(rows * columns, dtype=np.uint32).reshape(rows, columns)
    a, b = number[:-1, :-1].reshape(-1), number[:-1, 1:].reshape(-1)
    c, d = number[1:, :-1].reshape(-1), number[1:, 1:].reshape(-1)
    triangles = np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])
    return Mesh(vertices, triangles[there[triangles].all(axis=1)])


def _boxes(
    grid: _Floats, there: npt.NDArray[np.bool_], steps: tuple[float, float], target_height: float
) -> OrientedBoxes:
    """A sheared box around the triangles of each cell.

    A cell is cut by the lines through its height and by one diagonal.
    So its triangles lie between planes wherever the middle, the four middles of sides and the four
    corners do.
    """
    rows, columns = grid.shape
    wide = np.pad(grid, 1, constant_values=np.nan)

    def moved(rows_by: int, columns_by: int) -> _Floats:
        """The heights of the neighbours in one direction."""
        return wide[1 + rows_by : 1 + rows_by + rows, 1 + columns_by : 1 + columns_by + columns]

    #: Places within a cell, in half steps of rows and columns, and the heights of the triangles.
    places = {(0, 0): grid}
    for way in (-1, 1):
        places[way, 0] = 0.5 * (grid + moved(way, 0))
        places[0, way] = 0.5 * (grid + moved(0, way))
        # The diagonal of these two corners runs through the cell's own height.
        places[way, way] = 0.5 * (grid + moved(way, way))
        # That of the others joins its neighbours.
        places[way, -way] = 0.5 * (moved(way, 0) + moved(0, -way))
    by_row = np.nan_to_num(places[1, 0] - places[-1, 0]) / steps[0]
    by_column = np.nan_to_num(places[0, 1] - places[0, -1]) / steps[1]
    above = np.stack(
        [
            height - 0.5 * (at[0] * steps[0] * by_row + at[1] * steps[1] * by_column)
            for at, height in places.items()
        ]
    )[:, there]
    hair = 2.0**-40 * (np.abs(grid[there]) + max(steps))  # more than float64 has rounded
    least = np.nanmin(above, axis=0) - hair
    most = np.nanmax(above, axis=0) + hair + target_height
    by_row, by_column = by_row[there], by_column[there]
    row, column = np.nonzero(there)
    centers = np.stack([column * steps[1], row * steps[0], 0.5 * (least + most)], axis=1)
    half = np.stack(
        [
            np.full(len(row), 0.5 * steps[1]),
            np.full(len(row), 0.5 * steps[0]),
            0.5 * (most - least),
        ],
        axis=1,
    )
    axes = np.zeros((len(row), 3, 3))
    axes[:] = np.eye(3)
    axes[:, 2, 0], axes[:, 2, 1] = by_column, by_row
    return OrientedBoxes(centers, half, axes)
