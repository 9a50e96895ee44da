"""Cameras in the form in which other tools have them.

They are compared with each tool's own projection, which is written out here.

A tool defines where a camera's point is in the image.
In OpenCV it is ``u = fx X/Z + cx``, where the first pixel's centre is 0.
In COLMAP it is the same, where the first pixel's centre is 0.5.
No expectation uses the library's matrices.
"""

import inspect
import re
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

import hizvk

if TYPE_CHECKING:
    from collections.abc import Callable

Floats = npt.NDArray[np.float64]
ROOT = Path(__file__).resolve().parent.parent

SIZE = (24, 32)
FX, FY, CX, CY = 30.0, 33.0, 14.25, 11.5
K = np.array([[FX, 0, CX], [0, FY, CY], [0, 0, 1]])
#: World to camera: a turn by 120 degrees about (1, 1, 1), which permutes the axes, and a shift.
ROTATION = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
SHIFT = np.array([0.5, -0.25, 2.0])
QVEC = (0.5, 0.5, 0.5, 0.5)  # w, x, y, z
GIVEN = {"size": SIZE, "near": 0.1}


def matrix(rotation: Floats = ROTATION, shift: Floats = SHIFT) -> Floats:
    return np.vstack([np.column_stack([rotation, shift]), [0.0, 0, 0, 1]])


CAMERA_FROM_WORLD = matrix()
WORLD_FROM_CAMERA = matrix(ROTATION.T, -ROTATION.T @ SHIFT)
#: The same poses for a camera that looks along -z with y up.
TURNED = np.diag([1.0, -1, -1, 1])


class Tool(NamedTuple):
    """A tool's camera in this library, and where the tool's pixel coordinates begin."""

    camera: hizvk.Camera
    focal: tuple[float, float]
    principal: tuple[float, float]
    first_center: float
    """The coordinate of the first pixel's centre, along both axes."""
    forward: float
    """1 if the camera looks along +z with y down, -1 if it looks along -z with y up."""

    def world(self, column: Any, row: Any, depth: Any) -> Floats:
        """World positions at `depth` that the tool shows at these columns and rows.

        Columns and rows are distances from the image's corner.
        """
        u = np.asarray(column) - 0.5 + self.first_center
        v = np.asarray(row) - 0.5 + self.first_center
        x = (u - self.principal[0]) / self.focal[0] * depth
        y = (v - self.principal[1]) / self.focal[1] * depth
        in_camera = np.stack([x, self.forward * y, self.forward * np.asarray(depth)], axis=-1)
        axes = ROTATION if self.forward > 0 else np.diag([1.0, -1, -1]) @ ROTATION
        shift = SHIFT if self.forward > 0 else SHIFT * (1, -1, -1)
        return np.asarray((in_camera - shift) @ axes)  # the inverse of a rotation is its transpose


FOV_X = 2 * np.degrees(np.arctan(SIZE[1] / 2 / FX))
FOV_Y = 2 * np.degrees(np.arctan(SIZE[0] / 2 / FY))
MIDDLE = (SIZE[1] / 2, SIZE[0] / 2)
GL = {"world_from_camera": WORLD_FROM_CAMERA @ TURNED, **GIVEN}

TOOLS = {
    "OpenCV": Tool(
        hizvk.Camera.from_opencv(
            K, pixel_center="integer", camera_from_world=CAMERA_FROM_WORLD, **GIVEN
        ),
        (FX, FY), (CX, CY), 0.0, 1.0,
    ),
    "gsplat": Tool(
        hizvk.Camera.from_opencv(
            K, pixel_center="half", camera_from_world=CAMERA_FROM_WORLD, **GIVEN
        ),
        (FX, FY), (CX, CY), 0.5, 1.0,
    ),
    "COLMAP": Tool(
        hizvk.Camera.from_colmap("PINHOLE", [FX, FY, CX, CY], qvec=QVEC, tvec=SHIFT, **GIVEN),
        (FX, FY), (CX, CY), 0.5, 1.0,
    ),
    "pycolmap": Tool(
        hizvk.Camera.from_colmap(
            "SIMPLE_RADIAL", [FX, CX, CY, 0], camera_from_world=CAMERA_FROM_WORLD[:3], **GIVEN
        ),
        (FX, FX), (CX, CY), 0.5, 1.0,
    ),
    "nerfstudio": Tool(
        hizvk.Camera.from_opengl(k=K, pixel_center="half", **GL), (FX, FY), (CX, CY), 0.5, -1.0
    ),
    "OpenGL axes, integer": Tool(
        hizvk.Camera.from_opengl(k=K, pixel_center="integer", **GL), (FX, FY), (CX, CY), 0.0, -1.0
    ),
    "Blender": Tool(hizvk.Camera.from_opengl(fov_x_deg=FOV_X, **GL), (FX, FX), MIDDLE, 0.5, -1.0),
    "pyrender": Tool(hizvk.Camera.from_opengl(fov_y_deg=FOV_Y, **GL), (FY, FY), MIDDLE, 0.5, -1.0),
}  # fmt: skip


