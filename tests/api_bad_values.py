"""Bad arguments of every public function: the tables behind test_api_errors.py.

Each function has a table: valid arguments, and for each parameter bad values with the exception and
a part of its text.
"""

import atexit
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import hizvk

NAN = float("nan")
INF = float("inf")
EYE4 = np.eye(4)
SINGULAR = np.diag([1.0, 1.0, 0.0, 1.0])
TRANSPOSED_POSE = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [5, 6, 7, 1]])
K = np.array([[100.0, 0, 32], [0, 100, 24], [0, 0, 1]])
# The projection of OpenGL: near 1, far 3, 90 degrees.
GL = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, -2, -3], [0, 0, -1, 0]])

Bad = tuple[Any, type[Exception], str]
BadValues = dict[str, list[Bad]]


class Table(NamedTuple):
    """A function's arguments: `make(device)` gives it with valid ones, and `bad` the bad values."""

    make: Callable[[hizvk.Device], tuple[Callable[..., Any], dict[str, Any]]]
    bad: BadValues


def camera(size: tuple[int, int] = (6, 8), **more: Any) -> hizvk.Camera:
    """At the origin, looking along -z."""
    return hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=size, near=0.1, **more)


TETRAHEDRON = hizvk.Mesh(np.eye(4)[:, :3] / 4, [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])


# --- bad values that several functions share ---

DEPTHS: list[Bad] = [
    ("far", ValueError, 'expected one of "farthest", "nearest", "both", "receivers", got'),
    (2, TypeError, "got int 2"),
]
LEVELS: list[Bad] = [
    (0, ValueError, "expected an integer in 1..15, got int 0"),
    (16, ValueError, "expected an integer in 1..15, got int 16"),
    (2.0, TypeError, "got float 2.0"),
    (True, TypeError, "got bool True"),
    ("all", TypeError, "got str 'all'"),
    ((1, 2, 3), ValueError, "expected None, a level or a pair (first, last), got tuple (1, 2, 3)"),
    ((3, 2), ValueError, "expected first <= last, got (3, 2)"),
    ((1, 16), ValueError, "in 1..15"),
    ((1, None), TypeError, "got None"),
]

VECTOR: list[Bad] = [
    ("abc", TypeError, "expected (3,) finite numbers, got str 'abc'"),
    (None, TypeError, "got None"),
    ((1, 2), ValueError, "expected (3,) finite numbers, got (2,) float64"),
    (np.ones((3, 1)), ValueError, "got (3, 1) float64; drop the last axis with [..., 0]"),
    ((1, 2, NAN), ValueError, "nan"),
    ((1, 2, INF), ValueError, "inf"),
    ((1, 2, 3j), TypeError, "got (3,) complex128"),
    ((True, False, True), TypeError, "got (3,) bool"),
    (np.ma.masked_array([1.0, 2, 3]), TypeError, "masked array"),
    ([[1, 2], [3]], ValueError, "no array"),
]
SIZE: list[Bad] = [
    (480, TypeError, "expected (height, width), two integers in 1..32768, got int 480"),
    ("ab", TypeError, "got str 'ab'"),
    ((480,), ValueError, "got tuple (480,)"),
    ((480, 640, 3), ValueError, "got tuple (480, 640, 3)"),
    ((480.0, 640.0), TypeError, "got tuple (480.0, 640.0)"),
    ((True, 640), TypeError, "got tuple (True, 640)"),
    ((0, 640), ValueError, "got tuple (0, 640)"),
    ((480, 32769), ValueError, "in 1..32768"),
]
NEAR: list[Bad] = [
    ("0.1", TypeError, "expected a finite number above 0, got str '0.1'"),
    (0, ValueError, "above 0, got int 0"),
    (-1.0, ValueError, "got float -1.0"),
    (NAN, ValueError, "got float nan"),
    (True, TypeError, "got bool True"),
    (None, TypeError, "got None"),
]
FAR: list[Bad] = [
    (0.05, ValueError, "expected a finite number above 0.1, got float 0.05"),
    (NAN, ValueError, "got float nan"),
    ("far", TypeError, "got str 'far'"),
]
FLAG: list[Bad] = [
    (1, TypeError, "expected True or False, got int 1"),
    (None, TypeError, "got None"),
    ("yes", TypeError, "got str 'yes'"),
]
NUMBER: list[Bad] = [
    ("0", TypeError, "expected a finite number"),
    (NAN, ValueError, "got float nan"),
    (1j, TypeError, "1j"),
]
POSE: list[Bad] = [
    (
        np.eye(3),
        ValueError,
        "expected (3, 4) or (4, 4) finite numbers, got (3, 3) float64; "
        "pass a rotation and a translation as a pair",
    ),
    (np.eye(4)[:, :3], ValueError, "got (4, 3) float64"),
    (
        (np.ones(3), np.zeros(3)),
        ValueError,
        "expected R of a pair (R, t) to be (3, 3) finite numbers, got (3,)",
    ),
    (
        (np.ones((3, 1)), np.zeros((3, 1))),
        ValueError,
        "a rotation vector becomes a matrix by cv2.Rodrigues(rvec)[0]",
    ),
    (
        (np.eye(3), np.zeros(4)),
        ValueError,
        "expected t of a pair (R, t) to be (3, 1) or (1, 3) or (3,) finite",
    ),
    ((np.eye(3), None), TypeError, "got None"),
    ((np.zeros((3, 3)), np.zeros(3)), ValueError, "singular"),
    (SINGULAR[:3], ValueError, "singular"),
    ("pose", TypeError, "got str 'pose'"),
    (np.full((4, 4), NAN), ValueError, "nan"),
    (SINGULAR, ValueError, "singular"),
    (np.zeros((4, 4)), ValueError, "singular"),
    (
        TRANSPOSED_POSE,
        ValueError,
        "expected the last row to be 0, 0, 0, 1, got [5.0, 6.0, 7.0, 1.0]; it looks transposed",
    ),
    (np.eye(4, dtype=complex), TypeError, "got (4, 4) complex128"),
]
MATRIX: list[Bad] = [
    (np.eye(3), ValueError, "expected (4, 4) finite numbers, got (3, 3) float64"),
    (EYE4 * NAN, ValueError, "nan"),
    (SINGULAR, ValueError, "expected an invertible (4, 4) matrix, got a singular one"),
    (np.ones((4, 4)), ValueError, "singular"),
    ("m", TypeError, "got str 'm'"),
    (np.eye(4, dtype=bool), TypeError, "got (4, 4) bool"),
]


PIXEL_CENTER: list[Bad] = [
    (
        None,
        TypeError,
        '"integer" (the first pixel\'s centre is (0, 0): OpenCV, KITTI, ROS) or '
        '"half" (it is (0.5, 0.5)',
    ),
    ("center", ValueError, "COLMAP, nerfstudio, gsplat, pyrender, CARLA), got str 'center'"),
    (0.5, TypeError, "got float 0.5; there is no default"),
]


def array_of(shape: str, *, wrong: tuple[int, ...]) -> list[Bad]:
    """Bad values for a float array of positions."""
    expected = f"expected float {shape}, got"
    return [
        (np.zeros(wrong), ValueError, f"{expected} {wrong} float64"),
        (np.zeros(wrong, dtype=np.int64), ValueError, f"{expected} {wrong} int64"),
        (np.zeros(wrong, dtype=bool), TypeError, "bool"),
        (np.zeros(wrong, dtype=complex), TypeError, "complex128"),
        (np.zeros(wrong, dtype=object), TypeError, "object"),
        (np.array([["a"]]), TypeError, "<U1"),
        (np.ma.zeros(wrong), TypeError, "got a masked array; "),
        ("abc", TypeError, f"{expected} str 'abc'"),
        (None, TypeError, f"{expected} None"),
        ([[1.0, 2.0], [3.0]], ValueError, "no array"),
        ([[2**60, 0, 0]], ValueError, "integers that float64 cannot hold"),
    ]


