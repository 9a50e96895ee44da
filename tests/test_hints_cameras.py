"""Hints at cameras and turns that look like a mistake, and none at those that may be right."""

from __future__ import annotations

import math
import pickle
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hizvk

if TYPE_CHECKING:
    from collections.abc import Callable

SIZE = (48, 64)


def made(angle: float, name: str = "look_at") -> hizvk.Camera:
    if name == "look_at":
        return hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=angle, size=SIZE, near=0.1)
    return hizvk.Camera.from_opengl(
        **{name: angle}, near=0.1, size=SIZE, world_from_camera=np.eye(4)
    )


@pytest.mark.parametrize("name", ["look_at", "fov_x_deg", "fov_y_deg"])
def test_an_angle_in_radians(name: str) -> None:
    for degrees in (30, 45, 60, 75, 90, 120):
        for angle in (math.radians(degrees), round(math.radians(degrees), 4)):
            with pytest.warns(hizvk.HizWarning, match=f"if that is meant, pass {degrees}$") as told:
                made(angle, name)
            assert told[0].filename == __file__
            assert str(told[0].message).startswith("fov_")


@pytest.mark.parametrize("name", ["look_at", "fov_x_deg", "fov_y_deg"])
def test_any_angle_below_half_a_turn_in_radians(name: str) -> None:
    """0.8 radians are 45.84 degrees, and 0.6911 are an iPhone's 39.60."""
    for angle, meant in ((0.8, "45.84"), (0.6911, "39.6"), (2.0, "114.6"), (3.1, "177.6")):
        with pytest.warns(hizvk.HizWarning, match=f"if that is meant, pass {meant}$") as told:
            made(angle, name)
        assert told[0].filename == __file__


