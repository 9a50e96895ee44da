"""Mip textures of depth against the library's own pyramid.

Both make all levels above the image, of rendered and of uploaded images.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from .rounds import in_turns
from .run import ALL_LEVELS

if TYPE_CHECKING:
    from .run import Run

__all__ = ["measure"]

#: Depths and lookups of a mip texture.
WAYS: Final = (
    ("farthest", "normalized"),
    ("farthest", "edge_texel"),
    ("both", "normalized"),
)


def measure(run: Run) -> None:
    """Times each way, for each size of image."""
    for name, size in run.extent.images:
        run.step(f"mip textures, {name}")
        rendered = run.depth(run.town(1, 0.0), size)
        camera = rendered.camera
        uploaded = run.device._engine.upload_depth(
            rendered.numpy(), camera.depth_kind, 1.0, (), "none", (0.0, 0.0), camera._inner
        )
        for source, depth in (("rendered", rendered._inner), ("uploaded", uploaded)):
            own = "all levels of a pyramid"
            ways = {
                "empty submit": run.yardstick.empty_submit_ms,
                own: run.yardstick.reduction(depth, "own", ALL_LEVELS).ms,
            }
            for depths, lookup in WAYS:
                mips = run.yardstick.mips(depth, depths, lookup)
                ways[f"mip texture, {depths}, {lookup}"] = mips.ms
            ms = in_turns(ways, run.extent.rounds)
            run.found.timed(f"mip textures, {name} {source}", ms)
            for depths, lookup in WAYS:
                run.found.ratio(
                    f"mips.{name}.{source}.{depths}.{lookup}",
                    f"{name}, {source}: mip texture ({depths}, {lookup}) / pyramid",
                    ms[f"mip texture, {depths}, {lookup}"],
                    ms[own],
                    None,
                )
