"""Real out-of-memory conditions give a named error and no crash, and the next device works."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).with_name("out_of_memory.py")

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/statm").exists(), reason="limits of memory are set as Linux has them"
)


@pytest.mark.parametrize(
    ("call", "mebibytes"),
    [
        ("instances", 128),
        ("occluders", 64),
        ("convert", 64),
        ("upload", 16),
        ("upload", 250),
        ("render", 128),
    ],
)
def test_out_of_memory_is_an_error_and_the_next_device_works(call: str, mebibytes: int) -> None:
    """The host's memory (a list in Rust) and the device's run out at different limits.

    wgpu gives up the device when its own staging memory runs out.
    Then the error reports the lost device.
    """
    run = subprocess.run(
        [sys.executable, str(SCRIPT), call, str(mebibytes)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    error, after = run.stdout.splitlines()[-2:]
    assert error in ("OutOfMemoryError", "DeviceLostError")
    assert after == "next device: [True, False]"


def test_a_cull_without_memory_for_all_levels_in_one_texture_goes_on() -> None:
    """The cull reads the depth image and the levels in place."""
    run = subprocess.run(
        [sys.executable, str(SCRIPT), "cull", "70"],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    told = "no error: 0 kept, 0 bytes copied beside 2000000 others"
    assert run.stdout.splitlines()[-2:] == [told, "next device: [True, False]"]
