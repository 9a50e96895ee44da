"""Points: their guard, tolerances, projection, colours, and depth images made of them.

Expectations come from loops of this file: rays against triangles, pinhole formulas, pixel by pixel.
"""

from typing import Any

import numpy as np
import pytest

import hizvk

Floats = np.ndarray[Any, np.dtype[np.float64]]

EYE = (0.1, 0.2, 3.0)
SIZE = (120, 160)


def view(size: tuple[int, int] = SIZE, reversed_z: bool = True) -> hizvk.Camera:
    return hizvk.Camera.look_at(
        EYE, (0, 0, 0), fov_y_deg=60, size=size, near=0.1, far=50.0, reversed_z=reversed_z
    )


def bumpy(around: int = 36) -> tuple[Floats, Any]:
    """A closed mesh of radius 0.85 to 1.15 with bumps and valleys."""
    down = np.linspace(0.05, np.pi - 0.05, around // 2)
    turn = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    t, p = np.meshgrid(down, turn, indexing="ij")
    r = 1.0 + 0.15 * np.sin(5.0 * t) * np.cos(7.0 * p)
    vertices = np.stack([r * np.sin(t) * np.cos(p), r * np.cos(t), r * np.sin(t) * np.sin(p)], -1)
    index = np.arange(t.size).reshape(t.shape)
    a, b = index[:-1], index[1:]
    c, d = np.roll(b, -1, 1), np.roll(a, -1, 1)
    corners = [np.stack(three, -1).reshape(-1, 3) for three in ((a, b, c), (a, c, d))]
    return vertices.reshape(-1, 3), np.concatenate(corners)


def seen_by_rays(vertices: Floats, triangles: Any, eye: Any, which: Any) -> Any:
    """Which of some vertices no triangle hides that they are no corner of (Moeller 1997)."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    from_a = np.asarray(eye) - a
    seen = np.ones(len(which), bool)
    for k, i in enumerate(which):
        ray = vertices[i] - eye
        across = np.cross(ray, c - a)
        scale = np.einsum("ij,ij->i", b - a, across)
        own = (triangles == i).any(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.einsum("ij,ij->i", from_a, across) / scale
            turned = np.cross(from_a, b - a)
            v = (turned @ ray) / scale
            at = np.einsum("ij,ij->i", c - a, turned) / scale
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (at > 0) & (at < 1 - 1e-9) & ~own
        seen[k] = not hit.any()
    return seen


@pytest.fixture(scope="module")
def mesh() -> tuple[Floats, Any, Any]:
    vertices, triangles = bumpy()
    return vertices, triangles, seen_by_rays(vertices, triangles, EYE, range(len(vertices)))


def test_a_point_takes_16_bytes_where_float32_holds_it(device: hizvk.Device) -> None:
    numbers = np.random.default_rng(1).normal(size=(65536, 3))
    single = numbers.astype(np.float32)
    # A box of 48 bytes around each 64 points, and around each 64 of these boxes.
    boxes = (65536 // 64 + 65536 // 4096) * 48
    for array, each in ((single, 16), (single.astype(np.float64), 16), (numbers, 32)):
        cloud = device.instances(hizvk.Points(array))
        assert cloud.kind == "points"
        assert len(cloud) == 65536
        assert cloud.device_bytes == 65536 * each + boxes


def test_the_default_guard_keeps_the_visible_vertices_of_a_mesh(
    device: hizvk.Device, mesh: tuple[Floats, Any, Any]
) -> None:
    vertices, triangles, visible = mesh
    camera = view()
    hiz = device.pyramid(device.render_depth(device.occluders(vertices, triangles), camera))
    cloud = device.instances(hizvk.Points(vertices))
    lost = {
        guard: int((visible & ~device.cull(cloud, camera, hiz, guard_px=guard).mask).sum())
        for guard in (0.0, 0.25, 0.5, None)
    }
    kept = device.cull(cloud, camera, hiz)
    hidden = ~visible
    print(
        f"{visible.sum()} visible, lost by guard: {lost}; of {hidden.sum()} hidden "
        f"{(hidden & kept.mask).sum()} kept"
    )
    assert lost[0.0] > 0.3 * visible.sum()
    assert lost[None] == lost[0.5] <= 0.02 * visible.sum()
    # It still hides most of what is hidden.
    assert (hidden & kept.mask).sum() < 0.35 * hidden.sum()
    # A tolerance of a hundredth of the radius keeps the rest.
    depth = device.render_depth(device.occluders(vertices, triangles), camera)
    moved = device.pyramid(
        depth.numpy(), camera, kind=depth.kind, tolerance=hizvk.Tolerance(abs=0.01)
    )
    assert not (visible & ~device.cull(cloud, camera, moved).mask).any()


def test_explicit_guards_win_and_options_say_the_default(device: hizvk.Device) -> None:
    camera = view()
    image = np.random.default_rng(2).uniform(1.0, 4.0, SIZE)
    hiz = device.pyramid(image, camera, kind="z")
    positions = np.random.default_rng(3).uniform(-1.5, 1.5, (3000, 3))
    points = device.instances(hizvk.Points(positions))
    spheres = device.instances(hizvk.Spheres(positions, 0.0))

    def told(instances: hizvk.Instances, **keywords: Any) -> list[int]:
        return [int(code) for code in device.cull(instances, camera, hiz, **keywords).verdicts]

    assert told(points) == told(points, guard_px=0.5) == told(spheres, guard_px=0.5)
    assert told(points, guard_px=0.0) == told(spheres) != told(points)
    sample = told(points, coverage="sample")
    assert sample == told(points, coverage="sample", guard_px=1.0)
    # Groups, orders and fits change nothing of what is kept of points.
    for keywords in ({"hierarchy": True}, {"order": "any"}, {"fit": "volume", "descent": 64}):
        mask = device.cull(points, camera, hiz, **keywords).mask
        assert not (mask & ~device.cull(points, camera, hiz).mask).any(), keywords


def test_nothing_that_the_oracle_sees_is_culled(device: hizvk.Device) -> None:
    rng = np.random.default_rng(4)
    for reversed_z in (False, True):
        camera = view((33, 47), reversed_z)
        image = rng.uniform(1.5, 4.0, camera.size).astype(np.float32)
        # Points within float32's last bits of the image's depth, near the borders of pixels.
        column, row = rng.integers(0, 47, 4000), rng.integers(0, 33, 4000)
        beside = rng.choice([0.0, 1.0, 0.5, 1e-6, 1 - 1e-6], (4000, 2))
        z = image[row, column] * (1.0 + rng.choice([0.0, -1e-7, 3e-7, 1e-6, 1e-4], 4000))
        ndc = np.stack([(column + beside[:, 0]) / 47 * 2 - 1, 1 - (row + beside[:, 1]) / 33 * 2], 1)
        clip = np.c_[ndc * z[:, None], np.zeros(4000), z]
        depth = camera.project(np.zeros((1, 3)))
        assert depth.inside.all()
        # View depth is w, so clip z follows from the rows of a perspective.
        m = camera.clip_from_world
        m = m / np.linalg.norm(m[3, :3])
        inverse = np.linalg.inv(np.delete(m, 2, axis=0)[:, :3])
        positions = (clip[:, [0, 1, 3]] - np.delete(m, 2, axis=0)[:, 3]) @ inverse.T
        for array in (positions, positions.astype(np.float32)):
            points = hizvk.Points(array)
            hiz = device.pyramid(image, camera, kind="z")
            truth = hizvk.reference.classify(points, camera, image, kind="z")
            for guard in (0.0, None):
                mask = device.cull(
                    device.instances(points), camera, hiz, guard_px=guard, depth_slack=0.0
                ).mask
                assert not (~mask & (truth == hizvk.reference.VISIBLE)).any()
                assert (~mask).sum() > 100


def test_points_in_checks_and_updates(device: hizvk.Device) -> None:
    points = hizvk.Points(np.array([[0.0, 0, 0], [1, 1, 1]]))
    corner = hizvk.Mesh([[0.0, 0, 0]] * 3, [[0, 1, 2]])
    assert hizvk.check_bounds(points, [corner, corner]).contained.tolist() == [True, False]
    cloud = device.instances(points)
    cloud.update(1, hizvk.Points(np.array([[0.5, 0.25, 2.0]])))
    with pytest.raises(ValueError, match="round them to float32, or upload all of them again"):
        cloud.update(1, hizvk.Points(np.array([[0.1, 0.25, 2.0]])))
    with pytest.raises(TypeError, match="expected points as the instances are, got Spheres"):
        cloud.update(1, hizvk.Spheres(np.zeros((1, 3)), 1.0))
    assert cloud.invalid.tolist() == []
    cloud.update(0, hizvk.Points(np.array([[np.nan, 0.0, 0.0]])))
    assert cloud.invalid.tolist() == [0]


# -- tolerance ------------------------------------------------------------------------------------

SOME = hizvk.Tolerance(rel=0.01, abs=0.02)


def cameras(reversed_z: bool) -> list[hizvk.Camera]:
    ortho = hizvk.Camera.orthographic(
        EYE, (0, 0, 0), height=2.0, width=3.0, near=0.1, far=50.0, size=SIZE, reversed_z=reversed_z
    )
    return [view(reversed_z=reversed_z), ortho]


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("kind", ["z", "distance", "own"])
def test_a_tolerance_moves_depth_away_from_the_eye(
    device: hizvk.Device, reversed_z: bool, kind: Any
) -> None:
    z = np.random.default_rng(5).uniform(0.2, 40.0, SIZE)
    for camera in cameras(reversed_z):
        given, moved = z, z * 1.01 + 0.02
        if kind == "own":
            # NDC depth is moved along the view: there and back by the oracle of this library's
            # conversion, which has tests of its own.
            own = camera.depth_kind
            given = device.pyramid(z, camera, kind="z").level(0).astype(np.float64)
            got = device.pyramid(given, camera, kind=own, tolerance=SOME).level(0)
            expected = device.pyramid(moved, camera, kind="z").level(0)
        else:
            got = device.pyramid(given, camera, kind=kind, tolerance=SOME).level(0)
            expected = device.pyramid(moved, camera, kind=kind).level(0)
        sign = -1.0 if reversed_z else 1.0
        farther = (got.astype(np.float64) - expected) * sign
        least = 0.0 if kind == "own" else -(2.0**-24)
        assert farther.min() >= least, farther.min()
        assert farther.max() < 2.0**-21, farther.max()


def test_what_is_no_depth_stays_no_depth(device: hizvk.Device) -> None:
    large = hizvk.Tolerance(rel=0.5, abs=3.0)
    for reversed_z in (False, True):
        for camera in cameras(reversed_z):
            far = 0.0 if reversed_z else 1.0
            for kind, bad in (
                ("z", [np.nan, np.inf, 0.0, -1.0, 7.0, 0.05]),
                ("distance", [np.nan, np.inf, 0.0, -1.0, 7.0, 0.05]),
                (camera.depth_kind, [np.nan, np.inf, far, 1.5, -0.5]),
            ):
                image = np.resize(np.array(bad), SIZE)
                words: dict[str, Any] = {"kind": kind, "invalid": (7.0,), "tolerance": large}
                assert (device.pyramid(image, camera, **words).level(0) == far).all(), kind
                # Sixteen bits of a sensor, and samples.
                words |= {"tolerance": SOME}
                samples = np.repeat(image[..., None], 4, axis=2)
                assert (device.pyramid(samples, camera, **words).level(0) == far).all(), kind


def test_a_tolerance_goes_with_sensors_updates_and_single_calls(device: hizvk.Device) -> None:
    camera = view()
    millimetres = np.full(SIZE, 2000, np.uint16)
    millimetres[:, 80:] = 0
    words: dict[str, Any] = {"kind": "z", "scale": 0.001, "tolerance": SOME}
    hiz = device.pyramid(millimetres, camera, **words)
    expected = device.pyramid(np.where(millimetres, 2.04, np.nan), camera, kind="z").level(0)
    assert np.abs(hiz.level(0) - expected).max() < 2.0**-22
    hiz.update(3, 5, np.full((4, 6), 3000, np.uint16))
    assert (
        np.abs(
            hiz.level(0)[3:7, 5:11]
            - device.pyramid(np.full(SIZE, 3.05), camera, kind="z").level(0)[0, 0]
        ).max()
        < 2.0**-22
    )
    axis = np.array([-0.1, -0.2, -3.0]) / np.linalg.norm([0.1, 0.2, 3.0])
    points = hizvk.Points(np.array(EYE) + np.outer([2.0, 2.03, 2.05, 2.2], axis))
    told = hizvk.visible(
        points, camera, depth=np.full(SIZE, 2.0), kind="z", tolerance=SOME, device=device
    )
    assert told.tolist() == [True, True, False, False]
    assert hizvk.visible(
        points, camera, depth=np.full(SIZE, 2.0), kind="z", device=device
    ).tolist() == [True, False, False, False]
    rendered = device.render_depth(device.occluders(*bumpy(12)), camera)
    with pytest.raises(TypeError, match=r"pass depth.numpy\(\), depth.camera and kind=depth.kind"):
        device.pyramid(rendered, tolerance=SOME)  # type: ignore[call-overload]


# -- projection and gather ------------------------------------------------------------------------


def test_projection_by_the_pinhole_formula() -> None:
    rng = np.random.default_rng(6)
    k = np.array([[100.0, 0.0, 31.0], [0.0, 120.0, 20.0], [0.0, 0.0, 1.0]])
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    eye = np.array([1e6, -2e6, 500.0])
    for reversed_z in (False, True):
        for far in (None, 30.0):
            camera = hizvk.Camera.from_opencv(
                k, pixel_center="integer", camera_from_world=(turn, -turn @ eye),
                size=(48, 64), near=0.5, far=far, reversed_z=reversed_z,
            )  # fmt: skip
            xyz = eye + rng.normal(size=(2500, 3)) * 8.0
            seen = camera.project(xyz)
            inside = 0
            for i, position in enumerate(xyz):
                x, y, z = turn @ (position - eye)
                assert abs(seen.z[i] - z) < 1e-6
                if z <= 0.0:
                    assert np.isnan(seen.pixels[i]).all()
                    assert np.isnan(seen.depth[i])
                    assert not seen.inside[i]
                    continue
                # OpenCV's first centre is (0, 0), which is (0.5, 0.5) here.
                column, row = 100.0 * x / z + 31.5, 120.0 * y / z + 20.5
                assert np.allclose(seen.pixels[i], (column, row), rtol=1e-5, atol=1e-4)
                near_far = 0.5 / z if far is None else 0.5 * (far - z) / (z * (far - 0.5))
                depth = near_far if reversed_z else 1.0 - near_far
                assert abs(seen.depth[i] - depth) < 1e-6 * max(1.0, abs(depth))
                is_inside = 0 <= column < 64 and 0 <= row < 48 and z >= 0.5
                is_inside &= far is None or z <= far
                assert seen.inside[i] == is_inside
                inside += is_inside
            assert inside > 30
            assert len(seen.rounded()) == inside
            at = np.floor(seen.pixels[seen.inside]).astype(int)
            assert (seen.rounded() == at).all()


def test_projection_of_parallel_rays() -> None:
    for reversed_z in (False, True):
        camera = hizvk.Camera.orthographic(
            (0, 0, 5), (0, 0, 0), height=2.0, width=4.0, near=1.0, far=9.0, size=(10, 40),
            reversed_z=reversed_z,
        )  # fmt: skip
        seen = camera.project([[-2.0, 1.0, 2.0], [1.0, 0.0, 0.0], [0.0, 0.0, 4.5]])
        assert np.allclose(seen.pixels, [[0.0, 0.0], [30.0, 5.0], [20.0, 5.0]])
        assert np.allclose(seen.z, [3.0, 5.0, 0.5])
        share = np.array([0.25, 0.5, -0.0625])
        assert np.allclose(seen.depth, 1.0 - share if reversed_z else share)
        assert seen.inside.tolist() == [True, True, False]
    bare = hizvk.Camera.from_matrices(np.eye(4), size=(4, 4), reversed_z=False)
    assert np.isnan(bare.project([[0.0, 0.0, 0.5]]).z).all()
    lost = bare.project([[np.nan, 0.0, 0.0], [0.0, np.inf, 0.0]])
    assert np.isnan(lost.pixels).all()
    assert not lost.inside.any()


def between(image: Any, x: float, y: float) -> Any:
    """The bilinear mean, corner by corner."""
    height, width = image.shape[:2]
    total = 0.0
    for column in (int(np.floor(x - 0.5)), int(np.floor(x - 0.5)) + 1):
        for row in (int(np.floor(y - 0.5)), int(np.floor(y - 0.5)) + 1):
            share = (1 - abs(x - 0.5 - column)) * (1 - abs(y - 0.5 - row))
            pixel = image[min(max(row, 0), height - 1), min(max(column, 0), width - 1)]
            total = total + share * pixel.astype(np.float64)
    return total


def test_gather_pixel_by_pixel() -> None:
    rng = np.random.default_rng(7)
    for shape, dtype in (((7, 9), np.uint16), ((7, 9, 3), np.uint8), ((1, 1, 2), np.float32)):
        image = (rng.random(shape) * 200).astype(dtype)
        places = rng.uniform(-1, 10, (400, 2))
        places[:3] = [[np.nan, 1.0], [0.0, 0.0], [shape[1], 1.0]]
        nearest = hizvk.gather(image, places)
        bilinear = hizvk.gather(image, places, sampling="bilinear")
        assert nearest.dtype == dtype
        for (x, y), one, other in zip(places, nearest, bilinear, strict=True):
            if 0 <= x < shape[1] and 0 <= y < shape[0]:
                assert (one == image[int(y), int(x)]).all()
                assert np.allclose(other, between(image, x, y))
            else:
                assert (one == 0).all()
                assert (other == 0).all()


# -- colours and depth of points ------------------------------------------------------------------


@pytest.mark.parametrize("sampling", ["nearest", "bilinear"])
@pytest.mark.parametrize("weight", ["equal", "near"])
def test_colours_of_many_views(
    device: hizvk.Device, mesh: tuple[Floats, Any, Any], sampling: Any, weight: Any
) -> None:
    vertices, triangles, _ = mesh
    walls = device.occluders(vertices, triangles)
    rng = np.random.default_rng(8)
    views: list[tuple[hizvk.Camera, Any, Any]] = []
    for k, eye in enumerate([EYE, (3.0, 0.1, 0.2), (-2.0, 2.0, 2.0)]):
        camera = hizvk.Camera.look_at(eye, (0, 0, 0), fov_y_deg=50, size=(60, 90), near=0.1)
        if k == 1:  # the factor of a matrix means nothing
            matrix = 1e-3 * camera.clip_from_world
            camera = hizvk.Camera.from_matrices(matrix, size=(60, 90), reversed_z=True)
        image = rng.integers(0, 255, (60, 90, 3)).astype(np.uint8 if k else np.float32)
        views.append((camera, device.render_depth(walls, camera), image))
    told: list[Any] = []
    points = hizvk.Points(vertices)
    got = hizvk.colour_points(
        points, views, sampling=sampling, weight=weight, device=device,
        progress=lambda done, total: told.append((done, total)),
    )  # fmt: skip
    assert told == [(1, 3), (2, 3), (3, 3)]
    sums, weights = np.zeros((len(vertices), 3)), np.zeros(len(vertices))
    counts = np.zeros(len(vertices), int)
    for camera, depth, image in views:
        mask = device.cull(device.instances(points), camera, device.pyramid(depth)).mask
        seen = camera.project(vertices)
        for i in np.flatnonzero(mask & seen.inside):
            x, y = seen.pixels[i]
            pixel = between(image, x, y) if sampling == "bilinear" else image[int(y), int(x)]
            share = 1.0 if weight == "equal" else seen.z[i] ** -2.0
            sums[i] += share * pixel.astype(np.float64)
            weights[i] += share
            counts[i] += 1
    assert (got.counts == counts).all()
    assert 0 < (counts == 0).sum() < len(counts) / 2
    known = counts > 0
    assert np.allclose(got.colours[known], sums[known] / weights[known, None], atol=1e-2)
    assert (got.colours[~known] == 0).all()
    assert np.allclose(got.weights[known], weights[known], rtol=1e-4)
    assert (got.bytes() == np.clip(np.rint(got.colours), 0, 255)).all()


def test_views_may_come_from_a_generator(
    device: hizvk.Device, capsys: pytest.CaptureFixture[str]
) -> None:
    camera = view((6, 8))
    grey = np.full((6, 8, 3), 77, np.uint8)
    points = hizvk.Points(np.array([[0.0, 0.0, 0.0], [np.nan, 0.0, 0.0]]))
    some = ((camera, np.full((6, 8), 2.0 + k), grey) for k in range(3))
    seen = hizvk.colour_points(points, some, kind="z", device=device, progress=True)
    # The point is some 3.007 away, so only the last image has nothing before it.
    assert seen.counts.tolist() == [1, 0]
    assert seen.bytes()[0].tolist() == [77] * 3
    assert "colouring points" in capsys.readouterr().err
    none = hizvk.colour_points(points, [], device=device)
    assert none.counts.tolist() == [0, 0]
    assert none.colours.shape == (2, 3)


def test_depth_from_points_disc_by_disc() -> None:
    rng = np.random.default_rng(9)
    for camera in [*cameras(False), *cameras(True)]:
        positions = rng.uniform(-1.4, 1.4, (300, 3))
        positions[0] = np.nan
        radius, least = 0.05, 1.2
        got = hizvk.depth_from_points(
            hizvk.Points(positions), camera, radius=radius, radius_px=least
        )
        seen = camera.project(positions)
        height, width = SIZE
        ortho = not camera.clip_from_world[3, :3].any()
        far = 0.0 if camera.reversed_z else 1.0
        expected = np.full(SIZE, far)
        centres = np.stack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5), -1)
        for i in range(len(positions)):
            if not 0.0 <= seen.depth[i] <= 1.0:
                continue
            per_unit = (
                np.array([width / 3.0, height / 2.0])
                if ortho
                else np.full(2, height / 2.0 / np.tan(np.radians(30.0))) / seen.z[i]
            )
            reach = np.maximum(least, radius * per_unit)
            off = np.abs(centres - seen.pixels[i])
            share = np.where(off <= 0.5, 0.0, off / reach)
            covered = (share**2).sum(axis=-1) <= 1.0
            nearer = seen.depth[i] > expected if camera.reversed_z else seen.depth[i] < expected
            expected = np.where(covered & nearer, seen.depth[i], expected)
        assert (np.abs(got - expected) < 2.0**-22).mean() > 0.9995
        sign = -1.0 if camera.reversed_z else 1.0
        same = np.abs(got - expected) < 2.0**-22
        assert ((got - expected)[same] * sign >= -(2.0**-50)).all(), "rounded towards far"


def test_discs_that_are_larger_than_the_image() -> None:
    """A radius in the wrong unit: one after the other these discs would take minutes."""
    camera = view().resized((720, 1280))
    positions = np.random.default_rng(4).uniform(-1.0, 1.0, (20_000, 3))
    image = hizvk.depth_from_points(hizvk.Points(positions), camera, radius=1e6)
    depth = camera.project(positions).depth
    depth = depth[(depth >= 0.0) & (depth <= 1.0)]
    nearest = depth.max() if camera.reversed_z else depth.min()
    np.testing.assert_allclose(image, nearest, rtol=1e-6)


def test_a_cloud_hides_its_own_back(device: hizvk.Device) -> None:
    """Depth from the points themselves, which costs the promise what its documentation says.

    The discs hide what they reach beyond: valleys and the rim, which are seen at a slant.
    """
    vertices, triangles = bumpy(100)
    camera = view()
    points = hizvk.Points(vertices)
    image = hizvk.depth_from_points(points, camera, radius=0.04)
    some = np.arange(0, len(vertices), 9)
    seen = seen_by_rays(vertices, triangles, EYE, some)
    lost, kept = {}, {}
    for tolerance in (0.0, 0.04, 0.16):
        mask = hizvk.visible(
            points, camera, depth=image, kind=camera.depth_kind, device=device,
            tolerance=hizvk.Tolerance(abs=tolerance),
        )[some]  # fmt: skip
        lost[tolerance], kept[tolerance] = int((seen & ~mask).sum()), int((~seen & mask).sum())
    print(f"of {seen.sum()} visible lost: {lost}; of {(~seen).sum()} hidden kept: {kept}")
    assert lost[0.16] <= 0.15 * seen.sum() < lost[0.0]
    assert kept[0.16] <= 0.35 * (~seen).sum()


# -- three answers --------------------------------------------------------------------------------


def test_points_get_three_answers(device: hizvk.Device) -> None:
    """Outside, hidden, surely visible; and undecided where pixels disagree or depth is equal."""
    for reversed_z in (False, True):
        for camera in cameras(reversed_z):
            image = np.full(SIZE, 4.0)
            image[:, 80:] = 8.0
            hiz = device.pyramid(image, camera, kind="z", depths="both")
            # At the pixel's own view depth, in columns 40 and 120, and on the step between.
            at = [(40.2, 60.4, z) for z in (3.9, 4.0, 4.1)]
            at += [(120.2, 60.4, z) for z in (7.9, 8.1)]
            at += [(80.0, 60.4, z) for z in (3.9, 6.0, 8.1)]
            at += [(40.2, -3.0, 3.9)]
            expected = "ZVOZOZVOX"
            positions = placed(camera, at)
            assert np.allclose(camera.project(positions).pixels, np.array(at)[:, :2])
            for array in (positions, positions.astype(np.float32)):
                seen = device.cull(device.instances(hizvk.Points(array)), camera, hiz)
                letters = {"UNOCCLUDED": "Z", "VISIBLE": "V", "OCCLUDED": "O", "OUTSIDE": "X"}
                told = "".join(letters[hizvk.Verdict(code).name] for code in seen.verdicts)
                if array.dtype == np.float32:  # equal depth is no longer equal
                    told, expected = told[:1] + told[2:], expected[:1] + expected[2:]
                assert told == expected, camera
                truth = hizvk.reference.unoccluded(hizvk.Points(array), camera, image, kind="z")
                found = hizvk.compare_unoccluded(seen.verdicts, truth)
                assert len(found.false_claims) == 0, found


def placed(camera: hizvk.Camera, at: Any) -> Floats:
    """World positions at some columns, rows and view depths of a camera of `cameras`."""
    at = np.array(at, np.float64)
    forward = -np.array(EYE) / np.linalg.norm(EYE)
    right = np.cross(forward, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    ndc = np.stack([at[:, 0] / SIZE[1] * 2.0 - 1.0, 1.0 - at[:, 1] / SIZE[0] * 2.0], 1)
    z = at[:, 2:]
    if camera.clip_from_world[3, :3].any():
        half = np.tan(np.radians(30.0))
        aside = ndc * z * np.array([half * SIZE[1] / SIZE[0], half])
    else:
        aside = ndc * np.array([1.5, 1.0])
    result: Floats = np.array(EYE) + aside[:, :1] * right + aside[:, 1:] * up + z * forward
    return result


def test_a_tolerance_works_both_ways_for_what_surely_shows(device: hizvk.Device) -> None:
    camera = view()
    some = hizvk.Tolerance(abs=0.001)
    hiz = device.pyramid(np.full(SIZE, 4.0), camera, kind="z", depths="both", tolerance=some)
    points = hizvk.Points(placed(camera, [(40.2, 60.4, z) for z in (3.0, 3.9995, 4.0005, 4.01)]))
    told = device.cull(device.instances(points), camera, hiz).verdicts
    names = [hizvk.Verdict(code).name for code in told]
    assert names == ["UNOCCLUDED", "VISIBLE", "VISIBLE", "OCCLUDED"]


def test_colours_come_from_the_device_of_the_depth_image(device: hizvk.Device) -> None:
    """A drawn image belongs to a device, and nobody has to name it again."""
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(48, 64), near=0.1)
    wall = device.occluders([(-9, -9, -5), (9, -9, -5), (0, 9, -5)], [[0, 1, 2]])
    depth = device.render_depth(wall, camera)
    points = hizvk.Points([(0.0, 0.0, -4.0), (0.0, 0.0, -6.0)])
    white = np.full((48, 64, 3), 255, np.uint8)
    seen = hizvk.colour_points(points, [(camera, depth, white)])
    assert seen.counts.tolist() == [1, 0]
