"""`inner_boxes` and `inner_prisms`: proven inside, and hiding most of what their meshes hide."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

import hizvk
from hizvk.occluders import growth, voxels
from hizvk.scenes import Scene, box_mesh, gabled_houses, truth, village
from hizvk.scenes.boulders import boulders

if TYPE_CHECKING:
    from collections.abc import Callable

Soup = tuple[np.ndarray, np.ndarray]
SIZE = (360, 640)


def ring(rows: int, columns: int, place: Callable[..., tuple[np.ndarray, ...]]) -> Soup:
    """A closed surface over two angles, both of which go once around."""
    u, v = np.meshgrid(
        np.arange(rows) * 2.0 * np.pi / rows, np.arange(columns) * 2.0 * np.pi / columns,
        indexing="ij",
    )  # fmt: skip
    n = np.arange(rows * columns).reshape(rows, columns)
    a, b = n, np.roll(n, -1, 0)
    c, d = np.roll(b, -1, 1), np.roll(n, -1, 1)
    triangles = np.concatenate(
        [np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))]
    )
    return np.stack(place(u, v), axis=-1).reshape(-1, 3), triangles


def torus() -> Soup:
    """Outer radius 2.7, inner radius 1.3, about z."""
    return ring(
        48, 24, lambda u, v: (
            (2.0 + 0.7 * np.cos(v)) * np.cos(u), (2.0 + 0.7 * np.cos(v)) * np.sin(u),
            0.7 * np.sin(v),
        ),
    )  # fmt: skip


def in_torus(points: np.ndarray) -> np.ndarray:
    """Whether points lie in the smooth torus, which contains the faceted one."""
    return np.hypot(np.hypot(points[:, 0], points[:, 1]) - 2.0, points[:, 2]) <= 0.7


def hollow_cube() -> Soup:
    """A cube of side 4 with a cavity of side 2 in its middle."""
    outer, inner = box_mesh([[0, 0, 0]], [[4, 4, 4]]), box_mesh([[1, 1, 1]], [[3, 3, 3]])
    return np.concatenate([outer[0], inner[0]]), np.concatenate([outer[1], inner[1][:, ::-1] + 8])


def proven(boxes: hizvk.Boxes, mesh: Soup) -> bool:
    return hizvk.check_proxy(box_mesh(boxes.min, boxes.max), mesh).inside


# -- boxes -----------------------------------------------------------------------------------------


def test_axis_aligned_buildings_are_met_exactly() -> None:
    """Their faces are planes of the grid, so no step of the resolution shows."""
    low = np.array([[0.1, 0.2, 0.0], [0.1, 0.2, 2.3], [20.7, 0.0, 0.0]])
    high = np.array([[9.7, 5.9, 2.3], [3.3, 2.1, 17.9], [29.0, 8.1, 12.2]])
    found = hizvk.inner_boxes(*box_mesh(low, high), resolution=8)
    assert found.volume_share == pytest.approx(1.0)
    assert found.rejected == 0
    # The tower reaches down to the ground through the low part.
    low[1, 2] = 0.0
    assert sorted(found.boxes.min.tolist()) == sorted(low.tolist())
    assert sorted(found.boxes.max.tolist()) == sorted(high.tolist())
    assert len(found.mesh.triangles) == 36


def test_the_grid_holds_all_of_a_mesh_with_a_face_near_its_end() -> None:
    """The tip of a pyramid is no face, and a face lies close below it."""
    pyramid = np.array([[0.0, 0, 1], [4, 0, 1], [4, 4, 1], [0, 4, 1], [2, 2, 8.01]])
    faces = [[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    slab, sides = box_mesh([[10, 10, 0]], [[14, 14, 8]])
    mesh = np.concatenate([pyramid, slab]), np.concatenate([faces, sides + len(pyramid)])
    grid = voxels.planes_of(mesh[0][mesh[1]], 16)
    assert (grid.planes[2][0], grid.planes[2][-1]) == (0.0, 8.01)
    assert proven(hizvk.inner_boxes(*mesh, resolution=16).boxes, mesh)


@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e200])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_a_torus_has_boxes_around_its_hole(scale: float, offset: float) -> None:
    vertices, triangles = torus()
    mesh = scale * (vertices + offset), triangles
    found = hizvk.inner_boxes(*mesh, resolution=48, max_boxes=24)
    assert len(found) > 8
    assert found.volume_share > 0.5
    assert found.rejected == 0
    assert proven(found.boxes, mesh)
    # An independent look: all corners, and points along the edges, lie in the smooth torus.
    corners = box_mesh(found.boxes.min, found.boxes.max)[0].reshape(-1, 8, 3) / scale - offset
    for a in range(8):
        for b in range(8):
            for part in np.linspace(0.0, 1.0, 5):
                assert in_torus(corners[:, a] + part * (corners[:, b] - corners[:, a])).all()


def test_a_cavity_is_outside() -> None:
    mesh = hollow_cube()
    found = hizvk.inner_boxes(*mesh, max_boxes=64, min_share=0.001)
    assert found.volume_share == pytest.approx(1.0)
    assert proven(found.boxes, mesh)
    cavity = (found.boxes.min < 3.0) & (found.boxes.max > 1.0)
    assert not cavity.all(axis=1).any()


def test_voxels_are_inside_where_hand_and_formula_say() -> None:
    """The grid of a hollow cube by hand, and of a ball by its radius."""
    vertices, triangles = hollow_cube()
    grid = voxels.planes_of(vertices[triangles], 4)
    assert [plane.tolist() for plane in grid.planes] == [[0.0, 1.0, 2.0, 3.0, 4.0]] * 3
    solid = np.ones((4, 4, 4), dtype=bool)
    solid[1:3, 1:3, 1:3] = False
    assert np.array_equal(voxels.inside(vertices[triangles], grid), solid)
    # Turned inside out it winds the other way, and is as solid.
    assert np.array_equal(voxels.inside(vertices[triangles[:, ::-1]], grid), solid)
    vertices, triangles = torus()
    grid = voxels.planes_of(vertices[triangles], 40)
    inside = voxels.inside(vertices[triangles], grid)
    i, j, k = np.nonzero(inside)
    for ends in np.ndindex(2, 2, 2):
        corner = np.stack(
            [
                grid.planes[axis][at + end]
                for axis, (at, end) in enumerate(zip((i, j, k), ends, strict=True))
            ],
            1,
        )
        assert in_torus(corner).all()
    # What is surely inside of the facets was not missed: tubes of 0.7 cos(pi / 24) and less.
    middle = np.stack(
        np.meshgrid(*(0.5 * (p[1:] + p[:-1]) for p in grid.planes), indexing="ij"), axis=-1
    )
    tube = np.hypot(np.hypot(middle[..., 0], middle[..., 1]) - 2.0, middle[..., 2])
    diagonal = np.linalg.norm([np.diff(p).max() for p in grid.planes])
    assert inside[tube < 0.7 * np.cos(np.pi / 24) - 0.01 - diagonal].all()


def test_growth_finds_the_largest_box_of_each_part() -> None:
    """Two blocks and a plate apart; the best box is the one of the largest surface."""
    inside = np.zeros((20, 20, 20), dtype=bool)
    blocks = [((0, 0, 0), (5, 5, 5)), ((8, 8, 8), (11, 11, 20)), ((13, 0, 0), (14, 20, 7))]
    for low, high in blocks:
        inside[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = True
    grid = voxels.Grid((np.arange(21.0),) * 3)
    found = growth.grow(inside, grid, 8, 0.0)
    # Surfaces: the plate 2 (20 + 140 + 7) = 334, the bar 162, the cube 150.
    assert [tuple(map(tuple, box)) for box in found.tolist()] == [blocks[2], blocks[1], blocks[0]]
    assert growth.filled(inside, grid, found) == 1.0
    assert growth.filled(inside, grid, found[:1]) == pytest.approx(140 / (140 + 108 + 125))
    # A share that only the plate has leaves the others out; one that none has leaves all out.
    assert len(growth.grow(inside, grid, 8, 0.3)) == 2
    assert len(growth.grow(inside, grid, 8, 0.5)) == 0
    assert len(growth.grow(inside, grid, 1, 0.0)) == 1


def test_grown_boxes_are_full_and_cannot_grow() -> None:
    """Voxel by voxel, in a random grid from which a few are missing."""
    inside = np.random.default_rng(6).random((9, 8, 7)) > 0.04
    candidates = growth._candidates(inside, np.argwhere(inside))
    assert len(candidates) > 20
    for (x0, y0, z0), (x1, y1, z1) in candidates.tolist():
        assert inside[x0:x1, y0:y1, z0:z1].all()
        beside = (
            inside[max(x0 - 1, 0) : x0, y0:y1, z0:z1],
            inside[x1 : x1 + 1, y0:y1, z0:z1],
            inside[x0:x1, max(y0 - 1, 0) : y0, z0:z1],
            inside[x0:x1, y1 : y1 + 1, z0:z1],
            inside[x0:x1, y0:y1, max(z0 - 1, 0) : z0],
            inside[x0:x1, y0:y1, z1 : z1 + 1],
        )
        assert not any(side.size and side.all() for side in beside)


def test_a_margin_leaves_room_on_every_side() -> None:
    found = hizvk.inner_boxes(*box_mesh([[0, 0, 0]], [[4, 4, 4]]), margin=0.25)
    assert found.boxes.min.tolist() == [[0.25] * 3]
    assert found.boxes.max.tolist() == [[3.75] * 3]
    assert len(hizvk.inner_boxes(*box_mesh([[0, 0, 0]], [[4, 4, 4]]), margin=2.0)) == 0


def test_boxes_of_a_float32_mesh_are_float32_numbers() -> None:
    vertices, triangles = torus()
    found = hizvk.inner_boxes(vertices.astype(np.float32), triangles)
    for corner in (found.boxes.min, found.boxes.max):
        assert np.array_equal(corner, corner.astype(np.float32))
    assert proven(found.boxes, (vertices.astype(np.float32), triangles))


def test_what_cannot_be_proven_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """The planted fault: the hole's voxels count as inside."""
    mesh = torus()
    monkeypatch.setattr(voxels, "inside", lambda _, grid: np.ones(grid.shape, dtype=bool))
    found = hizvk.inner_boxes(*mesh)
    assert len(found) == 0
    assert found.rejected >= 1
    assert found.volume_share == 0.0


