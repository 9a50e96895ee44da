"""What comes back: shapes, dtypes and values, on scenes whose answers are derived by hand."""

import numpy as np
import pytest

import hizvk
from hizvk import Verdict
from hizvk.reference import HIDDEN, INVALID, UNDECIDED, VISIBLE

NAN = float("nan")


@pytest.fixture(scope="module", params=[True, False], ids=["reversed", "standard"])
def camera(request: pytest.FixtureRequest) -> hizvk.Camera:
    """At the origin, looking along -z: at depth d the image reaches from -d to d in x and y."""
    return hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(8, 8), near=0.125, reversed_z=request.param
    )


def left_wall(size: tuple[int, int] = (8, 8)) -> np.ndarray:
    """A wall at depth 10 in the left half of the image, nothing in the right half."""
    depth = np.full(size, np.inf)
    depth[:, : size[1] // 2] = 10.0
    return depth


# Spheres of radius 1, and what becomes of them behind `left_wall`.
SCENE: list[tuple[tuple[float, float, float], float, Verdict]] = [
    ((-10, 0, -20), 1, Verdict.OCCLUDED),  # behind the wall
    ((10, 0, -20), 1, Verdict.VISIBLE),  # in the open half
    ((0, 0, -20), 1, Verdict.VISIBLE),  # across the wall's edge
    ((-2, 0, -5), 1, Verdict.VISIBLE),  # before the wall
    ((-5, 0, -10), 1, Verdict.VISIBLE),  # through the wall
    ((0, 0, 20), 1, Verdict.OUTSIDE),  # behind the camera
    ((-60, 0, -20), 1, Verdict.OUTSIDE),  # left of the view
    ((0, 60, -20), 1, Verdict.OUTSIDE),  # above the view
    ((0, 0, 0), 1, Verdict.VISIBLE),  # around the camera
    ((-0.0625, 0, -0.125), 0.0625, Verdict.VISIBLE),  # across the near plane
    ((-9, 1, -20), 0, Verdict.OCCLUDED),  # a point behind the wall
    ((NAN, 0, -20), 1, Verdict.INVALID),
    ((-10, 0, -20), NAN, Verdict.INVALID),
    ((-10, 0, -20), -1, Verdict.INVALID),
    ((float("inf"), 0, -20), 1, Verdict.INVALID),
]
VERDICTS = [verdict for *_, verdict in SCENE]
KEPT = [i for i, verdict in enumerate(VERDICTS) if verdict in (Verdict.VISIBLE, Verdict.INVALID)]


def scene() -> hizvk.Spheres:
    return hizvk.Spheres(
        np.array([center for center, *_ in SCENE]),
        np.array([float(radius) for _, radius, _ in SCENE]),
    )


def culled(device: hizvk.Device, camera: hizvk.Camera, **options: object) -> hizvk.CullResult:
    pyramid = device.pyramid(left_wall(), camera, kind="z")
    return device.cull(device.instances(scene()), camera, pyramid, **options)  # type: ignore[arg-type]


def test_verdicts(device: hizvk.Device, camera: hizvk.Camera) -> None:
    result = culled(device, camera)
    assert len(result) == len(SCENE)
    assert result.verdicts.dtype == np.uint8
    assert [Verdict(code) for code in result.verdicts] == VERDICTS
    assert result.mask.dtype == np.bool_
    assert np.flatnonzero(result.mask).tolist() == KEPT
    assert result.indices.dtype == np.uint32
    assert result.indices.tolist() == KEPT
    assert result.count == result.demand == len(KEPT)
    for array in (result.mask, result.verdicts, result.indices, result.draws):
        assert not array.flags.writeable  # they are shared
    assert result.mask is result.mask


def test_boxes_and_oriented_boxes(device: hizvk.Device, camera: hizvk.Camera) -> None:
    centers, radii = scene().centers.astype(np.float64), scene().radii.astype(np.float64)
    half = np.repeat(radii[:, None], 3, axis=1)
    quarter_turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    pyramid = device.pyramid(left_wall(), camera, kind="z")
    for bounds in (
        hizvk.Boxes(centers - half, centers + half),
        hizvk.OrientedBoxes(centers, half, np.broadcast_to(quarter_turn, (len(half), 3, 3))),
    ):
        result = device.cull(device.instances(bounds), camera, pyramid)
        assert [Verdict(code) for code in result.verdicts] == VERDICTS


def test_stats_add_up(device: hizvk.Device, camera: hizvk.Camera) -> None:
    stats = culled(device, camera, statistics=True).stats
    assert stats.tested == len(SCENE)
    assert stats.outside == VERDICTS.count(Verdict.OUTSIDE)
    assert stats.occluded == VERDICTS.count(Verdict.OCCLUDED)
    assert stats.kept == len(KEPT)
    assert stats.invalid == VERDICTS.count(Verdict.INVALID)
    assert stats.levels is not None
    assert stats.occluded <= sum(stats.levels) <= stats.tested
    assert stats.texels_read is None or stats.texels_read >= sum(stats.levels)
    for milliseconds in (stats.record_ms, stats.compile_ms, stats.wall_ms, stats.readback_ms):
        assert milliseconds >= 0
    assert "15 tested: 10 kept (4 invalid), 5 culled (3 outside, 2 occluded)" in str(stats)
    assert (stats.tested_groups, stats.tested_instances, stats.comparisons) == (
        0,
        len(SCENE),
        len(SCENE),
    )
    without = culled(device, camera).stats
    assert without.levels is None
    assert without.texels_read is None
    assert without.kept == stats.kept


def test_groups_are_tested_first(device: hizvk.Device, camera: hizvk.Camera) -> None:
    stats = culled(device, camera, hierarchy=True).stats
    # One group of 15, whose invalid members keep it.
    assert (stats.tested_groups, stats.tested_instances, stats.comparisons) == (
        1,
        len(SCENE),
        1 + len(SCENE),
    )
    assert [stats.outside, stats.occluded] == [
        VERDICTS.count(Verdict.OUTSIDE),
        VERDICTS.count(Verdict.OCCLUDED),
    ]


@pytest.mark.parametrize("order", ["stable", "any"])
@pytest.mark.parametrize("hierarchy", [False, True])
def test_what_was_not_asked_for_is_not_there(
    device: hizvk.Device, camera: hizvk.Camera, order: hizvk.options.Order, hierarchy: bool
) -> None:
    parts = {
        "mask": lambda seen: np.flatnonzero(seen.mask).tolist(),
        "verdicts": lambda seen: [
            i for i, code in enumerate(seen.verdicts) if code >= Verdict.VISIBLE
        ],
        "indices": lambda seen: sorted(seen.indices.tolist()),
        "draws": lambda seen: list(range(int(seen.draws["instance_count"].sum()))),
    }
    # Lists and draws can be made from a mask later, and a list has a draw.
    also = {"mask": {"indices", "draws"}, "indices": {"draws"}}
    for asked in parts:
        seen = culled(device, camera, order=order, hierarchy=hierarchy, outputs=[asked])
        assert seen.count == seen.demand == len(KEPT)
        for name, read in parts.items():
            if name == asked or name in also.get(asked, ()):
                assert read(seen) == (list(range(len(KEPT))) if name == "draws" else KEPT), (
                    asked,
                    name,
                )
            else:
                with pytest.raises(
                    ValueError,
                    match=rf"outputs: expected a cull that was asked for \w+, got .* {asked}",
                ):
                    read(seen)
    with pytest.raises(ValueError, match="got one with nothing"):
        _ = culled(device, camera, order=order, outputs=()).mask


def test_a_hidden_group_is_explained_and_counted(
    device: hizvk.Device, camera: hizvk.Camera
) -> None:
    # 64 together behind the wall, and one in view: two groups, the second of one member.
    centers = np.array([[0.01 * i, 0, -20] for i in range(64)] + [[0, 0, -2]])
    crowd = device.instances(hizvk.Spheres(centers, np.full(65, 0.05)), order="given")
    pyramid = device.pyramid(np.full(camera.size, 8.0), camera, kind="z")
    seen = device.cull(crowd, camera, pyramid, hierarchy=True)
    assert seen.verdicts.tolist() == [Verdict.OCCLUDED] * 64 + [Verdict.VISIBLE]
    assert (seen.stats.tested_groups, seen.stats.tested_instances) == (2, 1)
    told = seen.explain(7)
    assert told.verdict == Verdict.OCCLUDED
    assert told.reason.startswith("its group of 64 is hidden as a whole (behind")
    assert told.group is not None
    assert (told.group.verdict, told.group.group) == (Verdict.OCCLUDED, None)
    # Its own test, x from 0.02 to 0.12 at depth 20, then the box around all 64, x from -0.05 to
    # 0.68: both in column 4.
    assert told.rectangle == (4, 3, 4, 4)
    assert told.group.rectangle == (3, 3, 4, 4)
    assert "the box around its group: occluded" in str(told)
    beside = hizvk.Spheres(centers + np.where(np.arange(65) < 64, 500.0, 0.0)[:, None], 0.05)
    outside = device.cull(
        device.instances(beside, order="given"), camera, pyramid, hierarchy=True
    ).explain(7)
    assert outside.verdict == Verdict.OUTSIDE
    assert outside.reason.startswith("its group of 64 is outside as a whole (outside one plane")
    last = seen.explain(64)
    assert (last.verdict, last.group) == (Verdict.VISIBLE, None)
    full = device.cull(
        crowd, camera, pyramid, outputs=["indices"], order="any", capacity=1, hierarchy=False
    )
    assert full.count == 1
    with pytest.raises(ValueError, match="a list that is full"):
        _ = full.demand


def test_draw_arguments(device: hizvk.Device, camera: hizvk.Camera) -> None:
    template = hizvk.DrawTemplate(36, first_index=6, base_vertex=-2, first_instance=0)
    draws = culled(device, camera, draw=template).draws
    assert draws.dtype == hizvk.DRAW_DTYPE
    assert draws.dtype.itemsize == 20
    assert draws.dtype.names == (
        "index_count",
        "instance_count",
        "first_index",
        "base_vertex",
        "first_instance",
    )
    assert draws.tolist() == [(36, len(KEPT), 6, -2, 0)]


def test_any_order_has_the_same_members(device: hizvk.Device, camera: hizvk.Camera) -> None:
    result = culled(device, camera, order="any")
    assert sorted(result.indices.tolist()) == KEPT
    assert [Verdict(code) for code in result.verdicts] == VERDICTS


@pytest.mark.parametrize("order", ["stable", "any"])
@pytest.mark.parametrize("capacity", [0, 3, len(KEPT), 1000])
def test_capacity_and_demand(
    device: hizvk.Device, camera: hizvk.Camera, order: str, capacity: int
) -> None:
    result = culled(device, camera, order=order, capacity=capacity)
    written = min(capacity, len(KEPT))
    assert result.demand == len(KEPT)
    assert result.count == written
    assert result.draws["instance_count"].sum() == written
    assert len(result.indices) == len(set(result.indices.tolist())) == written
    assert set(result.indices.tolist()) <= set(KEPT)
    assert np.flatnonzero(result.mask).tolist() == KEPT  # nothing is lost silently
    assert result.stats.kept == len(KEPT)


def test_explain_by_hand(device: hizvk.Device, camera: hizvk.Camera) -> None:
    # Centre (-10, 0, -20), radius 1: x / depth from -(200 + 499^0.5) / 399 to -(200 - 499^0.5) /
    # 399, that is columns 1.77 to 2.22; y / depth within 1 / 399^0.5, rows 3.80 to 4.20.
    # So pixels 1..2 by 3..4, four texels of level 0.
    told = culled(device, camera).explain(0)
    assert told.index == 0
    assert told.verdict is Verdict.OCCLUDED
    assert told.rectangle == (1, 3, 2, 4)
    assert told.level == 0
    assert set(told.texels) == {(1, 3), (2, 3), (1, 4), (2, 4)}
    wall, sphere = 0.125 / 10, 0.125 / 19
    if not camera.reversed_z:
        wall, sphere = 1 - wall, 1 - sphere
    assert told.texel_depths == pytest.approx((wall,) * 4, rel=1e-6)
    assert told.farthest == pytest.approx(wall, rel=1e-6)
    assert told.nearest == pytest.approx(sphere, rel=1e-3)
    text = str(told)
    assert "instance 0: occluded" in text
    assert "x 1..2, y 3..4" in text


def wide_camera(*, reversed_z: bool = True) -> hizvk.Camera:
    """64 pixels per side, 8 of them a unit wide at depth 4.

    Column 32 begins at x = 0, and row 31 ends at y = 0.
    """
    return hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(64, 64), near=0.125, reversed_z=reversed_z
    )


