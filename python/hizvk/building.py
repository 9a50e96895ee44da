"""What `Device.pyramid` and `Device.receiver_mask` make of depth images and arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import _arguments
from ._on_device import check_owner
from .camera import Camera
from .errors import LimitError
from .other_cameras import other_camera
from .renewal import Source
from .resources import DepthImage, Pyramid
from .samples import checked_samples

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._on_device import Maker
    from ._types import DepthKind, Depths
    from .depth import DepthArray

__all__ = ["check_side", "of_arrays", "of_image", "receivers"]


def of_image(
    device: Maker,
    depth: DepthImage,
    stored: tuple[int, int],
    depths: Depths,
    *,
    scale: float,
    tolerance: object,
    **others: object,
) -> Pyramid:
    """The pyramid of a rendered image, with levels `stored`.

    The parameters of `Device.pyramid` that say what an array is are refused by name.
    """
    for name, value in others.items():
        if value is not None:
            got = _arguments.describe(value)
            expected = "nothing beside a DepthImage, which has its own"
            raise TypeError(f"{name}: expected {expected}, got {got}")
    if tolerance is not None:
        got = _arguments.describe(tolerance)
        raise TypeError(
            "tolerance: expected None beside a DepthImage, whose depth stays; to move it "
            f"pass depth.numpy(), depth.camera and kind=depth.kind, got {got}"
        )
    if _arguments.number("scale", scale, above=0.0) != 1.0:
        raise ValueError(
            f"scale: expected 1 beside a DepthImage, whose depth is NDC, got {scale:g}"
        )
    check_owner("depth", depth, device)
    built = device._engine.pyramid(depth._inner, stored, depths)
    source = Source(depth._inner)
    return Pyramid(device, built, depth.camera, source, is_rendered=True, depths=depths)


def of_arrays(
    device: Maker,
    images: DepthArray | list[DepthArray],
    camera: Camera,
    stored: tuple[int, int],
    invalid: Any = None,
    depths: Depths = "farthest",
) -> Pyramid:
    """The pyramid of an image that was checked, or of one per sample; with levels `stored`."""
    given = images if isinstance(images, list) else [images]
    if len(given) == 1:
        uploaded = device._engine.upload_depth(*given[0], camera._inner, depths)
    else:
        planes = [plane.image for plane in given]
        uploaded = device._engine.upload_samples(planes, *given[0][1:], camera._inner, depths)
    source = Source.uploaded(uploaded, given, invalid)
    built = device._engine.pyramid(uploaded, stored, depths)
    return Pyramid(device, built, camera, source, depths=depths)


def receivers(
    device: Maker,
    depth: DepthImage | npt.ArrayLike,
    camera: Camera,
    light_camera: Camera,
    *,
    kind: DepthKind | None,
    filter_radius: float,
    reach_px: float,
    slacks: tuple[float, float],
) -> DepthImage:
    """The image of `Device.receiver_mask`; `slacks` are ``depth_slack`` and ``depth_slack_abs``."""
    camera = _arguments.instance("camera", camera, Camera, "a Camera")
    light_camera = _arguments.instance("light_camera", light_camera, Camera, "a Camera")
    check_side(device, light_camera)
    radius = _arguments.number("filter_radius", filter_radius, at_least=0.0, at_most=2.0**60)
    reach = _arguments.number("reach_px", reach_px, at_least=0.0, at_most=16.0)
    if reach * 256.0 != round(reach * 256.0):
        raise ValueError(f"reach_px: expected a multiple of 1/256, got {reach}")
    relative, absolute = slacks
    slacks = (
        _arguments.number("depth_slack", relative, at_least=0.0, at_most=0.5),
        _arguments.number("depth_slack_abs", absolute, at_least=0.0, at_most=0.5),
    )
    if isinstance(depth, DepthImage):
        check_owner("depth", depth, device)
        if kind is not None:
            got = _arguments.describe(kind)
            raise TypeError(f"kind: expected None beside a DepthImage, got {got}")
        if camera != depth.camera:
            raise other_camera("camera", "that of the depth image", depth.camera, camera)
        image = depth._inner
    else:
        check_side(device, camera)
        given = checked_samples("depth", depth, camera, kind, 1.0, None)
        if isinstance(given, list) and len(given) != 1:
            raise ValueError(
                f"depth: expected one sample per pixel, got {len(given)}: the farthest of them "
                "is not all that receives shadows"
            )
        one = given[0] if isinstance(given, list) else given
        image = device._engine.upload_depth(*one, camera._inner, "receivers")
    made = device._engine.receiver_mask(image, light_camera._inner, radius, reach, slacks)
    return DepthImage(device, made, light_camera)


def check_side(device: Maker, camera: Camera) -> None:
    """Refuses an image that the device cannot hold, before its array is converted."""
    side = max(camera.size)
    if side > device.max_image_side:
        raise LimitError("image side in pixels", side, device.max_image_side)
