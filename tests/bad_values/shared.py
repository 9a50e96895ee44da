"""What the tables of bad arguments share: values, and valid arguments beside them."""

from collections.abc import Callable
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
