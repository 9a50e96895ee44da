"""`split_mesh`: groups are what was given, fit their cells, and hide nothing that rays see."""

from __future__ import annotations

import importlib.util
import time
from typing import Any

import numpy as np
import pytest

import hizvk
from hizvk.scenes import Scene, truth
from hizvk.scenes.city import city


def scattered(count: int, seed: int = 1) -> np.ndarray:
    """``(count, 3, 3)``: triangles of all sizes from a millimetre to a kilometre."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-3.0, 3.0, (count, 1, 1))
    return rng.uniform(-500.0, 500.0, (count, 1, 3)) + size * rng.uniform(-0.5, 0.5, (count, 3, 3))


def longest_side(soup: np.ndarray) -> np.ndarray:
    return (soup.max(axis=1) - soup.min(axis=1)).max(axis=1)


# -- what a group is -------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_every_triangle_is_in_one_group_unchanged(dtype: type) -> None:
    soup = scattered(3000).astype(dtype)
    split = hizvk.split_mesh(soup, cell=8.0)
    assert sorted(split.order.tolist()) == list(range(len(soup)))
    assert split.offsets[0] == 0
    assert split.offsets[-1] == len(soup)
    assert (np.diff(split.offsets) > 0).all()
    assert np.array_equal(split.vertices[split.triangles], soup[split.order])
    assert split.boxes.min.dtype == dtype


def test_bounds_are_exact() -> None:
    """`check_bounds` decides in exact arithmetic; one rounding less on any side is found."""
    split = hizvk.split_mesh(scattered(500), cell=100.0)
    meshes = split.meshes()
    assert len(meshes) == len(split)
    assert hizvk.check_bounds(split.boxes, meshes).all_contained
    for axis in range(3):
        for corner, towards in (("min", np.inf), ("max", -np.inf)):
            tight = {"min": split.boxes.min.copy(), "max": split.boxes.max.copy()}
            tight[corner][:, axis] = np.nextafter(tight[corner][:, axis], towards)
            assert not hizvk.check_bounds(hizvk.Boxes(**tight), meshes).contained.any()


@pytest.mark.parametrize("cell", [0.02, 1.0, 7.3, 300.0, 1e5])
def test_groups_fit_their_cells(cell: float) -> None:
    soup = scattered(5000)
    split = hizvk.split_mesh(soup, cell=cell)
    box = (split.boxes.max - split.boxes.min).max(axis=1)
    side, group = longest_side(soup), split.group_of
    largest, least = np.zeros(len(split)), np.full(len(split), np.inf)
    np.maximum.at(largest, group, side)
    np.minimum.at(least, group, side)
    small = largest <= cell
    assert (box[small] <= cell).all()
    assert (box[~small] <= 3.0 * least[~small]).all()
    # No group mixes triangles that fit a cell with larger ones.
    assert (least[~small] > cell).all()


def test_triangles_as_large_as_a_cell_are_groups_of_their_own() -> None:
    """In a row along each axis, where any lattice would join some of them."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 1]])
    for axis in np.eye(3):
        for side in (1.0, 0.984375):
            row = side * corners + np.arange(200)[:, None, None] / 128.0 * axis  # exact
            split = hizvk.split_mesh(row, cell=1.0)
            assert (split.boxes.max - split.boxes.min <= 1.0).all()
            assert len(split) > 100


def test_large_neighbours_come_together() -> None:
    corners = np.array([[0.0, 0, 0], [5, 0, 0], [0, 5, 5]])
    split = hizvk.split_mesh(corners + 0.001 * np.arange(200)[:, None, None], cell=1.0)
    assert len(split) == 1


def test_neighbours_come_together() -> None:
    """100 small triangles in each of 4 places, 50 apart, in random order."""
    rng = np.random.default_rng(3)
    place = np.repeat(np.arange(4), 100)
    # Within the half cell that begins at the least coordinate of all.
    soup = rng.uniform(0.0, 1.0, (400, 3, 3)) + 50.0 * place[:, None, None] * [1.0, 0.0, 0.0]
    mixed = rng.permutation(400)
    split = hizvk.split_mesh(soup[mixed], cell=4.0)
    assert len(split) == 4
    for group in range(4):
        members = split.order[split.offsets[group] : split.offsets[group + 1]]
        assert len(set(place[mixed[members]].tolist())) == 1
        assert (np.diff(members) > 0).all()


def test_one_enormous_triangle_stays_apart() -> None:
    soup = np.concatenate(
        [scattered(200) * 0.001, [[[-1e6, -1e6, 0], [1e6, -1e6, 0], [0, 1e6, 0]]]]
    )
    split = hizvk.split_mesh(soup, cell=10.0)
    assert len(split) > 1
    lonely = split.group_of[200]
    assert np.flatnonzero(split.group_of == lonely).tolist() == [200]


