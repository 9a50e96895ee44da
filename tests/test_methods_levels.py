"""Turitzin's ways to make levels: bit-exact where the text is right, and wrong where it is not.

The expected levels come from loops over texels, written here.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt
import pytest

import hizvk
from hizvk.methods import MethodLevels, turitzin
from hizvk.methods.levels import SHAPES

if TYPE_CHECKING:
    from hizvk.methods.levels import _LevelWay

Array: TypeAlias = npt.NDArray[Any]


def image_of(size: tuple[int, int], seed: int = 1) -> Array:
    return np.random.default_rng(seed).uniform(0.01, 0.99, size).astype(np.float32)


def level_4(image: Array) -> Array:
    """The least depth of each 16x16 pixels; the last ones may be cut off."""
    height, width = image.shape
    return np.array(
        [
            [min(image[y : y + 16, x : x + 16].ravel().tolist()) for x in range(0, width, 16)]
            for y in range(0, height, 16)
        ],
        np.float32,
    )


def made(
    device: hizvk.Device, way: _LevelWay, images: list[Array], k: int, **more: Any
) -> list[Array]:
    levels = MethodLevels(device, way, images, **more)
    levels.run()
    return [levels.level(eye, k) for eye in range(len(images))]


def same_bits(a: Array, b: Array) -> bool:
    return a.shape == b.shape and bool((a.view(np.uint32) == b.view(np.uint32)).all())


@pytest.mark.parametrize("size", [(1, 1), (16, 16), (17, 33), (5, 130), (111, 103)])
def test_level_4_alone(device: hizvk.Device, size: tuple[int, int]) -> None:
    """Every shape, the tree, and the library's own, for two images at once."""
    images = [image_of(size, seed) for seed in (1, 2)]
    expected = [level_4(image) for image in images]
    for shape in SHAPES:
        for got, want in zip(made(device, "atomic", images, 4, shape=shape), expected, strict=True):
            assert same_bits(got, want), shape
    for got, want in zip(made(device, "tree", images, 4), expected, strict=True):
        assert same_bits(got, want)
    if max(size) > 16:
        own = made(device, "pyramid", images, 4, levels=(4, 4))
        assert all(same_bits(got, want) for got, want in zip(own, expected, strict=True))


@pytest.mark.parametrize("size", [(2, 2), (7, 5), (64, 9), (61, 130)])
def test_fragment_passes_make_every_level(device: hizvk.Device, size: tuple[int, int]) -> None:
    """Texel i of n covers the pixels from floor(i S / n) to before ceil((i + 1) S / n)."""
    image = image_of(size)
    levels = MethodLevels(device, "fragment", [image])
    levels.run()
    fine = image
    for k in range(1, int(math.log2(max(size))) + 1):
        sides = [max(side // 2, 1) for side in fine.shape]
        ends = [
            [(i * side // n, -(-(i + 1) * side // n)) for i in range(n)]
            for side, n in zip(fine.shape, sides, strict=True)
        ]
        fine = np.array(
            [[fine[a:b, c:d].min() for c, d in ends[1]] for a, b in ends[0]], np.float32
        )
        assert same_bits(levels.level(0, k), fine), k
    assert fine.shape == (1, 1)


@pytest.mark.parametrize("bad", [np.float32(-0.0), np.float32("nan")])
def test_minus_zero_and_nan_break_the_order_of_bits(device: hizvk.Device, bad: np.float32) -> None:
    """In reversed depth a pixel of -0.0 is as far as can be, and NaN is no depth, so far.

    Atomic minima of bits miss it, and the pyramid does not.
    """
    image = np.full((16, 16), 0.25, np.float32)
    image[9, 3] = bad
    for way in ("atomic", "tree"):
        assert made(device, way, [image], 4)[0].tolist() == [[0.25]]  # type: ignore[arg-type]
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(16, 16), near=0.1)
    pyramid = device.pyramid(image, camera, kind="reversed_ndc")
    assert pyramid.level(4).tolist() == [[0.0]]
    # A zero without a sign is no fault of theirs.
    image[9, 3] = 0.0
    assert made(device, "atomic", [image], 4)[0].tolist() == [[0.0]]


def test_an_initial_one_caps_larger_depths(device: hizvk.Device) -> None:
    """The least of view depths from 3 to 9 becomes 1, where the minimum begins at 1.

    The tree begins with pixels, and has the number.
    """
    image = np.linspace(3.0, 9.0, 256, dtype=np.float32).reshape(16, 16)
    assert made(device, "atomic", [image], 4)[0].tolist() == [[1.0]]
    assert made(device, "tree", [image], 4)[0].tolist() == [[3.0]]


def test_what_it_refuses(device: hizvk.Device) -> None:
    image = image_of((20, 20))
    with pytest.raises(ValueError, match=r"shape: expected one of \(\(16, 16\), .*, got \(2, 2\)"):
        MethodLevels(device, "atomic", [image], shape=(2, 2))
    with pytest.raises(ValueError, match=r"images: expected at least one, all of one size, got \["):
        MethodLevels(device, "tree", [image, image[1:]])
    with pytest.raises(ValueError, match=r'way: expected one of "fragment", "atomic", "tree"'):
        MethodLevels(device, "guess", [image])  # type: ignore[arg-type]
    levels = MethodLevels(device, "tree", [image])
    with pytest.raises(ValueError, match="level: expected 4, got 3 of image 0"):
        levels.level(0, 3)
    with pytest.raises(ValueError, match="expected an image that was given, got 4 of image 1"):
        levels.level(1, 4)


def test_the_table_has_every_way(capsys: pytest.CaptureFixture[str]) -> None:
    assert turitzin.main(["--quick", "--repetitions", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = [line for line in lines if line.startswith("| ")][1:]
    assert "412 x 444" in lines[0]
    assert len(rows) == 5 + len(SHAPES) + 1
    assert all("| yes |" in row for row in rows)


def test_a_wrong_level_is_told(monkeypatch: pytest.MonkeyPatch, device: hizvk.Device) -> None:
    """A row whose bits differ from NumPy's says so."""
    right = turitzin.farthest_blocks

    def wrong(image: Array, level: int) -> Array:
        found = right(image, level).copy()
        found[-1, -1] = np.nextafter(found[-1, -1], np.float32(1.0))
        return found

    monkeypatch.setattr(turitzin, "farthest_blocks", wrong)
    rows = turitzin.measure(device, size=(34, 50), repetitions=1)
    assert [row.is_exact for row in rows] == [True, True] + [False] * (len(rows) - 2)
