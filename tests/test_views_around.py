"""`cube`, `visible_sets` and `viewshed`: what is seen from a place, in all directions."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import hizvk
from hizvk.sweeping import terrain

EYES = [(0.0, 0.0, 0.0), (3.7, -2.2, 1e-9), (691_607.253, 5_334_760.381, 515.02), (1e12, 0.1, -7.0)]


def seams() -> np.ndarray:
    """Directions through corners and edges of a cube, and beside them; then random ones."""
    along = np.linspace(-1.0, 1.0, 41)
    edges = [
        np.roll((a, b, t), turn)
        for a, b in itertools.product((-1.0, 1.0), repeat=2)
        for t in along
        for turn in range(3)
    ]
    hairs = np.random.default_rng(3).uniform(-1e-15, 1e-15, (len(edges), 3)) + edges
    rest = np.random.default_rng(4).normal(size=(500, 3))
    return np.concatenate([edges, hairs, rest])


# -- cube ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("eye", EYES)
@pytest.mark.parametrize("size", [1, 31])
def test_no_direction_is_lost_between_faces(
    device: hizvk.Device, eye: tuple[float, float, float], size: int
) -> None:
    """By hand: some face's borders contain it; and a cull keeps a point there, before any depth."""
    ways = seams() / np.abs(seams()).max(axis=1, keepdims=True)
    reach = max(1.0, 1e-3 * np.abs(eye).max())
    points = np.array(eye) + 7.0 * reach * ways
    cameras = hizvk.cube(eye, size=size, near=0.1, seam_px=min(0.5, size / 4.0))
    inside = np.zeros(len(points), np.bool_)
    for camera in cameras:
        clip = np.c_[points - eye, np.ones(len(points))] @ centred(camera, eye).T
        inside |= (np.abs(clip[:, :2]) < clip[:, 3:]).all(axis=1) & (clip[:, 3] > 0.0)
    assert inside.all()
    seen = hizvk.sweep(
        hizvk.Spheres(points, 0.0), cameras, depths=lambda _: np.full((size, size), 1e20), kind="z"
    )
    assert seen.union().all()
    # Each face alone sees about a sixth.
    assert (seen.counts < 0.4 * len(points)).all()


def centred(camera: hizvk.Camera, eye: tuple[float, float, float]) -> np.ndarray:
    """``clip_from_world`` for positions relative to the eye."""
    moved = np.eye(4)
    moved[:3, 3] = eye
    matrix = camera.clip_from_world
    matrix[:, 3] = 0.0  # all faces meet in the eye
    return matrix


def test_a_seam_that_is_missing_is_seen() -> None:
    """Faces that end before the edges lose what lies there: the test above would be red."""
    points = hizvk.Spheres(7.0 * seams()[:40], 0.0)
    short = [
        hizvk.Camera.look_at((0, 0, 0), way, up=up, fov_y_deg=89.5, size=(64, 64), near=0.1)
        for way, up in (
            ((1, 0, 0), (0, 1, 0)),
            ((-1, 0, 0), (0, 1, 0)),
            ((0, 1, 0), (0, 0, 1)),
            ((0, -1, 0), (0, 0, 1)),
            ((0, 0, 1), (0, 1, 0)),
            ((0, 0, -1), (0, 1, 0)),
        )
    ]
    seen = hizvk.sweep(points, short, depths=lambda _: np.full((64, 64), 1e20), kind="z")
    assert not seen.union().all()