HALF_SIZES: list[Bad] = [
    (np.ones((3, 3)), ValueError, "expected float (2, 3), got (3, 3) float64"),
    (np.ones((2, 3), dtype=complex), TypeError, "got (2, 3) complex128"),
    ((1.0, 2.0), ValueError, "expected float (3,) or one number, got (2,) float64"),
    ([[1.0, 2.0], [3.0]], ValueError, "no array"),
    ("large", TypeError, "got str 'large'"),
    (None, TypeError, "got None"),
]
PROGRESS: list[Bad] = [
    ("bar", TypeError, "expected None, True, False or a function, got str 'bar'"),
    (1, TypeError, "got int 1"),
]
BOUNDS: list[Bad] = [
    (
        np.zeros((2, 3)),
        TypeError,
        "expected Spheres, Boxes, OrientedBoxes or Points, got (2, 3) float64",
    ),
    (None, TypeError, "got None"),
]
CAMERA: list[Bad] = [
    ([camera(), camera()], TypeError, "got a list of 2; pass one a call, in a loop"),
    (None, TypeError, "expected a Camera"),
    (EYE4, TypeError, "got (4, 4) float64"),
]
IMAGE: list[Bad] = [
    (np.zeros((6, 9, 1)), ValueError, "got (6, 9, 1) float64"),
    (np.zeros((1, 8, 6)), ValueError, "got (1, 8, 6) float64"),
    (np.zeros((8, 6)), ValueError, "expected float (6, 8) (the camera's size), got (8, 6) float64"),
    (np.zeros(48), ValueError, "got (48,) float64"),
    (np.zeros((6, 8), dtype=np.int8), TypeError, "got (6, 8) int8"),
    (np.zeros((6, 8, 3)), ValueError, "got (6, 8, 3) float64"),
    (np.zeros((3, 4)), ValueError, "goes with camera.resized("),
    (np.zeros((6, 8), dtype=np.uint8), TypeError, "got (6, 8) uint8"),
    (np.zeros((6, 8), dtype=bool), TypeError, "got (6, 8) bool"),
    (np.ma.zeros((6, 8), dtype=np.uint8), TypeError, "got (6, 8) uint8"),
    (np.ma.zeros((8, 6)), ValueError, "got (8, 6) float64"),
    (memoryview(np.zeros((6, 8), dtype=np.int8)), TypeError, "got (6, 8) int8"),
    ("image", TypeError, "got str 'image'"),
]
KIND: list[Bad] = [
    (
        None,
        TypeError,
        'expected one of "ndc", "reversed_ndc", "z", "distance", got None; there is no default',
    ),
    (
        "depth",
        ValueError,
        'expected one of "ndc", "reversed_ndc", "z", "distance", got str \'depth\'',
    ),
    (3, TypeError, "got int 3"),
    (
        "ndc",
        ValueError,
        'expected "reversed_ndc" (1 near and 0 far) for a camera with reversed_z=True, got "ndc"',
    ),
]
SCALE: list[Bad] = [
    (0, ValueError, "above 0, got int 0"),
    (-0.001, ValueError, "got float -0.001"),
    (NAN, ValueError, "got float nan"),
    ("mm", TypeError, "got str 'mm'"),
]
INVALID: list[Bad] = [
    (
        0,
        TypeError,
        "expected None or a collection of the numbers that mean no data, in the array's own units",
    ),
    ("0", TypeError, "got str '0'"),
    (("0",), TypeError, "got str '0' in it"),
    ((True,), TypeError, "got bool True in it"),
    (np.zeros((2, 2)), TypeError, "(2, 2) float64"),
]
TOLERANCE: list[Bad] = [
    (0.01, TypeError, "expected a hizvk.Tolerance or None, got float 0.01"),
    ((0.01, 0.02), TypeError, "got tuple (0.01, 0.02)"),
]
SAMPLING: list[Bad] = [
    ("linear", ValueError, 'expected one of "nearest", "bilinear"'),
    (1, TypeError, "got int 1"),
]
POINTS: list[Bad] = [
    (np.zeros((2, 3)), TypeError, "expected Points, as hizvk.Points(xyz) makes them, got (2, 3)"),
    (None, TypeError, "got None"),
]
RADIUS: list[Bad] = [
    (-1, ValueError, "at least 0"),
    (NAN, ValueError, "got float nan"),
    ("1", TypeError, "got str '1'"),
]
GUARD: list[Bad] = [
    (0.3, ValueError, "expected a multiple of 1/256, got 0.3"),
    (-1, ValueError, "expected a finite number at least 0 and at most 16, got int -1"),
    ("1", TypeError, "got str '1'"),
]
COVERAGE: list[Bad] = [
    ("pixel", ValueError, 'expected one of "area", "sample"'),
    (0, TypeError, "got int 0"),
]
DEPTH_SLACK: list[Bad] = [
    (-1e-7, ValueError, "at least 0"),
    (0.75, ValueError, "at most 0.5, got float 0.75"),
    ("a", TypeError, "got str 'a'"),
]
FOOTPRINT: list[Bad] = [
    (3, ValueError, "expected one of 1, 2, 4, 8, got 3"),
    (16, ValueError, "expected one of 1, 2, 4, 8, got 16"),
    (2.0, TypeError, "got float 2.0"),
]
FIT: list[Bad] = [
    ("box", ValueError, 'expected one of "rectangle", "volume"'),
    (1, TypeError, "got int 1"),
]
DESCENT: list[Bad] = [
    (-1, ValueError, "in 0..65536"),
    (70000, ValueError, "in 0..65536"),
    (None, TypeError, "got None"),
]
TRANSFORM_SLACK: list[Bad] = [
    (-1, ValueError, "at least 0"),
    (INF, ValueError, "got float inf"),
    ([], TypeError, "list []"),
]
VERTICES: list[Bad] = [
    (np.zeros((4, 2)), ValueError, "expected float (V, 3), got (4, 2) float64"),
    (np.full((4, 3), 2**60), ValueError, "got (4, 3) int64 with 1152921504606846976 in it, which"),
    (
        np.full((4, 3), NAN),
        ValueError,
        "expected finite float (V, 3), got 12 NaN or infinite numbers",
    ),
]
TRIANGLES: list[Bad] = [
    (np.zeros((1, 4), dtype=int), ValueError, "expected integer (T, 3), got (1, 4) int64"),
    (np.zeros((1, 3)), TypeError, "got (1, 3) float64"),
    ([[0, 1, 3]], ValueError, "expected vertex indices in 0..2, got 3"),
    ([[0, 1, -1]], ValueError, "expected vertex indices in 0..2, got -1"),
    ("abc", TypeError, "got str 'abc'"),
    ([[0, 1], [2]], ValueError, "no array"),
]
SINGLE_MESH: list[Bad] = [
    (
        None,
        TypeError,
        "or PyVista or a tuple (vertices, triangles), got None",
    ),
    (
        (np.zeros((3, 2)), [[0, 1, 2]]),
        ValueError,
        "vertices: expected float (V, 3), got (3, 2) float64",
    ),
    (
        (np.zeros((3, 3)), [[0, 1, 3]]),
        ValueError,
        "triangles: expected vertex indices in 0..2, got 3",
    ),
    (
        hizvk.Mesh(np.zeros((3, 3)), [[0, 1, 2]], EYE4),
        ValueError,
        "without transforms, got Mesh(3 vertices",
    ),
]
TRANSFORMS: list[Bad] = [
    (np.eye(3), ValueError, "expected float (4, 4), got (3, 3) float64"),
    (np.zeros((2, 4, 3)), ValueError, "expected float (K, 4, 4), got (2, 4, 3) float64"),
    (np.eye(4, dtype=bool), TypeError, "got (4, 4) bool"),
    (np.eye(4) * NAN, ValueError, "NaN or infinite"),
    (TRANSPOSED_POSE, ValueError, "it looks transposed"),
    (
        np.diag([1.0, 1, 1, 2]),
        ValueError,
        "expected the last row to be 0, 0, 0, 1, got [0.0, 0.0, 0.0, 2.0]",
    ),
]


def unsigned(name: str) -> list[Bad]:
    """Bad values of a 32-bit number in draw arguments."""
    return [
        (-1, ValueError, "expected an integer in 0..4294967295, got int -1"),
        (2**32, ValueError, "0..4294967295"),
        (1.0, TypeError, "got float 1.0"),
        (True, TypeError, "got bool True"),
        (name, TypeError, f"got str '{name}'"),
    ]


# --- the tables ---

VIEW: BadValues = {
    "eye": VECTOR,
    "target": [*VECTOR, ((0, 0, 0), ValueError, "eye")],
    "up": [
        *VECTOR,
        ((0, 0, 0), ValueError, "expected a direction"),
        ((0, 0, 5), ValueError, "such as (0, 1, 0)"),
    ],
    "size": SIZE,
    "near": NEAR,
    "far": FAR,
    "reversed_z": FLAG,
}
LOOK: dict[str, Any] = {
    "eye": (0, 0, 0),
    "target": (0, 0, -1),
    "up": (0, 1, 0),
    "size": (6, 8),
    "near": 0.1,
    "far": 10,
}
LOOK["reversed_z"] = True
FOV: list[Bad] = [
    (0, ValueError, "expected a finite number above 0 and below 180, got int 0"),
    (180, ValueError, "below 180, got int 180"),
    (None, TypeError, "got None"),
]
INTRINSICS: list[Bad] = [
    (EYE4, ValueError, "expected (3, 3) finite numbers, got (4, 4) float64"),
    (EYE4[:3], ValueError, "got (3, 4) float64; of a projection P = K [I | t] pass P[:, :3]"),
    (K.T, ValueError, "it looks transposed"),
    (K * 2, ValueError, "expected [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]"),
    (-K, ValueError, "got fx=-100 and fy=-100"),
    (K * NAN, ValueError, "nan"),
    ("k", TypeError, "got str 'k'"),
]
DISTORTION: list[Bad] = [
    ([0.1, 0, 0, 0], ValueError, "undistort the depth image first, by cv2.initUndistortRectifyMap"),
    ("none", TypeError, "expected None or an array of zeros, got str 'none'"),
    ([NAN], ValueError, "undistort"),
]
VECTOR_OR_NONE: list[Bad] = [
    (None, ValueError, "expected the other half of the pose") if bad[0] is None else bad
    for bad in VECTOR
]
ORTHO_NEAR: list[Bad] = [
    ("near", TypeError, "expected a finite number, got str"),
    (NAN, ValueError, "got float nan"),
]
CLIP: list[Bad] = [*MATRIX, (None, ValueError, "got neither")]


TEXT: list[Bad] = [(3, TypeError, "expected a text, got int 3"), (None, TypeError, "got None")]
#: What figures and pages of results are asked for.
DRAWN: BadValues = {
    "bounds": [
        (np.zeros((1, 3)), TypeError, "expected Spheres, Boxes, OrientedBoxes or Points, got"),
        (
            hizvk.Spheres(np.zeros((2, 3)), 1.0),
            ValueError,
            "expected those of the 1 instances that were tested, got 2",
        ),
    ],
    "up": [
        ("w", ValueError, 'expected one of "x", "y", "z", "-x", "-y", "-z", got str'),
        ((0, 0, 1), TypeError, "got tuple"),
    ],
    "most": [
        (0, ValueError, "expected an integer in 1..2147483647, got int 0"),
        (10.0, TypeError, "got float 10.0"),
    ],
    "unit": TEXT,
}
#: What `Pyramid.level` and `DepthImage.numpy` are asked for.
WANTED_KIND: list[Bad] = [
    ("depth", ValueError, 'expected one of "ndc", "reversed_ndc", "z", "distance", got str'),
    (2, TypeError, "got int 2"),
]


def rendered(device: hizvk.Device) -> hizvk.DepthImage:
    """A depth image of a triangle."""
    return device.render_depth(device.occluders(TETRAHEDRON), camera())


def spheres() -> hizvk.Spheres:
    return hizvk.Spheres(np.array([[0.0, 0.0, -5.0]]), 1.0)


def occlusion_map(device: hizvk.Device) -> hizvk.OcclusionMap:
    return device.occlusion_map(device.occluders([TETRAHEDRON]), camera())


def cull_arguments(device: hizvk.Device) -> dict[str, Any]:
    view = camera()
    pyramid = device.pyramid(np.ones((6, 8)), view, kind="z")
    return {"instances": device.instances(spheres()), "camera": view, "pyramid": pyramid}


FLAG_OR_NONE: list[Bad] = [
    (1, TypeError, "expected True, False or None, got int 1"),
    ("auto", TypeError, "got str"),
]
CAPACITY: list[Bad] = [
    (-1, ValueError, "in 0..4294967295"),
    (1.5, TypeError, "got float 1.5"),
]
LIMIT: list[Bad] = [
    (-1, ValueError, "in 0..9223372036854775807"),
    (1.5, TypeError, "got float 1.5"),
    (True, TypeError, "got bool True"),
]
OF_MESHES: BadValues = {
    "meshes": [
        (36, TypeError, "expected a sequence of MeshLods or None, got int 36"),
        ([], ValueError, "expected at least one MeshLods, got none"),
        ([36], TypeError, "expected a MeshLods for each mesh, got int 36"),
    ],
    "emit": [
        ("list", ValueError, 'expected one of "bins", "instances", got str \'list\''),
        (None, TypeError, "got None"),
    ],
    "placement": [
        ("loose", ValueError, 'expected one of "packed", "reserved", got str \'loose\''),
        (None, TypeError, "got None"),
    ],
}
PIXEL_BUDGET: list[Bad] = [
    (0, ValueError, "expected an integer in 1..4294967295, got int 0"),
    (1.5, TypeError, "got float 1.5"),
]
DRAW: list[Bad] = [((36,), TypeError, "expected a DrawTemplate or None, got tuple (36,)")]
OPTIONS_OBJECT: list[Bad] = [
    ({"order": "any"}, TypeError, "expected a CullOptions or None, got dict {'order': 'any'}"),
    ("any", TypeError, "got str 'any'"),
]
OUTPUTS_OBJECT: list[Bad] = [
    ("mask", TypeError, "expected None or a collection of"),
    (["masks"], ValueError, 'expected one of "mask", "verdicts", "indices", "draws"'),
    ([1], TypeError, "got int 1"),
    (hizvk.CullOptions(), TypeError, "'pixels', or an Outputs, got CullOptions"),
]
#: The fields of `CullOptions`, which are also keywords of functions.
OPTIONS: dict[str, list[Bad]] = {
    "order": [
        ("fast", ValueError, 'expected one of "stable", "any"'),
        (None, TypeError, "got None"),
    ],
    "coverage": COVERAGE,
    "guard_px": GUARD,
    "depth_slack": DEPTH_SLACK,
    "depth_slack_abs": DEPTH_SLACK,
    "transform_slack": TRANSFORM_SLACK,
    "footprint": FOOTPRINT,
    "descent": DESCENT,
    "fit": FIT,
    "hierarchy": [
        ("auto", TypeError, "expected True, False, None or a number of tiers, got str"),
        (4, ValueError, "expected an integer in 0..3, got int 4"),
    ],
    "statistics": FLAG,
    "lod": [
        (1.0, TypeError, "expected a LodByError, LodByDistance, LodBySize or None, got float 1.0"),
        ([10.0], TypeError, "got list [10.0]"),
    ],
    "shadow": [
        ((0, -1, 0), TypeError, "expected a DirectionalLight or None, got tuple (0, -1, 0)"),
    ],
}

LOD_PIXELS: list[Bad] = [
    (0.0, ValueError, "at most 32768, got float 0.0"),
    (-1.0, ValueError, "got float -1.0"),
    (NAN, ValueError, "got float nan"),
    ("1", TypeError, "got str '1'"),
    ([1.0], TypeError, "got list [1.0]"),
]


