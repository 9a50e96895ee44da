"""What `hizvk.recommend` tries beyond the first candidates: one axis after the other.

Each axis begins with the best candidate so far and changes one thing.
So the rows add up instead of multiplying.

Axes about how a plain image is drawn begin with the best candidate that has one.
Where conservative depth is better, their rows are shown, and the best stays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..lod import LodRule
    from ..measuring.configuration import Configuration

__all__ = ["AXES", "Axis", "Facts"]

#: Parts of the triangles that are drawn.
DRAWN: Final = (2, 8, 32)
#: Fewer triangles than this are drawn at once anyway.
FEW: Final = 64


@dataclass(frozen=True)
class Facts:
    """What there is to choose from."""

    instances: int
    triangles: int | None
    """Of all copies of the occluders; None where depth is given."""
    selected: tuple[int, ...]
    """Budgets of triangles for which `select_occluders` leaves some of the meshes out."""
    are_points: bool
    """Whether the bounds are points of another kind, so that `Points` can take their place."""
    lods: tuple[LodRule, ...]
    """The rules for levels of detail that may be used."""


@dataclass(frozen=True)
class Axis:
    """One thing that is changed."""

    name: str
    is_plain: bool
    """Whether it is about how a plain image is drawn."""
    variants: Callable[[Configuration, Facts], list[Configuration]]
    """The configurations to try beside the one that it begins with."""


def _points(best: Configuration, facts: Facts) -> list[Configuration]:
    if not facts.are_points:
        return []
    # Half a pixel is the default of points, which conservative depth does not need.
    guards = (0.5, 0.0) if best.promises_rays else (0.5,)
    return [replace(best, volume="points", fit="rectangle", guard_px=guard) for guard in guards]


def _rasteriser(best: Configuration, facts: Facts) -> list[Configuration]:
    if facts.triangles is None:
        return []
    device = replace(best, depth=replace(best.depth, rasteriser="device"))
    return [device, replace(best, depth=replace(best.depth, rasteriser="host"))]


def _max_triangles(best: Configuration, facts: Facts) -> list[Configuration]:
    if facts.triangles is None or facts.triangles < FEW:
        return []
    budgets = [facts.triangles // part for part in DRAWN]
    return [replace(best, depth=replace(best.depth, max_triangles=budget)) for budget in budgets]


def _selection(best: Configuration, facts: Facts) -> list[Configuration]:
    return [replace(best, depth=replace(best.depth, selected=some)) for some in facts.selected]


def _ends(best: Configuration, _: Facts) -> list[Configuration]:
    return [replace(best, depth=replace(best.depth, depths="both"))]


def _hierarchy(best: Configuration, facts: Facts) -> list[Configuration]:
    # A box of tier t holds 64^t instances; fewer have no such tier.
    tiers = [tier for tier in (1, 2, 3) if facts.instances > 64**tier]
    return [replace(best, hierarchy=tier) for tier in [0, *tiers]] if tiers else []


def _lod(best: Configuration, facts: Facts) -> list[Configuration]:
    # Bins of several meshes come in a stable order.
    return [replace(best, lod=rule, order="stable") for rule in facts.lods]


AXES: Final = (
    Axis("points", False, _points),
    Axis("rasteriser", True, _rasteriser),
    Axis("max_triangles", True, _max_triangles),
    Axis("select_occluders", False, _selection),
    Axis("depths", False, _ends),
    Axis("hierarchy", False, _hierarchy),
    Axis("lod", False, _lod),
)
