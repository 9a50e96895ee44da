"""The rows that `hizvk.recommend` measures: the first candidates, then one axis after the other."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from ..measuring.pareto import front
from ..measuring.spread import spread
from . import checking
from .axes import AXES
from .budget import admitted, by_use
from .candidate import Candidate, choose
from .timing import number_of_steps, time_all

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np
    import numpy.typing as npt

    from ..bounds import Bounds
    from ..measuring.configuration import Configuration
    from ..measuring.spread import Spread
    from ..occluders import OccluderSelection
    from ..options import CullOptions, MeshLods
    from ..progress import Progress
    from ..resources import Instances
    from .axes import Facts
    from .checking import CheckedCandidates, Judge
    from .timing import DepthSource

__all__ = ["Question", "Search"]

#: The part of the time that the first candidates may take; checks and axes have the rest.
FIRST: Final = 0.7


@dataclass(frozen=True, eq=False)
class Question:
    """The caller's scene, and what is asked about it."""

    alternatives: dict[str, Bounds | Instances]
    """The bounds by kind."""
    volumes: Mapping[str, Instances]
    """The same on the device."""
    source: DepthSource
    judge: Judge
    every_ray: bool
    coverage: str
    options: CullOptions
    repetitions: int
    max_ms: float | None
    kept_within: float
    meshes: Sequence[MeshLods] | None
    selections: Mapping[int, OccluderSelection]
    """Which occluders `DepthVariant.selected` means."""
    until: float
    """When to stop, by `time.monotonic`."""


@dataclass(frozen=True, eq=False)
class _Row:
    """A measured configuration."""

    ms: Spread
    cull_ms: Spread
    masks: list[npt.NDArray[np.bool_]]
    triangles: int | None


