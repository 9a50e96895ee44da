"""Mip textures of depth: their texels by definition, in numpy, and what the device makes.

``crates/hiz_core/tests/mips.rs`` has more sizes, and what shaders read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pytest

import hizvk
from hizvk._types import MipLookup, words

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hizvk._types import MipDepths

Ints = npt.NDArray[np.int64]
Depths = npt.NDArray[np.float32]

#: Sizes that the device is asked for: single rows, primes, powers of two and their neighbours.
SIZES = [(1, 1), (1, 7), (9, 1), (5, 5), (16, 17), (33, 31), (64, 63), (97, 129), (270, 481)]


def sides(n: int) -> list[int]:
    """Texels along an axis, from level 0 to the level of one."""
    return [max(1, n >> k) for k in range(n.bit_length())]


def supports(n: int) -> Iterator[tuple[int, Ints, Ints]]:
    """For each level its texels, and the first and the last pixel that went into each.

    A level takes two texels of the one before it, or three where that one's size is odd.
    """
    first = last = np.arange(n)
    yield n, first, last
    for texels in sides(n)[1:]:
        before = len(first)
        i = np.arange(texels)
        third = np.minimum(2 * i + 1 + before % 2, before - 1)
        first, last = first[2 * i], last[third]
        yield texels, first, last


def test_no_pixel_of_a_footprint_is_missed() -> None:
    """The footprint of texel i of n is the half-open interval i/n..(i+1)/n of the image.

    Along one axis: footprints and taps of a texel are products of those of its axes.
    """
    missed = counted = 0
    for side in range(1, 4201):
        for texels, first, last in supports(side):
            i = np.arange(texels)
            begin = i * side // texels
            end = -((i + 1) * -side // texels) - 1
            missed += int(np.count_nonzero((first > begin) | (last < end)))
            counted += texels
    print(f"sizes 1..4200: {counted} texels, {missed} miss a pixel of their footprint")
    assert missed == 0
    assert counted > 17_000_000


def test_two_texels_on_odd_sizes_miss_pixels() -> None:
    """The fault that the third texel prevents: the last row or column is lost."""
    missed = 0
    for side in range(1, 200):
        last = np.arange(side)
        for texels in sides(side)[1:]:
            last = last[2 * np.arange(texels) + 1]
            end = -((np.arange(texels) + 1) * -side // texels) - 1
            missed += int(np.count_nonzero(last < end))
    assert missed > 1000


def test_mip_texel_covers_its_pixel() -> None:
    """All sizes of 1 to 130 rows by those around powers of two, all levels, every row and column.

    Rows and columns swap roles in every other size.
    """
    lengths = range(1, 131)
    others = [*range(1, 10), 15, 16, 17, 31, 32, 33, 63, 64, 65, 97, 127, 128, 129, 130]
    normalized = {n: list(supports(n)) for n in lengths}
    wrong = 0
    for one in lengths:
        for k, other in enumerate(others):
            height, width = (one, other) if (one + k) % 2 else (other, one)
            i = np.arange(max(height, width))
            pixels = np.stack([i % height, i % width], axis=-1)
            for level in range(max(height, width).bit_length()):
                centre = hizvk.mip_texel(pixels, level, (height, width))
                edge = hizvk.mip_texel(pixels, level, (height, width), "edge_texel")
                for axis, n in enumerate((height, width)):
                    last = len(normalized[n]) - 1
                    texels, first, end = normalized[n][min(level, last)]
                    p, t = pixels[:, axis], centre[:, axis]
                    inside = (t >= 0) & (t < texels)
                    # The texel's part of the image holds the pixel's centre.
                    inside &= (t * 2 * n <= (2 * p + 1) * texels) & (
                        (t + 1) * 2 * n > (2 * p + 1) * texels
                    )
                    wrong += int(np.count_nonzero(~inside))
                    t = np.clip(t, 0, texels - 1)
                    wrong += int(np.count_nonzero((p < first[t]) | (p > end[t])))
                    # Blocks of 2^level pixels; the last one takes what is left.
                    begins = np.arange(texels) << level
                    of_block = np.searchsorted(begins, p, side="right") - 1
                    wrong += int(np.count_nonzero(edge[:, axis] != of_block))
    assert wrong == 0


def ends_of(image: Depths, far: float) -> tuple[Depths, Depths]:
    """Farthest and nearest depth of each pixel; what is no depth may be either."""
    valid = (image >= 0) & (image <= 1)
    plain = np.where(valid & (image >= np.finfo(np.float32).tiny), image, np.float32(0))
    return (
        np.where(valid, plain, np.float32(far)).astype(np.float32),
        np.where(valid, plain, np.float32(1 - far)).astype(np.float32),
    )


def by_definition(image: Depths, lookup: MipLookup, is_max: bool) -> list[Depths]:
    """All levels of sanitized depths."""
    join = np.maximum if is_max else np.minimum
    height, width = image.shape
    levels = [image]
    for k in range(1, max(height, width).bit_length()):
        rows, columns = max(1, height >> k), max(1, width >> k)
        if lookup == "edge_texel":
            begins = [np.arange(rows) << k, np.arange(columns) << k]
            by_rows = join.reduceat(image, begins[0], axis=0)
            levels.append(join.reduceat(by_rows, begins[1], axis=1))
            continue
        before = levels[-1]
        for axis, texels in enumerate((rows, columns)):
            n = before.shape[axis]
            taken = [np.minimum(2 * np.arange(texels) + t, n - 1) for t in range(2 + n % 2)]
            before = join.reduce([np.take(before, t, axis=axis) for t in taken])
        levels.append(before)
    return levels


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("lookup", words(MipLookup))
def test_levels_of_the_device(device: hizvk.Device, lookup: MipLookup, reversed_z: bool) -> None:
    rng = np.random.default_rng(14)
    odd = np.array([np.nan, np.inf, -np.inf, -0.5, 1.5, -0.0, 1e-40, -1e-40], np.float32)
    far = 0.0 if reversed_z else 1.0
    for size in SIZES:
        camera = hizvk.Camera.look_at(
            (0, 0, 0),
            (0, 0, -1),
            fov_y_deg=60,
            size=size,
            near=0.1,
            reversed_z=reversed_z,
            far=None if reversed_z else 100.0,
        )
        image = rng.random(size, np.float32)
        image = np.where(rng.random(size) < 0.02, rng.choice(odd, size), image)
        with np.errstate(invalid="ignore"):
            hiz = device.pyramid(image, camera, kind=camera.depth_kind)
        farthest, nearest = ends_of(image, far)
        expected: dict[MipDepths, list[Depths]] = {
            "farthest": by_definition(farthest, lookup, not reversed_z),
            "nearest": by_definition(nearest, lookup, reversed_z),
        }
        expected["both"] = [
            np.stack(pair, axis=-1)
            for pair in zip(expected["farthest"], expected["nearest"], strict=True)
        ]
        for depths, levels in expected.items():
            made = hiz.mips(depths=depths, lookup=lookup)
            assert len(made) == len(levels)
            for k, (found, level) in enumerate(zip(made, levels, strict=True)):
                assert found.dtype == np.float32
                np.testing.assert_array_equal(
                    found.view(np.uint32), level.view(np.uint32), f"{size}, {depths}, level {k}"
                )


def test_wgsl_has_the_functions() -> None:
    lookup, cull = hizvk.wgsl(), hizvk.wgsl("mip_cull")
    assert "fn mip_texel_at(" in lookup
    assert "fn mip_hides(" in cull
    # Sizes are arguments: a level's size must not be asked for per invocation.
    code = "\n".join(line.split("//")[0] for line in lookup.splitlines())
    assert "textureDimensions" not in code


def test_the_nearest_depths_of_what_lost_its_no_data_are_refused(device: hizvk.Device) -> None:
    """A pyramid of the farthest depths alone: its conversion has made "no data" far."""
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(8, 8), near=0.1)
    image = np.full((8, 8), 10.0)
    whole = device.pyramid(image, camera, kind="z")
    assert (whole.mips(depths="nearest")[3] > 0).all(), "nothing was lost"
    image[3, 3] = 0
    holed = device.pyramid(image, camera, kind="z")
    for depths in ("nearest", "both"):
        with pytest.raises(ValueError, match="build the pyramid with depths both"):
            holed.mips(depths=depths)  # type: ignore[arg-type]
    assert holed.mips()[3][0, 0] == 0.0, "far"
    both = device.pyramid(image, camera, kind="z", depths="both")
    assert both.mips(depths="nearest")[3][0, 0] == 1.0, "near"
    # An update may lose it, too.
    whole.update(0, 0, np.zeros((1, 1)))
    with pytest.raises(ValueError, match="build the pyramid with depths both"):
        whole.mips(depths="nearest")


def test_mips_of_several_samples(device: hizvk.Device) -> None:
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(8, 8), near=0.1)
    image = np.random.default_rng(4).uniform(0.1, 0.9, (8, 8, 4)).astype(np.float32)
    both = device.pyramid(image, camera, kind="reversed_ndc", depths="both")
    assert both.mips(depths="nearest")[3][0, 0] == image.max()
    assert both.mips(depths="farthest")[3][0, 0] == image.min()
    farthest = device.pyramid(image, camera, kind="reversed_ndc")
    assert farthest.mips()[3][0, 0] == image.min()
    with pytest.raises(ValueError, match="farthest of 4 samples"):
        farthest.mips(depths="nearest")
