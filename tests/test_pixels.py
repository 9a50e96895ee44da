"""Counts of pixels: cases worked out by hand, ray truth in NumPy, and what is refused."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

import hizvk

if TYPE_CHECKING:
    import numpy.typing as npt

SIZE = (96, 128)
CAMERA = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=SIZE, near=0.1)


def rays(size: tuple[int, int] = SIZE) -> npt.NDArray[np.float64]:
    """``(height, width, 3)``: the rays through the centres of pixels, one unit deep."""
    height, width = size
    row, column = np.mgrid[0:height, 0:width] + 0.5
    scale = 2.0 / height
    x, y = (column - width / 2) * scale, (height / 2 - row) * scale
    return np.stack([x, y, np.full_like(x, -1.0)], axis=-1)


def crossing(
    low: npt.NDArray[np.float64], high: npt.NDArray[np.float64], size: tuple[int, int] = SIZE
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """The view depths at which the ray of each pixel enters and leaves a box; inf if it misses."""
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.stack([low / rays(size), high / rays(size)])
    enter = np.nanmax(at.min(axis=0), axis=-1)
    leave = np.nanmin(at.max(axis=0), axis=-1)
    misses = enter >= leave
    return np.where(misses, np.inf, enter), np.where(misses, np.inf, leave)


def crowd(count: int, seed: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Corners of boxes in front of the camera, some of them partly outside of its view."""
    random = np.random.default_rng(seed)
    centers = np.c_[
        random.uniform(-12, 12, count), random.uniform(-9, 9, count), random.uniform(-25, -5, count)
    ]
    half = random.uniform(0.2, 1.5, (count, 3))
    return centers - half, centers + half


