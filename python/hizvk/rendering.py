"""What `Device.render_depth` does: checks, and one of three ways to draw."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import _arguments
from ._on_device import owned
from ._types import Rasteriser, words
from .camera import Camera
from .drawing import Drawing, chosen, limit
from .other_cameras import other_camera
from .progress import Progress, check_progress
from .resources import SOME_OCCLUDERS, DepthImage, Occluders

if TYPE_CHECKING:
    from ._arguments import Size
    from ._on_device import Maker
    from .progress import ProgressLike

__all__ = ["rendered"]


def rendered(
    device: Maker,
    occluders: Occluders,
    camera: Camera | None,
    *,
    size: Size | None,
    conservative: bool,
    refinement: int,
    rasteriser: Rasteriser,
    into: DepthImage | None,
    drawing: tuple[Any, int | None, int | None],
    progress: ProgressLike,
) -> DepthImage | tuple[int, int, int, int] | None:
    """A new depth image, or the rectangle of `into` that was touched.

    Parameters are those of `Device.render_depth`; `drawing` has ``only``, ``max_triangles`` and
    ``max_occluders``.
    """
    owned("occluders", occluders, Occluders, *SOME_OCCLUDERS, device=device)
    conservative = _arguments.flag("conservative", conservative)
    refinement = _arguments.integer("refinement", refinement, low=0, high=8)
    _arguments.choice("rasteriser", rasteriser, words(Rasteriser))
    check_progress(progress)
    only, max_triangles, max_occluders = drawing
    what = Drawing(
        chosen("only", only, occluders),
        limit("max_triangles", max_triangles),
        limit("max_occluders", max_occluders),
    )
    if into is not None:
        owned("into", into, DepthImage, "a DepthImage of Device.render_depth", device=device)
        for name, value, default in (
            ("size", size, None),
            ("conservative", conservative, False),
            ("rasteriser", rasteriser, "auto"),
        ):
            if value != default:
                raise ValueError(f"{name}: expected {default!r} beside into, got {value!r}")
        if camera is not None and camera != into.camera:
            raise other_camera("camera", "None or that of into", into.camera, camera)
        return device._engine.render_depth_into(into._inner, occluders._inner, *what)
    camera = _arguments.instance("camera", camera, Camera, "a Camera")
    if size is not None:
        camera = camera.resized(size)
    if not conservative:
        drawn = device._engine.render_depth(occluders._inner, camera._inner, rasteriser, *what)
        return DepthImage(device, drawn, camera)
    if any(part is not None for part in what) or rasteriser != "auto":
        raise ValueError(
            "conservative: expected False beside rasteriser, only, max_triangles and "
            "max_occluders, got True"
        )
    with Progress(progress, "conservative depth", 1) as steps:
        drawn = device._engine.render_depth_conservative(
            occluders._inner, camera._inner, refinement
        )
        steps.step()
    return DepthImage(device, drawn, camera)