@pytest.mark.parametrize("reversed_z", [True, False])
@pytest.mark.parametrize("side", [4, 8])
def test_explain_lists_a_whole_footprint(device: hizvk.Device, reversed_z: bool, side: int) -> None:
    camera = wide_camera(reversed_z=reversed_z)
    depth = np.full(camera.size, 2.0)
    depth[20:30, 34:44] = 3.0  # in the middle of what the box can touch, in no corner of it
    pyramid = device.pyramid(depth, camera, kind="z")
    # At depth 4 from x = -1.45 to 1.9 and y = -1.3 to 1.7: pixels 20 to 47 by 18 to 42.
    box = device.instances(hizvk.Boxes([[-1.45, -1.3, -4]], [[1.9, 1.7, -4]]))
    told = device.cull(box, camera, pyramid, footprint=side).explain(0)
    assert told.rectangle == (20, 18, 47, 42)
    # 28 by 25 pixels: the finest level with no more than 8 (4) texels a side is level 2 (3).
    level = 2 if side == 8 else 3
    assert told.level == level
    assert told.texels == tuple(
        (x, y)
        for y in range(18 >> level, (42 >> level) + 1)
        for x in range(20 >> level, (47 >> level) + 1)
    )
    assert told.texels_read == len(told.texels) == len(told.texel_depths)
    assert set(told.texel_levels) == {level}
    texels = pyramid.level(level)
    assert told.texel_depths == tuple(float(texels[y, x]) for x, y in told.texels)
    assert told.verdict is Verdict.OCCLUDED
    assert told.decisive is not None
    # The first one of the dent.
    assert told.texels[told.decisive] == (34 >> level, 20 >> level)
    assert told.farthest == told.texel_depths[told.decisive]
    assert (told.farthest_z, told.nearest_z) == (
        pytest.approx(3.0, rel=1e-6),
        pytest.approx(4.0, rel=1e-6),
    )
    assert "view depth 3 (depth image)" in str(told)
    assert f"decisive  ({34 >> level}, {20 >> level}) of level {level}" in str(told)


