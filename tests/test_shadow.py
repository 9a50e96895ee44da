"""Shadow casters: pictures with and without the culled casters are equal, bit for bit.

Depth, shadow maps and lookups come from the loops of this file, which cast rays at boxes.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hizvk
from hizvk import cli
from hizvk.bench import shadows as bench

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

    Floats = npt.NDArray[np.float64]

SIZE = (45, 80)
#: Texels of a shadow map's side.
MAP = 128


def entries(
    origins: Floats, directions: Floats, low: Floats, high: Floats
) -> tuple[Floats, Floats]:
    """Where rays enter and leave each box, ``(rays, boxes)``; infinite where they miss it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a = (low[None] - origins[:, None]) / directions[:, None]
        b = (high[None] - origins[:, None]) / directions[:, None]
    # A ray within a face's plane meets a box only if it lies between its faces.
    inside = (origins[:, None] >= low[None]) & (origins[:, None] <= high[None])
    flat = np.broadcast_to(directions[:, None] == 0, a.shape)
    first = np.where(flat, np.where(inside, -np.inf, np.inf), np.minimum(a, b)).max(axis=2)
    last = np.where(flat, np.where(inside, np.inf, -np.inf), np.maximum(a, b)).min(axis=2)
    missed = first > last
    return np.where(missed, np.inf, first), np.where(missed, -np.inf, last)


@dataclass(frozen=True)
class Scene:
    """Boxes on a ground plane at y = 0."""

    low: Floats
    high: Floats

    @property
    def receivers(self) -> tuple[Floats, Floats]:
        """A box around all that can receive; the ground reaches 200 beyond the boxes."""
        low, high = self.low.min(axis=0), self.high.max(axis=0)
        return (
            np.array([low[0] - 200, 0.0, low[2] - 200]),
            np.array([high[0] + 200, high[1], high[2] + 200]),
        )


def town(seed: int = 5, side: int = 9, small: int = 300) -> Scene:
    """Houses on a grid with streets between them, and small things that lie about."""
    random = np.random.default_rng(seed)
    step = 14.0
    at = np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2) * step
    count = len(at)
    half = random.uniform((2.5, 3, 2.5), (4, 14, 4), (count, 3))
    middle = np.stack([at[:, 0], half[:, 1], at[:, 1]], 1)
    of_small = random.uniform(0.15, 0.6, (small, 3))
    where = random.uniform((0, 0, 0), (side * step, 2, side * step), (small, 3))
    middle = np.concatenate([middle, where + of_small * (0, 1, 0)])
    half = np.concatenate([half, of_small])
    return Scene(middle - half, middle + half)


VIEWS = {
    "street": ((7, 1.7, 7 + 14 * 4), (120, 1.5, 7 + 14 * 4 + 3), (0.5, -1, 0.3)),
    "air": ((-20, 40, -20), (70, 0, 70), (0.5, -1, 0.3)),
    "square, low sun": ((7 + 14 * 4, 1.7, 7 + 14 * 4), (7 + 14 * 4, 1.7, 300), (1, -0.35, 0.4)),
    "light along an axis": ((-20, 40, -20), (70, 0, 70), (0, -1, 0)),
}


def perspective(eye: Any, target: Any, *, reversed_z: bool = True) -> hizvk.Camera:
    return hizvk.Camera.look_at(
        eye, target, fov_y_deg=60, size=SIZE, near=0.1, reversed_z=reversed_z
    )


def parallel(eye: Any, target: Any, *, reversed_z: bool = True) -> hizvk.Camera:
    return hizvk.Camera.orthographic(
        eye, target, height=60, size=SIZE, near=0.0, far=400.0, reversed_z=reversed_z
    )


