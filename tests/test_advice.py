"""What the library advises: depth for a mesh's own vertices, and the picks of `recommend`.

What is visible is found by hand, or by rays at every triangle (Moller and Trumbore 1997), which are
implemented here again.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hizvk
from hizvk.measuring.configuration import Configuration, DepthVariant
from hizvk.measuring.spread import spread
from hizvk.recommendation import Candidate, choose, entry, timing
from hizvk.recommendation.blockers import Blockers, points_of
from hizvk.recommendation.tried import promised

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    Mask = npt.NDArray[np.bool_]

EYE = np.array([4.0, -5.0, 3.0])
GUIDE = Path(__file__).parents[1] / "docs" / "guide.md"


def grid(rows: int, columns: int, *, wraps: bool) -> np.ndarray:
    """Triangles of a grid of vertices; its sides meet if it wraps."""
    number = np.arange(rows * columns).reshape(rows, columns)
    if wraps:
        number = np.pad(number, ((0, 1), (0, 1)), mode="wrap")
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    corners = np.stack([a, b, c, a, c, d], axis=-1)
    return corners.reshape(-1, 3)


def torus(rows: int = 48, columns: int = 24) -> tuple[np.ndarray, np.ndarray]:
    u, v = np.meshgrid(np.arange(rows) / rows, np.arange(columns) / columns, indexing="ij")
    u, v = 2.0 * np.pi * u, 2.0 * np.pi * v
    wide = 2.0 + 0.8 * np.cos(v)
    vertices = np.stack([wide * np.cos(u), wide * np.sin(u), 0.8 * np.sin(v)], axis=-1).reshape(
        -1, 3
    )
    return vertices, grid(rows, columns, wraps=True)


def hills(side: int = 36) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.meshgrid(np.linspace(-3.0, 3.0, side), np.linspace(-3.0, 3.0, side), indexing="ij")
    z = 0.5 * np.sin(2.0 * x) * np.cos(1.7 * y)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), grid(side, side, wraps=False)


def ball(rows: int = 32, columns: int = 40) -> tuple[np.ndarray, np.ndarray]:
    polar, turn = np.meshgrid(
        np.linspace(0.05, np.pi - 0.05, rows), np.arange(columns) / columns, indexing="ij"
    )
    turn = 2.0 * np.pi * turn
    vertices = 2.0 * np.stack(
        [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1
    )
    number = np.pad(np.arange(rows * columns).reshape(rows, columns), ((0, 0), (0, 1)), mode="wrap")
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    return vertices.reshape(-1, 3), np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


MESHES = {"torus": torus, "ball": ball, "hills": hills}


def looking_at(size: tuple[int, int], **more: Any) -> hizvk.Camera:
    return hizvk.Camera.look_at(
        EYE, (0, 0, 0), up=(0, 0, 1), fov_y_deg=50, size=size, near=0.1, **more
    )


def seen_from(
    start: np.ndarray, points: np.ndarray, vertices: np.ndarray, triangles: np.ndarray
) -> Mask:
    """Whether nothing blocks the way from `start` to each point, except what touches the point."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    free = np.ones(len(points), dtype=bool)
    for number, (point, begin) in enumerate(
        zip(points, np.broadcast_to(start, points.shape), strict=True)
    ):
        ray = point - begin
        across = np.cross(ray, c - a)
        scale = ((b - a) * across).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = ((begin - a) * across).sum(axis=1) / scale
            other = np.cross(begin - a, b - a)
            v = other @ ray / scale
            t = ((c - a) * other).sum(axis=1) / scale
        free[number] = not (
            (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9) & (t > 0.0) & (t < 1.0 - 1e-9)
        ).any()
    return free


def in_view(camera: hizvk.Camera, points: np.ndarray) -> Mask:
    clip = np.c_[points, np.ones(len(points))] @ camera.clip_from_world.T
    ndc = clip[:, :3] / clip[:, 3:]
    return (np.abs(ndc - np.array([0.0, 0.0, 0.5])) <= (1.0, 1.0, 0.5)).all(axis=1) & (
        clip[:, 3] > 0.0
    )


# -- points that lie on their own occluder ---------------------------------------------------------


