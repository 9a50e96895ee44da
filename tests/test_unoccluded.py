"""The verdict UNOCCLUDED: nothing of the depth image hides any part of an instance.

The oracle decides whether it is right, and rays in the castle whether it means what it says.
`crates/hiz_core/tests/unoccluded.rs` has the cases that are nearly undecided, and planted faults.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hizvk
from hizvk import Verdict
from test_castle import camera_of, scene  # noqa: F401  (a fixture)

WALL = 10.0


def look(size: tuple[int, int] = (60, 80), **more: Any) -> hizvk.Camera:
    return hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=size, near=0.1, **more)


def names(seen: hizvk.CullResult) -> list[str]:
    return [Verdict(code).name for code in seen.verdicts]


@pytest.mark.parametrize("reversed_z", [False, True])
def test_five_verdicts_and_what_tells_of_them(device: hizvk.Device, reversed_z: bool) -> None:
    camera = look(reversed_z=reversed_z)
    centers = [[0, 0, -5], [0, 0, -9.8], [0, 0, -15], [0, 0, 5], [0, 0, np.nan]]
    spheres = hizvk.Spheres(centers, 0.5)
    wall = np.full(camera.size, WALL)
    crowd = device.instances(spheres)
    both = device.pyramid(wall, camera, kind="z", depths="both")
    seen = device.cull(crowd, camera, both)
    assert names(seen) == ["UNOCCLUDED", "VISIBLE", "OCCLUDED", "OUTSIDE", "INVALID"]
    assert seen.mask.tolist() == [True, True, False, False, True]
    stats = seen.stats
    assert (stats.unoccluded, stats.kept, stats.occluded, stats.outside) == (1, 3, 1, 1)
    assert "3 kept (1 unoccluded, 1 invalid)" in str(stats)
    told = seen.explain(0)
    assert told.verdict == Verdict.UNOCCLUDED
    assert told.reason.startswith("inside the frustum, and before")
    assert told.in_front_of_z == pytest.approx(WALL, rel=1e-4)
    assert "nearest in the depth image" in str(told)
    # A pyramid of one end has no such verdict, and culls the same.
    one = device.cull(crowd, camera, device.pyramid(wall, camera, kind="z"))
    assert names(one) == ["VISIBLE", "VISIBLE", "OCCLUDED", "OUTSIDE", "INVALID"]
    assert one.stats.unoccluded == 0
    assert one.explain(0).in_front_of is None


@pytest.mark.parametrize("kind", ["z", "distance"])
@pytest.mark.parametrize("pixel", [np.nan, 0.0, -1.0, 0.05])
def test_a_pixel_without_a_depth_may_hold_anything(
    device: hizvk.Device, kind: Any, pixel: float
) -> None:
    """NaN, zero, negative, and before the near plane: near, so nothing over it surely shows."""
    camera = look()
    wall = np.full(camera.size, WALL)
    wall[30, 40] = pixel
    spheres = hizvk.Spheres([[0, 0, -5], [2, 0, -5]], 0.3)
    pyramid = device.pyramid(wall, camera, kind=kind, depths="both")
    seen = device.cull(device.instances(spheres), camera, pyramid)
    assert names(seen) == ["VISIBLE", "UNOCCLUDED"]
    truth = hizvk.reference.unoccluded(spheres, camera, wall, kind=kind)
    assert truth.tolist() == [hizvk.reference.COVERED, hizvk.reference.UNOCCLUDED]


def test_what_invalid_lists_is_near_too(device: hizvk.Device) -> None:
    camera = look()
    wall = np.full(camera.size, 10_000, dtype=np.uint16)
    wall[30, 40] = 65_535
    spheres = hizvk.Spheres([[0, 0, -5], [2, 0, -5]], 0.3)
    options: dict[str, Any] = {"kind": "z", "scale": 0.001}
    pyramid = device.pyramid(wall, camera, depths="both", **options)
    seen = device.cull(device.instances(spheres), camera, pyramid)
    assert names(seen) == ["VISIBLE", "UNOCCLUDED"]


def test_members_of_groups_are_told_one_by_one(device: hizvk.Device) -> None:
    rng = np.random.default_rng(5)
    camera = look((120, 160))
    wall = np.full(camera.size, WALL)
    wall[:, 80:] = 4.0
    centers = rng.uniform([-6, -4, -14], [6, 4, -1], (4000, 3))
    spheres = hizvk.Spheres(centers, rng.uniform(0.01, 0.3, 4000))
    pyramid = device.pyramid(wall, camera, kind="z", depths="both")
    crowd = device.instances(spheres)
    flat = device.cull(crowd, camera, pyramid, hierarchy=False)
    groups = device.cull(crowd, camera, pyramid, hierarchy=True)
    truth = hizvk.reference.unoccluded(spheres, camera, wall, kind="z")
    for seen in (flat, groups):
        found = hizvk.compare_unoccluded(seen.verdicts, truth)
        assert not len(found.false_claims), found
        assert found.found_share > 0.8
        assert seen.stats.unoccluded == found.claimed
        assert seen.stats.kept == int(seen.mask.sum())
    assert groups.stats.unoccluded >= flat.stats.unoccluded


def cameras(rng: np.random.Generator) -> list[hizvk.Camera]:
    """Perspective and orthographic, both conventions, with and without far, near and far away."""
    found = []
    for reversed_z in (False, True):
        for away in (0.0, 1e3, 1e6):
            eye = away * rng.uniform(-1, 1, 3)
            forward = rng.normal(size=3)
            common: dict[str, Any] = {"reversed_z": reversed_z, "size": (48, 64)}
            for far in (None, 60.0):
                found.append(
                    hizvk.Camera.look_at(
                        eye, eye + forward, fov_y_deg=70, near=0.2, far=far, **common
                    )
                )
            found.append(
                hizvk.Camera.orthographic(eye, eye + forward, height=16, near=0.2, far=60, **common)
            )
    return found


def image_of(rng: np.random.Generator, camera: hizvk.Camera) -> np.ndarray:
    """View depth: a far wall, a slope, and posts one pixel wide."""
    rows, columns = camera.size
    image = np.full(camera.size, 50.0)
    image[rows // 3 :] = np.linspace(8, 30, columns)
    for _ in range(6):
        image[:, rng.integers(columns)] = rng.uniform(1, 20)
    return image


@pytest.mark.parametrize("coverage", ["area", "sample"])
def test_no_answer_is_false_and_most_are_found(device: hizvk.Device, coverage: Any) -> None:
    rng = np.random.default_rng(11)
    found: dict[str, list[int]] = {}
    for camera in cameras(rng):
        image = image_of(rng, camera)
        pyramid = device.pyramid(image, camera, kind="z", depths="both")
        count = 300
        # Centres in the view, by pixel and view depth.
        z = rng.uniform(0.5, 30, count)
        axes = np.linalg.inv(camera.clip_from_world)
        ndc = rng.uniform(-1, 1, (count, 2))
        near, far = (1.0, 1e-4) if camera.reversed_z else (0.0, 0.9999)
        ends = [
            np.concatenate([ndc, np.full((count, 1), d), np.ones((count, 1))], axis=1) @ axes.T
            for d in (near, far)
        ]
        a, b = (end[:, :3] / end[:, 3:] for end in ends)
        ray = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
        centers = a + z[:, None] * ray
        sizes = rng.uniform(0.01, 1.0, (count, 3))
        turns = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
        for bounds in (
            hizvk.Spheres(centers, sizes[:, 0]),
            hizvk.Boxes(centers - sizes, centers + sizes),
            hizvk.OrientedBoxes(centers, sizes, turns),
        ):
            crowd = device.instances(bounds)
            truth = hizvk.reference.unoccluded(bounds, camera, image, kind="z", coverage=coverage)
            sums = found.setdefault(type(bounds).__name__, [0, 0, 0])
            for place, descent in ((1, 0), (2, 4096)):
                seen = device.cull(crowd, camera, pyramid, coverage=coverage, descent=descent)
                compared = hizvk.compare_unoccluded(seen.verdicts, truth)
                assert not len(compared.false_claims), (camera, compared)
                # Between the samples an instance is outside, too.
                missed = compared.missed[seen.mask[compared.missed]]
                sums[place] += compared.unoccluded - len(missed)
            sums[0] += compared.unoccluded
    for name, (all_, flat, walked) in found.items():
        print(f"{coverage} {name}: of {all_} unoccluded, {flat} found, {walked} with a descent")
        assert all_ > 300, name
        assert flat > 0.3 * all_, name
        assert walked > 0.85 * all_, name


@pytest.mark.parametrize("convention", ["standard", "reversed"])
def test_rays_of_the_castle_meet_nothing_before_it(
    judge: Any,
    scene: Any,  # noqa: F811
    device: hizvk.Device,
    convention: str,
) -> None:
    """Every ray that meets an UNOCCLUDED instance meets it before all occluders.

    The exact answer about the same depth image says how many are found.
    """
    size = (360, 640)
    kind: Any = "reversed_ndc" if convention == "reversed" else "ndc"
    boxes = hizvk.Boxes(scene.instance_aabb_min, scene.instance_aabb_max)
    crowd = device.instances(boxes)
    sums = {0: [0, 0], 4096: [0, 0]}
    pixels = 0
    for k, camera in list(enumerate(scene.cameras))[::8]:
        linear, _ = judge.occluder_depth(scene, camera, size)
        depth = judge.encode_depth(linear, camera, convention).astype(np.float32)
        ours = camera_of(judge, scene, k, size, convention)
        pyramid = device.pyramid(depth, ours, kind=kind, depths="both")
        truth = hizvk.reference.unoccluded(boxes, ours, depth, kind=kind)
        for descent, sum_ in sums.items():
            seen = device.cull(crowd, ours, pyramid, descent=descent)
            compared = hizvk.compare_unoccluded(seen.verdicts, truth)
            assert not len(compared.false_claims), (camera.name, compared)
            sum_[0] += compared.unoccluded
            sum_[1] += compared.unoccluded - len(compared.missed)
        vertices = camera.to_view(scene.instance_vertices)
        for i in np.flatnonzero(seen.verdicts == Verdict.UNOCCLUDED)[:30]:
            first, end = scene.instance_first_triangle[i : i + 2]
            own, _ = judge.cast(vertices, scene.instance_triangles[first:end], camera, size)
            meets = np.isfinite(own)
            assert (own[meets] < linear[meets]).all(), (camera.name, i)
            pixels += int(meets.sum())
    (all_, flat), (_, walked) = sums.values()
    print(
        f"{convention}: of {all_} unoccluded, {flat} found, {walked} with a descent; {pixels} rays"
    )
    assert all_ > 20
    assert flat > 0.3 * all_
    assert walked > 0.85 * all_


@pytest.mark.parametrize("reversed_z", [False, True])
def test_a_mask_alone_is_that_of_the_verdicts(device: hizvk.Device, reversed_z: bool) -> None:
    """Without verdicts no nearest depth of an instance is read, and the same is kept."""
    rng = np.random.default_rng(7)
    camera = look((60, 80), reversed_z=reversed_z)
    image = rng.choice([4.0, 9.0, np.inf], camera.size, p=[0.5, 0.4, 0.1])
    image[20:50, :60] = 4.0
    pyramid = device.pyramid(image, camera, kind="z", depths="both")
    centers = rng.uniform([-6, -4, -14], [6, 4, -1], (6000, 3))
    crowd = device.instances(hizvk.Spheres(centers, rng.uniform(0.01, 0.3, 6000)))
    for options in ({}, {"descent": 64}, {"fit": "volume"}, {"coverage": "sample"}):
        for hierarchy in (0, 1, 2):
            given: dict[str, Any] = {"hierarchy": hierarchy, **options}
            told = device.cull(crowd, camera, pyramid, **given)
            masks = [
                device.cull(crowd, camera, pyramid, outputs=outputs, **given).mask
                for outputs in (["mask"], ["mask", "indices", "draws"])
            ]
            assert all(np.array_equal(mask, told.mask) for mask in masks), given
            assert 100 < told.mask.sum() < 5900
            assert (told.verdicts == Verdict.UNOCCLUDED).sum() > 100
