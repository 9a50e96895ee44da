"""Two passes: the depth of early and late equals that of all instances, bit for bit."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pytest

import hizvk

SIZE: Final = (72, 128)
SIDE: Final = 10
SMALL: Final = 500
FRAMES: Final = 60
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
TRIANGLES = np.array([[side[i] for i in (0, 1, 2, 0, 2, 3)] for side in SIDES]).reshape(-1, 3)


class Town:
    """Houses, and small boxes of which some move, come and go."""

    def __init__(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        houses = np.stack(np.meshgrid(range(SIDE), [0.0], range(SIDE)), -1).reshape(-1, 3) * 14
        tall = random.uniform((2.5, 3, 2.5), (5, 12, 5), houses.shape)
        small = random.uniform(0.15, 0.6, (SMALL, 3))
        stands = random.uniform((0, 0, 0), (SIDE * 14, 2, SIDE * 14), (SMALL, 3))
        self.half = np.concatenate([tall, small])
        self.center = np.concatenate([houses, stands]) + [0, 1, 0] * self.half
        moves = random.random(len(self.half)) < 0.2
        moves[: SIDE * SIDE] = False
        self.velocity = random.normal(0, 0.4, self.center.shape) * [1, 0, 1] * moves[:, None]
        self.is_absent = np.zeros(len(self.half), bool)
        self.random = random

    def step(self, frame: int) -> None:
        self.center += self.velocity
        if frame % 3 == 1:
            self.is_absent[self.random.integers(SIDE * SIDE, len(self.half), 20)] ^= True
        if frame % 7 == 2:
            self.is_absent[self.random.integers(SIDE * SIDE)] ^= True

    def bodies(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres and half sizes; what is absent stands below everything."""
        away = self.is_absent[:, None]
        return np.where(away, [0, -1000.0, 0], self.center), np.where(away, 0.01, self.half)


def transforms(center: np.ndarray, half: np.ndarray) -> np.ndarray:
    matrices = np.zeros((len(center), 4, 4))
    matrices[:, range(3), range(3)], matrices[:, :3, 3], matrices[:, 3, 3] = half, center, 1.0
    return matrices


def camera(frame: int) -> hizvk.Camera:
    """A walk along a street, with a jump every 15 frames."""
    jump, step = divmod(frame, 15)
    eye = np.array([7 + 0.7 * step, 1.7 + 12 * (jump % 2), 7 + 14 * ((1 + 3 * jump) % SIDE)])
    turn = 0.05 * step + jump
    ahead = [np.cos(turn), -0.02 - 0.3 * (jump % 2), np.sin(turn)]
    return hizvk.Camera.look_at(eye, eye + ahead, fov_y_deg=60, size=SIZE, near=0.1)


def bits(depth: hizvk.DepthImage) -> np.ndarray:
    return depth.numpy().view(np.uint32)


OPTIONS: Final[dict[str, Any]] = {"depth_slack": 1e-2, "descent": 1024}


@pytest.mark.parametrize("rasteriser", ["host", "device"])
@pytest.mark.parametrize("way", ["last", "by size at jumps", "a list of 20", "masks", "arrays"])
def test_early_and_late_give_the_depth_of_all(
    device: hizvk.Device, rasteriser: Any, way: str
) -> None:
    town, random = Town(5), np.random.default_rng(7)
    center, half = town.bodies()
    crowd = device.instances(hizvk.Boxes(center - half, center + half))
    drawn = device.occluders(hizvk.Mesh(CORNERS, TRIANGLES, transforms(center, half)))
    culler = device.temporal(crowd, early_capacity=20 if way == "a list of 20" else None)
    counts, early_alone = [], 0
    for frame in range(FRAMES):
        town.step(frame)
        center, half = town.bodies()
        crowd.update(0, hizvk.Boxes(center - half, center + half))
        drawn.move(0, transforms(center, half))
        view = camera(frame)
        more: dict[str, Any] = {}
        if way == "by size at jumps" and frame % 15 == 0:
            more["largest_px"] = 6
        elif way == "masks":
            more["only"] = random.random(len(crowd)) < 0.1
        elif frame == 40:
            culler.reset()
        early = culler.early(view, **more)
        depth = device.render_depth(drawn, view, only=early, rasteriser=rasteriser)
        everything = device.render_depth(drawn, view, rasteriser=rasteriser)
        early_alone += int((bits(depth) != bits(everything)).sum())
        if way == "arrays":
            late = culler.late(view, depth.numpy(), kind="reversed_ndc", **OPTIONS)
        else:
            late = culler.late(view, depth, **OPTIONS)
        device.render_depth(drawn, into=depth, only=late)
        assert np.array_equal(bits(depth), bits(everything)), frame
        assert not (early.mask & late.mask).any()
        if "only" in more:
            assert not (early.mask & ~more["only"]).any()
        counts.append((early.count, late.count))
    early_counts, late_counts = np.transpose(counts)
    if way == "a list of 20":
        assert early_counts.max() == 20
    # What is drawn late is needed, and most of the crowd is not drawn at all.
    assert early_alone > 300
    assert 0 < late_counts.mean() < len(crowd) / 2
    assert early_counts.mean() > 5