def lod_list(way: str, wrong_order: list[float]) -> list[Bad]:
    return [
        ([], ValueError, f"expected 1 to 7 {way} numbers, got list []"),
        (list(range(1, 9)), ValueError, f"expected 1 to 7 {way} numbers"),
        (wrong_order, ValueError, f"expected 1 to 7 {way} numbers without equal ones, got list"),
        ([0.5, 0.5], ValueError, "without equal ones, got list [0.5, 0.5]"),
        ([NAN], ValueError, "got float nan"),
        ([-1.0], ValueError, "got float -1.0"),
        (["1"], TypeError, "got str '1'"),
        (0.5, TypeError, f"expected 1 to 7 {way} numbers, got float 0.5"),
        (np.ones((2, 2)), ValueError, "got (2, 2) float64"),
    ]


TABLES: dict[str, Table] = {
    "DirectionalLight": Table(
        lambda _: (
            hizvk.DirectionalLight,
            {
                "direction": (0, -1, 0),
                "receivers": ((-1, -1, -1), (1, 1, 1)),
                "angular_radius_deg": 0.27,
                "filter_radius": 0.05,
            },
        ),
        {
            "direction": [*VECTOR, ((0, 0, 0), ValueError, "expected a vector that is not 0")],
            "receivers": [
                (3.0, TypeError, "expected a pair (least, greatest) of corners, got float 3.0"),
                (((0, 0, 0),), ValueError, "expected a pair (least, greatest) of corners"),
                (((0, 0), (1, 1)), ValueError, "expected (3,) finite numbers"),
                (((0, 0, 2), (1, 1, 1)), ValueError, "expected least <= greatest on each axis"),
                (((0, 0, 0), (1, 1, NAN)), ValueError, "nan"),
                (((0, 0, 0), (1, 1, 1e30)), ValueError, "expected numbers below 2^60"),
            ],
            "angular_radius_deg": [
                *NUMBER,
                (-1.0, ValueError, "got float -1.0"),
                (31.0, ValueError, "at most 30, got float 31.0"),
            ],
            "filter_radius": [*NUMBER, (-1.0, ValueError, "got float -1.0")],
        },
    ),
    "LodByError": Table(
        lambda _: (hizvk.LodByError, {"pixels": 1.0}),
        {"pixels": LOD_PIXELS},
    ),
    "LodByDistance": Table(
        lambda _: (hizvk.LodByDistance, {"thresholds": [10.0, 20.0]}),
        {"thresholds": lod_list("ascending", [20.0, 10.0])},
    ),
    "LodByDistance.at_ndc_depths": Table(
        lambda _: (
            hizvk.LodByDistance.at_ndc_depths,
            {"depths": [0.8, 0.9], "near": 1.0, "far": 500.0, "reversed_z": False},
        ),
        {
            "depths": [
                *lod_list("ascending", [0.9, 0.8]),
                ([1.5], ValueError, "at most 1, got float 1.5"),
            ],
            "near": [
                (0.0, ValueError, "above 0, got float 0.0"),
                ("1", TypeError, "got str '1'"),
            ],
            "far": [
                (1.0, ValueError, "above 1, got float 1.0"),
                (NAN, ValueError, "got float nan"),
            ],
            "reversed_z": FLAG,
        },
    ),
    "LodBySize": Table(
        lambda _: (hizvk.LodBySize, {"pixels": [20.0, 10.0]}),
        {"pixels": lod_list("descending", [10.0, 20.0])},
    ),
    "Spheres": Table(
        lambda _: (hizvk.Spheres, {"centers": np.zeros((2, 3)), "radii": np.ones(2)}),
        {
            "centers": array_of("(N, 3)", wrong=(3, 100)),
            "radii": [
                (np.ones(3), ValueError, "expected float (2,) or one number, got (3,) float64"),
                (np.ones((2, 1)), ValueError, "got (2, 1) float64"),
                (np.ones(2, dtype=bool), TypeError, "got (2,) bool"),
                ("1", TypeError, "got str '1'"),
                (np.timedelta64(0, "s"), TypeError, "got timedelta64"),
                (True, TypeError, "got bool True"),
                (1j, TypeError, "got complex 1j"),
                (None, TypeError, "got None"),
                (10**400, ValueError, "expected float (2,) or one number, got int 1000"),
            ],
        },
    ),
    "Boxes": Table(
        lambda _: (hizvk.Boxes, {"min": np.zeros((2, 3)), "max": np.ones((2, 3))}),
        {"min": array_of("(N, 3)", wrong=(3, 100)), "max": array_of("(2, 3)", wrong=(3, 3))},
    ),
    "Boxes.from_corners": Table(
        lambda _: (hizvk.Boxes.from_corners, {"corners": np.zeros((2, 8, 3))}),
        {"corners": array_of("(N, 8, 3)", wrong=(2, 3))},
    ),
    "OrientedBoxes.from_corners": Table(
        lambda _: (
            hizvk.OrientedBoxes.from_corners,
            {"corners": np.zeros((2, 8, 3)), "order": "kitti"},
        ),
        {
            "corners": [
                *array_of("(N, 8, 3)", wrong=(2, 3)),
                (np.zeros((2, 3, 8)), ValueError, "pass corners.swapaxes(-1, -2)"),
                (np.arange(24.0).reshape(1, 8, 3) ** 2, ValueError, "1 of 1 that are no box in it"),
            ],
            "order": [
                ("waymo", ValueError, '"carla" (get_world_vertices) or "open3d"'),
                (None, TypeError, "got None"),
            ],
        },
    ),
    "OrientedBoxes": Table(
        lambda _: (
            hizvk.OrientedBoxes,
            {
                "centers": np.zeros((2, 3)),
                "half_sizes": np.ones((2, 3)),
                "rotations": np.zeros((2, 3, 3)),
            },
        ),
        {
            "centers": array_of("(N, 3)", wrong=(3, 100)),
            "half_sizes": array_of("(2, 3)", wrong=(3, 3)),
            "rotations": [
                *array_of("(2, 3, 3)", wrong=(2, 9)),
                (
                    np.zeros(2),
                    ValueError,
                    "got (2,) float64; angles, quaternions and matrices with a translation are",
                ),
                (
                    np.zeros((2, 4)),
                    ValueError,
                    "OrientedBoxes.from_yaw, .from_quaternions and .from_transforms",
                ),
            ],
        },
    ),
    "OrientedBoxes.from_yaw": Table(
        lambda _: (
            hizvk.OrientedBoxes.from_yaw,
            {
                "centers": np.zeros((2, 3)),
                "half_sizes": np.ones((2, 3)),
                "yaw_deg": np.zeros(2),
                "up": (0, 0, 1),
            },
        ),
        {
            "centers": array_of("(N, 3)", wrong=(3, 100)),
            "half_sizes": HALF_SIZES,
            "yaw_deg": [
                (np.zeros(3), ValueError, "expected float (2,) or one number, got (3,) float64"),
                ("north", TypeError, "got str 'north'"),
            ],
            "up": [*VECTOR, ((0, 0, 0), ValueError, "expected a direction, got (0.0, 0.0, 0.0)")],
        },
    ),
    "OrientedBoxes.from_quaternions": Table(
        lambda _: (
            hizvk.OrientedBoxes.from_quaternions,
            {
                "centers": np.zeros((2, 3)),
                "half_sizes": 0.5,
                "quaternions": [[1, 0, 0, 0], [0.5, 0.5, 0.5, 0.5]],
                "order": "wxyz",
            },
        ),
        {
            "centers": array_of("(N, 3)", wrong=(3, 100)),
            "half_sizes": HALF_SIZES,
            "quaternions": array_of("(2, 4)", wrong=(4, 4)),
            "order": [
                (
                    "zyxw",
                    ValueError,
                    'expected "wxyz" (nuScenes, COLMAP, Blender, trimesh, MuJoCo) or "xyzw" (SciPy',
                ),
                (None, TypeError, "got None; there is no default"),
            ],
        },
    ),
    "OrientedBoxes.from_transforms": Table(
        lambda _: (
            hizvk.OrientedBoxes.from_transforms,
            {"world_from_box": np.stack([EYE4, EYE4]), "half_sizes": [1.0, 2.0, 3.0]},
        ),
        {
            "world_from_box": [
                *array_of("(N, 4, 4)", wrong=(2, 3, 3)),
                (np.eye(3), ValueError, "expected float (4, 4), got (3, 3) float64"),
                (TRANSPOSED_POSE, ValueError, "it looks transposed"),
            ],
            "half_sizes": HALF_SIZES,
        },
    ),
    "Camera": Table(lambda _: (hizvk.Camera, {}), {}),
    "Camera.look_at": Table(
        lambda _: (hizvk.Camera.look_at, {**LOOK, "fov_y_deg": 60}), {**VIEW, "fov_y_deg": FOV}
    ),
    "Camera.frustum": Table(
        lambda _: (hizvk.Camera.frustum, {**LOOK, "left": -1, "right": 2, "bottom": -1, "top": 1}),
        {
            **VIEW,
            "left": NUMBER,
            "right": [*NUMBER, (-1, ValueError, "above -1, got int -1")],
            "bottom": NUMBER,
            "top": [*NUMBER, (-2, ValueError, "above -1, got int -2")],
        },
    ),
    "Camera.orthographic": Table(
        lambda _: (hizvk.Camera.orthographic, {**LOOK, "height": 10, "width": 20}),
        {
            **VIEW,
            "near": ORTHO_NEAR,
            "far": [*FAR, (INF, ValueError, "got float inf"), (None, TypeError, "got None")],
            "height": [(0, ValueError, "above 0, got int 0"), ("1", TypeError, "got str '1'")],
            "width": [(-1, ValueError, "above 0, got int -1"), ("1", TypeError, "got str '1'")],
        },
    ),
    "Camera.from_opencv": Table(
        lambda _: (
            hizvk.Camera.from_opencv,
            {
                "k": K,
                "pixel_center": "half",
                "camera_from_world": EYE4,
                "size": (48, 64),
                "near": 0.1,
            },
        ),
        {
            "k": INTRINSICS,
            "pixel_center": PIXEL_CENTER,
            "camera_from_world": [
                *POSE,
                (None, ValueError, "expected exactly one of them: (4, 4), (3, 4) or a pair"),
            ],
            "world_from_camera": POSE,
            "size": SIZE,
            "near": NEAR,
            "far": FAR,
            "distortion": DISTORTION,
            "reversed_z": FLAG,
        },
    ),
    "Camera.from_colmap": Table(
        lambda _: (
            hizvk.Camera.from_colmap,
            {
                "model": "PINHOLE",
                "params": [100, 110, 32, 24],
                "qvec": [1, 0, 0, 0],
                "tvec": [0, 0, 4],
                "size": (48, 64),
                "near": 0.1,
            },
        ),
        {
            "model": [
                (
                    "pinhole",
                    ValueError,
                    "expected one of COLMAP's models SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL",
                ),
                (
                    "OPENCV_FISHEYE",
                    ValueError,
                    "no pinhole with any numbers; run COLMAP's image_undistorter, and pass",
                ),
                ("THIN_PRISM_FISHEYE", ValueError, "image_undistorter"),
                (1, TypeError, "got int 1"),
                (None, TypeError, "got None"),
            ],
            "params": [
                (
                    [100, 32, 24],
                    ValueError,
                    "expected fx, fy, cx, cy of PINHOLE, (4,) finite numbers, got (3,)",
                ),
                ([100, 0, 32, 24], ValueError, "with focal lengths above 0"),
                ([100, -1, 32, 24], ValueError, "with focal lengths above 0"),
                ([100, NAN, 32, 24], ValueError, "nan"),
                ("100", TypeError, "got str '100'"),
            ],
            "qvec": [
                (
                    [0, 0, 0, 0],
                    ValueError,
                    "expected a quaternion (w, x, y, z) of length 1, got [0.0, 0.0, 0.0, 0.0]",
                ),
                ([1, 1, 0, 0], ValueError, "of length 1.41421"),
                ([1, 0, 0], ValueError, "expected (4,) finite numbers, got (3,) float64"),
                ([NAN, 0, 0, 1], ValueError, "nan"),
                (
                    None,
                    ValueError,
                    "expected the other half of the pose, as images.txt has it; got None",
                ),
            ],
            "tvec": VECTOR_OR_NONE,
            "camera_from_world": POSE,
            "world_from_camera": POSE,
            "size": SIZE,
            "near": NEAR,
            "far": FAR,
            "reversed_z": FLAG,
        },
    ),
    "Camera.from_opengl": Table(
        lambda _: (
            hizvk.Camera.from_opengl,
            {"projection": GL, "camera_from_world": EYE4, "size": (48, 64)},
        ),
        {
            "projection": [
                *MATRIX,
                (GL.T, ValueError, "looks transposed; pass projection.T"),
                (
                    None,
                    ValueError,
                    "projection, k, fov_x_deg, fov_y_deg: expected exactly one of them, got none",
                ),
            ],
            "k": INTRINSICS,
            "pixel_center": PIXEL_CENTER,
            "fov_x_deg": FOV[:2],
            "fov_y_deg": FOV[:2],
            "camera_from_world": POSE,
            "world_from_camera": POSE,
            "size": SIZE,
            "near": NEAR,
            "far": FAR,
            "distortion": DISTORTION,
            "reversed_z": FLAG[::2],
        },
    ),
    "Camera.from_matrices": Table(
        lambda _: (
            hizvk.Camera.from_matrices,
            {"clip_from_world": GL, "size": (48, 64), "reversed_z": False},
        ),
        {
            "clip_from_world": CLIP,
            "clip_from_camera": MATRIX,
            "camera_from_world": POSE,
            "world_from_camera": POSE,
            "size": SIZE,
            "reversed_z": FLAG,
        },
    ),
    "Camera.project": Table(
        lambda _: (camera().project, {"xyz": np.zeros((2, 3))}),
        {"xyz": array_of("(N, 3)", wrong=(3, 100))},
    ),
    "Projected.rounded": Table(lambda _: (camera().project(np.zeros((2, 3))).rounded, {}), {}),
    "PointColours.bytes": Table(
        lambda device: (
            hizvk.colour_points(hizvk.Points(np.zeros((2, 3))), [], device=device).bytes,
            {},
        ),
        {},
    ),
    "Points": Table(
        lambda _: (hizvk.Points, {"positions": np.zeros((2, 3))}),
        {"positions": array_of("(N, 3)", wrong=(3, 100))},
    ),
    "Tolerance": Table(
        lambda _: (hizvk.Tolerance, {"rel": 0.01, "abs": 0.02}),
        {
            "rel": [
                (0.6, ValueError, "at least 0 and at most 0.5, got float 0.6"),
                (NAN, ValueError, "got float nan"),
                ("1", TypeError, "got str '1'"),
            ],
            "abs": RADIUS,
        },
    ),
    "gather": Table(
        lambda _: (hizvk.gather, {"image": np.zeros((4, 4)), "pixels": np.zeros((2, 2))}),
        {
            "image": [
                (np.zeros(4), ValueError, "expected (height, width) or (height, width, channels)"),
                (np.zeros((0, 4)), ValueError, "got (0, 4) float64"),
                ("image", ValueError, "got str 'image'"),
            ],
            "pixels": array_of("(N, 2)", wrong=(2, 100)),
            "sampling": SAMPLING,
        },
    ),
    "fill_depth": Table(
        lambda _: (hizvk.fill_depth, {"depth": np.ones((6, 8)), "radius_px": 2, "kind": "z"}),
        {
            "depth": [
                (np.ones(48), ValueError, "expected float (height, width), or whole numbers of 16"),
                (np.ones((6, 8), np.uint8), TypeError, "got (6, 8) uint8"),
                (np.ones((6, 8), bool), TypeError, "got (6, 8) bool"),
                (np.full((6, 8), 2**60), ValueError, "which float64 cannot hold"),
                ([[1.0, 2.0], [3.0]], ValueError, "no array"),
                ("depth", TypeError, "got ndarray array('depth'"),
                (None, TypeError, "got ndarray array(None"),
            ],
            "radius_px": [
                (-1, ValueError, "expected an integer in 0..1024, got int -1"),
                (1025, ValueError, "got int 1025"),
                (2.0, TypeError, "got float 2.0"),
            ],
            "kind": [
                ("ndc", ValueError, 'expected one of "z", "distance", got str \'ndc\''),
                (None, TypeError, "got None"),
            ],
            "invalid": INVALID,
        },
    ),
    "depth_from_points": Table(
        lambda _: (
            hizvk.depth_from_points,
            {"points": hizvk.Points(np.zeros((2, 3))), "camera": camera()},
        ),
        {"points": POINTS, "camera": CAMERA, "radius": RADIUS, "radius_px": RADIUS},
    ),
    "colour_points": Table(
        lambda device: (
            hizvk.colour_points,
            {
                "points": hizvk.Points(np.zeros((2, 3))),
                "views": [(camera(), np.ones((6, 8)), np.zeros((6, 8, 3), np.uint8))],
                "kind": "z",
                "device": device,
            },
        ),
        {
            "points": POINTS,
            "views": [
                (None, TypeError, "expected an iterable of (Camera, depth, image), got None"),
                ([camera()], TypeError, "expected tuples (Camera, depth, image), got Camera"),
                ([(1, 2, 3)], TypeError, "expected a Camera first in each view, got int 1"),
                (
                    [(camera(), np.ones((6, 8)), np.zeros((6, 8, 3), np.int32))],
                    TypeError,
                    "expected uint8 or float images (6, 8, 3), got (6, 8, 3) int32",
                ),
                (
                    [(camera(), np.ones((6, 8)), np.zeros((8, 6, 3), np.uint8))],
                    ValueError,
                    "expected images (6, 8, 3) (the camera's size), got (8, 6, 3) uint8; an image "
                    "of another size goes with camera.resized",
                ),
                (
                    [(camera(), np.ones((6, 8)), np.zeros((6, 8, 4), np.uint8))],
                    ValueError,
                    "got (6, 8, 4) uint8; without the alpha it is image[..., :3]",
                ),
                (
                    [(camera(), np.ones((6, 8)), np.zeros((6, 8), np.uint8))],
                    ValueError,
                    "got (6, 8) uint8; a grey one goes as np.dstack([image] * 3)",
                ),
            ],
            "kind": KIND,
            "scale": SCALE,
            "invalid": INVALID,
            "tolerance": TOLERANCE,
            "sampling": SAMPLING,
            "weight": [
                ("far", ValueError, 'expected one of "equal", "near"'),
                (1, TypeError, "got int 1"),
            ],
            "device": [(3, TypeError, "expected a Device or None, got int 3")],
            "options": OPTIONS_OBJECT,
            **OPTIONS,
            "progress": PROGRESS,
        },
    ),
    "Camera.resized": Table(lambda _: (camera().resized, {"size": (3, 4)}), {"size": SIZE}),
    "Mesh": Table(
        lambda _: (
            hizvk.Mesh,
            {"vertices": np.zeros((3, 3)), "triangles": [[0, 1, 2]], "transforms": EYE4},
        ),
        {"vertices": VERTICES, "triangles": TRIANGLES, "transforms": TRANSFORMS},
    ),
    "Mesh.of": Table(
        lambda _: (hizvk.Mesh.of, {"mesh": TETRAHEDRON, "transforms": EYE4}),
        {
            "mesh": [
                (
                    None,
                    TypeError,
                    "expected a Mesh, a mesh of trimesh, Open3D or PyVista, or a scene",
                ),
                (np.zeros((3, 3)), TypeError, "got (3, 3) float64"),
            ],
            "transforms": TRANSFORMS,
        },
    ),
    "DrawTemplate": Table(
        lambda _: (hizvk.DrawTemplate, {"index_count": 36}),
        {
            "index_count": unsigned("index_count"),
            "first_index": unsigned("first_index"),
            "first_instance": unsigned("first_instance"),
            "base_vertex": [
                (2**31, ValueError, "in -2147483648..2147483647"),
                (0.5, TypeError, "got float 0.5"),
            ],
        },
    ),
    "Device": Table(
        lambda _: (hizvk.Device, {}),
        {
            "adapter": [
                (
                    1.5,
                    TypeError,
                    "expected an adapter's index, a part of its name, or None, got float 1.5",
                ),
                (True, TypeError, "got bool True"),
                (-1, ValueError, "in 0..2147483647, got int -1"),
                (" ", ValueError, "got an empty string"),
            ]
        },
    ),
    "Device.instances": Table(
        lambda device: (device.instances, {"bounds": spheres()}),
        {
            "bounds": BOUNDS,
            "strict": FLAG,
            "order": [
                ("sorted", ValueError, 'expected one of "morton", "given", got str \'sorted\''),
                (None, TypeError, "got None"),
            ],
            "mesh_ids": [
                ([0.5], TypeError, "expected integer (1,), got (1,) float64"),
                ([0, 1], ValueError, "expected integer (1,), got (2,) int64"),
                ([-1], ValueError, "expected mesh ids from 0 on, or hizvk.ABSENT, got -1"),
                ([2**32], ValueError, "or hizvk.ABSENT, got 4294967296"),
                ([2**20], hizvk.LimitError, "1048577 requested, this device allows 65536"),
                ("mesh", TypeError, "got str 'mesh'"),
            ],
            "scales": [
                ([1.0, 2.0], ValueError, "expected float (1,) or one number, got (2,) float64"),
                ([-1.0], ValueError, "expected numbers from 0 on below 2^60, got -1"),
                ([NAN], ValueError, "got NaN at index 0"),
                ("large", TypeError, "got str 'large'"),
            ],
        },
    ),
    "Occluders.move": Table(
        lambda device: (
            device.occluders(np.zeros((3, 3)), [[0, 1, 2]]).move,
            {"mesh": 0, "transforms": EYE4},
        ),
        {
            "mesh": [
                (1, ValueError, "expected the number of one of the 1 meshes, got 1"),
                (-1, ValueError, "in 0..4294967295, got int -1"),
                ("door", TypeError, "got str 'door'"),
            ],
            "transforms": TRANSFORMS,
        },
    ),
    "Instances.update": Table(
        lambda device: (device.instances(spheres()).update, {"first": 0, "bounds": spheres()}),
        {
            "first": [
                (2, ValueError, "in 0..1, got int 2"),
                (-1, ValueError, "in 0..1, got int -1"),
                (0.0, TypeError, "got float 0.0"),
            ],
            "bounds": [
                *BOUNDS,
                (
                    hizvk.Boxes(np.zeros((1, 3)), np.ones((1, 3))),
                    TypeError,
                    "expected spheres as the instances are, got Boxes Boxes(1 of float64)",
                ),
                (
                    hizvk.Spheres(np.zeros((2, 3)), 1.0),
                    ValueError,
                    "expected at most 1 from instance 0 of 1 on, got 2",
                ),
            ],
            "strict": FLAG,
        },
    ),
    "Device.occluders": Table(
        lambda device: (device.occluders, {"vertices": np.zeros((3, 3)), "triangles": [[0, 1, 2]]}),
        {
            "vertices": [*VERTICES, (None, TypeError, "got None")],
            "triangles": TRIANGLES,
            "transforms": TRANSFORMS,
            "cull": [
                ("both", ValueError, 'expected one of "none", "back", "front", got str \'both\''),
                (None, TypeError, "got None"),
            ],
        },
    ),
    "Device.render_depth": Table(
        lambda device: (
            device.render_depth,
            {"occluders": device.occluders(np.zeros((3, 3)), [[0, 1, 2]]), "camera": camera()},
        ),
        {
            "occluders": [
                (
                    np.zeros((3, 3)),
                    TypeError,
                    "expected Occluders of Device.occluders, got (3, 3) float64",
                )
            ],
            "camera": CAMERA,
            "size": SIZE,
            "conservative": FLAG,
            "refinement": [
                (9, ValueError, "in 0..8"),
                (-1, ValueError, "in 0..8"),
                (2.0, TypeError, "got float 2.0"),
            ],
            "rasteriser": [
                ("gpu", ValueError, 'expected one of "auto", "device", "host", got str'),
                (None, TypeError, "got None"),
            ],
            "into": [
                (np.zeros((6, 8)), TypeError, "expected a DepthImage of Device.render_depth"),
            ],
            "only": [
                ("all", TypeError, "expected a CullResult, a bool (1,) array or an array of int"),
                ([0.0], TypeError, "got (1,) float64"),
                ([[0]], TypeError, "got (1, 1) int64"),
                ([1], ValueError, "expected numbers of copies in 0..0, got 1"),
                ([-1], ValueError, "expected numbers of copies in 0..0, got -1"),
                ([True, False], ValueError, "expected bool (1,), got (2,) bool"),
                (np.ma.masked_all(1, bool), TypeError, "got a masked array"),
            ],
            "max_triangles": LIMIT,
            "max_occluders": LIMIT,
            "progress": PROGRESS,
        },
    ),
    "Device.pyramid": Table(
        lambda device: (
            device.pyramid,
            {"depth": np.ones((6, 8)), "camera": camera(), "kind": "z"},
        ),
        {
            "depth": [*IMAGE, (None, TypeError, "got None")],
            "camera": CAMERA,
            "kind": KIND,
            "scale": SCALE,
            "invalid": INVALID,
            "tolerance": TOLERANCE,
            "levels": LEVELS,
            "depths": DEPTHS,
        },
    ),
    "Device.receiver_mask": Table(
        lambda device: (
            device.receiver_mask,
            {
                "depth": np.ones((6, 8)),
                "camera": camera(),
                "light_camera": camera(),
                "kind": "z",
                "filter_radius": 0.1,
                "reach_px": 0.5,
                "depth_slack": 0.0,
                "depth_slack_abs": 0.0,
            },
        ),
        {
            "depth": [
                *IMAGE,
                (np.ones((6, 8, 4)), ValueError, "expected one sample per pixel, got 4"),
            ],
            "camera": CAMERA,
            "light_camera": CAMERA,
            "kind": KIND,
            "filter_radius": [*NUMBER, (-1.0, ValueError, "got float -1.0")],
            "reach_px": [
                *NUMBER,
                (17.0, ValueError, "at most 16, got float 17.0"),
                (0.3, ValueError, "expected a multiple of 1/256, got 0.3"),
            ],
            "depth_slack": DEPTH_SLACK,
            "depth_slack_abs": DEPTH_SLACK,
        },
    ),
    "Device.cull": Table(
        lambda device: (device.cull, cull_arguments(device)),
        {
            "instances": [
                (
                    spheres(),
                    TypeError,
                    "expected Instances of Device.instances, got Spheres Spheres(1",
                )
            ],
            "camera": [
                (None, TypeError, "expected a Camera or a sequence of Cameras, got None"),
                (EYE4, TypeError, "got (4, 4) float64"),
                ("front", TypeError, "got str 'front'"),
                ([], ValueError, "expected 1 to 256 views, got 0"),
                ([camera()] * 257, ValueError, "expected 1 to 256 views, got 257"),
                ([None], TypeError, "camera[0]: expected a Camera, got None"),
                (camera((6, 9)), ValueError, "expected the camera of the pyramid"),
                (
                    camera().resized((3, 4)),
                    ValueError,
                    "pass camera.resized((6, 8)), the same view; the promise is",
                ),
                (camera((6, 9)), ValueError, "depth of one camera says nothing about another one"),
            ],
            "pyramid": [
                (
                    np.zeros((6, 8)),
                    TypeError,
                    "expected a Pyramid of Device.pyramid, got (6, 8) float64",
                )
            ],
            "options": OPTIONS_OBJECT,
            "outputs": OUTPUTS_OBJECT,
            "among": [
                ("all", TypeError, "expected a bool (1,) array, a CullResult or a ViewsResult"),
                ([0], TypeError, "got (1,) int64"),
                ([True, False], ValueError, "got (2,) bool"),
                ([[True]], ValueError, "got (1, 1) bool"),
                (np.ma.masked_all(1, bool), TypeError, "got a masked array"),
            ],
            "wait": FLAG,
            **OPTIONS,
            "pixel_budget": PIXEL_BUDGET,
            "capacity": CAPACITY,
            "draw": DRAW,
            **OF_MESHES,
        },
    ),
    "Device.occlusion_map": Table(
        lambda device: (
            device.occlusion_map,
            {"occluders": device.occluders([TETRAHEDRON]), "camera": camera()},
        ),
        {
            "occluders": [(TETRAHEDRON, TypeError, "expected Occluders of Device.occluders")],
            "camera": [(None, TypeError, "expected a Camera, got None")],
            "size": [
                ((256, 255), ValueError, "expected powers of two up to 32768, got (256, 255)"),
                (256, TypeError, "got int 256"),
            ],
            "least": [
                (3, ValueError, "expected a power of two, got 3"),
                (512, ValueError, "expected an integer in 1..256, got int 512"),
            ],
            "regions": [
                (0, ValueError, "expected an integer in 1..256, got int 0"),
                (24, ValueError, "expected a power of two, got 24"),
            ],
            "max_triangles": [(-1, ValueError, "got int -1")],
            "max_occluders": [(0.5, TypeError, "got float 0.5")],
        },
    ),
    "OcclusionMap.level": Table(
        lambda device: (occlusion_map(device).level, {"level": 0}),
        {"level": [(7, ValueError, "in -7..6, got int 7"), (0.0, TypeError, "got float 0.0")]},
    ),
    "OcclusionMap.opacity": Table(
        lambda device: (occlusion_map(device).opacity, {"level": 0}),
        {"level": [(-8, ValueError, "in -7..6, got int -8")]},
    ),
    "OcclusionMap.least_counts": Table(
        lambda device: (occlusion_map(device).least_counts, {"negligible_px": 0}),
        {"negligible_px": [(-1, ValueError, "got int -1"), (1.0, TypeError, "got float 1.0")]},
    ),
    "BspTiling": Table(
        lambda device: (hizvk.BspTiling, {"occluders": device.occluders([TETRAHEDRON])}),
        {
            "occluders": [(TETRAHEDRON, TypeError, "expected Occluders of Device.occluders")],
            "leaf": [(0, ValueError, "got int 0"), (0.5, TypeError, "got float 0.5")],
            "most_parts": [
                (0.5, ValueError, "got float 0.5"),
                ("all", TypeError, "got str 'all'"),
                (NAN, ValueError, "got float nan"),
            ],
        },
    ),
    "BspTiling.draw": Table(
        lambda device: (
            hizvk.BspTiling(device.occluders([TETRAHEDRON])).draw,
            {"camera": camera()},
        ),
        {"camera": [(None, TypeError, "expected a Camera, got None")]},
    ),
    "Device.cull_map": Table(
        lambda device: (
            device.cull_map,
            {"bounds": spheres(), "camera": camera(), "maps": occlusion_map(device)},
        ),
        {
            "bounds": [(None, TypeError, "expected Spheres, Boxes, OrientedBoxes or Points")],
            "camera": [
                (None, TypeError, "expected a Camera, got None"),
                (camera(far=9.0), ValueError, "expected the view of the maps"),
            ],
            "maps": [(None, TypeError, "expected an OcclusionMap of Device.occlusion_map")],
            "negligible_px": [
                (-1, ValueError, "expected an integer in 0..4294967295, got int -1"),
                (0.5, TypeError, "got float 0.5"),
            ],
            "copies": [
                ([0, 1, 2], ValueError, "expected integer (1,), got"),
                ([0.5], TypeError, "expected integer (1,), got"),
                ([-1], ValueError, "expected numbers of copies from 0 on, or hizvk.ABSENT, got -1"),
            ],
        },
    ),
    "Device.cull_approximate": Table(
        lambda device: (
            device.cull_approximate,
            {
                "instances": device.instances(spheres()),
                "camera": camera(),
                "pyramid": device.pyramid(np.ones((6, 8)), camera(), kind="z"),
                "negligible_px": 4,
            },
        ),
        {
            "instances": [
                (spheres(), TypeError, "expected Instances of Device.instances, got Spheres")
            ],
            "camera": [
                (None, TypeError, "expected a Camera, got None"),
                (camera((6, 9)), ValueError, "expected the camera of the pyramid"),
            ],
            "pyramid": [(None, TypeError, "expected a Pyramid of Device.pyramid, got None")],
            "options": OPTIONS_OBJECT,
            "negligible_px": [
                (-1, ValueError, "expected an integer in 0..4294967295, got int -1"),
                (0.5, TypeError, "got float 0.5"),
            ],
            **OPTIONS,
        },
    ),
    "CullResult.visible_fraction": Table(
        lambda device: (
            device.cull(
                device.instances(spheres()),
                camera(),
                device.pyramid(np.ones((6, 8)), camera(), kind="z"),
                outputs=["pixels"],
            ).visible_fraction,
            {},
        ),
        {"objects_in_depth": FLAG},
    ),
    "visible_fraction": Table(
        lambda _: (hizvk.visible_fraction, {"pixels": np.zeros(2, hizvk.PIXELS_DTYPE)}),
        {
            "pixels": [
                (np.zeros(2), TypeError, "expected an array of PIXELS_DTYPE, got (2,) float64"),
                ([(1, 0, 1, 0, 0)], TypeError, "expected an array of PIXELS_DTYPE, got"),
            ],
            "objects_in_depth": FLAG,
        },
    ),
    "Device.temporal": Table(
        lambda device: (device.temporal, {"instances": device.instances(spheres())}),
        {
            "instances": [
                (spheres(), TypeError, "expected Instances of Device.instances, got Spheres")
            ],
            "early_capacity": [
                (-1, ValueError, "expected an integer in 0..4294967295, got int -1"),
                (2.0, TypeError, "got float 2.0"),
            ],
        },
    ),
    "Temporal.early": Table(
        lambda device: (
            device.temporal(device.instances(spheres())).early,
            {"camera": camera()},
        ),
        {
            "camera": CAMERA,
            "only": [
                ([True, False], ValueError, "expected bool (1,), got (2,) bool"),
                ([1], ValueError, "expected numbers of instances in 0..0, got 1"),
                ("all", TypeError, "got str 'all'"),
            ],
            "largest_px": [
                (-1, ValueError, "expected an integer in 0..2147483647, got int -1"),
                (1.5, TypeError, "got float 1.5"),
            ],
        },
    ),
    "Temporal.late": Table(
        lambda device: (
            device.temporal(device.instances(spheres())).late,
            {"camera": camera(), "depth": np.ones((6, 8)), "kind": "z"},
        ),
        {
            "camera": CAMERA,
            "depth": [*IMAGE, (None, TypeError, "got None")],
            "kind": KIND,
            "scale": SCALE,
            "invalid": INVALID,
            "levels": LEVELS,
            "options": OPTIONS_OBJECT,
            **OPTIONS,
        },
    ),
    "Temporal.reset": Table(
        lambda device: (device.temporal(device.instances(spheres())).reset, {}), {}
    ),
    "Device.warm_up": Table(
        lambda device: (
            device.warm_up,
            {"instances": device.instances(spheres()), "camera": camera()},
        ),
        {
            "instances": [
                (
                    spheres(),
                    TypeError,
                    "expected Instances of Device.instances, got Spheres Spheres(1",
                )
            ],
            "camera": CAMERA,
            "options": OPTIONS_OBJECT,
            "outputs": OUTPUTS_OBJECT,
            "occluders": [
                (
                    np.zeros((3, 3)),
                    TypeError,
                    "expected Occluders of Device.occluders or None, got (3, 3) float64",
                )
            ],
            "levels": LEVELS,
            **OPTIONS,
            "pixel_budget": PIXEL_BUDGET,
            "capacity": CAPACITY,
            "draw": DRAW,
            **OF_MESHES,
        },
    ),
    "CullOptions": Table(lambda _: (hizvk.CullOptions, {}), OPTIONS),
    "Outputs": Table(
        lambda _: (hizvk.Outputs, {}),
        {
            "mask": FLAG,
            "verdicts": FLAG,
            "indices": FLAG_OR_NONE,
            "draws": FLAG_OR_NONE,
            "pixels": FLAG,
            "pixel_budget": PIXEL_BUDGET,
            "capacity": CAPACITY,
            "draw": DRAW,
            **OF_MESHES,
        },
    ),
    "MeshLods": Table(
        lambda _: (hizvk.MeshLods, {"draws": [hizvk.DrawTemplate(3)] * 2}),
        {
            "draws": [
                (hizvk.DrawTemplate(3), TypeError, "expected a sequence of DrawTemplate, got"),
                ([36], TypeError, "expected a DrawTemplate for each level, got int 36"),
                ([], ValueError, "expected 1 to 8 levels of detail, got none"),
                (
                    [hizvk.DrawTemplate(3, first_instance=7)],
                    ValueError,
                    "expected first_instance 0, which the cull sets, got 7",
                ),
                (
                    [hizvk.DrawTemplate(3)] * 9,
                    hizvk.LimitError,
                    "9 requested, this device allows 8",
                ),
            ],
            "errors": [
                ([0.0], ValueError, "expected one for each of 2 levels of detail, got 1"),
                ([0.0, -1.0], ValueError, "got float -1.0"),
                ([0.0, NAN], ValueError, "got float nan"),
                ([0.0, "far"], TypeError, "got str 'far'"),
                (0.5, TypeError, "expected a sequence of numbers or None, got float 0.5"),
            ],
        },
    ),
    "check_proxy": Table(
        lambda device: (hizvk.check_proxy, {"proxy": TETRAHEDRON, "mesh": TETRAHEDRON}),
        {
            "proxy": [*SINGLE_MESH],
            "mesh": [
                *SINGLE_MESH,
                (
                    (TETRAHEDRON.vertices, TETRAHEDRON.triangles[:3]),
                    ValueError,
                    "expected a closed mesh whose triangles run consistently around, got 3 edges",
                ),
            ],
            "progress": PROGRESS,
        },
    ),
    "check_bounds": Table(
        lambda device: (hizvk.check_bounds, {"bounds": spheres(), "meshes": [TETRAHEDRON]}),
        {
            "bounds": BOUNDS,
            "meshes": [
                (
                    None,
                    TypeError,
                    "expected a Mesh, a mesh of trimesh, Open3D or PyVista, or a list of them",
                ),
                ([], ValueError, "expected one for each of the 1 bounds, got 0"),
                (
                    [TETRAHEDRON, TETRAHEDRON],
                    ValueError,
                    "expected one for each of the 1 bounds, got 2",
                ),
                ([(TETRAHEDRON.vertices,)], TypeError, "got tuple"),
                (
                    [(np.zeros((3, 2)), [[0, 1, 2]])],
                    ValueError,
                    "vertices: expected float (V, 3), got (3, 2) float64",
                ),
            ],
            "progress": PROGRESS,
        },
    ),
    "Device.timed": Table(lambda device: (device.timed, {}), {}),
    "Device.wait": Table(lambda device: (device.wait, {}), {}),
    "DepthImage.plot": Table(
        lambda device: (rendered(device).plot, {}), {"kind": WANTED_KIND, "unit": TEXT}
    ),
    "DepthImage.numpy": Table(lambda device: (rendered(device).numpy, {}), {"kind": WANTED_KIND}),
    "mip_texel": Table(
        lambda _: (hizvk.mip_texel, {"pixel": (0, 0), "level": 1, "size": (6, 8)}),
        {
            "pixel": [
                ((6, 0), ValueError, "rows below 6 and columns below 8, got 0 to 6"),
                ((0, -1), ValueError, "got -1 to 0"),
                ((0.5, 1.0), TypeError, "expected (..., 2) integers"),
                ((1, 2, 3), ValueError, "got (3,) int64"),
                (3, ValueError, "got int 3"),
                ([[1, 2], [3]], ValueError, "a ragged sequence"),
                (None, TypeError, "got None"),
            ],
            "level": [
                (4, ValueError, "expected an integer in 0..3, got int 4"),
                (-1, ValueError, "got int -1"),
                (1.0, TypeError, "got float 1.0"),
            ],
            "size": SIZE,
            "lookup": [
                ("edge", ValueError, 'expected one of "normalized", "edge_texel", got str'),
                (None, TypeError, "got None"),
            ],
        },
    ),
    "wgsl": Table(
        lambda _: (hizvk.wgsl, {}),
        {
            "name": [
                ("mip", ValueError, 'expected one of "mip_lookup", "mip_cull"'),
                (1, TypeError, "got int 1"),
            ]
        },
    ),
    "Pyramid.mips": Table(
        lambda device: (device.pyramid(np.ones((6, 8)), camera(), kind="z").mips, {}),
        {
            "depths": [
                ("all", ValueError, 'expected one of "farthest", "nearest", "both", got str'),
                (None, TypeError, "got None"),
            ],
            "lookup": [
                ("edge", ValueError, 'expected one of "normalized", "edge_texel", got str'),
                (True, TypeError, "got bool True"),
            ],
        },
    ),
    "Pyramid.level": Table(
        lambda device: (device.pyramid(np.ones((6, 8)), camera(), kind="z").level, {"k": 0}),
        {
            "k": [
                (4, IndexError, "expected a level in 0..3, got 4"),
                (-1, IndexError, "expected a level in 0..3, got -1"),
                (0.0, TypeError, "got float 0.0"),
            ],
            "end": [
                ("nearest", ValueError, 'expected one of "farthest", got'),
                (1, TypeError, "got int 1"),
            ],
            "kind": WANTED_KIND,
        },
    ),
    "Pyramid.plot": Table(
        lambda device: (device.pyramid(np.ones((6, 8)), camera(), kind="z").plot, {}),
        {
            "end": [
                ("nearest", ValueError, 'expected one of "farthest", got'),
                (1, TypeError, "got int 1"),
            ],
            "kind": WANTED_KIND,
            "unit": TEXT,
        },
    ),
    "Pyramid.update": Table(
        lambda device: (
            device.pyramid(np.ones((6, 8)), camera(), kind="z").update,
            {"row": 1, "column": 2, "array": np.ones((3, 4))},
        ),
        {
            "row": [
                (6, ValueError, "expected an integer in 0..5, got int 6"),
                (-1, ValueError, "got int -1"),
                (1.0, TypeError, "got float 1.0"),
                (None, TypeError, "got None"),
            ],
            "column": [
                (8, ValueError, "expected an integer in 0..7, got int 8"),
                ((0, 0, 1, 1), TypeError, "got tuple (0, 0, 1, 1)"),
            ],
            "array": [
                (
                    np.ones((6, 4)),
                    ValueError,
                    "expected float64 (height, width) with 1 <= height <= 5 and 1 <= width <= 6, "
                    "which is what lies from row 1 and column 2 on, got (6, 4) float64",
                ),
                (np.ones((3, 7)), ValueError, "got (3, 7) float64"),
                (np.ones((0, 4)), ValueError, "got (0, 4) float64"),
                (np.ones(3), ValueError, "got (3,) float64"),
                (np.ones((3, 4, 4)), ValueError, "got (3, 4, 4) float64"),
                (np.ones((3, 4), np.float32), TypeError, "got (3, 4) float32"),
                ([[1.0]], TypeError, "got list [[1.0]]"),
                (None, TypeError, "got None"),
            ],
        },
    ),
    "CullResult.hints": Table(lambda device: (device.cull(**cull_arguments(device)).hints, {}), {}),
    "CullResult.bin": Table(
        lambda device: (
            device.cull(
                **cull_arguments(device), meshes=[hizvk.MeshLods([hizvk.DrawTemplate(3)])]
            ).bin,
            {"mesh": 0, "lod": 0},
        ),
        {
            "mesh": [
                (1, ValueError, "expected a mesh below 1, got 1"),
                (-1, ValueError, "got int -1"),
                (0.0, TypeError, "got float 0.0"),
            ],
            "lod": [
                (1, ValueError, "expected a level below 1 for mesh 0, got 1"),
                (8, ValueError, "in 0..7, got int 8"),
                ("0", TypeError, "got str '0'"),
            ],
        },
    ),
    "CullResult.plot": Table(
        lambda device: (device.cull(**cull_arguments(device)).plot, {}), DRAWN
    ),
    "CullResult.save_html": Table(
        lambda device: (device.cull(**cull_arguments(device)).save_html, {"path": os.devnull}),
        {
            **DRAWN,
            "path": [
                (3.5, TypeError, "expected a path, got float 3.5"),
                (None, TypeError, "got None"),
            ],
            "occluders": [
                (
                    "wall",
                    TypeError,
                    "expected a Mesh, a mesh of trimesh, Open3D or PyVista, or a list",
                ),
                ([TETRAHEDRON, 3], TypeError, "got int 3"),
            ],
            "title": [(3, TypeError, "expected a text, got int 3")],
        },
    ),
    "Explanation.plot": Table(
        lambda device: (device.cull(**cull_arguments(device)).explain(0).plot, {}), {"unit": TEXT}
    ),
    "CullResult.explain": Table(
        lambda device: (device.cull(**cull_arguments(device)).explain, {"index": 0}),
        {
            "index": [
                (1, IndexError, "expected an integer in 0..0, got 1"),
                (-1, IndexError, "got -1"),
                ("0", TypeError, "got str '0'"),
            ]
        },
    ),
    "visible": Table(
        lambda device: (
            hizvk.visible,
            {
                "bounds": spheres(),
                "camera": camera(),
                "depth": np.ones((6, 8)),
                "kind": "z",
                "device": device,
            },
        ),
        {
            "tolerance": TOLERANCE,
            "bounds": BOUNDS,
            "camera": CAMERA,
            "depth": [*IMAGE, (None, TypeError, "got None")],
            "kind": KIND,
            "scale": SCALE,
            "invalid": INVALID,
            "device": [("lavapipe", TypeError, "expected a Device or None, got str 'lavapipe'")],
            "options": OPTIONS_OBJECT,
            **OPTIONS,
        },
    ),
    "recommend": Table(
        lambda device: (
            hizvk.recommend,
            {
                "bounds": spheres(),
                "cameras": [camera()],
                "depths": [np.ones((6, 8))],
                "kind": "z",
                "device": device,
                "repetitions": 1,
            },
        ),
        {
            "bounds": [
                (
                    np.zeros((2, 3)),
                    TypeError,
                    "expected Spheres, Boxes, OrientedBoxes, Points, Instances or a sequence",
                ),
                (None, TypeError, "got None"),
                ([], ValueError, "got an empty sequence"),
                ([spheres(), 3], TypeError, "got int 3"),
                ([spheres(), spheres()], ValueError, "expected each kind once, got spheres twice"),
                (
                    [spheres(), hizvk.Boxes(np.zeros((2, 3)), np.ones((2, 3)))],
                    ValueError,
                    "expected the same instances in each kind, got [1, 2] of them",
                ),
            ],
            "cameras": [
                (None, TypeError, "expected a Camera or a sequence of Camera, got None"),
                ([], ValueError, "got an empty sequence"),
                ([EYE4], TypeError, "got (4, 4) float64"),
            ],
            "occluders": [("walls", TypeError, "expected exactly one of them, got both")],
            "depths": [
                (3, TypeError, "expected a sequence of (height, width) arrays, got int 3"),
                (
                    [np.ones((6, 8))] * 2,
                    ValueError,
                    "expected 1 images, one for each camera, got 2",
                ),
                (
                    [np.ones((8, 6))],
                    ValueError,
                    "expected float (6, 8) (the camera's size), got (8, 6) float64",
                ),
            ],
            "kind": KIND,
            "scale": SCALE,
            "invalid": INVALID,
            "device": [("lavapipe", TypeError, "expected a Device or None, got str 'lavapipe'")],
            "options": OPTIONS_OBJECT,
            **OPTIONS,
            "max_ms": [(0, ValueError, "above 0, got int 0"), ("2", TypeError, "got str '2'")],
            "kept_within": [
                (0.9, ValueError, "at least 1, got float 0.9"),
                (None, TypeError, "got None"),
            ],
            "meshes": [
                (3, TypeError, "expected a sequence of MeshLods or None, got int 3"),
                ([], ValueError, "expected at least one MeshLods, got none"),
            ],
            "mesh_ids": [
                ([0, 1], ValueError, "expected integer (1,), got (2,) int64"),
                ([0.5], TypeError, "got (1,) float64"),
            ],
            "lods": [([hizvk.LodByError(1)], TypeError, "expected None without meshes")],
            "max_seconds": [
                (-1.0, ValueError, "at least 0, got float -1.0"),
                ("10", TypeError, "got str '10'"),
            ],
            "repetitions": [
                (0, ValueError, "in 1..10000, got int 0"),
                (1.0, TypeError, "got float 1.0"),
            ],
            "progress": PROGRESS,
        },
    ),
    "compare": Table(
        lambda _: (hizvk.compare, {"mask": [True, False], "truth": [True, True]}),
        {
            "mask": [
                (np.array([1, 0]), TypeError, "expected bool (N,), got (2,) int64"),
                (np.ones((2, 1), dtype=bool), ValueError, "got (2, 1) bool"),
                ("ab", TypeError, "got str 'ab'"),
                (None, TypeError, "got None"),
            ],
            "truth": [
                ([True], ValueError, "expected bool (2,), got (1,) bool"),
                (np.array([1.0, 0.0]), TypeError, "got (2,) float64"),
                (np.array([1], dtype=np.uint8), ValueError, "expected uint8 (2,), got (1,) uint8"),
                (
                    np.array([1, 77], dtype=np.uint8),
                    ValueError,
                    "codes of hizvk.reference (1, 2, 3, 4), got 77",
                ),
                (None, TypeError, "got None"),
            ],
        },
    ),
    "compare_unoccluded": Table(
        lambda _: (
            hizvk.compare_unoccluded,
            {"verdicts": np.array([4, 2], dtype=np.uint8), "truth": [True, True]},
        ),
        {
            "verdicts": [
                (np.array([4, 2]), TypeError, "expected uint8 (N,), got (2,) int64"),
                (np.ones((2, 1), dtype=np.uint8), ValueError, "got (2, 1) uint8"),
                (np.array([4, 9], dtype=np.uint8), ValueError, "codes of hizvk.Verdict, got 9"),
                (None, TypeError, "got None"),
            ],
            "truth": [
                ([True], ValueError, "expected bool (2,), got (1,) bool"),
                (np.array([1.0, 0.0]), TypeError, "got (2,) float64"),
                (np.array([6], dtype=np.uint8), ValueError, "expected uint8 (2,), got (1,) uint8"),
                (
                    np.array([6, 1], dtype=np.uint8),
                    ValueError,
                    "codes of hizvk.reference.unoccluded (5, 6, 3, 4), got 1",
                ),
                (None, TypeError, "got None"),
            ],
        },
    ),
    "adapters": Table(lambda _: (hizvk.adapters, {}), {}),
    "reference.classify": Table(
        lambda _: (
            hizvk.reference.classify,
            {"bounds": spheres(), "camera": camera(), "depth": np.ones((6, 8)), "kind": "z"},
        ),
        {
            "bounds": BOUNDS,
            "camera": CAMERA,
            "depth": [*IMAGE, (None, TypeError, "got None")],
            "kind": KIND,
            "scale": SCALE,
            "invalid": INVALID,
            "coverage": COVERAGE,
            "own_depth": [
                ("volume", ValueError, 'expected one of "nearest", "pixel"'),
                (0, TypeError, "got int 0"),
            ],
            "progress": PROGRESS,
        },
    ),
    "reference.unoccluded": Table(
        lambda _: (
            hizvk.reference.unoccluded,
            {"bounds": spheres(), "camera": camera(), "depth": np.ones((6, 8)), "kind": "z"},
        ),
        {
            "bounds": BOUNDS,
            "camera": CAMERA,
            "depth": [*IMAGE, (None, TypeError, "got None")],
            "kind": KIND,
            "scale": SCALE,
            "invalid": INVALID,
            "coverage": COVERAGE,
            "progress": PROGRESS,
        },
    ),
    "reference.pyramid": Table(
        lambda _: (hizvk.reference.pyramid, {"depth": np.ones((6, 8)), "reversed_z": False}),
        {
            "depth": [
                (np.ones(6), ValueError, "expected float (height, width), got (6,) float64"),
                (np.ones((0, 8)), ValueError, "expected at least one pixel, got (0, 8) float64"),
                (np.ones((6, 8), dtype=int), TypeError, "got (6, 8) int64"),
            ],
            "reversed_z": FLAG,
        },
    ),
}