def test_explain_follows_a_descent(device: hizvk.Device) -> None:
    camera = wide_camera()
    depth = np.full(camera.size, 2.0)
    depth[24, 31] = 50.0
    pyramid = device.pyramid(depth, camera, kind="z")
    # Pixels 20 to 31 by 18 to 24 at depth 4, of level 3 the texels (2, 2) to (3, 3).
    box = device.instances(hizvk.Boxes([[-1.45, 0.9, -4]], [[-0.1, 1.7, -4]]))
    told = device.cull(box, camera, pyramid, descent=4096).explain(0)
    assert (told.rectangle, told.level) == ((20, 18, 31, 24), 3)
    # The footprint; then its texels again, down into the one with the far pixel, of whose children
    # the rectangle meets the first row alone: columns 6 and 7 of level 2, and so on to the pixel
    # itself.
    walked = [
        (3, 2, 2),
        (3, 3, 2),
        (3, 2, 3),
        (3, 3, 3),
        (2, 6, 6),
        (2, 7, 6),
        (1, 14, 12),
        (1, 15, 12),
        (0, 30, 24),
        (0, 31, 24),
    ]
    expected = [(3, 2, 2), (3, 3, 2), (3, 2, 3), (3, 3, 3), *walked]
    assert [
        (level, x, y) for level, (x, y) in zip(told.texel_levels, told.texels, strict=True)
    ] == expected
    assert told.verdict is Verdict.VISIBLE
    assert told.decisive == len(expected) - 1
    assert told.farthest_z == pytest.approx(50.0, rel=1e-6)
    # The same budget, with no hole: behind everything, the farthest of which is the wall.
    plain = device.cull(
        box, camera, device.pyramid(np.full(camera.size, 2.0), camera, kind="z"), descent=4096
    ).explain(0)
    assert (plain.verdict, plain.farthest_z) == (Verdict.OCCLUDED, pytest.approx(2.0, rel=1e-6))


