"""Hints at units and conventions that are probably wrong, and none where a scene may be right."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hizvk

if TYPE_CHECKING:
    import numpy.typing as npt

SIZE = (48, 64)
CAMERA = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.1)


def crowd(near: float, far: float, count: int = 40) -> hizvk.Spheres:
    """Balls in view at depths of `near` to `far`."""
    z = np.linspace(near, far, count)
    across = np.random.default_rng(1).uniform(-0.3, 0.3, (count, 2)) * z[:, None]
    return hizvk.Spheres(np.c_[across, -z], 0.01 * z)


def room(near: float, far: float, dtype: Any = np.float64) -> npt.NDArray[Any]:
    """A wall that runs from `near` at the left to `far` at the right."""
    return np.tile(np.linspace(near, far, SIZE[1]), (SIZE[0], 1)).astype(dtype)


def said(bounds: Any, depth: Any, camera: hizvk.Camera = CAMERA, **more: Any) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        hizvk.visible(bounds, camera, depth=depth, **{"kind": "z", **more})
    assert all(one.category is hizvk.HizWarning and one.filename == __file__ for one in caught)
    return [str(one.message) for one in caught]


def asked(
    device: hizvk.Device, bounds: Any, depth: Any, camera: hizvk.Camera = CAMERA, **more: Any
) -> tuple[str, ...]:
    hiz = device.pyramid(depth, camera, **{"kind": "z", **more})
    return device.cull(device.instances(bounds), camera, hiz).hints()


def test_positions_in_millimetres_before_depth_in_metres(device: hizvk.Device) -> None:
    """All of them are hidden, a thousand times as far away as the image."""
    bounds, depth = crowd(2000.0, 3000.0), room(2.0, 3.0)
    (warned,) = said(bounds, depth)
    (hint,) = asked(device, bounds, depth)
    for text in (warned, hint):
        assert text.startswith("bounds, depth: all 40 in view are hidden, and they are ")
        assert "by scale or by the positions" in text
    # By hand: both medians are 2,500 and 2.5, as good as the pixels and balls are spread.
    factor = float(warned.split(" times as far")[0].rsplit(" ", 1)[1].replace(",", ""))
    assert factor == pytest.approx(1000.0, rel=0.05)
    distances = said(bounds, depth, kind="distance")
    assert distances[0].startswith("bounds, depth: all 40 in view are hidden")
    ndc = said(bounds, 0.1 / depth, kind="reversed_ndc")
    assert ndc[0].startswith("bounds, depth: all 40 in view are hidden")
    rendered = device.pyramid(depth, CAMERA, kind="z")
    seen = device.cull(device.instances(bounds), CAMERA, rendered)
    assert escaped("Hint: bounds, depth: all 40 in view are hidden") in seen._repr_html_()


def escaped(text: str) -> str:
    from html import escape

    return escape(text)


def test_that_all_is_hidden_may_be_right(device: hizvk.Device) -> None:
    """A wall at 2 m before things at 20 to 150 m: `hints` says so, and `visible` does not warn."""
    for bounds, depth in (
        (crowd(20.0, 150.0), room(2.0, 2.0)),
        (crowd(20.0, 150.0), room(0.5, 3.0)),
        (crowd(3.0, 4.0), room(2.0, 2.0)),
    ):
        assert said(bounds, depth) == []
        (text,) = asked(device, bounds, depth)
        assert text.startswith("bounds, depth: all 40 in view are hidden (their middles at a view")
        assert "check kind, scale and the units of the positions" in text
        assert ("the image at 2 everywhere)" in text) == (depth.min() == depth.max())
    # One that is hidden, and many outside, are nothing to speak of.
    one = hizvk.Spheres([(0.0, 0, -3000.0), (0.0, 0, 5.0)], 0.1)
    assert said(one, room(2.0, 2.0)) == []
    assert asked(device, one, room(2.0, 2.0)) == ()
    # Something that is kept gives no cause.
    some = crowd(1.0, 3000.0)
    assert said(some, room(2.0, 2.0)) == []
    assert asked(device, some, room(2.0, 2.0)) == ()


@pytest.mark.parametrize("dtype", [np.uint16, np.int32, np.float64])
def test_depth_in_millimetres_without_a_scale(device: hizvk.Device, dtype: Any) -> None:
    bounds, depth = crowd(2.2, 3.0), room(2000.0, 2100.0, dtype)
    (warned,) = said(bounds, depth)
    assert [warned.split("(")[0]] == [text.split("(")[0] for text in asked(device, bounds, depth)]
    assert warned.startswith("depth, scale: ")
    assert ("whole numbers without scale" in warned) == (dtype != np.float64)
    assert "pass scale=0.001" in warned
    # With the scale all are hidden, by a wall a few centimetres nearer.
    assert said(bounds, depth, scale=0.001) == []
    assert not hizvk.visible(bounds, CAMERA, depth=depth, kind="z", scale=0.001).any()


def before_and_behind(unit: float) -> tuple[hizvk.Spheres, npt.NDArray[Any]]:
    """Balls of up to 30 % before and behind a wall that runs from 2 to 9 m, positions in `unit`."""
    depth, rng = room(2.0, 9.0), np.random.default_rng(3)
    places = rng.uniform(0.1, 0.9, (60, 2)) * SIZE
    z = depth[tuple(places.astype(int).T)] * rng.uniform(0.7, 1.3, 60)
    # By hand: 60 degrees over 48 rows, square pixels.
    step = 2.0 * np.tan(np.radians(30.0)) / SIZE[0]
    up, right = (SIZE[0] / 2 - places[:, 0]) * step, (places[:, 1] - SIZE[1] / 2) * step
    return hizvk.Spheres(np.c_[right * z, up * z, -z] * unit, 0.02 * unit), depth


def test_centimetres_and_metres(device: hizvk.Device) -> None:
    """A factor of 100 may be right; balls that lie at the depth of their pixels without it tell."""
    metres, depth = before_and_behind(1.0)
    assert said(metres, depth) == []
    seen = hizvk.visible(metres, CAMERA, depth=depth, kind="z")
    assert 10 < seen.sum() < 50
    cm, _ = before_and_behind(100.0)
    hints = said(cm, depth)
    assert hints[0].startswith("bounds, depth: all 60 in view are hidden, and most middles / 100")
    assert "pass scale=100, or positions / 100" in hints[0]
    (text,) = asked(device, cm, depth)
    assert text.startswith("bounds, depth: all 60 in view are hidden, and most middles / 100")
    hints += said(metres, 100.0 * depth)
    assert hints[1].startswith("depth, scale: nothing is hidden")
    assert "if it is in centimetres and positions are in metres, pass scale=0.01" in hints[1]
    whole = (100.0 * depth).astype(np.uint16)
    assert "pass scale=0.01" in said(metres, whole)[0]
    assert len(hints) == 2
    # With what the hints say, the answer is that of metres.
    for bounds, image, scale in ((cm, depth, 100.0), (metres, 100.0 * depth, 0.01)):
        found = hizvk.visible(bounds, CAMERA, depth=image, kind="z", scale=scale)
        assert (found == seen).mean() > 0.95
    # A factor of 100 alone is none: things behind a near wall, and before far mountains.
    assert said(crowd(20.0, 380.0), room(2.0, 2.0)) == []
    assert said(crowd(0.5, 15.0), room(400.0, 500.0)) == []


def test_ndc_depth_has_no_scale() -> None:
    """Near and far in other units than the positions: there is no scale to pass."""
    depth = 0.1 / room(2000.0, 2100.0)
    (text,) = said(crowd(2.0, 3.0), depth, kind="reversed_ndc")
    assert text.startswith("depth, scale: nothing is hidden")
    assert text.endswith("bring them to those")
    assert "scale=" not in text


def test_whole_numbers_that_are_world_units(device: hizvk.Device) -> None:
    """A scene in millimetres, as data sets of robots have it."""
    depth = room(900.0, 1100.0, np.uint16)
    for bounds in (crowd(500.0, 800.0), crowd(500.0, 1500.0), crowd(1500.0, 1600.0)):
        assert said(bounds, depth) == []
    assert asked(device, crowd(500.0, 800.0), depth) == ()
    # Centimetres before a far wall: 40 times as far, and in whole numbers.
    assert said(crowd(20.0, 30.0), depth) == []


def test_things_before_far_mountains_are_no_mistake(device: hizvk.Device) -> None:
    for bounds, depth in ((crowd(1.0, 30.0), room(900.0, 1100.0)), (crowd(0.5, 1.0), room(40, 60))):
        assert said(bounds, depth) == []
        assert asked(device, bounds, depth) == ()
    # What is rendered is in the units of its occluders.
    far = hizvk.Mesh([[-9e5, -9e5, -1e5], [9e5, -9e5, -1e5], [0, 9e5, -1e5]], [[0, 1, 2]])
    image = device.render_depth(device.occluders(far), CAMERA)
    assert said(crowd(1.0, 2.0), image, kind=None) == []


@pytest.mark.parametrize("reversed_z", [True, False])
def test_an_image_that_was_cleared_for_the_other_direction(
    device: hizvk.Device, reversed_z: bool
) -> None:
    camera = hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.1, reversed_z=reversed_z
    )
    kind, near = camera.depth_kind, 1.0 if reversed_z else 0.0
    cleared = np.full(SIZE, near)
    for found in (
        said(crowd(2.0, 9.0), cleared, camera, kind=kind),
        asked(device, crowd(2.0, 9.0), cleared, camera, kind=kind),
    ):
        (text,) = found
        assert text.startswith("depth: every pixel is at the near plane, so everything in view is")
    assert said(crowd(2.0, 9.0), np.full(SIZE, 1.0 - near), camera, kind=kind)[0].startswith(
        "depth: every pixel is far"
    )
    some = cleared.copy()
    some[:, ::2] = 0.5
    assert said(crowd(2.0, 9.0), some, camera, kind=kind) == []


def test_parallel_rays_have_no_ratios(device: hizvk.Device) -> None:
    """View depth of an orthographic camera begins where its eye was put."""
    camera = hizvk.Camera.orthographic(
        (0, 0, 0), (0, 0, -1), height=4.0, size=SIZE, near=0.1, far=9000.0
    )
    balls = hizvk.Spheres(np.c_[np.zeros((5, 2)), -np.linspace(2000.0, 3000.0, 5)], 0.1)
    assert said(balls, room(2.0, 2.0), camera) == []
    assert asked(device, balls, room(2.0, 2.0), camera) == ()
    bare = hizvk.Camera.from_matrices(np.eye(4), size=SIZE, reversed_z=False)
    inside = hizvk.Spheres([(0.0, 0, 0.5), (0.1, 0, 0.5)], 0.01)
    assert said(inside, np.full(SIZE, 0.1), bare, kind="ndc") == []
    assert asked(device, inside, np.full(SIZE, 0.1), bare, kind="ndc") == ()


# -- heights and points ----------------------------------------------------------------------------


def test_heights_of_float32_s_end_are_refused() -> None:
    heights = np.zeros((6, 6), np.float32)
    heights[0, :3] = np.finfo(np.float32).min
    with pytest.raises(ValueError, match=r"^heights: expected .* got -3\.40282e\+38; ") as caught:
        hizvk.viewshed(heights, 10.0, (3, 3))
    way = str(caught.value).rpartition("pass ")[2]
    assert np.isnan(eval(way, {"heights": heights, "np": np})).sum() == 3


@pytest.mark.parametrize("number", [-9999.0, -32768.0])
def test_heights_that_are_no_data(number: float) -> None:
    heights = np.zeros((6, 6))
    heights[0, :3] = number
    with pytest.warns(hizvk.HizWarning, match="^heights: 3 are ") as told:
        hizvk.viewshed(heights, 10.0, (3, 3), size=16)
    assert told[0].filename == __file__
    way = f"np.where(heights == {number:g}, np.nan, heights)"
    assert way in str(told[0].message)
    assert np.isnan(eval(way, {"heights": heights, "np": np})).sum() == 3
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        seen = hizvk.viewshed(np.where(heights == number, np.nan, heights), 10.0, (3, 3), size=16)
        assert not seen[0, :3].any()
        hizvk.viewshed(np.full((4, 4), -9998.5), 10.0, (1, 1), size=16)


def test_points_of_one_pixel_each_are_hinted_at() -> None:
    rng = np.random.default_rng(2)
    points = hizvk.Points(np.c_[rng.uniform(-0.5, 0.5, (200, 2)), -np.ones(200)])
    with pytest.warns(hizvk.HizWarning, match=r"^radius: .*pass radius=.*or radius_px=1$") as told:
        image = hizvk.depth_from_points(points, CAMERA)
    assert told[0].filename == __file__
    share = 100.0 * (image > 0).mean()
    assert f"{share:.1f} % of the pixels" in str(told[0].message)
    standard = hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.1, reversed_z=False
    )
    with pytest.warns(hizvk.HizWarning, match=f"and {share:.1f} % of the pixels"):
        hizvk.depth_from_points(points, standard)
    dense = hizvk.Points(np.c_[rng.uniform(-1, 1, (20_000, 2)), -np.ones(20_000)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hizvk.depth_from_points(points, CAMERA, radius=0.05)
        hizvk.depth_from_points(points, CAMERA, radius_px=1)
        hizvk.depth_from_points(dense, CAMERA)
        hizvk.depth_from_points(hizvk.Points(points.positions[:9]), CAMERA)
        hizvk.depth_from_points(hizvk.Points(np.zeros((0, 3))), CAMERA)


def test_every_pose_that_fits_is_named() -> None:
    """5 m behind the eye: turned round, and as the inverse, the pose looks at the balls."""
    pose = np.eye(4)
    pose[2, 3] = -5.0
    camera = hizvk.Camera.from_opencv(
        [[50.0, 0, 32], [0, 50.0, 24], [0, 0, 1]],
        pixel_center="half",
        camera_from_world=pose,
        size=SIZE,
        near=0.1,
    )
    # Their depths are -5 as given, 5 with y and z turned round, and 5 from an eye at z = -5.
    (text,) = said(
        hizvk.Spheres([(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)], 0.05), np.full(SIZE, 50.0), camera
    )
    assert "2 would be inside of it with the camera's y and z turned round" in text
    assert ", or 2 would be inside of it with the pose as world_from_camera" in text


def test_most_bounds_invalid(device: hizvk.Device) -> None:
    low = np.tile([-0.1, -0.1, -5.0], (50, 1))
    high = low + np.array([0.2, -0.2, 0.2])  # the y of both corners are swapped
    high[0] = low[0] + 0.2
    (text,) = said(hizvk.Boxes(low, high), np.full(SIZE, 50.0))
    assert text.startswith("bounds: 49 of 50 are invalid, so they are kept")
    few = high.copy()
    few[1:40] = low[1:40] + 0.2
    assert said(hizvk.Boxes(low, few), np.full(SIZE, 50.0)) == []


def test_a_word_of_other_libraries_is_no_option() -> None:
    balls = crowd(2.0, 3.0)
    for word, meant in (("depth_scale", "scale"), ("units", "scale"), ("footprnt", "footprint")):
        with pytest.raises(TypeError, match=f"^{word}: .* the closest is {meant}, and all are"):
            hizvk.visible(balls, CAMERA, depth=room(2.0, 3.0), kind="z", **{word: 1})  # type: ignore[call-overload]