#: Classes that only the package makes, so no argument can be bad.
MADE_BY_THE_PACKAGE = {
    "Adapter",
    "Comparison",
    "UnoccludedComparison",
    "CullResult",
    "CullStats",
    "DepthImage",
    "Explanation",
    "Instances",
}
MADE_BY_THE_PACKAGE |= {"BoundsCheck", "Occluders", "ProxyCheck", "Pyramid", "Recommendation"}
MADE_BY_THE_PACKAGE |= {"StageTime", "StageTimes", "ViewsResult"}
MADE_BY_THE_PACKAGE |= {"ApproximateResult", "PassResult", "Temporal"}
MADE_BY_THE_PACKAGE |= {"MapResult", "OcclusionMap", "TiledCoverage"}
MADE_BY_THE_PACKAGE |= {"PointColours", "Projected", "HierarchyFrame"}
MADE_BY_THE_PACKAGE |= {"InnerBoxes", "InnerPrisms", "OccluderSelection", "SplitMesh"}


# --- making occluders of meshes ---

#: A mesh as vertices and triangles, where the triangles may be left out.
CLOSED: BadValues = {
    "vertices": [
        (np.zeros((4, 2)), ValueError, "expected float (V, 3), got (4, 2) float64"),
        (np.eye(3) * NAN, ValueError, "expected finite float (V, 3)"),
        ("mesh", TypeError, "got str 'mesh'"),
    ],
    "triangles": [
        *TRIANGLES,
        (
            [[0, 1, 2]],
            ValueError,
            "expected a closed mesh whose triangles run consistently around, got 3 edges that run "
            "more often in one direction than in the other (the first in triangle 0); equal "
            "positions count as one vertex; close its holes, split_mesh it",
        ),
    ],
}


