"""What cameras project, against positions worked out by hand; and cameras as values."""

import copy
import pickle

import numpy as np
import numpy.typing as npt
import pytest

import hizvk


def project(camera: hizvk.Camera, point: tuple[float, float, float]) -> tuple[float, float, float]:
    """Column, row (0.5 is the first pixel's centre) and NDC depth of a world position."""
    x, y, z, w = camera.clip_from_world @ np.array([*point, 1.0])
    height, width = camera.size
    return (x / w + 1) * width / 2, (1 - y / w) * height / 2, z / w


def test_look_at_by_hand() -> None:
    # 90 degrees at depth 2: y reaches from -2 to 2; the image is twice as wide.
    camera = hizvk.Camera.look_at(
        (10, 20, 30), (10, 20, 0), fov_y_deg=90, size=(100, 200), near=0.5
    )
    assert project(camera, (10, 20, 28)) == pytest.approx((100, 50, 0.25))  # the axis; near / depth
    assert project(camera, (12, 20, 28)) == pytest.approx((150, 50, 0.25))  # right
    assert project(camera, (10, 21, 28)) == pytest.approx((100, 25, 0.25))  # up is towards row 0


@pytest.mark.parametrize(("reversed_z", "at_near", "at_far"), [(True, 1.0, 0.0), (False, 0.0, 1.0)])
def test_depth_conventions(reversed_z: bool, at_near: float, at_far: float) -> None:
    look = hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(4, 6), near=1, far=3, reversed_z=reversed_z
    )
    flat = hizvk.Camera.orthographic(
        (0, 0, 0), (0, 0, -1), height=2, size=(4, 6), near=1, far=3, reversed_z=reversed_z
    )
    for camera in (look, flat):
        assert camera.reversed_z is reversed_z
        assert camera.depth_kind == ("reversed_ndc" if reversed_z else "ndc")
        assert project(camera, (0, 0, -1))[2] == pytest.approx(at_near)
        assert project(camera, (0, 0, -3))[2] == pytest.approx(at_far)
    assert project(flat, (0, 0, -2))[2] == pytest.approx(0.5)  # linear in depth


def test_an_infinite_far_plane_is_none_or_infinity() -> None:
    cameras = [
        hizvk.Camera.look_at((0, 0, 0), (1, 0, 0), fov_y_deg=60, size=(4, 6), near=1, far=far)
        for far in (None, float("inf"), np.inf)
    ]
    assert cameras[0] == cameras[1] == cameras[2]


def test_frustum_borders_are_tangents() -> None:
    camera = hizvk.Camera.frustum(
        (0, 0, 0), (0, 0, -1), left=-1, right=3, bottom=-0.5, top=1.5, size=(20, 40), near=0.1
    )
    assert project(camera, (-2, 3, -2))[:2] == pytest.approx((0, 0))  # left top
    assert project(camera, (6, -1, -2))[:2] == pytest.approx((40, 20))  # right bottom
    assert project(camera, (0, 0, -2))[:2] == pytest.approx((10, 15))  # the axis


def test_orthographic_is_in_world_units_and_square_by_default() -> None:
    camera = hizvk.Camera.orthographic((0, 0, 5), (0, 0, 0), height=4, size=(8, 16), near=0, far=10)
    assert project(camera, (4, 2, 0)) == pytest.approx((16, 0, 0.5))
    wide = hizvk.Camera.orthographic(
        (0, 0, 5), (0, 0, 0), height=4, width=16, size=(8, 16), near=0, far=10
    )
    assert project(wide, (8, -2, -5)) == pytest.approx((16, 8, 0))


OPENCV_POSE = np.array(
    [[0.0, -1, 0, 0.5], [1, 0, 0, 0.25], [0, 0, 1, 4], [0, 0, 0, 1]]
)  # a turn about z, a shift