def test_last_frames_answer_alone_loses_what_appears(device: hizvk.Device) -> None:
    """A box behind a door that opens: shown by both passes, and lost by a stale mask."""
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.1)
    shut, open_ = np.array([[0, 0, -5.0], [0, 0, -9.0]]), np.array([[90, 0, -5.0], [0, 0, -9.0]])
    half = np.array([[9, 9, 0.1], [1, 1, 1.0]])
    crowd = device.instances(hizvk.Boxes(shut - half, shut + half))
    drawn = device.occluders(hizvk.Mesh(CORNERS, TRIANGLES, transforms(shut, half)))
    culler = device.temporal(crowd)
    for frame, center in enumerate([shut, shut, open_]):
        crowd.update(0, hizvk.Boxes(center - half, center + half))
        drawn.move(0, transforms(center, half))
        early = culler.early(camera)
        depth = device.render_depth(drawn, camera, only=early)
        late = culler.late(camera, depth, **OPTIONS)
        if frame == 1:
            assert (early.indices.tolist(), late.indices.tolist()) == ([0], [])
        if frame == 2:
            # The door was visible, and is outside of the view now.
            assert (early.indices.tolist(), late.indices.tolist()) == ([], [1])


def test_answers_stay_while_later_frames_run(device: hizvk.Device) -> None:
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.1)
    crowd = device.instances(hizvk.Spheres([[0, 0, -5.0], [1, 0, -5.0], [0, 0, 5.0]], 0.4))
    culler = device.temporal(crowd)
    first = culler.early(camera, only=[0, 2])
    second = culler.early(camera, only=np.array([False, True, True]))
    third = culler.early(camera, largest_px=10_000)
    late = culler.late(camera, np.full(SIZE, np.inf), kind="z")
    # The last one is behind the camera; the late pass follows the last early one.
    assert first.indices.tolist() == [0]
    assert second.indices.tolist() == [1]
    assert (third.count, late.indices.tolist(), len(late)) == (0, [0, 1], 3)
    # Without an early pass everything that is visible is drawn late.
    culler.early(camera)
    assert culler.late(camera, np.full(SIZE, np.inf), kind="z").count == 0
    assert culler.late(camera, np.full(SIZE, np.inf), kind="z").count == 2
    assert "of 3 instances" in repr(late)
    assert "of 3 instances" in repr(culler)
    assert len(culler) == 3
    assert culler.device_bytes > 0


def test_no_instances(device: hizvk.Device) -> None:
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.1)
    culler = device.temporal(device.instances(hizvk.Spheres(np.zeros((0, 3)), 1.0)))
    assert culler.early(camera).mask.shape == (0,)
    assert culler.late(camera, np.full(SIZE, np.inf), kind="z").count == 0


def test_what_is_refused_is_named(device: hizvk.Device) -> None:
    view, other = camera(0), camera(1)
    crowd = device.instances(hizvk.Spheres([[0, 0, -5.0]], 1.0))
    culler = device.temporal(crowd)
    depth = np.full(SIZE, np.inf)
    with pytest.raises(ValueError, match='order: expected "stable"'):
        culler.late(view, depth, kind="z", order="any")
    with pytest.raises(ValueError, match=r"guard_px: .* 9/256 for 4 bits"):
        culler.late(view, depth, kind="z", coverage="sample")
    culler.late(view, depth, kind="z", coverage="sample", guard_px=9 / 256)
    culler.early(view)
    with pytest.raises(ValueError, match="camera: expected that of this frame's"):
        culler.late(other, depth, kind="z")
    with pytest.raises(ValueError, match="camera: expected the camera of depth"):
        culler.late(other, device.pyramid(depth, view, kind="z"))
    crowd.update(0, hizvk.Spheres([[0, 0, -6.0]], 1.0))
    with pytest.raises(ValueError, match="instances: expected no update between"):
        culler.late(view, depth, kind="z")
    with pytest.raises(TypeError, match="kind: expected nothing beside a Pyramid"):
        culler.late(view, device.pyramid(depth, view, kind="z"), kind="z")


def test_levels_of_detail_are_refused_and_the_way_out_is_named() -> None:
    device = hizvk.Device()
    town = Town(1)
    center, half = town.bodies()
    crowd = device.instances(hizvk.Boxes(center - half, center + half))
    culler = device.temporal(crowd)
    view = camera(0)
    culler.early(view)
    depth = device.pyramid(np.zeros(SIZE), view, kind=view.depth_kind)
    rule = hizvk.LodByDistance([20.0])
    expected = r"^lod: expected None.*got LodByDistance.*among=late"
    with pytest.raises(ValueError, match=expected):
        culler.late(view, depth, lod=rule)
    late = culler.late(view, depth)
    # The way out: the levels of what a pass draws.
    lods = [hizvk.MeshLods([hizvk.DrawTemplate(36)] * 2)]
    told = device.cull(crowd, view, depth, meshes=lods, lod=rule, among=late)
    assert (told.mask == late.mask).all()
