"""What a cull keeps, and what the float64 oracle says about a sample of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hizvk import reference
from hizvk.measuring.volumes import part_of

from .figures import Error

if TYPE_CHECKING:
    import numpy.typing as npt

    from hizvk.bounds import Bounds
    from hizvk.resources import DepthImage

    from .run import Run

__all__ = ["OracleSample"]


class OracleSample:
    """The oracle's verdicts on a sample of instances before one depth image.

    Parameters
    ----------
    run : Run
        Collects the errors.
    bounds : Spheres, Boxes or OrientedBoxes
        All instances.
    depth : DepthImage
        What hides them.
    """

    def __init__(self, run: Run, bounds: Bounds, depth: DepthImage) -> None:
        self._run = run
        count = min(run.extent.sample, len(bounds))
        self._sample = np.sort(
            np.random.default_rng(run.seed).choice(len(bounds), count, replace=False)
        )
        codes = reference.classify(
            part_of(bounds, self._sample), depth.camera, depth.numpy(), kind="reversed_ndc"
        )
        self._hidden = codes == reference.HIDDEN
        self._visible = codes == reference.VISIBLE

    @property
    def hidden_share(self) -> float:
        """The share of the sample that is certainly hidden."""
        return float(self._hidden.mean()) if len(self._hidden) else 0.0

    def judge(
        self, part: str, label: str, mask: npt.NDArray[np.bool_], *, promises: bool = True
    ) -> Error:
        """Counts what `mask` ``(N,)`` keeps and what of that is wrong."""
        kept = mask[self._sample]
        error = Error(
            part=part,
            label=label,
            instances=len(mask),
            kept=int(mask.sum()),
            sample=len(kept),
            hidden=int(self._hidden.sum()),
            hidden_kept=int((self._hidden & kept).sum()),
            false_culls=int((self._visible & ~kept).sum()),
            promises=promises,
        )
        self._run.found.errors.append(error)
        return error