def project(camera: hizvk.Camera, points: Floats) -> tuple[Floats, Floats]:
    """Columns and rows from the image's corner, so the first pixel's centre is (0.5, 0.5)."""
    x, y, _, w = camera.clip_from_world @ np.vstack([points.T, np.ones(len(points))])
    height, width = camera.size
    return (x / w + 1) * width / 2, (1 - y / w) * height / 2


# -- pixel centres ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TOOLS)
def test_a_pixels_centre_lands_on_it(name: str) -> None:
    tool = TOOLS[name]
    row, column = (side.ravel() + 0.5 for side in np.mgrid[: SIZE[0], : SIZE[1]])
    depth = np.linspace(1.0, 50.0, row.size)
    columns, rows = project(tool.camera, tool.world(column, row, depth))
    np.testing.assert_allclose(columns, column, rtol=0, atol=1e-10)
    np.testing.assert_allclose(rows, row, rtol=0, atol=1e-10)


def scene(tool: Tool) -> tuple[hizvk.Spheres, Floats]:
    """Points just in front of the wall that the tool shows in their pixel, and the walls' depth."""
    rng = np.random.default_rng(7)
    walls = rng.uniform(4.0, 40.0, SIZE)
    row, column = (side.ravel() for side in np.mgrid[: SIZE[0], : SIZE[1]])
    inside = rng.uniform(0.1, 0.9, (2, row.size))
    return hizvk.Spheres(
        tool.world(column + inside[0], row + inside[1], 0.99 * walls.ravel()), 0.0
    ), walls


@pytest.mark.parametrize("name", TOOLS)
def test_what_a_tool_shows_is_not_culled(device: hizvk.Device, name: str) -> None:
    points, walls = scene(TOOLS[name])
    for options in ({}, {"footprint": 8}, {"descent": 64, "fit": "volume"}):
        seen = hizvk.visible(
            points, TOOLS[name].camera, depth=walls, kind="z", device=device, **options
        )
        assert seen.all()


@pytest.mark.parametrize(("right", "wrong"), [
    ("OpenCV", "gsplat"), ("gsplat", "OpenCV"), ("COLMAP", "OpenCV"),
    ("nerfstudio", "OpenGL axes, integer"),
])  # fmt: skip
def test_half_a_pixel_off_hides_what_shows(device: hizvk.Device, right: str, wrong: str) -> None:
    """Why there is no default: of 768 visible points the wrong choice culls about 300."""
    points, walls = scene(TOOLS[right])
    seen = hizvk.visible(points, TOOLS[wrong].camera, depth=walls, kind="z", device=device)
    assert np.count_nonzero(~seen) > 150


