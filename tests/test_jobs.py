"""The jobs of docs/jobs/: their data, their pages, and their figures."""

from __future__ import annotations

import ast
import contextlib
import importlib.util
import io
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import documented
import hizvk
from documented import page
from hizvk.scenes.embree import embree_scene
from tools.jobs import cloud, driving, model

if TYPE_CHECKING:
    from collections.abc import Collection

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT / "examples" / "data"


def load(path: Path) -> Any:
    """A module of a folder that is no package."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_data_are_what_their_script_makes() -> None:
    """If this is red, run scripts/example_data.py."""
    made = load(ROOT / "scripts" / "example_data.py").files()
    assert {path.name: path.read_text(encoding="utf-8") for path in DATA.iterdir()} == made


def test_labels_may_be_few(tmp_path: Path) -> None:
    """A frame without objects, a result file with scores, and a region that is left out."""
    example = load(ROOT / "examples" / "driving_boxes.py")
    path = tmp_path / "label.txt"
    ignored = "DontCare -1 -1 -10 1 2 3 4 -1 -1 -1 -1000 -1000 -1000 -10"
    for lines, count in (([], 0), ([ignored], 0)):
        path.write_text("\n".join(lines), encoding="utf-8")
        names, levels, boxes = example.read_labels(path)
        assert len(names) == len(levels) == len(boxes) == count
    car = "Car 0.00 0 -1.58 10 10 20 20 1.50 1.60 4.00 1.00 1.70 20.00 0.00 0.99"
    path.write_text(f"{ignored}\n{car}\n", encoding="utf-8")
    names, _, boxes = example.read_labels(path)
    assert names == ["Car"]
    # Length along x, height along y (down), width along z; the location is on the ground.
    assert boxes.half_sizes.tolist() == [[2.0, 0.75, 0.8]]
    assert np.allclose(boxes.centers, [[1.0, 0.95, 20.0]])


def test_cityjson_may_be_of_other_kinds(tmp_path: Path) -> None:
    """Surfaces without a solid or a transform, several levels of detail, holes and corners."""
    example = load(ROOT / "examples" / "model_visibility.py")
    path = tmp_path / "some.city.json"
    square, angle = [0, 1, 2, 3], [0, 1, 4, 3]
    fine = {"type": "MultiSurface", "lod": "2", "boundaries": [[square], [angle], [square, angle]]}
    coarse = {"type": "Solid", "lod": 1.2, "boundaries": [[[square]]]}
    point = {"type": "MultiPoint", "lod": "3", "boundaries": [0]}
    model = {
        "type": "CityJSON",
        "CityObjects": {
            "part": {"type": "BuildingPart", "geometry": [fine, point, coarse]},
            "parent": {"type": "Building"},
        },
        "vertices": [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [1, 1, 0]],
    }
    path.write_text(json.dumps(model), encoding="utf-8")
    names, surfaces = example.read_surfaces(path)
    assert names == ["part"] * 3
    assert [len(rings) for rings in surfaces] == [1, 1, 2]
    # The square is a fan; the angle, whose corner turns inwards, and the hole are none.
    assert [len(example.fan(rings)) for rings in surfaces] == [2, 0, 0]


def test_the_gallery_has_a_command_for_each_picture() -> None:
    """Every picture of a job is drawn by one name of scripts/gallery.py, or by the renderer."""
    parts = re.split(r"^## ", page("gallery.md"), flags=re.MULTILINE)[1:]
    shown = []
    for part in parts:
        (picture,) = re.findall(r"\]\(images/(\w+)\.png\)", part)
        assert re.search(r"^```sh\n.+?^```$", part, re.MULTILINE | re.DOTALL), part
        if picture.startswith("job_"):
            name = picture.removeprefix("job_")
            assert f"gallery.py {name}" in part or f"images/{picture}.png\n```" in part, part
        shown.append(picture)
    jobs = {path.stem for path in (ROOT / "docs" / "images").glob("job_*.png")}
    assert jobs <= set(shown)
    drawn = re.findall(
        r"^    \"(\w+)\": ", (ROOT / "scripts" / "gallery.py").read_text(), re.MULTILINE
    )
    assert jobs == {f"job_{name}" for name in drawn} | {"job_renderer"}


def test_the_list_of_examples_is_whole() -> None:
    """Each script with the first line of its text; if this is red, write it into the list."""
    text = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    listed = dict(re.findall(r"^- \[(.+?)\]\(\1\): (.+(?:\n  .+)*)", text, re.MULTILINE))
    files = {path.name: path for path in (ROOT / "examples").glob("*.*") if path.suffix != ".md"}
    assert sorted(listed) == sorted(files)
    for name, path in files.items():
        if path.suffix == ".py":
            about = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
            assert about is not None
            assert " ".join(listed[name].split()).startswith(about.splitlines()[0]), name


JOBS = ("driving", "points", "models", "renderer", "class")


def test_each_job_has_a_page_and_an_example() -> None:
    """A page opens with whom it is for, and its first section is a first answer."""
    assert sorted(path.stem for path in (ROOT / "docs" / "jobs").glob("*.md")) == sorted(JOBS)
    for name in JOBS:
        text = page(f"jobs/{name}.md")
        assert re.match(r"# .+\n\nThis page is for ", text), name
        assert re.findall(r"^## (.+)$", text, re.MULTILINE)[0] == "The first answer", name
        assert "## Beside what is used today" in text, name
        shown = re.findall(r"examples?[/ ]([\w.]+)", text)
        there = [*ROOT.glob("examples/*"), *ROOT.glob("crates/hiz_core/examples/*")]
        assert any(path.name in shown for path in there), name


def test_the_renderer_is_as_long_as_its_page_says() -> None:
    folder = ROOT / "crates" / "hiz_core" / "examples" / "drop_in"
    for row in documented.table(page("jobs/renderer.md"), "file", "lines"):
        text = (folder / row["file"].strip("`")).read_text(encoding="utf-8")
        assert len(text.splitlines()) == int(row["lines"]) <= 100, row


def columns(rows: list[dict[str, str]], names: Collection[str]) -> list[list[str]]:
    """Some columns of a table, row by row."""
    return [[row[name] for name in names] for row in rows]


def is_comparable(name: str) -> bool:
    """Whether counts of this driver and the page's have to agree."""
    return documented.is_of_this_driver(page("bench.md")) and name != "Open3D, a ray per pixel"


