"""What `Device.cull` does for one camera and for several, and what it asks of a pyramid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._on_device import owned
from .hints import Question
from .other_cameras import other_camera
from .resources import A_PYRAMID, Pyramid
from .result import CullResult
from .views import ViewsResult, pairs

if TYPE_CHECKING:
    from ._core import MeshTable
    from ._on_device import Maker
    from .camera import Camera
    from .options import CullOptions, Outputs
    from .resources import Instances

__all__ = ["check_coverage", "checked_pyramid", "culled", "culled_views"]


def culled(
    device: Maker,
    instances: Instances,
    camera: Camera,
    pyramid: object,
    options: CullOptions,
    outputs: Outputs,
    restriction: Any,
    wait: bool,
    table: MeshTable | None,
) -> CullResult:
    """A cull for one camera.

    `restriction` is what `among_of` made of ``among``, and `table` has the meshes of `outputs`.
    """
    pyramid = checked_pyramid(device, camera, pyramid)
    if options.coverage == "sample":
        check_coverage(options, pyramid)
    culling = device._engine.cull(
        instances._inner,
        camera._inner,
        pyramid._inner,
        options,
        outputs,
        table,
        restriction,
        not wait,
    )
    return CullResult(device, culling, Question(camera, pyramid, options, *instances._known))


def culled_views(
    device: Maker,
    instances: Instances,
    camera: object,
    pyramid: object,
    options: CullOptions,
    outputs: Outputs,
    restriction: Any,
    wait: bool,
) -> ViewsResult:
    """A cull for several cameras, each with a pyramid of its own."""
    cameras, pyramids = pairs(camera, pyramid, device)
    for number, (one, of) in enumerate(zip(cameras, pyramids, strict=True)):
        if one != of.camera:
            raise _other_camera(f"camera[{number}]", one, of)
        check_coverage(options, of)
    if outputs.pixels:
        raise ValueError(
            "pixels: expected False beside several cameras, got True: counts are those of one "
            "view, so cull them one by one"
        )
    if outputs.meshes is not None:
        raise ValueError(
            f"meshes: expected None beside several cameras, got {len(outputs.meshes)}: levels "
            "of detail are chosen for each view, so cull them one by one"
        )
    culling = device._engine.cull_views(
        instances._inner,
        [one._inner for one in cameras],
        [one._inner for one in pyramids],
        options,
        outputs,
        restriction,
        not wait,
    )
    questions = [
        Question(one, of, options, *instances._known)
        for one, of in zip(cameras, pyramids, strict=True)
    ]
    return ViewsResult(device, culling, questions)


def checked_pyramid(device: Maker, camera: Camera, pyramid: object) -> Pyramid:
    """A pyramid of this device, and of this camera."""
    found = owned("pyramid", pyramid, Pyramid, *A_PYRAMID, device=device)
    if camera is not found.camera and camera != found.camera:
        raise _other_camera("camera", camera, found)
    return found


def check_coverage(options: CullOptions, pyramid: Pyramid) -> None:
    """Refuses sample coverage for the farthest of several samples."""
    if options.coverage == "sample" and pyramid._source.samples > 1:
        raise ValueError(
            f'coverage: expected "area" for a pyramid of the farthest of {pyramid._source.samples} '
            'samples per pixel, which lie beside the pixels\' centres, got "sample"'
        )


def _other_camera(name: str, camera: Camera, pyramid: Pyramid) -> ValueError:
    """Why a camera cannot cull with the pyramid of another one, and the way out."""
    way = "depth of one camera says nothing about another one"
    if camera.resized(pyramid.size) == pyramid.camera:
        way = (
            f"pass camera.resized({pyramid.size}), the same view; "
            "the promise is about an image of that size"
        )
    return other_camera(name, "the camera of the pyramid", pyramid.camera, camera, way)
