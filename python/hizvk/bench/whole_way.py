"""The whole way of each scene, from meshes to a mask: times and errors in one table.

Its rows are some of the scene's own: both rasterisers, conservative depth, numpy and Embree.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ..measuring.configuration import Configuration, DepthVariant
from .configurations import RASTERISERS
from .results import STAGES

if TYPE_CHECKING:
    from collections.abc import Iterator

    from .results import Row, SceneResult

__all__ = ["HEAD", "LABELS", "differing", "rows"]

DEVICE, HOST = (str(Configuration(depth=depth)) for depth in RASTERISERS)
#: The ray caster whose first call builds the trees.
TREES: Final = "Embree, one ray per pixel"
#: The rows of a scene, by label; those that a run lacks are left out.
LABELS: Final = (
    DEVICE,
    HOST,
    str(Configuration(depth=DepthVariant(2, True))),
    "numpy Hi-Z, float32",
    TREES,
    "Embree, rays to 9 points of a box",
)
HEAD: Final = (
    "scene | | once | render | reduce | cull | read | sum | kept | false culls | hidden kept"
)
#: The part of the kept instances by which the two rasterisers may differ.
ALLOWED: Final = 0.001


def rows(scene: SceneResult) -> Iterator[list[str]]:
    """The rows of the table, as text."""
    found = {row.label: row for row in scene.rows}
    for label in LABELS:
        row = found.get(label)
        if row is None or row.total_ms is None:
            continue
        once = _once(scene, row)
        yield [
            scene.key,
            label if row.configuration else f"*{label}*",
            "" if once is None else f"{once:.1f}",
            *(f"{ms.median:.2f}" if (ms := row.ms.get(stage)) else "" for stage in STAGES),
            f"{row.total_ms.median:.2f}",
            f"{row.kept:,}",
            f"{row.false_culls:,}",
            f"{100.0 * row.hidden_kept:.2f} %",
        ]


def _once(scene: SceneResult, row: Row) -> float | None:
    """Milliseconds before the first view: uploads, or the trees that rays are cast into."""
    if row.configuration is not None:
        return scene.way_upload_ms
    if row.label == TREES and row.first_ms is not None and row.total_ms is not None:
        return max(0.0, row.first_ms - row.total_ms.median)
    return None


def differing(scene: SceneResult) -> str | None:
    """Says so if the two rasterisers' depth makes culls keep different numbers of instances."""
    kept = {row.label: row.kept for row in scene.rows if row.label in (DEVICE, HOST)}
    if len(kept) < 2 or abs(kept[HOST] - kept[DEVICE]) <= max(1.0, ALLOWED * kept[DEVICE]):
        return None
    return f"{kept[HOST]:,} kept with the host's rasteriser, {kept[DEVICE]:,} with the device's"
