"""Tiers of boxes and accepted groups: the same answers, and how many tests they take."""

from __future__ import annotations

from itertools import product
from typing import Any, Final

import numpy as np
import pytest

import hizvk

COUNT: Final = 8300
GROUP: Final = 64
SIZE: Final = (48, 64)
#: The wall's distance, which fills the image.
WALL: Final = 10.0
FRONT, BEHIND, OUTSIDE = range(3)


@pytest.fixture(scope="module")
def camera() -> hizvk.Camera:
    return hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=70, size=SIZE, near=0.125)


@pytest.fixture(scope="module")
def pyramids(device: hizvk.Device, camera: hizvk.Camera) -> dict[str, hizvk.Pyramid]:
    """Of the farthest end, and of both."""
    image = np.full(SIZE, WALL)
    return {
        depths: device.pyramid(image, camera, kind="z", depths=depths)
        for depths in ("farthest", "both")
    }


def fates(seed: int) -> np.ndarray:
    """What becomes of each instance: whole boxes of each tier share it, and others are mixed."""
    random = np.random.default_rng(seed)
    each = random.integers(0, 3, COUNT)
    of_group = np.repeat(random.integers(0, 3, -(-COUNT // GROUP)), GROUP)[:COUNT]
    is_mixed = np.repeat(random.random(-(-COUNT // GROUP)) < 0.3, GROUP)[:COUNT]
    found = np.where(is_mixed, each, of_group)
    found[: GROUP**2] = BEHIND
    return found


def spheres(of: np.ndarray, seed: int = 5) -> hizvk.Spheres:
    random = np.random.default_rng(seed)
    centers = random.uniform(-0.5, 0.5, (len(of), 3))
    centers[:, 2] += np.choose(of, [-5.0, -15.0, -15.0])
    centers[:, 0] += np.where(of == OUTSIDE, 500.0, 0.0)
    return hizvk.Spheres(centers, np.full(len(of), 0.1))


def spent(of: np.ndarray, tiers: int, *, both: bool) -> tuple[list[int], int, int]:
    """Boxes tested per tier, instances tested and accepted: a plain walk down."""
    boxes, tested, accepted = [0, 0, 0], 0, 0
    todo = [(tiers - 1, of)]
    while todo:
        tier, here = todo.pop()
        for first in range(0, len(here), GROUP ** (tier + 1)):
            part = here[first : first + GROUP ** (tier + 1)]
            boxes[tier] += 1
            if (part != FRONT).all():
                continue
            if both and (part == FRONT).all():
                accepted += len(part)
            elif tier == 0:
                tested += len(part)
            else:
                todo.append((tier - 1, part))
    return boxes, tested, accepted


@pytest.mark.parametrize("depths", ["farthest", "both"])
def test_tiers_give_the_same_answers(
    device: hizvk.Device,
    camera: hizvk.Camera,
    pyramids: dict[str, hizvk.Pyramid],
    depths: str,
) -> None:
    of = fates(1)
    crowd = device.instances(spheres(of), order="given")
    front = hizvk.Verdict.UNOCCLUDED if depths == "both" else hizvk.Verdict.VISIBLE
    expected = np.choose(of, [front, hizvk.Verdict.OCCLUDED, hizvk.Verdict.OUTSIDE])
    for hierarchy in (None, False, True, 0, 1, 2, 3):
        seen = device.cull(crowd, camera, pyramids[depths], hierarchy=hierarchy)
        assert np.array_equal(seen.mask, of == FRONT), hierarchy
        assert np.array_equal(seen.verdicts, expected), hierarchy
        assert np.array_equal(np.sort(seen.indices), np.flatnonzero(of == FRONT)), hierarchy
        # A third tier begins at 258,049 instances, and groups pay from some more than these.
        tiers = min(2, int(hierarchy or 0))
        stats = seen.stats
        boxes, tested, accepted = (
            spent(of, tiers, both=depths == "both") if tiers else ([0, 0, 0], COUNT, 0)
        )
        assert (stats.tested_boxes, stats.tested_instances) == (tuple(boxes), tested), hierarchy
        assert (stats.accepted_instances, stats.tested_groups) == (accepted, boxes[0]), hierarchy
        assert stats.comparisons == sum(boxes) + tested, hierarchy


def test_updates_absent_and_among(
    device: hizvk.Device, camera: hizvk.Camera, pyramids: dict[str, hizvk.Pyramid]
) -> None:
    of, random = fates(2), np.random.default_rng(3)
    absent = random.random(COUNT) < 0.2
    ids = np.where(absent, hizvk.ABSENT, 0).astype(np.uint32)
    crowd = device.instances(spheres(of), mesh_ids=ids)
    asked = random.random(COUNT) < 0.5
    for first, count, fate in ((4000, 200, FRONT), (0, COUNT, BEHIND), (77, 1, FRONT)):
        of[first : first + count] = fate
        moved = spheres(of, seed=first)
        part = slice(first, first + count)
        crowd.update(first, hizvk.Spheres(moved.centers[part], moved.radii[part]))
        for depths, hierarchy in product(("farthest", "both"), (2, 1)):
            pyramid = pyramids[depths]
            seen = device.cull(crowd, camera, pyramid, hierarchy=hierarchy)
            assert np.array_equal(seen.mask, (of == FRONT) & ~absent)
            some = device.cull(crowd, camera, pyramid, hierarchy=hierarchy, among=asked)
            assert np.array_equal(some.mask, (of == FRONT) & ~absent & asked)


def test_a_part_that_is_updated_reaches_the_third_tier(
    device: hizvk.Device, camera: hizvk.Camera, pyramids: dict[str, hizvk.Pyramid]
) -> None:
    """Its box is made of the boxes of the second tier, of which the last one has changed."""
    count = GROUP**3 + GROUP
    of = np.full(count, BEHIND)
    crowd = device.instances(hizvk.Points(spheres(of).centers.astype(np.float32)), order="given")
    for index in (3, 200_000, GROUP**3 - 1, count - 1):
        of[index] = FRONT
        moved = hizvk.Points(spheres(of).centers[index : index + 1].astype(np.float32))
        crowd.update(index, moved)
        seen = device.cull(crowd, camera, pyramids["farthest"], hierarchy=3)
        assert seen.stats.tested_boxes[2] == 2
        assert np.flatnonzero(seen.mask).tolist() == np.flatnonzero(of == FRONT).tolist()


def test_invalid_members_are_kept_and_counted(
    device: hizvk.Device, camera: hizvk.Camera, pyramids: dict[str, hizvk.Pyramid]
) -> None:
    centers = spheres(np.full(COUNT, FRONT)).centers.copy()
    bad = [5, 70, 4200]
    centers[bad, 1] = np.nan
    crowd = device.instances(hizvk.Spheres(centers, np.full(COUNT, 0.1)), order="given")
    seen = device.cull(crowd, camera, pyramids["both"], hierarchy=2)
    assert seen.mask.all()
    assert (seen.stats.invalid, seen.stats.kept) == (3, COUNT)
    assert np.flatnonzero(seen.verdicts == hizvk.Verdict.INVALID).tolist() == bad
    # Their groups are tested one by one, and all others are accepted.
    assert seen.stats.tested_instances == 3 * GROUP
    assert seen.stats.accepted_instances == COUNT - 3 * GROUP


def test_depth_comparisons_are_counted(
    device: hizvk.Device, camera: hizvk.Camera, pyramids: dict[str, hizvk.Pyramid]
) -> None:
    """One whole tier is hidden by one box: 2 x 2 texels, where a flat cull reads them for each."""
    crowd = device.instances(spheres(np.full(GROUP**2, BEHIND)))
    options: dict[str, Any] = {"statistics": True}
    flat, nested = (
        device.cull(crowd, camera, pyramids["farthest"], hierarchy=h, **options).stats
        for h in (0, 2)
    )
    assert nested.tested_boxes == (0, 1, 0)
    assert nested.texels_read is not None
    assert flat.texels_read is not None
    assert 1 <= nested.texels_read <= 4
    assert flat.texels_read >= GROUP**2
    assert flat.texels_read > 100 * nested.texels_read


def test_frames_of_two_passes(
    device: hizvk.Device, camera: hizvk.Camera, pyramids: dict[str, hizvk.Pyramid]
) -> None:
    of = fates(4)
    crowd = device.instances(spheres(of))
    culler = device.temporal(crowd)
    for frame in range(4):
        early = culler.early(camera).mask
        late = culler.late(camera, pyramids["both"], hierarchy=2).mask
        visible = of == FRONT
        assert np.array_equal(late, visible & ~early), frame
        if frame > 1:
            assert np.array_equal(early, visible), frame


def test_explanations(
    device: hizvk.Device, camera: hizvk.Camera, pyramids: dict[str, hizvk.Pyramid]
) -> None:
    crowd = device.instances(spheres(np.full(COUNT, FRONT)), order="given")
    told = device.cull(crowd, camera, pyramids["both"], hierarchy=2).explain(4444)
    assert told.verdict == hizvk.Verdict.UNOCCLUDED
    assert "shows as a whole" in told.reason
