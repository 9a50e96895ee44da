"""Depth of every kind of camera as view depth and distance: `Pyramid.level(k, kind=)`.

Expected depths are formed here from the planes' distances; none comes from the code under test.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hizvk
from hizvk.view_depth import RayView

SIZE = (37, 61)
NEAR, FAR = 0.25, 40.0
EYE, TARGET = (1e5, -20.0, 30.0), (1e5 + 3.0, -19.0, 24.0)
FOV_Y = 70.0

Images = npt.NDArray[np.float64]
Case = tuple[hizvk.Camera, Callable[[Images], Images]]


def perspective(reversed_z: bool, far: float | None) -> Case:
    """A camera, and NDC depth of view depth as textbooks have it."""
    camera = hizvk.Camera.look_at(
        EYE, TARGET, fov_y_deg=FOV_Y, size=SIZE, near=NEAR, far=far, reversed_z=reversed_z
    )
    share = 1.0 if far is None else far / (far - NEAR)
    return camera, lambda z: (1 - share * (1 - NEAR / z)) if reversed_z else share * (1 - NEAR / z)


def orthographic(reversed_z: bool) -> Case:
    camera = hizvk.Camera.orthographic(
        EYE, TARGET, height=9.0, size=SIZE, near=NEAR, far=FAR, reversed_z=reversed_z
    )
    return camera, lambda z: ((FAR - z) if reversed_z else (z - NEAR)) / (FAR - NEAR)


CASES = {
    "reversed infinite": perspective(True, None),
    "reversed finite": perspective(True, FAR),
    "standard infinite": perspective(False, None),
    "standard finite": perspective(False, FAR),
    "orthographic": orthographic(False),
    "orthographic reversed": orthographic(True),
}


def blocks(image: Images, level: int, reduce: Any) -> Images:
    """Each block of 2^level x 2^level pixels reduced to one number, by a loop."""
    step = 2**level
    height, width = (-(-side // step) for side in image.shape)
    return np.array(
        [
            [
                reduce(image[i * step : (i + 1) * step, j * step : (j + 1) * step])
                for j in range(width)
            ]
            for i in range(height)
        ]
    )


def lengths(camera: hizvk.Camera) -> Images:
    """How long the ray of each pixel is per unit of view depth, by the angle of view."""
    if "orthographic" in repr(camera):
        return np.ones(SIZE)
    tangent = np.tan(np.radians(FOV_Y) / 2.0)
    x = ((np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2 - 1) * tangent * SIZE[1] / SIZE[0]
    y = (1 - (np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2) * tangent
    return np.sqrt(1 + x[None] ** 2 + y[:, None] ** 2)


@pytest.mark.parametrize("name", CASES)
def test_levels_of_each_camera(device: hizvk.Device, name: str) -> None:
    camera, ndc_of = CASES[name]
    z = np.random.default_rng(5).uniform(1.0, 30.0, SIZE)
    ndc = ndc_of(z)
    hiz = device.pyramid(ndc, camera, kind=camera.depth_kind, depths="both")
    other = "ndc" if camera.reversed_z else "reversed_ndc"
    for level in range(hiz.num_levels):
        for end, reduce in (("farthest", np.max), ("nearest", np.min)):
            expected = blocks(z, level, reduce)
            found = hiz.level(level, end, kind="z")  # type: ignore[arg-type]
            assert found.dtype == np.float32
            # An ulp of float32 NDC depth near 1 is 6e-8, and z^2 / near times that in view depth.
            room = 1e-7 * (expected**2 / NEAR + FAR)
            assert (np.abs(found - expected) <= room).all()
            stored = hiz.level(level, end)  # type: ignore[arg-type]
            turned = hiz.level(level, end, kind=other)  # type: ignore[arg-type]
            np.testing.assert_allclose(turned, 1.0 - stored, atol=1e-7)
            np.testing.assert_array_equal(
                hiz.level(level, end, kind=camera.depth_kind),
                stored,  # type: ignore[arg-type]
            )
    # The distance of a texel bounds those of its pixels.
    distance = z * lengths(camera)
    for level in (0, 1, 3):
        above = hiz.level(level, kind="distance").astype(np.float64)
        below = hiz.level(level, "nearest", kind="distance").astype(np.float64)
        room = 1e-7 * (above**2 / NEAR + FAR)
        assert (above >= blocks(distance, level, np.max) - room).all()
        assert (below <= blocks(distance, level, np.min) + room).all()
        # Not by more than the rays of a block differ.
        spread = blocks(lengths(camera), level, np.max) / blocks(lengths(camera), level, np.min)
        assert (above <= blocks(distance, level, np.max) * spread + room).all()
        assert (below >= blocks(distance, level, np.min) / spread - room).all()


@pytest.mark.parametrize("kind", ["z", "distance"])
@pytest.mark.parametrize("name", CASES)
def test_metric_depth_comes_back(device: hizvk.Device, name: str, kind: Any) -> None:
    camera, _ = CASES[name]
    depth = np.random.default_rng(6).uniform(1.0, 20.0, SIZE)
    found = device.pyramid(depth, camera, kind=kind).level(0, kind=kind)
    assert (np.abs(found - depth) <= 2e-7 * (depth**2 / NEAR + FAR)).all()


def test_the_far_plane(device: hizvk.Device) -> None:
    for name, (camera, _) in CASES.items():
        sky = np.full(SIZE, 0.0 if camera.reversed_z else 1.0)
        hiz = device.pyramid(sky, camera, kind=camera.depth_kind)
        for kind in ("z", "distance"):
            far = hiz.level(2, kind=kind)  # type: ignore[arg-type]
            if "infinite" in name:
                assert np.isposinf(far).all(), name
            elif kind == "z":
                np.testing.assert_allclose(far, FAR, rtol=1e-5)


def test_an_oblique_near_plane(device: hizvk.Device) -> None:
    """NDC depth depends on the pixel as well (Lengyel 2005); level 0 knows the pixel."""
    clip = np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0.2, 0.1, 1.0, -0.5], [0, 0, 1.0, 0]])
    camera = hizvk.Camera.from_matrices(
        clip_from_camera=clip, camera_from_world=np.eye(4), size=SIZE, reversed_z=False
    )
    z = np.random.default_rng(7).uniform(2.0, 9.0, SIZE)
    x = ((np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2 - 1)[None] * z
    y = (1 - (np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2)[:, None] * z
    ndc = (0.2 * x + 0.1 * y + z - 0.5) / z
    inside = (ndc >= 0.0) & (ndc <= 1.0)
    assert inside.mean() > 0.5
    found = device.pyramid(ndc, camera, kind="ndc").level(0, kind="z")
    np.testing.assert_allclose(found[inside], z[inside], rtol=1e-5)


def test_a_bare_orthographic_matrix_is_refused(device: hizvk.Device) -> None:
    camera = hizvk.Camera.from_matrices(np.eye(4), size=SIZE, reversed_z=False)
    hiz = device.pyramid(np.full(SIZE, 0.5), camera, kind="ndc")
    for kind in ("z", "distance"):
        with pytest.raises(ValueError, match=r'^kind: expected "ndc" for an orthographic .*pose'):
            hiz.level(0, kind=kind)  # type: ignore[arg-type]
    assert hiz.level(1, kind="reversed_ndc").max() == 0.5


def test_a_rendered_image(device: hizvk.Device) -> None:
    camera, _ = CASES["reversed infinite"]
    forward = np.subtract(TARGET, EYE) / np.linalg.norm(np.subtract(TARGET, EYE))
    square = np.array([[-90.0, -90, 0], [90, -90, 0], [90, 90, 0], [-90, 90, 0]])
    right = np.cross(forward, (0, 1, 0))
    right /= np.linalg.norm(right)
    corners = EYE + 12.5 * forward + square[:, :1] * right
    corners += square[:, 1:2] * np.cross(right, forward)
    image = device.render_depth(device.occluders(corners, [[0, 1, 2], [0, 2, 3]]), camera)
    np.testing.assert_allclose(image.numpy(kind="z"), 12.5, rtol=1e-5)
    np.testing.assert_allclose(image.numpy(kind="distance"), 12.5 * lengths(camera), rtol=1e-5)
    np.testing.assert_allclose(image.numpy(), NEAR / 12.5, rtol=1e-5)


#: Factors of a matrix's rows: the squares of what they make overflow float64, or vanish.
ROW_FACTORS = [
    (1e-200, 1.0, 1.0, 1.0),
    (1.0, 1e-300, 1.0, 1.0),
    (1e-170, 1e-290, 1e-200, 1.0),
    (1e200, 1e180, 1.0, 1.0),
    (1.0, 1.0, 1.0, 1e200),
    (1e-300, 1e-300, 1e-300, 1e-300),
]


STRETCHED = [
    (name, factors)
    for name in ("reversed infinite", "orthographic")
    for factors in ROW_FACTORS
    # A depth row far shorter than the constant of w is that of a singular matrix.
    if name != "orthographic" or factors[3] <= factors[2]
]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("name", "factors"), STRETCHED)
def test_rows_of_lengths_far_apart(name: str, factors: tuple[float, float, float, float]) -> None:
    """Factors of the rows stretch the image, and leave the eye and the axes where they are."""
    matrix = CASES[name][0].clip_from_world * np.array(factors)[:, None]
    camera = hizvk.Camera.from_matrices(matrix, size=SIZE, reversed_z=name != "orthographic")
    seen = RayView(camera)
    forward = np.subtract(TARGET, EYE) / np.linalg.norm(np.subtract(TARGET, EYE))
    right = np.cross(forward, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    np.testing.assert_allclose(seen.forward, forward, atol=1e-12)
    np.testing.assert_allclose(seen.right, right, atol=1e-9)
    np.testing.assert_allclose(seen.up, np.cross(right, forward), atol=1e-9)
    if name != "orthographic":
        assert seen.eye is not None
        np.testing.assert_allclose(seen.eye, EYE, rtol=1e-9)
    assert not np.isnan(seen.ray_lengths() if seen.eye is not None else 0.0).any()
    assert not np.isnan(seen.depth_of(np.full((1, 1), 0.5))).any()


def test_rows_that_float64_cannot_hold() -> None:
    matrix = (
        CASES["reversed infinite"][0].clip_from_world * np.array([1e200, 1, 1, 1e-200])[:, None]
    )
    camera = hizvk.Camera.from_matrices(matrix, size=SIZE, reversed_z=True)
    with pytest.raises(ValueError, match=r"^camera: expected a matrix whose w row is of about"):
        RayView(camera)