def test_numbers_at_the_ends_of_float64() -> None:
    huge = np.array([[[1e308] * 3, [-1e308] * 3, [0.0, 0.0, 0.0]]] * 3)
    for soup in (huge, scattered(100) * 1e300, scattered(100) * 1e-310):
        for cell in (5e-324, 1.0, 1e308):
            split = hizvk.split_mesh(soup, cell=cell)
            assert sorted(split.order.tolist()) == list(range(len(soup)))
            assert hizvk.check_bounds(split.boxes, split.meshes()).all_contained


# -- rules for bad triangles -----------------------------------------------------------------------


def test_triangles_without_a_place_are_listed_and_in_no_group() -> None:
    soup = scattered(50)
    soup[7, 1, 2], soup[20, 0, 0], soup[21, 2, 1] = np.nan, np.inf, -np.inf
    split = hizvk.split_mesh(soup, cell=8.0)
    assert split.invalid.tolist() == [7, 20, 21]
    assert np.flatnonzero(split.group_of == -1).tolist() == [7, 20, 21]
    assert np.flatnonzero(~split.triangle_mask(np.ones(len(split), bool))).tolist() == [7, 20, 21]
    # So the occluders' vertices are finite.
    assert len(split.mesh().triangles) == 47
    nothing = hizvk.split_mesh(np.full((2, 3, 3), np.nan), cell=1.0)
    assert len(nothing) == len(nothing.boxes) == len(nothing.mesh().triangles) == 0
    assert nothing.invalid.tolist() == [0, 1]


def test_triangles_without_area_are_bounded_like_others() -> None:
    soup = np.array([[[0.0, 0, 0]] * 3, [[0.0, 0, 0], [1, 1, 1], [2, 2, 2]]])
    split = hizvk.split_mesh(soup, cell=8.0)
    assert len(split) == 1
    assert split.boxes.max.tolist() == [[2.0, 2.0, 2.0]]


def test_empty() -> None:
    split = hizvk.split_mesh(np.empty((0, 3, 3)), cell=1.0)
    assert (len(split), split.offsets.tolist(), split.meshes()) == (0, [0], [])
    assert repr(split) == "SplitMesh(0 triangles in 0 groups)"


# -- forms of the arguments ------------------------------------------------------------------------


def test_a_mesh_and_its_soup_are_cut_alike() -> None:
    scene = city(1, 1).scene
    indexed = hizvk.split_mesh(scene.vertices, scene.triangles, cell=50.0)
    for other in (
        hizvk.split_mesh(scene.vertices[scene.triangles], cell=50.0),
        hizvk.split_mesh(hizvk.Mesh(scene.vertices, scene.triangles), cell=50.0),
        hizvk.split_mesh((scene.vertices, scene.triangles), cell=50.0),  # type: ignore[arg-type]
    ):
        assert np.array_equal(other.order, indexed.order)
        assert np.array_equal(other.offsets, indexed.offsets)
        assert np.array_equal(other.boxes.min, indexed.boxes.min)
    # Vertices that no chosen group uses are left out, and shared ones stay shared.
    chosen = np.arange(len(indexed)) % 3 == 0
    mesh = indexed.mesh(chosen)
    asked = np.repeat(chosen, np.diff(indexed.offsets))
    expected = indexed.vertices[indexed.triangles[asked]]
    assert np.array_equal(mesh.vertices[mesh.triangles], expected)
    assert len(mesh.vertices) == len(np.unique(indexed.triangles[asked]))
    placed = hizvk.Mesh(scene.vertices, scene.triangles, np.eye(4))
    with pytest.raises(ValueError, match="vertices: expected a mesh without transforms"):
        hizvk.split_mesh(placed, cell=1.0)


def test_a_mask_leads_back_to_the_callers_triangles() -> None:
    soup = np.arange(6)[:, None, None] * 100.0 + np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    split = hizvk.split_mesh(soup[[3, 0, 5, 1, 4, 2]], cell=4.0)
    mask = split.boxes.min[:, 0] >= 300.0  # of 3, 5 and 4, which are triangles 0, 2 and 4
    assert np.flatnonzero(split.triangle_mask(mask)).tolist() == [0, 2, 4]


# -- occluders and instances at once ---------------------------------------------------------------


def as_scene(split: hizvk.SplitMesh, scene: Scene) -> Scene:
    """The groups as instances; an unseen triangle far below stands for the occluders.

    So `firm` excuses nothing: what owns a pixel has to be kept.
    """
    return Scene(
        name="groups",
        origin=scene.origin,
        vertices=np.array([[0.0, 0, -1e4], [1, 0, -1e4], [0, 1, -1e4]]) + scene.origin,
        triangles=np.array([[0, 1, 2]], np.uint32),
        instance_vertices=split.vertices.astype(np.float64),
        instance_triangles=split.triangles,
        owner=np.repeat(np.arange(len(split), dtype=np.int32), np.diff(split.offsets)),
        box_min=split.boxes.min.astype(np.float64),
        box_max=split.boxes.max.astype(np.float64),
        views=scene.views,
    )