@pytest.mark.parametrize("skew", [0.0, 3.0])
@pytest.mark.parametrize("far", [None, 100.0])
@pytest.mark.parametrize("reversed_z", [True, False])
@pytest.mark.parametrize(("pixel_center", "shift"), [("integer", 0.5), ("half", 0.0)])
def test_opencv_pixels(
    skew: float, far: float | None, reversed_z: bool, pixel_center: str, shift: float
) -> None:
    k = np.array([[120.0, skew, 33.5], [0, 110, 21.25], [0, 0, 1]])
    given = {
        "size": (48, 64),
        "near": 0.5,
        "far": far,
        "reversed_z": reversed_z,
        "pixel_center": pixel_center,
    }
    forth = hizvk.Camera.from_opencv(
        k, camera_from_world=OPENCV_POSE, distortion=np.zeros(5), **given
    )
    back = hizvk.Camera.from_opencv(k, world_from_camera=np.linalg.inv(OPENCV_POSE), **given)
    for world in ((0.0, 0.0, 0.0), (0.3, -0.4, 1.0), (-1.0, 0.7, 20.0)):
        u, v, z = k @ (OPENCV_POSE @ np.array([*world, 1.0]))[:3]
        n, f = 0.5, far
        standard = 1 - n / z if f is None else f / (f - n) * (1 - n / z)
        expected = (u / z + shift, v / z + shift, 1 - standard if reversed_z else standard)
        assert project(forth, world) == pytest.approx(expected)
        assert project(back, world) == pytest.approx(expected)


def opengl_projection(near: float, far: float, top: float, right: float) -> npt.NDArray[np.float64]:
    """As in OpenGL's own reference for glFrustum with symmetric borders."""
    return np.array(
        [
            [near / right, 0, 0, 0],
            [0, near / top, 0, 0],
            [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)],
            [0, 0, -1, 0],
        ]
    )


def test_opengl_clip_z_is_mapped() -> None:
    gl = opengl_projection(1, 3, 1, 2)
    camera = hizvk.Camera.from_opengl(gl, camera_from_world=np.eye(4), size=(10, 20))
    assert camera.reversed_z is False
    assert project(camera, (0, 0, -1)) == pytest.approx((10, 5, 0))
    assert project(camera, (0, 0, -3)) == pytest.approx((10, 5, 1))
    assert project(camera, (2, 1, -1))[:2] == pytest.approx((20, 0))
    look = hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(10, 20), near=1, far=3, reversed_z=False
    )
    assert camera.clip_from_world == pytest.approx(look.clip_from_world)
    moved = np.eye(4)
    moved[:3, 3] = (1, 2, 3)
    placed = hizvk.Camera.from_opengl(gl, world_from_camera=moved, size=(10, 20))
    assert project(placed, (1, 2, 0)) == pytest.approx((10, 5, 1))


def test_matrices_in_one_or_two_parts() -> None:
    look = hizvk.Camera.look_at(
        (1, 2, 3), (4, 5, -6), fov_y_deg=50, size=(30, 40), near=0.2, far=50
    )
    whole = hizvk.Camera.from_matrices(look.clip_from_world, size=(30, 40), reversed_z=True)
    assert whole.clip_from_world == pytest.approx(look.clip_from_world)
    pose = np.linalg.inv(OPENCV_POSE)
    parts = hizvk.Camera.from_matrices(
        clip_from_camera=look.clip_from_world,
        camera_from_world=OPENCV_POSE,
        size=(30, 40),
        reversed_z=True,
    )
    other = hizvk.Camera.from_matrices(
        clip_from_camera=look.clip_from_world,
        world_from_camera=pose,
        size=(30, 40),
        reversed_z=True,
    )
    assert parts.clip_from_world == pytest.approx(look.clip_from_world @ OPENCV_POSE)
    assert other.clip_from_world == pytest.approx(parts.clip_from_world)


