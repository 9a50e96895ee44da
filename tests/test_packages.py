"""What an installed package says and finds: extras, licences of its parts, other systems."""

from __future__ import annotations

import base64
import ctypes
import hashlib
import importlib.util
import json
import os
import re
import sys
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hizvk
from hizvk import cli, doctor, extras

ROOT = Path(__file__).resolve().parents[1]


def script(name: str) -> Any:
    """A module of scripts/, which is not a package."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "scripts" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


inspect_wheel, same_lock = script("inspect_wheel"), script("same_lock")
stable_sbom = script("stable_sbom")


# -- extras ----------------------------------------------------------------------------------------


def settings() -> dict[str, Any]:
    found: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    return found


def test_the_extras_are_those_of_the_project() -> None:
    declared = {
        extra: tuple(re.split(r"[ <>=!~;\[]", one)[0] for one in packages)
        for extra, packages in settings()["project"]["optional-dependencies"].items()
    }
    for extra, packages in extras.PACKAGES.items():
        assert declared[extra] == packages


class Installed:
    """What importlib.metadata tells of hizvk: where pip says that it came from."""

    def __init__(self, url: str | None) -> None:
        self.url = url

    def read_text(self, name: str) -> str | None:
        assert name == "direct_url.json"
        return None if self.url is None else json.dumps({"url": self.url, "archive_info": {}})


def advised(monkeypatch: pytest.MonkeyPatch, url: str | None) -> str:
    monkeypatch.setattr(metadata, "distribution", lambda _: Installed(url))
    return extras.install_line("viz", "scene")


def test_a_wheel_that_is_still_there_takes_the_extras(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    wheel = tmp_path / "with space" / "hizvk-0.1.0-cp311-abi3-any.whl"
    wheel.parent.mkdir()
    wheel.touch()
    assert advised(monkeypatch, wheel.as_uri()) == f"pip install '{wheel}[viz,scene]'"
    wheel.unlink()
    assert advised(monkeypatch, wheel.as_uri()) == "pip install matplotlib embreex"


@pytest.mark.parametrize("url", [None, ROOT.as_uri(), "https://example.org/hizvk-0.1.0.whl"])
def test_elsewhere_the_packages_are_named(monkeypatch: pytest.MonkeyPatch, url: str | None) -> None:
    assert advised(monkeypatch, url) == "pip install matplotlib embreex"


def test_without_metadata_the_packages_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(_: str) -> Any:
        raise metadata.PackageNotFoundError("hizvk")

    monkeypatch.setattr(metadata, "distribution", nothing)
    assert extras.install_line("viz") == "pip install matplotlib"


# -- the wheel -------------------------------------------------------------------------------------


def sbom(**changes: Any) -> dict[str, Any]:
    one = {
        "name": "wgpu",
        "bom-ref": "registry+https://github.com/rust-lang/crates.io-index#wgpu",
        "version": locked("wgpu"),
        "licenses": [{"expression": "MIT OR Apache-2.0"}],
    }
    parts = [{**one, "name": name, "version": locked(name)} for name in inspect_wheel.PARTS]
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "metadata": {"component": {"bom-ref": "path+file:///crates/hiz_py#0.1.0"}},
        "components": parts,
    } | changes


LOCK = tomllib.loads((ROOT / "Cargo.lock").read_text(encoding="utf-8"))["package"]


def locked(name: str) -> str:
    return next(str(one["version"]) for one in LOCK if one["name"] == name)


def test_a_bill_of_materials_names_locked_crates_with_licences() -> None:
    inspect_wheel.check_sbom(sbom())
    bad = {
        "format": sbom(bomFormat="SPDX"),
        "missing": sbom(components=sbom()["components"][1:]),
        "not in Cargo.lock": sbom(
            components=[{**each, "version": "0.0.1"} for each in sbom()["components"]]
        ),
        "a build's folder": sbom(
            metadata={"component": {"bom-ref": "path+file:///tmp/t/crates/hiz_py#0.1.0"}}
        ),
        "no licence": sbom(components=[{**each, "licenses": []} for each in sbom()["components"]]),
    }
    for why, planted in bad.items():
        with pytest.raises(AssertionError, match=why):
            inspect_wheel.check_sbom(planted)


@pytest.mark.parametrize(
    "folder", ["/tmp/tmp.iKR0TP2vAh/hizvk-0.1.0", "/D:/a/hizvk/hizvk", "/home/crates/my%20own"]
)
def test_a_bill_of_materials_does_not_tell_where_it_was_built(tmp_path: Path, folder: str) -> None:
    names = ["hiz_core", "hiz_py"]
    refs = [f"path+file://{folder}/crates/{name}#0.1.0" for name in names]
    bill = {
        "metadata": {"component": {"bom-ref": refs[1]}},
        "components": [{"bom-ref": refs[0]}, {"bom-ref": "registry+https://x#wgpu@30.0.1"}],
        "dependencies": [{"ref": refs[1], "dependsOn": [refs[0]]}],
    }
    path = tmp_path / "hizvk-0.1.0-cp311-abi3-win_amd64.whl"
    info = "hizvk-0.1.0.dist-info"
    others = {"hizvk/__init__.py": b"x = 1\n", f"{info}/WHEEL": b"Tag: cp311-abi3-win_amd64\n"}
    at = f"{info}/sboms/hiz_py.cyclonedx.json"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as wheel:
        for name, content in others.items():
            wheel.writestr(name, content)
        wheel.writestr(at, json.dumps(bill))
        wheel.writestr(f"{info}/RECORD", f"hizvk/__init__.py,sha256=a,6\n{at},sha256=b,9\n")
    stable_sbom.main(str(path))
    stable_sbom.main(str(path))  # once more changes nothing
    with zipfile.ZipFile(path) as wheel:
        assert wheel.testzip() is None
        assert wheel.namelist() == [*others, at, f"{info}/RECORD"]
        for name, content in others.items():
            assert wheel.read(name) == content
        written = wheel.read(at)
        record = wheel.read(f"{info}/RECORD").decode().splitlines()
    found = json.loads(written)
    core, py = (f"path+file:///crates/{name}#0.1.0" for name in names)
    assert found["metadata"]["component"]["bom-ref"] == py
    assert found["components"][0]["bom-ref"] == core
    assert found["dependencies"] == [{"ref": py, "dependsOn": [core]}]
    digest = base64.urlsafe_b64encode(hashlib.sha256(written).digest()).decode().rstrip("=")
    assert record == ["hizvk/__init__.py,sha256=a,6", f"{at},sha256={digest},{len(written)}"]


def test_actions_are_named_by_hash() -> None:
    """A tag can be moved to another commit; the version is for people."""
    found: dict[str, set[str]] = {}
    for path in sorted((ROOT / ".github" / "workflows").glob("*.yml")):
        for line in path.read_text(encoding="utf-8").splitlines():
            name, is_one, rest = line.partition("uses: ")
            if not is_one or name.strip() not in ("", "-"):
                continue
            pinned = re.fullmatch(r"([\w-]+/[\w-]+)@([0-9a-f]{40} # v\d+\.\d+\.\d+)", rest)
            assert pinned, f"{path.name}: expected NAME@HASH # vX.Y.Z, got {rest}"
            found.setdefault(pinned[1], set()).add(pinned[2])
    assert len(found) >= 4
    assert all(len(versions) == 1 for versions in found.values()), found


def test_a_wheel_without_a_bill_of_materials_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "hizvk-0.1.0-cp311-abi3-manylinux_2_28_x86_64.whl"
    with zipfile.ZipFile(path, "w") as wheel:
        wheel.writestr("hizvk-0.1.0.dist-info/WHEEL", "Tag: cp311-abi3-manylinux_2_28_x86_64\n")
    with zipfile.ZipFile(path) as wheel, pytest.raises(AssertionError, match="bill of materials"):
        inspect_wheel.sbom_of(wheel, "hizvk-0.1.0.dist-info")


@pytest.mark.parametrize(
    ("platform", "good"),
    [
        ("manylinux_2_28_x86_64", True),
        ("manylinux_2_28_aarch64", True),
        ("manylinux_2_17_x86_64", False),
        ("manylinux_2_34_x86_64", False),
        ("linux_x86_64", False),
        ("macosx_11_0_arm64", True),
        ("win_amd64", True),
    ],
)
def test_tags_of_platforms(platform: str, good: bool) -> None:
    assert inspect_wheel.is_known(platform) == good


def test_a_lock_file_with_a_stranger_is_refused(tmp_path: Path) -> None:
    part = tmp_path / "Cargo.lock"
    whole = str(ROOT / "Cargo.lock")
    packages = (ROOT / "Cargo.lock").read_text(encoding="utf-8").split("\n[[package]]")
    part.write_text("\n[[package]]".join(packages[:9]), encoding="utf-8")
    same_lock.main(whole, str(part))
    part.write_text(
        "\n[[package]]".join([*packages[:9], '\nname = "stranger"\nversion = "1.0.0"\n']),
        encoding="utf-8",
    )
    with pytest.raises(SystemExit, match=r"stranger 1\.0\.0"):
        same_lock.main(whole, str(part))


# -- other systems ---------------------------------------------------------------------------------


def test_arrays_are_copied_where_the_system_tells_nothing_of_its_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Windows has no `os.sysconf`, and an array that is not contiguous has to be copied."""
    monkeypatch.delattr(os, "sysconf", raising=False)
    centers = np.arange(24.0).reshape(4, 6)[:, ::2]
    assert not centers.flags.c_contiguous
    assert hizvk.Spheres(centers, 1.0).centers.tolist() == centers.tolist()