def test_a_missing_or_unknown_word_is_told_the_way() -> None:
    """Python's own error would only name the parameter."""
    with pytest.raises(
        TypeError, match=r"^pixel_center: expected \"integer\" .*OpenCV.* or \"half\" .*COLMAP"
    ):
        hizvk.Camera.from_opencv(K, camera_from_world=np.eye(4), **GIVEN)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match=r"^pixel_center: expected \"integer\""):
        hizvk.Camera.from_opengl(k=K, camera_from_world=np.eye(4), **GIVEN)
    assert (
        inspect.signature(hizvk.Camera.from_opencv).parameters["pixel_center"].default
        is inspect.Parameter.empty
    )
    sees = {"pixel_center": "half", **GIVEN}
    for maker, arguments in (
        (hizvk.Camera.from_opencv, sees),
        (hizvk.Camera.from_opengl, sees),
        (hizvk.Camera.from_matrices, {}),
    ):  # fmt: skip
        for word in ("R", "t", "rotation", "tvec", "viewmat", "c2w"):
            with pytest.raises(
                TypeError,
                match=rf"^{word}: .*camera_from_world=\(R, t\) where camera = R @ world \+ t",
            ):
                maker(K, **{word: np.eye(3)}, **arguments)
    with pytest.raises(TypeError, match=r"^colour: expected no such parameter; all are k, "):
        hizvk.Camera.from_opencv(
            K, pixel_center="half", camera_from_world=np.eye(4), colour=1, **GIVEN
        )  # type: ignore[call-arg]
    boxes: dict[str, Any] = {"centers": np.zeros((1, 3)), "half_sizes": 1.0}
    with pytest.raises(
        TypeError, match=r"^order: expected \"wxyz\" .*nuScenes.* or \"xyzw\" .*SciPy"
    ):
        hizvk.OrientedBoxes.from_quaternions(  # type: ignore[call-arg]
            quaternions=[[1, 0, 0, 0]], **boxes
        )
    with pytest.raises(
        TypeError, match=r"^up: expected the axis of the turn, \(0, 0, 1\) where z is up"
    ):
        hizvk.OrientedBoxes.from_yaw(yaw_deg=0.0, **boxes)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match=r"^yaw: expected yaw_deg, in degrees: np.degrees\(yaw\)"):
        hizvk.OrientedBoxes.from_yaw(yaw=0.0, up=(0, 0, 1), **boxes)  # type: ignore[call-arg]


# -- poses -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["camera_from_world", "world_from_camera"])
def test_every_form_of_a_pose(name: str) -> None:
    pose = CAMERA_FROM_WORLD if name == "camera_from_world" else WORLD_FROM_CAMERA
    rotation, shift = pose[:3, :3], pose[:3, 3]
    makers: list[Callable[..., hizvk.Camera]] = [
        lambda **pose: hizvk.Camera.from_opencv(K, pixel_center="half", **pose, **GIVEN),
        lambda **pose: hizvk.Camera.from_colmap("PINHOLE", [FX, FY, CX, CY], **pose, **GIVEN),
        lambda **pose: hizvk.Camera.from_opengl(fov_y_deg=50, **pose, **GIVEN),
        lambda **pose: hizvk.Camera.from_opengl(np.diag([1.0, 1, -1, 1]), **pose, size=SIZE),
        lambda **pose: hizvk.Camera.from_matrices(
            clip_from_camera=np.eye(4), **pose, size=SIZE, reversed_z=False
        ),
    ]
    for maker in makers:
        whole = maker(**{name: pose})
        for form in (
            pose[:3], pose[:3].tolist(), pose.tolist(), (rotation, shift), [rotation, shift],
            (rotation.tolist(), shift[:, None]), (rotation, shift[None]),
        ):  # fmt: skip
            assert maker(**{name: form}) == whole
    # The meaning, worked out by hand.
    # The camera of solvePnP's R and t sees the world point R^T (p - t) at p.
    camera = hizvk.Camera.from_opencv(
        K, pixel_center="integer", camera_from_world=(ROTATION, SHIFT.reshape(3, 1)), **GIVEN
    )
    columns, rows = project(camera, ((np.array([[0.0, 0, 5]]) - SHIFT) @ ROTATION))
    assert (columns[0], rows[0]) == pytest.approx((CX + 0.5, CY + 0.5))


def turned_by(quaternion: tuple[float, ...], point: Floats) -> Floats:
    """The point turned by a unit quaternion (w, x, y, z).

    It is q p q*, by Hamilton's products and without a matrix.
    """

    def times(a: Any, b: Any) -> tuple[float, ...]:
        w, x, y, z = a
        s, i, j, k = b
        return (
            w * s - x * i - y * j - z * k,
            w * i + x * s + y * k - z * j,
            w * j - x * k + y * s + z * i,
            w * k + x * j - y * i + z * s,
        )

    w, x, y, z = quaternion
    return np.array(times(times(quaternion, (0.0, *point)), (w, -x, -y, -z))[1:])


