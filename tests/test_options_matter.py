"""Every option changes a result: there is one scene per option, worked out by hand.

The camera is at the origin and looks along -z, 90 degrees wide, with the near plane at 1.
The image has 16x16 pixels.
At depth 8 a pixel is a unit wide, column 8 begins at x = 0, and row 8 begins at y = 0.
Rows run downwards.
The wall is at depth 4.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hizvk

SIZE = (16, 16)


CAMERA = hizvk.Camera.look_at(
    (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=SIZE, near=1.0, reversed_z=True
)


def box(low: Any, high: Any) -> hizvk.Boxes:
    return hizvk.Boxes(np.array([low], np.float64), np.array([high], np.float64))


def sphere(center: Any, radius: float) -> hizvk.Spheres:
    return hizvk.Spheres(np.array([center], np.float64), np.array([radius], np.float64))


def wall(*open_pixels: tuple[Any, Any]) -> Any:
    """Depth 4, except for (row, column) pixels or slices, which are open."""
    depth = np.full(SIZE, 4.0)
    for pixel in open_pixels:
        depth[pixel] = np.inf
    return depth


HOLE_COLUMN = wall((slice(None), 8))

#: The bounds and the depth image, then options that hide the bounds and options that keep them.
CULLS: dict[str, tuple[Any, Any, dict[str, Any], dict[str, Any]]] = {
    # Between pixel centres, in front of the wall.
    "coverage": (sphere((0, 0, -2), 0.01), wall(), {"coverage": "sample"}, {"coverage": "area"}),
    # A quarter of a pixel beside the open column.
    "guard_px": (
        box((-1.5, -0.5, -8), (-0.25, 0.5, -8)),
        HOLE_COLUMN,
        {"guard_px": 0.125},
        {"guard_px": 0.5},
    ),
    "guard_px, default": (
        box((-1.5, -0.5, -8), (-0.25, 0.5, -8)),
        HOLE_COLUMN,
        {},
        {"guard_px": 0.5},
    ),
    # In sample coverage the default is 1/64.
    # The box ends 1/100 in front of the column's pixel centres.
    "guard_px, sample": (
        box((-1.5, -0.5, -8), (0.49, 0.5, -8)),
        HOLE_COLUMN,
        {"coverage": "sample", "guard_px": 0.0},
        {"coverage": "sample"},
    ),
    # The wall is at 1/4 in reversed Z.
    # A hundredth of that less is 1 / 4.0404, and 1/100 less is 1 / 4.1667.
    "depth_slack": (
        box((-1, -1, -5), (1, 1, -4.03)),
        wall(),
        {"depth_slack": 0.005},
        {"depth_slack": 0.01},
    ),
    "depth_slack_abs": (
        box((-1, -1, -5), (1, 1, -4.1)),
        wall(),
        {"depth_slack_abs": 0.005},
        {"depth_slack_abs": 0.01},
    ),
    # The slack is kappa eps (1 + 4.1 / 4) and more.
    # It is 0.0024 at 10,000 and 0.24 at a million, while 4.1 / 4 - 1 is 0.025.
    "transform_slack": (
        box((-1, -1, -5), (1, 1, -4.1)),
        wall(),
        {"transform_slack": 1e4},
        {"transform_slack": 1e6},
    ),
    # Three pixels, columns 9 to 11, beside the open column 8.
    # The 2x2 texels that span them are of level 1 and contain that column.
    "footprint": (
        box((1.1, 0.1, -8), (3.9, 0.9, -8)),
        HOLE_COLUMN,
        {"footprint": 4},
        {"footprint": 2},
    ),
    # Two pixels, columns 9 and 10, which no border of a texel parts but that of level 1.
    # The one texel that encloses them is of level 2, and contains the open column 8.
    "footprint 1": (
        box((1.1, 0.1, -8), (2.9, 0.9, -8)),
        HOLE_COLUMN,
        {"footprint": 2},
        {"footprint": 1},
    ),
    "footprint 8": (
        box((1.1, -1.9, -8), (6.9, 0.9, -8)),
        HOLE_COLUMN,
        {"footprint": 8},
        {"footprint": 4},
    ),
    "descent": (
        box((1.1, -1.9, -8), (6.9, 0.9, -8)),
        HOLE_COLUMN,
        {"descent": 4096},
        {"descent": 0},
    ),
    "descent, budget": (
        box((1.1, -1.9, -8), (6.9, 0.9, -8)),
        HOLE_COLUMN,
        {"descent": 4096},
        {"descent": 3},
    ),
    # A ball of 3.24 pixels about the middle.
    # Its rectangle has the open pixel in its corner, but its outline does not contain it.
    "fit": (
        sphere((0, 0, -8), 3.0),
        wall((4, 11)),
        {"fit": "volume", "descent": 4096},
        {"fit": "rectangle", "descent": 4096},
    ),
}


def by_visible(device: hizvk.Device, bounds: Any, depth: Any, options: dict[str, Any]) -> bool:
    return bool(hizvk.visible(bounds, CAMERA, depth=depth, kind="z", device=device, **options)[0])


def by_cull(device: hizvk.Device, bounds: Any, depth: Any, options: dict[str, Any]) -> bool:
    pyramid = device.pyramid(depth, CAMERA, kind="z")
    return bool(device.cull(device.instances(bounds), CAMERA, pyramid, **options).mask[0])


def by_groups(device: hizvk.Device, bounds: Any, depth: Any, options: dict[str, Any]) -> bool:
    """A hundred copies of the bounds, in two groups: hidden as a whole, or all kept."""
    many = type(bounds)(
        *(np.repeat(getattr(bounds, name), 100, axis=0) for name in bounds.__dataclass_fields__)
    )
    pyramid = device.pyramid(depth, CAMERA, kind="z")
    mask = device.cull(device.instances(many), CAMERA, pyramid, hierarchy=True, **options).mask
    assert mask.all() or not mask.any()
    return bool(mask[0])


@pytest.mark.parametrize("face", [by_visible, by_cull, by_groups])
@pytest.mark.parametrize("name", CULLS)
def test_each_option_of_a_cull(device: hizvk.Device, name: str, face: Any) -> None:
    bounds, depth, hiding, keeping = CULLS[name]
    assert not face(device, bounds, depth, hiding), "hidden"
    # A group's test always descends by up to 16 texels.
    # So it hides what its footprint alone would keep.
    if face is not by_groups or not name.startswith(("descent", "footprint")):
        assert face(device, bounds, depth, keeping), "kept"


@pytest.mark.parametrize("dtype", [np.float64, np.float32, np.uint16])
def test_kind_and_scale(device: hizvk.Device, dtype: Any) -> None:
    """A distance of 4 in the image's corner is a view depth of 2.4.

    Steps of 2 put a wall at depth 8.
    """
    corner = sphere((3.0 * 14 / 16, 3.0 * 14 / 16, -3.0), 0.05)
    depth = wall().astype(dtype)

    def kept(bounds: Any, **options: Any) -> tuple[bool, bool]:
        seen = hizvk.visible(bounds, CAMERA, depth=depth, device=device, **options)
        pyramid = device.pyramid(depth, CAMERA, **options)
        return bool(seen[0]), bool(device.cull(device.instances(bounds), CAMERA, pyramid).mask[0])

    assert kept(corner, kind="z") == (True, True)
    assert kept(corner, kind="distance") == (False, False)
    behind = box((-1, -1, -7), (1, 1, -6))
    assert kept(behind, kind="z") == (False, False)
    assert kept(behind, kind="z", scale=2.0) == (True, True)
    assert kept(behind, kind="distance", scale=2.0) == (True, True)
    far_behind = box((-1, -1, -10), (1, 1, -9))
    assert kept(far_behind, kind="z", scale=2.0) == (False, False)
    assert kept(far_behind, kind="z", scale=3.0) == (True, True)


def test_levels(device: hizvk.Device) -> None:
    """Three pixels far from an open column.

    A texel of level 3 contains both, and it is read only if level 3 is the finest level.
    """
    three = box((1.1, 0.1, -8), (3.9, 0.9, -8))
    depth = wall((slice(None), 15))
    for levels, kept in ((None, False), (1, False), ((1, 1), False), (3, True), ((3, 3), True)):
        pyramid = device.pyramid(depth, CAMERA, kind="z", levels=levels)
        assert bool(device.cull(device.instances(three), CAMERA, pyramid).mask[0]) == kept, levels
    # Six pixels are more than two texels of level 1.
    # They are no more than two texels of level 2 (columns 8 to 15).
    six = box((1.1, 0.1, -8), (6.9, 0.9, -8))
    for levels, kept in ((None, False), ((1, 2), False), ((1, 1), True)):
        pyramid = device.pyramid(wall((slice(None), 0)), CAMERA, kind="z", levels=levels)
        assert bool(device.cull(device.instances(six), CAMERA, pyramid).mask[0]) == kept, levels


def points(count: int) -> tuple[hizvk.Spheres, Any]:
    """Specks in random order in front of and behind the wall, and which of them are in front."""
    random = np.random.default_rng(3)
    z = np.where(random.random(count) < 0.5, 2.0, 8.0)
    centers = np.stack(
        [z * random.uniform(-0.9, 0.9, count), z * random.uniform(-0.9, 0.9, count), -z], axis=1
    )
    return hizvk.Spheres(centers, np.full(count, 1e-3)), z == 2.0


def test_order_of_the_list(device: hizvk.Device) -> None:
    bounds, before = points(3000)
    pyramid = device.pyramid(wall(), CAMERA, kind="z")
    expected = np.flatnonzero(before)
    stable, any_order = (
        device.cull(device.instances(bounds), CAMERA, pyramid, order=order).indices
        for order in ("stable", "any")
    )
    assert stable.tolist() == expected.tolist()
    assert np.sort(any_order).tolist() == expected.tolist()
    # In stored order, which is not the caller's order.
    assert any_order.tolist() != expected.tolist()


def test_hierarchy_and_statistics(device: hizvk.Device) -> None:
    bounds, before = points(3000)
    pyramid = device.pyramid(wall(), CAMERA, kind="z")
    instances = device.instances(bounds)
    groups = {
        h: device.cull(instances, CAMERA, pyramid, hierarchy=h).stats.tested_groups
        for h in (None, True, False)
    }
    assert groups == {None: 0, True: 47, False: 0}
    # Where nothing is hidden, each instance is tested; the last of 47 groups has 56 members.
    nothing = device.pyramid(np.full(SIZE, np.inf), CAMERA, kind="z")
    assert device.cull(instances, CAMERA, nothing, hierarchy=True).stats.tested_instances == 3000
    without, with_them = (
        device.cull(instances, CAMERA, pyramid, statistics=s).stats for s in (False, True)
    )
    assert (without.levels, without.texels_read) == (None, None)
    assert with_them.levels is not None
    assert sum(with_them.levels) == 3000
    assert (with_them.outside, with_them.occluded, with_them.kept) == (
        0,
        3000 - before.sum(),
        before.sum(),
    )


def test_outputs_capacity_and_draws(device: hizvk.Device) -> None:
    bounds, before = points(500)
    pyramid = device.pyramid(wall(), CAMERA, kind="z")
    instances = device.instances(bounds)
    demand = int(before.sum())
    draw = hizvk.DrawTemplate(36, 7, -3, 0)
    for order in ("stable", "any"):
        culled = device.cull(instances, CAMERA, pyramid, order=order, capacity=10, draw=draw)
        assert (culled.count, culled.demand, len(culled.indices)) == (10, demand, 10)
        assert culled.mask.sum() == demand
        [record] = culled.draws.tolist()
        assert record == (36, 10, 7, -3, 0)
    asked = {
        "mask": lambda r: r.mask,
        "verdicts": lambda r: r.verdicts,
        "indices": lambda r: r.indices,
        "draws": lambda r: r.draws,
    }
    for name, of in asked.items():
        result = device.cull(instances, CAMERA, pyramid, order="any", outputs=[name])
        assert len(of(result)) > 0
        # Lists can be worked out from a mask, and a draw from its list.
        refused = {
            "mask": ["verdicts"],
            "verdicts": ["mask", "indices"],
            "indices": ["mask"],
            "draws": ["mask", "indices"],
        }
        for other in refused[name]:
            with pytest.raises(ValueError, match="outputs: expected"):
                asked[other](result)


def test_strict_and_stored_order(device: hizvk.Device) -> None:
    bad = sphere((0, 0, np.nan), 1.0)
    assert device.instances(bad).invalid.tolist() == [0]
    with pytest.raises(ValueError, match="bounds: expected finite"):
        device.instances(bad, strict=True)
    bounds, before = points(1000)
    morton, given = device.instances(bounds), device.instances(bounds, order="given")
    assert morton.host_bytes - given.host_bytes == 8 * 1000
    pyramid = device.pyramid(wall(), CAMERA, kind="z")
    for instances in (morton, given):
        assert device.cull(instances, CAMERA, pyramid).mask.tolist() == before.tolist()
    given.update(0, sphere((0, 0, -2), 0.1))
    assert device.cull(given, CAMERA, pyramid).mask[0]
    with pytest.raises(ValueError, match="bounds: expected finite"):
        given.update(0, bad, strict=True)
    given.update(0, bad)
    assert given.invalid.tolist() == [0]


#: A square at depth 4, x and y in -2..2, counter-clockwise as the camera sees it.
SQUARE = np.array([[-2.0, -2, -4], [2, -2, -4], [2, 2, -4], [-2, 2, -4]])
FRONT = np.array([[0, 1, 2], [0, 2, 3]])


def drawn(device: hizvk.Device, occluders: hizvk.Occluders, **options: Any) -> Any:
    image = device.render_depth(occluders, CAMERA, **options)
    return device.pyramid(image).level(0)


def about(depth: Any) -> Any:
    """A depth in reversed Z, with a tolerance for conservative depth's rounding towards far."""
    return pytest.approx(1.0 / depth, rel=1e-6)


