"""`Recommendation`: what `hizvk.recommend` found, with notes in words."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from .. import _arguments

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from .candidate import Candidate
    from .checking import CheckedCandidates

__all__ = ["Recommendation", "notes_on"]

#: How many candidates a printed table shows.
ROWS: Final = 10


@dataclass(frozen=True, eq=False)
class Recommendation:
    """What `recommend` found; ``print`` shows ten candidates as a table, and `table` all."""

    best: Candidate
    """The candidate to use; it is `Candidate.safe`."""
    within_budget: bool
    """False if no safe candidate is within ``max_ms``; then `best` is the fastest of them."""
    candidates: tuple[Candidate, ...]
    """All candidates, the fastest first."""
    tested: int
    """Instances times cameras."""
    adapter: str
    """Where it was measured; another device may order the candidates otherwise."""
    check: str = ""
    """How candidates were checked, and how much of what they cull was looked at."""
    notes: tuple[str, ...] = ()
    """Why candidates were dropped, and what is proven of the best."""
    axes: Mapping[str, tuple[Candidate, ...]] = field(default_factory=dict)
    """What was tried beyond the first candidates, by axis.

    The first of each is what the axis began with.
    """

    @property
    def front(self) -> tuple[Candidate, ...]:
        """The Pareto front of time and instances kept, the fastest first."""
        return tuple(one for one in self.candidates if one.on_front)

    def table(self, most: int | None = None) -> str:
        """The candidates as a table, the fastest first; ``print`` of this object shows ten.

        Parameters
        ----------
        most : int, optional
            How many rows; None: all.
            The best comes first, then the best of each axis, the Pareto front, and the fastest.

        Raises
        ------
        TypeError, ValueError
            If `most` is not an integer of at least 1.
        """
        if most is not None:
            most = _arguments.integer("most", most, low=1, high=2**31 - 1)
        lines = [
            "    ms per camera      kept     hides   unclear"
            "   (* the Pareto front; - not for what was asked)"
        ]
        shown = self._shown(most)
        for one in shown:
            share = 100.0 * one.kept / max(self.tested, 1)
            mark = "*" if one.on_front else " " if one.asked else "-"
            lines.append(
                f"  {mark} {one.ms.median:11.2f}  {share:8.2f} %  "
                f"{one.hides:8,}  {one.unclear:8,}   {one}"
                + ("" if one.triangles is None else f", {one.triangles:,} triangles")
            )
        left = len(self.candidates) - len(shown)
        if left:
            rows = "row" if left == 1 else "rows"
            lines.append(f"    and {left} more {rows}, which Recommendation.table() shows")
        return "\n".join(lines)

    def _shown(self, most: int | None) -> list[Candidate]:
        """The rows of a table, in the order of `candidates`."""
        known = {one.configuration: one for one in self.candidates}
        of_axes = [
            min(rows[1:], key=lambda one: (not one.safe, one.ms.median)).configuration
            for rows in self.axes.values()
        ]
        order = [self.best, *(known[one] for one in of_axes), *self.front, *self.candidates]
        wanted = dict.fromkeys(one.configuration for one in order)
        shown = set(list(wanted)[:most])
        return [one for one in self.candidates if one.configuration in shown]

    def __str__(self) -> str:
        over = (
            "" if self.within_budget else " (over the budget, as all are that may be recommended)"
        )
        lines = [f"on {self.adapter}: {self.best}{over}", self.table(ROWS)]
        if self.axes:
            tried = (f"{name} ({len(rows) - 1})" for name, rows in self.axes.items())
            lines.append(f"one after the other, from the best so far: {', '.join(tried)}")
        lines += [f"checked by {self.check}"] if self.check else []
        return "\n".join([*lines, *self.notes])


def notes_on(
    candidates: Sequence[Candidate],
    best: Candidate,
    check: CheckedCandidates,
    *,
    coverage: str,
    points: bool,
    rendered: bool,
    left_out: Sequence[str] = (),
) -> tuple[str, ...]:
    """What to know about a recommendation, a sentence or two each."""
    notes = []
    if left_out:
        notes.append(
            f"There was no time for {', '.join(left_out)}: a longer max_seconds has some, "
            "fewer cameras or repetitions save some."
        )
    dropped = [one for one in candidates if one.asked and not one.safe]
    if dropped:
        asked = sum(one.asked for one in candidates)
        lost, unclear = max(one.hides for one in dropped), max(one.unclear for one in dropped)
        what = []
        if lost:
            seen = f"the {check.visible:,} that the check found visible"
            what.append(f"hide up to {lost:,} of {seen}")
        if unclear:
            what.append(f"cull up to {unclear:,} that are not shown to be hidden")
        why = ""
        if rendered and coverage == "area":
            why = " Plain depth knows the depth at its pixels' centres alone."
        elif points:
            why = (
                " The image knows the depth at its pixels' centres alone, and points lie on what "
                "it shows."
            )
        notes.append(
            f"{len(dropped)} of {asked} candidates were dropped: they {', and '.join(what)}.{why}"
        )
    if best.configuration.guard_px:
        notes.append(
            "A guard of half a pixel is a good guess for points before an image, and no proof."
        )
    if not best.proven:
        notes.append(
            "The best is right before the cameras given: all that it culls there is hidden. "
            "Before other cameras, only conservative depth is proven for what shows between the "
            "pixels' centres."
        )
    if rendered and coverage == "area" and not points:  # points cover no pixel's centre
        notes.append(
            "If your image has one sample per pixel, at its centre and without jitter, ask with "
            'coverage="sample": plain depth of the full size is proven for that.'
        )
    if not rendered and coverage == "area":
        notes.append(
            "It is right for the images as they are. With multisampling or jitter, a pixel has to "
            "hold the farthest depth of all its samples."
        )
    if points and coverage == "sample":
        notes.append('Points cover no pixel centre, so all are culled: ask with coverage="area".')
    return tuple(notes)