def test_colmaps_own_example() -> None:
    """The image and camera of COLMAP's description of its format, by COLMAP's own projection."""
    quaternion, shift = (
        (0.851773, 0.0165051, 0.503764, -0.142941),
        np.array([-0.737434, 1.02973, 3.74354]),
    )
    camera = hizvk.Camera.from_colmap(
        "SIMPLE_PINHOLE",
        [2559.81, 1536, 1152],
        qvec=quaternion,
        tvec=shift,
        size=(2304, 3072),
        near=0.1,
    )
    for point in ([1.67241, 0.292931, 0.609726], [2.01848, 0.108877, -0.0260841], [0.0, 0, 0]):
        x, y, z = turned_by(quaternion, np.array(point)) + shift
        columns, rows = project(camera, np.array([point]))
        expected = (2559.81 * x / z + 1536, 2559.81 * y / z + 1152)
        assert (columns[0], rows[0]) == pytest.approx(
            expected, abs=2e-2
        )  # its quaternion has six digits


COLMAP_ZEROS = {
    "SIMPLE_PINHOLE": (1, 0), "PINHOLE": (2, 0), "SIMPLE_RADIAL": (1, 1), "RADIAL": (1, 2),
    "OPENCV": (2, 4), "FULL_OPENCV": (2, 8), "FOV": (2, 1), "SIMPLE_DIVISION": (1, 1),
    "DIVISION": (2, 1),
}  # fmt: skip


@pytest.mark.parametrize("model", COLMAP_ZEROS)
def test_a_colmap_model_is_a_pinhole_if_nothing_is_bent(model: str) -> None:
    focals, bent = COLMAP_ZEROS[model]
    focal = [FX, FY][:focals]
    pose = {"qvec": QVEC, "tvec": SHIFT, **GIVEN}
    straight = hizvk.Camera.from_colmap("PINHOLE", [focal[0], focal[-1], CX, CY], **pose)
    assert hizvk.Camera.from_colmap(model, [*focal, CX, CY, *[0.0] * bent], **pose) == straight
    for place in range(bent):
        params = [*focal, CX, CY, *[0.0] * bent]
        params[focals + 2 + place] = -1e-12
        with pytest.raises(
            ValueError, match=r"^params: .*no distortion.*=-1e-12 of .*COLMAP's image_undistorter"
        ):
            hizvk.Camera.from_colmap(model, params, **pose)

    class Enumeration:  # like pycolmap's CameraModelId
        name = model

    named = hizvk.Camera.from_colmap(
        Enumeration(),  # type: ignore[arg-type]
        [*focal, CX, CY, *[0.0] * bent],
        **pose,
    )
    assert named == straight


@pytest.mark.parametrize(
    "model", ["OPENCV_FISHEYE", "SIMPLE_FISHEYE", "RADIAL_FISHEYE", "EQUIRECTANGULAR"]
)
def test_a_fisheye_is_no_pinhole_with_zeros_either(model: str) -> None:
    """At 45 degrees an equidistant fisheye shows a point at f pi / 4, and a pinhole shows it at f.

    So zeros would hide visible things.
    """
    with pytest.raises(
        ValueError, match=r"^model: .*no pinhole with any numbers; run COLMAP's image_undistorter"
    ):
        hizvk.Camera.from_colmap(
            model, [FX, FY, CX, CY, 0, 0, 0, 0], qvec=QVEC, tvec=SHIFT, **GIVEN
        )


