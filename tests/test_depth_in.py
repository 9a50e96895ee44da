"""Depth as renderers have it, from Python: samples per pixel, and rectangles that change."""

from typing import Any

import numpy as np
import pytest

import hizvk

SIZES = [(1, 1), (1, 7), (9, 1), (17, 13), (31, 33), (64, 65), (127, 251)]


def camera(size: tuple[int, int], *, reversed_z: bool = True) -> hizvk.Camera:
    """At the origin, looking along -z, with near 1 and far 100."""
    return hizvk.Camera.look_at(
        (0, 0, 0),
        (0, 0, -1),
        fov_y_deg=90,
        size=size,
        near=1.0,
        far=100.0,
        reversed_z=reversed_z,
    )


def levels_of(image: np.ndarray, *, reversed_z: bool) -> list[np.ndarray]:
    """Each texel of each level from all of its pixels, by the definition."""
    farthest = np.minimum if reversed_z else np.maximum
    far = 0.0 if reversed_z else 1.0
    image = image.astype(np.float32)
    with np.errstate(invalid="ignore"):
        image = np.where((image >= 0) & (image <= 1), image, np.float32(far))
    image = np.where(np.abs(image) < np.finfo(np.float32).tiny, np.float32(0), image)
    found, k = [image], 1
    while found[-1].size > 1:
        rows = farthest.reduceat(image, np.arange(0, image.shape[0], 1 << k), axis=0)
        found.append(farthest.reduceat(rows, np.arange(0, image.shape[1], 1 << k), axis=1))
        k += 1
    return found


def same_levels(hiz: hizvk.Pyramid, expected: list[np.ndarray]) -> bool:
    """Level 0 and all stored levels, bit for bit."""
    return all(
        np.array_equal(hiz.level(k).view(np.uint32), expected[k].view(np.uint32))
        for k in (0, *hiz.levels)
    )


def ndc_samples(rng: np.random.Generator, size: tuple[int, int], count: int) -> np.ndarray:
    """NDC depths, some of which are none."""
    bad = np.array([np.nan, -0.0, -0.5, 1.5, np.inf, 1e-40, 0.0, 1.0])
    samples = rng.random((*size, count))
    return np.where(rng.random(samples.shape) < 0.1, rng.choice(bad, samples.shape), samples)


# -- samples ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("reversed_z", [True, False])
@pytest.mark.parametrize("count", [2, 4, 8, 16])
def test_the_farthest_sample_counts(device: hizvk.Device, count: int, reversed_z: bool) -> None:
    rng = np.random.default_rng(count)
    kind: Any = "reversed_ndc" if reversed_z else "ndc"
    for size in SIZES:
        samples = ndc_samples(rng, size, count).astype(np.float32)
        planes = [levels_of(samples[..., k], reversed_z=reversed_z)[0] for k in range(count)]
        farthest = (np.min if reversed_z else np.max)(planes, axis=0)
        hiz = device.pyramid(samples, camera(size, reversed_z=reversed_z), kind=kind)
        assert same_levels(hiz, levels_of(farthest, reversed_z=reversed_z)), size


@pytest.mark.parametrize("kind", ["z", "distance"])
@pytest.mark.parametrize("dtype", ["float32", "float64", "float16", "uint16"])
def test_metric_samples_are_converted_one_by_one(
    device: hizvk.Device, kind: Any, dtype: str
) -> None:
    """A sample without data is infinitely far, and so is one in front of the near plane."""
    rng = np.random.default_rng(5)
    view = camera((12, 20))
    samples = rng.uniform(2, 60, (*view.size, 4))
    samples[rng.random(samples.shape) < 0.1] = 0.0
    samples[rng.random(samples.shape) < 0.05] = 0.25
    samples = samples.astype(dtype)
    planes = [device.pyramid(samples[..., k], view, kind=kind).level(0) for k in range(4)]
    hiz = device.pyramid(samples, view, kind=kind)
    assert same_levels(hiz, levels_of(np.min(planes, axis=0), reversed_z=True))
    # Where one of the samples is no depth, the pixel is far.
    none = (samples < 1).any(axis=2)
    assert (hiz.level(0)[none] == 0).all()
    assert (hiz.level(0)[~none] > 0).all()


def test_masked_samples_are_no_data(device: hizvk.Device) -> None:
    view = camera((4, 4))
    samples = np.ma.masked_array(np.full((4, 4, 2), 5.0), mask=False)
    samples[1, 2, 1] = np.ma.masked
    far = device.pyramid(samples, view, kind="z").level(0) == 0
    assert np.argwhere(far).tolist() == [[1, 2]]


