"""Sweeps: how many views per second one machine makes, by the number of instances.

``python -m hizvk.bench.sweeps`` prints the table of ``docs/sweeps.md``.
``--processes N`` adds a column for a pool of N processes that has run before.

The scene is the street-level city of the bench.
A view is one of six images of 256 x 256 around an eye in a street: its depth is drawn from 7,836
triangles, and boxes are culled that lie anywhere in the city, 0.6 m to a side.
"""

from __future__ import annotations

import argparse
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import TYPE_CHECKING, Final

import numpy as np

import hizvk

from ..commands import page, pipes
from ..scenes.city import city

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..scenes.scene import Scene

__all__ = ["Row", "main", "measure", "table"]

COUNTS: Final = (1_000, 10_000, 100_000, 1_000_000)
#: Eyes of a sweep; each has six views.
EYES: Final = 16
SIZE: Final = 256
NEAR: Final = 0.1
#: Sweeps of each kind that are timed, after one that compiles and uploads.
ROUNDS: Final = 3


@dataclass(frozen=True)
class Row:
    """Sweeps over some number of instances."""

    instances: int
    views: int
    kept: float
    """Instances that a view keeps, in the mean."""
    here: float
    """Views per second of this thread, in the best round."""
    conservative: float
    """The same with conservative depth."""
    pool: float | None
    """Views per second of a pool of processes; None if it was not asked for."""


def _cameras(scene: Scene) -> list[hizvk.Camera]:
    eyes = [np.add(view.eye, (step, 0.0, 0.0)) for step in (0.0, 0.5) for view in scene.views]
    around = [hizvk.cube(eye, size=SIZE, near=NEAR) for eye in eyes[:EYES]]
    return [camera for six in around for camera in six]


def measure(
    counts: Sequence[int] = COUNTS, *, processes: int | None = None, rounds: int = ROUNDS
) -> list[Row]:
    """The table's rows."""
    scene = city().scene
    walls = hizvk.Mesh(scene.vertices, scene.triangles)
    cameras = _cameras(scene)
    low, high = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
    pool = None
    if processes is not None:
        pool = ProcessPoolExecutor(processes, mp_context=get_context("spawn"))
    rows = []
    for count in counts:
        centers = np.random.default_rng(2010).uniform(low, high, (count, 3))
        boxes = hizvk.Boxes(centers - 0.3, centers + 0.3)
        kinds: list[dict[str, object]] = [{}, {"conservative": True}]
        kinds += [] if pool is None else [{"executor": pool}]
        best, kept = [0.0] * len(kinds), 0.0
        for turn in range(rounds + 1):
            for k, more in enumerate(kinds):
                began = time.perf_counter()
                seen = hizvk.sweep(boxes, cameras, occluders=walls, progress=False, **more)  # type: ignore[arg-type]
                speed = len(cameras) / (time.perf_counter() - began)
                best[k] = max(best[k], speed) if turn else 0.0
                kept = seen.count / len(seen) if k == 0 else kept
        rows.append(Row(count, len(cameras), kept, best[0], best[1], best[2] if pool else None))
    if pool is not None:
        pool.shutdown()
    return rows


def table(rows: Sequence[Row]) -> str:
    """The rows as Markdown."""
    head = (
        "instances | kept per view | views per second, one thread | with conservative depth "
        "| with a pool"
    )
    return "\n".join(page.table(head, (_cells(row) for row in rows), left=0))


def _cells(row: Row) -> list[str]:
    return [
        f"{row.instances:,}",
        f"{row.kept:,.1f}",
        f"{row.here:.0f}",
        f"{row.conservative:.0f}",
        "" if row.pool is None else f"{row.pool:.0f}",
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Prints the table."""
    parser = argparse.ArgumentParser("python -m hizvk.bench.sweeps", description=__doc__)
    parser.add_argument("--processes", type=int, metavar="N", help="also with a pool of N")
    given = parser.parse_args(arguments)
    rows = measure(processes=given.processes)
    print(f"{hizvk.Device().adapter}; {rows[0].views} views, best of {ROUNDS} rounds\n")
    print(table(rows))
    return 0


if __name__ == "__main__":
    sys.exit(pipes.run(main))
