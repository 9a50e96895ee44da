"""Whole calls from Python with the mask read back.

What Python adds, what small calls cost, and what numpy and Embree take for the same.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

import numpy as np

from hizvk.bench.numpy_hiz import NumpyPyramid
from hizvk.bench.numpy_hiz import cull as numpy_cull
from hizvk.bench.rays import Rays
from hizvk.scenes import Scene, box_mesh, embree

from .errors import OracleSample
from .rounds import in_turns

if TYPE_CHECKING:
    from collections.abc import Callable

    from hizvk.resources import DepthImage, Instances, Pyramid

    from .run import Run
    from .town import Town

__all__ = ["measure"]

#: Instances of a small call.
SMALL = 1_000
#: Rounds with the others; rays for every pixel take long.
SLOW_ROUNDS = 3


def measure(run: Run) -> None:
    """Measures calls of `Workload.calls` and `Workload.crowd` instances, and of `SMALL`.

    95 % of them are hidden.
    """
    count = run.extent.calls
    run.step(f"calls of {count:,} and {SMALL:,} instances from Python")
    scene = run.town(count, 0.95)
    depth = run.depth(scene, run.extent.images[0][1])
    pyramid = run.device.pyramid(depth)
    _ours(run, scene, depth, pyramid)
    run.step(f"calls of {run.extent.crowd:,} instances in groups")
    _groups(run)
    run.step("numpy and Embree")
    _others(run, scene, depth, pyramid)


def _call(run: Run, instances: Instances, pyramid: Pyramid, *, read: bool) -> Callable[[], float]:
    def call() -> float:
        run.device.wait()
        start = time.perf_counter()
        seen = run.device.cull(instances, pyramid.camera, pyramid, outputs=["mask"])
        if read:
            _ = seen.mask
        else:
            run.device.wait()
        return 1e3 * (time.perf_counter() - start)

    return call


#: The parts of a call, in their order.
PARTS: Final = ("until cull returns", "the wait", "the mask")


def _part(run: Run, instances: Instances, pyramid: Pyramid, part: str) -> Callable[[], float]:
    """A call whose parts are taken apart; ``"the wait"`` is left to `Device.wait`."""

    def call() -> float:
        run.device.wait()
        times = [time.perf_counter()]
        seen = run.device.cull(instances, pyramid.camera, pyramid, outputs=["mask"])
        times.append(time.perf_counter())
        run.device.wait()
        times.append(time.perf_counter())
        _ = seen.mask
        times.append(time.perf_counter())
        return 1e3 * float(np.diff(times)[PARTS.index(part)])

    return call


def _ours(run: Run, scene: Town, depth: DepthImage, pyramid: Pyramid) -> None:
    many = run.device.instances(scene.boxes)
    few = run.device.instances(run.town(SMALL, 0.95).boxes)
    ways = {
        "many, mask read": _call(run, many, pyramid, read=True),
        "many, device": run.cull(many, depth.camera, pyramid, groups=None).ms,
        "few, mask read": _call(run, few, pyramid, read=True),
        **{f"few, {part}": _part(run, few, pyramid, part) for part in PARTS},
        "few, not read": _call(run, few, pyramid, read=False),
        "few, device": run.cull(few, depth.camera, pyramid, groups=None).ms,
        "empty submit": run.yardstick.empty_submit_ms,
    }
    ms = in_turns(ways, 3 * run.extent.rounds)
    found, count = run.found, len(many)
    found.timed("calls", ms)
    found.spread(
        "calls.beyond",
        f"{count:,} instances, mask read, beyond device time",
        ms["many, mask read"] - ms["many, device"],
        "ms",
        1.0,
    )
    for key, way, target in (
        ("small", "mask read", 4.0),
        ("small_unread", "not read", None),
        ("small_device", "device", None),
    ):
        found.ratio(
            f"calls.{key}",
            f"{len(few):,} instances, {way} / empty submit",
            ms[f"few, {way}"],
            ms["empty submit"],
            target,
        )
    whole = np.sum([ms[f"few, {part}"] for part in PARTS], axis=0)
    for part in PARTS:
        label = f"{len(few):,} instances: {part} / the call part by part"
        found.ratio(f"calls.small_part.{part}", label, ms[f"few, {part}"], whole)


def _groups(run: Run) -> None:
    """What the public call adds to its own recorded cull, for many instances in groups."""
    scene = run.town(run.extent.crowd, 0.95)
    depth = run.depth(scene, run.extent.images[0][1])
    pyramid = run.device.pyramid(depth)
    crowd = run.device.instances(scene.boxes)
    ways = {
        "groups, mask read": _call(run, crowd, pyramid, read=True),
        "groups, not read": _call(run, crowd, pyramid, read=False),
        "groups, device": run.cull(crowd, depth.camera, pyramid, groups=None).ms,
    }
    ms = in_turns(ways, 3 * run.extent.rounds)
    run.found.timed("calls in groups", ms)
    for key, way, target in (("groups", "not read", 1.05), ("groups_read", "mask read", None)):
        run.found.ratio(
            f"calls.{key}",
            f"{len(crowd):,} instances in groups, {way} / device",
            ms[f"groups, {way}"],
            ms["groups, device"],
            target,
        )


def _others(run: Run, scene: Town, depth: DepthImage, pyramid: Pyramid) -> None:
    boxes = run.device.instances(scene.boxes)
    numbers, view = depth.numpy(), scene.view
    matrix = depth.camera.clip_from_world.astype(np.float32)
    masks = {}

    def with_numpy() -> float:
        start = time.perf_counter()
        masks["numpy Hi-Z, float32"] = numpy_cull(scene.low, scene.high, matrix, levels, view.near)
        return 1e3 * (time.perf_counter() - start)

    def pyramid_with_numpy() -> float:
        start = time.perf_counter()
        NumpyPyramid.build(numbers)
        return 1e3 * (time.perf_counter() - start)

    levels = NumpyPyramid.build(numbers)
    ways: dict[str, Callable[[], float]] = {
        "hizvk, mask read": _call(run, boxes, pyramid, read=True),
        "hizvk, reduction": run.yardstick.reduction(depth._inner, "own", (1, 15)).ms,
        "numpy, cull": with_numpy,
        "numpy, pyramid": pyramid_with_numpy,
    }
    if embree.can_cast():
        rays = Rays(_as_scene(scene))

        def pixels() -> float:
            start = time.perf_counter()
            rays.image(view, depth.size)
            return 1e3 * (time.perf_counter() - start)

        def points() -> float:
            start = time.perf_counter()
            masks["Embree, rays to 9 points of a box"] = rays.points(view, depth.size)
            return 1e3 * (time.perf_counter() - start)

        ways |= {"Embree, one ray per pixel": pixels, "Embree, rays to 9 points of a box": points}
    else:
        run.found.notes.append(f"left out: {embree.missing()}")
    ms = in_turns(ways, SLOW_ROUNDS)
    run.found.timed("beside others", ms)
    for label in ways:
        if label.startswith(("numpy, cull", "Embree")):
            run.found.ratio(
                f"others.{label}", f"{label} / hizvk, mask read", ms[label], ms["hizvk, mask read"]
            )
    run.found.ratio(
        "others.numpy, pyramid",
        "numpy, pyramid / hizvk, all levels",
        ms["numpy, pyramid"],
        ms["hizvk, reduction"],
    )
    judge = OracleSample(run, scene.boxes, depth)
    judge.judge(
        "calls", "hizvk", run.device.cull(boxes, depth.camera, pyramid, outputs=["mask"]).mask
    )
    for label, mask in masks.items():
        judge.judge("calls", label, mask, promises=False)


def _as_scene(town: Town) -> Scene:
    """The town for `Rays`, with every box of the crowd as the thing itself."""
    low, high = town.low.astype(np.float64), town.high.astype(np.float64)
    vertices, triangles = box_mesh(low, high)
    return Scene(
        name="a town",
        origin=(0.0, 0.0, 0.0),
        vertices=town.vertices,
        triangles=town.triangles,
        instance_vertices=vertices,
        instance_triangles=triangles,
        owner=np.repeat(np.arange(len(low), dtype=np.int32), 12),
        box_min=low,
        box_max=high,
        views=(town.view,),
    )
