"""What ``hizvk doctor`` looks at, what each finding means, and what to do about it."""

from __future__ import annotations

import ctypes
import importlib.util
import os
import platform
import sys
from dataclasses import dataclass
from glob import glob
from typing import Final

import numpy as np

import hizvk

from . import _core, extras

__all__ = ["DoctorCheck", "checks", "install_hint"]

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

#: How to get a driver, by `sys.platform`.
#: Twin: `INSTALL_HINT` in ``crates/hiz_core/src/headless/adapter.rs``.
INSTALL_HINTS: Final = {
    "win32": "install the driver of the GPU, which brings Vulkan and Direct3D 12",
    "darwin": "Metal is part of macOS; use a session that may use the GPU",
}
LINUX_HINT: Final = "apt install libvulkan1 mesa-vulkan-drivers"

#: What each finding means, by its name.
MEANINGS: Final = {
    "package": "the package that answers here, and how it was compiled",
    "vulkan loader": "the library that finds Vulkan drivers; without it there is no device",
    "vulkan drivers": "the files that name drivers to the loader; it finds no driver without one",
    "adapters": "what a device can be made of, GPUs first; Device(...) or HIZVK_ADAPTER chooses",
    "device": "what is taken where nobody chooses, and the largest depth image that it holds",
    "stage times": "what Device.timed and CullStats.gpu_ms measure with",
    "cull": "a wall hides one of three spheres: upload, pyramid, cull and answer work here",
    "extras": "packages that pictures and ray-cast truth need; a cull needs none of them",
}
#: What to do about a device that gives wrong answers, or none.
ANOTHER: Final = (
    "do not cull on this adapter: choose another by HIZVK_ADAPTER, update its driver, and please "
    "report this with `hizvk info --json`"
)


@dataclass(frozen=True)
class DoctorCheck:
    """One finding of ``hizvk doctor``."""

    name: str
    passed: bool
    detail: str
    """What was found."""
    advice: str = ""
    """What to do; there is advice about whatever did not pass."""

    @property
    def meaning(self) -> str:
        """What the finding is about."""
        return MEANINGS[self.name.partition(" (")[0]]


def checks() -> list[DoctorCheck]:
    """Checks what culling needs, from the bottom up, and stops where the rest cannot work."""
    found = [_package()]
    if sys.platform != "darwin":
        found.append(_loader())
        if not found[-1].passed:
            return found
    # Elsewhere drivers are not registered by files alone.
    if sys.platform not in ("darwin", "win32"):
        found.append(_drivers())
    adapters = hizvk.adapters()
    if not adapters:
        return [*found, DoctorCheck("adapters", False, "none", install_hint())]
    found.append(DoctorCheck("adapters", True, "; ".join(map(str, adapters))))
    try:
        device = hizvk.Device()
    except hizvk.HizError as error:
        advice = "another adapter may work: HIZVK_ADAPTER takes its number or a part of its name"
        if "HIZVK_ADAPTER" in os.environ:
            advice = "HIZVK_ADAPTER has to name one of the adapters"
        return [*found, DoctorCheck("device", False, str(error), advice)]
    slow = "a software driver: answers are right, and a GPU is faster; for one install its driver"
    found.append(
        DoctorCheck(
            "device",
            True,
            f"{device.adapter}, images up to {device.max_image_side} per side",
            slow if device.adapter.device_type == "cpu" else "",
        )
    )
    found += [_try_culling(device, reversed_z) for reversed_z in (True, False)]
    return [*found, _stage_times(device), _extras()]


def install_hint() -> str:
    """How to get a driver on this system."""
    return INSTALL_HINTS.get(sys.platform, LINUX_HINT)


def _package() -> DoctorCheck:
    """Versions, and whether this is a release build."""
    build = _core.__build__
    detail = (
        f"hizvk {hizvk.__version__}, {build} build, Python {platform.python_version()}, "
        f"NumPy {np.__version__}"
    )
    slow = "answers are right, and some calls slower; `make wheel` makes a release build"
    return DoctorCheck("package", True, detail, "" if build == "release" else slow)


def _loader() -> DoctorCheck:
    """Whether the Vulkan loader can be opened; on Windows Direct3D 12 can take its place."""
    loader = LOADERS.get(sys.platform, LINUX_LOADER)
    try:
        ctypes.CDLL(loader)
    except OSError as error:
        if loader == LINUX_LOADER:
            return DoctorCheck("vulkan loader", False, str(error), install_hint())
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
    only = "VK_DRIVER_FILES or VK_ICD_FILENAMES leaves all other drivers out" if chosen else ""
    return DoctorCheck("vulkan drivers", True, ", ".join(files), only)


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
        return DoctorCheck(name, False, str(error), ANOTHER)
    expected = [hizvk.Verdict.VISIBLE, hizvk.Verdict.OCCLUDED, hizvk.Verdict.OUTSIDE]
    words = ", ".join(hizvk.Verdict(code).name.lower() for code in got)
    return DoctorCheck(name, got == expected, words, "" if got == expected else ANOTHER)


def _stage_times(device: hizvk.Device) -> DoctorCheck:
    """Whether the device's timestamps can be trusted."""
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(8, 8), near=0.1)
    with device.timed() as times:
        device.pyramid(np.full(camera.size, 10.0), camera, kind="z")
    if times.gpu_ms is not None:
        return DoctorCheck("stage times", True, "the device's timestamps")
    advice = "gpu_ms is None here, since the driver's timestamps do not fit its work; use wall_ms"
    return DoctorCheck("stage times", True, "the host's clock alone", advice)


def _extras() -> DoctorCheck:
    """Which of the optional packages are there."""
    there: list[tuple[str, str]] = []
    absent: list[tuple[str, str]] = []
    for extra, packages in extras.PACKAGES.items():
        for package in packages:
            (there if importlib.util.find_spec(package) else absent).append((extra, package))
    detail = ", ".join(package for _, package in there) or "none"
    advice = ""
    if absent:
        line = extras.install_line(*dict.fromkeys(extra for extra, _ in absent))
        advice = f"without {', '.join(package for _, package in absent)}: {line}"
    return DoctorCheck("extras", True, detail, advice)
