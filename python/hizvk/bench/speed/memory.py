"""Bytes on the device against what is stored, and the peak on the host against the input."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from .run import Run

__all__ = ["measure"]

#: Bytes of an instance: as a record on the device (`crates/hiz_core/src/bounds.rs`), and as the float32 that came.
BOX_RECORD: Final = 48
BOX_GIVEN: Final = 24
#: What the cull leaves: mask, indices and draws.
OUTPUTS: Final = (True, False, True, True)

#: A process of its own, so that its peak is that of one upload. It prints bytes: the peak beyond what was there before
#: the upload, and what the device and the host keep; and the instances of a piece.
CHILD: Final = """
import json, sys
import numpy as np
import hizvk
from hizvk.bench.speed import town

def status(name):
    with open("/proc/self/status") as file:
        return next(1024 * int(line.split()[1]) for line in file if line.startswith(name))

device = hizvk.Device()
scene = town.make(int(sys.argv[1]), 0.95, int(sys.argv[2]))
device.instances(hizvk.Boxes(scene.low[:64], scene.high[:64]))
device.wait()
with open("/proc/self/clear_refs", "w") as file:
    file.write("5")  # the peak begins anew
before = status("VmRSS")
crowd = device.instances(scene.boxes, order=sys.argv[3])
device.wait()
peak = status("VmHWM") - before
print(json.dumps([peak, crowd.device_bytes, crowd.host_bytes, -(-len(crowd) // crowd._inner.num_pieces())]))
"""


def measure(run: Run) -> None:
    """Of `Extent.crowd` boxes before the first depth image."""
    run.step("memory")
    _device(run)
    _host(run)


def _device(run: Run) -> None:
    scene = run.town(run.extent.crowd, 0.95)
    depth = run.depth(scene, run.extent.images[0][1])
    pyramid, boxes = run.device.pyramid(depth), run.device.instances(scene.boxes)
    cull = run.cull(boxes, depth.camera, pyramid, groups=True, order="stable", outputs=OUTPUTS)
    cull.ms()  # what is made when it is first needed
    image = 4 * depth.size[0] * depth.size[1]
    texels = sum(level.size for level in map(pyramid.level, pyramid.levels))
    used = boxes.device_bytes + pyramid.device_bytes + image + cull.device_bytes()
    count = len(boxes)
    leaves = image + 4 * texels + count // 8 + 4 * count + 20
    found = run.found
    found.number(
        "memory.device", f"{count:,} boxes, device / (stored bounds + depth and its levels + mask, indices, draws)",
        used / (BOX_RECORD * count + leaves), "x", 1.5,
    )  # fmt: skip
    found.number(
        "memory.device_given",
        "the same with the bounds as they came, float32",
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
            [sys.executable, "-c", CHILD, str(count), str(run.seed), order],
            capture_output=True,
            text=True,
            check=False,
        )
        if ran.returncode != 0:
            reason = (ran.stderr.strip().splitlines() or ["?"])[-1]
            run.found.notes.append(f"the peak of the host's memory was left out: {reason}")
            return
        peak, device_bytes, host_bytes, piece = json.loads(ran.stdout)
        # A software driver's device is the host: what the device keeps is taken off, else it would
        # be counted twice.
        on_host = run.device.adapter.device_type == "cpu"
        beyond = peak - host_bytes - (device_bytes if on_host else 0)
        run.found.number(
            f"memory.host.{order}",
            f"{count:,} boxes, {name} order: peak beyond input, what stays and the device / one staging area",
            beyond / (BOX_RECORD * piece), "x", 1.0,
        )  # fmt: skip
        run.found.number(
            f"memory.host_input.{order}",
            f"{count:,} boxes, {name} order: peak beyond input, device not counted / input",
            (peak - (device_bytes if on_host else 0)) / (BOX_GIVEN * count), "x",
        )  # fmt: skip