def lost(
    device: hizvk.Device, split: hizvk.SplitMesh, boxes: hizvk.Boxes, scene: Scene, **options: Any
) -> tuple[int, int, int]:
    """Over all views: visible groups that were culled, kept triangles, and all triangles."""
    groups, caster = as_scene(split, scene), truth.RayCaster(as_scene(split, scene))
    occluders, instances = device.occluders(split.mesh()), device.instances(boxes)
    false_culls = kept = 0
    for view in groups.views:
        depth = device.render_depth(occluders, view.camera((360, 640)), **options)
        mask = device.cull(instances, depth.camera, device.pyramid(depth), descent=4096).mask
        visible = caster.look(view, (360, 640)).pixels(len(split)) > 0
        false_culls += int((visible & ~mask).sum())
        kept += int(split.triangle_mask(mask).sum())
    return false_culls, kept, len(split.order) * len(groups.views)


@pytest.fixture(scope="module")
def soup() -> tuple[Scene, np.ndarray]:
    """A whole city as 1,191,036 triangles in random order, none of which share a vertex."""
    if importlib.util.find_spec("embreex") is None:
        pytest.skip("embreex, by which the truth is cast, is not installed")
    scene = city(58_000, 4).scene
    corners = np.concatenate(
        [
            scene.vertices[scene.triangles],
            scene.instance_vertices[scene.instance_triangles],
        ]
    )
    return scene, corners[np.random.default_rng(5).permutation(len(corners))]


def test_a_soup_of_a_million_triangles_hides_itself(
    device: hizvk.Device, soup: tuple[Scene, np.ndarray]
) -> None:
    scene, corners = soup
    assert len(corners) > 1_000_000
    started = time.perf_counter()
    split = hizvk.split_mesh(corners, cell=8.0)
    took = time.perf_counter() - started
    false_culls, kept, all_ = lost(device, split, split.boxes, scene)
    print(f"{split!r}, cut in {took:.2f} s: {kept:,} of {all_:,} kept in 4 views")
    assert false_culls == 0
    assert kept < 0.05 * all_
    # The check can fail: boxes at a tenth of their size, or those of the next group.
    middle = 0.5 * (split.boxes.min + split.boxes.max)
    half = 0.05 * (split.boxes.max - split.boxes.min)
    assert lost(device, split, hizvk.Boxes(middle - half, middle + half), scene)[0] > 0
    rolled = hizvk.Boxes(np.roll(split.boxes.min, 1, axis=0), np.roll(split.boxes.max, 1, axis=0))
    assert lost(device, split, rolled, scene)[0] > 0


def test_slanted_groups_hide_no_part_of_themselves(device: hizvk.Device) -> None:
    pytest.importorskip("embreex")
    pytest.importorskip("matplotlib")
    from hizvk.scenes import mountains

    scene = mountains(1, 4)
    split = hizvk.split_mesh(scene.vertices, scene.triangles, cell=400.0)
    assert lost(device, split, split.boxes, scene)[0] == 0
    small = {"size": (90, 160), "conservative": True}
    assert lost(device, split, split.boxes, scene, **small)[0] == 0


def test_a_wall_across_the_view_does_not_hide_its_own_groups(device: hizvk.Device) -> None:
    """Groups without thickness, at the depth that the image holds; rounding must not decide."""
    rng = np.random.default_rng(8)
    for distance in 10.0 ** rng.uniform(0.0, 4.0, 12):
        number = np.arange(13.0)
        side = distance * (number / 12.0 - 0.5 + rng.uniform(-0.02, 0.02))
        x, y = np.meshgrid(side, side, indexing="ij")
        vertices = np.stack([x, y, np.full_like(x, -distance)], axis=-1).reshape(-1, 3)
        index = np.arange(169).reshape(13, 13)
        a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
        triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
        split = hizvk.split_mesh(vertices, triangles, cell=distance / 6.0)
        camera = hizvk.Camera.look_at(
            (0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(360, 640), near=0.1
        )
        occluders, instances = device.occluders(split.mesh()), device.instances(split.boxes)
        for options in ({}, {"size": (45, 80), "conservative": True}):
            depth = device.render_depth(occluders, camera, **options)
            for fit in ("rectangle", "volume"):
                seen = device.cull(
                    instances, depth.camera, device.pyramid(depth), descent=4096, fit=fit
                )
                assert seen.mask.all()
