"""Bad arguments: making occluders of meshes."""

from typing import Any

import numpy as np

import hizvk

from .shared import (
    INF,
    NAN,
    NUMBER,
    PROGRESS,
    TETRAHEDRON,
    TRIANGLES,
    VECTOR,
    Bad,
    BadValues,
    Table,
)

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
TABLES: dict[str, Table] = {
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
