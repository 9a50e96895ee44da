"""Bad arguments: bounds, cameras, meshes, and what else a call takes."""

import numpy as np

import hizvk

from .shared import (
    CAMERA,
    CLIP,
    DISTORTION,
    EYE4,
    FAR,
    FLAG,
    FOV,
    GL,
    HALF_SIZES,
    INF,
    INTRINSICS,
    INVALID,
    KIND,
    LOD_PIXELS,
    LOOK,
    MATRIX,
    NAN,
    NEAR,
    NUMBER,
    OPTIONS,
    OPTIONS_OBJECT,
    ORTHO_NEAR,
    PIXEL_CENTER,
    POINTS,
    POSE,
    PROGRESS,
    RADIUS,
    SAMPLING,
    SCALE,
    SIZE,
    TETRAHEDRON,
    TOLERANCE,
    TRANSFORMS,
    TRANSPOSED_POSE,
    TRIANGLES,
    VECTOR,
    VECTOR_OR_NONE,
    VERTICES,
    VIEW,
    K,
    Table,
    array_of,
    camera,
    lod_list,
)

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
}
