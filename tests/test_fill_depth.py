"""Sparse depth that is filled: what it hides, what that costs, and the definition by loops."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hizvk
from hizvk import scenes
from hizvk.scenes import truth

if TYPE_CHECKING:
    from collections.abc import Callable

#: Where depth is measured: at every fifth pixel of every fifth row, or anywhere, 4 % of them.
PATTERNS: dict[str, tuple[int, Callable[[np.random.Generator, tuple[int, ...]], np.ndarray]]] = {
    "grid": (7, lambda _, size: (np.indices(size) % 5 == 0).all(axis=0)),
    "random": (15, lambda rng, size: rng.random(size) < 0.04),
}


@pytest.mark.parametrize(("make", "name"), [(scenes.room, "room"), (scenes.village, "village")])
def test_sparse_depth_hides_once_it_is_filled(device: hizvk.Device, make: Any, name: str) -> None:
    """Prints the rows of docs/guide.md, "Sparse depth"."""
    scene, rng = make(), np.random.default_rng(0)
    walls = device.occluders(scene.vertices, scene.triangles)
    crowd = device.instances(hizvk.Boxes(scene.box_min, scene.box_max))
    for pattern, (radius, known) in PATTERNS.items():
        hidden, kept, lost = np.zeros(3, int), 0, 0
        for view in scene.views[:6]:
            camera = view.camera((270, 480))
            near, far = view.near, view.far
            full = truth.linear_depth(device.render_depth(walls, camera).numpy(), near, far)
            full[~np.isfinite(full)] = 0.0
            sparse = np.where(known(rng, full.shape), full, 0.0)
            images = full, sparse, hizvk.fill_depth(sparse, radius, kind="z")
            found = [
                device.cull(crowd, camera, device.pyramid(image, camera, kind="z"), descent=4096)
                for image in images
            ]
            hidden += [result.stats.occluded for result in found]
            kept += int(found[0].mask.sum())
            lost += int((found[0].mask & ~found[2].mask).sum())
        print(
            f"| {name} | {pattern} | {radius} | {hidden[0]:,} | {hidden[1]:,} | {hidden[2]:,} "
            f"| {lost} of {kept:,} |"
        )
        assert hidden[1] < 0.01 * hidden[0] < 0.75 * hidden[0] < hidden[2]
        assert lost < 0.1 * kept
        # What is seen beside a silhouette is lost where the window is wider than the measurements
        # are apart.
        assert (lost > 0) == (name == "village" and pattern == "random")


def test_filling_by_loops() -> None:
    """The definition, pixel by pixel."""
    rng = np.random.default_rng(1)
    # The window doubles, so powers of two and their neighbours are ends of their own.
    radii = [((12, 9), radius, 0.3) for radius in (1, 2, 4, 5, 8)]
    for size, radius, share in [((1, 1), 0, 1.0), ((7, 1), 2, 0.4), ((9, 14), 3, 0.15), *radii]:
        depth = np.where(rng.random(size) < share, rng.uniform(1, 9, size), 0.0)
        depth[rng.random(size) < 0.05] = np.nan
        depth[rng.random(size) < 0.05] = -1.0
        expected = np.zeros(size)
        with np.errstate(invalid="ignore"):
            known = np.where(depth > 0.0, depth, 0.0)
        for i, j in np.ndindex(*size):
            above, below = slice(max(i - radius, 0), i + 1), slice(i, i + radius + 1)
            left, right = slice(max(j - radius, 0), j + 1), slice(j, j + radius + 1)
            quarters = [known[a, b].max() for a in (above, below) for b in (left, right)]
            expected[i, j] = max(quarters) if min(quarters) > 0.0 else 0.0
        got = hizvk.fill_depth(depth, radius, kind="z")
        assert np.array_equal(got, expected)
        assert np.array_equal(hizvk.fill_depth(depth[..., None], radius, kind="distance"), expected)


def test_filling_keeps_the_dtype_and_what_it_says_of_no_data() -> None:
    whole = np.zeros((5, 5), np.uint16)
    whole[::2, ::2] = 5000
    whole[2, 2], whole[0, 0] = 65535, 7
    filled = hizvk.fill_depth(whole, 2, kind="z")
    assert filled.dtype == np.uint16
    assert filled.max() == 5000
    assert hizvk.fill_depth(whole.astype(np.int32), 2, kind="z").tolist() == filled.tolist()
    assert hizvk.fill_depth(whole, 2, kind="z", invalid=()).max() == 65535
    assert 7 not in hizvk.fill_depth(whole, 0, kind="z", invalid=(7,))
    half = np.full((3, 3), 2.0, np.float16)
    half[1, 1] = 0
    assert hizvk.fill_depth(half, 1, kind="z").dtype == np.float16
    masked = np.ma.masked_array(np.full((3, 3), 2.0), mask=np.eye(3, dtype=bool))
    masked.data[1, 1] = 99.0
    assert hizvk.fill_depth(masked, 1, kind="z").max() == 2.0


def test_filled_depth_closes_a_gap_that_no_pixel_shows(device: hizvk.Device) -> None:
    """The cost of filling: a wall at 4 has a gap of three pixels, all known pixels beside it."""
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(32, 32), near=1.0)
    full = np.full((32, 32), 4.0)
    full[:, 15:18] = 50.0
    ball = hizvk.Spheres([[0.2, 0.0, -6.0]], 0.3)  # columns 15.7 to 17.4
    sparse = np.zeros((32, 32))
    sparse[::4, 1::4] = full[::4, 1::4]  # columns 13 and 17: the gap is seen
    blind = np.zeros((32, 32))
    blind[::4, 2::4] = full[::4, 2::4]  # columns 14 and 18: it is not
    seen = [
        hizvk.visible(ball, camera, depth=image, kind="z", device=device).all()
        for image in (full, *(hizvk.fill_depth(image, 4, kind="z") for image in (sparse, blind)))
    ]
    assert seen == [True, True, False]