@pytest.mark.parametrize("conservative", [False, True])
def test_faces_and_transforms_of_occluders(device: hizvk.Device, conservative: bool) -> None:
    for triangles, left_out in ((FRONT, "front"), (FRONT[:, ::-1], "back")):
        for cull in ("none", "back", "front"):
            occluders = device.occluders(
                SQUARE,
                triangles,
                cull=cull,  # type: ignore[call-overload]
            )
            seen = drawn(device, occluders, conservative=conservative)
            assert seen[8, 8] == (0.0 if cull == left_out else about(4)), (cull, left_out)
            assert seen[0, 0] == 0.0
    # At depth 4 a pixel is half a unit, so the square covers columns 4 to 11.
    # Moved by 4 to either side it covers columns 12 to 15, and 0 to 3.
    still = drawn(device, device.occluders(SQUARE, FRONT), conservative=conservative)
    moved = np.stack([np.eye(4), np.eye(4)])
    moved[0][0, 3], moved[1][0, 3] = 4.0, -4.0
    seen = drawn(
        device, device.occluders(SQUARE, FRONT, transforms=moved), conservative=conservative
    )
    assert [still[8, column] for column in (2, 8, 13)] == [0.0, about(4), 0.0]
    assert [seen[8, column] for column in (2, 8, 13)] == [about(4), 0.0, about(4)]