def test_narrow_views_are_no_radians() -> None:
    """A tenth of a degree would be 5.7 degrees, as narrow again; pi is half a turn."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for angle in (0.001, 0.01, 0.1, 0.19, 3.15, 3.2, 5, 45.5, 57.29577951308232, 90, 179):
            made(angle)


def test_what_was_told_is_not_told_again(device: hizvk.Device) -> None:
    """A camera is made again when it is unpickled, and when hints look for the pose meant."""
    with pytest.warns(hizvk.HizWarning):
        camera = hizvk.Camera.from_opengl(
            fov_y_deg=0.8, near=0.1, size=SIZE, camera_from_world=np.eye(4)
        )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert pickle.loads(pickle.dumps(camera)) == camera
        hiz = device.pyramid(np.full(SIZE, 9.0), camera, kind="z")
        away = device.instances(hizvk.Spheres([(0.0, 0.0, 5.0)] * 9, 0.1))
        (text,) = device.cull(away, camera, hiz).hints()
    assert "9 would be inside of it with the camera's y and z turned round" in text


def test_angles_in_radians_for_boxes() -> None:
    """Quarter and half turns of data sets, with two digits; few boxes turn by 1.57 degrees."""
    centers = np.zeros((4, 3))
    for yaws in ([1.57, -1.57, 3.14, 0.0], [1.58, -1.56, 0.0, 0.0], 1.5708):
        with pytest.warns(hizvk.HizWarning, match=r"^yaw_deg: most of the .* np\.degrees") as seen:
            hizvk.OrientedBoxes.from_yaw(centers, 1.0, yaws, up=(0, 0, 1))
        assert seen[0].filename == __file__
    for yaws in (
        [90.0, 180.0, 1.57, 0.0],
        [0.0] * 4,
        [0.0, np.nan, np.inf, 2.0],
        [1.0, -2.0, 1.57, 3.0],
        -90.0,
    ):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            hizvk.OrientedBoxes.from_yaw(centers, 1.0, yaws, up=(0, 0, 1))


# -- camera matrices -------------------------------------------------------------------------------


def matrix(fx: float, fy: float, cx: float, cy: float) -> np.ndarray:
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def makers(k: np.ndarray) -> list[Callable[[Any], hizvk.Camera]]:
    """The constructors that take a camera matrix."""
    pose = {"world_from_camera": np.eye(4), "near": 0.1}
    params = [k[0, 0], k[1, 1], k[0, 2], k[1, 2]]
    return [
        lambda size: hizvk.Camera.from_opencv(k, pixel_center="half", size=size, **pose),
        lambda size: hizvk.Camera.from_opengl(k=k, pixel_center="half", size=size, **pose),
        lambda size: hizvk.Camera.from_colmap("PINHOLE", params, size=size, **pose),
    ]


def told(k: np.ndarray, size: tuple[int, int]) -> str:
    """What all constructors say of a camera matrix; empty where they say nothing."""
    texts = set()
    for make in makers(k):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            make(size)
        assert all(one.filename == __file__ for one in caught)
        texts.add("".join(str(one.message) for one in caught))
    (text,) = texts
    return text


def test_a_camera_matrix_of_a_larger_image_is_hinted_at() -> None:
    k, small = matrix(1000, 1000, 960, 540), (270, 480)
    text = told(k, small)
    assert text.startswith("k, size: ")
    assert text.endswith("camera.resized((270, 480))")
    assert told(k, (1080, 1920)) == ""
    assert told(k, (540, 1920)) == "", "a crop may have its principal point on its border"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for make in makers(k):
            assert make((1080, 1920)).resized(small).size == small


def test_a_camera_matrix_of_numbers_from_0_to_1_is_hinted_at() -> None:
    k, size = matrix(0.78, 1.04, 0.5, 0.5), (480, 640)
    text = told(k, size)
    assert "fx=0.78 in an image of (480, 640) pixels" in text
    way = text.rpartition("pass ")[2]
    pixels = eval(way, {"k": k})
    assert pixels.tolist() == matrix(0.78 * 640, 1.04 * 480, 320, 240).tolist()
    assert told(pixels, size) == ""


def test_a_focal_length_in_millimetres_is_hinted_at() -> None:
    assert "pass the focal length in pixels" in told(matrix(4.15, 4.15, 320, 240), (480, 640))
    # As wide as lenses get: a view of 150 degrees, and tiny images.
    assert told(matrix(85, 85, 320, 240), (480, 640)) == ""
    assert told(matrix(1, 1, 0.5, 0.5), (1, 1)) == ""
    assert told(matrix(4, 4, 4, 3), (6, 8)) == ""


def test_a_swapped_principal_point_is_hinted_at() -> None:
    """Either of K and size may be the wrong way round; the middles of their images differ."""
    for k, size in (
        (matrix(500, 500, 240, 320), (480, 640)),
        (matrix(500, 500, 320, 240), (640, 480)),
        (matrix(1000, 1000, 541.3, 955.0), (1080, 1920)),
    ):
        text = told(k, size)
        assert text.startswith("k, size: the principal point (")
        assert f"is the middle of an image of {size[::-1]} pixels, and not of {size}" in text
    for k, size in (
        (matrix(500, 500, 320, 240), (480, 640)),
        (matrix(500, 500, 240, 240), (480, 480)),
        (matrix(500, 500, 235, 250), (480, 490)),  # nearly square
        (matrix(500, 500, 240, 500), (480, 640)),  # a crop
    ):
        assert told(k, size) == ""


# -- another camera than the pyramid's -------------------------------------------------------------


def test_an_error_says_in_what_cameras_differ(device: hizvk.Device) -> None:
    """Their texts are the same: matrices are as long as their shapes there."""
    moved = np.eye(4)
    moved[0, 3] = 0.25
    first, second = (
        hizvk.Camera.from_opencv(
            matrix(50, 50, 32, 24),
            pixel_center="half",
            camera_from_world=pose,
            size=SIZE,
            near=0.1,
        )
        for pose in (np.eye(4), moved)
    )
    assert repr(first) == repr(second)
    balls = device.instances(hizvk.Spheres([(0.0, 0.0, 4.0)], 0.1))
    wall = device.occluders([(-9.0, -9, 9), (9, -9, 9), (0, 9, 9)], [[0, 1, 2]])
    image = device.render_depth(wall, first)
    hiz, small = device.pyramid(image), (24, 32)
    resized = device.pyramid(np.full(small, 9.0), first.resized(small), kind="z")
    maps = device.occlusion_map(wall, first)
    text = r"got one whose camera_from_world\[0, 3\] is 0\.25 and not 0($|;)"
    calls: list[Callable[[], object]] = [
        lambda: device.cull(balls, second, hiz),
        lambda: device.cull(balls, [first, second], [hiz, hiz]),
        lambda: device.cull(balls, second.resized(small), resized),
        lambda: hizvk.visible(hizvk.Spheres([(0.0, 0, 4)], 0.1), second, depth=image),
        lambda: device.render_depth(wall, second, into=image),
        lambda: device.temporal(balls).late(second, hiz),
        lambda: device.receiver_mask(image, second, first),
        lambda: device.cull_map(hizvk.Spheres([(0.0, 0, 4)], 0.1), second, maps),
    ]
    for call in calls:
        with pytest.raises(ValueError, match=text):
            call()
    eyes = [
        hizvk.Camera.look_at((0, 0, z), (0, 0, -1), fov_y_deg=60, size=SIZE, near=near)
        for z, near in ((0, 0.1), (1, 0.2))
    ]
    hiz = device.pyramid(np.full(SIZE, 9.0), eyes[0], kind="z")
    with pytest.raises(
        ValueError,
        match=r"one whose eye is \(0\.0, 0\.0, 1\.0\) and not \(0\.0, 0\.0, 0\.0\), "
        r"whose near is 0\.2 and not 0\.1;",
    ):
        device.cull(balls, eyes[1], hiz)
    with pytest.raises(ValueError, match=r"got Camera\.from_opencv\("):
        device.cull(balls, first, hiz)
