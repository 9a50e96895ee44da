"""The tree beside the flat list of meshlets: times in turns, and what each frame looked at.

Both draw on one thread with the same code, and every image is compared bit for bit.
Times are those of the processor, least of all rounds, so that other processes count little.
What a call takes for a scene of nothing, which is writing the image, is taken off.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

import hizvk

from .scenes import SCENES

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hizvk.scenes import View

    from .scenes import Crowded

__all__ = ["COUNTS", "TIMES", "Row", "measure", "print_tables"]

#: Degrees from the last frame to this one.
TURN_DEG: Final = 2.0


@dataclass
class Row:
    """One scene of one size: sums and lists over its views."""

    scene: str
    triangles: int
    meshlets: int
    nodes: int
    different: int = 0
    """Images that differ between the ways."""
    visited: int = 0
    settled_by_one: int = 0
    comparisons: int = 0
    drawn: int = 0
    flat_drawn: int = 0
    in_hidden_nodes: int = 0
    in_hidden_meshlets: int = 0
    views: int = 0
    complexity: list[float] = field(default_factory=list)
    complexity_drawn: list[float] = field(default_factory=list)
    flat_ms: list[float] = field(default_factory=list)
    tree_ms: list[float] = field(default_factory=list)
    again_ms: list[float] = field(default_factory=list)
    """With the visible leaves of the last frame."""

    def times(self) -> list[str]:
        """A row of the table of times: milliseconds of a frame, averaged over the views."""
        flat, tree, again = (
            sum(each) / len(each) for each in (self.flat_ms, self.tree_ms, self.again_ms)
        )
        return [
            self.scene,
            f"{self.triangles / 1e6:.1f} M",
            f"{self.meshlets:,}",
            f"{flat:.2f}",
            f"{tree:.2f}",
            f"{again:.2f}",
            f"{tree / flat:.2f}",
        ]

    def counts(self) -> list[str]:
        """A row of the table of counts."""
        in_view = self.in_hidden_nodes + self.in_hidden_meshlets + self.drawn
        return [
            self.scene,
            f"{self.triangles / 1e6:.1f} M",
            f"{self.nodes:,}",
            f"{self.visited / self.views:.0f}",
            f"{self.settled_by_one / self.visited:.0%}",
            f"{self.comparisons / self.visited:.1f}",
            f"{self.in_hidden_nodes / in_view:.1%}",
            f"{np.mean(self.complexity):.1f}",
            f"{np.mean(self.complexity_drawn):.1f}",
            f"{self.drawn / max(self.flat_drawn, 1):.2f}",
        ]


#: The heads of the two tables.
TIMES: Final = (
    "scene",
    "triangles",
    "meshlets",
    "list, ms",
    "tree, ms",
    "with last frame, ms",
    "tree / list",
)
COUNTS: Final = (
    "scene",
    "triangles",
    "nodes",
    "visited",
    "settled by one",
    "comparisons per node",
    "triangles in hidden nodes",
    "depth complexity",
    "of what was drawn",
    "drawn / list's",
)


def measure(
    made: Crowded, size: tuple[int, int], rounds: int, *, threshold: int, count: bool = True
) -> Row:
    """One scene, all of its views in turns."""
    scene = hizvk.HierarchicalVisibility(made.meshes, threshold=threshold)
    row = Row(made.name, scene.num_triangles, scene.num_meshlets, len(scene.nodes))
    for view in made.views:
        _view(row, scene, view, size, rounds, count)
    return row


def _view(
    row: Row,
    scene: hizvk.HierarchicalVisibility,
    view: View,
    size: tuple[int, int],
    rounds: int,
    count: bool,
) -> None:
    camera = view.camera(size)
    last = scene.render(_before(view, size))
    frame, flat = scene.render(camera, count=count), scene.render_flat(camera)
    again = scene.render(camera, previous=last)
    row.different += not np.array_equal(frame.depth, flat.depth)
    row.different += not np.array_equal(again.depth, flat.depth)
    row.views += 1
    row.visited += frame.nodes_visited
    row.settled_by_one += frame.settled_by_one
    row.comparisons += frame.comparisons
    row.drawn += frame.triangles_drawn
    row.flat_drawn += flat.triangles_drawn
    row.in_hidden_nodes += frame.triangles_in_hidden_nodes
    row.in_hidden_meshlets += frame.triangles_in_hidden_meshlets
    row.complexity.append(frame.depth_complexity)
    row.complexity_drawn.append(frame.depth_complexity_drawn)
    nothing = hizvk.HierarchicalVisibility([])
    calls: tuple[Callable[[], object], ...] = (
        lambda: scene.render_flat(camera),
        lambda: scene.render(camera),
        lambda: scene.render(camera, previous=last),
        lambda: nothing.render_flat(camera),
        lambda: nothing.render(camera),
    )
    flat_ms, tree_ms, again_ms, flat_writes, tree_writes = in_turns(calls, rounds)
    row.flat_ms.append(flat_ms - flat_writes)
    row.tree_ms.append(tree_ms - tree_writes)
    row.again_ms.append(again_ms - tree_writes)


def in_turns(calls: Sequence[Callable[[], object]], rounds: int) -> list[float]:
    """The least milliseconds of this thread's processor time that each call takes."""
    least = [float("inf")] * len(calls)
    for _ in range(rounds):
        for number, call in enumerate(calls):
            start = time.thread_time()
            call()
            least[number] = min(least[number], 1e3 * (time.thread_time() - start))
    return least


def _before(view: View, size: tuple[int, int]) -> hizvk.Camera:
    """The camera of the last frame: turned about the upward axis."""
    away = np.subtract(view.target, view.eye)
    cos, sin = np.cos(np.radians(TURN_DEG)), np.sin(np.radians(TURN_DEG))
    turned = (cos * away[0] - sin * away[1], sin * away[0] + cos * away[1], away[2])
    return hizvk.Camera.look_at(
        view.eye,
        tuple(np.add(view.eye, turned)),
        up=view.up,
        fov_y_deg=view.fov_y_deg,
        size=size,
        near=view.near,
        far=view.far,
    )


def print_tables(
    names: Sequence[str],
    sizes: Sequence[float],
    *,
    size: tuple[int, int],
    views: int,
    rounds: int,
    threshold: int,
) -> int:
    """Measures the scenes and prints both tables; 1 if any image differs."""
    rows = []
    for name in names:
        for millions in sizes:
            made = SCENES[name](round(millions * 1e6), views)
            rows.append(measure(made, size, rounds, threshold=threshold))
    for head, cells in ((TIMES, Row.times), (COUNTS, Row.counts)):
        print(f"| {' | '.join(head)} |")
        print(f"|{'---|' * len(head)}")
        for row in rows:
            print(f"| {' | '.join(cells(row))} |")
        print()
    different = sum(row.different for row in rows)
    print(f"{different} of {sum(2 * row.views for row in rows)} images differ from the list's")
    return int(different > 0)
