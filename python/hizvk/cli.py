"""The command line: ``hizvk info | doctor | demo | bench``."""

from __future__ import annotations

import argparse
import ctypes
import dataclasses
import importlib
import importlib.util
import json
import os
import platform
import sys
from glob import glob
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import hizvk

from . import _core

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["main"]

#: The library that the Vulkan loader is, by `sys.platform`.
#: On macOS there is none to look for, because Metal is used.
LOADERS: Final = {"win32": "vulkan-1.dll"}
LINUX_LOADER: Final = "libvulkan.so.1"
#: Where the Vulkan loader looks for drivers on Linux, beside what the environment adds.
DRIVER_FOLDERS: Final = (
    "/etc/vulkan/icd.d",
    "/usr/local/share/vulkan/icd.d",
    "/usr/share/vulkan/icd.d",
)
#: Variables that choose drivers and adapters.
VARIABLES: Final = ("HIZVK_ADAPTER", "VK_DRIVER_FILES", "VK_ICD_FILENAMES", "VK_ADD_DRIVER_FILES")
#: The commands that are packages of their own; each has ``main(arguments) -> exit code``.
DELEGATED: Final = {
    "demo": "the demo scene: culls it, draws it, checks it",
    "bench": "measures speed and error on this machine",
}

#: How to get a driver, by `sys.platform`.
#: Twin: `INSTALL_HINT` in ``crates/hiz_core/src/headless/adapter.rs``.
INSTALL_HINTS: Final = {
    "win32": "install the driver of the GPU, which brings Vulkan and Direct3D 12",
    "darwin": "Metal is part of macOS; use a session that may use the GPU",
}
LINUX_HINT: Final = "apt install libvulkan1 mesa-vulkan-drivers"


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command and returns the exit code.

    0: good; 1: something is wrong; 2: wrong usage.
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    parser = argparse.ArgumentParser(
        prog="hizvk", description="Occlusion culling that never hides what can be seen."
    )
    parser.add_argument("--version", action="version", version=f"hizvk {hizvk.__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="command")
    for name, help_text in (
        ("info", "versions and adapters"),
        ("doctor", "checks that culling works here"),
    ):
        command = commands.add_parser(name, help=help_text, description=help_text)
        command.add_argument("--json", action="store_true", help="print one JSON object")
    for name, help_text in DELEGATED.items():
        commands.add_parser(name, help=help_text, add_help=False)
    if arguments and arguments[0] in DELEGATED:
        # Its own package parses the rest, --help and --json included.
        return _delegate(arguments[0], arguments[1:])
    parsed = parser.parse_args(arguments)
    return _info(parsed.json) if parsed.command == "info" else _doctor(parsed.json)


def _delegate(name: str, arguments: list[str]) -> int:
    """Runs ``hizvk.<name>.main(arguments)``."""
    if importlib.util.find_spec(f"hizvk.{name}") is None:
        print(f"hizvk {name}: not part of this build", file=sys.stderr)
        return 2
    code: int = importlib.import_module(f"hizvk.{name}").main(arguments)
    return code


def information() -> dict[str, Any]:
    """The output of `info` as plain data."""
    return {
        "hizvk": hizvk.__version__,
        "build": _core.__build__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "platform": platform.platform(),
        "environment": {name: os.environ[name] for name in VARIABLES if name in os.environ},
        "adapters": [dataclasses.asdict(adapter) for adapter in hizvk.adapters()],
    }


def _info(as_json: bool) -> int:
    told = information()
    if as_json:
        print(json.dumps(told, indent=2))
        return 0
    for name in ("hizvk", "build", "python", "numpy", "platform"):
        print(f"{name:9} {told[name]}")
    for name, value in told["environment"].items():
        print(f"{name}={value}")
    print("adapters")
    for adapter in told["adapters"]:
        print(f"  {hizvk.Adapter(**adapter)}")
    if not told["adapters"]:
        print(f"  none: {_install_hint()}")
    return 0


@dataclasses.dataclass(frozen=True)
class DoctorCheck:
    """One finding of `doctor`."""

    name: str
    passed: bool
    detail: str
    advice: str = ""


def checks() -> list[DoctorCheck]:
    """Checks what culling needs, from the bottom up, and stops where the rest cannot work."""
    found = [
        DoctorCheck(
            "package", True, f"hizvk {hizvk.__version__}, Python {platform.python_version()}"
        )
    ]
    if sys.platform != "darwin":
        found.append(_loader())
        if not found[-1].passed:
            return found
    # Elsewhere drivers are not registered by files alone.
    if sys.platform not in ("darwin", "win32"):
        found.append(_drivers())
    adapters = hizvk.adapters()
    if not adapters:
        return [*found, DoctorCheck("adapters", False, "none", _install_hint())]
    found.append(DoctorCheck("adapters", True, "; ".join(map(str, adapters))))
    try:
        device = hizvk.Device()
    except hizvk.HizError as error:
        advice = (
            "HIZVK_ADAPTER has to name one of the adapters" if "HIZVK_ADAPTER" in os.environ else ""
        )
        return [*found, DoctorCheck("device", False, str(error), advice)]
    found.append(
        DoctorCheck(
            "device", True, f"{device.adapter}, images up to {device.max_image_side} per side"
        )
    )
    return [*found, *(_try_culling(device, reversed_z) for reversed_z in (True, False))]


def _install_hint() -> str:
    return INSTALL_HINTS.get(sys.platform, LINUX_HINT)


def _loader() -> DoctorCheck:
    """Whether the Vulkan loader can be opened; on Windows Direct3D 12 can take its place."""
    loader = LOADERS.get(sys.platform, LINUX_LOADER)
    try:
        ctypes.CDLL(loader)
    except OSError as error:
        if loader == LINUX_LOADER:
            return DoctorCheck("vulkan loader", False, str(error), _install_hint())
        return DoctorCheck("vulkan loader", True, f"no {loader}; Direct3D 12 is left")
    return DoctorCheck("vulkan loader", True, loader)


def _drivers() -> DoctorCheck:
    """The driver descriptions that the loader reads on Linux."""
    chosen = os.environ.get("VK_DRIVER_FILES") or os.environ.get("VK_ICD_FILENAMES")
    files = chosen.split(os.pathsep) if chosen else []
    if not chosen:
        home = os.environ.get("XDG_DATA_HOME", os.path.expanduser("~/.local/share"))
        folders = (*DRIVER_FOLDERS, os.path.join(home, "vulkan", "icd.d"))
        files = sorted(file for folder in folders for file in glob(os.path.join(folder, "*.json")))
    missing = [file for file in files if not os.path.exists(file)]
    if missing:
        return DoctorCheck(
            "vulkan drivers",
            False,
            f"no such file: {', '.join(missing)}",
            "correct or unset VK_DRIVER_FILES",
        )
    if not files:
        return DoctorCheck("vulkan drivers", False, "no driver description found", LINUX_HINT)
    return DoctorCheck("vulkan drivers", True, ", ".join(files))


def _try_culling(device: hizvk.Device, reversed_z: bool) -> DoctorCheck:
    """A wall at depth 10 before three points: in front of it, behind it, and behind the camera."""
    name = f"cull ({'reversed' if reversed_z else 'standard'} depth)"
    camera = hizvk.Camera.look_at(
        (0.0, 0.0, 0.0),
        (0.0, 0.0, -1.0),
        fov_y_deg=90.0,
        size=(45, 64),
        near=0.1,
        reversed_z=reversed_z,
    )
    wall = np.full(camera.size, 10.0, dtype=np.float32)
    spheres = hizvk.Spheres(np.array([[0.0, 0.0, -5.0], [0.0, 0.0, -20.0], [0.0, 0.0, 20.0]]), 1.0)
    try:
        pyramid = device.pyramid(wall, camera, kind="z")
        got = device.cull(device.instances(spheres), camera, pyramid).verdicts.tolist()
    except (hizvk.HizError, ValueError) as error:
        return DoctorCheck(name, False, str(error))
    expected = [hizvk.Verdict.VISIBLE, hizvk.Verdict.OCCLUDED, hizvk.Verdict.OUTSIDE]
    words = ", ".join(hizvk.Verdict(code).name.lower() for code in got)
    return DoctorCheck(
        name,
        got == expected,
        words,
        "" if got == expected else "please report this with `hizvk info --json`",
    )


def _doctor(as_json: bool) -> int:
    found = checks()
    healthy = all(check.passed for check in found)
    if as_json:
        print(
            json.dumps(
                {"healthy": healthy, "checks": [dataclasses.asdict(check) for check in found]},
                indent=2,
            )
        )
        return 0 if healthy else 1
    for check in found:
        print(f"{'ok  ' if check.passed else 'FAIL'} {check.name}: {check.detail}")
        if check.advice:
            print(f"     {check.advice}")
    return 0 if healthy else 1
