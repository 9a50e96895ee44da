"""Approximate culling: pictures with and without differ by at most what is said."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import hizvk

SIZE = (120, 160)
CAMERA = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=SIZE, near=0.1)


def scene(count: int, seed: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Corners of boxes of all sizes."""
    random = np.random.default_rng(seed)
    centers = np.c_[
        random.uniform(-20, 20, count),
        random.uniform(-14, 14, count),
        random.uniform(-40, -6, count),
    ]
    half = random.uniform(0.05, 1.2, (count, 1)) * random.uniform(0.5, 1.5, (count, 3))
    return centers - half, centers + half


def rendered(
    boxes: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]],
    drawn: npt.NDArray[np.bool_],
    size: tuple[int, int] = SIZE,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Depth and ids at the centres of pixels, by rays; inf and -1 are background."""
    height, width = size
    row, column = np.mgrid[0:height, 0:width] + 0.5
    x, y = (column - width / 2) * (2 / height), (height / 2 - row) * (2 / height)
    ray = np.stack([x, y, np.full_like(x, -1.0)], axis=-1)
    depth, ids = np.full(size, np.inf), np.full(size, -1)
    for i in np.flatnonzero(drawn):
        with np.errstate(divide="ignore", invalid="ignore"):
            at = np.stack([boxes[0][i] / ray, boxes[1][i] / ray])
        enter = np.nanmax(at.min(axis=0), axis=-1)
        nearer = (enter < np.nanmin(at.max(axis=0), axis=-1)) & (enter < depth)
        depth[nearer], ids[nearer] = enter[nearer], i
    return depth, ids


@pytest.mark.parametrize("negligible", [0, 3, 20, 200])
@pytest.mark.parametrize("own_depth", [False, True])
def test_pictures_differ_by_at_most_what_is_said(
    device: hizvk.Device, negligible: int, own_depth: bool
) -> None:
    """The depth image has some of the objects, or all of them."""
    boxes = scene(300, 7)
    everything = np.ones(300, bool)
    occluders = everything if own_depth else np.arange(300) < 60
    depth, _ = rendered(boxes, occluders)
    pyramid = device.pyramid(depth, CAMERA, kind="z")
    seen = device.cull_approximate(
        device.instances(hizvk.Boxes(*boxes)), CAMERA, pyramid, negligible_px=negligible
    )
    # What is drawn as an occluder is drawn in any case.
    drawn = seen.mask if own_depth else seen.mask | occluders
    _, before = rendered(boxes, everything)
    _, after = rendered(boxes, drawn)
    differing = int((before != after).sum())
    assert differing <= seen.pixels_lost
    each = seen.pixels["touched"].astype(int) - seen.pixels["hidden"]
    assert (each[seen.negligible] <= negligible).all()
    assert (each[~seen.negligible] > negligible).all()
    assert not (seen.mask & seen.negligible).any()
    if negligible == 0:
        assert differing == seen.pixels_lost == 0
    if negligible == 200:
        assert differing > 0, "the bound is tested"
        assert seen.pixels_lost < 20 * differing


def test_a_result_that_says_what_it_is(device: hizvk.Device) -> None:
    boxes = scene(40, 8)
    pyramid = device.pyramid(np.full(SIZE, np.inf), CAMERA, kind="z")
    crowd = device.instances(hizvk.Boxes(*boxes))
    seen = device.cull_approximate(crowd, CAMERA, pyramid, negligible_px=30, fit="volume")
    assert isinstance(seen, hizvk.ApproximateResult)
    assert not isinstance(seen, hizvk.CullResult)
    assert seen.approximate
    assert not hasattr(device.cull(crowd, CAMERA, pyramid), "approximate")
    assert seen.count == len(seen.indices) == int(seen.mask.sum())
    assert np.array_equal(np.flatnonzero(seen.mask), seen.indices)
    assert len(seen) == 40
    assert seen.negligible_px == 30
    assert repr(seen) == "<ApproximateResult of 40 instances, 30 px negligible>"
    # It cannot slip in where a certified result is expected.
    with pytest.raises(TypeError, match="among: expected"):
        device.cull(crowd, CAMERA, pyramid, among=seen)  # type: ignore[call-overload]
    with pytest.raises(TypeError, match="negligible_px"):
        device.cull(crowd, CAMERA, pyramid, negligible_px=3)  # type: ignore[call-overload]


@pytest.mark.parametrize("negligible", [4, 40])
def test_an_antialiased_picture(device: hizvk.Device, negligible: int) -> None:
    """Four samples per pixel, counted on an image of twice the size.

    A resolved pixel is the mean of its four samples.
    So the resolved pictures differ by at most a quarter of the samples lost, summed over pixels.
    """
    twice = (2 * SIZE[0], 2 * SIZE[1])
    boxes = scene(200, 9)
    everything = np.ones(200, bool)
    occluders = np.arange(200) < 40
    depth, _ = rendered(boxes, occluders, twice)
    camera = CAMERA.resized(twice)
    pyramid = device.pyramid(depth, camera, kind="z")
    seen = device.cull_approximate(
        device.instances(hizvk.Boxes(*boxes)), camera, pyramid, negligible_px=negligible
    )
    shade = np.append(np.random.default_rng(1).uniform(0, 1, 200), 0.0)

    def resolved(drawn: npt.NDArray[np.bool_]) -> npt.NDArray[np.float64]:
        _, ids = rendered(boxes, drawn, twice)
        means = shade[ids].reshape(SIZE[0], 2, SIZE[1], 2).mean(axis=(1, 3))
        return np.asarray(means)

    difference = np.abs(resolved(everything) - resolved(seen.mask | occluders))
    assert difference.sum() <= seen.pixels_lost / 4 + 1e-9
    assert np.count_nonzero(difference > 1e-12) <= seen.pixels_lost
    assert difference.any(), "the bound is tested"


def test_samples_of_the_standard_pattern(device: hizvk.Device) -> None:
    """The four samples of the standard pattern lie in four quarters of a pixel.

    So a multisampled image is an image of twice the size, whose pixels hold one sample each.
    """
    # In sixteenths of a pixel, as Vulkan and Direct3D have them.
    pattern = np.array([(6, 2), (14, 6), (2, 10), (10, 14)]) / 16
    quarters = np.floor(2 * pattern).astype(int)
    assert sorted(map(tuple, quarters)) == [(0, 0), (0, 1), (1, 0), (1, 1)]
    low, high = np.array([-1.0, -1.0, -6.0]), np.array([1.0, 1.0, -5.0])
    wall = 2.0  # hides everything left of the column 80.3
    twice = np.full((2 * SIZE[0], 2 * SIZE[1]), 1e9)
    covered, shown = 0, 0
    for (x, y), (column, row) in zip(pattern, quarters, strict=True):
        rows, columns = np.mgrid[0 : SIZE[0], 0 : SIZE[1]]
        px, py = columns + x, rows + y
        hidden = px < 80.3
        twice[row::2, column::2] = np.where(hidden, wall, 1e9)
        ray = (px - SIZE[1] / 2) * 2 / SIZE[0], (SIZE[0] / 2 - py) * 2 / SIZE[0]
        inside = np.ones(SIZE, bool)
        for axis in (0, 1):
            with np.errstate(divide="ignore"):
                at = np.sort([low[axis] / ray[axis], high[axis] / ray[axis]], axis=0)
            inside &= (at[0] < 6) & (at[1] > 5)
        covered += int(inside.sum())
        shown += int((inside & ~hidden).sum())
    camera = CAMERA.resized(twice.shape)
    box = device.instances(hizvk.Boxes([low], [high]))
    counts = device.cull(box, camera, device.pyramid(twice, camera, kind="z"), outputs=["pixels"])
    assert counts.pixels[0]["touched"] >= covered
    assert counts.pixels[0]["touched"] - counts.pixels[0]["hidden"] >= shown > 0