def test_the_faces_are_those_of_a_cube_map() -> None:
    cameras = hizvk.cube((1.0, 2.0, 3.0), size=8, near=0.5, seam_px=0)
    # By hand, of the convention of cube maps: the view direction, and where the image's top lies.
    ways = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    tops = [(0, -1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (0, -1, 0), (0, -1, 0)]
    for camera, way, top in zip(cameras, ways, tops, strict=True):
        middle = np.array((1.0, 2.0, 3.0)) + 2.0 * np.array(way)
        seen = camera.project(np.stack([middle, middle + 1.9 * np.array(top)]))
        np.testing.assert_allclose(seen.pixels, [(4.0, 4.0), (4.0, 0.2)], atol=1e-9)
        np.testing.assert_allclose(seen.z, 2.0)
    # With half a pixel the outermost centres lie on the edge of the cube.
    seam = hizvk.cube((0, 0, 0), size=8, near=0.5)[5].project([(2.0, 2.0, -2.0)])
    np.testing.assert_allclose(seam.pixels, [(0.5, 7.5)])


# -- visible_sets ----------------------------------------------------------------------------------


def test_cells_see_what_their_viewpoints_see() -> None:
    """A wall with a door at y 0..1: by hand, lines from each corner through the door."""
    sides = [(-9.0, 0.0), (1.0, 9.0)]
    wall = [
        hizvk.Mesh([(0, a, -9), (0, b, -9), (0, b, 9), (0, a, 9)], [[0, 1, 2], [0, 2, 3]])
        for a, b in sides
    ]
    at = np.linspace(-8.0, 8.0, 161)
    points = np.stack([np.full(161, 4.0), at, np.zeros(161)], axis=1)
    cells = hizvk.Boxes([(-4.0, 0.2, 0.0), (-4.0, -6.0, 0.0)], [(-2.0, 0.8, 0.0), (-3.0, -5, 0)])
    seen = hizvk.visible_sets(
        hizvk.Spheres(points, 0.0), cells, occluders=wall, size=256, near=0.1, descent=4096
    )
    for cell, (low, high) in enumerate(zip(cells.min, cells.max, strict=True)):
        expected = np.zeros(161, np.bool_)
        for x, y in itertools.product((low[0], high[0]), (low[1], high[1])):
            crossing = y + (at - y) * (0.0 - x) / (4.0 - x)
            expected |= (crossing > 0.0) & (crossing < 1.0)
        mask = seen.mask(cell)
        assert not (expected & ~mask).any()
        # Pixels at silhouettes are far, so a point or two more are kept on either side.
        assert (mask & ~expected).sum() <= 4
        assert 5 < expected.sum() < 130
    middle = hizvk.visible_sets(
        hizvk.Spheres(points, 0.0), cells, occluders=wall, samples=1, size=256, near=0.1
    )
    assert (middle.counts < seen.counts).all()


# -- viewshed --------------------------------------------------------------------------------------


def hills(rows: int = 22, columns: int = 26) -> np.ndarray:
    y, x = np.mgrid[:rows, :columns]
    rough = np.random.default_rng(8).uniform(-1.0, 1.0, (rows, columns))
    return 6.0 * np.sin(0.7 * x) * np.cos(0.6 * y) + rough


def clear(
    eye: np.ndarray, points: np.ndarray, corners: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> np.ndarray:
    """Whether no triangle lies before each point (Moller and Trumbore 1997), one ray at a time."""
    a, b, c = corners
    free = np.ones(len(points), np.bool_)
    for number, point in enumerate(points):
        ray = point - eye
        across = np.cross(ray, c - a)
        scale = ((b - a) * across).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = ((eye - a) * across).sum(axis=1) / scale
            other = np.cross(eye - a, b - a)
            v = other @ ray / scale
            t = ((c - a) * other).sum(axis=1) / scale
        hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0) & (t < 1.0 - 1e-9)
        free[number] = not hit.any()
    return free


def on_the_ground(
    heights: np.ndarray, steps: tuple[float, float], per_cell: int
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Cell and position of random points on the triangles, and the triangles' corners."""
    rows, columns = heights.shape
    corners: list[tuple[np.ndarray, ...]] = []
    cells, points = [], []
    random = np.random.default_rng(9)
    for i, j in itertools.product(range(rows - 1), range(columns - 1)):
        square = {
            (p, q): np.array([(j + q) * steps[1], (i + p) * steps[0], heights[i + p, j + q]])
            for p in (0, 1)
            for q in (0, 1)
        }
        for third in ((1, 0), (0, 1)):
            triangle = (square[0, 0], square[third], square[1, 1])
            if not np.isfinite(triangle).all():
                continue
            corners.append(triangle)
            for _ in range(per_cell):
                weights = random.dirichlet((0.7, 0.7, 0.7))
                point = sum(w * corner for w, corner in zip(weights, triangle, strict=True))
                points.append(point)
                cells.append((round(point[1] / steps[0]), round(point[0] / steps[1])))
    a, b, c = (np.array([one[k] for one in corners]) for k in range(3))
    return np.array(cells), np.array(points), (a, b, c)


@pytest.mark.parametrize(
    ("eye", "eye_height", "target_height", "steps", "holes"),
    [
        ((11.3, 7.6), 1.7, 0.0, (10.0, 10.0), 0),
        ((3.0, 20.0), 6.0, 2.5, (3.0, 4.5), 0),
        ((0.0, 0.0), 9.0, 0.0, (2.0, 2.0), 40),
    ],
)
def test_a_hidden_cell_is_hidden(
    eye: tuple[float, float],
    eye_height: float,
    target_height: float,
    steps: tuple[float, float],
    holes: int,
) -> None:
    heights = hills()
    flat = np.random.default_rng(2).permutation(heights.size)[:holes]
    flat = flat[flat > 2 * heights.shape[1]]
    heights.reshape(-1)[flat] = np.nan
    cells, points, corners = on_the_ground(heights, steps, 2)
    # The eye's own ground: by hand, of the triangle that it stands on.
    i, j = int(eye[0]), int(eye[1])
    u, v = eye[0] - i, eye[1] - j
    diagonal = heights[i + 1, j + 1]
    if u >= v:
        ground = heights[i, j] * (1 - u) + heights[i + 1, j] * (u - v) + diagonal * v
    else:
        ground = heights[i, j] * (1 - v) + heights[i, j + 1] * (v - u) + diagonal * u
    place = np.array([eye[1] * steps[1], eye[0] * steps[0], ground + eye_height])
    raised = points + np.array([0.0, 0.0, target_height]) * np.random.default_rng(1).uniform(
        size=(len(points), 1)
    )
    shown = np.zeros(heights.shape, np.bool_)
    for cell in cells[clear(place, raised, corners)]:
        shown[tuple(cell)] = True
    mask = hizvk.viewshed(
        heights, steps, eye, eye_height=eye_height, target_height=target_height, size=256
    )
    assert mask.shape == heights.shape
    assert not (shown & ~mask).any()
    assert not mask[np.isnan(heights)].any()
    hidden = ~shown & np.isfinite(heights)
    kept = (mask & hidden).sum() / hidden.sum()
    print(f"{shown.sum()} of {shown.size} cells shown, {kept:.1%} of the hidden kept")
    assert 0.05 < shown.mean() < 0.9
    # A few rays for each cell do not find all that shows, and a cell counts as a whole.
    assert kept < 0.6


@pytest.mark.parametrize("target_height", [0.0, 3.0])
def test_a_cell_s_box_holds_its_triangles(target_height: float) -> None:
    heights = hills()
    heights[5, 7] = heights[12, 3] = np.nan
    cells, points, _ = on_the_ground(heights, (3.0, 4.5), 12)
    boxes = terrain._boxes(heights, np.isfinite(heights), (3.0, 4.5), target_height)
    number = np.cumsum(np.isfinite(heights).reshape(-1)).reshape(heights.shape) - 1
    # A point on the border of two cells may count as the other one's.
    apart = np.abs(points[:, :2] / (4.5, 3.0) % 1.0 - 0.5).min(axis=1) > 1e-9
    of = number[cells[:, 0], cells[:, 1]][apart]
    for raised in (0.0, target_height):
        moved = points[apart] + (0.0, 0.0, raised) - boxes.centers[of]
        local = np.linalg.solve(np.asarray(boxes.rotations)[of], moved[:, :, None])[..., 0]
        assert (np.abs(local) <= boxes.half_sizes[of]).all()
    # They are thin: half of them less than a quarter of what stands upright around them.
    assert np.median(boxes.half_sizes[:, 2]) < 3.0 + target_height


def test_what_shows_through_a_notch_needs_conservative_depth() -> None:
    """A ridge with a notch narrower than a pixel, through which cells far behind are seen."""
    heights = np.zeros((41, 60))
    heights[:, 12] = 12.0
    heights[25, 12] = 0.0
    _, _, corners = on_the_ground(heights, (10.0, 10.0), 0)
    eye, place = (20, 2), np.array([20.0, 200.0, 5.0])
    cells = np.argwhere(np.ones_like(heights))
    far = cells[(cells[:, 1] > 14) & (cells[:, 0] > 20)]
    free = clear(place, np.c_[far[:, 1] * 10.0, far[:, 0] * 10.0, np.zeros(len(far))], corners)
    shown = far[free]
    assert 2 < len(shown) < 200

    def lost(*, conservative: bool) -> int:
        mask = hizvk.viewshed(
            heights, 10.0, eye, eye_height=5.0, size=18, conservative=conservative
        )
        return int((~mask[shown[:, 0], shown[:, 1]]).sum())

    assert lost(conservative=True) == 0
    assert lost(conservative=False) > 0


def test_the_eye_s_own_ground_is_seen_however_near() -> None:
    heights = np.zeros((5, 5))
    seen = hizvk.viewshed(heights, 100.0, (2, 2), eye_height=1e-3, size=64)
    assert seen.all()
    # One deep in a hole sees the hole.
    heights = np.full((7, 7), 30.0)
    heights[3, 3] = 0.0
    seen = hizvk.viewshed(heights, 1.0, (3, 3), size=128)
    assert seen[3, 3]
    assert not seen[0, 0]
    assert not seen[6, 3]


def test_the_other_diagonal_is_another_terrain() -> None:
    """By hand: a ridge along the split of the squares hides; across it, it does not."""
    heights = np.diag(np.full(8, 5.0))
    along = hizvk.viewshed(heights, 1.0, (0, 7), eye_height=1.0, size=256)
    assert not along[7, 0]
    # Mirrored, the squares are split across the ridge, and between its peaks it is low.
    across = hizvk.viewshed(heights[:, ::-1], 1.0, (0, 0), eye_height=1.0, size=256)
    assert across[7, 7]
