"""Bad arguments: sweeps, cubes and viewsheds."""

import atexit
import tempfile
from pathlib import Path

import numpy as np

import hizvk

from .shared import (
    BOUNDS,
    FAR,
    FLAG,
    INF,
    INVALID,
    KIND,
    NEAR,
    NUMBER,
    OPTIONS,
    OPTIONS_OBJECT,
    PROGRESS,
    SCALE,
    SIZE,
    TETRAHEDRON,
    TOLERANCE,
    VECTOR,
    Bad,
    BadValues,
    Table,
    camera,
    spheres,
)


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

TABLES: dict[str, Table] = {
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
