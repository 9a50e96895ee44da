"""What newcomers pass at first: it is taken, or the message ends with the way out."""

import pickle
import re
import subprocess
import sys
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import hizvk

SIZE = (6, 8)
CAMERA = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.1)
DEPTH = np.full(SIZE, 10.0)
CORNERS = [(0.0, 0.0, -5.0), (1.0, 0.0, -5.0), (1.0, 1.0, -5.0), (0.0, 1.0, -5.0)]
BALLS = hizvk.Spheres([(0.0, 0.0, -5.0)], 0.5)
K = [100.0, 0.0, 4.0, 0.0, 100.0, 3.0, 0.0, 0.0, 1.0]


class Frame:
    """What a data frame of pandas or polars has of an array."""

    columns = ("x", "y", "z", "name")

    def __init__(self, numbers: np.ndarray) -> None:
        self.numbers = numbers

    def to_numpy(self) -> np.ndarray:
        return self.numbers

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        return self.numbers


def opencv(k: Any, pose: Any, size: Any = SIZE) -> hizvk.Camera:
    return hizvk.Camera.from_opencv(
        k, pixel_center="half", camera_from_world=pose, size=size, near=0.1
    )


def colour(image: Any, **more: Any) -> Any:
    points = more.pop("points", hizvk.Points(CORNERS))
    return hizvk.colour_points(points, [(CAMERA, DEPTH, image)], kind="z", **more)


def culled(device: hizvk.Device, **more: Any) -> hizvk.CullResult:
    hiz = device.pyramid(DEPTH, CAMERA, kind="z")
    asked: dict[str, Any] = {"instances": device.instances(BALLS), "pyramid": hiz} | more
    return device.cull(asked.pop("instances"), CAMERA, asked.pop("pyramid"), **asked)


WAYS: list[tuple[Callable[[hizvk.Device], object], str]] = [
    # One row, several rows in a line, more columns than three.
    (
        lambda _: hizvk.Spheres([0.0, 0.0, -5.0], 1.0),
        "pass numpy.asarray(centers).reshape(-1, 3)",
    ),
    (lambda _: hizvk.Spheres(np.zeros(12), 1.0), "pass .reshape(-1, 3)"),
    (lambda _: hizvk.Points(np.zeros(0)), "pass .reshape(0, 3)"),
    (lambda _: hizvk.Points(np.zeros((5, 4))), "pass [:, :3], if these columns are x, y, z"),
    (lambda _: opencv(K, np.eye(4)), "pass numpy.asarray(k).reshape(3, 3)"),
    # Data frames have no indices of arrays.
    (
        lambda _: hizvk.Points(Frame(np.zeros((5, 4)))),
        "pass positions.to_numpy()[:, :3], if these columns are x, y, z",
    ),
    (
        lambda _: hizvk.Spheres(np.zeros((5, 3)), Frame(np.zeros((5, 1)))),
        "drop the last axis with radii.to_numpy()[..., 0]",
    ),
    (
        lambda _: hizvk.Mesh(CORNERS, Frame(np.zeros((3, 8), int))),
        "it looks transposed, pass triangles.to_numpy().T",
    ),
    (
        lambda _: hizvk.Points(Frame(np.array([[0.0, 1.0, 2.0, "car"]], object))),
        'pass positions[["x", "y", "z"]].to_numpy(), with the names of its columns',
    ),
    (lambda _: opencv(np.reshape(K, (3, 3)), np.eye(4)[:3].ravel()), "pass .reshape(3, 4)"),
    (lambda _: opencv(np.reshape(K, (3, 3)), np.eye(4), (6, 8, 3)), "pass .shape[:2]"),
    # Meshes.
    (lambda _: hizvk.Mesh(CORNERS, [[0, 1, 2, 3]]), "split each face into triangles first"),
    (
        lambda _: hizvk.Mesh(CORNERS, [0, 1, 2, 0, 2, 3]),
        "pass numpy.asarray(triangles).reshape(-1, 3)",
    ),
    (lambda _: hizvk.Mesh(CORNERS, [[1, 2, 3], [1, 3, 4]]), "count from 1: subtract 1"),
    (lambda _: hizvk.Mesh(CORNERS, [[0.0, 1.0, 2.0]]), "convert it with .astype(np.int64)"),
    (lambda _: hizvk.Mesh.of("house.glb"), "read the file first"),
    (
        lambda device: device.occluders([CORNERS, [[0, 1, 2]]]),
        "of arrays pass hizvk.Mesh(vertices, triangles)",
    ),
    # Objects that are made first.
    (lambda device: culled(device, instances=BALLS), "by device.instances(bounds)"),
    (lambda device: culled(device, pyramid=DEPTH), "by device.pyramid(depth, camera, kind=...)"),
    (
        lambda _: hizvk.visible((CORNERS, CORNERS), CAMERA, depth=DEPTH, kind="z"),
        "pass hizvk.Boxes(*bounds) or hizvk.Spheres(*bounds)",
    ),
    (
        lambda _: hizvk.visible(BALLS, CAMERA, depth=DEPTH, kind="z", tolerance=0.05),
        "pass hizvk.Tolerance(abs=0.05)",
    ),
    # Depth and photographs.
    (
        lambda _: hizvk.visible(BALLS, CAMERA, depth=np.ones((6, 8, 3)), kind="z"),
        "pass depth[..., 0]",
    ),
    (
        lambda _: hizvk.visible(BALLS, CAMERA, depth=np.ones(48), kind="z"),
        "pass depth.reshape(camera.size), if it is stored row by row",
    ),
    (
        lambda _: hizvk.visible(BALLS, CAMERA, depth=DEPTH, kind="z", invalid=0),
        "pass [0]",
    ),
    (lambda _: colour(np.zeros((6, 8, 3), np.uint16)), "pass image / 257.0"),
    # Sweeps and pictures.
    (
        lambda _: hizvk.sweep(BALLS, (c for c in [CAMERA]), depths=[DEPTH], kind="z"),
        "pass list(cameras)",
    ),
    (
        lambda _: hizvk.sweep(BALLS, [CAMERA], depths=(d for d in [DEPTH]), kind="z"),
        "pass list(depths), or a function that loads one",
    ),
    (
        lambda device: culled(device).plot("seen.png"),
        "a path goes to plot().savefig(path), or to save_html(path)",
    ),
    (
        lambda device: device.render_depth(hizvk.Mesh(CORNERS, [[0, 1, 2]]), CAMERA),  # type: ignore[arg-type]
        "meshes become occluders by device.occluders(mesh)",
    ),
    (
        lambda device: hizvk.visible_fraction(culled(device)),  # type: ignore[arg-type]
        'pass the pixels of a cull with outputs=["pixels"]',
    ),
    (lambda device: hizvk.compare(culled(device), [True]), "pass the result's .mask"),
    # Options and results.
    (lambda device: culled(device, outputs="mask"), 'pass ["mask"]'),
    (lambda _: hizvk.compare(np.array([True, False]), [1, 0]), "pass numpy.asarray(...) != 0"),
]


