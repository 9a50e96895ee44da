"""Hierarchical visibility against the device's image and pyramid, and against counts by NumPy."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pytest

import hizvk
from documented import page
from hizvk.methods import HIDDEN, NOT_VISITED, OUTSIDE, VISIBLE
from tools.hierarchy.compare import measure
from tools.hierarchy.pictures import cells_of_test, draw, extents
from tools.hierarchy.scenes import SCENES, building, rocks

if TYPE_CHECKING:
    from pathlib import Path

SIZES = [(360, 640), (97, 131), (1, 1), (1, 77), (129, 1), (64, 256)]


@pytest.fixture(scope="module")
def scene() -> hizvk.HierarchicalVisibility:
    return hizvk.HierarchicalVisibility(building(100_000).meshes, threshold=1)


def cameras(
    size: tuple[int, int], count: int = 3, *, reversed_z: bool = True
) -> list[hizvk.Camera]:
    return [
        hizvk.Camera.look_at(
            view.eye,
            view.target,
            up=view.up,
            fov_y_deg=view.fov_y_deg,
            size=size,
            near=view.near,
            reversed_z=reversed_z,
        )
        for view in building(100_000, count).views
    ]


def reduced(level: npt.NDArray[np.float32], reversed_z: bool) -> npt.NDArray[np.float32]:
    """The next level: the farthest of 2x2, where a missing row or column repeats the last one."""
    rows, columns = level.shape
    padded = np.pad(level, ((0, rows % 2), (0, columns % 2)), mode="edge")
    blocks = padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2)
    return blocks.min(axis=(1, 3)) if reversed_z else blocks.max(axis=(1, 3))


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("reversed_z", [True, False], ids=["reversed", "standard"])
def test_depth_and_levels_have_the_bits_of_the_device(
    device: hizvk.Device,
    scene: hizvk.HierarchicalVisibility,
    size: tuple[int, int],
    reversed_z: bool,
) -> None:
    occluders = device.occluders(building(100_000).meshes)
    for camera in cameras(size, 2, reversed_z=reversed_z):
        frame = scene.render(camera)
        depth = device.render_depth(occluders, camera, rasteriser="host")
        assert np.array_equal(frame.depth, depth.numpy())
        pyramid = device.pyramid(depth)
        assert len(frame.levels) == pyramid.num_levels
        expected = frame.depth
        for k, level in enumerate(frame.levels):
            if k > 0:
                expected = reduced(expected, reversed_z)
            assert np.array_equal(level, expected), k
            assert np.array_equal(level, pyramid.level(k)), k


def test_what_is_hidden_is_behind_every_pixel_of_its_box(
    scene: hizvk.HierarchicalVisibility,
) -> None:
    hidden = 0
    for camera in cameras((180, 320)):
        frame = scene.render(camera)
        for node, extent in enumerate(extents(scene.nodes, camera)):
            if frame.states[node] != HIDDEN:
                continue
            assert extent is not None, "a box at the eye is never hidden"
            (x0, x1), (y0, y1) = extent.columns, extent.rows
            assert (frame.depth[y0 : y1 + 1, x0 : x1 + 1] >= extent.nearest).all()
            # The quadtree finds the same, and the picture of it shows that.
            assert cells_of_test(frame, extent)[-1].hides
            hidden += 1
    assert hidden > 20


def test_the_last_frame_changes_no_pixel(scene: hizvk.HierarchicalVisibility) -> None:
    first, second, third = cameras((180, 320))
    last = scene.render(first)
    for camera in (first, second, third):
        plain = scene.render(camera)
        for previous in (last, last.visible_leaves, plain, []):
            again = scene.render(camera, previous=previous)
            assert np.array_equal(again.depth, plain.depth)
            assert np.array_equal(again.visible_leaves, plain.visible_leaves)
            for a, b in zip(again.levels, plain.levels, strict=True):
                assert np.array_equal(a, b)
        last = plain
    other = hizvk.HierarchicalVisibility([])
    with pytest.raises(ValueError, match="previous: expected a frame of this tree of 0 nodes, got"):
        other.render(first, previous=last)


def test_the_counts_add_up(scene: hizvk.HierarchicalVisibility) -> None:
    nodes = scene.nodes
    for camera in cameras((180, 320)):
        frame, flat = scene.render(camera, count=True), scene.render_flat(camera)
        parts = (
            frame.triangles_outside,
            frame.triangles_in_hidden_nodes,
            frame.triangles_in_hidden_meshlets,
            frame.triangles_drawn,
        )
        assert sum(parts) == scene.num_triangles
        assert parts[1] == nodes["triangles"][frame.states == HIDDEN].sum()
        assert frame.nodes_visited == np.isin(frame.states, (HIDDEN, VISIBLE)).sum()
        above = frame.states[nodes["parent"][1:]]
        assert ((above == VISIBLE) == (frame.states[1:] != NOT_VISITED)).all()
        assert (nodes["meshlets"][frame.visible_leaves] > 0).all()
        assert frame.settled_by_one <= frame.nodes_visited <= frame.comparisons
        assert 0.0 <= frame.share_settled_by_one < 1.0
        assert 0.0 < frame.share_in_hidden_nodes < 1.0
        assert frame.depth_complexity > frame.depth_complexity_drawn > 0.5
        assert np.array_equal(frame.depth, flat.depth)
        assert flat.triangles_drawn > 0
        assert "nodes visited" in repr(frame)
    assert np.isnan(scene.render(camera).depth_complexity)


def test_depth_complexity_by_hand() -> None:
    """Nine walls across the view, each of which covers every pixel's centre once."""
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(33, 47), near=0.1)
    places = np.tile(np.eye(4), (9, 1, 1))
    places[:, 2, 3] = -10.0 * np.arange(1, 10)
    square = np.array([[-200.0, -200, 0], [200, -200, 0], [-200, 200, 0], [200, 200, 0]])
    walls = hizvk.Mesh(square, [[0, 1, 2], [2, 1, 3]], places)
    scene = hizvk.HierarchicalVisibility(walls, threshold=1)
    frame = scene.render(camera, count=True)
    assert (frame.depth_complexity, frame.depth_complexity_drawn) == (9.0, 1.0)
    assert frame.triangles_drawn == 2
    assert "18 triangles" in repr(scene)
    # Nothing is seen of it from behind.
    away = hizvk.Camera.look_at((0, 0, 9), (0, 0, 99), fov_y_deg=60, size=(33, 47), near=0.1)
    assert scene.render(away).states.tolist()[0] == OUTSIDE


