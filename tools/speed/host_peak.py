"""The peak of the host's memory during one upload: ``-m tools.speed.host_peak COUNT SEED ORDER``.

A process of its own, so that its peak is that of one upload.
Prints a JSON list of four numbers: the bytes of the peak beyond what was there before the upload,
the bytes that the device keeps, the bytes that the host keeps, and the instances of a piece.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Final

import hizvk

from . import town

#: Linux keeps a process's current and greatest memory here, and can begin the latter anew.
STATUS: Final = Path("/proc/self/status")
RESET: Final = Path("/proc/self/clear_refs")


def _status(name: str) -> int:
    """Bytes of one entry of `STATUS`."""
    lines = STATUS.read_text(encoding="ascii").splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith(name))


def main(count: int, seed: int, order: str) -> None:
    """Uploads `count` boxes and prints what it took."""
    if not (STATUS.exists() and RESET.exists()):
        raise SystemExit(f"this system has no {RESET}")
    device = hizvk.Device()
    scene = town.make(count, 0.95, seed)
    device.instances(hizvk.Boxes(scene.low[:64], scene.high[:64]))
    device.wait()
    RESET.write_text("5", encoding="ascii")  # the peak begins anew
    before = _status("VmRSS")
    crowd = device.instances(scene.boxes, order=order)  # type: ignore[arg-type]
    device.wait()
    peak = _status("VmHWM") - before
    piece = -(-len(crowd) // crowd._inner.num_pieces())
    print(json.dumps([peak, crowd.device_bytes, crowd.host_bytes, piece]))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3])