def test_explain_in_world_units(device: hizvk.Device) -> None:
    box = device.instances(hizvk.Boxes([[-1.0, -1, -9]], [[1, 1, -7]]))
    for reversed_z in (True, False):
        camera = hizvk.Camera.orthographic(
            (0, 0, 0),
            (0, 0, -1),
            height=16,
            size=(16, 16),
            near=0.0,
            far=30.0,
            reversed_z=reversed_z,
        )
        told = device.cull(
            box, camera, device.pyramid(np.full((16, 16), 6.0), camera, kind="z")
        ).explain(0)
        assert (told.farthest_z, told.nearest_z) == (
            pytest.approx(6.0, abs=1e-4),
            pytest.approx(7.0, abs=1e-4),
        )
        # A bare orthographic matrix does not say where view depth starts.
        bare = hizvk.Camera.from_matrices(
            camera.clip_from_world, size=(16, 16), reversed_z=reversed_z
        )
        told = device.cull(
            box, bare, device.pyramid(np.full((16, 16), 0.5), bare, kind=bare.depth_kind)
        ).explain(0)  # type: ignore[call-overload]
        assert (told.farthest_z, told.nearest_z) == (None, None)
        assert told.farthest == 0.5
        assert "view depth" not in str(told)
    open_sky = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(16, 16), near=0.125)
    told = device.cull(
        box, open_sky, device.pyramid(np.full((16, 16), np.inf), open_sky, kind="z")
    ).explain(0)
    assert told.farthest_z == float("inf")


