"""What bins cost beyond the mask: planes by mesh and level of detail, and an append in any order.

A cull with the mask alone tests and marks the same instances.
What another cull takes beyond it is its lists and draws.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

import hizvk
from hizvk.options import Outputs

from .rounds import in_turns

if TYPE_CHECKING:
    from collections.abc import Callable

    from .run import Run

__all__ = ["measure"]

#: Meshes and levels of detail of the ordered bins.
SHAPES: Final = ((1, 1), (64, 1), (64, 4), (4096, 4))
#: Milliseconds that bins may take beyond the mask for a million instances, 5 % of them kept.
TARGETS_MS: Final = {1: 3.0, 4: 6.0}
#: How often the ordered list's time beyond the mask the bins may take, half of them kept.
TARGET_RATIO: Final = 2.0
#: Outputs of a cull: the mask, or an ordered or unordered list with its draw.
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
    culls: dict[str, Callable[[], float]] = {}
    plain = run.device.instances(scene.boxes)
    culls["mask, one mesh"] = run.cull(plain, depth.camera, pyramid, groups=True).ms
    for order, name in (("stable", "list, ordered"), ("any", "list, any order")):
        culls[name] = run.cull(
            plain, depth.camera, pyramid, groups=True, outputs=LIST, order=order
        ).ms
    draw = hizvk.DrawTemplate(36)
    for meshes, lods in SHAPES:
        ids = None if meshes == 1 else random.integers(0, meshes, count, dtype=np.uint32)
        instances = run.device.instances(scene.boxes, mesh_ids=ids)
        table = (hizvk.MeshLods([draw] * lods),) * meshes
        bins = Outputs(mask=False, verdicts=False, meshes=table)
        culls[_bins(meshes, lods)] = run.cull(
            instances, depth.camera, pyramid, groups=True, bins=bins, lod=lod if lods > 1 else None
        ).ms
    one = (hizvk.MeshLods([draw] * 4),)
    reserved = Outputs(mask=False, verdicts=False, meshes=one, placement="reserved")
    for order in ("stable", "any"):
        culls[_reserved(order)] = run.cull(
            plain, depth.camera, pyramid, groups=True, bins=reserved, lod=lod, order=order
        ).ms
    ms = in_turns(culls, run.extent.rounds)
    found = run.found
    found.timed(f"emit, {kept:.0%} kept", ms)
    mask = ms["mask, one mesh"]
    beyond = {name: took - mask for name, took in ms.items()}
    listed = beyond["list, ordered"]
    found.spread(
        f"emit.list.{kept:g}", f"ordered list beyond the mask, {kept:.0%} kept", listed, "ms"
    )
    for meshes, lods in SHAPES:
        name = _bins(meshes, lods)
        key, what = f"emit.{meshes}.{lods}.{kept:g}", f"{name}, {kept:.0%} kept"
        if kept < 0.1:
            target = TARGETS_MS[lods] * count / 1e6
            found.spread(key, f"{what}, beyond the mask", beyond[name], "ms", target)
        else:
            label = f"{what}, beyond the mask / the ordered list's"
            found.ratio(key, label, beyond[name], listed, TARGET_RATIO)
    for order in ("stable", "any"):
        name = _reserved(order)
        label = f"{name}, {kept:.0%} kept, beyond the mask"
        found.spread(f"emit.reserved.{order}.{kept:g}", label, beyond[name], "ms")


def _reserved(order: str) -> str:
    return f"reserved bins, 1 mesh, 4 levels, order {order}"


def _bins(meshes: int, lods: int) -> str:
    return f"packed bins, {meshes:,} meshes, {lods} levels"