def test_size_conservative_and_refinement(device: hizvk.Device) -> None:
    """A wall whose right edge crosses column 8 beyond its centre.

    The centre is covered, and the pixel is not.
    """
    right = 4.0 * 0.8 / 8
    wide = np.array([[-9.0, -9, -4], [right, -9, -4], [right, 9, -4], [-9, 9, -4]])
    occluders = device.occluders(wide, FRONT)
    plain = drawn(device, occluders)
    whole = drawn(device, occluders, conservative=True, refinement=0)
    assert [plain[8, 8], whole[8, 8], plain[8, 7], whole[8, 7]] == [0.25, 0.0, 0.25, about(4)]
    assert drawn(device, occluders, size=(4, 8)).shape == (4, 8)
    assert drawn(device, occluders, size=(4, 8), conservative=True)[2, 3] == about(4)
    # Two walls that end within column 8; the farther one begins where the nearer one still is.
    # Neither covers the pixel, but together they cover each of its quarters.
    left, lap = wide.copy(), wide.copy()
    left[1:3, 0] = 0.26  # ends at 8.52, at depth 4
    lap[[0, 3], 0], lap[[1, 2], 0] = 0.2, 9.0  # begins at 8.32, at depth 5
    lap[:, 2] = -5.0
    overlapping = device.occluders([(left, FRONT), (lap, FRONT)])
    coarse, fine = (
        drawn(device, overlapping, conservative=True, refinement=n)[8, 8] for n in (0, 2)
    )
    assert [coarse, fine] == [0.0, about(5)]


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("size", [(16, 16), (8, 40), (31, 7)])
def test_a_resized_orthographic_camera_and_depth_along_z(
    device: hizvk.Device, size: tuple[int, int], reversed_z: bool
) -> None:
    """8 wide, 4 high, and from 1 to 9 away.

    The walls in the image's quarters are 3, 5, 7 and 8 away.
    """
    first = hizvk.Camera.orthographic(
        (1, 2, 3),
        (1, 2, 2),
        height=4.0,
        width=8.0,
        size=(50, 60),
        near=1.0,
        far=9.0,
        reversed_z=reversed_z,
    )
    camera = first.resized(size)
    quarters = np.array([[3.0, 5.0], [7.0, 8.0]])
    rows, columns = (np.arange(n) * 2 // n for n in size)
    depth = quarters[np.ix_(rows, columns)]
    ndc = (depth - 1.0) / 8.0
    pyramid = device.pyramid(depth, camera, kind="z")
    expected = 1.0 - ndc if reversed_z else ndc
    np.testing.assert_allclose(pyramid.level(0), expected, rtol=0, atol=1e-6)
    # In each quarter's middle there is one box a little in front of its wall and one behind it.
    low, high, kept = [], [], []
    for row, column in np.ndindex(2, 2):
        x, y = 1.0 + (column - 0.5) * 4.0, 2.0 - (row - 0.5) * 2.0
        for offset in (-0.01, 0.01):
            z = 3.0 - (quarters[row, column] + offset)
            low.append((x - 0.1, y - 0.1, z - 0.005))
            high.append((x + 0.1, y + 0.1, z))
            kept.append(offset < 0)
    for descent in (0, 4096):
        mask = device.cull(
            device.instances(hizvk.Boxes(low, high)), camera, pyramid, descent=descent
        ).mask
        assert mask.tolist() == kept, (size, descent)
    assert (
        hizvk.visible(hizvk.Boxes(low, high), camera, depth=depth, kind="z", device=device).tolist()
        == kept
    )