def test_an_explanation_after_an_update_is_stale(
    device: hizvk.Device, camera: hizvk.Camera
) -> None:
    instances = device.instances(scene())
    result = device.cull(instances, camera, device.pyramid(left_wall(), camera, kind="z"))
    before = [result.explain(i) for i in range(3)]
    instances.update(0, hizvk.Spheres([[10.0, 0, -20]], 1.0))
    told = result.explain(0)
    assert told.stale
    assert told.verdict is Verdict.VISIBLE  # where it is now
    assert "stale     updated since the cull" in str(told)
    assert Verdict(result.verdicts[0]) is Verdict.OCCLUDED  # where it was
    assert [result.explain(i) for i in (1, 2)] == before[1:]
    assert not before[0].stale


def test_results_export_by_dlpack(device: hizvk.Device, camera: hizvk.Camera) -> None:
    """They are shared and read-only; an import by DLPack gets a copy."""
    result = culled(device, camera)
    for array in (result.mask, result.verdicts, result.indices):
        assert type(array.__dlpack__()).__name__ == "PyCapsule"
        imported = np.from_dlpack(array)
        assert imported.dtype == array.dtype
        np.testing.assert_array_equal(imported, array)
        assert not np.shares_memory(imported, array)
        assert not array.flags.writeable
        part = np.from_dlpack(array[2:])
        np.testing.assert_array_equal(part, array[2:])
        # What is computed from them is a plain array.
        for made in (array == array, array & array, np.flatnonzero(array), np.where(array, 1, 0)):
            assert type(made) is np.ndarray
        assert isinstance(array.sum(), np.integer)
        assert repr(array) == repr(np.array(array))
        copy = array.copy()
        copy[0] = 1
        assert np.from_dlpack(copy)[0] == 1


@pytest.mark.parametrize("index", range(len(SCENE)))
def test_explain_agrees_with_the_verdict(
    device: hizvk.Device, camera: hizvk.Camera, index: int
) -> None:
    told = culled(device, camera).explain(index)
    assert told.verdict is VERDICTS[index]
    assert told.reason
    assert VERDICTS[index].name.lower() in str(told)
    if told.verdict is Verdict.OUTSIDE:
        assert told.texels == ()


def test_invalid_bounds_are_listed(device: hizvk.Device) -> None:
    instances = device.instances(scene())
    assert instances.invalid.dtype == np.uint64
    assert instances.invalid.tolist() == [
        i for i, verdict in enumerate(VERDICTS) if verdict is Verdict.INVALID
    ]


def test_no_instances(device: hizvk.Device, camera: hizvk.Camera) -> None:
    pyramid = device.pyramid(left_wall(), camera, kind="z")
    empty = np.zeros((0, 3))
    for bounds in (
        hizvk.Spheres(empty, np.zeros(0)),
        hizvk.Spheres(empty, 1.0),
        hizvk.Boxes(empty, empty),
        hizvk.OrientedBoxes(empty, empty, np.zeros((0, 3, 3))),
    ):
        for order in ("stable", "any"):
            result = device.cull(device.instances(bounds), camera, pyramid, order=order)  # type: ignore[arg-type]
            assert len(result) == len(bounds) == 0
            assert result.mask.shape == result.verdicts.shape == result.indices.shape == (0,)
            assert result.count == result.demand == result.stats.tested == 0
            assert result.draws["instance_count"].sum() == 0
            with pytest.raises(IndexError):
                result.explain(0)
        assert hizvk.visible(bounds, camera, depth=left_wall(), kind="z", device=device).shape == (
            0,
        )


@pytest.mark.parametrize(("x", "kept"), [(-10.0, False), (10.0, True)])
def test_one_instance(device: hizvk.Device, camera: hizvk.Camera, x: float, kept: bool) -> None:
    pyramid = device.pyramid(left_wall(), camera, kind="z")
    result = device.cull(device.instances(hizvk.Spheres([[x, 0.0, -20.0]], 1)), camera, pyramid)
    assert result.mask.tolist() == [kept]
    assert result.indices.tolist() == [0] * kept


