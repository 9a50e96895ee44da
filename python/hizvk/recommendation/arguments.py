"""The arguments of `hizvk.recommend`: checked, as plain lists, and on one device."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _arguments
from ..camera import Camera
from ..depth import DepthArray, checked_image
from ..device import maker_of
from ..measuring.volumes import KINDS
from ..mesh import A_MESH, meshes_of
from ..resources import Instances, Occluders

if TYPE_CHECKING:
    from ..bounds import Bounds
    from ..device import Device

__all__ = ["alternatives_of", "cameras_of", "device_of", "images_of", "occluders_on", "upload"]


def alternatives_of(bounds: Any) -> dict[str, Bounds | Instances]:
    """The given bounds by their kind."""
    expected = "Spheres, Boxes, OrientedBoxes, Points, Instances or a sequence of them"
    given = bounds if isinstance(bounds, Sequence) and not isinstance(bounds, str) else [bounds]
    found: dict[str, Bounds | Instances] = {}
    for one in given:
        if isinstance(one, Instances):
            name = one.kind
        else:
            names = [name for name, volume in KINDS.items() if isinstance(one, volume)]
            if not names:
                raise TypeError(f"bounds: expected {expected}, got {_arguments.describe(one)}")
            name = names[0]
        if name in found:
            raise ValueError(f"bounds: expected each kind once, got {name} twice")
        found[name] = one
    if not found:
        raise ValueError(f"bounds: expected {expected}, got an empty sequence")
    counts = {len(one) for one in found.values()}
    if len(counts) > 1:
        raise ValueError(
            f"bounds: expected the same instances in each kind, got {sorted(counts)} of them"
        )
    return found


def cameras_of(cameras: Any) -> list[Camera]:
    """The cameras as a list."""
    expected = "a Camera or a sequence of Camera"
    found = [cameras] if isinstance(cameras, Camera) else cameras
    if not isinstance(found, Sequence) or isinstance(found, str):
        raise TypeError(f"cameras: expected {expected}, got {_arguments.describe(cameras)}")
    if not found:
        raise ValueError(f"cameras: expected {expected}, got an empty sequence")
    for one in found:
        _arguments.instance("cameras", one, Camera, expected)
    return list(found)


def images_of(
    depths: Any, cameras: list[Camera], kind: Any, scale: Any, invalid: Any
) -> list[DepthArray]:
    """The checked depth image of each camera."""
    if not isinstance(depths, (Sequence, np.ndarray)) or isinstance(depths, str):
        got = _arguments.describe(depths)
        raise TypeError(f"depths: expected a sequence of (height, width) arrays, got {got}")
    if len(depths) != len(cameras):
        raise ValueError(
            f"depths: expected {len(cameras)} images, one for each camera, got {len(depths)}"
        )
    return [
        checked_image("depths", image, camera, kind, scale, invalid)
        for image, camera in zip(depths, cameras, strict=True)
    ]


def device_of(occluders: object, alternatives: dict[str, Any]) -> Device | None:
    """The device of the first argument that lies on one already."""
    for thing in (occluders, *alternatives.values()):
        if isinstance(thing, (Occluders, Instances)):
            return maker_of(thing)
    return None


def occluders_on(device: Device, occluders: Any) -> Occluders:
    """The occluders on `device`: uploaded, or checked if they lie on a device already."""
    if isinstance(occluders, Occluders):
        if occluders.device is not device:
            raise ValueError(
                "occluders: expected Occluders of this device, got one of another Device"
            )
        return occluders
    return device.occluders(
        meshes_of("occluders", occluders, f"Occluders, {A_MESH}, or a sequence of them")
    )


def upload(bounds: Bounds | Instances, device: Device) -> Instances:
    """The instances on `device`: uploaded, or checked if they lie on a device already."""
    if not isinstance(bounds, Instances):
        return device.instances(bounds)
    if bounds.device is not device:
        raise ValueError("bounds: expected Instances of this device, got one of another Device")
    return bounds
