"""The occluders' depth: the rasteriser on the host, the device's, and conservative depth.

`hizvk bench` has the whole way of each scene, with the errors; here are ratios and targets.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

from hizvk.bench import catalogue
from hizvk.bench.configurations import RASTERISERS
from hizvk.measuring.configuration import DepthVariant

from .rounds import in_turns

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hizvk import _core
    from hizvk.bench.catalogue import BenchScene
    from hizvk.camera import Camera
    from hizvk.resources import Occluders

    from .run import Run

__all__ = ["measure"]

#: Plain images, as (height, width); the conservative one has half the sides of the first.
SIZES: Final = ((360, 640), (1080, 1920))
SMALL: Final = DepthVariant(2, conservative=True)
#: How many times as long the device's rasteriser takes, on a processor and in the smaller image.
FASTER: Final = 5.0
#: Milliseconds of conservative depth, by scene.
CONSERVATIVE: Final = {"mountains": 15.0}


def measure(run: Run) -> None:
    """Measures the scenes of `Workload.scenes`, a few views of each, both faces drawn."""
    for key in run.extent.scenes:
        run.step(f"the occluders of {key}")
        try:
            bench = catalogue.make(key, 1, run.extent.views, run.seed, None)
        except catalogue.Missing as missing:
            run.found.notes.append(f"left out: {missing}")
            continue
        _scene(run, bench)


def _scene(run: Run, bench: BenchScene) -> None:
    scene, key, found = bench.scene, bench.key, run.found
    occluders = run.device.occluders(scene.vertices, scene.triangles)
    ways: dict[str, Callable[[], float]] = {}
    for size in SIZES[: run.extent.plain_sizes]:
        cameras = [view.camera(size) for view in scene.views]
        image = f"{size[1]}x{size[0]}"
        rasters = [
            run.yardstick.raster(occluders._inner, camera._inner, found.cores) for camera in cameras
        ]
        ways[f"{image}, host alone"] = _alone(rasters)
        for drawn in RASTERISERS:
            ways[f"{image}, {drawn.rasteriser}"] = _rendered(run, occluders, cameras, drawn)
    height, width = SMALL.size(SIZES[0])
    small = f"{width}x{height}, conservative"
    cameras = [view.camera(SIZES[0]) for view in scene.views]
    ways[small] = _rendered(run, occluders, cameras, SMALL)
    ms = in_turns(ways, run.extent.rounds)
    found.timed(f"occluders: {key}", ms)
    is_processor = run.device.adapter.device_type == "cpu"
    for number, size in enumerate(SIZES[: run.extent.plain_sizes]):
        image = f"{size[1]}x{size[0]}"
        device = ms[f"{image}, device"]
        for way in ("host alone", "host"):
            is_judged = is_processor and number == 0 and way == "host alone"
            found.ratio(
                f"occluders.{key}.{image}.{way}",
                f"{key}, {image}: device's rasteriser / {way}",
                device,
                ms[f"{image}, {way}"],
                FASTER if is_judged else None,
                at_least=True,
            )
    found.spread(
        f"occluders.{key}.conservative",
        f"{key}, {small} depth",
        ms[small],
        "ms",
        CONSERVATIVE.get(key),
    )


def _alone(rasters: Sequence[_core.YardstickRaster]) -> Callable[[], float]:
    """Milliseconds per view of drawing on the host, without upload."""
    return lambda: sum(raster.ms() for raster in rasters) / len(rasters)


def _rendered(
    run: Run, occluders: Occluders, cameras: Sequence[Camera], variant: DepthVariant
) -> Callable[[], float]:
    """Milliseconds per view of `Device.render_depth`, until the image is on the device."""

    def render() -> float:
        run.device.wait()
        start = time.perf_counter()
        for camera in cameras:
            run.device.render_depth(occluders, camera, **variant.render_options(camera.size))
            run.device.wait()
        return 1e3 * (time.perf_counter() - start) / len(cameras)

    return render