def test_sample_coverage_and_guard(device: hizvk.Device, camera: hizvk.Camera) -> None:
    # A point-like sphere in a corner of pixel (6, 6): it meets the pixel's area, not its centre.
    corner = hizvk.Spheres([[20 * (6.125 - 4) / 4, -20 * (6.125 - 4) / 4, -20.0]], 0.01)
    pyramid = device.pyramid(left_wall(), camera, kind="z")
    instances = device.instances(corner)
    assert device.cull(instances, camera, pyramid).mask.tolist() == [True]
    assert device.cull(instances, camera, pyramid, coverage="sample").mask.tolist() == [False]
    assert device.cull(
        instances, camera, pyramid, coverage="sample", guard_px=0.5
    ).mask.tolist() == [True]


@pytest.mark.parametrize("kind", ["ndc", "z", "distance"])
def test_kinds_of_depth(device: hizvk.Device, camera: hizvk.Camera, kind: str) -> None:
    # A plane at depth 10: the ray through a pixel's centre is longer than the depth.
    rows, columns = np.mgrid[0:8, 0:8]
    x, y = (columns + 0.5 - 4) / 4, (rows + 0.5 - 4) / 4
    images = {
        "ndc": np.full((8, 8), 0.0125 if camera.reversed_z else 1 - 0.0125),
        "z": np.full((8, 8), 10.0),
        "distance": 10.0 * np.sqrt(1 + x**2 + y**2),
    }
    image, kind = images[kind], camera.depth_kind if kind == "ndc" else kind
    pyramid = device.pyramid(image, camera, kind=kind)  # type: ignore[call-overload]
    expected = 0.0125 if camera.reversed_z else 1 - 0.0125
    assert pyramid.level(0) == pytest.approx(np.full((8, 8), expected), rel=1e-6)
    spheres = hizvk.Spheres([[-1.0, 0, -10.5], [-1, 0, -9.5]], 0.25)
    mask = hizvk.visible(spheres, camera, depth=image, kind=kind, device=device)  # type: ignore[arg-type]
    assert mask.tolist() == [False, True]
    if kind in ("z", "distance"):  # the same in half units
        mask = hizvk.visible(spheres, camera, depth=2 * image, kind=kind, scale=0.5, device=device)  # type: ignore[arg-type]
        assert mask.tolist() == [False, True]


def test_pyramid_levels_by_hand(device: hizvk.Device) -> None:
    depth = np.array(
        [[0.5, 0.25, 0.75, 0.5, 0.125], [0.5, 0.5, 0.5, 0.5, 0.5], [0.25, 1.0, 0.5, 0.375, 0.625]]
    )
    far_is_0 = [depth, [[0.25, 0.5, 0.125], [0.25, 0.375, 0.625]], [[0.25, 0.125]], [[0.125]]]
    far_is_1 = [depth, [[0.5, 0.75, 0.5], [1.0, 0.5, 0.625]], [[1.0, 0.625]], [[1.0]]]
    for reversed_z, expected in ((True, far_is_0), (False, far_is_1)):
        camera = hizvk.Camera.look_at(
            (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(3, 5), near=1, reversed_z=reversed_z
        )
        pyramid = device.pyramid(depth, camera, kind=camera.depth_kind)  # type: ignore[call-overload]
        reference = hizvk.reference.pyramid(depth, reversed_z=reversed_z)
        assert pyramid.num_levels == len(reference) == 4
        assert pyramid.size == (3, 5)
        assert pyramid.camera == camera
        assert pyramid.device_bytes > 0
        for k, values in enumerate(expected):
            for level in (pyramid.level(k), reference[k]):
                assert level.dtype == np.float32
                assert level.tolist() == np.asarray(values).tolist()


def test_chosen_levels_by_hand(device: hizvk.Device) -> None:
    """A stored level equals that of a pyramid with all levels; reading another one is an error.

    What a level that is not stored would have decided, a coarser one decides.
    """
    depth = np.full((40, 40), 0.5, np.float32)
    depth[3, 3] = 0.0
    view = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(40, 40), near=1)
    everything = device.pyramid(depth, view, kind="reversed_ndc")
    assert everything.levels == range(1, 7)
    for levels, stored in (
        (1, range(1, 7)),
        (2, range(2, 7)),
        (9, range(6, 7)),
        ((2, 2), range(2, 3)),
        ([4, 5], range(4, 6)),
        ((5, 15), range(5, 7)),
    ):
        pyramid = device.pyramid(depth, view, kind="reversed_ndc", levels=levels)  # type: ignore[arg-type]
        assert pyramid.levels == stored
        assert pyramid.num_levels == 7
        assert (pyramid.device_bytes < everything.device_bytes) == (stored != range(1, 7))
        for k in range(7):
            if k in (0, *stored):
                np.testing.assert_array_equal(pyramid.level(k), everything.level(k))
            else:
                text = f"{stored[0]}..{stored[-1]}" if len(stored) > 1 else str(stored[0])
                with pytest.raises(
                    IndexError, match=rf"^k: expected 0 or a level that is stored, {text}, got {k}$"
                ):
                    pyramid.level(k)
    # Behind the wall at depth 2: in one pixel, in pixels 4 to 6 (the hole is in the first blocks of
    # 4 and 8), in 20.
    spheres = hizvk.Spheres([[1.1, 1.1, -4], [-2.9, 2.9, -4], [1.5, -1.5, -4]], [0.02, 0.1, 1.8])
    instances = device.instances(spheres)
    for given, expected in (
        (None, [False, False, False]),
        (2, [False, False, False]),
        (3, [False, True, False]),
        ((1, 1), [False, False, True]),  # the large one spans more than 2 x 2 texels of level 1
    ):
        pyramid = device.pyramid(depth, view, kind="reversed_ndc", levels=given)  # type: ignore[arg-type]
        result = device.cull(instances, view, pyramid)
        assert result.mask.tolist() == expected, given
        assert device.cull(instances, view, pyramid, descent=4096).mask.tolist() == [False] * 3
        if given == (1, 1):
            explained = result.explain(2)
            assert "coarsest stored level" in explained.reason
            assert explained.level == 1
            assert len(explained.texels) == 0


