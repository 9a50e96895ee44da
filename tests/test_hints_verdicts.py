"""Hints at a cull's verdicts: all is outside or invalid, or the depth image can hide nothing."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

import hizvk

#: 90 degrees, 8 pixels of one world unit at depth 4.
CAMERA = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(8, 8), near=1.0)
IMAGE = np.full(CAMERA.size, 4.0)
#: One ball beside the middle of the view, one that a wall at depth 4 hides, one before it.
MIDDLES = np.array([[1.33375, 0.0, -5.5], [-3.5, 0.0, -5.5], [-0.5, 0.0, -2.5]])
#: A wall at depth 4 with a gap in front of the first ball.
GAP = [
    hizvk.Mesh(
        [[left, -9.0, -4.0], [right, -9.0, -4.0], [right, 9.0, -4.0], [left, 9.0, -4.0]],
        [[0, 1, 2], [0, 2, 3]],
    )
    for left, right in ((-9.0, 0.95), (0.99, 9.0))
]


def hinted(
    bounds: hizvk.Spheres, camera: hizvk.Camera = CAMERA, depth: Any = IMAGE, **more: Any
) -> list[str]:
    """The warnings of `visible`, all of them for this file, and the hints of the result."""
    kind = None if isinstance(depth, hizvk.DepthImage) else "z"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        hizvk.visible(bounds, camera, depth=depth, kind=kind, **more)
    assert all(one.category is hizvk.HizWarning and one.filename == __file__ for one in caught)
    device = more.pop("device")
    pyramid = device.pyramid(depth) if kind is None else device.pyramid(depth, camera, kind=kind)
    asked = device.cull(device.instances(bounds), camera, pyramid, **more).hints()
    said = [str(one.message) for one in caught]
    assert [text.split(":")[0] for text in asked] == [text.split(":")[0] for text in said]
    return said


def test_what_is_as_it_should_be_gets_no_hint(device: hizvk.Device) -> None:
    one_in_view = np.array([[0.0, 0.0, -3.0], [99.0, 0.0, -3.0]])
    half = np.where(np.arange(8) < 4, 4.0, 0.0) * np.ones((8, 1))
    small = np.zeros((8, 8))
    small[3:5, 3:5] = 2.0
    assert hinted(hizvk.Spheres(MIDDLES, 0.5), device=device) == []
    assert hinted(hizvk.Spheres(one_in_view, 0.5), device=device) == [], (
        "something is in view, and nothing hidden"
    )
    assert hinted(hizvk.Spheres(one_in_view, 0.0), device=device) == []
    assert hinted(hizvk.Spheres(MIDDLES, 0.5), depth=half, device=device) == []
    beside = hizvk.Spheres(MIDDLES[1:2], 0.5)
    assert hinted(beside, depth=small, device=device) == [], "little depth, but in one place"
    assert hinted(hizvk.Spheres(np.zeros((0, 3)), 0.5), depth=np.zeros((8, 8)), device=device) == []
    assert hinted(hizvk.Spheres(MIDDLES[1:2], 0.5), device=device) == [], "all of it hidden"
    assert (
        hinted(
            hizvk.Spheres(MIDDLES, 0.5),
            depth=device.render_depth(device.occluders(GAP), CAMERA),
            device=device,
        )
        == []
    )
    assert hinted(hizvk.Spheres(MIDDLES, 0.5), coverage="sample", device=device) == []


def test_everything_outside_is_hinted_at(device: hizvk.Device) -> None:
    away = MIDDLES * (1.0, 1.0, -1.0)
    (text,) = hinted(hizvk.Spheres(away, 0.5), device=device)
    assert text.startswith(
        "bounds, camera: all 3 lie outside of the view; if that is not meant, check the pose's"
    )
    # One alone is often outside, with nothing wrong: callers ask in a loop.
    assert hinted(hizvk.Spheres(away[:1], 0.5), device=device) == []


def test_a_rendered_image_lacks_nothing(device: hizvk.Device) -> None:
    """A rope before the sky: few pixels have a depth, and none is missing."""
    rope = device.occluders(
        np.array([[-9.0, -4, -5], [9, 5, -5], [9, 5.02, -5], [-9, -3.98, -5]]),
        [[0, 1, 2], [0, 2, 3]],
    )
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(240, 320), near=0.1)
    depth = device.render_depth(rope, camera)
    balls = hizvk.Spheres(np.random.default_rng(0).uniform((-1, -1, -9), (1, 1, -6), (50, 3)), 0.1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert hizvk.visible(balls, camera, depth=depth, device=device).all()


@pytest.mark.parametrize("resized", [False, True])
def test_a_pose_that_was_mistaken_is_named(device: hizvk.Device, resized: bool) -> None:
    """`CAMERA` looks along -z with y up, OpenGL's unit pose; as a pose of OpenCV it looks away."""
    projection = np.array(
        [[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1], [0, 0, 1, 0]]
    )  # z forward, reversed, infinite

    def made(pose: np.ndarray, way: str = "camera_from_world") -> hizvk.Camera:
        size = (16, 16) if resized else CAMERA.size
        camera = hizvk.Camera.from_matrices(
            clip_from_camera=projection, **{way: pose}, size=size, reversed_z=True
        )
        return camera.resized(CAMERA.size) if resized else camera

    balls = hizvk.Spheres(MIDDLES, 0.5)
    (text,) = hinted(balls, made(np.eye(4)), device=device)
    assert "3 would be inside of it with the camera's y and z turned round" in text
    up = np.eye(4)
    up[1, 3] = 50.0
    for way, pose in (("world_from_camera", up), ("camera_from_world", np.linalg.inv(up))):
        (text,) = hinted(
            hizvk.Spheres(MIDDLES + np.array([0.0, 50.0, 0.0]), 0.5), made(pose, way), device=device
        )
        assert "3 would be inside of it with the camera's y and z turned round" in text
    right = np.diag([1.0, -1.0, -1.0, 1.0])
    assert hinted(balls, made(right), device=device) == []
    # The pose the wrong way round: the camera stands at (0, 0, 20) and looks back along -z.
    pose = right.copy()
    pose[2, 3] = 20.0
    balls = hizvk.Spheres(MIDDLES + np.array([0.0, 0.0, 20.0]), 0.5)
    assert hinted(balls, made(pose, "world_from_camera"), device=device) == []
    moved = right.copy()
    moved[:3, 3] = (40.0, 0.0, 0.0)
    balls = hizvk.Spheres(MIDDLES + np.array([40.0, 0.0, 0.0]), 0.5)
    assert hinted(balls, made(moved, "world_from_camera"), device=device) == []
    (text,) = hinted(balls, made(moved, "camera_from_world"), device=device)
    assert "3 would be inside of it with the pose as world_from_camera" in text


