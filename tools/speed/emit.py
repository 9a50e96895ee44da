"""What bins cost: planes by mesh and level of detail, and an append in any order.

What follows the marking of an ordered cull is timed alone: it makes lists and draws of the mask or
of the planes.
Whole culls stand beside it, because bins in any order have no such part.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

import hizvk
from hizvk.options import Outputs

from .rounds import in_turns

if TYPE_CHECKING:
    from hizvk import _core

    from .run import Run

__all__ = ["measure"]

#: Meshes and levels of detail of the ordered bins.
SHAPES: Final = ((1, 1), (64, 1), (64, 4), (4096, 1), (4096, 4))
#: Milliseconds beyond the marking for a million instances, 5 % of them kept, by levels.
TARGETS_MS: Final = {1: 3.0, 4: 6.0}
#: How often the ordered list's time beyond the marking the bins may take, half of them kept.
TARGET_RATIO: Final = 2.0
#: Outputs of a cull: a list with its draw.
LIST: Final = (False, False, True, True)


def measure(run: Run) -> None:
    """Measures `Workload.crowd` instances, of which 5 % and 50 % are kept."""
    for kept in (0.05, 0.5):
        _measure(run, kept)


def _measure(run: Run, kept: float) -> None:
    count = run.extent.crowd
    run.step(f"lists of {count:,} instances by mesh and level of detail, {kept:.0%} kept")
    scene = run.town(count, 1.0 - kept)
    depth = run.depth(scene, run.extent.images[0][1])
    pyramid = run.device.pyramid(depth)
    # Levels change within the town, so every plane is used.
    lod = hizvk.LodByDistance([20.0, 40.0, 80.0])
    random = np.random.default_rng(run.seed)
    draw = hizvk.DrawTemplate(36)
    crowds = {
        meshes: run.device.instances(
            scene.boxes,
            mesh_ids=random.integers(0, meshes, count, dtype=np.uint32) if meshes > 1 else None,
        )
        for meshes in sorted({meshes for meshes, _ in SHAPES})
    }

    def cull(meshes: int, lods: int, order: str, placement: str) -> _core.YardstickCull:
        table = (hizvk.MeshLods([draw] * lods),) * meshes
        bins = Outputs(
            mask=False,
            verdicts=False,
            meshes=table,
            placement=placement,  # type: ignore[arg-type]
        )
        rule = lod if lods > 1 else None
        at = (crowds[meshes], depth.camera, pyramid)
        return run.cull(*at, groups=True, bins=bins, lod=rule, order=order)

    def listed(order: str) -> _core.YardstickCull:
        at = (crowds[1], depth.camera, pyramid)
        return run.cull(*at, groups=True, outputs=LIST, order=order)

    ordered = {"ordered list": listed("stable")}
    ordered |= {_bins(*shape): cull(*shape, "stable", "packed") for shape in SHAPES}
    ordered["reserved bins, 1 mesh, 4 levels"] = cull(1, 4, "stable", "reserved")
    whole = {f"{name}, whole cull": each for name, each in ordered.items()}
    whole["unordered list, whole cull"] = listed("any")
    whole["unordered bins, 1 mesh, 4 levels, whole cull"] = cull(1, 4, "any", "reserved")
    culls = in_turns({name: each.ms for name, each in whole.items()}, run.extent.rounds)
    beyond = in_turns({name: each.emit_ms for name, each in ordered.items()}, run.extent.rounds)
    found = run.found
    found.timed(f"emit, {kept:.0%} kept, beyond the marking", beyond)
    found.timed(f"emit, {kept:.0%} kept", culls)
    for meshes, lods in SHAPES:
        name = _bins(meshes, lods)
        key, what = f"emit.{meshes}.{lods}.{kept:g}", f"{name}, {kept:.0%} kept, beyond the marking"
        if kept < 0.1:
            target = TARGETS_MS[lods] * count / 1e6
            found.spread(key, what, beyond[name], "ms", target)
        else:
            label = f"{what} / the ordered list's"
            found.ratio(key, label, beyond[name], beyond["ordered list"], TARGET_RATIO)


def _bins(meshes: int, lods: int) -> str:
    of = "1 mesh" if meshes == 1 else f"{meshes:,} meshes"
    return f"packed bins, {of}, {lods} level{'s' if lods > 1 else ''}"