@pytest.mark.parametrize("threshold", [1, 4, 100])
@pytest.mark.parametrize("deepest", [0, 3, 16])
def test_the_tree_holds_every_meshlet_once(threshold: int, deepest: int) -> None:
    scene = hizvk.HierarchicalVisibility(
        building(100_000).meshes, threshold=threshold, deepest=deepest
    )
    nodes = scene.nodes
    assert (scene.threshold, scene.deepest) == (threshold, deepest)
    assert nodes["meshlets"].sum() == scene.num_meshlets
    assert nodes["triangles"][0] == scene.num_triangles
    assert (nodes["parent"][1:] < np.arange(1, len(nodes))).all()
    above = nodes[nodes["parent"][1:]]
    assert (above["min"] <= nodes["min"][1:]).all()
    assert (above["max"] >= nodes["max"][1:]).all()
    assert (above["level"] < nodes["level"][1:]).all()
    assert nodes["level"].max() <= deepest
    is_leaf = ~np.isin(np.arange(len(nodes)), nodes["parent"])
    crowded = is_leaf & (nodes["meshlets"] > threshold) & (nodes["level"] < deepest)
    # Only meshlets larger than half of their cell stay together.
    side = (nodes["max"] - nodes["min"]).max(axis=1)
    assert (side[crowded] > side[0] * 0.5 ** (nodes["level"][crowded] + 1.0)).all()


def test_it_is_loaded_when_it_is_asked_for() -> None:
    code = (
        "import sys, hizvk; assert 'hizvk.methods' not in sys.modules; "
        "print(hizvk.HierarchicalVisibility.__name__, 'hizvk.methods' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=60
    )
    assert done.stdout.split() == ["HierarchicalVisibility", "True"]


def test_the_comparison_and_the_pictures(tmp_path: Path) -> None:
    for made in (building(20_000, 2), rocks(20_000, 2)):
        row = measure(made, (90, 160), 1, threshold=4)
        assert row.different == 0
        assert row.views == 2
        assert row.visited > 0
        assert len(row.times()) == 7
        assert len(row.counts()) == 10
    pytest.importorskip("matplotlib", reason="pictures need matplotlib (the extra viz)")
    paths = draw(building(20_000, 1), tmp_path)
    assert [path.name for path in paths] == ["octree.png", "pyramid.png", "quadtree.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)


@pytest.mark.parametrize(
    "name",
    [
        "building",
        pytest.param("boulders", marks=pytest.mark.slow),
        pytest.param("mountains", marks=pytest.mark.slow),
    ],
)
def test_the_page_has_the_counts_of_today(name: str) -> None:
    """`python -m tools.hierarchy compare` prints the same rows for 0.3 million triangles."""
    row = measure(SCENES[name](300_000, 6), (360, 640), 1, threshold=4)
    assert f"| {' | '.join(row.counts())} |" in page("methods.md")
