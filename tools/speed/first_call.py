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

#: The variable that names Mesa's folder of compiled shaders.
#: Other drivers have their own ways; with them nobody knows whether the cache is cold.
CACHE: Final = "MESA_SHADER_CACHE_DIR"
#: Seconds that a first mask may take.
TARGETS: Final = {"cold": 3.0, "warm": 1.0}

#: What each process runs.
CHILD: Final = Path(__file__).with_name("first_mask.py")
#: And to compare first frames with and without a warm-up.
FRAMES: Final = Path(__file__).with_name("first_frame.py")
#: Milliseconds that a `record_*` call of the first frame after a warm-up may take.
FRAME_TARGET: Final = 2.0


def measure(run: Run) -> None:
    """Measures `Workload.calls` boxes, which is enough for the cull with groups."""
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
        frames: dict[str, list[list[float]]] = {"warmed": [], "unwarmed": []}
        for number in range(run.extent.processes):
            cache = Path(folder) / f"cache{number}"
            cache.mkdir()
            for state in ("cold", "warm"):
                run.step(f"a fresh process, {state}")
                told[state].append(_process(CHILD, file, cache))
            for kind, some in frames.items():
                run.step(f"a fresh process, its first frame {kind}")
                fresh = Path(folder) / f"{kind}{number}"
                fresh.mkdir()
                some.append(_process(FRAMES, file, fresh, kind))
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
    for kind, some in frames.items():
        numbers = [float(ms) for ms in np.median(some, axis=0)]
        warm_up, longest, on_device, later_longest, later_on_device = numbers
        of = {"warmed": "after a warm-up", "unwarmed": "without a warm-up"}[kind]
        tell = run.found.number
        if kind == "warmed":
            tell("first_frame.warm_up", "warm-up, shader cache cold", warm_up, "ms")
            tell("first_frame.later.call", "longest record call, later", later_longest, "ms")
            tell("first_frame.later.device", "a later frame, device", later_on_device, "ms")
        tell(
            f"first_frame.{kind}.call",
            f"longest record call of the first frame, {of}",
            longest,
            "ms",
            FRAME_TARGET if kind == "warmed" else None,
        )
        tell(f"first_frame.{kind}.device", f"first frame {of}, device", on_device, "ms")
    if "Mesa" not in run.device.adapter.driver_info:
        run.found.notes.append(
            f"{CACHE} is Mesa's: it is not known whether the driver's cache was cold in the first "
            "calls"
        )


def _process(child: Path, file: Path, cache: Path, *arguments: str) -> list[float]:
    environment = os.environ | {CACHE: str(cache), "MESA_SHADER_CACHE_DISABLE": "false"}
    ran = subprocess.run(
        # -P: its folder is not on the path
        [sys.executable, "-P", str(child), str(file), *arguments],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    seconds: list[float] = json.loads(ran.stdout)
    return seconds