def test_integers_lists_and_small_floats_are_numbers_too() -> None:
    exact = hizvk.Camera.look_at(
        (0.0, 0.5, 2.0), (0.0, 0.5, 0.0), fov_y_deg=60.0, size=(4, 6), near=0.5
    )
    for kind in (np.float16, np.float32, np.float64, np.dtype(">f8")):
        eye = np.array([0, 0.5, 2], dtype=kind)
        eye.setflags(write=False)
        camera = hizvk.Camera.look_at(
            eye, [0, 0.5, 0], fov_y_deg=np.float32(60), size=np.array([4, 6]), near=np.array(0.5)
        )
        assert camera == exact


# --- cameras as values ---


def shifted(by: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[0, 3] = by
    return matrix


def all_kinds() -> list[hizvk.Camera]:
    look = {"eye": (1, 2, 3), "target": (4, 5, -6), "size": (30, 40), "near": 0.2, "far": 50}
    k = np.array([[120.0, 1, 33.5], [0, 110, 21.25], [0, 0, 1]])
    gl = opengl_projection(1, 3, 1, 2)
    return [
        hizvk.Camera.look_at(**look, fov_y_deg=50),
        hizvk.Camera.look_at(**look, fov_y_deg=50, reversed_z=False),
        hizvk.Camera.frustum(**look, left=-1, right=0.5, bottom=-1, top=1),
        hizvk.Camera.orthographic(**look, height=10),
        hizvk.Camera.from_opencv(
            k, pixel_center="half", world_from_camera=OPENCV_POSE, size=(30, 40), near=0.1
        ),
        hizvk.Camera.from_opencv(
            k, pixel_center="half", camera_from_world=OPENCV_POSE, size=(30, 40), near=0.1
        ),
        hizvk.Camera.from_opencv(
            k, pixel_center="integer", camera_from_world=OPENCV_POSE, size=(30, 40), near=0.1
        ),
        hizvk.Camera.from_colmap(
            "RADIAL",
            [90, 33, 21, 0, 0],
            qvec=[0.5, 0.5, 0.5, -0.5],
            tvec=[1, 2, 3],
            size=(30, 40),
            near=0.1,
            far=9,
        ),
        hizvk.Camera.from_opengl(
            k=k, pixel_center="integer", camera_from_world=shifted(1), size=(30, 40), near=0.1
        ),
        hizvk.Camera.from_opengl(
            fov_x_deg=70, world_from_camera=shifted(1), size=(30, 40), near=0.1
        ),
        hizvk.Camera.from_opengl(
            fov_y_deg=70, world_from_camera=shifted(1), size=(30, 40), near=0.1, reversed_z=False
        ),
        hizvk.Camera.from_opengl(gl, camera_from_world=shifted(1), size=(30, 40)),
        hizvk.Camera.from_matrices(gl, size=(30, 40), reversed_z=False),
        hizvk.Camera.from_matrices(
            clip_from_camera=gl, camera_from_world=shifted(2), size=(30, 40), reversed_z=False
        ),
        hizvk.Camera.look_at(**look, fov_y_deg=50).resized((15, 20)).resized((3, 5)),
    ]


def test_cameras_are_values() -> None:
    cameras = all_kinds()
    for number, (camera, again) in enumerate(zip(cameras, all_kinds(), strict=True)):
        for same in (
            again,
            pickle.loads(pickle.dumps(camera)),
            copy.copy(camera),
            copy.deepcopy(camera),
        ):
            assert same == camera
            assert hash(same) == hash(camera)
            assert repr(same) == repr(camera)
            assert same.clip_from_world.tobytes() == camera.clip_from_world.tobytes()
        assert [camera == other for other in cameras].count(True) == 1, number
    assert cameras[0] != "a camera"
    assert len({*cameras, *all_kinds()}) == len(cameras)


def test_repr_says_how_to_make_it() -> None:
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(4, 6), near=0.5)
    assert repr(camera) == (
        "Camera.look_at(eye=(0.0, 0.0, 0.0), target=(0.0, 0.0, -1.0), up=(0.0, 1.0, 0.0), "
        "fov_y_deg=60.0, size=(4, 6), near=0.5, far=None, reversed_z=True)"
    )
    assert eval(repr(camera), {"Camera": hizvk.Camera}) == camera
    assert repr(camera.resized((2, 3))) == repr(camera) + ".resized((2, 3))"
    pose = hizvk.Camera.from_opengl(
        opengl_projection(1, 3, 1, 2), camera_from_world=np.eye(4), size=(4, 6)
    )
    assert (
        repr(pose) == "Camera.from_opengl(projection=<4x4>, camera_from_world=<4x4>, size=(4, 6))"
    )
    colmap = hizvk.Camera.from_colmap(
        "PINHOLE", [9, 9, 3, 2], qvec=[1, 0, 0, 0], tvec=[0, 0, 1], size=(4, 6), near=0.5
    )
    assert repr(colmap) == (
        "Camera.from_colmap(model='PINHOLE', params=<4>, camera_from_world=<4x4>, size=(4, 6), "
        "near=0.5, far=None, reversed_z=True)"
    )