def names_of_checks(monkeypatch: pytest.MonkeyPatch, system: str, loader: bool) -> dict[str, bool]:
    """The checks of `hizvk doctor`, as if this system were another one."""
    opened = []

    def load(name: str) -> None:
        opened.append(name)
        if not loader:
            raise OSError(f"{name}: not found")

    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(ctypes, "CDLL", load)
    found = {check.name: check.passed for check in doctor.checks()}
    assert opened == {"darwin": [], "win32": ["vulkan-1.dll"]}.get(system, ["libvulkan.so.1"])
    return found


@pytest.mark.parametrize("loader", [True, False])
def test_doctor_asks_for_what_a_system_has(monkeypatch: pytest.MonkeyPatch, loader: bool) -> None:
    on_macos = names_of_checks(monkeypatch, "darwin", loader)
    assert not any(name.startswith("vulkan") for name in on_macos)
    on_windows = names_of_checks(monkeypatch, "win32", loader)
    # Direct3D 12 is left where the loader is not.
    assert on_windows["vulkan loader"]
    assert "vulkan drivers" not in on_windows
    for found in (on_macos, on_windows):
        assert found["device"]
        assert found["cull (reversed depth)"]
    on_linux = names_of_checks(monkeypatch, "linux", loader)
    assert on_linux["vulkan loader"] == loader
    assert ("device" in on_linux) == loader


