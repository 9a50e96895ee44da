"""The results of the bench as plain objects; `report` writes them."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ..measuring.pareto import front

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._arguments import Size
    from ..measuring.configuration import Configuration
    from ..measuring.spread import Spread

__all__ = ["STAGES", "Row", "SceneResult", "fronts"]

#: The timed stages of a view, in order.
STAGES: Final = ("render", "reduce", "cull", "read")
#: Decimals of a share that count on the front: a thousandth of the hidden instances in the view.
SAME: Final = 3


@dataclass
class Row:
    """One way to find what is visible, over all views of a scene."""

    label: str
    configuration: Configuration | None
    """None: not by hizvk (a yardstick)."""
    ms: dict[str, Spread | None] = field(default_factory=dict)
    """Milliseconds per view of each of `STAGES`; None: no such stage, or it was not timed."""
    total_ms: Spread | None = None
    """Of all stages: the medians of render and reduce, and the spread of cull and read.

    Rows with the same depth image share render and reduce.
    """
    ns_per_instance: float | None = None
    """The cull's median divided by the number of instances."""
    first_ms: float | None = None
    """The first cull, including what it compiles or builds."""
    texels_per_instance: float | None = None
    """Depth texels that tests of groups and instances read, divided by all instances."""
    kept: int = 0
    false_culls: int = 0
    """Visible instances that were culled, over all views."""
    hairs: int = 0
    """Culled ones that are visible only by a hair, so a rasteriser may hide them."""
    hidden_kept: float = 0.0
    """Kept but visible in no pixel, as a share of all that are visible in no pixel."""
    hidden_kept_in_view: float = 0.0
    """The same among the instances inside the view volume."""
    share_of_rectangle: float = 0.0
    """Culled inside the view volume, divided by what the best rectangle test culls there."""
    pareto: bool = False
    """Whether no configuration that promises as much is better in time or error, no worse in both.

    Sample coverage promises less than area coverage.
    So it competes with both, and area coverage competes only with its like.
    """

    @property
    def promises(self) -> bool:
        """Whether it is a configuration whose promise reaches the view's own pixels."""
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
    """How it was found what is visible."""
    visible: int
    """Instances that own a pixel, over all views."""
    hidden: int
    inside: int
    """Instances inside the view volume, over all views."""
    one_instance_ms: float
    """The cull of a single instance, which is the fixed cost of a call."""
    upload_ms: float
    """All kinds of bounds together."""
    way_upload_ms: float
    """The occluders and the boxes, which is what one way needs."""
    warm_up_ms: float
    """All first calls together; they compile and build."""
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