def test_sample_coverage_is_refused(device: hizvk.Device) -> None:
    view = camera((8, 8))
    crowd = device.instances(hizvk.Spheres([[0.0, 0, -20]], 0.5))
    hiz = device.pyramid(np.full((8, 8, 4), 5.0), view, kind="z")
    assert not device.cull(crowd, view, hiz).mask[0]
    with pytest.raises(ValueError, match=r'^coverage: expected "area" .* 4 samples .*got "sample"'):
        device.cull(crowd, view, hiz, coverage="sample")


def test_what_is_seen_through_one_sample_is_kept(device: hizvk.Device) -> None:
    view = camera((8, 8))
    crowd = device.instances(hizvk.Spheres([[0.3, 0.3, -20]], 0.2))
    samples = np.full((8, 8, 4), 5.0)
    assert not device.cull(crowd, view, device.pyramid(samples, view, kind="z")).mask[0]
    samples[3, 4, 2] = 50.0
    assert device.cull(crowd, view, device.pyramid(samples, view, kind="z")).mask[0]


@pytest.mark.parametrize("shape", [(6, 8, 3), (6, 8, 5), (6, 8, 0)])
def test_other_counts_are_refused(device: hizvk.Device, shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"^depth: expected \(height, width\), or .* got \(6, 8, "):
        device.pyramid(np.ones(shape), camera((6, 8)), kind="z")


# -- rectangles ------------------------------------------------------------------------------------


@pytest.mark.parametrize("levels", [None, 2, (3, 3), (4, 4), (6, 6), (2, 5)])
@pytest.mark.parametrize("reversed_z", [True, False])
def test_arrays_end_as_a_pyramid_of_the_whole_image(
    device: hizvk.Device, levels: Any, reversed_z: bool
) -> None:
    rng = np.random.default_rng(11)
    kind: Any = "reversed_ndc" if reversed_z else "ndc"
    for size in SIZES:
        image = ndc_samples(rng, size, 1)[..., 0].astype(np.float32)
        view = camera(size, reversed_z=reversed_z)
        hiz = device.pyramid(image, view, kind=kind, levels=levels)
        for _ in range(25):
            row, column = (int(rng.integers(side)) for side in size)
            height, width = (
                int(rng.integers(1, side - begin + 1))
                for side, begin in zip(size, (row, column), strict=True)
            )
            part = ndc_samples(rng, (height, width), 1)[..., 0].astype(np.float32)
            image[row : row + height, column : column + width] = part
            hiz.update(row, column, part)
        assert same_levels(hiz, levels_of(image, reversed_z=reversed_z)), size


@pytest.mark.parametrize("reversed_z", [True, False])
def test_both_ends_of_samples_follow_an_update(device: hizvk.Device, reversed_z: bool) -> None:
    """By the definition: the farthest and the nearest of all samples that a texel covers."""
    rng = np.random.default_rng(12)
    kind: Any = "reversed_ndc" if reversed_z else "ndc"
    far, near = (0.0, 1.0) if reversed_z else (1.0, 0.0)
    ends = [np.fmin, np.fmax] if reversed_z else [np.fmax, np.fmin]
    size = (17, 22)
    image = ndc_samples(rng, size, 4).astype(np.float32)
    hiz = device.pyramid(image, camera(size, reversed_z=reversed_z), kind=kind, depths="both")
    for row, column, height, width in [(0, 0, 17, 22), (3, 5, 6, 9), (16, 21, 1, 1), (8, 0, 2, 22)]:
        part = ndc_samples(rng, (height, width), 4).astype(np.float32)
        image[row : row + height, column : column + width] = part
        hiz.update(row, column, part)
        with np.errstate(invalid="ignore"):
            is_depth = (image >= 0) & (image <= 1)
        for end, reduce, without in zip(("farthest", "nearest"), ends, (far, near), strict=True):
            pixels = reduce.reduce(np.where(is_depth, image, np.float32(without)), axis=2)
            pixels[np.abs(pixels) < np.finfo(np.float32).tiny] = 0.0
            for k in range(hiz.num_levels):
                rows = reduce.reduceat(pixels, np.arange(0, size[0], 1 << k), axis=0)
                texels = reduce.reduceat(rows, np.arange(0, size[1], 1 << k), axis=1)
                assert np.array_equal(hiz.level(k, end=end), texels), (end, k, row)


@pytest.mark.parametrize("kind", ["z", "distance"])
@pytest.mark.parametrize("dtype", ["float32", "float64", "float16", "uint16"])
def test_metric_arrays_are_converted_at_their_place(
    device: hizvk.Device, kind: Any, dtype: str
) -> None:
    rng = np.random.default_rng(3)
    view = camera((37, 53))
    image = rng.uniform(5, 60, view.size).astype(dtype)
    hiz = device.pyramid(image, view, kind=kind, scale=1.25, invalid=(7.0,))
    for row, column, height, width in [
        (0, 0, 37, 1),
        (36, 52, 1, 1),
        (3, 9, 20, 31),
        (5, 0, 1, 53),
    ]:
        part = rng.uniform(5, 60, (height, width)).astype(dtype)
        image[row : row + height, column : column + width] = part
        hiz.update(row, column, part)
    anew = device.pyramid(image, view, kind=kind, scale=1.25, invalid=(7.0,))
    assert same_levels(hiz, [anew.level(k) for k in range(anew.num_levels)])