@pytest.mark.parametrize(
    ("system", "word"), [("linux", "apt"), ("darwin", "Metal"), ("win32", "Direct3D 12")]
)
def test_advice_fits_the_system(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], system: str, word: str
) -> None:
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(ctypes, "CDLL", lambda _: None)
    monkeypatch.setattr(hizvk, "adapters", list)
    assert cli.main(["doctor"]) == 1
    assert word in capsys.readouterr().out
    rust = (ROOT / "crates/hiz_core/src/headless/adapter.rs").read_text(encoding="utf-8")
    assert word in rust


def test_other_backends_are_built_where_vulkan_is_not_there() -> None:
    manifest = tomllib.loads((ROOT / "crates/hiz_py/Cargo.toml").read_text(encoding="utf-8"))
    extra = {
        target: each["dependencies"]["hiz_core"]["features"]
        for target, each in manifest["target"].items()
    }
    assert extra == {
        'cfg(target_vendor = "apple")': ["metal"],
        "cfg(windows)": ["dx12"],
    }


# -- the workflows ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["ci.yml", "wheels.yml"])
def test_what_a_workflow_calls_is_there(name: str) -> None:
    """actionlint knows GitHub's side; this is ours."""
    text = (ROOT / ".github" / "workflows" / name).read_text(encoding="utf-8")
    code = "\n".join(line.partition("#")[0] for line in text.splitlines())
    for path in re.findall(r"(?:scripts|\.ci)/[\w.]+", code):
        assert (ROOT / path).is_file(), path
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    assert set(re.findall(r"run: make ([a-z-]+)", code)) <= set(targets)
    # The compiler is not older than what the crates need.
    least = tomllib.loads((ROOT / "Cargo.toml").read_text("utf-8"))["workspace"]["package"]
    found = re.findall(r"rust:(\d+)\.(\d+)|rust-toolchain: \"(\d+)\.(\d+)\"", code)
    assert found
    for version in found:
        numbers = [int(part) for part in version if part]
        assert numbers >= [int(part) for part in least["rust-version"].split(".")]


def test_every_push_runs_the_checks_and_each_day_the_second_driver() -> None:
    text = (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
    events, jobs = text.split("\njobs:\n")
    assert re.search(r"^  push:$", events, re.MULTILINE)
    assert re.search(r"^    - cron: \"\d+ \d+ \* \* \*\"$", events, re.MULTILINE)
    assert "bash .ci/run" in jobs.partition("\n  swiftshader:")[0]
    assert "make test-swiftshader" in jobs.partition("\n  swiftshader:")[2]
