"""Both ends of a pyramid, bit for bit against numpy by their definition."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hizvk

ENDS = ("farthest", "nearest")
SIZES = [(1, 1), (1, 9), (9, 1), (7, 5), (31, 33), (65, 63), (64, 64), (3, 200)]
F32 = npt.NDArray[np.float32]


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(14)


def camera(size: tuple[int, int], reversed_z: bool, far: float | None = None) -> hizvk.Camera:
    return hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=size, near=0.5, far=far, reversed_z=reversed_z
    )


def own_kind(reversed_z: bool) -> str:
    return "reversed_ndc" if reversed_z else "ndc"


def by_definition(image: F32, end: str, reversed_z: bool, receivers: bool = False) -> F32:
    """What each pixel adds to an end; the other end's value where it adds nothing."""
    far = np.float32(0 if reversed_z else 1)
    is_depth = (image >= 0) & (image <= 1)
    out = np.where(is_depth, image, far if end == "farthest" else 1 - far)
    out = np.where(np.abs(out) < np.finfo(np.float32).tiny, 0, out)
    if receivers:
        out = np.where(image == far, 1 - far if end == "farthest" else far, out)
    return out.astype(np.float32)


def block_level(level_0: F32, k: int, greatest: bool) -> F32:
    """Level `k`, straight from the pixels of each block."""
    height, width = level_0.shape
    rows, columns = (-(-n // 2**k) for n in (height, width))
    spare = -np.inf if greatest else np.inf
    padded = np.full((rows * 2**k, columns * 2**k), spare, np.float32)
    padded[:height, :width] = level_0
    blocks = padded.reshape(rows, 2**k, columns, 2**k)
    return blocks.max(axis=(1, 3)) if greatest else blocks.min(axis=(1, 3))


def check(hiz: hizvk.Pyramid, pixels: dict[str, F32], reversed_z: bool) -> None:
    """All levels that are there, of all ends in `pixels`."""
    for end, level_0 in pixels.items():
        greatest = (end == "farthest") != reversed_z
        for k in [0, *hiz.levels]:
            expected = block_level(level_0, k, greatest)
            found = hiz.level(k, end=end)  # type: ignore[arg-type]
            assert found.dtype == np.float32
            assert found.shape == expected.shape
            assert np.array_equal(found, expected), (hiz, end, k)


def odd_image(size: tuple[int, int], rng: np.random.Generator) -> F32:
    image = rng.random(size, np.float32)
    odd = np.float32([np.nan, np.inf, -np.inf, -0.0, 0, 1, 1.5, -1, 1e-40, np.nextafter(1, 2)])
    where = rng.random(size) < 0.2
    image[where] = rng.choice(odd, size)[where]
    return image


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("depths", ["farthest", "nearest", "both", "receivers"])
def test_levels_are_those_of_their_pixels(
    device: hizvk.Device, depths: Any, reversed_z: bool, rng: np.random.Generator
) -> None:
    for size in SIZES:
        image = odd_image(size, rng)
        far = 0 if reversed_z else 1
        image[: size[0] // 2] = far
        for levels in (None, 2, (3, 3)):
            hiz = device.pyramid(
                image,
                camera(size, reversed_z),
                kind=own_kind(reversed_z),  # type: ignore[arg-type]
                levels=levels,
                depths=depths,
            )
            assert hiz.depths == depths
            ends = [depths] if depths in ENDS else ENDS
            pixels = {
                end: by_definition(image, end, reversed_z, depths == "receivers") for end in ends
            }
            check(hiz, pixels, reversed_z)


@pytest.mark.parametrize("reversed_z", [False, True])
def test_a_part_is_renewed_as_the_whole_is(
    device: hizvk.Device, reversed_z: bool, rng: np.random.Generator
) -> None:
    size = (45, 67)
    view = camera(size, reversed_z)
    for depths in ("both", "receivers"):
        image = odd_image(size, rng)
        keywords: dict[str, Any] = {"kind": own_kind(reversed_z), "depths": depths}
        hiz = device.pyramid(image, view, **keywords)
        for _ in range(12):
            y, x = (int(rng.integers(0, n)) for n in size)
            height, width = int(rng.integers(1, 46 - y)), int(rng.integers(1, 68 - x))
            image[y : y + height, x : x + width] = odd_image((height, width), rng)
            hiz.update(y, x, image[y : y + height, x : x + width].copy())
        pixels = {
            end: by_definition(image, end, reversed_z, depths == "receivers") for end in ENDS
        }
        check(hiz, pixels, reversed_z)


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("samples", [2, 4])
def test_samples_have_both_ends(
    device: hizvk.Device, samples: int, reversed_z: bool, rng: np.random.Generator
) -> None:
    size = (19, 26)
    far = np.float32(0 if reversed_z else 1)
    stack = np.stack([odd_image(size, rng) for _ in range(samples)], axis=2)
    stack[:9, :9] = far
    stack[12, 12, 0], stack[12, 12, 1:] = far, 0.5
    for depths in ("both", "receivers"):
        keywords: dict[str, Any] = {"kind": own_kind(reversed_z), "depths": depths}
        hiz = device.pyramid(stack, camera(size, reversed_z), **keywords)
        pixels = {}
        for end in ENDS:
            greatest = (end == "farthest") != reversed_z
            each = np.stack(
                [by_definition(stack[..., s], end, reversed_z) for s in range(samples)], axis=2
            )
            pixels[end] = each.max(axis=2) if greatest else each.min(axis=2)
        if depths == "receivers":
            # All samples are background; a receiver beside background keeps the far sample.
            only_background = pixels["nearest"] == far
            pixels["farthest"] = np.where(only_background, 1 - far, pixels["farthest"])
        check(hiz, pixels, reversed_z)
        nearest = device.pyramid(
            stack, camera(size, reversed_z), **{**keywords, "depths": "nearest"}
        )
        check(nearest, {"nearest": pixels["nearest"]}, reversed_z)


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("kind", ["z", "distance"])
@pytest.mark.parametrize("dtype", ["float64", "float32", "float16", "uint16"])
def test_no_data_of_measured_depth_is_near_in_the_nearest_end(
    device: hizvk.Device, dtype: str, kind: Any, reversed_z: bool
) -> None:
    """Walls of 8 m with a wall at 2 m, a pixel without data, and one that is far."""
    far = None if kind == "distance" else 9.0
    view = camera((16, 16), reversed_z, far)
    image = np.full((16, 16), 8, dtype)
    image[3, 3], image[4, 12], image[12, 4] = 2, 0, 9
    no_data = np.float32(0 if reversed_z else 1)
    for depths in ("both", "receivers"):
        hiz = device.pyramid(image, view, kind=kind, depths=depths, invalid=[0])  # type: ignore[call-overload]
        sign = -1 if reversed_z else 1
        farthest, nearest = (sign * hiz.level(3, end=end) for end in ENDS)
        assert nearest[0, 1] == sign * (1 - no_data), "no data is near"
        assert farthest[0, 1] == sign * no_data, "and far"
        assert nearest[0, 0] < nearest[1, 1], "the near wall"
        assert (nearest <= farthest).all()
        if far is not None:
            one = 2.0**-126 if reversed_z else 1 - 2.0**-24
            at_far = hiz.level(0, end="farthest")[12, 4]
            if depths == "receivers":
                assert at_far == np.float32(one), "a measured pixel is never background"
            else:
                assert at_far in (np.float32(one), no_data)


def test_receivers_without_any(device: hizvk.Device) -> None:
    for reversed_z in (False, True):
        far = np.float32(0 if reversed_z else 1)
        image = np.full((8, 16), far, np.float32)
        image[0, 8] = np.nan
        view = camera((8, 16), reversed_z)
        kind: Any = own_kind(reversed_z)
        hiz = device.pyramid(image, view, kind=kind, depths="receivers")
        assert hiz.level(3, end="farthest").tolist() == [[1 - far, far]], "nothing; undecided"
        assert hiz.level(3, end="nearest").tolist() == [[far, 1 - far]]


def test_what_refuses_a_pyramid_says_why(device: hizvk.Device) -> None:
    view = camera((8, 8), True)
    ball = device.instances(hizvk.Spheres([[0, 0, -3]], 0.5))
    for depths, why in (("nearest", "no farthest depths"), ("receivers", "leaves out background")):
        hiz = device.pyramid(np.ones((8, 8)), view, kind="z", depths=depths)  # type: ignore[call-overload]
        with pytest.raises(ValueError, match=why):
            device.cull(ball, view, hiz)
    with pytest.raises(ValueError, match='end: expected one of "farthest"'):
        device.pyramid(np.ones((8, 8)), view, kind="z").level(1, end="nearest")
    alone = device.pyramid(np.ones((8, 8)), view, kind="z", depths="nearest")
    assert np.array_equal(alone.level(1), alone.level(1, end="nearest"))
    assert "depths nearest" in repr(alone)


def test_both_ends_hide_the_same(device: hizvk.Device, rng: np.random.Generator) -> None:
    """Whatever the nearest end says, the farthest says what it said alone."""
    for reversed_z, dtype in itertools.product((False, True), ("float64", "float32", "float16")):
        view = camera((64, 64), reversed_z, 100.0)
        image = rng.uniform(2, 60, (64, 64)).astype(dtype)
        image[rng.random((64, 64)) < 0.05] = np.nan
        image[10:30, 10:50] = 100
        centers = rng.uniform((-9, -9, -40), (9, 9, -1), (2000, 3))
        balls = device.instances(hizvk.Spheres(centers, 0.05))
        masks = []
        for depths in ("farthest", "both"):
            hiz = device.pyramid(image, view, kind="z", depths=depths)  # type: ignore[call-overload]
            masks.append(device.cull(balls, view, hiz).mask)
        assert np.array_equal(*masks)
        assert not masks[0].all()
        assert masks[0].any()
