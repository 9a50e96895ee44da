"""Several views in one call beside as many calls, and culls of a part of the instances."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

import numpy as np

from hizvk.camera import Camera

from .rounds import in_turns

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from .run import Run

__all__ = ["measure"]

#: The faces of a cube map.
VIEWS: Final = 6
#: The size of a face, in pixels.
FACE: Final = (256, 256)
#: The share of the instances that a restricted cull asks for.
SHARE: Final = 0.05


def measure(run: Run) -> None:
    """Measures `Workload.calls` instances, 95 % hidden from one of the views."""
    run.step(f"{VIEWS} views in one call and in {VIEWS}")
    scene, device = run.town(run.extent.calls, 0.95), run.device
    walls = device.occluders(scene.vertices, scene.triangles)
    crowd = device.instances(scene.boxes)
    cameras = [_face(2.0 * np.pi * number / VIEWS) for number in range(VIEWS)]
    pyramids = [device.pyramid(device.render_depth(walls, camera)) for camera in cameras]
    pairs = list(zip(cameras, pyramids, strict=True))

    def one_call() -> object:
        return device.cull(crowd, cameras, pyramids, outputs=["mask"]).mask

    def calls() -> object:
        return [device.cull(crowd, c, p, outputs=["mask"]).mask for c, p in pairs]

    def calls_then_reads() -> object:
        culls = [device.cull(crowd, c, p, outputs=["mask"]) for c, p in pairs]
        return [seen.mask for seen in culls]

    chosen = np.random.default_rng(run.seed).random(len(crowd)) < SHARE
    near = np.asarray(scene.low)[:, 0] < np.quantile(scene.low[:, 0], SHARE)
    camera, pyramid = pairs[1]

    def of(among: npt.NDArray[np.bool_] | None, *, groups: bool) -> Callable[[], object]:
        return lambda: (
            device.cull(
                crowd,
                camera,
                pyramid,
                outputs=["mask"],
                hierarchy=groups,
                among=among,
            ).mask
        )

    ways: dict[str, Callable[[], object]] = {
        "one call": one_call,
        "a call each": calls,
        "a call each, read at the end": calls_then_reads,
        "all, flat": of(None, groups=False),
        "a scattered share, flat": of(chosen, groups=False),
        "a share that lies together, flat": of(near, groups=False),
        "a share that lies together, groups": of(near, groups=True),
        "all, groups": of(None, groups=True),
    }
    ms = in_turns({name: _timed(run, way) for name, way in ways.items()}, 3 * run.extent.rounds)
    found = run.found
    found.timed("views", ms)
    for key, way in (("calls", "a call each"), ("reads", "a call each, read at the end")):
        label = f"{VIEWS} views of {len(crowd):,} instances, masks read: one call / {way}"
        found.ratio(f"views.{key}", label, ms["one call"], ms[way])
    for way in ways:
        if " share" in way:
            whole = "all, groups" if way.endswith("groups") else "all, flat"
            label = f"{len(crowd):,} instances, {SHARE:.0%} asked for: {way} / {whole}"
            found.ratio(f"views.among.{way}", label, ms[way], ms[whole])


def _face(turn: float) -> Camera:
    """A camera on the square that looks towards `turn`."""
    return Camera.look_at(
        (0.0, 0.0, 2.0),
        (np.sin(turn), np.cos(turn), 2.0),
        up=(0, 0, 1),
        fov_y_deg=90,
        size=FACE,
        near=0.125,
    )


def _timed(run: Run, work: Callable[[], object]) -> Callable[[], float]:
    def timed() -> float:
        run.device.wait()
        start = time.perf_counter()
        work()
        return 1e3 * (time.perf_counter() - start)

    return timed