@pytest.mark.parametrize("name", MESHES)
def test_plain_depth_hides_a_mesh_s_own_vertices_and_conservative_depth_none(
    device: hizvk.Device, name: str
) -> None:
    """Prints the figures of docs/guide.md, "Points and vertices"."""
    vertices, triangles = MESHES[name]()
    camera = looking_at((360, 480))
    visible = in_view(camera, vertices) & seen_from(EYE, vertices, vertices, triangles)
    points, mesh = (
        device.instances(hizvk.Spheres(vertices, 0.0)),
        device.occluders(vertices, triangles),
    )

    def lost(guard_px: float, **options: Any) -> int:
        depth = device.render_depth(mesh, camera, **options)
        mask = device.cull(points, depth.camera, device.pyramid(depth), guard_px=guard_px).mask
        return int((visible & ~mask).sum())

    plain, guarded = lost(0.0), lost(0.5)
    proven = [lost(0.0, conservative=True, size=size) for size in (None, (180, 240), (37, 41))]
    print(
        f"{name}: {len(vertices)} vertices, {visible.sum()} visible; culled by plain depth {plain} "
        f"({100 * plain / visible.sum():.0f} %), with guard_px=0.5 {guarded}, "
        f"by conservative depth {proven[0]}"
    )
    assert proven == [0, 0, 0]
    row = f"| {name} | {len(vertices):,} | {visible.sum()} | "
    (written,) = (line for line in GUIDE.read_text().splitlines() if line.startswith(row))
    # Another driver's depth differs in the last bits.
    assert int(written.removeprefix(row).split()[0]) == pytest.approx(plain, rel=0.05)
    assert plain > 0.2 * visible.sum()


# -- check -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "kind", ["perspective", "standard", "orthographic", "orthographic, standard"]
)
@pytest.mark.parametrize("faces", ["none", "back", "front"])
def test_clear_rays_are_those_of_every_triangle(kind: str, faces: str) -> None:
    vertices, triangles = torus(24, 14)
    # Some beside the surface, and some out of view.
    points = np.concatenate(
        [
            vertices,
            vertices * 1.05,
            vertices * (1.0, 1.0, 0.5),
            vertices + np.array([9.0, 0.0, 0.0]),
        ]
    )
    if kind.startswith("orthographic"):
        camera = hizvk.Camera.orthographic(
            EYE,
            (0, 0, 0),
            up=(0, 0, 1),
            height=6.5,
            width=9.0,
            size=(60, 80),
            near=0.1,
            far=30,
            reversed_z="standard" not in kind,
        )
        forward = -EYE / np.linalg.norm(EYE)
        start = points - ((points - EYE) @ forward)[:, None] * forward
    else:
        camera = looking_at((60, 80), reversed_z=kind != "standard", far=1e4)
        start = np.broadcast_to(EYE, points.shape)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    along = np.broadcast_to(-EYE, a.shape) if kind.startswith("orthographic") else a - EYE
    front = (np.cross(b - a, c - a) * along).sum(axis=1) < 0.0
    drawn = triangles[{"none": front | ~front, "back": front, "front": ~front}[faces]]
    inside = in_view(camera, points)
    expected = inside & seen_from(start, points, vertices, drawn)
    found = Blockers(vertices, triangles.astype(np.uint32), faces, camera).clear(points)
    assert 100 < expected.sum() < inside.sum() < len(points)
    np.testing.assert_array_equal(found, expected)


def test_clear_rays_know_triangles_that_cross_the_eye_s_plane() -> None:
    """A floor one unit below the eye hides; a wall before the near plane hides nothing."""
    floor = np.array([[-50.0, -1.0, 50.0], [50.0, -1.0, 50.0], [0.0, -1.0, -500.0]])
    near = np.array([[-9.0, -9.0, -0.05], [9.0, -9.0, -0.05], [0.0, 9.0, -0.05]])
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(8, 8), near=0.1)
    points = np.array(
        [[0.0, -2.0, -4.0], [0.0, -0.9, -4.0], [0.0, -1.0, -4.0], [0.0, 1.0, -4.0], [0.0, 0.0, 4.0]]
    )
    triangles = np.array([[0, 1, 2], [3, 4, 5]], np.uint32)
    clear = Blockers(np.concatenate([floor, near]), triangles, "none", camera).clear(points)
    assert clear.tolist() == [False, True, True, True, False]