def closed(**more: Any) -> dict[str, Any]:
    """Valid arguments of the functions that take a closed mesh: a triangle from both sides."""
    return {"vertices": np.eye(3), "triangles": [[0, 1, 2], [0, 2, 1]], **more}


def groups() -> hizvk.SplitMesh:
    """One group."""
    return hizvk.split_mesh(**closed(cell=4.0))


MASK: list[Bad] = [
    (np.ones((2, 1), dtype=bool), ValueError, "expected bool (1,), got (2, 1) bool"),
    (np.array([1]), TypeError, "expected bool (1,), got (1,) int64"),
    ("all", TypeError, "got str 'all'"),
]
TABLES |= {
    "split_mesh": Table(
        lambda _: (hizvk.split_mesh, closed(cell=1.0)),
        {
            "vertices": [
                (np.zeros((4, 2)), ValueError, "expected float (V, 3), got (4, 2) float64"),
                (np.zeros((4, 3), dtype=bool), TypeError, "got (4, 3) bool"),
                ("mesh", TypeError, "got str 'mesh'"),
            ],
            "triangles": TRIANGLES,
            "cell": [
                *NUMBER,
                (0.0, ValueError, "above 0, got float 0.0"),
                (INF, ValueError, "inf"),
            ],
            "progress": PROGRESS,
        },
    ),
    "SplitMesh.triangle_mask": Table(
        lambda _: (groups().triangle_mask, {"mask": [True]}),
        {"mask": [*MASK, (None, TypeError, "got None")]},
    ),
    "SplitMesh.mesh": Table(lambda _: (groups().mesh, {"mask": [True]}), {"mask": MASK}),
    "SplitMesh.meshes": Table(lambda _: (groups().meshes, {}), {}),
    "inner_boxes": Table(
        lambda _: (hizvk.inner_boxes, closed()),
        {
            **CLOSED,
            "resolution": [
                (0, ValueError, "expected an integer in 1..128, got int 0"),
                (129, ValueError, "got int 129"),
                (8.0, TypeError, "got float 8.0"),
            ],
            "max_boxes": [(0, ValueError, "got int 0"), (True, TypeError, "got bool True")],
            "min_share": [*NUMBER, (1.5, ValueError, "at most 1, got float 1.5")],
            "margin": [*NUMBER, (-0.5, ValueError, "at least 0, got float -0.5")],
            "progress": PROGRESS,
        },
    ),
    "inner_prisms": Table(
        lambda _: (hizvk.inner_prisms, closed(up=(0, 0, 1))),
        {
            **CLOSED,
            "up": [
                *VECTOR,
                ((0, 1, 1), ValueError, "expected a vector along one axis, such as (0, 0, 1)"),
                ((0, 0, 0), ValueError, "got tuple (0.0, 0.0, 0.0); turn the mesh for others"),
            ],
            "max_prisms": [(0, ValueError, "got int 0"), (1.0, TypeError, "got float 1.0")],
            "progress": PROGRESS,
        },
    ),
    "select_occluders": Table(
        lambda _: (hizvk.select_occluders, {"meshes": [TETRAHEDRON]}),
        {
            "meshes": [
                (
                    None,
                    TypeError,
                    "expected a Mesh, a mesh of trimesh, Open3D or PyVista, or a list",
                ),
                ([(np.zeros((3, 2)), [[0, 1, 2]])], ValueError, "got (3, 2) float64"),
                ([TETRAHEDRON, 3], TypeError, "got int 3"),
            ],
            "min_size": [*NUMBER, (2.0, ValueError, "at most 1, got float 2.0")],
            "min_fill": [*NUMBER, (-0.1, ValueError, "at most 1, got float -0.1")],
            "max_density": [*NUMBER, (0.0, ValueError, "above 0, got float 0.0")],
            "max_protrusion": [*NUMBER, (-1.0, ValueError, "at least 0, got float -1.0")],
            "max_triangles": [
                (-1, ValueError, "got int -1"),
                (100.0, TypeError, "got float 100.0"),
            ],
            "progress": PROGRESS,
        },
    ),
}


