"""Bad arguments: the texts' own algorithms."""

from typing import Any

import numpy as np

import hizvk

from .shared import FLAG, TETRAHEDRON, Table, camera, spheres


def hierarchy() -> hizvk.HierarchicalVisibility:
    return hizvk.HierarchicalVisibility(TETRAHEDRON)


TABLES: dict[str, Table] = {
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