def test_the_page_of_boxes_has_todays_counts() -> None:
    """If this is red, run ``python -m tools.jobs driving --write``."""
    rows = documented.table(page("jobs/driving.md"), "way", "missed")
    pytest.importorskip("numba", reason="one of the ways needs it")
    found = driving.accuracy(hizvk.Device())
    assert [row[0] for row in found] == [row["way"] for row in rows]
    # Nothing that shows is lost, on any driver; ways of the host are the same everywhere.
    for row in found:
        assert row[1] == "0" or row[0] == "corners, NumPy", row
    shown = columns(rows, ("way", "missed", "kept in vain", "error of fraction"))
    if is_comparable(""):
        assert found == shown


def test_the_page_of_points_has_todays_counts() -> None:
    """If this is red, run ``python -m tools.jobs cloud --write``."""
    pytest.importorskip("embreex", reason="the truth is cast by embreex")
    rows = documented.table(page("jobs/points.md"), "way", "missed")
    found = cloud.accuracy(hizvk.Device(), cloud.FEW)
    assert found[-1][:2] == ["the same with conservative depth", "0"]
    names = ("way", "missed", "of visible", "kept in vain", "of hidden")
    if is_comparable(""):
        assert found == columns(rows, names)


@pytest.mark.slow
def test_the_page_of_models_has_todays_counts() -> None:
    """If this is red, run ``python -m tools.jobs model --write``."""
    pytest.importorskip("embreex", reason="the truth is cast by embreex")
    rows = documented.table(page("jobs/models.md"), "way", "found")
    shown = {row[0]: row for row in columns(rows, ("way", "found", "missed", "kept in vain"))}
    for row in model.accuracy(model.town(), model.MANY_RAYS):
        if is_comparable(row[0]):
            assert row == shown[row[0]]


