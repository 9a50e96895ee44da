"""`check_proxy` and `check_bounds` from Python.

Their geometry is tested in crates/hiz_ref/tests/containment.rs.
"""

from __future__ import annotations

import numpy as np

import hizvk
from hizvk.scenes import box_mesh, room


def test_box_in_box_and_poking_out_by_a_nanometre() -> None:
    mesh = box_mesh([[0, 0, 0]], [[1, 1, 1]])
    good = hizvk.check_proxy(box_mesh([[0.25, 0.25, 0.0]], [[0.75, 0.75, 1.0]]), mesh)
    assert good.inside
    assert good.protrusion == 0.0
    assert good.triangles.shape == (0,)
    assert good.witnesses.shape == (0, 3)
    bad = hizvk.check_proxy(
        hizvk.Mesh(*box_mesh([[0.25, 0.25, 0.0]], [[0.75, 0.75, 1.0 + 1e-9]])), mesh
    )
    assert not bad.inside
    assert len(bad.triangles) == 10  # all but the bottom
    assert bad.vertices.tolist() == [4, 5, 6, 7]
    assert 0.5e-9 < bad.protrusion < 1.1e-9
    assert bad.witnesses.shape == (10, 3)
    assert (bad.witnesses[:, 2] >= 1.0).all()


def test_float32_meshes_are_taken_exactly() -> None:
    vertices, triangles = box_mesh([[0, 0, 0]], [[0.1, 0.1, 0.1]])
    # 0.1 in float32 is larger than in float64.
    assert not hizvk.check_proxy(
        (vertices.astype(np.float32), triangles), (vertices, triangles)
    ).inside
    assert hizvk.check_proxy((vertices, triangles), (vertices.astype(np.float32), triangles)).inside


def test_a_scenes_own_boxes_contain_it() -> None:
    scene = room()
    meshes = [
        (scene.instance_vertices[8 * k : 8 * k + 8], scene.instance_triangles[:12])
        for k in range(len(scene.box_min))
    ]
    check = hizvk.check_bounds(hizvk.Boxes(scene.box_min, scene.box_max), meshes)
    assert check.all_contained
    assert check.offenders.shape == (0,)
    high = scene.box_max.copy()
    high[7, 2] = np.nextafter(high[7, 2], 0.0)
    high[9, 0] -= 0.015625
    shrunk = hizvk.check_bounds(hizvk.Boxes(scene.box_min, high), meshes)
    assert shrunk.offenders.tolist() == [9, 7]
    assert np.flatnonzero(~shrunk.contained).tolist() == [7, 9]
    assert shrunk.protrusion[9] == 0.015625
    assert 0.0 < shrunk.protrusion[7] < 1e-15


def test_a_mesh_with_transforms_stands_for_as_many_instances() -> None:
    vertices, triangles = box_mesh([[-1, -1, -1]], [[1, 1, 1]])
    places = np.stack([np.eye(4)] * 3)
    places[:, 0, 3] = [0.0, 10.0, 20.0]
    mesh = hizvk.Mesh(vertices, triangles, places)
    centers = np.array([[0.0, 0, 0], [10.0, 0, 0], [20.5, 0, 0]])
    turned = np.broadcast_to([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]], (3, 3, 3))
    check = hizvk.check_bounds(hizvk.OrientedBoxes(centers, np.ones((3, 3)), turned), mesh)
    assert check.contained.tolist() == [True, True, False]
    assert check.protrusion.tolist() == [0.0, 0.0, 0.5]
    spheres = hizvk.Spheres(centers, np.array([1.75, 1.0, -1.0]))
    loose = hizvk.check_bounds(spheres, mesh)
    assert loose.contained.tolist() == [True, False, False]
    assert abs(loose.protrusion[1] - (3**0.5 - 1.0)) < 1e-12
    assert loose.protrusion[2] == np.inf