def test_rendered_depth_by_hand(device: hizvk.Device, camera: hizvk.Camera) -> None:
    # The square x in -10..0, y in -10..10 at depth 10 covers the left half of the image.
    corners = np.array([[-10.0, -10, -10], [0, -10, -10], [0, 10, -10], [-10, 10, -10]])
    image = device.render_depth(device.occluders(corners, [[0, 1, 2], [0, 2, 3]]), camera)
    assert image.size == (8, 8)
    assert image.kind == camera.depth_kind
    assert image.camera == camera
    depth = image.numpy()
    assert depth.dtype == np.float32
    near, far = (0.0125, 0.0) if camera.reversed_z else (1 - 0.0125, 1.0)
    assert depth == pytest.approx(np.tile([near] * 4 + [far] * 4, (8, 1)), rel=1e-5)
    result = device.cull(device.instances(scene()), camera, device.pyramid(image))
    assert [Verdict(code) for code in result.verdicts] == VERDICTS
    mask = hizvk.visible(scene(), camera, depth=image)
    assert np.flatnonzero(mask).tolist() == KEPT


def test_occluders_placed_culled_and_resized(device: hizvk.Device, camera: hizvk.Camera) -> None:
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    faces = [[0, 1, 2], [0, 2, 3]]  # counter-clockwise for the camera
    placed = np.array([np.diag([5.0, 10, 1, 1])] * 2)
    placed[0, :3, 3] = (-5, 0, -10)
    placed[1, :3, 3] = (-5, 0, -30)
    far = 0.0 if camera.reversed_z else 1.0
    expected = device.render_depth(
        device.occluders(corners, faces, transforms=placed), camera
    ).numpy()
    assert (expected[:, :4] != far).all()
    assert (expected[:, 4:] == far).all()
    for meshes in (
        [(corners, faces, placed)],
        [hizvk.Mesh(corners, faces, m) for m in placed],
        hizvk.Mesh(corners, faces, placed),
    ):
        assert (device.render_depth(device.occluders(meshes), camera).numpy() == expected).all()  # type: ignore[call-overload]
    back = device.occluders(corners, faces, transforms=placed, cull="back")
    assert (device.render_depth(back, camera).numpy() == expected).all()
    front = device.occluders(corners, faces, transforms=placed, cull="front")
    assert (device.render_depth(front, camera).numpy() == far).all()
    assert (device.render_depth(device.occluders([]), camera).numpy() == far).all()
    small = device.render_depth(back, camera, size=(4, 2))
    assert small.camera == camera.resized((4, 2))
    assert (small.numpy() != far).tolist() == [[True, False]] * 4


