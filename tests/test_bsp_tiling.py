"""Tiling without depths: the coverage of the rasteriser bit for bit, in BSP order."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

import documented
import hizvk
from hizvk.bench import tiling as bench
from hizvk.scenes import box_mesh, village

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize("leaf", [None, 8])
def test_coverage_is_that_of_the_rasteriser(device: hizvk.Device, leaf: int | None) -> None:
    scene = village(9, 1, 3, seed=5)
    walls = device.occluders(scene.vertices, scene.triangles)
    tiling = hizvk.BspTiling(walls, leaf=leaf, most_parts=1e6)
    assert tiling.is_octree == (leaf is not None)
    assert tiling.num_parts > tiling.num_triangles == len(scene.triangles)
    for view in scene.views:
        camera = view.camera((135, 241))
        depth = device.render_depth(walls, camera, rasteriser="host").numpy()
        seen = tiling.draw(camera)
        np.testing.assert_array_equal(seen.coverage, depth > 0)
        assert 0 < seen.num_visible <= seen.parts
        assert 0 < seen.hidden_nodes < seen.nodes


def test_hidden_boxes_are_left_out(device: hizvk.Device) -> None:
    """Two hundred boxes behind one: of the six sides of the nearest one shows."""
    z = -np.arange(3.0, 203.0)
    low = np.stack([np.full_like(z, -1.0), np.full_like(z, -1.0), z - 0.5], axis=1)
    walls = device.occluders(*box_mesh(low, low + np.array([2.0, 2.0, 0.5])))
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(64, 64), near=0.1)
    tiling = hizvk.BspTiling(walls, most_parts=1.0)
    assert (tiling.num_triangles, tiling.num_parts, tiling.is_octree) == (2400, 2400, False)
    seen = tiling.draw(camera)
    assert seen.num_visible == 2
    assert seen.parts < 100
    assert repr(seen) == "<TiledCoverage 64x64: 2 visible triangles>"


@pytest.mark.slow
def test_triangles_that_split_without_end_are_refused(device: hizvk.Device) -> None:
    """Large triangles that all cross: 5,000 of them made 13 million parts, of 3.6 GB."""
    corners = np.random.default_rng(0).normal(size=(5000, 3, 3)) * 5.0
    soup = device.occluders(corners.reshape(-1, 3), np.arange(15000).reshape(-1, 3))
    with pytest.raises(hizvk.LimitError, match="parts of split triangles") as error:
        hizvk.BspTiling(soup)
    assert error.value.allowed == 2**20 + 16 * 5000


def test_the_bench_compares_with_depth_tiles(tmp_path: Path) -> None:
    found = bench.run(tmp_path, keys=["village"], views=1, size=(60, 80))
    assert found.passed
    assert [row.tree for row in found.rows] == ["one tree", "octree"]
    for row in found.rows:
        assert row.parts >= row.triangles > 0
        assert 0 < row.bits_bytes < row.depth_bytes
    assert (tmp_path / "report.md").exists()


@pytest.mark.slow
@pytest.mark.parametrize("scene", bench.NAMES)
def test_the_page_quotes_the_command(tmp_path: Path, scene: str) -> None:
    """If this is red, put the numbers of ``hizvk bench --tiling`` into docs/methods.md."""
    found = bench.run(tmp_path, keys=[scene])
    if found.missing:
        pytest.skip(found.missing[0])
    assert found.passed
    shown = [
        list(row.values())
        for row in documented.table(documented.page("methods.md"), "scene", "tree")
        if row["scene"] == scene
    ]
    assert shown == [bench.tree_cells(row) for row in found.rows]
