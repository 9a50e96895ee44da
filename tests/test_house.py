"""Modules of the package import in one direction, and `import hizvk` loads only what it needs.

The graph is drawn from the source text (`ast`), so it includes imports for type checkers and those
within functions.
"""

from __future__ import annotations

import ast
import functools
import subprocess
import sys
from pathlib import Path

import pytest

PYTHON = Path(__file__).resolve().parents[1] / "python"


def module_of(path: Path, root: Path) -> str:
    return ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__")


def imports(tree: ast.Module, module: str, is_package: bool, known: set[str]) -> set[str]:
    """The known modules that a module imports, within functions too."""
    found: set[str] = set()
    package = module if is_package else module.rpartition(".")[0]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1]
            base = ".".join([*above, node.module] if node.module else above)
            origin = base if node.level else node.module or ""
            for alias in node.names:
                # `from . import name` is a module where there is one of that name.
                inner = f"{origin}.{alias.name}"
                found.add(inner if inner in known else origin)
    return (found & known) - {module}


def graph(root: Path) -> dict[str, set[str]]:
    """Which modules each module below `root` imports; stubs count as the modules they describe."""
    paths = [*root.rglob("*.py"), *root.rglob("*.pyi")]
    known = {module_of(path, root) for path in paths}
    edges: dict[str, set[str]] = {name: set() for name in known}
    for path in paths:
        name = module_of(path, root)
        tree = ast.parse(path.read_text(encoding="utf-8"))
        edges[name] |= imports(tree, name, path.stem == "__init__", known)
    return edges


@functools.cache
def package() -> dict[str, set[str]]:
    """The graph of the package."""
    return graph(PYTHON)


def circles(edges: dict[str, set[str]]) -> list[list[str]]:
    """The groups of modules that import one another (Tarjan 1972), each sorted."""
    number: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(name: str) -> None:
        number[name] = lowest[name] = len(number)
        stack.append(name)
        for other in sorted(edges[name]):
            if other not in number:
                visit(other)
            if other in stack:
                lowest[name] = min(lowest[name], lowest[other])
        if lowest[name] == number[name]:
            group = stack[stack.index(name) :]
            del stack[stack.index(name) :]
            if len(group) > 1:
                found.append(sorted(group))

    for name in sorted(edges):
        if name not in number:
            visit(name)
    return found


def test_no_circle_of_modules() -> None:
    edges = package()
    assert len(edges) > 40
    assert circles(edges) == []


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        (
            {
                "a.py": "from __future__ import annotations\nfrom .b import x\n",
                "b.py": "if TYPE_CHECKING:\n    from .c import y\n",
                "c.py": "def f():\n    from . import a\n",
                "d.py": "from .a import x\n",
            },
            [["p.a", "p.b", "p.c"]],
        ),
        (
            {"a.py": "import p.sub.b\n", "sub/__init__.py": "", "sub/b.py": "from .. import a\n"},
            [["p.a", "p.sub.b"]],
        ),
        ({"a.py": "from .b import x\n", "b.py": "import os\n", "c.pyi": "from . import a\n"}, []),
    ],
)
def test_the_graph_sees_a_circle(
    tmp_path: Path, files: dict[str, str], expected: list[list[str]]
) -> None:
    for name, text in {"__init__.py": "", **files}.items():
        path = tmp_path / "p" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    assert circles(graph(tmp_path)) == expected


def loaded_by(code: str) -> set[str]:
    """The modules that the code loads in a new process, beside those of NumPy."""
    code = f"import sys, numpy; old = {{*sys.modules}}; {code}; print(*{{*sys.modules}} - old)"
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=60
    )
    return set(done.stdout.split())


def test_an_import_loads_next_to_nothing() -> None:
    """Seconds depend on the machine, so modules are counted: with 70 of them it took 25 ms."""
    loaded = loaded_by("import hizvk")
    ours = {name for name in loaded if name.split(".")[0] == "hizvk"}
    assert ours == {"hizvk", "hizvk._core", "hizvk._processes", "hizvk.errors"}
    assert len(loaded) <= 12, loaded


def test_a_cull_loads_no_tools() -> None:
    """It needs no benchmark, no scenes and no pictures."""
    loaded = loaded_by("import hizvk; hizvk.Device, hizvk.Camera, hizvk.Boxes, hizvk.visible")
    tools = ("recommendation", "measuring", "bench", "demo", "scenes", "commands", "cli", "check")
    strangers = {
        name
        for name in loaded
        if name.split(".")[0] in ("matplotlib", "embreex", "PIL", "scipy", "trimesh")
        or (name.startswith("hizvk.") and name.split(".")[1] in (*tools, "occluders", "methods"))
    }
    assert "hizvk.device" in loaded
    assert not strangers


def test_nothing_uses_the_methods() -> None:
    """The texts' algorithms stand beside the package: its lazy names and entries lead to them.

    `Device.occlusion_map` and `Device.cull_map` are entries of their own, and the bench compares.
    """
    users = {
        name
        for name, imported in package().items()
        if not name.startswith(("hizvk.methods", "hizvk.bench"))
        and any(module.startswith("hizvk.methods") for module in imported)
    }
    assert users <= {"hizvk", "hizvk.device"}


def test_every_public_name_is_there_when_it_is_asked_for() -> None:
    code = (
        "import hizvk; names = [getattr(hizvk, name) for name in hizvk.__all__]; "
        "assert {*hizvk.__all__} <= {*dir(hizvk)}; "
        "assert hizvk.camera.Camera is hizvk.Camera; "
        "assert not hasattr(hizvk, 'no_such_name')"
    )
    loaded_by(code)


def test_recommend_comes_when_it_is_asked_for() -> None:
    code = (
        "import hizvk; assert 'recommend' in dir(hizvk); "
        # A worker of a sweep imports its module before it has used the function.
        "import hizvk.sweeping.workers; assert callable(hizvk.sweep); "
        "print(hizvk.recommend.__name__, hizvk.Recommendation.__name__); "
        "from hizvk import *; print(recommend is hizvk.recommend)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=60
    )
    assert done.stdout.split() == ["recommend", "Recommendation", "True"]


def test_the_oracle_has_its_public_name() -> None:
    code = (
        "import hizvk.reference as r; from hizvk.check import reference as s; "
        "print(r.classify is s.classify)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=60
    )
    assert done.stdout.split() == ["True"]
