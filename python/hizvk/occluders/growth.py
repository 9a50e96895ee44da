"""Large boxes of inside voxels: grown from many seeds, then picked greedily.

From a seed a cube grows, then a box along one axis after the other, in all orders.
Each step is a bisection, by sums over boxes (Crow, *Summed-area tables for texture mapping*, 1984).
Growing from inside voxels is the way of Darnell's Oxel (2011).

A box is worth its mean silhouette, a quarter of its surface (Cauchy), times the part of its volume
that no box before it has.
By volume alone a thick block would go before a wide wall that hides more.
"""

from __future__ import annotations

from itertools import permutations, product
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from .voxels import Grid

__all__ = ["filled", "grow"]

#: Voxels from which boxes grow, evenly spread over all that are inside.
SEEDS: Final = 2048
#: How far the cube grows before the axes do, as a share of how far it can.
CUBES: Final = (0.0, 0.5, 1.0)
#: Smaller parts of the volume are roundings of its sums.
SOME: Final = 1e-9
#: Smaller volumes have lost bits, or are 0.
SMALLEST: Final = float(np.finfo(np.float64).tiny)


def grow(
    inside: npt.NDArray[np.bool_], grid: Grid, max_boxes: int, min_share: float
) -> npt.NDArray[np.intp]:
    """``(B, 2, 3)``: boxes of inside voxels, the most valuable first.

    A box is given by its first voxel, and by the one after its last.

    Parameters
    ----------
    inside : bool array of ``grid.shape``
        The voxels that boxes may have.
    grid : Grid
        The voxels' sizes.
    max_boxes : int
        At most so many.
    min_share : float
        Each box has at least this part of the inside volume to itself when it is picked.
    """
    seeds = np.argwhere(inside)
    if not len(seeds):
        return np.empty((0, 2, 3), np.intp)
    seeds = seeds[np.unique(np.linspace(0, len(seeds) - 1, SEEDS).astype(np.intp))]
    boxes = _candidates(inside, seeds)
    sides = np.stack(
        [grid.planes[k][boxes[:, 1, k]] - grid.planes[k][boxes[:, 0, k]] for k in range(3)], axis=1
    )
    volume, surface = sides.prod(axis=1), (sides * np.roll(sides, 1, axis=1)).sum(axis=1)
    left = np.where(inside, grid.volumes(), 0.0)
    least = max(min_share, SOME) * left.sum()
    chosen: list[int] = []
    while len(chosen) < max_boxes:
        new = _sums(_table(left), boxes)
        # A box whose volume leaves float64's range is nothing worth.
        share = np.divide(new, volume, out=np.zeros_like(volume), where=volume >= SMALLEST)
        worth = np.where(new >= least, surface * share, 0.0)
        best = int(np.argmax(worth))
        if worth[best] == 0.0:
            break
        chosen.append(best)
        _fill(left, boxes[best])
    return boxes[chosen]


def filled(inside: npt.NDArray[np.bool_], grid: Grid, boxes: npt.NDArray[np.intp]) -> float:
    """The part of the inside volume, 0 to 1, that the boxes ``(B, 2, 3)`` fill together."""
    if not inside.any():
        return 0.0
    left = np.where(inside, grid.volumes(), 0.0)
    total = float(left.sum())
    for box in boxes:
        _fill(left, box)
    return 1.0 - float(left.sum()) / total


def _fill(left: npt.NDArray[np.float64], box: npt.NDArray[np.intp]) -> None:
    (x0, y0, z0), (x1, y1, z1) = box.tolist()
    left[x0:x1, y0:y1, z0:z1] = 0.0


def _candidates(inside: npt.NDArray[np.bool_], seeds: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
    """``(C, 2, 3)``: boxes about the seeds that cannot grow along any axis, each once."""
    table = _table(inside.astype(np.int64))
    shape = np.array(inside.shape)

    def fits(boxes: npt.NDArray[np.intp]) -> npt.NDArray[np.bool_]:
        full: npt.NDArray[np.bool_] = _sums(table, boxes) == (boxes[:, 1] - boxes[:, 0]).prod(
            axis=1
        )
        return full

    def grown(
        boxes: npt.NDArray[np.intp], step: npt.NDArray[np.intp], most: npt.NDArray[np.intp]
    ) -> npt.NDArray[np.intp]:
        """The largest number of steps up to `most` for which ``boxes + steps * step`` fits."""
        low, high = np.zeros(len(boxes), np.intp), most.copy()
        while (low < high).any():
            middle = (low + high + 1) // 2
            full = fits(boxes + middle[:, None, None] * step)
            low, high = np.where(full, middle, low), np.where(full, high, middle - 1)
        return low

    one = np.stack([seeds, seeds + 1], axis=1)
    outwards = np.array([[-1, -1, -1], [1, 1, 1]])
    cube = grown(one, outwards, np.minimum(seeds, shape - 1 - seeds).min(axis=1))
    found = []
    for share, axes in product(CUBES, permutations(range(3))):
        boxes = one + (cube * share).astype(np.intp)[:, None, None] * outwards
        for axis in axes:
            for end in (0, 1):
                step = np.zeros((2, 3), np.intp)
                step[end, axis] = outwards[end, axis]
                most = boxes[:, 0, axis] if end == 0 else shape[axis] - boxes[:, 1, axis]
                boxes = boxes + grown(boxes, step, most)[:, None, None] * step
        found.append(boxes)
    return np.unique(np.concatenate(found).reshape(-1, 6), axis=0).reshape(-1, 2, 3)


def _table(values: npt.NDArray[np.generic]) -> npt.NDArray[np.generic]:
    """Sums over all voxels before each plane of the grid, along all three axes."""
    sums = np.zeros([side + 1 for side in values.shape], values.dtype)
    sums[1:, 1:, 1:] = values.cumsum(axis=0).cumsum(axis=1).cumsum(axis=2)
    return sums


def _sums(table: npt.NDArray[np.generic], boxes: npt.NDArray[np.intp]) -> npt.NDArray[np.generic]:
    """The sum over each box ``(C, 2, 3)``."""
    total = np.zeros(len(boxes), table.dtype)
    for ends in product((0, 1), repeat=3):
        corner = table[tuple(boxes[:, end, axis] for axis, end in enumerate(ends))]
        total = total + (-1) ** (3 - sum(ends)) * corner
    return total