# --- sweeps ---


def swept() -> hizvk.Sweep:
    depth = np.ones((6, 8))
    return hizvk.sweep(spheres(), [camera()], depths=[depth], kind="z")


#: It is removed when the interpreter ends.
FOLDER = tempfile.TemporaryDirectory()
atexit.register(FOLDER.cleanup)
FACES: list[Bad] = [
    ("sides", ValueError, 'expected one of "none", "back", "front", got str'),
    (None, TypeError, "got None"),
]
ADAPTER: list[Bad] = [
    (1.5, TypeError, "expected an adapter's index, a part of its name, or None, got float 1.5"),
    (-1, ValueError, "in 0..2147483647, got int -1"),
    (" ", ValueError, "got str ' '"),
]
EXECUTOR: list[Bad] = [
    ("threads", TypeError, "expected None, a number of processes, a concurrent.futures.Executor"),
    (0, ValueError, "expected an integer in 1..4096, got int 0"),
    (True, TypeError, "got bool True"),
]
NO_LIGHT: list[Bad] = [
    ("sun", TypeError, "got str 'sun'"),
    (
        hizvk.DirectionalLight((0, -1, 0), receivers=((-1, -1, -1), (1, 1, 1))),
        ValueError,
        "expected None in a sweep",
    ),
]
SWEEP: BadValues = {
    "executor": EXECUTOR,
    "adapter": ADAPTER,
    "progress": PROGRESS,
    "options": OPTIONS_OBJECT,
    **OPTIONS,
    "shadow": NO_LIGHT,
}
BLOCK: list[Bad] = [(0, ValueError, "got int 0"), (1.0, TypeError, "got float 1.0")]
RESUME: list[Bad] = [
    ("sweep.npz", TypeError, "expected a Sweep or None, got str 'sweep.npz'"),
]
MESHES: list[Bad] = [
    (3, TypeError, "expected a Mesh, a mesh of trimesh, Open3D or PyVista, or a sequence"),
    ([3], TypeError, "got int 3"),
]
SIDE: list[Bad] = [(0, ValueError, "got int 0"), (64.0, TypeError, "got float 64.0")]

