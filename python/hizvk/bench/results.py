"""What a run of the bench found out, as plain objects; `report` writes them."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .pareto import front

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._arguments import Size
    from ..scenes import Floats
    from .configurations import Configuration

__all__ = ["STAGES", "Row", "SceneResult", "Spread", "fronts", "spread"]

#: The timed stages of a view, in order.
STAGES: Final = ("render", "reduce", "cull", "read")
#: Decimals of a share that make a difference on the front: a thousandth of the hidden in the view.
SAME: Final = 3


@dataclass(frozen=True)
class Spread:
    """Medians over the repetitions, and the quartiles about them; means over the views."""

    median: float
    q1: float
    q3: float

    def __str__(self) -> str:
        return f"{self.median:.2f} ({self.q1:.2f} to {self.q3:.2f})"


def spread(ms: Floats, *, plus: float = 0.0) -> Spread:
    """Median and quartiles over the repetitions of each view, then the mean over the views.

    In this order, for of many views some are disturbed in every repetition, but few in most.

    Parameters
    ----------
    ms : (repetitions, views) float64 array
        Milliseconds.
    plus : float
        Is added to all three.
    """
    q1, median, q3 = np.quantile(ms, (0.25, 0.5, 0.75), axis=0).mean(axis=1) + plus
    return Spread(float(median), float(q1), float(q3))


@dataclass
class Row:
    """One way to find out what is visible, over all views of a scene."""

    label: str
    configuration: Configuration | None
    """None: not by hizvk (a yardstick)."""
    ms: dict[str, Spread | None] = field(default_factory=dict)
    """Milliseconds of each of `STAGES` a view; None where there is no such stage or it was not timed."""
    total_ms: Spread | None = None
    """Of all stages together: the medians of render and reduce, which rows share, and the spread of cull and read."""
    ns_per_instance: float | None = None
    """The cull's median by the number of instances."""
    first_ms: float | None = None
    """The first cull, with what is compiled or built then."""
    texels_per_instance: float | None = None
    """Depth texels read by tests of groups and of instances, over all instances."""
    kept: int = 0
    false_culls: int = 0
    """Visible instances that were culled, over all views."""
    hairs: int = 0
    """Culled ones that are visible by a hair, which a rasteriser may hide rightly (`hizvk.truth`)."""
    hidden_kept: float = 0.0
    """Kept and visible in no pixel, as a share of all that are visible in no pixel."""
    hidden_kept_in_view: float = 0.0
    """The same among the instances inside the view volume."""
    share_of_rectangle: float = 0.0
    """Culled inside the view volume, over what the best rectangle test culls there."""
    pareto: bool = False
    """Whether no configuration that promises as much is better in time or error and no worse in the other. Sample
    coverage promises less than area coverage, so it competes with both, area coverage with its like alone."""

    @property
    def promises(self) -> bool:
        """Whether it is a configuration whose promise reaches to the view's own pixels."""
        return self.configuration is not None and self.configuration.promises


@dataclass
class SceneResult:
    """A scene and its rows."""

    key: str
    name: str
    instances: int
    occluder_triangles: int
    instance_triangles: int
    views: int
    size: Size
    repetitions: int
    truth: str
    """How it was found out what is visible."""
    visible: int
    """Instances that own a pixel, over all views."""
    hidden: int
    inside: int
    """Instances inside the view volume, over all views."""
    one_instance_ms: float
    """The cull of a single instance: what a call costs before the first instance."""
    upload_ms: float
    warm_up_ms: float
    """All first calls: what compiles and builds."""
    rows: list[Row] = field(default_factory=list)

    def mark_front(self) -> None:
        """Sets `Row.pareto` by `Row.total_ms` and `Row.hidden_kept_in_view`."""
        cost = [np.nan if row.total_ms is None else row.total_ms.median for row in self.rows]
        for row, on in zip(self.rows, fronts(self.rows, cost), strict=True):
            row.pareto = on

    def as_data(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self)


def fronts(rows: Sequence[Row], cost: Sequence[float]) -> list[bool]:
    """Which rows are on the front of `cost` and hidden kept in the view, as `Row.pareto` says."""
    error = [round(row.hidden_kept_in_view, SAME) for row in rows]
    sound = np.array([row.promises and row.false_culls == 0 for row in rows])
    area = np.array(
        [row.configuration is not None and row.configuration.coverage == "area" for row in rows]
    )
    found: list[bool] = (
        front(cost, error, sound & area) | (front(cost, error, sound) & ~area)
    ).tolist()
    return found
