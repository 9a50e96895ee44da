"""Bytes on the device against what is stored, and the peak on the host against the input."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from .run import Run

__all__ = ["measure"]

#: Bytes of a box's record on the device, as hiz_core stores it.
BOX_RECORD: Final = 48
#: Bytes of a box as it was given, in float32.
BOX_GIVEN: Final = 24
#: What the cull makes: mask, indices and draws.
OUTPUTS: Final = (True, False, True, True)

#: The checkout, from which children import this package.
ROOT: Final = Path(__file__).resolve().parents[2]


def measure(run: Run) -> None:
    """Measures `Workload.crowd` boxes with the first depth image."""
    run.step("memory")
    _device(run)
    _host(run)


def _device(run: Run) -> None:
    scene = run.town(run.extent.crowd, 0.95)
    depth = run.depth(scene, run.extent.images[0][1])
    pyramid, boxes = run.device.pyramid(depth), run.device.instances(scene.boxes)
    cull = run.cull(boxes, depth.camera, pyramid, groups=True, order="stable", outputs=OUTPUTS)
    cull.ms()  # makes what is made at its first use
    image = 4 * depth.size[0] * depth.size[1]
    texels = sum(level.size for level in map(pyramid.level, pyramid.levels))
    used = boxes.device_bytes + pyramid.device_bytes + image + cull.device_bytes()
    count = len(boxes)
    leaves = image + 4 * texels + count // 8 + 4 * count + 20
    found = run.found
    found.number(
        "memory.device",
        f"{count:,} boxes, device / (stored bounds, depth, levels, outputs)",
        used / (BOX_RECORD * count + leaves),
        "x",
        1.5,
    )
    found.number(
        "memory.device_given",
        "the same with the bounds as given, float32",
        used / (BOX_GIVEN * count + leaves),
        "x",
    )
    for name, bytes_ in (
        ("instances", boxes.device_bytes),
        ("pyramid", pyramid.device_bytes),
        ("outputs", cull.device_bytes()),
    ):
        found.number(f"memory.{name}", f"{count:,} boxes, device: {name}", bytes_ / 2**20, "MiB")


def _host(run: Run) -> None:
    count = 4 * run.extent.crowd
    for order, name in (("morton", "Morton"), ("given", "given")):
        ran = subprocess.run(
            [sys.executable, "-m", "tools.speed.host_peak", str(count), str(run.seed), order],
            capture_output=True,
            text=True,
            check=False,
            cwd=ROOT,
        )
        if ran.returncode != 0:
            reason = (ran.stderr.strip().splitlines() or ["?"])[-1]
            run.found.notes.append(f"the peak of the host's memory was left out: {reason}")
            return
        peak, device_bytes, host_bytes, piece = json.loads(ran.stdout)
        # A software driver's device is the host.
        # What the device keeps is taken off then, or it would be counted twice.
        on_host = run.device.adapter.device_type == "cpu"
        beyond = peak - host_bytes - (device_bytes if on_host else 0)
        run.found.number(
            f"memory.host.{order}",
            f"{count:,} boxes, {name} order: peak beyond what is kept / staging area",
            beyond / (BOX_RECORD * piece),
            "x",
            1.0,
        )
        run.found.number(
            f"memory.host_input.{order}",
            f"{count:,} boxes, {name} order: peak without the device / input",
            (peak - (device_bytes if on_host else 0)) / (BOX_GIVEN * count),
            "x",
        )
