"""`Recommendation`: what `hizvk.recommend` found, with notes in words."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from .candidate import Candidate
    from .checking import CheckedCandidates

__all__ = ["Recommendation", "notes_on"]

#: How many candidates a printed table shows at least, where there are as many.
#: All of the Pareto front and the best are among them.
ROWS: Final = 10


@dataclass(frozen=True, eq=False)
class Recommendation:
    """What `recommend` found; ``print`` shows the best candidates as a table."""

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

    def _shown(self) -> list[Candidate]:
        """What the printed table has: the front, the best, and the fastest of the others."""
        room = ROWS - sum(one.on_front or one is self.best for one in self.candidates)
        shown = []
        for one in self.candidates:
            if one.on_front or one is self.best:
                shown.append(one)
            elif room > 0:
                room -= 1
                shown.append(one)
        return shown

    def __str__(self) -> str:
        over = (
            "" if self.within_budget else " (over the budget, as all are that may be recommended)"
        )
        lines = [
            f"on {self.adapter}: {self.best}{over}",
            "    ms per camera      kept     hides   unclear"
            "   (* the Pareto front; - not for what was asked)",
        ]
        shown = self._shown()
        for one in shown:
            share = 100.0 * one.kept / max(self.tested, 1)
            mark = "*" if one.on_front else " " if one.asked else "-"
            lines.append(
                f"  {mark} {one.ms.median:11.2f}  {share:8.2f} %  "
                f"{one.hides:8,}  {one.unclear:8,}   {one}"
                + ("" if one.triangles is None else f", {one.triangles:,} triangles")
            )
        if len(shown) < len(self.candidates):
            lines.append(f"    and {len(self.candidates) - len(shown)} more, in candidates")
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