def test_one_pose_of_a_colmap_image() -> None:
    def make(**pose: Any) -> hizvk.Camera:
        return hizvk.Camera.from_colmap("PINHOLE", [FX, FY, CX, CY], **pose, **GIVEN)

    assert make(qvec=QVEC, tvec=SHIFT) == make(camera_from_world=CAMERA_FROM_WORLD)
    assert make(qvec=[-part for part in QVEC], tvec=SHIFT) == make(
        camera_from_world=CAMERA_FROM_WORLD
    )
    with pytest.raises(
        ValueError, match=r"^qvec, tvec: expected both as images.txt has them, or camera_from_world"
    ):
        make()
    with pytest.raises(
        ValueError, match=r"^qvec, tvec: expected alone, or camera_from_world instead; got both"
    ):
        make(qvec=QVEC, tvec=SHIFT, camera_from_world=np.eye(4))
    with pytest.raises(ValueError, match=r"^camera_from_world, world_from_camera: .*got both"):
        make(world_from_camera=np.eye(4), camera_from_world=np.eye(4))


# -- OpenGL's axes ---------------------------------------------------------------------------------


def test_a_camera_matrix_is_pyrenders_projection() -> None:
    """The matrix of pyrender.IntrinsicsCamera.get_projection_matrix, copied from its source."""
    near, far = 0.5, 20.0
    height, width = SIZE
    projection = np.zeros((4, 4))
    projection[0, 0], projection[1, 1] = 2 * FX / width, 2 * FY / height
    projection[0, 2], projection[1, 2] = 1 - 2 * CX / width, 2 * CY / height - 1
    projection[3, 2] = -1
    projection[2, 2], projection[2, 3] = (far + near) / (near - far), 2 * far * near / (near - far)
    pose = {"world_from_camera": WORLD_FROM_CAMERA @ TURNED, "size": SIZE}
    by_k = hizvk.Camera.from_opengl(
        k=K, pixel_center="half", **pose, near=near, far=far, reversed_z=False
    )
    by_projection = hizvk.Camera.from_opengl(projection, **pose)
    np.testing.assert_allclose(
        by_k.clip_from_world, by_projection.clip_from_world, rtol=0, atol=1e-12
    )
    assert by_k.depth_kind == by_projection.depth_kind == "ndc"


def test_a_skew_in_either_axes() -> None:
    skewed = K.copy()
    skewed[0, 1] = 2.5
    down = hizvk.Camera.from_opencv(
        skewed, pixel_center="half", camera_from_world=CAMERA_FROM_WORLD, **GIVEN
    )
    up = hizvk.Camera.from_opengl(k=skewed, pixel_center="half", **GL)
    point = np.array([[0.3, -0.2, 7.0]])
    u, v, z = skewed @ (ROTATION @ point[0] + SHIFT)
    for camera in (down, up):
        columns, rows = project(camera, point)
        assert (columns[0], rows[0]) == pytest.approx((u / z, v / z))


def test_one_way_to_say_what_an_opengl_camera_sees() -> None:
    pose = {"world_from_camera": np.eye(4), "size": SIZE}
    by_angle = hizvk.Camera.from_opengl(fov_y_deg=60, **pose, near=0.1)
    look = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.1)
    np.testing.assert_allclose(by_angle.clip_from_world, look.clip_from_world, rtol=0, atol=1e-15)
    assert by_angle.reversed_z  # as in every constructor that takes near
    assert not hizvk.Camera.from_opengl(fov_y_deg=60, **pose, near=0.1, reversed_z=False).reversed_z
    with pytest.raises(
        ValueError, match=r"^projection, k, fov_x_deg, fov_y_deg: .*got fov_x_deg and fov_y_deg"
    ):
        hizvk.Camera.from_opengl(fov_x_deg=60, fov_y_deg=60, **pose, near=0.1)
    gl = np.diag([1.0, 1, -1, 1])
    for name, value in {"near": 0.1, "far": 9.0, "reversed_z": False}.items():
        with pytest.raises(
            TypeError, match=rf"^{name}: expected nothing beside a projection, which has its own"
        ):
            hizvk.Camera.from_opengl(gl, **pose, **{name: value})
    for more in ({"pixel_center": "half"}, {"distortion": np.zeros(4)}):
        with pytest.raises(
            TypeError,
            match=rf"^{next(iter(more))}: expected beside k alone, got .* beside fov_x_deg",
        ):
            hizvk.Camera.from_opengl(fov_x_deg=60, **more, **pose, near=0.1)
        with pytest.raises(
            TypeError,
            match=rf"^{next(iter(more))}: expected beside k alone, got .* beside projection",
        ):
            hizvk.Camera.from_opengl(gl, **more, **pose)


