"""Colours of a view in sunlight, from what the rays have seen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from ..scenes.truth import OCCLUDER, SKY, RayCaster

if TYPE_CHECKING:
    from .._arguments import Size
    from ..scenes import Scene, Terrain, View
    from ..scenes.grid import Floats
    from ..scenes.truth import Caster, Sight

__all__ = ["Image", "to_bytes", "view_picture"]

Image: TypeAlias = npt.NDArray[np.uint8]

SUN: Final = np.array([0.55, -0.48, 0.62]) / np.linalg.norm([0.55, -0.48, 0.62])
SUNLIGHT: Final = np.array([1.22, 1.06, 0.82])
SKYLIGHT: Final = np.array([0.40, 0.48, 0.60])
HAZE: Final = np.array([0.70, 0.79, 0.88])
ZENITH: Final = np.array([0.27, 0.47, 0.74])
#: The distance in metres after which 1/e of a colour is left.
HAZE_LENGTH: Final = 13_000.0


def view_picture(
    scene: Scene, view: View, sight: Sight, caster: Caster, *, samples: int = 1
) -> Image:
    """The scene in sunlight, as the rays saw it; ``(height, width, 3)``.

    Parameters
    ----------
    scene, view, sight
        What is seen from where.
    caster
        What the sight came from.
        A `RayCaster` also tells what lies in the shade, and can be asked for more samples.
    samples : int
        Points per side of each pixel that are averaged, for smooth edges.
    """
    size: Size = sight.owner.shape
    if samples == 1 or not isinstance(caster, RayCaster):
        return to_bytes(_colours(scene, view, sight, caster, view.rays(size)))
    total = np.zeros((*size, 3))
    for k in range(samples**2):
        shift = ((k % samples + 0.5) / samples - 0.5, (k // samples + 0.5) / samples - 0.5)
        closer = caster.look_shifted(view, size, shift)
        total += _colours(scene, view, closer, caster, view.rays(size, shift))
    return to_bytes(total / samples**2)


def _colours(scene: Scene, view: View, sight: Sight, caster: Caster, rays: Floats) -> Floats:
    """Light of each pixel, not yet clipped."""
    owner = sight.owner
    seen = owner != SKY
    up = rays[..., 2] / np.linalg.norm(rays, axis=-1)
    image: Floats = HAZE + (ZENITH - HAZE) * (np.clip(up, 0.0, 0.55) / 0.55)[..., None] ** 0.7
    depth = sight.depth[seen]
    points = rays[seen] * depth[:, None] + view.eye
    normal = sight.normal[seen].astype(np.float64)
    is_ground = owner[seen] == OCCLUDER
    albedo = _leaves(owner[seen])
    if scene.terrain is not None:
        albedo[is_ground], normal[is_ground] = _ground(
            scene.terrain, points[is_ground], depth[is_ground]
        )
    sun = np.clip(normal @ SUN, 0.0, 1.0)
    if isinstance(caster, RayCaster):
        sun *= caster.in_light(points + normal * (0.05 + 2e-4 * depth)[:, None], SUN)
    light = sun[:, None] * SUNLIGHT + (0.55 + 0.45 * normal[:, 2:]) * SKYLIGHT
    clear = np.exp(-depth / HAZE_LENGTH)[:, None]
    image[seen] = albedo * light * clear + HAZE * (1.0 - clear)
    return image


def _leaves(owner: npt.NDArray[np.int32]) -> Floats:
    """A green of its own for each instance."""
    vary = (owner.astype(np.uint32) * np.uint32(2654435761) >> np.uint32(8)).astype(
        np.float64
    ) / 2.0**24
    green: Floats = np.array([0.13, 0.25, 0.12]) + vary[:, None] * np.array([0.15, 0.14, 0.04])
    return green


def _ground(terrain: Terrain, points: Floats, distance: Floats) -> tuple[Floats, Floats]:
    """Colour and normal of the ground: low meadows, brown heights, bare slopes, in patches."""
    x, y, z = points.T
    normal = terrain.normal_at(x, y)
    patch, fine = np.zeros(len(x)), np.zeros(len(x))
    for length, heading in (
        (1900.0, 0.4),
        (1130.0, 1.9),
        (690.0, 2.7),
        (410.0, 0.9),
        (233.0, 2.2),
        (129.0, 1.4),
    ):
        patch += (
            np.cos((x * np.cos(heading) + y * np.sin(heading)) * 2.0 * np.pi / length + 3.0 * patch)
            / 6.0
        )
    for length, heading in ((83.0, 0.2), (47.0, 1.7), (29.0, 2.9), (17.0, 1.1)):
        fade = np.exp(-distance * 1.2 / (30.0 * length))  # before it is finer than the pixels
        fine += fade * np.cos(
            (x * np.cos(heading) + y * np.sin(heading)) * 2.0 * np.pi / length
            + 4.0 * patch
            + 2.0 * fine
        )
    high = np.clip((z - 470.0) / 480.0 + 0.45 * patch, 0.0, 1.0)[:, None]
    steep = np.clip((0.95 - normal[:, 2]) * 5.0 + 0.5 * patch, 0.0, 1.0)[:, None]
    colour = (1.0 - high) * np.array([0.33, 0.44, 0.19]) + high * np.array([0.53, 0.47, 0.27])
    colour = (1.0 - 0.6 * steep) * colour + 0.6 * steep * np.array([0.36, 0.34, 0.22])
    return colour * (1.0 + 0.16 * patch + 0.035 * fine)[:, None], normal


def to_bytes(image: Floats) -> Image:
    """Colours of 0 to 1 as bytes, clipped."""
    return (np.clip(image, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
