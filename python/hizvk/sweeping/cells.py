"""`visible_sets`: what is seen from samples of cells, as one row per cell."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import _arguments
from ..bounds import Boxes
from .cubes import cube
from .entry import sweep

if TYPE_CHECKING:
    from collections.abc import Sequence
    from concurrent.futures import Executor
    from typing import Unpack

    import numpy.typing as npt

    from .._types import FaceCull
    from ..bounds import Bounds
    from ..camera import Camera
    from ..mesh import MeshLike
    from ..options import CullOptions, OptionKeywords
    from ..progress import ProgressLike
    from .result import Sweep

__all__ = ["visible_sets"]


def visible_sets(
    bounds: Bounds,
    cells: Boxes,
    *,
    occluders: MeshLike | Sequence[MeshLike],
    samples: int = 2,
    size: int = 256,
    near: float,
    far: float | None = None,
    cull: FaceCull = "none",
    conservative: bool = True,
    executor: Executor | int | None = None,
    block: int | None = None,
    adapter: str | int | None = None,
    resume: Sweep | None = None,
    progress: ProgressLike = None,
    options: CullOptions | None = None,
    **keywords: Unpack[OptionKeywords],
) -> Sweep:
    """What can be seen from each of C cells: their potentially visible sets, sampled.

    Each cell is looked out of from viewpoints on a grid, its faces included.
    From each viewpoint six cameras see all directions (`cube`).
    The row of a cell is what any of them keeps.

    **These are samples of viewpoints, and no proof for the cell.**
    With `conservative` depth, whatever any ray from a viewpoint meets is in the set.
    From between two viewpoints an instance may show through a gap that neither sees.
    More samples make this rarer.
    For a cell inside of which nothing but a camera moves, add the viewpoints of its path.

    Parameters
    ----------
    bounds : Spheres, Boxes, OrientedBoxes or Points
        The N instances.
    cells : Boxes
        The C cells, finite.
    occluders, cull
        As in `sweep`.
    samples : int
        Viewpoints along each axis of a cell: 1 is its middle, 2 its corners, 3 the corners, the
        middles of edges and faces, and the middle.
    size : int
        Pixels per side of each of the six images.
    near, far : float
        As in `cube`.
        What is nearer than `near` to a viewpoint along all axes is not seen from there.
    conservative : bool
        True: conservative depth.
        False: plain depth, which is faster, and may hide what shows between centres of pixels.
    executor, block, adapter, resume, progress, options, **keywords
        As in `sweep`.

    Returns
    -------
    Sweep
        ``(C, N)``: a row per cell.
        `Sweep.csr` is the sparse matrix.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    SweepInterrupted
        As in `sweep`.

    Examples
    --------
    A wall between two cells: each sees the ball on its side.

    >>> import numpy as np, hizvk
    >>> wall = hizvk.Mesh(
    ...     [(0, -9, -9), (0, 9, -9), (0, 9, 9), (0, -9, 9)], [[0, 1, 2], [0, 2, 3]]
    ... )
    >>> balls = hizvk.Spheres([(-3.0, 0, 0), (3.0, 0, 0)], 0.2)
    >>> cells = hizvk.Boxes([(-2.0, -1, -1), (1.0, -1, -1)], [(-1.0, 1, 1), (2.0, 1, 1)])
    >>> seen = hizvk.visible_sets(balls, cells, occluders=wall, size=64, near=0.1)
    >>> [seen.mask(cell).tolist() for cell in range(2)]
    [[True, False], [False, True]]
    """
    _arguments.instance("cells", cells, Boxes, "Boxes")
    low, high = np.asarray(cells.min, np.float64), np.asarray(cells.max, np.float64)
    if not len(low):
        raise ValueError("cells: expected at least one cell, got none")
    fits = np.isfinite(low).all(axis=1) & np.isfinite(high).all(axis=1) & (low <= high).all(axis=1)
    if not fits.all():
        wrong = int(np.flatnonzero(~fits)[0])
        raise ValueError(
            f"cells: expected finite corners with min <= max, got cell {wrong} from "
            f"{low[wrong].tolist()} to {high[wrong].tolist()}"
        )
    samples = _arguments.integer("samples", samples, low=1, high=64)
    if occluders is None:
        raise TypeError("occluders: expected a mesh or a sequence of meshes, got None")
    cameras: list[Camera] = []
    groups: list[int] = []
    for number, eye in _viewpoints(low, high, samples):
        cameras += cube(eye, size=size, near=near, far=far)
        groups += [number] * 6
    return sweep(
        bounds,
        cameras,
        occluders=occluders,
        cull=cull,
        conservative=conservative,
        groups=groups,
        executor=executor,
        block=block,
        adapter=adapter,
        resume=resume,
        progress=progress,
        options=options,
        **keywords,
    )


def _viewpoints(
    low: npt.NDArray[np.float64], high: npt.NDArray[np.float64], samples: int
) -> list[tuple[int, npt.NDArray[np.float64]]]:
    """The viewpoints of all cells with the cells' numbers; each once, whatever the cell's shape."""
    along = [0.5] if samples == 1 else np.linspace(0.0, 1.0, samples).tolist()
    grid = np.stack(np.meshgrid(along, along, along, indexing="ij"), axis=-1).reshape(-1, 3)
    found = []
    for number, (least, most) in enumerate(zip(low, high, strict=True)):
        points = least * (1.0 - grid) + most * grid
        # A flat cell has fewer.
        found += [(number, point) for point in np.unique(points, axis=0)]
    return found