def test_nothing_that_a_ray_sees_is_lost_in_the_town() -> None:
    """The conservative sweep of the page keeps all that rays see from its places."""
    pytest.importorskip("embreex", reason="the truth is cast by embreex")
    of = model.town()
    origin = of.places.mean(axis=0)
    scene = embree_scene([(of.vertices - origin, of.triangles)])
    shown = model.seen_by_targets(of, scene, origin, 100)
    kept = model.ways(of)["hizvk, conservative"]()
    assert shown.any(axis=1).all()
    assert not (shown & ~kept).any()
    # It culls: about half of the surfaces, which no ray finds.
    assert 0.3 < kept.mean() < 0.7


def test_a_glb_file_hides_what_the_page_says(tmp_path: Path) -> None:
    """The house of the page by way of a file, whose node turns and moves it."""
    trimesh = pytest.importorskip("trimesh", reason="it writes and reads the file")
    house = trimesh.creation.box(extents=(3.0, 4.0, 4.0))
    place = np.array([[0.0, -1, 0, 0], [1, 0, 0, 1.5], [0, 0, 1, -10], [0, 0, 0, 1]])
    scene = trimesh.Scene()
    scene.add_geometry(house, transform=place)
    scene.export(tmp_path / "house.glb")
    read = trimesh.load(tmp_path / "house.glb", force="scene").to_mesh()
    things = hizvk.Spheres([(0.0, 1.0, -16.0), (0.0, 5.0, -16.0), (9.0, 1.0, 0.0)], 0.5)
    cameras = hizvk.cube((0.0, 1.7, 0.0), size=256, near=0.1)
    seen = hizvk.sweep(things, cameras, occluders=read, conservative=True, groups=[0] * 6)
    assert seen.mask(0).tolist() == [False, True, True]


LESSON = ROOT / "examples" / "lesson.ipynb"


def cells(kind: str) -> list[str]:
    """The text of each cell of the lesson of one kind."""
    notebook = json.loads(LESSON.read_text(encoding="utf-8"))
    assert notebook["nbformat"] == 4
    return ["".join(each["source"]) for each in notebook["cells"] if each["cell_type"] == kind]


def run_as_a_notebook(sources: list[str]) -> tuple[str, list[object]]:
    """What cells print, and the values that they end with, as a notebook shows both."""
    names: dict[str, Any] = {"__name__": "__main__"}
    shown = []
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        for number, source in enumerate(sources):
            body = ast.parse(source).body
            last = body.pop() if isinstance(body[-1], ast.Expr) else None
            exec(compile(ast.Module(body, []), f"cell {number}", "exec"), names)
            if isinstance(last, ast.Expr):
                value = eval(compile(ast.Expression(last.value), f"cell {number}", "eval"), names)
                if value is not None:
                    shown.append(value)
    return printed.getvalue(), shown


def test_the_lesson_has_no_outputs() -> None:
    """They would be those of another version."""
    for each in json.loads(LESSON.read_text(encoding="utf-8"))["cells"]:
        assert not each.get("outputs")
        assert each.get("execution_count") is None
    assert max(len(line) for text in cells("markdown") for line in text.splitlines()) <= 100


def test_the_lesson_runs() -> None:
    """Its pyramid is the device's, its own cull has false culls, and that of hizvk has none."""
    printed, shown = run_as_a_notebook(cells("code"))
    wrong = {
        name.strip(): int(count)
        for name, count in re.findall(r"^([a-z ]+): .* (\d+) wrongly culled", printed, re.MULTILINE)
    }
    assert set(wrong) == {"by hand", "hizvk", "with means"}
    assert wrong["hizvk"] == 0
    assert 0 < wrong["by hand"] < wrong["with means"]
    assert [type(each) for each in shown] == [hizvk.Pyramid, hizvk.CullResult, hizvk.Explanation]
    for value in shown:
        picture: Any = value
        assert picture._repr_html_() or picture._repr_png_()


@pytest.mark.slow
def test_the_lesson_runs_in_jupyter() -> None:
    """As a reader runs it; `pip install nbclient ipykernel` brings what it needs."""
    pytest.importorskip("ipykernel", reason="pip install nbclient ipykernel")
    nbclient = pytest.importorskip("nbclient", reason="pip install nbclient ipykernel")
    nbformat = importlib.import_module("nbformat")
    notebook = nbformat.read(LESSON, as_version=4)
    nbformat.validate(notebook)
    nbclient.NotebookClient(notebook, timeout=300).execute()
    assert "0 wrongly culled" in json.dumps(notebook)
