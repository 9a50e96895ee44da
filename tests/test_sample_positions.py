"""Which culls hold for every sample position, as multisampling, jitter and larger images have them.

The picture is drawn here, in numpy: rays through random places of pixels meet boxes.
A culled box may be in front of all occluders at none of these places.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

import hizvk

if TYPE_CHECKING:
    from hizvk._types import Coverage

Floats = npt.NDArray[np.float64]

SIZE = (54, 96)
NEAR = 0.1
FOV_Y_DEG = 60.0
#: Samples of each culled box, and of each pixel of a multisampled image.
SAMPLES = 100
PIXEL_SAMPLES = 4
#: The box that a mesh of a box is made of: a corner is a bit per axis.
FACES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
FACES += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]


class Boxes(NamedTuple):
    """Boxes along the axes, ``(N, 3)`` each."""

    low: Floats
    high: Floats


def random_boxes(
    rng: np.random.Generator, count: int, depths: tuple[float, float], sides: tuple[float, float]
) -> Boxes:
    """Boxes in a view along -z from the origin, at these view depths and with these sides."""
    depth = rng.uniform(*depths, count)
    slope = np.tan(np.radians(FOV_Y_DEG / 2))
    y = depth * slope * rng.uniform(-1.1, 1.1, count)
    x = depth * slope * SIZE[1] / SIZE[0] * rng.uniform(-1.1, 1.1, count)
    centre = np.stack([x, y, -depth], axis=-1)
    half = rng.uniform(*sides, (count, 3)) / 2
    return Boxes(centre - half, centre + half)


def slats(depth: float, pixels: float) -> Boxes:
    """Upright slats over all of the view, with gaps of a third of a pixel between them."""
    pixel = 2 * depth * np.tan(np.radians(FOV_Y_DEG / 2)) / SIZE[0]
    begin = np.arange(-60, 60, pixels) * pixel
    end = begin + (pixels - 1 / 3) * pixel
    other = np.full_like(begin, 1.0)
    reach = 40 * pixel
    return Boxes(
        np.stack([begin, -reach * other, -(depth + 0.2) * other], axis=-1),
        np.stack([end, reach * other, -depth * other], axis=-1),
    )


def entries(places: Floats, boxes: Boxes) -> Floats:
    """The view depth at which the rays through places of the image enter each box; inf: never.

    Places are ``(..., 2)``, columns and rows in pixels, and must broadcast with the boxes.
    """
    focal = SIZE[0] / 2 / np.tan(np.radians(FOV_Y_DEG / 2))
    way = np.stack(
        [
            (places[..., 0] - SIZE[1] / 2) / focal,
            (SIZE[0] / 2 - places[..., 1]) / focal,
            np.full(places.shape[:-1], -1.0),
        ],
        axis=-1,
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = boxes.low / way, boxes.high / way
    enter = np.minimum(a, b).max(axis=-1)
    leave = np.maximum(a, b).min(axis=-1)
    hits: Floats = np.where((enter < leave) & (enter > NEAR), enter, np.inf)
    return hits


def nearest_entries(places: Floats, boxes: Boxes) -> Floats:
    """The view depth of the first box that each ray meets."""
    found = np.full(places.shape[:-1], np.inf)
    for low, high in zip(boxes.low, boxes.high, strict=True):
        np.minimum(found, entries(places, Boxes(low, high)), out=found)
    return found


def places_on(boxes: Boxes, rng: np.random.Generator) -> Floats:
    """Random places of the image within the rectangles of boxes in front of the eye."""
    focal = SIZE[0] / 2 / np.tan(np.radians(FOV_Y_DEG / 2))
    depth = np.stack([-boxes.high[:, 2], -boxes.low[:, 2]], axis=-1)
    columns = np.stack(
        [SIZE[1] / 2 + focal * side[:, 0, None] / depth for side in boxes], axis=-1
    ).reshape(len(depth), 4)
    rows = np.stack(
        [SIZE[0] / 2 - focal * side[:, 1, None] / depth for side in boxes], axis=-1
    ).reshape(len(depth), 4)
    axes = []
    for at, side in ((columns, SIZE[1]), (rows, SIZE[0])):
        begin = np.clip(at.min(axis=1), 0, side)[:, None]
        end = np.clip(at.max(axis=1), 0, side)[:, None]
        axes.append(rng.uniform(begin, end, (len(depth), SAMPLES)))
    return np.stack(axes, axis=-1)


class Scene(NamedTuple):
    """Occluders, what they may hide, and the view."""

    occluders: Boxes
    things: Boxes
    camera: hizvk.Camera


@pytest.fixture(params=[False, True], ids=["standard", "reversed"])
def scene(request: pytest.FixtureRequest) -> Scene:
    rng = np.random.default_rng(14)
    walls = [slats(9.0, 2.5), random_boxes(rng, 25, (4, 12), (0.5, 3))]
    occluders = Boxes(*(np.concatenate(sides) for sides in zip(*walls, strict=True)))
    things = random_boxes(rng, 3000, (10, 60), (0.05, 1.5))
    camera = hizvk.Camera.look_at(
        (0, 0, 0),
        (0, 0, -1),
        fov_y_deg=FOV_Y_DEG,
        size=SIZE,
        near=NEAR,
        far=None if request.param else 200.0,
        reversed_z=request.param,
    )
    return Scene(occluders, things, camera)


def uploaded(device: hizvk.Device, boxes: Boxes) -> hizvk.Occluders:
    """The boxes as one mesh."""
    bits = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], bool)
    corners = np.where(bits, boxes.high[:, None], boxes.low[:, None])
    triangles = np.array(FACES) + 8 * np.arange(len(corners))[:, None, None]
    return device.occluders(corners.reshape(-1, 3), triangles.reshape(-1, 3))


def shown(scene: Scene, culled: npt.NDArray[np.bool_]) -> tuple[int, int]:
    """At how many of how many places a culled box is in front of all occluders."""
    things = Boxes(scene.things.low[culled], scene.things.high[culled])
    places = places_on(things, np.random.default_rng(15))
    own = entries(places, Boxes(things.low[:, None], things.high[:, None]))
    in_front = own < nearest_entries(places, scene.occluders)
    return int(np.count_nonzero(in_front)), int(np.count_nonzero(np.isfinite(own)))


def culled_by(
    device: hizvk.Device, scene: Scene, hiz: hizvk.Pyramid, coverage: Coverage
) -> npt.NDArray[np.bool_]:
    crowd = device.instances(hizvk.Boxes(scene.things.low, scene.things.high))
    mask: npt.NDArray[np.bool_] = device.cull(crowd, scene.camera, hiz, coverage=coverage).mask
    return ~mask


def test_conservative_depth_holds_for_every_sample_position(
    device: hizvk.Device, scene: Scene
) -> None:
    depth = device.render_depth(uploaded(device, scene.occluders), scene.camera, conservative=True)
    culled = culled_by(device, scene, device.pyramid(depth), "area")
    wrong, places = shown(scene, culled)
    print(f"{np.count_nonzero(culled)} culled, {wrong} of {places} places show one")
    assert wrong == 0
    assert places > 10_000


def test_plain_depth_at_pixel_centres_does_not(device: hizvk.Device, scene: Scene) -> None:
    """The fault that conservative depth prevents, with the coverage that fits plain depth."""
    depth = device.render_depth(uploaded(device, scene.occluders), scene.camera)
    culled = culled_by(device, scene, device.pyramid(depth), "sample")
    wrong, places = shown(scene, culled)
    print(f"{np.count_nonzero(culled)} culled, {wrong} of {places} places show one")
    assert wrong > 100


def test_samples_of_pixels_hold_for_these_samples(device: hizvk.Device, scene: Scene) -> None:
    """The farthest of random samples of each pixel, and area coverage: no such sample shows one.

    With one sample per pixel for all of them, some do.
    """
    rng = np.random.default_rng(16)
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    corner = np.stack([columns, rows], axis=-1)[:, :, None].astype(np.float64)
    places = corner + rng.random((*SIZE, PIXEL_SAMPLES, 2))
    seen = nearest_entries(places, scene.occluders)
    far = float(np.finfo(np.float64).max)
    z = np.where(np.isfinite(seen), seen, far)
    found = {}
    for name, image in (("all", z), ("first", z[..., 0])):
        hiz = device.pyramid(image, scene.camera, kind="z", invalid=[far])
        culled = culled_by(device, scene, hiz, "area")
        things = Boxes(scene.things.low[culled], scene.things.high[culled])
        found[name] = int(np.count_nonzero(nearest_entries(places, things) < seen))
    print(f"samples that show a culled box: {found}")
    assert found["all"] == 0
    assert found["first"] > 0