@pytest.mark.parametrize(
    ("vertices", "triangles"),
    [
        (np.empty((0, 3)), np.empty((0, 3), int)),
        (np.eye(3), [[0, 1, 2], [0, 2, 1]]),  # without volume
        (np.zeros((3, 3)), [[0, 1, 2]]),  # without area, so without an edge that is open
    ],
)
def test_meshes_without_volume_have_nothing_inside(vertices: np.ndarray, triangles: Soup) -> None:
    assert len(hizvk.inner_boxes(vertices, triangles)) == 0
    assert len(hizvk.inner_prisms(vertices, triangles, up=(0, 0, 1))) == 0


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("height", [5e-324, 1e-310, 1e-300])
def test_a_sheet_thinner_than_float64_tells_warns_of_nothing(height: float) -> None:
    found = hizvk.inner_boxes(*box_mesh([[0, 0, 0]], [[4, 4, height]]))
    assert len(found) <= 1


def test_open_meshes_are_refused_with_the_way_out() -> None:
    vertices, triangles = box_mesh([[0, 0, 0]], [[1, 1, 1]])
    for make in (hizvk.inner_boxes, lambda *m: hizvk.inner_prisms(*m, up=(0, 0, 1))):
        with pytest.raises(ValueError, match=r"triangles: expected a closed mesh .* split_mesh it"):
            make(vertices, triangles[1:])


