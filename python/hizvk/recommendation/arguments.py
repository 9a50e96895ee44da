"""The arguments of `hizvk.recommend`: checked, as plain lists, and on one device."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .. import _arguments
from ..bounds import Boxes, Points, are_points
from ..camera import Camera
from ..depth import DepthArray, checked_image
from ..device import maker_of
from ..lod import LodByError, LodBySize, LodRule
from ..measuring.volumes import KINDS
from ..mesh import A_MESH, meshes_of
from ..occluders import select_occluders
from ..options import Outputs
from ..resources import Instances, Occluders

if TYPE_CHECKING:
    import numpy.typing as npt

    from ..bounds import Bounds
    from ..device import Device
    from ..mesh import Mesh
    from ..occluders import OccluderSelection
    from ..options import MeshLods

__all__ = [
    "alternatives_of",
    "as_points",
    "cameras_of",
    "device_of",
    "images_of",
    "lods_of",
    "occluders_on",
    "selections_of",
    "upload",
]

#: Parts of the triangles that are selected; 1 drops what is a poor occluder, without a budget.
_SELECTED: Final = (1, 4)
#: Widths in pixels of `LodBySize`, if no rule is given and the meshes' errors are unknown.
_WIDTHS: Final = (256.0, 128.0, 64.0, 32.0, 16.0, 8.0, 4.0)


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


def upload(
    bounds: Bounds | Instances, device: Device, mesh_ids: npt.ArrayLike | None = None
) -> Instances:
    """The instances on `device`: uploaded, or checked if they lie on a device already."""
    if not isinstance(bounds, Instances):
        return device.instances(bounds, mesh_ids=mesh_ids)
    if bounds.device is not device:
        raise ValueError("bounds: expected Instances of this device, got one of another Device")
    if mesh_ids is not None:
        got = _arguments.describe(mesh_ids)
        raise ValueError(f"mesh_ids: expected None beside Instances, which have theirs, got {got}")
    return bounds


def as_points(alternatives: dict[str, Bounds | Instances]) -> Points | None:
    """The bounds as `Points`, if they are points of another kind and the host has them."""
    (first, *others) = alternatives.values()
    if others or isinstance(first, (Points, Instances)) or not are_points(first):
        return None
    return Points(first.min if isinstance(first, Boxes) else first.centers)


def lods_of(meshes: Any, lods: Any) -> tuple[tuple[MeshLods, ...] | None, tuple[LodRule, ...]]:
    """The meshes and the rules for their levels of detail."""
    found: Any = Outputs(meshes=meshes).meshes
    if found is None:
        if lods is not None:
            got = _arguments.describe(lods)
            raise TypeError(f"lods: expected None without meshes, got {got}")
        return None, ()
    if lods is None:
        if any(error for mesh in found for error in mesh.errors):
            return found, (LodByError(1.0),)
        levels = max(len(mesh.draws) for mesh in found)
        return found, (LodBySize(_WIDTHS[: max(levels - 1, 1)]),)
    expected = "a sequence of LodByError, LodByDistance and LodBySize"
    if isinstance(lods, str) or not isinstance(lods, Sequence):
        raise TypeError(f"lods: expected {expected}, got {_arguments.describe(lods)}")
    if not lods:
        raise ValueError(f"lods: expected {expected}, got an empty one")
    for number, rule in enumerate(lods):
        if not isinstance(rule, LodRule):
            got = _arguments.describe(rule)
            raise TypeError(f"lods[{number}]: expected {expected}, got {got}")
    return found, tuple(lods)


def selections_of(
    occluders: Any, triangles: int, until: float
) -> dict[int, tuple[OccluderSelection, list[Mesh]]]:
    """By budget of triangles: what `select_occluders` keeps, if it is a part of the meshes.

    After the first no budget is tried that would not be done by `until`, as by `time.monotonic`.
    """
    if occluders is None or isinstance(occluders, Occluders):
        return {}  # the host has no meshes
    meshes = meshes_of("occluders", occluders, A_MESH)
    if len(meshes) < 2:
        return {}  # there is nothing to select
    found = {}
    took = 0.0
    for part in _SELECTED:
        began = time.monotonic()
        if part != _SELECTED[0] and began + took > until:
            break
        selection = select_occluders(meshes, max_triangles=triangles // part)
        if 0 < len(selection) < len(meshes):
            found[triangles // part] = selection, [meshes[k] for k in selection.kept]
        took = time.monotonic() - began
    return found
