"""Faults that an environment variable plants into the shaders reach Python.

Release builds ignore them.
"""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap

import pytest

from hizvk import _core

#: A wall at depth 4 with a hole of one pixel, and a box at depth 8 that is visible through it.
#: Prints whether the box is kept, and the depth in the middle of an occluder at depth 2.
SCRIPT = textwrap.dedent("""
    import numpy as np, hizvk
    camera = hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(16, 16), near=1.0, reversed_z=True
    )
    depth = np.full((16, 16), 4.0)
    depth[8, 7] = 100.0
    device = hizvk.Device()
    kept = hizvk.visible(
        hizvk.Boxes([[-2.0, -2, -9]], [[2.0, 2, -8]]), camera, depth=depth, kind="z", device=device
    )
    wall = np.array([[-9.0, -9, -2], [9, -9, -2], [0, 30, -2]])
    occluders = device.occluders(wall, np.array([[0, 1, 2]]))
    drawn = device.render_depth(occluders, camera, rasteriser="device")
    print(bool(kept[0]), float(device.pyramid(drawn).level(0)[8, 8]))
""")

FAULTS = {
    "nearest for farthest": (
        "select(max(a, b), min(a, b), REVERSED) => select(min(a, b), max(a, b), REVERSED)\n"
        "max(max(below_one.x, below_one.y), max(below_one.z, below_one.w)) => "
        "min(min(below_one.x, below_one.y), min(below_one.z, below_one.w))",
        "False 0.5",
    ),
    "occluders twice as far": (
        "dot(copy.clip_w, d)); => 2.0 * dot(copy.clip_w, d));",
        "True 0.25",
    ),
}


def run(fault: str) -> str:
    """The output of the script with this fault."""
    environment = os.environ | {"HIZVK_PLANTED_FAULT": fault}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_without_a_fault_nothing_is_wrong() -> None:
    assert run("") == "True 0.5"


@pytest.mark.parametrize("name", FAULTS)
def test_planted_faults_reach_python(name: str) -> None:
    """A development build takes the fault.

    A release build ignores it; a benchmark may have left one here.
    """
    fault, wrong = FAULTS[name]
    assert run(fault) == (wrong if _core.takes_planted_faults else "True 0.5")
