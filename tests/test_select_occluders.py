"""`select_occluders` by hand-made meshes, and the report of what fewer occluders lose."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

import documented
import hizvk
from hizvk import cli
from hizvk.bench import hiding, occluders
from hizvk.bench.hiding import Groups, Limited, Ranked, Stage
from hizvk.occluders import silhouettes
from hizvk.progress import Progress
from hizvk.scenes import View, box_mesh
from hizvk.scenes.hedge import hedge

if TYPE_CHECKING:
    from collections.abc import Callable

CASTLE = Path(__file__).resolve().parents[2] / "shared" / "judge" / "castle.npz"
Soup = tuple[np.ndarray, np.ndarray]


def box(low: tuple[float, ...], high: tuple[float, ...]) -> Soup:
    return box_mesh([low], [high])


def fine(low: tuple[float, ...], high: tuple[float, ...], times: int) -> Soup:
    """A box whose triangles are all there `times` times over."""
    vertices, triangles = box(low, high)
    return vertices, np.tile(triangles, (times, 1))


WALL = box((0, 0, 0), (10, 0.25, 3))


def reasons(meshes: list[Soup], **options: float | None) -> dict[int, str]:
    """The first word of each reason."""
    found = hizvk.select_occluders(meshes, **options)  # type: ignore[arg-type]
    assert sorted([*found.kept.tolist(), *found.reasons]) == list(range(len(meshes)))
    return {k: text.partition(":")[0] for k, text in found.reasons.items()}


# -- silhouettes -----------------------------------------------------------------------------------


def test_area_and_fill_by_hand() -> None:
    """Sides across x, y and z: 0.75, 30 and 2.5 of the wall; a triangle is half of its square."""
    flat = np.array([[0.0, 0, 0], [4, 0, 0], [0, 0, 4]]), np.array([[0, 1, 2]])
    slanted = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 4]]), np.array([[0, 1, 2]])
    found = hizvk.select_occluders([WALL, flat, slanted], min_fill=0.0, min_size=0.0)
    assert found.area[0] == pytest.approx((0.75 + 30.0 + 2.5) / 3.0)
    assert found.fill[0] == pytest.approx(1.0)
    # 16 x 16 samples; those on the diagonal count as well.
    assert found.area[1] == pytest.approx(8.0 / 3.0, rel=0.07)
    assert found.fill[1] == pytest.approx(0.5, abs=0.035)
    assert found.area[2] == pytest.approx((8.0 + 8.0) / 3.0, rel=0.07)  # along x it is a line
    assert found.triangles.tolist() == [12, 1, 1]


def test_silhouettes_are_those_of_points_tested_one_by_one() -> None:
    """A random soup, against the same samples by barycentric coordinates in float64."""
    rng = np.random.default_rng(4)
    soup = rng.uniform(0.0, 10.0, (1, 3, 3)) + rng.uniform(0.0, 4.0, (12, 3, 3))
    mesh = hizvk.Mesh(soup.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    pieces = silhouettes.measured([mesh], Progress(False, "measuring"))
    low, high = soup.min(axis=(0, 1)), soup.max(axis=(0, 1))
    at = (np.arange(silhouettes.SAMPLES) + 0.5) / silhouettes.SAMPLES
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        x, y = np.meshgrid(low[i] + at * (high - low)[i], low[j] + at * (high - low)[j])
        covered = np.zeros(x.shape, dtype=bool)
        for corner in soup[:, :, [i, j]]:
            a, u, v = corner[0], corner[1] - corner[0], corner[2] - corner[0]
            twice = u[0] * v[1] - u[1] * v[0]
            s = ((x - a[0]) * v[1] - (y - a[1]) * v[0]) / twice
            t = (u[0] * (y - a[1]) - u[1] * (x - a[0])) / twice
            covered |= (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0)
        expected = covered.mean() * (high - low)[i] * (high - low)[j]
        assert pieces.silhouette[0, axis] / pieces.scale**2 == pytest.approx(expected)


@pytest.mark.parametrize("scale", [2.0**-600, 1.0, 2.0**600])
def test_units_do_not_matter(scale: float) -> None:
    made = hedge().meshes()[640:]
    usual = hizvk.select_occluders(made, max_triangles=5200)
    found = hizvk.select_occluders([(v * scale, t) for v, t in made], max_triangles=5200)
    assert found.kept.tolist() == usual.kept.tolist()
    assert list(found.reasons) == list(usual.reasons)
    assert np.array_equal(found.fill, usual.fill)


# -- criteria --------------------------------------------------------------------------------------


def test_small_ones_are_dropped() -> None:
    """A cube of side s has the size s; the diagonal here is close to that of the wall, 10.4."""
    for side, is_small in ((0.05, True), (0.06, False)):
        cube = box((5, 2, 1), (5 + side, 2 + side, 1 + side))
        assert reasons([WALL, cube], max_protrusion=None) == ({1: "small"} if is_small else {})
    nothing = np.empty((0, 3)), np.empty((0, 3), np.uint32)
    line = np.array([[0.0, 0, 0], [1, 0, 0], [9, 0, 0]]), np.array([[0, 1, 2]])
    assert reasons([WALL, nothing, line], min_size=0.0) == {1: "small", 2: "small"}
    assert reasons([]) == {}


def test_ill_shaped_ones_are_dropped() -> None:
    """Two bars at the ends of a large box: their silhouettes are 2 x 0.3 of 4 and less."""
    bars = box_mesh([[0, 0, 0], [0, 3.7, 3.7]], [[4, 0.3, 0.3], [4, 4, 4]])
    assert reasons([WALL, bars]) == {1: "ill-shaped"}
    assert reasons([WALL, bars], min_fill=0.0) == {}


def test_high_polygon_ones_are_dropped_if_their_triangles_hide_little() -> None:
    """960 triangles on a cube of 0.5 m, beside walls; a large cube may have as many."""
    walls = [box((0, 10 * k, 0), (100, 10 * k + 1, 30)) for k in range(8)]
    statue = fine((0, 5, 0), (1, 6, 1), 80)
    assert reasons([*walls, statue]) == {8: "high-polygon"}
    assert reasons([*walls, statue], max_density=None) == {}
    assert reasons([*walls, fine((0, 5, 0), (90, 8, 9), 80)]) == {}
    # As many for its area, but few.
    assert reasons([*walls, fine((0, 5, 0), (1, 6, 1), 8)]) == {}


@pytest.mark.parametrize(
    ("low", "high", "is_redundant"),
    [
        ((4, 0.25, 2), (4.3, 0.3, 2.3), True),  # a clock on the wall
        ((4, 0.05, 1), (5, 0.2, 2), True),  # within the wall
        ((4, 0.25, 0), (5, 1.25, 1), False),  # a crate before it
        ((9.9, 0, 0), (13, 0.25, 3), False),  # an end that goes on
        ((0, 5, 0), (9, 5.25, 3), False),  # another wall
    ],
)
def test_redundant_ones_stick_out_of_a_larger_one_by_little(
    low: tuple[float, ...], high: tuple[float, ...], is_redundant: bool
) -> None:
    assert reasons([WALL, box(low, high)]) == ({1: "redundant"} if is_redundant else {})
    assert reasons([WALL, box(low, high)], max_protrusion=None) == {}


def test_nothing_is_redundant_beside_what_is_no_larger_or_open() -> None:
    # The same wall twice: one of them is enough, but neither is much larger.
    assert reasons([WALL, WALL]) == {}
    # Posts and bars around a hole, and a board within it.
    frame = box_mesh(
        [[0, 0, 0], [9, 0, 0], [0, 0, 0], [0, 0, 9]],
        [[1, 1, 10], [10, 1, 10], [10, 1, 1], [10, 1, 10]],
    )
    assert reasons([frame, box((3, 0.2, 3), (6, 0.4, 6))]) == {}


def test_copies_count_as_one_mesh() -> None:
    places = np.stack([np.eye(4)] * 3)
    places[:, 0, 3] = [0.0, 20.0, 40.0]
    vertices, triangles = WALL
    found = hizvk.select_occluders([hizvk.Mesh(vertices, triangles, places)])
    assert found.triangles.tolist() == [36]
    assert found.area[0] == pytest.approx(3.0 * (0.75 + 30.0 + 2.5) / 3.0)
    # Clocks on two of the walls are redundant; a third one in the air is not.
    clock = box((4, 0.25, 2), (4.3, 0.3, 2.3))
    walls = hizvk.Mesh(vertices, triangles, places)
    assert list(hizvk.select_occluders([walls, hizvk.Mesh(*clock, places[:2])]).reasons) == [1]
    away = places.copy()
    away[2, 1, 3] = 5.0
    assert hizvk.select_occluders([walls, hizvk.Mesh(*clock, away)], min_size=0.0).reasons == {}


def test_a_budget_takes_the_most_silhouette_per_triangle() -> None:
    """Areas 100, 100 and 4 with 48, 12 and 12 triangles: 2.1, 8.3 and 0.3 per triangle."""
    cubes = [
        fine((0, 0, 0), (10, 10, 10), 4),
        box((20, 0, 0), (30, 10, 10)),
        box((40, 0, 0), (42, 2, 2)),
    ]
    found = hizvk.select_occluders(cubes)
    assert found.kept.tolist() == [1, 0, 2]
    assert str(found) == "OccluderSelection(3 of 3 meshes, 72 of 72 triangles)"
    for budget, kept in (
        (72, [1, 0, 2]),
        (71, [1, 0]),
        (59, [1, 2]),
        (24, [1, 2]),
        (12, [1]),
        (0, []),
    ):
        found = hizvk.select_occluders(cubes, max_triangles=budget)
        assert found.kept.tolist() == kept
        assert {text.partition(":")[0] for text in found.reasons.values()} <= {"budget"}
    assert found.reasons[1].startswith("budget: 12 triangles do not fit beside the 0")


# -- where size and distance fail ------------------------------------------------------------------


@pytest.fixture(scope="module")
def stage(device: hizvk.Device) -> Stage:
    made = hedge(1000, 3)
    low, high = (
        np.array([pick(vertices, axis=0) for vertices, _ in made.meshes()])
        for pick in (np.min, np.max)
    )
    groups = Groups(made.scene.vertices, made.scene.triangles, made.offsets, hizvk.Boxes(low, high))
    return Stage(device, made.scene, groups, (180, 320))


def test_small_occluders_hide_together_what_a_large_one_does_not(stage: Stage) -> None:
    made = hedge(1000, 3)
    bricks = np.arange(len(stage.groups)) < made.bricks
    assert stage.hidden == [1000, 1000, 1000]
    for k in range(3):
        assert stage.hides(stage.drawn([stage.groups.mesh(bricks)], k)) == 1000
        assert stage.hides(stage.drawn([stage.groups.mesh(~bricks)], k)) < 20
    # Each rock is larger than any brick, and nearer.
    sizes = np.linalg.norm(stage.groups.boxes.max - stage.groups.boxes.min, axis=1)
    assert sizes[~bricks].min() > 3.0 * sizes[bricks].max()
    assert stage.groups.boxes.min[~bricks, 1].max() < stage.groups.boxes.min[bricks, 1].min()


def test_ranking_by_size_and_distance_fails_there(stage: Stage) -> None:
    """Another ranking is one more row, such as one that knows which objects are bricks."""
    bricks = (np.arange(len(stage.groups)) < hedge(1000, 3).bricks).astype(float)
    rows = hiding.cut(stage, [*hiding.WAYS, Ranked("bricks first", lambda _: lambda _: bricks)])
    share = {row.label: row.share(0.5) for row in rows}
    assert share["size and distance of the box, per view"] < 0.05
    assert share["world area, static"] < 0.05
    assert share["`select_occluders`, static"] == share["bricks first"] == 1.0


def test_a_way_keeps_to_its_budget(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[tuple[int, np.ndarray]] = []
    monkeypatch.setattr(Stage, "drawn", lambda *call: drawn.append((call[2], call[1][0])))
    sizes = stage.groups.sizes
    for way in hiding.WAYS:
        if not isinstance(way, Ranked):
            continue
        draw = way.start(stage)
        for k in range(3):
            for budget in (0, 11, 12, 5000, 10**6):
                draw(k, budget)
                triangles = len(drawn[-1][1].triangles)
                assert triangles <= min(budget, int(sizes[stage.in_view[k]].sum()))
    assert any(len(mesh.triangles) > 1000 for _, mesh in drawn)


def test_a_limit_of_triangles_is_the_librarys_own_choice(stage: Stage) -> None:
    draw = Limited("a limit", 1).start(stage)
    sizes = stage.groups.sizes
    for k in range(3):
        whole = int(sizes[stage.in_view[k]].sum())
        assert stage.hides(draw(k, whole)) == stage.hidden[k] == 1000
        assert (draw(k, 0).numpy() == 0.0).all()  # reversed Z: nothing was drawn
        # A clear pixel stays clear, and no other one is nearer than with all of them.
        full, some = draw(k, whole).numpy(), draw(k, whole // 4).numpy()
        assert 0 < (some > 0.0).sum() < (full > 0.0).sum()
        assert (some <= full).all()


def test_what_was_hidden_makes_room_in_the_next_frame(device: hizvk.Device) -> None:
    """A near wall hides large boxes, and small ones stand beside it; half may be drawn."""
    low = [[-4.0, 5.0, -4.0], *([[-3.0, 8.0 + 2.0 * k, -3.0] for k in range(4)])]
    high = [[4.0, 5.5, 4.0], *([[3.0, 9.0 + 2.0 * k, 3.0] for k in range(4)])]
    low += [[9.0, 10.0, -2.0 + k] for k in range(4)]
    high += [[9.5, 10.5, -1.5 + k] for k in range(4)]
    boxes = np.array(low), np.array(high)
    vertices, triangles = box_mesh(*boxes)
    seen = View("ahead", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 80.0, 0.25)
    camera = seen.camera((90, 160))
    meshes = [hizvk.Mesh(vertices[8 * k : 8 * k + 8], triangles[:12]) for k in range(len(boxes[0]))]
    occluders = device.occluders(meshes)
    full = device.render_depth(occluders, camera, rasteriser="host").numpy()

    def frame() -> np.ndarray:
        return device.render_depth(occluders, camera, rasteriser="host", max_triangles=60).numpy()

    assert (frame() != full).any()  # the wall and the four that it hides: the largest
    assert np.array_equal(frame(), full)  # the wall and the four small ones
    assert np.array_equal(frame(), full)


# -- the command -----------------------------------------------------------------------------------


def test_the_command_leaves_a_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--scene", "hedge", "--scene", "village", "--scene", "castle"]
    sizes = ["--instances", "300", "--views", "2", "--castle", str(tmp_path / "none.npz")]
    assert cli.main(["bench", "--occluders", *words, *sizes, "--out", str(tmp_path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told == json.loads((tmp_path / "report.json").read_text())
    assert [scene["key"] for scene in told["scenes"]] == ["hedge", "village"]
    assert "castle is left out" in told["missing"][0]
    (prisms,) = told["scenes"][1]["proxies"]
    assert (prisms["triangles"], prisms["drawn"]) == (576, 432)
    assert 0 < prisms["left"] <= prisms["hidden"] <= 600
    page = (tmp_path / "report.md").read_text()
    assert "| hedge | `select_occluders`, static | 100.0 % |" in page
    assert "| village | `inner_prisms` | 576 | 432 |" in page


def as_printed(
    found: occluders.Report, which: Callable[..., list[list[str]]]
) -> set[tuple[str, ...]]:
    return {tuple(row) for row in which(found)}


@pytest.mark.parametrize(
    "scene",
    ["hedge", "village", "room", *(
        pytest.param(name, marks=pytest.mark.slow)
        for name in ("mountains", "city", "castle", "boulders")
    )],
)  # fmt: skip
def test_the_page_quotes_the_command(tmp_path: Path, scene: str) -> None:
    """If this is red, put the tables of ``hizvk bench --occluders`` into docs/occluders.md."""
    text = documented.page("occluders.md")
    if not documented.is_of_this_driver(text):
        pytest.skip(
            f"docs/occluders.md was printed on another driver than {hizvk.Device().adapter}"
        )
    if scene == "castle" and not CASTLE.exists():
        pytest.skip("the castle is not beside this checkout (../shared/judge)")
    if scene == "mountains" and importlib.util.find_spec("matplotlib") is None:
        pytest.skip("matplotlib, which brings the elevation model, is not installed")
    found = occluders.run(tmp_path, keys=[scene], castle=CASTLE if CASTLE.exists() else None)
    shown = {
        tuple(row.values())
        for head in (("scene", "ranking"), ("scene", "proxies"))
        for row in documented.table(text, *head)
        if row["scene"] == scene
    }
    assert shown == as_printed(found, occluders.cuts) | as_printed(found, occluders.proxies)
