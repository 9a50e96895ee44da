"""The stages of a view on the device, each waited for and timed by the clock on the wall."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from ..options import CullOptions

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    import numpy.typing as npt

    from ..camera import Camera
    from ..device import Device
    from ..options import MeshLods
    from ..resources import DepthImage, Instances, Occluders, Pyramid
    from .configuration import Configuration, DepthVariant

__all__ = ["Stopwatch", "cull", "drawn_triangles", "rendered"]


class Stopwatch:
    """Milliseconds since the last lap, after the device is done."""

    def __init__(self, device: Device) -> None:
        self._device = device
        device.wait()
        self._last = time.perf_counter()

    def lap(self) -> float:
        """Waits for the device; milliseconds since it was made or asked last."""
        self._device.wait()
        now = time.perf_counter()
        took, self._last = 1000.0 * (now - self._last), now
        return took


def rendered(
    device: Device, occluders: Occluders, camera: Camera, variant: DepthVariant
) -> tuple[DepthImage, Pyramid, float, float]:
    """Depth image, pyramid, and the milliseconds that each took."""
    watch = Stopwatch(device)
    depth = device.render_depth(occluders, camera, **variant.render_options(camera.size))
    render = watch.lap()
    pyramid = device.pyramid(depth, levels=variant.levels)
    return depth, pyramid, render, watch.lap()


def cull(
    device: Device,
    instances: Instances,
    pyramid: Pyramid,
    configuration: Configuration,
    base: CullOptions | None = None,
) -> tuple[npt.NDArray[np.bool_], float, float]:
    """The mask, and the milliseconds of the cull and of reading the mask."""
    options = configuration.options(base or CullOptions())
    watch = Stopwatch(device)
    result = device.cull(instances, pyramid.camera, pyramid, options)
    took = watch.lap()
    mask = result.mask
    return mask, took, watch.lap()


def drawn_triangles(
    device: Device,
    instances: Instances,
    pyramid: Pyramid,
    options: CullOptions,
    meshes: Sequence[MeshLods],
) -> tuple[npt.NDArray[np.bool_], float, float, int]:
    """As `cull`, with a list for each mesh and LOD; and how many triangles these draw."""
    watch = Stopwatch(device)
    result = device.cull(instances, pyramid.camera, pyramid, options, meshes=meshes)
    draws = result.draws
    took = watch.lap()
    mask = result.mask
    indices = draws["index_count"].astype("i8") * draws["instance_count"]
    return mask, took, watch.lap(), int(indices.sum()) // 3