@pytest.mark.parametrize("faces", ["none", "back", "front"])
def test_the_triangles_on_the_host_are_those_that_were_given(
    device: hizvk.Device, faces: str
) -> None:
    """By hand: a mesh in two places, one of them mirrored, and another mesh."""
    vertices = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    moved, mirrored = np.eye(4), np.diag([-1.0, 1.0, 1.0, 1.0])
    moved[:3, 3] = (1e6, 0.5, 0.0)
    meshes = [
        hizvk.Mesh(vertices, [[0, 1, 2]], np.stack([moved, mirrored])),
        hizvk.Mesh(2.0 * vertices, [[2, 1, 0]]),
    ]
    positions, triangles, told = device.occluders(meshes, cull=faces)._inner.surface()
    expected = [vertices + moved[:3, 3], vertices * (-1.0, 1.0, 1.0), 2.0 * vertices]
    assert positions.reshape(-1, 3).tolist() == np.concatenate(expected).tolist()
    assert triangles.reshape(-1, 3).tolist() == [[0, 1, 2], [3, 5, 4], [8, 7, 6]]
    assert told == faces


def test_points_of_bounds_lie_in_them() -> None:
    rng = np.random.default_rng(1)
    centers, which, camera = rng.normal(size=(50, 3)), np.arange(7, 40), looking_at((60, 80))
    spheres = hizvk.Spheres(centers, rng.uniform(0.1, 0.5, 50))
    away = np.linalg.norm(points_of(spheres, which, camera) - centers[which, None], axis=2)
    assert (away <= np.asarray(spheres.radii)[which, None]).all()
    assert ((away > 0.999 * np.asarray(spheres.radii)[which, None]).sum(axis=1) == 18).all()
    boxes = hizvk.Boxes(centers, centers + rng.uniform(0.1, 0.5, (50, 3)))
    points = points_of(boxes, which, camera)
    assert ((points >= boxes.min[which, None]) & (points <= boxes.max[which, None])).all()
    assert (points.min(axis=1) == boxes.min[which]).all()
    assert (points.max(axis=1) == boxes.max[which]).all()
    turn = np.linalg.qr(rng.normal(size=(50, 3, 3)))[0]
    oriented = hizvk.OrientedBoxes(centers, np.full((50, 3), 0.3), turn)
    local = np.einsum(
        "nji,nkj->nki", turn[which], points_of(oriented, which, camera) - centers[which, None]
    )
    assert np.abs(local).max() == pytest.approx(0.3)
    assert (
        points_of(hizvk.Spheres(centers, 0.0), which, camera).tolist()
        == centers[which, None].tolist()
    )


# -- what is recommended ---------------------------------------------------------------------------


def test_best_for_points_on_their_own_mesh_is_conservative_and_loses_none(
    device: hizvk.Device,
) -> None:
    vertices, triangles = torus(64, 40)
    camera = looking_at((360, 480))
    visible = in_view(camera, vertices) & seen_from(EYE, vertices, vertices, triangles)
    points = hizvk.Spheres(vertices, 0.0)
    found = hizvk.recommend(
        points, camera, occluders=hizvk.Mesh(vertices, triangles), device=device, repetitions=1
    )
    print(found)
    assert found.best.configuration.promises_rays
    assert found.best.volume in ("spheres", "points")
    assert len(found.best.bounds) == len(points)  # type: ignore[arg-type]
    assert found.best.hides == found.best.unclear == 0
    tried = [one.configuration for one in found.candidates]
    assert Configuration("spheres", depth=DepthVariant(1, True)) in tried
    assert Configuration("spheres", depth=DepthVariant(1, True, levels=2)) in tried
    assert Configuration("spheres", coverage="sample") in tried
    # What it says of each is what rays at every triangle say, and the whole call is the one that
    # was checked.
    crowds = {
        "spheres": device.instances(points),
        "points": device.instances(hizvk.Points(vertices)),
    }
    assert {one.volume for one in found.candidates} == set(crowds)
    walls = device.occluders(vertices, triangles)
    for one in found.candidates:
        mask = one.cull(crowds[one.volume], camera, walls).mask
        assert one.hides == (visible & ~mask).sum(), str(one)
        assert one.unclear == 0
        assert one.kept == mask.sum()
    assert any(one.hides > 0.2 * visible.sum() for one in found.candidates)
    assert all(not one.hides for one in found.front)
    assert "candidates were dropped: they hide up to" in str(found)
    assert "pixels' centres alone" in str(found)
    # A budget that plain depth alone keeps does not bring it back.
    safe = [one for one in found.candidates if one.safe]
    assert choose(found.candidates, max_ms=1e-9) == (
        min(safe, key=lambda one: one.ms.median),
        False,
    )