@pytest.mark.parametrize("number", range(len(WAYS)))
def test_a_message_ends_with_the_way_out(device: hizvk.Device, number: int) -> None:
    call, way = WAYS[number]
    with pytest.raises((TypeError, ValueError)) as refused:
        call(device)
    assert str(refused.value).endswith(way) or f"; {way}" in str(refused.value)


@pytest.mark.parametrize(
    "make",
    [
        lambda: hizvk.Spheres([], []),
        lambda: hizvk.Spheres((), 1.0),
        lambda: hizvk.Boxes([], []),
        lambda: hizvk.Boxes.from_corners([]),
        lambda: hizvk.Points([]),
        lambda: hizvk.OrientedBoxes([], [], []),
        lambda: hizvk.OrientedBoxes.from_yaw([], [], [], up=(0, 0, 1)),
        lambda: hizvk.OrientedBoxes.from_quaternions([], [], [], order="wxyz"),
        lambda: hizvk.OrientedBoxes.from_corners([], order="carla"),
    ],
)
def test_a_frame_without_objects_is_empty_lists(make: Callable[[], Any]) -> None:
    seen = hizvk.visible(make(), CAMERA, depth=DEPTH, kind="z")
    assert seen.shape == (0,)
    assert seen.dtype == np.bool_


def test_empty_lists_are_no_image_and_no_matrix() -> None:
    with pytest.raises(ValueError, match=r"^depth: expected"):
        hizvk.visible(BALLS, CAMERA, depth=[], kind="z")
    with pytest.raises(ValueError, match=r"^k: expected"):
        opencv([], np.eye(4))


def test_what_is_on_a_device_says_what_goes_to_other_processes(device: hizvk.Device) -> None:
    for thing in (device, culled(device), device.instances(BALLS)):
        with pytest.raises(TypeError, match=rf"^a {type(thing).__name__} stays in its process: "):
            pickle.dumps(thing)