def test_resized_keeps_the_view() -> None:
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(40, 60), near=0.5)
    small = camera.resized((20, 15))
    assert small.size == (20, 15)
    column, row, depth = project(camera, (0.1, 0.2, -1))
    assert project(small, (0.1, 0.2, -1)) == pytest.approx((column / 4, row / 2, depth))


def test_a_camera_far_from_the_origin_loses_nothing() -> None:
    """The eye is kept apart, so that the rows about it are those of the camera at the origin."""
    near = hizvk.Camera.look_at((0, 0, 0), (3, -1, 2), fov_y_deg=60, size=(40, 60), near=0.5)
    far = hizvk.Camera.look_at(
        (2.0**30, -(2.0**31), 0),
        (2.0**30 + 3, -(2.0**31) - 1, 2),
        fov_y_deg=60,
        size=(40, 60),
        near=0.5,
    )
    assert near._inner.rows() == far._inner.rows()
    assert far._inner.origin() == [2.0**30, -(2.0**31), 0.0]


@pytest.mark.parametrize("exponent", [-1000, -600, -70, 70, 600, 1000])
def test_the_factor_of_a_matrix_means_nothing(device: hizvk.Device, exponent: int) -> None:
    """Squares of such numbers leave float64, and yet every answer is that of the plain matrix."""
    look = hizvk.Camera.look_at((1, 2, 3), (0, 0, 0), fov_y_deg=60, size=(8, 12), near=0.1)
    flat = hizvk.Camera.orthographic(
        (1, 2, 3), (0, 0, 0), height=4, size=(8, 12), near=0.1, far=9, reversed_z=False
    )
    points = hizvk.Points([(0.1, 0.2, 0.3), (-0.3, 0.1, 0.0)])
    image = np.full((8, 12), 0.4, np.float32)
    for plain in (look, flat):
        one, scaled = (
            hizvk.Camera.from_matrices(
                factor * plain.clip_from_world, size=(8, 12), reversed_z=plain.reversed_z
            )
            for factor in (1.0, 2.0**exponent)
        )
        for expected, got in zip(
            one.project(points.positions), scaled.project(points.positions), strict=True
        ):
            assert np.array_equal(expected, got, equal_nan=True)
        discs = [hizvk.depth_from_points(points, camera, radius=0.4) for camera in (one, scaled)]
        assert (discs[0] == discs[1]).all()
        assert 0 < (discs[0] == discs[0].min()).mean() < 1
        if plain is look:
            depths = [
                device.pyramid(image, camera, kind=camera.depth_kind).level(1, kind="distance")
                for camera in (one, scaled)
            ]
            assert (depths[0] == depths[1]).all()