#: 90 degrees, 8 pixels of one world unit at depth 4.
CAMERA = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(8, 8), near=1.0)


def wall(left: float, right: float, depth: float = 4.0) -> hizvk.Mesh:
    corners = [
        [left, -9.0, -depth],
        [right, -9.0, -depth],
        [right, 9.0, -depth],
        [left, 9.0, -depth],
    ]
    return hizvk.Mesh(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]))


#: A gap between pixel centres.
#: The balls: one behind the gap, whose middle shows; one that the wall hides; one before the wall.
GAP = [wall(-9.0, 0.95), wall(0.99, 9.0)]
MIDDLES = np.array([[0.97 * 5.5 / 4.0, 0.0, -5.5], [-3.5, 0.0, -5.5], [-0.5, 0.0, -2.5]])
BALLS = hizvk.Spheres(MIDDLES, 0.5)


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer candidates of every sort: each needs its own pipeline, and compiling takes the time."""

    def some(*arguments: Any, **more: Any) -> list[Configuration]:
        return [
            one
            for one in promised(*arguments, **more)
            if one.footprint < 8 and one.fit == "rectangle"
        ]

    monkeypatch.setattr(entry, "promised", some)


@pytest.mark.usefixtures("few")
def test_what_shows_between_the_centres_drops_plain_depth(device: hizvk.Device) -> None:
    found = hizvk.recommend(BALLS, CAMERA, occluders=GAP, device=device, repetitions=1)
    for one in found.candidates:
        # By hand: the plain image shows a closed wall, so ball 0 is lost.
        # Through x = 0.97 a ray meets its middle.
        conservative = one.configuration.depth.conservative
        assert (one.hides, one.unclear) == ((0, 0) if conservative or one.kept == 3 else (1, 0)), (
            str(one)
        )
        assert one.safe == (one.asked and not one.hides)
        assert one.proven == conservative
    assert {one.kept for one in found.candidates if one.hides} == {1}
    assert found.best.proven
    assert 'ask with coverage="sample"' in str(found)


@pytest.mark.usefixtures("few")
def test_pixel_centres_alone_are_plain_depth_s(device: hizvk.Device) -> None:
    found = hizvk.recommend(
        BALLS, CAMERA, occluders=GAP, device=device, repetitions=1, coverage="sample"
    )
    assert found.best.configuration.coverage == "sample"
    assert not found.best.configuration.depth.conservative
    assert found.best.kept == 1
    assert all(not one.hides for one in found.candidates), "no centre shows ball 0"
    result = found.best.cull(device.instances(BALLS), CAMERA, device.occluders(GAP))
    assert result.mask.tolist() == [False, False, True]


@pytest.mark.usefixtures("few")
def test_plain_depth_that_culls_what_is_proven_hidden_is_recommended(device: hizvk.Device) -> None:
    """Without the gap all is proven; plain depth is cheaper here, and right before this camera."""
    whole = [wall(-9.0, 0.95), wall(0.95, 9.0)]
    for bounds in (BALLS, device.instances(BALLS)):
        found = hizvk.recommend(bounds, CAMERA, occluders=whole, device=device, repetitions=1)
        assert all(one.safe or not one.asked for one in found.candidates)
        assert {one.kept for one in found.candidates} == {1}
    # Of what is on the device already no ray can be cast: what is not proven is unclear.
    found = hizvk.recommend(
        device.instances(BALLS), CAMERA, occluders=GAP, device=device, repetitions=1
    )
    plain = [one for one in found.candidates if not one.configuration.depth.conservative]
    assert {(one.hides, one.unclear, one.safe) for one in plain} == {(0, 1, False)}
    assert found.best.proven
    assert "1 that are not shown to be hidden" in str(found)


def planted(one: Configuration) -> bool:
    return one.footprint == 4


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize(("coverage", "victim"), [("area", 0), ("area", 2), ("sample", 2)])
def test_a_candidate_that_hides_what_is_visible_is_never_chosen(
    device: hizvk.Device, monkeypatch: pytest.MonkeyPatch, coverage: str, victim: int
) -> None:
    """A planted liar is the fastest, keeps least, and may even be one of those that are proven."""
    honest = timing.cull

    def lying(
        device: hizvk.Device, instances: Any, pyramid: Any, one: Configuration, base: Any
    ) -> tuple[Mask, float, float]:
        mask, *took = honest(device, instances, pyramid, one, base)
        if planted(one):
            mask, took = mask.copy(), [0.0, 0.0]
            mask[victim] = False
        return mask, took[0], took[1]

    monkeypatch.setattr(timing, "cull", lying)
    found = hizvk.recommend(
        BALLS,
        CAMERA,
        occluders=GAP,
        device=device,
        repetitions=1,
        coverage=coverage,
        kept_within=9.0,
    )
    liars = [one for one in found.candidates if planted(one.configuration)]
    assert liars
    assert all(one.hides for one in liars)
    assert not planted(found.best.configuration)
    assert not any(one in found.front for one in liars)


def test_a_smaller_plain_image_is_found_out(
    device: hizvk.Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = Configuration("spheres", depth=DepthVariant(8))
    monkeypatch.setattr(
        entry,
        "promised",
        lambda *_, **__: [small, Configuration("spheres", depth=DepthVariant(1, True))],
    )
    post = wall(-0.4, 0.4)
    found = hizvk.recommend(BALLS, CAMERA, occluders=post, device=device, repetitions=1)
    lie = next(one for one in found.candidates if one.configuration == small)
    assert lie.hides > 0
    assert found.best.configuration != small


def test_choose_refuses_where_nothing_is_safe() -> None:
    ms = spread(np.ones((1, 1)))
    liar = Candidate(Configuration(), ms, ms, 3, False, hides=1)
    unclear = Candidate(Configuration(), ms, ms, 3, False, unclear=1)
    beside = Candidate(Configuration(), ms, ms, 3, False, asked=False)
    with pytest.raises(ValueError, match="candidates: expected one that hides nothing"):
        choose([liar, unclear, beside])
    honest = Candidate(Configuration(), spread(np.full((1, 1), 9.0)), ms, 300, False)
    assert choose([liar, unclear, beside, honest]) == (honest, True)
    assert choose([liar, honest], max_ms=2.0) == (honest, False)


@pytest.mark.usefixtures("few")
def test_points_before_a_depth_image_get_a_guard(device: hizvk.Device) -> None:
    vertices, triangles = hills(24)
    camera = looking_at((180, 240))
    visible = in_view(camera, vertices) & seen_from(EYE, vertices, vertices, triangles)
    image = device.render_depth(device.occluders(vertices, triangles), camera).numpy()
    points = hizvk.Spheres(vertices, 0.0)
    found = hizvk.recommend(
        points, camera, depths=[image], kind="reversed_ndc", device=device, repetitions=1
    )
    assert found.best.configuration.guard_px == 0.5
    assert found.best.cull_options["guard_px"] == 0.5
    assert "good guess for points before an image, and no proof" in str(found)
    uploaded = hizvk.recommend(
        device.instances(points),
        camera,
        depths=[image],
        kind="reversed_ndc",
        device=device,
        repetitions=1,
    )
    assert uploaded.best.configuration.guard_px == 0.5
    bare = [one for one in found.candidates if one.configuration.guard_px is None]
    assert all(one.hides > 0.2 * visible.sum() for one in bare)
    # Bare bounds may be recommended as Points; those on a device stay what they are.
    seen = uploaded.best.cull(device.instances(points), camera, depth=image, kind="reversed_ndc")
    print(
        f"with the guard {int((visible & ~seen.mask).sum())} of {visible.sum()} visible ones "
        "are culled"
    )
    assert (visible & ~seen.mask).sum() < 0.05 * visible.sum()
    # Volumes promise for the image as it is, and the oracle agrees.
    found = hizvk.recommend(
        hizvk.Spheres(vertices, 0.05),
        camera,
        depths=[image],
        kind="reversed_ndc",
        device=device,
        repetitions=1,
    )
    assert all(one.safe for one in found.candidates)
    assert {one.configuration.guard_px for one in found.candidates} == {None}


def test_candidate_makes_the_whole_call(device: hizvk.Device) -> None:
    ms = spread(np.ones((1, 1)))
    one = Configuration("spheres", descent=64, depth=DepthVariant(2, True, levels=(1, 2)))
    candidate = Candidate(one, ms, ms, 2, False)
    balls, walls = device.instances(BALLS), device.occluders(GAP)
    options = candidate.render_options(CAMERA.size)
    assert (options, candidate.pyramid_options) == (
        {"size": (4, 4), "conservative": True},
        {"levels": (1, 2)},
    )
    depth = device.render_depth(walls, CAMERA, **options)
    pyramid = device.pyramid(depth, **candidate.pyramid_options)
    by_hand = device.cull(balls, depth.camera, pyramid, **candidate.cull_options)
    assert (
        candidate.cull(balls, CAMERA, walls).mask.tolist()
        == by_hand.mask.tolist()
        == [True, False, True]
    )

    def refused(error: type[Exception], text: str, call: Callable[[], object]) -> None:
        with pytest.raises(error) as caught:
            call()
        assert text in str(caught.value)

    boxes = device.instances(hizvk.Boxes(MIDDLES, MIDDLES))
    plain = Candidate(Configuration("spheres"), ms, ms, 2, False)
    image = device.render_depth(walls, CAMERA)
    refused(
        ValueError,
        "instances: expected spheres, got boxes",
        lambda: candidate.cull(boxes, CAMERA, walls),
    )
    refused(
        TypeError, "expected exactly one of them, got neither", lambda: plain.cull(balls, CAMERA)
    )
    refused(TypeError, "got both", lambda: plain.cull(balls, CAMERA, walls, depth=image))
    refused(
        TypeError, "expected occluders instead", lambda: candidate.cull(balls, CAMERA, depth=image)
    )
    assert plain.cull(balls, CAMERA, depth=image).mask.tolist() == [False, False, True]


def test_a_rasteriser_knows_the_centres_up_to_the_grid_that_it_snaps_to(
    device: hizvk.Device,
) -> None:
    """Prints how far beside a pixel's centre a wall may end and still be drawn (docs/guide.md)."""
    steps = np.arange(1, 513) / 4096.0  # pixels; one is one world unit at depth 4

    def drawn(gap: float, **options: Any) -> bool:
        depth = device.render_depth(
            device.occluders([wall(0.5 + gap, 9.0)]), CAMERA, **options
        ).numpy()
        return bool((depth[:, 4] > 0.0).any())

    last = max((step for step in steps if drawn(step)), default=0.0)
    print(
        f"drawn at a centre that the wall misses by up to {last:g} of a pixel "
        f"(1/{1 / last if last else 0:g})"
    )
    # Vulkan: at least 4 bits below the pixel, so that a corner moves by half a sixteenth; or all of
    # it, cut off.
    assert last < 1.0 / 16.0
    assert drawn(0.0)
    assert not drawn(0.0, conservative=True), "its left part is open"
    assert not drawn(steps[0], conservative=True)


def test_points_are_not_sent_to_sample_coverage(device: hizvk.Device) -> None:
    """It culls every one of them."""
    wall = hizvk.Mesh([[-1.0, -1, -5], [1, -1, -5], [0, 1, -5]], [[0, 1, 2]])
    points = np.random.default_rng(0).uniform((-3, -3, -12), (3, 3, -3), (50, 3))
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(48, 64), near=0.1)
    found = hizvk.recommend(
        hizvk.Spheres(points, 0.0), camera, occluders=wall, device=device, repetitions=1
    )
    assert not any('coverage="sample"' in note for note in found.notes)