def test_the_default_device_is_made_once(camera: hizvk.Camera) -> None:
    from hizvk.oneline import default_device

    assert (
        np.flatnonzero(hizvk.visible(scene(), camera, depth=left_wall(), kind="z")).tolist() == KEPT
    )
    assert default_device() is default_device()


def test_instances_and_repr(device: hizvk.Device, camera: hizvk.Camera) -> None:
    spheres = scene()
    instances = device.instances(spheres)
    assert repr(spheres) == "Spheres(15 of float64)"
    assert (len(instances), instances.kind, instances.num_pieces) == (15, "spheres", 1)
    assert instances.device is device
    assert instances.device_bytes >= 15 * 16
    assert repr(instances) == "<Instances: 15 spheres>"
    pyramid = device.pyramid(left_wall(), camera, kind="z")
    assert repr(pyramid) == "<Pyramid 8x8, 4 levels>"
    partial = device.pyramid(left_wall(), camera, kind="z", levels=2)
    assert repr(partial) == "<Pyramid 8x8, 4 levels, stored 2..3>"
    assert repr(device.cull(instances, camera, pyramid)) == "<CullResult of 15 instances>"
    corners = np.zeros((3, 3))
    assert (
        repr(hizvk.Mesh(corners, [[0, 1, 2]], [np.eye(4)] * 2))
        == "Mesh(3 vertices, 1 triangles, 2 copies)"
    )
    occluders = device.occluders([hizvk.Mesh(corners, [[0, 1, 2]], [np.eye(4)] * 2)] * 3)
    assert repr(occluders) == "<Occluders: 6 meshes, 6 triangles>"
    assert (
        repr(device.render_depth(occluders, camera))
        == f"<DepthImage 8x8 of kind {camera.depth_kind}>"
    )
    assert repr(device) == f"<Device {device.adapter}>"
    assert device.adapter in hizvk.adapters()
    assert device.max_image_side >= 8192
    device.wait()


# --- the oracle and the comparison ---

TRUTH = {
    Verdict.OUTSIDE: HIDDEN,
    Verdict.OCCLUDED: HIDDEN,
    Verdict.VISIBLE: VISIBLE,
    Verdict.INVALID: INVALID,
}


def test_the_oracle_by_hand(camera: hizvk.Camera) -> None:
    codes = hizvk.reference.classify(scene(), camera, left_wall(), kind="z")
    assert codes.dtype == np.uint8
    assert codes.tolist() == [TRUTH[verdict] for verdict in VERDICTS]
    centers, radii = scene().centers, np.repeat(scene().radii[:, None], 3, axis=1)
    boxes = hizvk.Boxes(centers - radii, centers + radii)
    assert hizvk.reference.classify(boxes, camera, left_wall(), kind="z").tolist() == codes.tolist()
    turned = hizvk.OrientedBoxes(centers, radii, np.broadcast_to(np.eye(3), (len(centers), 3, 3)))
    assert (
        hizvk.reference.classify(turned, camera, left_wall(), kind="z").tolist() == codes.tolist()
    )


def test_compare_by_hand() -> None:
    mask = np.array([True, True, False, False, True, False])
    codes = np.array([VISIBLE, HIDDEN, VISIBLE, HIDDEN, UNDECIDED, INVALID], dtype=np.uint8)
    found = hizvk.compare(mask, codes)
    assert found.false_culls.tolist() == [2, 5]  # bad bounds have to be kept
    assert found.false_keeps.tolist() == [1]
    assert (found.total, found.kept, found.culled) == (6, 3, 3)
    assert (found.visible, found.hidden, found.undecided) == (3, 2, 1)
    assert found.kept_share == 0.5
    assert found.false_keep_share == 0.5
    assert found.kept_over_visible == 1.0
    assert "2 wrongly culled, 1 wrongly kept (50.0 % of the hidden)" in str(found)
    plain = hizvk.compare([True, False], [True, True])
    assert (plain.false_culls.tolist(), plain.false_keeps.tolist()) == ([1], [])
    none = hizvk.compare([], [])
    assert (none.total, none.kept_share, none.false_keep_share, none.kept_over_visible) == (
        0,
        0.0,
        0.0,
        1.0,
    )
    assert hizvk.compare([True], [False]).kept_over_visible == float("inf")


def test_the_cull_agrees_with_the_oracle(device: hizvk.Device, camera: hizvk.Camera) -> None:
    codes = hizvk.reference.classify(scene(), camera, left_wall(), kind="z")
    found = hizvk.compare(culled(device, camera).mask, codes)
    assert found.false_culls.size == 0
    assert found.false_keeps.size == 0