@pytest.mark.parametrize(
    "bounds",
    [
        hizvk.Boxes([(1.0, 1.0, -5.0)], [(0.0, 2.0, -4.0)]),  # min above max
        hizvk.Spheres([(0.0, 0.0, -5.0)] * 2, -1.0),
        hizvk.Points([(np.nan, 0.0, -5.0)]),
    ],
)
def test_bounds_that_are_all_invalid_are_told(bounds: Any) -> None:
    with pytest.warns(hizvk.HizWarning, match=rf"^bounds: all {len(bounds)} are invalid"):
        kept = hizvk.visible(bounds, CAMERA, depth=DEPTH, kind="z")
    assert kept.all()


def test_one_valid_instance_keeps_the_hint_away() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        kept = hizvk.visible(
            hizvk.Spheres([(0.0, 0.0, -5.0), (0.0, 0.0, -20.0)], [-1.0, 1.0]),
            CAMERA,
            depth=DEPTH,
            kind="z",
        )
    assert kept.tolist() == [True, False]


def test_plain_arrays_are_told_which_bounds_they_look_like() -> None:
    for shape, way in (
        ((7, 3), "hizvk.Points(bounds)"),
        ((7, 6), "hizvk.Boxes(bounds[:, :3], bounds[:, 3:])"),
        ((7, 8, 3), "hizvk.Boxes.from_corners(bounds)"),
        ((7, 4, 4), "hizvk.OrientedBoxes.from_transforms(bounds)"),
    ):
        bounds = np.zeros(shape)
        if shape[1:] == (4, 4):
            bounds[:] = np.eye(4)
        with pytest.raises(TypeError) as caught:
            hizvk.visible(bounds, CAMERA, depth=DEPTH, kind="z")  # type: ignore[arg-type]
        assert f"; pass {way}, if that is what the numbers are" in str(caught.value)
        made = eval(way, {"hizvk": hizvk, "bounds": bounds})
        assert len(made) == len(bounds)


@pytest.mark.parametrize(
    ("call", "word", "meant"),
    [
        (lambda: look_at(fov=60), "fov", "fov_y_deg"),
        (lambda: look_at(fov_y_degs=60), "fov_y_degs", "fov_y_deg"),
        (lambda: look_at(fov_y_deg=60, znear=0.1), "znear", "near"),
        (lambda: look_at(fov_y_deg=60, resolution=SIZE), "resolution", "size"),
        (
            lambda: hizvk.Camera.orthographic((0, 0, 0), (0, 0, -1), fov=60),  # type: ignore[call-arg]
            "fov",
            "height",
        ),
        (
            lambda: hizvk.Camera.from_opencv(K=np.eye(3), pixel_center="half"),  # type: ignore[call-arg]
            "K",
            "k",
        ),
        (lambda: hizvk.Camera.from_opengl(hfov=60), "hfov", "fov_x_deg"),  # type: ignore[call-arg]
        (lambda: hizvk.Spheres(np.zeros((2, 3)), radius=1.0), "radius", "radii"),  # type: ignore[call-arg]
        (lambda: hizvk.Boxes(mins=CORNERS, maxs=CORNERS), "mins", "min"),  # type: ignore[call-arg]
        (lambda: hizvk.Points(xyz=CORNERS), "xyz", "positions"),  # type: ignore[call-arg]
        (lambda: hizvk.Mesh(CORNERS, faces=[[0, 1, 2]]), "faces", "triangles"),  # type: ignore[call-arg]
        (lambda: look_at(fov_y_deg=60, colour=1), "colour", None),
        (
            lambda: hizvk.Device().pyramid(DEPTH, CAMERA, kind="z", depth_scale=0.001),  # type: ignore[call-overload]
            "depth_scale",
            "scale",
        ),
        (
            lambda: hizvk.Device().occluders(vertices=CORNERS, faces=[[0, 1, 2]]),  # type: ignore[call-overload]
            "faces",
            "triangles",
        ),
        # Of functions that take options, too, their own parameters count.
        (lambda: hizvk.sweep(BALLS, [CAMERA], depth=[DEPTH], kind="z"), "depth", "depths"),  # type: ignore[call-arg]
        (lambda: hizvk.recommend(BALLS, CAMERA, occluder=None), "occluder", "occluders"),  # type: ignore[call-arg]
        (lambda: hizvk.visible(BALLS, CAMERA, depth=DEPTH, kinds="z"), "kinds", "kind"),  # type: ignore[call-arg]
        (lambda: colour(np.zeros((6, 8, 3), np.uint8), device_=1), "device_", "device"),
        (lambda: culled(hizvk.Device(), output=["mask"]), "output", "outputs"),
        (lambda: hizvk.Tolerance(absolute=0.1), "absolute", "abs"),  # type: ignore[call-arg]
        (lambda: hizvk.CullOptions(foot_print=4), "foot_print", "footprint"),  # type: ignore[call-arg]
        (lambda: hizvk.Outputs(masks=True), "masks", "mask"),  # type: ignore[call-arg]
        (lambda: hizvk.LodBySize(pixel=[4.0]), "pixel", "pixels"),  # type: ignore[call-arg]
        (lambda: hizvk.DirectionalLight((0, 0, -1), radius=1), "radius", "angular_radius_deg"),  # type: ignore[call-arg]
        (lambda: hizvk.Device(name="llvmpipe"), "name", "adapter"),  # type: ignore[call-arg]
        (lambda: hizvk.cube((0, 0, 0), size=8, znear=0.1), "znear", "near"),  # type: ignore[call-arg]
    ],
)
def test_a_word_that_is_no_parameter(call: Callable[[], Any], word: str, meant: str) -> None:
    with pytest.raises(TypeError, match=f"^{word}: expected no such parameter; ") as refused:
        call()
    assert (f"the closest is {meant}, and all are" in str(refused.value)) == (meant is not None)
    assert ("the closest is" in str(refused.value)) == (meant is not None)


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("world_to_camera", "camera_from_world"),
        ("world2cam", "camera_from_world"),
        ("camera_to_world", "world_from_camera"),
        ("cam2world", "world_from_camera"),
    ],
)
@pytest.mark.parametrize("make", [hizvk.Camera.from_opengl, hizvk.Camera.from_matrices])
def test_the_word_for_a_pose_is_not_its_inverse(make: Any, word: str, meant: str) -> None:
    """By letters alone ``world_from_camera`` is closest to ``world_to_camera``."""
    with pytest.raises(TypeError, match=f"^{word}: .*the closest is {meant}, and all are"):
        make(**{word: np.eye(4)})