TABLES |= {
    "sweep": Table(
        lambda _: (
            hizvk.sweep,
            {
                "bounds": spheres(),
                "cameras": [camera()],
                "depths": [np.ones((6, 8))],
                "kind": "z",
            },
        ),
        {
            "bounds": BOUNDS,
            "cameras": [
                (None, TypeError, "expected a sequence of Camera, got None"),
                ([], ValueError, "got an empty one"),
                ([camera(), 3], TypeError, "expected a Camera, got int 3"),
            ],
            "occluders": [("walls", TypeError, "expected exactly one of them, got both")],
            "depths": [
                (3, TypeError, "expected 1 arrays, one for each camera, or a function"),
                ([], ValueError, "got 0"),
                ([np.ones((8, 6))], ValueError, "expected float (6, 8) (the camera's size)"),
            ],
            "kind": KIND,
            "scale": SCALE,
            "invalid": INVALID,
            "tolerance": TOLERANCE,
            "cull": FACES,
            "conservative": [*FLAG, (True, ValueError, "expected False beside depths")],
            "size": [*SIZE, ((6, 8), ValueError, "expected None beside depths")],
            "rasteriser": [
                ("gpu", ValueError, 'expected one of "auto", "device", "host", got str'),
                (None, TypeError, "got None"),
            ],
            "groups": [
                ([0, 0], ValueError, "expected integer (1,), a number from 0 on"),
                ([0.0], TypeError, "got (1,) float64"),
                ([1], ValueError, "expected numbers in 0..0, got 1"),
                ([-1], ValueError, "got -1"),
            ],
            "block": BLOCK,
            "resume": RESUME,
            **SWEEP,
        },
    ),
    "Sweep.mask": Table(
        lambda _: (swept().mask, {"view": 0}),
        {
            "view": [
                (1, IndexError, "expected an integer in 0..0, got 1"),
                ("0", TypeError, "got str '0'"),
            ]
        },
    ),
    "Sweep.visible_from": Table(
        lambda _: (swept().visible_from, {"index": 0}),
        {
            "index": [
                (-1, IndexError, "expected an integer in 0..0, got -1"),
                (0.0, TypeError, "got float 0.0"),
            ]
        },
    ),
    "Sweep.union": Table(lambda _: (swept().union, {}), {}),
    "Sweep.csr": Table(lambda _: (swept().csr, {}), {"scipy": FLAG}),
    "Sweep.save": Table(
        lambda _: (swept().save, {"path": Path(FOLDER.name) / "sweep.npz"}),
        {"path": [(3, TypeError, "expected a path, got int 3"), (None, TypeError, "got None")]},
    ),
    "Sweep.load": Table(
        lambda _: (hizvk.Sweep.load, {"path": saved_sweep()}),
        {
            "path": [
                (3, TypeError, "expected a path, got int 3"),
                (__file__, ValueError, "expected a file of Sweep.save, got"),
            ]
        },
    ),
    "cube": Table(
        lambda _: (hizvk.cube, {"eye": (0, 0, 0), "size": 8, "near": 0.1}),
        {
            "eye": VECTOR,
            "size": SIDE,
            "near": NEAR,
            "far": FAR,
            "seam_px": [
                *NUMBER,
                (-0.5, ValueError, "at least 0 and at most 2, got float -0.5"),
                (3.0, ValueError, "got float 3.0"),
            ],
            "reversed_z": FLAG,
        },
    ),
    "visible_sets": Table(
        lambda _: (
            hizvk.visible_sets,
            {
                "bounds": spheres(),
                "cells": hizvk.Boxes(np.zeros((1, 3)), np.ones((1, 3))),
                "occluders": TETRAHEDRON,
                "samples": 1,
                "size": 8,
                "near": 0.1,
            },
        ),
        {
            "bounds": BOUNDS,
            "cells": [
                (spheres(), TypeError, "expected Boxes, got Spheres Spheres(1 of float64)"),
                (
                    hizvk.Boxes(np.zeros((0, 3)), np.zeros((0, 3))),
                    ValueError,
                    "expected at least one cell, got none",
                ),
                (
                    hizvk.Boxes(np.ones((1, 3)), np.zeros((1, 3))),
                    ValueError,
                    "expected finite corners with min <= max, got cell 0",
                ),
            ],
            "occluders": [*MESHES, (None, TypeError, "got None")],
            "samples": [(0, ValueError, "in 1..64, got int 0"), (2.0, TypeError, "float 2.0")],
            "size": SIDE,
            "near": NEAR,
            "far": FAR,
            "cull": FACES,
            "conservative": FLAG,
            "block": BLOCK,
            "resume": RESUME,
            **SWEEP,
        },
    ),
    "viewshed": Table(
        lambda _: (
            hizvk.viewshed,
            {"heights": np.zeros((3, 4)), "cell_size": 1.0, "eye": (1, 1), "size": 8},
        ),
        {
            "heights": [
                (np.zeros(4), ValueError, "expected float (rows, columns), got (4,) float64"),
                (np.zeros((1, 4)), ValueError, "expected at least 2 x 2 heights, got (1, 4)"),
                (np.zeros((3, 4), dtype=bool), TypeError, "got (3, 4) bool"),
                (np.full((3, 4), INF), ValueError, "expected finite heights, or NaN for no data"),
            ],
            "cell_size": [
                *NUMBER,
                (0.0, ValueError, "above 0, got float 0.0"),
                ((1.0, 0.0), ValueError, "above 0, got float 0.0"),
                ((1.0, 2.0, 3.0), ValueError, "expected (2,) finite numbers"),
            ],
            "eye": [
                ((5, 1), ValueError, "expected a row in 0..2 and a column in 0..3, got 5, 1"),
                ((1, 2, 3), ValueError, "expected (2,) finite numbers, got (3,)"),
                (None, TypeError, "got None"),
            ],
            "eye_height": [*NUMBER, (0.0, ValueError, "above 0, got float 0.0")],
            "target_height": [*NUMBER, (-1.0, ValueError, "at least 0, got float -1.0")],
            "size": SIDE,
            "conservative": FLAG,
            **SWEEP,
        },
    ),
}