def test_what_pyrenders_depth_costs() -> None:
    """The loss that docs/conventions.md states as less than 2^-20.

    It is that of a buffer of 24 bits, and of pyrender's conversion back in float32.
    """
    rng = np.random.default_rng(5)
    exact = rng.random(200_000)
    for near, far in ((1.0, 2.0), (0.05, 100.0), (1e-3, 1e4), (0.01, 1e5), (3.0, 7.0)):
        for neighbour in (0, 1):  # a buffer may take either
            stored = ((np.floor(exact * (2**24 - 1)) + neighbour) / (2**24 - 1)).astype(np.float32)
            signed = 2.0 * stored - 1.0
            z = (2.0 * near * far / (far + near - signed * (far - near)))[stored < 1.0]
            assert z.dtype == np.float32
            again = far / (far - near) * (1.0 - near / z.astype(np.float64))
            assert np.abs(again - exact[stored < 1.0]).max() < 2.0**-20


# -- boxes -----------------------------------------------------------------------------------------


def test_yaw_turns_from_x_to_y_where_z_is_up() -> None:
    boxes = hizvk.OrientedBoxes.from_yaw(
        np.zeros((4, 3)), [2.0, 1.0, 0.5], np.array([0.0, 90, -90, 540]), up=(0, 0, 3)
    )
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    for rotation, expected in zip(
        boxes.rotations, (np.eye(3), quarter, quarter.T, quarter @ quarter), strict=True
    ):
        assert (rotation == expected).all()  # quarter turns are exact
    assert boxes.half_sizes.tolist() == [[2.0, 1.0, 0.5]] * 4
    # KITTI's devkit has R = [c 0 s; 0 1 0; -s 0 c] about the camera's y.
    # A car at ry = -pi/2 points along +z.
    ry = -1.3
    kitti = hizvk.OrientedBoxes.from_yaw(
        np.zeros((1, 3)), 1.0, np.degrees(ry), up=(0, 1, 0)
    ).rotations[0]
    c, s = np.cos(ry), np.sin(ry)
    np.testing.assert_allclose(kitti, [[c, 0, s], [0, 1, 0], [-s, 0, c]], rtol=0, atol=1e-15)
    # Any axis and angle, compared with the quaternion of the same turn (cos, sin * axis).
    axis, angles = np.array([1.0, -2, 0.5]), np.arange(-400.0, 400.0, 13.0)
    turns = hizvk.OrientedBoxes.from_yaw(np.zeros((len(angles), 3)), 1.0, angles, up=axis).rotations
    for turned, angle in zip(turns, angles, strict=True):
        half = np.radians(angle) / 2
        quaternion = (np.cos(half), *(np.sin(half) * axis / np.linalg.norm(axis)))
        for k in range(3):
            np.testing.assert_allclose(
                turned[:, k], turned_by(quaternion, np.eye(3)[k]), rtol=0, atol=1e-14
            )


@pytest.mark.parametrize("order", ["wxyz", "xyzw"])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_quaternions_in_either_order_and_of_any_length(order: Any, dtype: Any) -> None:
    rng = np.random.default_rng(3)
    unit = rng.normal(size=(50, 4))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    most = 200 if dtype == np.float64 else 30  # their squares overflow and underflow
    given = (unit * 10.0 ** rng.integers(-most, most, (50, 1))).astype(dtype)
    if order == "xyzw":
        given = np.roll(given, -1, axis=1)
    boxes = hizvk.OrientedBoxes.from_quaternions(np.zeros((50, 3)), 1.0, given, order=order)
    expected = [[turned_by(tuple(q), axis) for axis in np.eye(3)] for q in unit]
    np.testing.assert_allclose(
        boxes.rotations.transpose(0, 2, 1),
        expected,
        rtol=0,
        atol=1e-14 if dtype == np.float64 else 1e-6,
    )


