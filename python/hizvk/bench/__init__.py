"""``hizvk bench``: what culling costs and what it leaves, on scenes with known truth.

- `command`: the command line
- `frame`: what the reports share: options, run, what a page begins with
- `catalogue`: the scenes; `volumes` has the bounds of their instances
- `configurations`: what is compared
- `measure`: times and counts
- `numpy_hiz`, `rays`: what a Python user would do without this library
- `rectangle`: the best rectangle test
- `score`: false culls and hidden instances kept
- `occluders`, `hiding`: ``--occluders``, what is lost with fewer or simpler occluders
- `maps`, `maps_results`, `maps_pictures`: ``--maps``, hierarchical occlusion maps beside the cull
- `texts`, `texts_report`, `texts_plot`: ``--texts``, what published tests lose
- `sweeps`: views per second of sweeps
- `results`: the numbers as plain objects
- `tiling`: ``--tiling``, coverage bits in BSP order beside the tiles with depth
- `whole_way`: from meshes to a mask with both rasterisers, numpy and Embree
- `report`, `plots`: report.json (its schema stands there), report.md, a picture per scene
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs ``hizvk bench`` and returns its exit code."""
    from .command import main as run

    return run(arguments)
