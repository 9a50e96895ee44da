"""Fresh processes up to their first mask, with the driver's shader cache cold and warm."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from .figures import FirstCall

if TYPE_CHECKING:
    from .run import Run

__all__ = ["measure"]

#: Where Mesa keeps compiled shaders; other drivers have their own ways, and for them cold is what it is.
CACHE: Final = "MESA_SHADER_CACHE_DIR"
#: Seconds that a first mask may take.
TARGETS: Final = {"cold": 3.0, "warm": 1.0}

#: Prints seconds: import (numpy and hizvk), device, the first and the second way to a mask. Reading the scene is not
#: counted.
CHILD: Final = """
import json, sys, time
start = time.perf_counter()
import numpy as np
after_numpy = time.perf_counter()
scene = np.load(sys.argv[1])
arrays = [scene[name] for name in ("low", "high", "vertices", "triangles")]
loaded = time.perf_counter()
import hizvk
imported = time.perf_counter()
device = hizvk.Device()
opened = time.perf_counter()

def way():
    low, high, vertices, triangles = arrays
    camera = hizvk.Camera.look_at((0, 0, 2), (0, 100, 2), up=(0, 0, 1), fov_y_deg=60, size=(1080, 1920), near=0.125)
    depth = device.render_depth(device.occluders(vertices, triangles), camera)
    return device.cull(device.instances(hizvk.Boxes(low, high)), camera, device.pyramid(depth)).mask

way()
first = time.perf_counter()
way()
second = time.perf_counter()
print(json.dumps([after_numpy - start + imported - loaded, opened - imported, first - opened, second - first]))
"""


def measure(run: Run) -> None:
    """`Extent.calls` boxes: enough for the cull with groups."""
    if run.extent.processes == 0:
        run.found.notes.append("the first calls of fresh processes were left out")
        return
    scene = run.town(run.extent.calls, 0.95)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "town.npz"
        np.savez(
            file, low=scene.low, high=scene.high, vertices=scene.vertices, triangles=scene.triangles
        )
        told: dict[str, list[list[float]]] = {"cold": [], "warm": []}
        for number in range(run.extent.processes):
            cache = Path(folder) / f"cache{number}"
            cache.mkdir()
            for state in ("cold", "warm"):
                run.step(f"a fresh process, {state}")
                told[state].append(_process(file, cache))
    for state in ("cold", "warm"):
        seconds = np.median(told[state], axis=0)
        call = FirstCall(state, *map(float, seconds))  # type: ignore[arg-type]
        run.found.first_calls.append(call)
        run.found.number(
            f"first_call.{state}",
            f"first mask of a fresh process, shader cache {state}",
            call.total_s,
            "s",
            TARGETS[state],
        )
    if "Mesa" not in run.device.adapter.driver_info:
        run.found.notes.append(
            f"{CACHE} is Mesa's: whether the driver's cache was cold in the first calls is not known"
        )


def _process(file: Path, cache: Path) -> list[float]:
    environment = os.environ | {CACHE: str(cache), "MESA_SHADER_CACHE_DISABLE": "false"}
    ran = subprocess.run(
        [sys.executable, "-c", CHILD, str(file)],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    seconds: list[float] = json.loads(ran.stdout)
    return seconds