def test_transforms_in_every_shape() -> None:
    scaled = np.array([[0.0, -2, 0, 5], [3, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]])
    for given in (
        scaled,
        scaled[None],
        scaled[:3],
        scaled[None, :3],
        scaled.tolist(),
        scaled.astype(np.float32),
    ):
        boxes = hizvk.OrientedBoxes.from_transforms(given)
        assert boxes.centers.tolist() == [[5.0, 6, 7]]
        assert boxes.half_sizes.tolist() == [[0.5, 0.5, 0.5]]
        assert boxes.rotations.tolist() == [scaled[:3, :3].tolist()]
    assert hizvk.OrientedBoxes.from_transforms(scaled, [1.0, 2, 3]).half_sizes.tolist() == [
        [1.0, 2, 3]
    ]


def test_boxes_that_are_none_are_kept_and_counted(device: hizvk.Device) -> None:
    nan = np.full((4, 4), np.nan)
    only_row = np.eye(4)
    only_row[3] = np.nan
    camera = hizvk.Camera.look_at((0, 0, 5), (0, 0, 0), fov_y_deg=60, size=SIZE, near=0.1)
    lists = [
        hizvk.OrientedBoxes.from_transforms(np.stack([np.eye(4), nan, only_row])),
        hizvk.OrientedBoxes.from_quaternions(
            np.zeros((3, 3)), 0.5, [[1, 0, 0, 0], [0, 0, 0, 0], [np.inf, 0, 0, 1]], order="wxyz"
        ),
        hizvk.OrientedBoxes.from_yaw(
            np.zeros((3, 3)), 0.5, np.array([0, np.nan, np.inf]), up=(0, 1, 0)
        ),
    ]
    for boxes in lists:
        uploaded = device.instances(boxes)
        assert uploaded.invalid.tolist() == [1, 2]
        near_wall = device.pyramid(np.full(SIZE, 1.0), camera, kind="z")
        assert device.cull(uploaded, camera, near_wall).mask.tolist() == [False, True, True]


# -- meshes of other libraries ---------------------------------------------------------------------


class Trimesh:
    """The attributes of trimesh.Trimesh that the library reads."""

    def __init__(self, vertices: Any, faces: Any) -> None:
        self.vertices, self.faces = np.asarray(vertices, np.float64), np.asarray(faces, np.int64)


class Vector:
    """Like open3d.utility.Vector3dVector: not an array, but numpy can make one of it."""

    def __init__(self, rows: Any, dtype: Any) -> None:
        self._rows = np.asarray(rows, dtype)

    def __len__(self) -> int:
        return len(self._rows)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        return np.array(self._rows, dtype=dtype)


class Open3d:
    """The attributes of open3d.geometry.TriangleMesh that the library reads."""

    def __init__(self, vertices: Any, triangles: Any) -> None:
        self.vertices, self.triangles = Vector(vertices, np.float64), Vector(triangles, np.int32)


CORNERS = np.array([[-50.0, -50, -10], [50, -50, -10], [50, 50, -10], [-50, 50, -10]])
FACES = [[0, 1, 2], [0, 2, 3]]


def test_meshes_of_trimesh_and_open3d_hide(device: hizvk.Device) -> None:
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=SIZE, near=0.125)
    spheres = hizvk.Spheres(np.array([[0.0, 0, -5], [0, 0, -20]]), 1.0)
    instances = device.instances(spheres)
    there, away = Trimesh(CORNERS, FACES), Open3d(CORNERS, FACES)
    forms: list[Any] = [
        there,
        away,
        [there],
        [away, there, hizvk.Mesh(CORNERS, FACES), (CORNERS, FACES)],
        (there, away),
    ]
    for form in forms:
        pyramid = device.pyramid(device.render_depth(device.occluders(form), camera))
        assert device.cull(instances, camera, pyramid).mask.tolist() == [True, False]
    moved = np.eye(4)
    moved[2, 3] = -20.0
    placed = device.occluders(there, transforms=moved)
    pyramid = device.pyramid(device.render_depth(placed, camera))
    assert device.cull(instances, camera, pyramid).mask.tolist() == [True, True]
    for form in (there, [away]):
        found = hizvk.recommend(spheres, camera, occluders=form, device=device, repetitions=1)
        assert found.best.kept == 1
    assert hizvk.check_bounds(
        hizvk.Boxes(CORNERS.min(0)[None], CORNERS.max(0)[None]), there
    ).contained.all()
    assert hizvk.check_bounds(hizvk.Spheres([[0.0, 0, -10]], 71.0), [away]).contained.all()