def test_points_by_sample_coverage_are_hinted_at(device: hizvk.Device) -> None:
    (text,) = hinted(hizvk.Spheres(MIDDLES, 0.0), coverage="sample", device=device)
    assert "a point covers no pixel's centre" in text
    (text,) = hinted(hizvk.Spheres(MIDDLES, 1e-3), coverage="sample", device=device)
    assert text.startswith("bounds, coverage: nothing covers a pixel's centre")
    # What was moved to be larger is no point any more.
    instances = device.instances(hizvk.Spheres(MIDDLES, 0.0))
    instances.update(1, hizvk.Spheres(MIDDLES[2:], 0.5))
    pyramid = device.pyramid(IMAGE, CAMERA, kind="z")
    assert device.cull(instances, CAMERA, pyramid, coverage="sample").hints() == ()


@pytest.mark.parametrize("reversed_z", [True, False])
def test_depth_that_cannot_hide_is_hinted_at(device: hizvk.Device, reversed_z: bool) -> None:
    camera = hizvk.Camera.look_at(
        (0, 0, 0),
        (0, 0, -1),
        fov_y_deg=90,
        size=(64, 64),
        near=1.0,
        far=100.0,
        reversed_z=reversed_z,
    )
    balls = hizvk.Spheres(MIDDLES, 0.5)
    metres = np.full((64, 64), 4.0)
    assert hinted(balls, camera, metres, device=device) == []
    for empty in (
        np.zeros((64, 64)),
        metres * 1000.0,
        np.full((64, 64), np.nan),
        np.full((64, 64), np.inf),
    ):
        (text,) = hinted(balls, camera, empty, device=device)
        assert text.startswith(
            "depth: every pixel is far, so nothing can be hidden; "
            "if something should be there, check its numbers, kind and scale"
        )
    sparse = np.zeros((64, 64))
    sparse[::5, ::5] = 4.0  # 13 x 13 of 4,096
    (text,) = hinted(balls, camera, sparse, device=device)
    assert text.startswith("depth: 4.1 % of the pixels have a depth")
    lines = np.zeros((64, 64))
    lines[::5] = 4.0
    # Each lies beside others of its line, so it is blocks of 2x2 that are missing.
    for bars in (lines, lines.T):
        (text,) = hinted(balls, camera, bars, device=device)
        assert text.startswith("depth: 20.3 % of the pixels have a depth, and hardly any 2x2 of")
    # Nothing could be hidden, whatever the depth.
    (text,) = hinted(hizvk.Spheres(MIDDLES, np.nan), camera, sparse, device=device)
    assert text.startswith(f"bounds: all {len(MIDDLES)} are invalid")