def look_at(**more: Any) -> hizvk.Camera:
    return hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), **more)


def test_a_function_that_other_processes_cannot_look_up() -> None:
    """Threads need no name for it, and a function of a module has one."""
    cameras = [CAMERA] * 2

    def swept(depths: Any, executor: Any) -> hizvk.Sweep:
        return hizvk.sweep(BALLS, cameras, depths=depths, kind="z", executor=executor)

    text = r"^depths: expected a function on the top level of a module .*, got function <function "
    for pool in (2, ProcessPoolExecutor(1)):
        with pytest.raises(TypeError, match=text) as refused:
            swept(lambda view: DEPTH, pool)
        assert "resume" not in str(refused.value)
    with ThreadPoolExecutor(2) as threads:
        assert swept(lambda view: DEPTH, threads).counts.tolist() == [1, 1]
    session = (
        "import hizvk.sweeping.arguments as a\ndef load(view): ...\na.refuse_unsendable(load, "
    )
    for runner, refused_there in (("2", True), ("None", False)):
        run = subprocess.run(
            [sys.executable, "-"], input=f"{session}{runner})", capture_output=True, text=True
        )
        assert (run.returncode != 0) == refused_there
        assert ("of an interactive session; pass such a function" in run.stderr) == refused_there


def test_fractions_of_objects_that_the_image_does_not_hold(device: hizvk.Device) -> None:
    seen = culled(device, outputs=["pixels"])
    with pytest.warns(hizvk.HizWarning, match="pass objects_in_depth=False"):
        assert seen.visible_fraction() == [0.0]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert seen.visible_fraction(objects_in_depth=False) == [1.0]
        hidden = device.instances(hizvk.Spheres([(0.0, 0.0, -20.0)], 0.5))
        assert culled(device, instances=hidden, outputs=["pixels"]).visible_fraction() == [0.0]


@pytest.mark.parametrize(
    ("eye", "hint"),
    [
        (np.zeros((5, 3)), True),
        ([(0.0, 1.0, 2.0), (3.0, 4.0, 5.0)], True),
        ((0.0, 1.0), False),
        (np.zeros((3, 4)), False),
    ],
)
def test_a_cube_is_around_one_eye(eye: Any, hint: bool) -> None:
    with pytest.raises(ValueError, match=r"^eye: expected \(3,\) finite numbers, got") as caught:
        hizvk.cube(eye, size=8, near=0.1)
    way = "[camera for one in eye for camera in hizvk.cube(one, ...)]"
    assert (way in str(caught.value)) == hint
    if hint:
        call = way.replace("...", "size=8, near=0.1")
        assert len(eval(call, {"eye": eye, "hizvk": hizvk})) == 6 * len(eye)
    with pytest.raises(
        TypeError, match=r"^size: .*pixels per side of a square, got tuple \(8, 8\)"
    ):
        hizvk.cube((0, 0, 0), size=(8, 8), near=0.1)  # type: ignore[arg-type]