def test_samples_are_replaced_together(device: hizvk.Device) -> None:
    rng = np.random.default_rng(8)
    view = camera((19, 21))
    samples = ndc_samples(rng, view.size, 4).astype(np.float32)
    hiz = device.pyramid(samples, view, kind="reversed_ndc")
    part = ndc_samples(rng, (6, 9), 4).astype(np.float32)
    samples[4:10, 12:21] = part
    hiz.update(4, 12, part)
    anew = device.pyramid(samples, view, kind="reversed_ndc")
    assert same_levels(hiz, [anew.level(k) for k in range(anew.num_levels)])


def test_culls_follow_the_update(device: hizvk.Device) -> None:
    """Also culls of so many instances that all levels are copied into one texture."""
    view = camera((64, 64))
    rng = np.random.default_rng(2)
    crowd = device.instances(hizvk.Spheres(rng.uniform((-9, -9, -40), (9, 9, -20), (9000, 3)), 0.1))
    image = np.full(view.size, 90.0)
    hiz = device.pyramid(image, view, kind="z")
    before = device.cull(crowd, view, hiz)
    image[10:50, 20:60] = 8.0
    hiz.update(10, 20, image[10:50, 20:60])
    after = device.cull(crowd, view, hiz)
    anew = device.cull(crowd, view, device.pyramid(image, view, kind="z"))
    assert before.count > after.count
    assert np.array_equal(after.mask, anew.mask)


def test_a_drawn_image_is_followed(device: hizvk.Device) -> None:
    """Object by object: test, draw, update."""
    for rasteriser in ("host", "device"):
        rng = np.random.default_rng(4)
        view = camera((75, 101))
        centers = rng.uniform((-6, -6, -40), (6, 6, -5), (30, 3))
        corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 1.5
        squares = device.occluders([(c + corners, [[0, 1, 2], [0, 2, 3]]) for c in centers])
        depth = device.render_depth(squares, view, only=[], rasteriser=rasteriser)
        hiz = device.pyramid(depth)
        for i in range(30):
            touched = device.render_depth(squares, into=depth, only=[i])
            hiz.update(depth, touched)
        assert same_levels(hiz, levels_of(depth.numpy(), reversed_z=True)), rasteriser


def test_another_image_is_refused(device: hizvk.Device) -> None:
    view = camera((6, 8))
    square = device.occluders(np.eye(3) - (0, 0, 9), [[0, 1, 2]])
    depth, other = (device.render_depth(square, view) for _ in range(2))
    rendered = device.pyramid(depth)
    rendered.update(depth, (0, 0, 7, 5))
    with pytest.raises(ValueError, match=r"^depth: expected the DepthImage that the pyramid was"):
        rendered.update(other, (0, 0, 7, 5))
    with pytest.raises(ValueError, match=r"^array: expected None for a pyramid of a DepthImage"):
        rendered.update(0, 0, np.ones((2, 2)))
    with pytest.raises(TypeError, match=r"^array: expected nothing beside a DepthImage"):
        rendered.update(depth, (0, 0, 7, 5), np.ones((2, 2)))  # type: ignore[call-overload]
    uploaded = device.pyramid(np.ones((6, 8)), view, kind="z")
    with pytest.raises(ValueError, match=r"^depth: expected the DepthImage that the pyramid was"):
        uploaded.update(depth, None)


@pytest.mark.parametrize(
    ("rectangle", "error", "text"),
    [
        ((0, 0, 8, 5), ValueError, r"expected \(x0, y0, x1, y1\) with 0 <= x0 <= x1 < 8"),
        ((3, 0, 2, 5), ValueError, r"got tuple \(3, 0, 2, 5\)"),
        ((0, 0, 1), ValueError, r"got tuple \(0, 0, 1\)"),
        ((-1, 0, 1, 1), ValueError, r"got tuple \(-1, 0, 1, 1\)"),
        ((0.0, 0, 1, 1), TypeError, "got float 0.0"),
        ("all", TypeError, "got str 'all'"),
        (7, TypeError, "got int 7"),
    ],
)
def test_rectangles_are_refused_by_name(
    device: hizvk.Device, rectangle: Any, error: type[Exception], text: str
) -> None:
    square = device.occluders(np.eye(3) - (0, 0, 9), [[0, 1, 2]])
    depth = device.render_depth(square, camera((6, 8)))
    hiz = device.pyramid(depth)
    with pytest.raises(error, match=f"^rectangle: .*{text}"):
        hiz.update(depth, rectangle)