def test_what_is_no_mesh_is_told_so(device: hizvk.Device) -> None:
    class Points:  # trimesh.PointCloud has only vertices
        vertices = CORNERS

    for value, text in (
        (
            Points(),
            r"^vertices: expected a Mesh, a mesh of trimesh, Open3D or PyVista, or a list of them "
            r".*got Points",
        ),
        ([Points()], r"^vertices\[0\]: expected a Mesh"),
    ):
        with pytest.raises(TypeError, match=text):
            device.occluders(value)
    with pytest.raises(
        ValueError, match=r"^vertices\[1\]: triangles: expected integer \(T, 3\), got \(1, 4\)"
    ):
        device.occluders([Trimesh(CORNERS, FACES), Trimesh(CORNERS, [[0, 1, 2, 3]])])


# -- hints that work -------------------------------------------------------------------------------


def test_the_hint_for_a_masked_array_works() -> None:
    for dtype in (np.float32, np.float64, np.uint16, np.int32):
        masked = np.ma.masked_equal(np.array([[1, 2, 3]], dtype=dtype), 2)
        with pytest.raises(TypeError, match="masked array; fill it first") as caught:
            hizvk.Spheres(masked, 1.0)
        hint = str(caught.value).rsplit("with ", 1)[1]
        filled = eval("masked" + hint, {"np": np, "masked": masked})
        assert np.isnan(hizvk.Spheres(filled, 1.0).centers).tolist() == [[False, True, False]]


def test_what_is_advised_to_install_can_be_installed() -> None:
    """hizvk itself is on no package index, so hints name a wheel's path, or the extras' packages.

    ``tests/test_packages.py`` has the lines that are advised.
    """
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = {
        re.match(r"[\w-]+", one)[0]
        for all_of in settings["optional-dependencies"].values()
        for one in all_of
    }  # type: ignore[index]
    advised = set()
    for path in (ROOT / "python").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert "hizvk[" not in text.replace("``pip install hizvk[viz]``", ""), path
        for line in re.findall(r"(?<!``)pip install (\w[\w ]*)", text):
            advised |= set(line.split())
    assert advised <= extras


# -- the page --------------------------------------------------------------------------------------


def blocks() -> list[str]:
    page = (ROOT / "docs" / "conventions.md").read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", page, re.DOTALL)


@pytest.mark.parametrize("block", blocks(), ids=range(len(blocks())))
def test_the_pages_blocks_run(block: str) -> None:
    """Each block runs by itself and asserts what it shows."""
    assert "assert " in block
    exec(compile(block, "docs/conventions.md", "exec"), {})


def test_the_page_has_every_tool() -> None:
    page = (ROOT / "docs" / "conventions.md").read_text(encoding="utf-8")
    tools = re.findall(r"^\| \[.*?\]\(#([a-z0-9]+)\)", page, re.MULTILINE)
    headings = [title.lower() for title in re.findall(r"^## (\w+)$", page, re.MULTILINE)]
    assert set(tools) == set(headings) - {"boxes", "meshes", "arrays", "up"}
    assert page.count("```python") == len(set(tools)) + 2
    assert page.count("<!-- Source:") > len(set(tools))


def test_words_of_other_cameras_get_a_way_out() -> None:
    words = {"size": (24, 32), "near": 0.1, "camera_from_world": np.eye(4)}
    with pytest.raises(
        TypeError, match="pixel_center: expected no such parameter: COLMAP's centres are at halves"
    ):
        hizvk.Camera.from_colmap(
            "PINHOLE",
            [20, 20, 16, 12],
            pixel_center="half",  # type: ignore[call-arg]
            **words,
        )
    with pytest.raises(ValueError, match=r"pass k\[:3, :3\]"):
        hizvk.Camera.from_opencv(np.eye(4), pixel_center="half", **words)