# -- prisms ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_prism_ends_at_the_eaves(axis: int, sign: float) -> None:
    """Eaves at 5 and 3, ridges above; any axis may be up, in either direction."""
    vertices, triangles = gabled_houses(
        [[0.0, 0.0], [30.0, 0.0]], [[8.0, 6.0, 5.0, 8.0], [12.0, 9.0, 3.0, 7.0]], [30.0, 77.0]
    )
    turned = np.roll(vertices, axis - 2, axis=1)
    turned[:, axis] *= sign
    faces = triangles if sign > 0.0 else triangles[:, ::-1]
    up = sign * np.eye(3)[axis]
    found = hizvk.inner_prisms(turned, faces, up=up)
    assert found.top.tolist() == [sign * 3.0, sign * 5.0]  # 12 x 9 x 3 is larger than 8 x 6 x 5
    assert found.floor.tolist() == [0.0, 0.0]
    assert found.offsets.tolist() == [0, 12, 24]
    assert found.rejected == 0
    assert hizvk.check_proxy(found.mesh, (turned, faces)).inside
    # Wound inside out, the mesh is as solid.
    assert hizvk.inner_prisms(turned, faces[:, ::-1], up=up).top.tolist() == found.top.tolist()
    # One rounding higher would stick out.
    higher = found.mesh.vertices.copy()
    high = higher[:, axis] == sign * 5.0
    higher[high, axis] = np.nextafter(sign * 5.0, sign * 9.0)
    assert not hizvk.check_proxy((higher, found.mesh.triangles), (turned, faces)).inside
    assert len(hizvk.inner_prisms(turned, faces, up=up, max_prisms=1)) == 1