def picture(
    low: npt.NDArray[np.float64], high: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Depth image and id image of boxes, by rays; inf and -1 where there is none."""
    depth = np.full(SIZE, np.inf)
    ids = np.full(SIZE, -1)
    for i in range(len(low)):
        enter, _ = crossing(low[i], high[i])
        nearer = enter < depth
        depth[nearer], ids[nearer] = enter[nearer], i
    return depth, ids


@pytest.mark.parametrize("depths_of", ["occluders", "all"])
def test_counts_are_within_their_bounds_and_fractions_are_close(
    device: hizvk.Device, depths_of: str
) -> None:
    walls, boxes = crowd(25, 1), crowd(150, 2)
    depth, _ = picture(*walls)
    ids = np.full(SIZE, -1)
    if depths_of == "all":
        both = np.concatenate([walls[0], boxes[0]]), np.concatenate([walls[1], boxes[1]])
        depth, ids = picture(*both)
        ids -= len(walls[0])
    pyramid = device.pyramid(depth, CAMERA, kind="z")
    seen = device.cull(
        device.instances(hizvk.Boxes(*boxes)),
        CAMERA,
        pyramid,
        outputs=["mask", "pixels"],
        coverage="sample",
        guard_px=0.0,
        fit="volume",
    )
    counts = seen.pixels
    errors = []
    fractions = seen.visible_fraction(objects_in_depth=depths_of == "all")
    for i in range(len(boxes[0])):
        enter, leave = crossing(boxes[0][i], boxes[1][i])
        covered = np.isfinite(enter)
        one = {name: int(counts[i][name]) for name in hizvk.PIXELS_DTYPE.names or ()}
        assert one["touched"] == one["hidden"] + one["inside"] + one["open"], i
        assert one["touched"] >= covered.sum(), i
        if depths_of == "all":
            # Its own surface is the pixel's: never hidden, and never open.
            shows = covered & (ids == i)
            assert one["inside"] >= shows.sum(), i
            assert one["touched"] - one["open"] >= shows.sum(), i
        else:
            shows = covered & (enter < depth)
        assert one["touched"] - one["hidden"] >= shows.sum(), i
        # The surface ends behind the box, so it is not open.
        behind = covered & (depth < leave * (1 - 1e-6))
        assert one["touched"] - one["open"] >= behind.sum(), i
        if covered.sum() >= 16:
            errors.append(abs(fractions[i] - shows.sum() / covered.sum()))
        if not seen.mask[i]:
            assert one["touched"] == one["hidden"], i
    assert len(errors) > 50
    assert np.mean(errors) < 0.02


def test_rays_worked_out_by_hand(device: hizvk.Device) -> None:
    """A box of 10 x 10 pixels whose left four columns are behind a wall."""
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(20, 20), near=0.1)
    wall = np.full((20, 20), 100.0)
    wall[:, :9] = 1.0
    pyramid = device.pyramid(wall, camera, kind="z")
    box = device.instances(hizvk.Boxes([(-1, -1, -2.01)], [(1, 1, -2)]))
    seen = device.cull(box, camera, pyramid, outputs=["pixels"], coverage="sample", guard_px=0.0)
    assert seen.pixels[0].item() == (100, 40, 0, 60, 0)
    assert seen.visible_fraction(objects_in_depth=False) == pytest.approx([0.6])
    assert seen.visible_fraction() == [0.0], "one looks through it where it is not hidden"
    # With its own surface in the image.
    wall[5:15, 9:15] = 2.0
    own = device.pyramid(wall, camera, kind="z")
    seen = device.cull(box, camera, own, outputs=["pixels"], coverage="sample", guard_px=0.0)
    assert seen.pixels[0].item() == (100, 40, 60, 0, 0)
    assert seen.visible_fraction() == pytest.approx([0.6])


def test_outcomes_that_have_no_rectangle(device: hizvk.Device) -> None:
    pyramid = device.pyramid(np.full(SIZE, 1.0), CAMERA, kind="z")
    low = np.array([(-1, -1, -1), (-1, -1, 3), (np.nan, 0, -5), (-0.1, -0.1, -9.0)])
    high = np.array([(1, 1, 1), (1, 1, 5), (1, 1, -4), (0.1, 0.1, -8.0)])
    boxes = device.instances(hizvk.Boxes(low, high))
    seen = device.cull(boxes, CAMERA, pyramid, outputs=["pixels", "mask"])
    pixels = SIZE[0] * SIZE[1]
    crossing, behind, invalid, hidden = (one.item() for one in seen.pixels)
    assert crossing == invalid == (pixels, 0, pixels, 0, pixels)
    assert behind == (0, 0, 0, 0, 0)
    assert hidden[0] == hidden[1] > 0 == hidden[2] + hidden[3]
    assert seen.visible_fraction().tolist() == [1.0, 0.0, 1.0, 0.0]
    only = device.cull(boxes, CAMERA, pyramid, outputs=["pixels"], among=[False] * 4)
    assert not any(any(one.item()) for one in only.pixels)


def test_a_budget_ends_with_an_upper_bound(device: hizvk.Device) -> None:
    depth, _ = picture(*crowd(40, 3))
    pyramid = device.pyramid(depth, CAMERA, kind="z")
    boxes = device.instances(hizvk.Boxes(*crowd(100, 4)))
    full = device.cull(boxes, CAMERA, pyramid, outputs=["pixels"]).pixels
    assert not full["undecided"].any()
    for budget in (1, 4, 30):
        part = device.cull(boxes, CAMERA, pyramid, outputs=["pixels"], pixel_budget=budget).pixels
        assert (part["hidden"] <= full["hidden"]).all()
        assert (part["touched"] - part["hidden"] >= full["touched"] - full["hidden"]).all()
        assert (part["undecided"] <= part["inside"]).all()
    assert part["undecided"].any()


@pytest.mark.parametrize("kind", ["spheres", "oriented", "points"])
def test_other_bounds_are_counted(device: hizvk.Device, kind: str) -> None:
    """A wall hides the left half of the image, and bounds lie wholly in one half."""
    wall = np.full(SIZE, np.inf)
    wall[:, :64] = 2.0
    pyramid = device.pyramid(wall, CAMERA, kind="z")
    centers = np.array([(-3.0, 1, -10), (3.0, 1, -10)])
    bounds: hizvk.Spheres | hizvk.OrientedBoxes | hizvk.Points = hizvk.Points(centers)
    if kind == "spheres":
        bounds = hizvk.Spheres(centers, 0.5)
    if kind == "oriented":
        bounds = hizvk.OrientedBoxes(centers, np.full((2, 3), 0.4), np.stack([np.eye(3)] * 2))
    seen = device.cull(device.instances(bounds), CAMERA, pyramid, outputs=["pixels"])
    left, right = seen.pixels
    assert left["hidden"] == left["touched"] > 0
    assert right["open"] == right["touched"] > 0


def test_several_samples_say_nothing_about_what_is_open(device: hizvk.Device) -> None:
    """The image keeps the farthest sample, and a nearer one may be in front."""
    samples = np.full((*SIZE, 4), 50.0)
    samples[..., 0] = 1.0
    box = device.instances(hizvk.Boxes([(-1, -1, -6)], [(1, 1, -5)]))
    seen = device.cull(box, CAMERA, device.pyramid(samples, CAMERA, kind="z"), outputs=["pixels"])
    assert seen.pixels[0]["open"] == 0 < seen.pixels[0]["inside"]


def test_what_was_not_asked_for_is_refused(device: hizvk.Device) -> None:
    pyramid = device.pyramid(np.full(SIZE, 1.0), CAMERA, kind="z")
    boxes = device.instances(hizvk.Boxes(*crowd(3, 5)))
    seen = device.cull(boxes, CAMERA, pyramid)
    with pytest.raises(ValueError, match=r"asked for pixels, .*; name pixels among"):
        _ = seen.pixels
    with pytest.raises(ValueError, match="pixels: expected False beside several cameras"):
        device.cull(boxes, [CAMERA], [pyramid], outputs=["pixels"])
    waited = device.cull(boxes, CAMERA, pyramid, outputs=["pixels"], wait=False)
    assert waited.pixels.dtype == hizvk.PIXELS_DTYPE
    assert (
        len(
            device.cull(
                device.instances(hizvk.Boxes(np.zeros((0, 3)), np.zeros((0, 3)))),
                CAMERA,
                pyramid,
                outputs=["pixels"],
            ).pixels
        )
        == 0
    )


@pytest.mark.parametrize("reversed_z", [False, True])
def test_one_looks_through_where_all_samples_are_behind(
    device: hizvk.Device, reversed_z: bool
) -> None:
    """Several samples per pixel: open if the nearest is behind, hidden if the farthest is before.

    The box faces the camera, from view depth 4 to 4.01, so each pixel compares with these two.
    """
    camera = hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(32, 32), near=0.1, reversed_z=reversed_z
    )
    rng = np.random.default_rng(6)
    image = rng.choice([2.0, 4.005, 9.0, np.inf], (32, 32, 4), p=[0.1, 0.1, 0.6, 0.2])
    image[:16] = np.where(rng.random((16, 32, 1)) < 0.3, 2.0, 9.0)
    box = device.instances(hizvk.Boxes([(-3, -3, -4.01)], [(3, 3, -4)]))
    pyramids = {
        depths: device.pyramid(image, camera, kind="z", depths=depths)
        for depths in ("farthest", "both")
    }
    counts = {
        depths: device.cull(box, camera, pyramid, outputs=["pixels"]).pixels[0]
        for depths, pyramid in pyramids.items()
    }
    # The box's front spans pixels 4 to 27, and a rectangle may have one more on each side.
    inner, outer = image[4:28, 4:28], image[3:29, 3:29]
    both, one = counts["both"], counts["farthest"]
    # At the box's outline only its front is in a pixel.
    is_behind, may_be_behind = (inner > 4.01).all(axis=-1), (outer > 4).all(axis=-1)
    assert 0 < is_behind.sum() <= both["open"] <= may_be_behind.sum() < 676
    hides = [(part < 4).all(axis=-1).sum() for part in (inner, outer)]
    assert 0 < hides[0] <= both["hidden"] <= hides[1]
    assert both["hidden"] == one["hidden"]
    assert both["touched"] == one["touched"]
    assert one["open"] == 0, "a nearer sample may be before the box"
