"""Bad arguments: options, results and functions of the package."""

import os

import numpy as np

import hizvk
import hizvk.measuring.configuration
import hizvk.measuring.spread
import hizvk.recommendation

from .shared import (
    BOUNDS,
    CAMERA,
    CAPACITY,
    COVERAGE,
    DRAW,
    DRAWN,
    EYE4,
    FLAG,
    FLAG_OR_NONE,
    IMAGE,
    INVALID,
    KIND,
    NAN,
    OF_MESHES,
    OPTIONS,
    OPTIONS_OBJECT,
    PIXEL_BUDGET,
    PROGRESS,
    SCALE,
    SINGLE_MESH,
    SIZE,
    TETRAHEDRON,
    TEXT,
    TOLERANCE,
    WANTED_KIND,
    Table,
    camera,
    cull_arguments,
    rendered,
    spheres,
)


def several(device: hizvk.Device) -> hizvk.ViewsResult:
    arguments = cull_arguments(device)
    views = {name: [arguments.pop(name)] for name in ("camera", "pyramid")}
    return device.cull(**views, **arguments)


def recommendation() -> hizvk.Recommendation:
    ms = hizvk.measuring.spread.spread(np.ones((1, 1)))
    configuration = hizvk.measuring.configuration.Configuration()
    best = hizvk.recommendation.Candidate(configuration, ms, ms, 1, True)
    return hizvk.Recommendation(best, True, (best,), 1, "no adapter")


TABLES: dict[str, Table] = {
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
    "Recommendation.table": Table(
        lambda _: (recommendation().table, {}),
        {"most": [(0, ValueError, "got int 0"), ("all", TypeError, "got str 'all'")]},
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
    "ViewsResult.plot": Table(
        lambda device: (several(device).plot, {}),
        {name: DRAWN[name] for name in ("bounds", "most", "unit")},
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
                    "codes of hizvk.reference.unoccluded (3, 4, 5, 6), got 1",
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
            "tolerance": TOLERANCE,
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
