"""``hizvk demo``: culls trees in the mountains, draws what happened, and checks the cull.

``hizvk demo --scene arm`` does so with ARM's spheres among prisms.

Each view makes the library's three calls: `Device.render_depth` of the terrain, `Device.pyramid`,
and `Device.cull` of the trees' boxes.
Then the truth is found without the library (`hizvk.scenes.truth`).
The exit code is 1 if a visible tree was culled.

- `command`: the command line
- `run`: all views: cull, check, pictures, report
- `arm`: ARM's scene, its check and its report; `arm_pictures` draws bounds
- `report`: the numbers, and the page that tells them
- `pictures`: the pictures of a view; `shading` colours what the rays have seen
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs ``hizvk demo`` and returns its exit code."""
    from .command import main as run

    return run(arguments)