class Search:
    """Measures, checks and chooses.

    Parameters
    ----------
    question : Question
        What is asked.
    steps : Progress
        Counts what is done.
    """

    def __init__(self, question: Question, steps: Progress) -> None:
        self._question, self._steps = question, steps
        self._rows: dict[Configuration, _Row] = {}
        self._axes: dict[str, list[Candidate]] = {}
        self.left_out: list[str] = []
        """What there was no time for, in words."""

    def run(
        self, first: list[Configuration], facts: Facts
    ) -> tuple[list[Candidate], Candidate, bool, CheckedCandidates]:
        """All candidates, the best, whether it is within the budget, and the check."""
        asked, began = self._question, time.monotonic()
        first = by_use(first, every_ray=asked.every_ray, area=asked.coverage == "area")
        measured = self._measure(first, began + FIRST * (asked.until - began))
        if len(measured) < len(first):
            self.left_out.append(f"{len(first) - len(measured)} of {len(first)} first candidates")
        began = time.monotonic()
        check = self._check()
        # As much is kept for the check at the end.
        until = asked.until - (time.monotonic() - began)
        candidates = self._candidates(check)
        best, _ = self._choose(candidates)
        for axis in AXES:
            start = best if not axis.is_plain else _plain(candidates, best)
            # None: no candidate has a plain image.
            variants = [] if start is None else axis.variants(start.configuration, facts)
            if start is None or not variants:
                continue
            tried = list(dict.fromkeys([start.configuration, *variants]))
            measured = self._measure(tried, until) if time.monotonic() < until else tried[:1]
            if len(measured) < len(tried):
                part = "" if len(measured) == 1 else f"{len(tried) - len(measured)} rows of "
                self.left_out.append(f"{part}{axis.name}")
            if len(measured) == 1:
                continue
            rows = [self._provisional(start, one) for one in measured]
            self._axes[axis.name] = rows
            known = {one.configuration: one for one in [*candidates, *rows]}
            candidates = list(known.values())
            if start.configuration == best.configuration:
                best = self._next(rows, candidates)
        if self._axes:
            check = self._check()
        candidates = self._candidates(check)
        found = {one.configuration: one for one in candidates}
        best, within = self._judged(found[best.configuration], candidates)
        candidates.sort(key=lambda one: one.ms.median)
        return candidates, best, within, check

    def axes(self, candidates: Sequence[Candidate]) -> dict[str, tuple[Candidate, ...]]:
        """What was tried on each axis, as checked in the end, with the times of that axis."""
        found = {one.configuration: one for one in candidates}
        return {
            name: tuple(
                replace(found[row.configuration], ms=row.ms, cull_ms=row.cull_ms) for row in rows
            )
            for name, rows in self._axes.items()
        }

    def planned(self, first: Sequence[Configuration], facts: Facts) -> int:
        """About how many steps `run` takes; it corrects the number as it goes."""
        views = self._question.source.views
        steps = number_of_steps(first, views, self._question.repetitions)
        steps += 2 * len(self._question.alternatives) * len(views)
        for axis in AXES:
            rows = [first[0], *axis.variants(first[0], facts)]
            if len(rows) > 1:
                steps += number_of_steps(rows, views, self._question.repetitions)
        return steps

    def _measure(self, chosen: list[Configuration], until: float) -> list[Configuration]:
        """Measures the rows for which there is time, and returns them."""
        asked = self._question
        chosen = admitted(chosen, asked.volumes, asked.source, asked.options, asked.meshes, until)
        steps = number_of_steps(chosen, asked.source.views, asked.repetitions)
        if self._steps.total is not None:
            self._steps.total = max(self._steps.total, self._steps.done + steps)
        times = time_all(
            chosen,
            asked.volumes,
            asked.source,
            asked.repetitions,
            asked.options,
            self._steps,
            asked.meshes,
            until,
        )
        for k, one in enumerate(chosen):
            cull_ms = spread(times.cull[k])
            self._rows[one] = _Row(times.total(k), cull_ms, times.masks[k], times.triangles[k])
        return chosen

    def _check(self) -> CheckedCandidates:
        return checking.hold(
            list(self._rows),
            [row.masks for row in self._rows.values()],
            self._question.alternatives,
            self._question.judge,
            every_ray=self._question.every_ray,
            steps=self._steps,
            until=self._question.until,
        )

    def _candidate(self, one: Configuration, hides: int, unclear: int) -> Candidate:
        asked, row = self._question, self._rows[one]
        selected = one.depth.selected
        return Candidate(
            one,
            ms=row.ms,
            cull_ms=row.cull_ms,
            kept=sum(int(mask.sum()) for mask in row.masks),
            on_front=False,
            hides=hides,
            unclear=unclear,
            proven=one.promises_rays or not asked.every_ray,
            asked=asked.coverage == "sample" or one.coverage == "area",
            bounds=asked.alternatives[one.volume],
            options=one.options(asked.options),
            selection=None if selected is None else asked.selections[selected],
            mesh_lods=None if one.lod is None else tuple(asked.meshes or ()),
            triangles=row.triangles,
        )

    def _candidates(self, check: CheckedCandidates) -> list[Candidate]:
        made = [
            self._candidate(one, check.hides[k], check.unclear[k])
            for k, one in enumerate(self._rows)
        ]
        on = front(
            [one.ms.median for one in made],
            [one.kept for one in made],
            [one.safe for one in made],
        )
        return [replace(one, on_front=bool(is_on)) for one, is_on in zip(made, on, strict=True)]

    def _provisional(self, start: Candidate, one: Configuration) -> Candidate:
        """A row before its check: counted as that which it differs from in one thing."""
        return self._candidate(one, start.hides, start.unclear)

    def _choose(
        self, candidates: Sequence[Candidate], least: int | None = None
    ) -> tuple[Candidate, bool]:
        asked = self._question
        return choose(candidates, max_ms=asked.max_ms, kept_within=asked.kept_within, least=least)

    def _next(self, rows: Sequence[Candidate], candidates: Sequence[Candidate]) -> Candidate:
        """The best of an axis, whose rows were timed in turns."""
        drawing = [one for one in rows if one.triangles is not None]
        if drawing:  # drawing costs more than the cull
            return min(drawing, key=lambda one: (one.triangles, one.ms.median))
        # What earlier axes have given away for speed is not given away again.
        within = [
            one.kept
            for one in candidates
            if one.safe
            and (self._question.max_ms is None or one.ms.median <= self._question.max_ms)
        ]
        return self._choose(rows, min(within, default=None))[0]

    def _judged(self, best: Candidate, candidates: Sequence[Candidate]) -> tuple[Candidate, bool]:
        """The best of all axes, if the last check found nothing wrong and it is within the budget.

        Otherwise it is the best of all rows that draw as it does.
        """
        max_ms = self._question.max_ms
        if best.safe and (max_ms is None or best.ms.median <= max_ms):
            return best, True
        alike = [one for one in candidates if (one.triangles is None) == (best.triangles is None)]
        usable = any(one.safe for one in alike)
        return self._choose(alike if usable else candidates)


def _plain(candidates: Sequence[Candidate], best: Candidate) -> Candidate | None:
    """The best candidate with a plain image of full size, or the best if it has one."""
    if not best.configuration.depth.conservative:
        return best
    plain = [one for one in candidates if not one.configuration.depth.conservative]
    order = sorted(plain, key=lambda one: (not one.safe, not one.asked, one.hides, one.ms.median))
    return order[0] if order else None
