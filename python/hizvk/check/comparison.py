"""A cull beside the truth: false culls, which are bugs, and false keeps, which are a cost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .. import _arguments
from . import reference
from .sides import sides

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["Comparison", "compare"]


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """A mask beside the truth."""

    false_culls: npt.NDArray[np.intp]
    """Instances that are visible and were culled: each one is a bug."""
    false_keeps: npt.NDArray[np.intp]
    """Instances that are hidden and were kept: a cost."""
    total: int
    """Instances."""
    kept: int
    """Instances that the mask keeps."""
    visible: int
    """Instances that are visible in truth."""
    hidden: int
    """Instances that are hidden in truth (outside the view, or occluded)."""
    undecided: int
    """Instances that the truth leaves open; they count as neither."""

    @property
    def culled(self) -> int:
        """Instances that the mask culls."""
        return self.total - self.kept

    @property
    def kept_share(self) -> float:
        """`kept` / `total`; 0 for no instances."""
        return self.kept / self.total if self.total else 0.0

    @property
    def false_keep_share(self) -> float:
        """Of the hidden, the share that was kept; 0 where nothing is hidden."""
        return len(self.false_keeps) / self.hidden if self.hidden else 0.0

    @property
    def kept_over_visible(self) -> float:
        """`kept` / `visible`: 1 is perfect; infinite where only hidden instances were kept."""
        if self.visible:
            return self.kept / self.visible
        return float("inf") if self.kept else 1.0

    def __repr__(self) -> str:
        return f"<Comparison: {self}>"

    def __str__(self) -> str:
        return (
            f"{self.total:,} instances, {self.kept:,} kept, {self.visible:,} visible, "
            f"{self.hidden:,} hidden, {self.undecided:,} undecided; "
            f"{len(self.false_culls):,} wrongly culled, {len(self.false_keeps):,} wrongly kept "
            f"({100.0 * self.false_keep_share:.1f} % of the hidden)"
        )


def compare(mask: npt.ArrayLike, truth: npt.ArrayLike) -> Comparison:
    """Compares what a cull kept with what is visible.

    Parameters
    ----------
    mask : (N,) bool array
        True for what was kept, as `CullResult.mask`.
    truth : (N,) bool or uint8 array
        True for what is visible; or the codes of `hizvk.reference.classify`.
        `reference.INVALID` counts as visible, because invalid bounds have to be kept.
        `reference.UNDECIDED` counts as neither.

    Returns
    -------
    Comparison

    Raises
    ------
    TypeError, ValueError
        For other dtypes, or lengths that differ.

    Examples
    --------
    >>> import hizvk
    >>> found = hizvk.compare([True, False, True], [True, True, False])
    >>> found.false_culls.tolist(), found.false_keeps.tolist(), found.kept_over_visible
    ([1], [2], 1.0)
    """
    kept = _arguments.bools("mask", mask, None)
    is_visible, is_hidden = sides(
        truth,
        len(kept),
        yes=(reference.VISIBLE, reference.INVALID),
        no=(reference.HIDDEN,),
        source="hizvk.reference",
    )
    return Comparison(
        false_culls=np.flatnonzero(is_visible & ~kept),
        false_keeps=np.flatnonzero(is_hidden & kept),
        total=len(kept),
        kept=int(kept.sum()),
        visible=int(is_visible.sum()),
        hidden=int(is_hidden.sum()),
        undecided=int((~is_visible & ~is_hidden).sum()),
    )