def saved_sweep() -> str:
    path = Path(FOLDER.name) / "sweep.npz"
    swept().save(path)
    return str(path)


MADE_BY_THE_PACKAGE |= {"Sweep"}
# --- the algorithms of the texts ---


def hierarchy() -> hizvk.HierarchicalVisibility:
    return hizvk.HierarchicalVisibility(TETRAHEDRON)


TABLES |= {
    "HierarchicalVisibility": Table(
        lambda _: (hizvk.HierarchicalVisibility, {"meshes": [TETRAHEDRON]}),
        {
            "meshes": [
                (None, TypeError, "a mesh of trimesh, Open3D or PyVista, or a list"),
                ([(np.zeros((3, 2)), [[0, 1, 2]])], ValueError, "got (3, 2) float64"),
                ([TETRAHEDRON, 3], TypeError, "got int 3"),
            ],
            "threshold": [
                (0, ValueError, "expected an integer in 1..2147483647, got int 0"),
                (1.0, TypeError, "got float 1.0"),
            ],
            "deepest": [
                (-1, ValueError, "expected an integer in 0..30, got int -1"),
                (31, ValueError, "got int 31"),
                (True, TypeError, "got bool True"),
            ],
            "cull": [("both", ValueError, 'expected one of "none", "back", "front"')],
        },
    ),
    "HierarchicalVisibility.render": Table(
        lambda _: (hierarchy().render, {"camera": camera()}),
        {
            "camera": [(None, TypeError, "expected a Camera, got None")],
            "previous": [
                ("all", TypeError, "expected integer (K,), got str 'all'"),
                ([0.5], TypeError, "got (1,) float64"),
                ([[0]], ValueError, "expected integer (K,), got (1, 1) int64"),
                (np.zeros((1, 1), int), ValueError, "got (1, 1) int64"),
                ([1], ValueError, "expected numbers of the 1 nodes, got 1"),
                ([-1], ValueError, "got -1"),
            ],
            "count": FLAG,
        },
    ),
    "HierarchicalVisibility.render_flat": Table(
        lambda _: (hierarchy().render_flat, {"camera": camera()}),
        {"camera": [(2, TypeError, "expected a Camera, got int 2")]},
    ),
}


# --- published tests ---


def published(device: hizvk.Device) -> dict[str, Any]:
    """The valid arguments of a `PublishedTest`."""
    pyramid = device.pyramid(np.ones((6, 8)), camera(), kind="z")
    return {
        "device": device,
        "text": "arm",
        "bounds": spheres(),
        "camera": camera(),
        "pyramid": pyramid,
    }


TABLES |= {
    "PublishedTest": Table(
        lambda device: (hizvk.PublishedTest, published(device)),
        {
            "device": [(None, TypeError, "expected a Device, got None")],
            "text": [
                ("greene", ValueError, 'expected one of "rakos", "arm", "darnell", "one_lookup"'),
                (2010, TypeError, "got int 2010"),
            ],
            "bounds": [
                (
                    hizvk.Boxes([[0, 0, -2.0]], [[1, 1, -1.0]]),
                    TypeError,
                    "expected Spheres for 'arm', got Boxes",
                ),
                (hizvk.Spheres(np.zeros((0, 3)), 1.0), ValueError, "at least one, got none"),
            ],
            "camera": [
                (None, TypeError, "expected a Camera, got None"),
                (camera().resized((8, 8)), ValueError, "of the pyramid's size (6, 8), got"),
                (
                    hizvk.Camera.orthographic(
                        (0, 0, 0), (0, 0, -1), height=2, size=(6, 8), near=0, far=9
                    ),
                    ValueError,
                    "expected a perspective camera, got",
                ),
            ],
            "pyramid": [(np.ones((6, 8)), TypeError, "expected a Pyramid, got (6, 8) float64")],
        },
    ),
    "PublishedTest.run": Table(
        lambda device: (hizvk.PublishedTest(**published(device)).run, {}), {}
    ),
}
