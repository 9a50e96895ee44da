"""A cull's UNOCCLUDED beside the truth: false ones, which are bugs, and missed ones, a cost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .. import _arguments, foreign
from ..explanation import Verdict
from . import reference
from .sides import sides

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["UnoccludedComparison", "compare_unoccluded"]


@dataclass(frozen=True, eq=False, repr=False)
class UnoccludedComparison:
    """The instances that a cull calls UNOCCLUDED, beside those that are."""

    false_claims: npt.NDArray[np.intp]
    """Instances that are UNOCCLUDED and should not be: each one is a bug."""
    missed: npt.NDArray[np.intp]
    """Instances that are unoccluded in truth and have another verdict: a cost."""
    total: int
    """Instances."""
    claimed: int
    """Instances that are UNOCCLUDED."""
    unoccluded: int
    """Instances that are unoccluded in truth."""
    undecided: int
    """Instances that the truth leaves open; they count as neither."""

    @property
    def found_share(self) -> float:
        """Of those that are unoccluded in truth, the share that was found; 1 if there are none."""
        return 1.0 - len(self.missed) / self.unoccluded if self.unoccluded else 1.0

    def __repr__(self) -> str:
        return f"<UnoccludedComparison: {self}>"

    def __str__(self) -> str:
        return (
            f"{self.total:,} instances, {self.unoccluded:,} unoccluded, {self.claimed:,} found, "
            f"{self.undecided:,} undecided; {len(self.false_claims):,} wrongly found, "
            f"{len(self.missed):,} missed"
        )


def compare_unoccluded(verdicts: npt.ArrayLike, truth: npt.ArrayLike) -> UnoccludedComparison:
    """Compares a cull's UNOCCLUDED with the truth.

    Parameters
    ----------
    verdicts : (N,) uint8 array
        The codes of `CullResult.verdicts`.
    truth : (N,) bool or uint8 array
        True for what is unoccluded; or the codes of `hizvk.reference.unoccluded`.
        `reference.UNDECIDED` counts as neither.

    Returns
    -------
    UnoccludedComparison

    Raises
    ------
    TypeError, ValueError
        For other dtypes or codes, or lengths that differ.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> verdicts = np.array([hizvk.Verdict.UNOCCLUDED, hizvk.Verdict.VISIBLE], dtype=np.uint8)
    >>> found = hizvk.compare_unoccluded(verdicts, [True, True])
    >>> found.false_claims.tolist(), found.missed.tolist(), found.found_share
    ([], [1], 0.5)
    """
    verdicts = foreign.as_numpy("verdicts", "uint8 (N,)", verdicts)
    codes = np.asarray(verdicts)
    if codes.dtype != np.uint8 or codes.ndim != 1:
        kind = ValueError if codes.dtype == np.uint8 else TypeError
        raise kind(f"verdicts: expected uint8 (N,), got {_arguments.describe(verdicts)}")
    is_it, is_not = sides(
        truth,
        len(codes),
        yes=(reference.UNOCCLUDED,),
        no=(reference.COVERED, reference.INVALID),
        source="hizvk.reference.unoccluded",
    )
    unknown = codes[~np.isin(codes, list(Verdict))]
    if unknown.size:
        raise ValueError(f"verdicts: expected codes of hizvk.Verdict, got {int(unknown[0])}")
    is_claimed = codes == Verdict.UNOCCLUDED
    return UnoccludedComparison(
        false_claims=np.flatnonzero(is_claimed & is_not),
        missed=np.flatnonzero(is_it & ~is_claimed),
        total=len(codes),
        claimed=int(is_claimed.sum()),
        unoccluded=int(is_it.sum()),
        undecided=int((~is_it & ~is_not).sum()),
    )
