"""A single call streams its bounds: masks across its parts, what it keeps, and its hints."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest

import hizvk

#: More than a part of 65,536 bounds.
COUNT = 2 * 65_536 + 77
SIZE = (60, 90)


def camera(size: tuple[int, int] = SIZE) -> hizvk.Camera:
    return hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=size, near=0.1)


def bounds(kind: str, count: int = COUNT, dtype: Any = np.float32) -> Any:
    rng = np.random.default_rng(3)
    centers = rng.uniform((-60, -40, -120), (60, 40, 5), (count, 3)).astype(dtype)
    centers[::1001] = np.nan
    half = rng.uniform(0.0, 1.0, (count, 3)).astype(dtype)
    if kind == "spheres":
        return hizvk.Spheres(centers, half[:, 0])
    if kind == "boxes":
        return hizvk.Boxes(centers - half, centers + half)
    turns = np.broadcast_to(np.eye(3, dtype=dtype), (count, 3, 3))
    return hizvk.OrientedBoxes(centers, half, turns)


def wall(depth: float, size: tuple[int, int] = SIZE) -> Any:
    image = np.full(size, 100.0, np.float32)
    image[:, size[1] // 3 :] = depth
    return image


def flat(device: hizvk.Device, them: Any, view: hizvk.Camera, image: Any) -> Any:
    pyramid = device.pyramid(image, view, kind="z")
    return device.cull(device.instances(them), view, pyramid, hierarchy=False).mask


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("kind", ["spheres", "boxes", "oriented_boxes"])
def test_the_mask_is_that_of_a_cull_without_groups(
    device: hizvk.Device, kind: str, dtype: Any
) -> None:
    them, view, image = bounds(kind, dtype=dtype), camera(), wall(20.0)
    expected = flat(device, them, view, image)
    assert 0 < expected.sum() < COUNT
    for hierarchy in (None, False):
        seen = hizvk.visible(them, view, depth=image, kind="z", device=device, hierarchy=hierarchy)
        np.testing.assert_array_equal(seen, expected)
        assert seen.flags.writeable
        assert seen.dtype == np.bool_
    grouped = hizvk.visible(them, view, depth=image, kind="z", device=device, hierarchy=True)
    assert not (grouped & ~expected).any()  # a group's test may hide a few more
    assert (expected & ~grouped).mean() < 1e-3


@pytest.mark.parametrize("count", [0, 1, 65_535, 65_536, 65_537])
def test_every_number_of_bounds_has_its_mask(device: hizvk.Device, count: int) -> None:
    them, view, image = bounds("boxes", count), camera(), wall(20.0)
    seen = hizvk.visible(them, view, depth=image, kind="z", device=device)
    np.testing.assert_array_equal(seen, flat(device, them, view, image))


def test_what_is_kept_never_answers_for_another_image(device: hizvk.Device) -> None:
    """Calls of one size and of others, near and far walls, in turns, and depth on the device."""
    for count in (500, 70_000):
        them = bounds("boxes", count)
        for depth, size in [(20.0, SIZE), (5.0, SIZE), (90.0, SIZE), (5.0, (33, 65)), (20.0, SIZE)]:
            view, image = camera(size), wall(depth, size)
            expected = flat(device, them, view, image)
            for dtype in (np.float32, np.float64):
                seen = hizvk.visible(them, view, depth=image.astype(dtype), kind="z", device=device)
                assert (seen == expected).mean() > 0.999
                assert not (expected & ~seen).any() or dtype is np.float64
    view = camera()
    mesh = hizvk.Mesh([[-99.0, -99, -20], [99.0, -99, -20], [0.0, 99, -20]], [[0, 1, 2]])
    rendered = device.render_depth(device.occluders([mesh]), view)
    them = bounds("boxes")
    pyramid = device.pyramid(rendered)
    expected = device.cull(device.instances(them), view, pyramid, hierarchy=False).mask
    np.testing.assert_array_equal(hizvk.visible(them, view, depth=rendered), expected)


def test_threads_have_their_own_answers(device: hizvk.Device) -> None:
    them, view = bounds("boxes", 70_000), camera()
    images = [wall(depth) for depth in (5.0, 20.0, 60.0, 90.0)]
    expected = [flat(device, them, view, image) for image in images]
    wrong: list[int] = []

    def work(k: int) -> None:
        for _ in range(5):
            seen = hizvk.visible(them, view, depth=images[k], kind="z", device=device)
            if not np.array_equal(seen, expected[k]):
                wrong.append(k)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_hints_look_at_all_parts(device: hizvk.Device) -> None:
    view = camera()
    far = np.zeros(SIZE, np.float32)
    with pytest.warns(hizvk.HizWarning, match="every pixel is far"):
        hizvk.visible(bounds("boxes"), view, depth=far, kind=view.depth_kind, device=device)
    away = hizvk.Spheres(np.full((COUNT, 3), 500.0), 1.0)
    with pytest.warns(hizvk.HizWarning, match=f"all {COUNT:,} lie outside"):
        hizvk.visible(away, view, depth=wall(20.0), kind="z", device=device)
    # Only the last bounds are hidden by the wall.
    centers = np.full((COUNT, 3), (0.0, 0.0, -2.0))
    centers[-9:] = (0.0, 0.0, -50.0)
    seen = hizvk.visible(
        hizvk.Spheres(centers, 0.1), view, depth=wall(20.0), kind="z", device=device
    )
    assert seen.sum() == COUNT - 9