def test_a_number_past_the_end_says_what_may_be_meant(device: hizvk.Device) -> None:
    seen = culled(device, instances=device.instances(hizvk.Spheres(np.zeros((5, 3)), 1.0)))
    hiz = device.pyramid(DEPTH, CAMERA, kind="z")  # 6 x 8 pixels: levels 0 to 3
    sweep = hizvk.sweep(BALLS, [CAMERA] * 2, depths=[DEPTH] * 2, kind="z")
    views = device.cull(device.instances(BALLS), [CAMERA] * 2, [hiz] * 2)
    calls: list[tuple[Callable[[int], object], str, int]] = [
        (seen.explain, "index: expected an integer", 5),
        (hiz.level, "k: expected a level", 4),
        (sweep.mask, "view: expected an integer", 2),
    ]
    for call, expected, count in calls:
        for number, hint in (
            (count, "; the first one is 0"),
            (-1, f"; counted from the end that is {count - 1}"),
            (-count, "; counted from the end that is 0"),
            (count + 1, ""),
            (-count - 1, ""),
        ):
            with pytest.raises(IndexError) as caught:
                call(number)
            assert str(caught.value) == f"{expected} in 0..{count - 1}, got {number}{hint}"
    with pytest.raises(
        IndexError, match=r"^view: expected .* in -2\.\.1, got 2; the first one is 0$"
    ):
        views[2]
    nothing = culled(device, instances=device.instances(hizvk.Spheres([], [])))
    with pytest.raises(IndexError, match=r"nothing, for there are no instances, got 0$"):
        nothing.explain(0)


#: Refusals of the engine, whose own interface has other names than this one.
REFUSED_BY_THE_ENGINE: list[Callable[[hizvk.Device, dict[str, hizvk.Pyramid]], object]] = [
    lambda device, of: device.cull(device.instances(BALLS), CAMERA, of["nearest"]),
    lambda device, of: device.cull(device.instances(BALLS), CAMERA, of["receivers"]),
    lambda device, of: device.cull(device.instances(BALLS), CAMERA, of["both"], shadow=SUN),
    lambda device, of: device.cull(
        device.instances(BALLS), CAMERA, of["receivers"], shadow=SUN, outputs=["pixels"]
    ),
    lambda device, of: device.cull(
        device.instances(BALLS), CAMERA, of["receivers"], shadow=SUN, fit="volume"
    ),
    lambda device, of: device.cull(
        device.instances(BALLS), CAMERA, of["receivers"], shadow=SUN
    ).explain(0),
    lambda device, of: device.cull_approximate(
        device.instances(BALLS), CAMERA, of["nearest"], negligible_px=1
    ),
    lambda device, of: device.temporal(device.instances(BALLS)).late(
        CAMERA, of["both"], order="any"
    ),
    lambda device, of: device.temporal(device.instances(BALLS)).late(
        CAMERA, of["receivers"], shadow=SUN
    ),
    lambda device, _: culled(device, meshes=[MESH], order="any"),
    lambda device, _: culled(device, meshes=[MESH], emit="instances").bin(mesh=0, lod=0),
    lambda device, _: culled(device).lods,
]
SUN = hizvk.DirectionalLight((0, -1, 0), receivers=((-9, -9, -9), (9, 9, 9)))
MESH = hizvk.MeshLods([hizvk.DrawTemplate(3)])


@pytest.mark.parametrize("call", REFUSED_BY_THE_ENGINE)
def test_refusals_speak_of_this_interface(device: hizvk.Device, call: Any) -> None:
    """``Depths::Farthest``, ``Order::Any`` or `record_cull` are no words of Python."""
    depths: Any
    pyramids = {}
    for depths in ("nearest", "both", "receivers"):
        pyramids[depths] = device.pyramid(DEPTH, CAMERA, kind="z", depths=depths)
    with pytest.raises(ValueError, match=r"^\w+: expected ") as refused:
        call(device, pyramids)
    assert not re.search(r"::|record_|\b(Stable|Any|Binned)\b", str(refused.value))
