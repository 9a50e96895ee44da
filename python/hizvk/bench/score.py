"""Compares masks with what is seen: false culls, and hidden instances kept."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

from ..scenes.truth import linear_depth
from .rectangle import project, rectangle_test

if TYPE_CHECKING:
    from .._arguments import Size
    from ..scenes import Scene, View
    from ..scenes.grid import Floats
    from ..scenes.truth import Caster, Sight
    from .rectangle import Projected
    from .results import Row

__all__ = ["ViewTruth", "look", "score"]

Mask: TypeAlias = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class ViewTruth:
    """The truth about one view."""

    view: View
    sight: Sight
    given: Floats
    """``(height, width)``: view depth of the occluders as the device renders them in full size."""
    projected: Projected
    visible: Mask
    """``(N,)``: owns a pixel."""
    rectangle: Mask
    """``(N,)``: kept by the best rectangle test."""


def look(
    scene: Scene, view: View, size: Size, depth: npt.NDArray[np.float32], caster: Caster
) -> ViewTruth:
    """The truth about a view.

    Parameters
    ----------
    scene, view, size
        What is seen, from where, and in how many pixels.
    depth : (height, width) float32 array
        The occluders as the device renders them, reversed NDC.
    caster : hizvk.scenes.truth.Caster
        Finds out what is seen.
    """
    given = linear_depth(depth, view.near, view.far)
    sight = caster.look(view, size, given)
    projected = project(scene, view, size)
    return ViewTruth(
        view,
        sight,
        given,
        projected,
        sight.pixels(len(scene)) > 0,
        rectangle_test(projected, given),
    )


def score(
    rows: list[Row], masks: list[list[Mask]], truths: list[ViewTruth], caster: Caster
) -> None:
    """Fills in the counts of each row.

    Parameters
    ----------
    rows : list of Row
        To be filled in.
    masks : list of list of (N,) bool array
        What each row keeps (first index) in each view (second).
    truths : list of ViewTruth
        By view.
    caster : hizvk.scenes.truth.Caster
        Says which instances are visible by more than a hair.
    """
    visible = np.stack([truth.visible for truth in truths])
    inside = np.stack([truth.projected.inside for truth in truths])
    best = np.stack([truth.rectangle for truth in truths])
    kept = [np.stack(of_row) for of_row in masks]
    firm = np.zeros_like(visible)
    for number, truth in enumerate(truths):
        asked = np.flatnonzero(np.any([truth.visible & ~of_row[number] for of_row in kept], axis=0))
        if len(asked):
            firm[number, asked] = caster.firm(truth.view, truth.sight, truth.given, asked)
    for row, mask in zip(rows, kept, strict=True):
        wrong = visible & ~mask
        row.kept = int(mask.sum())
        row.false_culls = int((wrong & firm).sum())
        row.hairs = int((wrong & ~firm).sum())
        row.hidden_kept = _share(mask & ~visible, ~visible)
        row.hidden_kept_in_view = _share(mask & ~visible & inside, ~visible & inside)
        row.share_of_rectangle = _share(~mask & inside, ~best & inside)


def _share(part: Mask, whole: Mask) -> float:
    return int(part.sum()) / max(int(whole.sum()), 1)
