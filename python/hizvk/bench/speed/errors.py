"""What a cull keeps, and what the float64 oracle says of a sample of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ... import reference
from ...bounds import Boxes, OrientedBoxes, Spheres
from .figures import Error

if TYPE_CHECKING:
    import numpy.typing as npt

    from ...bounds import Bounds
    from ...resources import DepthImage
    from .run import Run

__all__ = ["Judge"]


class Judge:
    """The oracle's verdict about a sample of instances before one depth image.

    Parameters
    ----------
    run : Run
        Where the errors go.
    bounds : Spheres, Boxes or OrientedBoxes
        All instances.
    depth : DepthImage
        What they are hidden by.
    """

    def __init__(self, run: Run, bounds: Bounds, depth: DepthImage) -> None:
        self._run = run
        count = min(run.extent.sample, len(bounds))
        self._sample = np.sort(
            np.random.default_rng(run.seed).choice(len(bounds), count, replace=False)
        )
        codes = reference.classify(
            _part(bounds, self._sample), depth.camera, depth.numpy(), kind="reversed_ndc"
        )
        self._hidden = codes == reference.HIDDEN
        self._visible = codes == reference.VISIBLE

    @property
    def hidden_share(self) -> float:
        """Of the sample, what is hidden for certain."""
        return float(self._hidden.mean()) if len(self._hidden) else 0.0

    def judge(
        self, part: str, label: str, mask: npt.NDArray[np.bool_], *, promises: bool = True
    ) -> Error:
        """Counts what `mask`, ``(N,)``, keeps and what of that is wrong."""
        kept = mask[self._sample]
        error = Error(
            part, label, len(mask), int(mask.sum()), len(kept), int(self._hidden.sum()),
            int((self._hidden & kept).sum()), int((self._visible & ~kept).sum()), promises,
        )  # fmt: skip
        self._run.found.errors.append(error)
        return error


def _part(bounds: Bounds, which: npt.NDArray[np.intp]) -> Bounds:
    if isinstance(bounds, Boxes):
        return Boxes(bounds.min[which], bounds.max[which])
    if isinstance(bounds, Spheres):
        return Spheres(bounds.centers[which], bounds.radii[which])
    return OrientedBoxes(bounds.centers[which], bounds.half_sizes[which], bounds.rotations[which])