def test_a_prism_is_closed() -> None:
    """So back faces may be left out."""
    found = hizvk.inner_prisms(*gabled_houses([[0, 0]], [[8.0, 6, 5, 8]], [30.0]), up=(0, 0, 1))
    assert hizvk.check_proxy(found.mesh, found.mesh).inside
    corners = found.mesh.vertices[found.mesh.triangles]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(8.0 * 6.0 * 5.0, rel=0.01)  # on a grid of 1/64


def test_tents_and_steps() -> None:
    """A tent has no wall, so no prism; a step ends the prism of the floor below it."""
    tent = np.array([[0.0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [2, 2, 3]])
    faces = [[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    found = hizvk.inner_prisms(tent, faces, up=(0, 0, 1))
    assert (len(found), found.rejected) == (0, 1)
    low, high = [[0, 0, 0], [0, 0, 3]], [[9, 9, 3], [3, 3, 20]]
    found = hizvk.inner_prisms(*box_mesh(low, high), up=(0, 0, 1))
    # The tower is a closed box of its own, so its floor bears a prism too.
    assert sorted(zip(found.floor.tolist(), found.top.tolist(), strict=True)) == [
        (0.0, 3.0),
        (3.0, 20.0),
    ]


# -- what they hide --------------------------------------------------------------------------------


def hidden(
    device: hizvk.Device, scene: Scene, occluders: hizvk.Mesh, *, rays: bool = False
) -> tuple[int, int]:
    """Instances that are hidden over all views, and how many of them rays see."""
    uploaded = device.occluders([occluders])
    instances = device.instances(hizvk.Boxes(scene.box_min, scene.box_max))
    caster = truth.make_caster(scene) if rays else None
    count = false_culls = 0
    for view in scene.views:
        depth = device.render_depth(uploaded, view.camera(SIZE))
        seen = device.cull(instances, depth.camera, device.pyramid(depth), descent=4096)
        count += int((seen.verdicts == hizvk.Verdict.OCCLUDED).sum())
        if caster is not None:
            linear = truth.linear_depth(depth.numpy(), view.near)
            sight = caster.look(view, SIZE, linear)
            wrong = np.flatnonzero((sight.pixels(len(scene)) > 0) & ~seen.mask)
            false_culls += int(caster.firm(view, sight, linear, wrong).sum())
    return count, false_culls


def told(name: str, scene: Scene, inner: hizvk.Mesh, base: int, count: int) -> float:
    """Prints and returns the share of the hiding that is kept."""
    print(
        f"{scene.name}: {name} keep {100.0 * count / base:.1f} % of the {base} hidden by "
        f"{len(inner.triangles)} triangles in place of {len(scene.triangles)}"
    )
    return count / base


def test_prisms_of_turned_houses_keep_their_share_of_the_hiding(device: hizvk.Device) -> None:
    scene = village(36, 4000, 6)
    prisms = hizvk.inner_prisms(scene.vertices, scene.triangles, up=(0, 0, 1))
    assert len(prisms) == 36
    base, _ = hidden(device, scene, hizvk.Mesh(scene.vertices, scene.triangles))
    count, false_culls = hidden(device, scene, prisms.mesh, rays=True)
    assert false_culls == 0
    assert base > 1000
    assert 0.75 < told("prisms", scene, prisms.mesh, base, count) <= 1.0


def test_boxes_of_boulders_keep_their_share_of_the_hiding(device: hizvk.Device) -> None:
    made = boulders(25, 4000, 6)
    scene = made.scene
    boxes = [hizvk.inner_boxes(*made.mesh(k), max_boxes=12) for k in range(made.count)]
    for k in range(0, made.count, 6):
        assert proven(boxes[k].boxes, made.mesh(k))
    inner = hizvk.Mesh(
        *box_mesh(
            np.concatenate([one.boxes.min for one in boxes]),
            np.concatenate([one.boxes.max for one in boxes]),
        )
    )
    assert len(inner.triangles) < 0.05 * len(scene.triangles)
    base, _ = hidden(device, scene, hizvk.Mesh(scene.vertices, scene.triangles))
    count, false_culls = hidden(device, scene, inner, rays=True)
    assert false_culls == 0
    assert base > 1000
    assert 0.7 < told("boxes", scene, inner, base, count) <= 1.0
    # Boxes that stick out by 2 m on every side hide what can be seen: the check can fail.
    wide = box_mesh(
        np.concatenate([one.boxes.min for one in boxes]) - 2.0,
        np.concatenate([one.boxes.max for one in boxes]) + 2.0,
    )
    assert hidden(device, scene, hizvk.Mesh(*wide), rays=True)[1] > 0