def seen(scene: Scene, camera: hizvk.Camera) -> tuple[npt.NDArray[np.float32], Floats]:
    """The NDC depth of the picture, and the point that each pixel shows; NaN for background."""
    height, width = camera.size
    clip = np.asarray(camera.clip_from_world)
    back = np.linalg.inv(clip)
    column, row = np.meshgrid(
        (np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2
    )
    near, far = (1.0, 1e-3) if camera.depth_kind == "reversed_ndc" else (0.0, 0.999)

    def at(depth: float) -> Floats:
        homogeneous = np.stack(
            [column, row, np.full_like(row, depth), np.ones_like(row)], -1
        ).reshape(-1, 4)
        world = homogeneous @ back.T
        return world[:, :3] / world[:, 3:]

    start = at(near)
    along = at(far) - start
    first, last = entries(start, along, scene.low, scene.high)
    hit = np.where(first >= 0, first, np.inf).min(axis=1)
    del last
    with np.errstate(divide="ignore", invalid="ignore"):
        ground = -start[:, 1] / along[:, 1]
    hit = np.minimum(hit, np.where(ground > 0, ground, np.inf))
    points = start + along * np.where(np.isfinite(hit), hit, np.nan)[:, None]
    low, high = scene.receivers
    points[(points < low - 1e-6).any(axis=1) | (points > high + 1e-6).any(axis=1)] = np.nan
    projected = np.concatenate([points, np.ones((len(points), 1))], 1) @ clip.T
    depth = projected[:, 2] / projected[:, 3]
    background = 0.0 if camera.depth_kind == "reversed_ndc" else 1.0
    outside = ~((depth > 0) & (depth < 1))
    points[outside] = np.nan
    depth = np.where(outside, background, depth).astype(np.float32)
    # A depth that float32 rounds to far would be background.
    points[depth == background] = np.nan
    return depth.reshape(SIZE), points


@dataclass(frozen=True)
class ShadowMap:
    """An orthographic shadow map of a direction, with 3x3 filtering and a constant bias."""

    direction: Floats
    right: Floats
    down: Floats
    corner: Floats
    texel: float
    bias: float

    @classmethod
    def around(cls, scene: Scene, direction: Any, bias: float = 0.05) -> ShadowMap:
        towards = np.asarray(direction, float)
        towards /= np.linalg.norm(towards)
        other = np.array([1.0, 0, 0]) if abs(towards[0]) < 0.9 else np.array([0, 1.0, 0])
        right = np.cross(towards, other)
        right /= np.linalg.norm(right)
        down = np.cross(towards, right)
        corners = np.array(
            [
                [(scene.low, scene.high)[k >> axis & 1].T[axis] for axis in range(3)]
                for k in range(8)
            ]
        )
        flat = corners.transpose(0, 2, 1).reshape(-1, 3)
        lateral = np.stack([flat @ right, flat @ down], 1)
        low, high = lateral.min(axis=0) - 1, lateral.max(axis=0) + 1
        return cls(towards, right, down, low, float((high - low).max()) / MAP, bias)

    @property
    def filter_radius(self) -> float:
        """Lookups reach 1.5 texels along each axis, and the bias along the light."""
        return float(np.hypot(1.5 * np.sqrt(2) * self.texel, self.bias)) * (1 + 1e-9)

    def drawn(self, scene: Scene, kept: npt.NDArray[np.bool_]) -> Floats:
        """The nearest kept box along each texel's ray."""
        place = self.corner[0] + (np.arange(MAP) + 0.5) * self.texel
        other = self.corner[1] + (np.arange(MAP) + 0.5) * self.texel
        rows, columns = np.meshgrid(other, place, indexing="ij")
        start = columns.reshape(-1, 1) * self.right + rows.reshape(-1, 1) * self.down
        rays = np.broadcast_to(self.direction, start.shape)
        nearest = np.full(len(start), np.inf)
        low, high = scene.low[kept], scene.high[kept]
        for first in range(0, len(low), 32):
            part = slice(first, first + 32)
            nearest = np.minimum(
                nearest, entries(start, rays, low[part], high[part])[0].min(axis=1, initial=np.inf)
            )
        return nearest.reshape(MAP, MAP)

    def picture(self, image: Floats, points: Floats) -> Floats:
        """The share of the 3x3 texels around each point that shadow it."""
        reference = points @ self.direction - self.bias
        with np.errstate(invalid="ignore"):
            columns = np.floor((points @ self.right - self.corner[0]) / self.texel)
            rows = np.floor((points @ self.down - self.corner[1]) / self.texel)
        shadow = np.zeros(len(points))
        for dy in (-1, 0, 1):
            for dx in (-1, 0, 1):
                x, y = columns + dx, rows + dy
                inside = (x >= 0) & (x < MAP) & (y >= 0) & (y < MAP)
                found = image[
                    np.where(inside, y, 0).astype(int), np.where(inside, x, 0).astype(int)
                ]
                shadow += inside & (found < reference)
        return shadow / 9


def casters_of(device: hizvk.Device, scene: Scene, kind: str = "boxes") -> hizvk.Instances:
    middle, half = (scene.low + scene.high) / 2, (scene.high - scene.low) / 2
    if kind == "spheres":
        return device.instances(hizvk.Spheres(middle, np.linalg.norm(half, axis=1)))
    if kind == "oriented boxes":
        return device.instances(
            hizvk.OrientedBoxes(middle, half, np.broadcast_to(np.eye(3), (len(middle), 3, 3)))
        )
    return device.instances(hizvk.Boxes(scene.low, scene.high))


@pytest.fixture(scope="module")
def scene() -> Scene:
    return town()


@pytest.mark.parametrize("reversed_z", [True, False])
@pytest.mark.parametrize("make", [perspective, parallel])
@pytest.mark.parametrize("name", VIEWS)
def test_a_shadow_mapped_picture_is_equal(
    device: hizvk.Device, scene: Scene, name: str, make: Any, reversed_z: bool
) -> None:
    eye, target, direction = VIEWS[name]
    camera = make(eye, target, reversed_z=reversed_z)
    depth, points = seen(scene, camera)
    shadows = ShadowMap.around(scene, direction)
    light = hizvk.DirectionalLight(
        direction, receivers=scene.receivers, filter_radius=shadows.filter_radius
    )
    pyramid = device.pyramid(depth, camera, kind=camera.depth_kind, depths="receivers")
    whole = shadows.drawn(scene, np.ones(len(scene.low), bool))
    reference = shadows.picture(whole, points)
    assert 0 < np.count_nonzero(reference) < reference.size
    for kind in ("boxes", "spheres", "oriented boxes"):
        kept = device.cull(casters_of(device, scene, kind), camera, pyramid, shadow=light).mask
        picture = shadows.picture(shadows.drawn(scene, kept), points)
        assert np.array_equal(picture, reference), kind
        if kind == "boxes":
            assert kept.mean() < 0.5


def test_soft_shadows_are_equal(device: hizvk.Device, scene: Scene) -> None:
    """Points of the light's rim and middle, each with a shadow ray of its own."""
    eye, target, direction = VIEWS["air"]
    camera = perspective(eye, target)
    depth, points = seen(scene, camera)
    radius = 3.0
    light = hizvk.DirectionalLight(direction, receivers=scene.receivers, angular_radius_deg=radius)
    pyramid = device.pyramid(depth, camera, kind=camera.depth_kind, depths="receivers")
    kept = device.cull(casters_of(device, scene), camera, pyramid, shadow=light).mask
    assert kept.mean() < 0.7
    shadows = ShadowMap.around(scene, direction)
    visible = points[np.isfinite(points[:, 0])][::3]
    for k in range(9):
        angle = k * np.pi / 4
        rim = np.cos(angle) * shadows.right + np.sin(angle) * shadows.down
        ray = shadows.direction + (k < 8) * np.tan(np.radians(radius)) * rim
        # Back along the ray, from a little above the surface.
        first, last = entries(visible, np.broadcast_to(-ray, visible.shape), scene.low, scene.high)
        blocked = (last >= 0) & (first < np.inf)
        assert not blocked[:, ~kept].any(), k


def test_both_halves_of_the_theorem_cull(device: hizvk.Device) -> None:
    """A shadow behind a wall, one in the air before it, one on it, and one in the background."""
    camera = perspective((0, 0, 0), (0, 0, -1))
    depth = np.full(SIZE, 10.0)
    depth[:, 60:] = np.inf
    pyramid = device.pyramid(depth, camera, kind="z", depths="receivers")
    # The light goes down; receivers are below y = -3.
    light = hizvk.DirectionalLight((0, -1, 0), receivers=((-50, -9, -50), (50, -3, 50)))
    middles = [[0, 5, -20], [0, 5, -5], [0, 5, -10], [40, 5, -30], [0, -12, -10]]
    casters = device.instances(hizvk.Spheres(middles, 0.5))
    result = device.cull(casters, camera, pyramid, shadow=light)
    assert result.mask.tolist() == [False, False, True, False, False]
    # The last one lies below all receivers.
    assert result.verdicts[-1] == hizvk.Verdict.OUTSIDE


@pytest.mark.parametrize("guard", [0.0, 0.25])
def test_shadows_between_samples_are_looked_for_beside_them(
    device: hizvk.Device, guard: float
) -> None:
    """Their rectangles hold no pixel centre, and the pixels on both sides show the same wall."""
    camera = perspective((0, 0, 0), (0, 0, -1))
    pyramid = device.pyramid(np.full(SIZE, 10.0), camera, kind="z", depths="receivers")
    light = hizvk.DirectionalLight((0, -1, 0), receivers=((-50, -9, -50), (50, -3, 50)))
    across = np.linspace(-15, 15, 301)
    behind = np.stack([across, np.full(301, 5.0), np.full(301, -20.0)], axis=1)
    on_it = behind * (0.5, 1.0, 0.5)
    for middles, kept in ((behind, 0.0), (on_it, 1.0)):
        casters = device.instances(hizvk.Spheres(middles, 0.001))
        options = hizvk.CullOptions(coverage="sample", guard_px=guard)
        mask = device.cull(casters, camera, pyramid, shadow=light, options=options).mask
        assert mask.mean() == kept


def test_an_invalid_pixel_keeps_what_may_shadow_it(device: hizvk.Device) -> None:
    camera = perspective((0, 0, 0), (0, 0, -1))
    light = hizvk.DirectionalLight((0, -1, 0), receivers=((-50, -9, -50), (50, 9, 50)))
    casters = device.instances(hizvk.Spheres([[0, 5, -5]], 0.5))
    for hole, kept in ((0.0, False), (np.nan, True), (2.0, True)):
        depth = np.full(SIZE, 0.01, np.float32)
        depth[20:25, 38:42] = hole
        pyramid = device.pyramid(depth, camera, kind="reversed_ndc", depths="receivers")
        mask = device.cull(casters, camera, pyramid, shadow=light).mask
        assert mask.tolist() == [kept], hole


def test_a_cull_of_casters_is_refused_what_it_does_not_take(device: hizvk.Device) -> None:
    camera = perspective((0, 0, 0), (0, 0, -1))
    depth = np.full(SIZE, 10.0)
    casters = device.instances(hizvk.Spheres([[0, 5, -5]], 0.5))
    light = hizvk.DirectionalLight((0, -1, 0), receivers=((-50, -9, -50), (50, 9, 50)))
    plain = device.pyramid(depth, camera, kind="z")
    receivers = device.pyramid(depth, camera, kind="z", depths="receivers")
    with pytest.raises(ValueError, match=r'pyramid: .*depths="receivers"'):
        device.cull(casters, camera, plain, shadow=light)
    with pytest.raises(ValueError, match=r'pyramid: .*depths="receivers"'):
        device.cull(casters, camera, receivers)
    with pytest.raises(ValueError, match="fit: expected"):
        device.cull(casters, camera, receivers, shadow=light, fit="volume")
    with pytest.raises(ValueError, match="shadow: expected None"):
        device.cull(casters, camera, receivers, shadow=light).explain(0)


def spot(eye: Any, target: Any, *, reversed_z: bool = True, size: int = MAP) -> hizvk.Camera:
    return hizvk.Camera.look_at(
        eye, target, fov_y_deg=80, size=(size, size), near=0.2, far=300, reversed_z=reversed_z
    )


def spot_map(scene: Scene, light: hizvk.Camera, eye: Floats, kept: npt.NDArray[np.bool_]) -> Floats:
    """The distance along the light's axis of the nearest kept box, per texel."""
    height, width = light.size
    back = np.linalg.inv(np.asarray(light.clip_from_world))
    column, row = np.meshgrid(
        (np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2
    )
    near = 1.0 if light.depth_kind == "reversed_ndc" else 0.0
    world = np.stack([column, row, np.full_like(row, near), np.ones_like(row)], -1) @ back.T
    start = (world[..., :3] / world[..., 3:]).reshape(-1, 3)
    rays = start - eye
    nearest = np.full(len(start), np.inf)
    low, high = scene.low[kept], scene.high[kept]
    for first in range(0, len(low), 32):
        part = slice(first, first + 32)
        enter, leave = entries(np.broadcast_to(eye, rays.shape), rays, low[part], high[part])
        # What is nearer than the near plane is clipped.
        enter = np.where(leave >= 1, np.maximum(enter, 1.0), np.inf)
        nearest = np.minimum(nearest, enter.min(axis=1, initial=np.inf))
    return nearest.reshape(height, width)


@pytest.mark.parametrize("reversed_z", [True, False])
@pytest.mark.parametrize("name", ["street", "air"])
def test_a_spot_lights_picture_is_equal(
    device: hizvk.Device, scene: Scene, name: str, reversed_z: bool
) -> None:
    eye, target, _ = VIEWS[name]
    camera = perspective(eye, target, reversed_z=reversed_z)
    depth, points = seen(scene, camera)
    stand = np.array([60.0, 30, 40])
    light = spot(stand, (40, 0, 60), reversed_z=not reversed_z)
    mask = device.receiver_mask(
        depth, camera, light, kind=camera.depth_kind, filter_radius=1e-6, reach_px=1 / 64
    )
    casters = casters_of(device, scene)
    kept = device.cull(casters, light, device.pyramid(mask)).mask
    assert kept.mean() < 0.5

    def picture(image: Floats) -> npt.NDArray[np.bool_]:
        with np.errstate(invalid="ignore", divide="ignore"):
            clip = np.concatenate([points, np.ones((len(points), 1))], 1)
            clip = clip @ np.asarray(light.clip_from_world).T
            x = np.floor((clip[:, 0] / clip[:, 3] + 1) / 2 * MAP)
            y = np.floor((1 - clip[:, 1] / clip[:, 3]) / 2 * MAP)
            inside = (clip[:, 3] > 0) & (x >= 0) & (x < MAP) & (y >= 0) & (y < MAP)
            found = image[np.where(inside, y, 0).astype(int), np.where(inside, x, 0).astype(int)]
            # The map has multiples of the near plane's distance, 0.2.
            return inside & (found * 0.2 < clip[:, 3] - 0.05)

    whole = picture(spot_map(scene, light, stand, np.ones(len(scene.low), bool)))
    assert 0 < np.count_nonzero(whole) < whole.size
    assert np.array_equal(picture(spot_map(scene, light, stand, kept)), whole)


def test_a_receiver_masks_texels_by_definition(device: hizvk.Device) -> None:
    """A receiver's texel holds a depth at least as far as the receiver, and not much farther."""
    random = np.random.default_rng(3)
    for reversed_z in (True, False):
        camera = perspective((0, 0, 0), (0, 0, -1), reversed_z=reversed_z)
        light = spot((5, 8, 0), (0, 0, -20), reversed_z=reversed_z, size=61)
        z = random.uniform(5, 40, SIZE)
        depth = 0.1 / z if reversed_z else 1 - 0.1 / z
        depth[random.uniform(size=SIZE) < 0.3] = 0.0 if reversed_z else 1.0
        depth = depth.astype(np.float32)
        mask = device.receiver_mask(depth, camera, light, kind=camera.depth_kind, reach_px=0.0)
        image = mask.numpy().astype(float)
        assert image.shape == (61, 61)
        back = np.linalg.inv(np.asarray(camera.clip_from_world))
        rows, columns = np.nonzero(depth != (0.0 if reversed_z else 1.0))
        ndc = np.stack(
            [
                (columns + 0.5) / SIZE[1] * 2 - 1,
                1 - (rows + 0.5) / SIZE[0] * 2,
                depth[rows, columns].astype(float),
                np.ones(len(rows)),
            ],
            1,
        )
        clip = (ndc @ back.T) @ np.asarray(light.clip_from_world).T
        clip = clip[clip[:, 3] * np.sign((ndc @ back.T)[:, 3]) > 0]
        x = (clip[:, 0] / clip[:, 3] + 1) / 2 * 61
        y = (1 - clip[:, 1] / clip[:, 3]) / 2 * 61
        inside = (x >= 0) & (x < 61) & (y >= 0) & (y < 61)
        own = (clip[:, 2] / clip[:, 3])[inside]
        found = image[np.floor(y[inside]).astype(int), np.floor(x[inside]).astype(int)]
        assert (found <= own).all() if reversed_z else (found >= own).all()
        best = np.full((61, 61), 1.0 if reversed_z else 0.0)
        farthest = np.minimum if reversed_z else np.maximum
        farthest.at(best, (np.floor(y[inside]).astype(int), np.floor(x[inside]).astype(int)), own)
        # Receivers within a rounding of a border count on both sides of it.
        assert np.mean(np.abs(image - best) < 1e-4) > 0.9


def test_a_receiver_over_all_of_a_large_mask_is_in_every_texel(device: hizvk.Device) -> None:
    """Its blocks are more than lavapipe has iterations for."""
    camera = perspective((0, 0, 0), (0, 0, -1))
    light = spot((5, 8, 0), (0, 0, -20), size=4096)
    depth = np.zeros(SIZE, np.float32)
    depth[SIZE[0] // 2, SIZE[1] // 2] = 0.1 / 16
    sides = []
    for radius in (1.0, 3.0, 4.0, 9.0, 30.0):
        mask = device.receiver_mask(
            depth, camera, light, kind="reversed_ndc", filter_radius=radius
        ).numpy()
        rows, columns = np.nonzero(mask < 1)
        # It marks a rectangle as a whole, of texels or of blocks of them.
        sides.append((np.ptp(rows) + 1, np.ptp(columns) + 1))
        assert len(rows) == sides[-1][0] * sides[-1][1]
    assert sides[0][0] < 1024
    assert sides[-2:] == [(4096, 4096)] * 2


def test_an_invalid_pixel_keeps_every_caster_of_a_mask(device: hizvk.Device) -> None:
    camera = perspective((0, 0, 0), (0, 0, -1))
    light = spot((5, 8, 0), (0, 0, -20))
    depth = np.full(SIZE, 0.01, np.float32)
    assert (device.receiver_mask(depth, camera, light, kind="reversed_ndc").numpy() > 0).all()
    depth[3, 4] = np.nan
    assert (device.receiver_mask(depth, camera, light, kind="reversed_ndc").numpy() == 0).all()
    empty = np.zeros(SIZE, np.float32)
    assert (device.receiver_mask(empty, camera, light, kind="reversed_ndc").numpy() == 1).all()


def test_the_bench_reports_what_is_lost(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """``hizvk bench --shadows``: its report, and its exit code."""
    asked = []

    def measured(size: tuple[int, int], *, small: int, descent: int) -> list[bench.Row]:
        asked.append((size, small, descent))
        return [bench.Row("street", 1600, 7, 900, 30, 9, lost, 1.25)]

    monkeypatch.setattr(bench, "measure", measured)
    for lost in (0, 1):
        given = ["--shadows", "--out", str(tmp_path), "--size", "80x45", "--small", "300"]
        assert cli.main(["bench", *given]) == lost
        page = capsys.readouterr().out
        assert f"| street | 1,600 | 7 | 900 | 30 | 9 | {lost} | 1.2 |" in page
        assert (tmp_path / "report.md").read_text(encoding="utf-8").strip() == page.strip()
        assert json.loads((tmp_path / "report.json").read_text())["rows"][0]["lost"] == lost
    assert asked == [((45, 80), 300, 0)] * 2


def test_the_bench_loses_no_shadow() -> None:
    for row in bench.measure((45, 80), small=300):
        assert row.lost == 0
        assert 0 < row.needed <= row.ours < row.frustum
        assert row.needed <= row.behind <= row.frustum
