"""Processes that end or fork after they have used a device.

None aborts or hangs, and errors say what to do.
"""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import hizvk

SCRIPT = Path(__file__).with_name("processes.py")
#: A limit against hanging, not a test of speed: scenes take a second or two.
GUARD_S = 120


def stacks(group: int) -> str:
    """What every thread of a scene and of its forks waits for.

    The scenes write Python's stacks on stderr when they are told to.
    The native ones need gdb.
    """
    with contextlib.suppress(ProcessLookupError):
        os.killpg(group, signal.SIGUSR1)
    time.sleep(1)
    gdb = shutil.which("gdb")
    if gdb is None:
        return "(with gdb installed, the native stacks would stand here)\n"
    told = []
    for pid in sorted(int(name) for name in os.listdir("/proc") if name.isdigit()):
        with contextlib.suppress(ProcessLookupError):
            if os.getpgid(pid) == group:
                ask = [gdb, "-batch", "-p", str(pid), "-ex", "thread apply all backtrace 30"]
                answer = subprocess.run(ask, capture_output=True, text=True, check=False)
                told.append(f"process {pid}:\n{answer.stdout}")
    return "".join(told)


def run(scene: str) -> "subprocess.CompletedProcess[str]":
    process = subprocess.Popen(
        [sys.executable, str(SCRIPT), scene],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        out, err = process.communicate(timeout=GUARD_S)
    except subprocess.TimeoutExpired:
        threads = stacks(process.pid)
        # Kills its forks, too.
        os.killpg(process.pid, signal.SIGKILL)
        out, err = process.communicate()
        pytest.fail(f"{scene}: a process hangs (ended after {GUARD_S} s)\n{out}{err}{threads}")
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)


@pytest.mark.parametrize("how", ["plain", "unread", "cycle", "daemons", "daemons_open"])
def test_a_process_ends_in_peace(how: str) -> None:
    ended = run(f"end_{how}")
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "", "")


def test_a_process_ends_with_its_own_status() -> None:
    ended = run("end_sys_exit")
    assert (ended.returncode, ended.stderr) == (3, "")
    ended = run("end_exception")
    assert ended.returncode == 1
    assert ended.stderr.splitlines()[-1] == "ValueError: on purpose"


def test_after_the_end_a_device_is_an_error() -> None:
    ended = run("after_the_end")
    assert (ended.returncode, ended.stderr) == (0, "")
    said, left = ended.stdout.splitlines()
    assert said == "HizError: the interpreter is about to end: every device has been let go of"
    assert left == "threads left: 0", "the driver's threads are joined when its device is destroyed"


def test_after_the_end_many_threads_meet_an_error_and_no_lock() -> None:
    ended = run("after_the_end_for_many")
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "joined 8\n", "")


def test_a_fork_is_told_of_its_parents_objects() -> None:
    told = run("refused")
    assert (told.returncode, told.stderr) == (0, "")
    assert told.stdout.splitlines() == ["[]", "status 0", "collected", "status 5"]


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        ("default", ["[True, False]", "status 5", "[True, False]", "status 0"]),
        ("no_device", ["nothing", "status 5"]),
        ("threads_of_a_child", ["[True, False]", "status 5"]),
        ("all_cores_in_a_fork", ["True", "status 0"]),
        ("while_threads_cull", ["[True, False]", "status 0"] * 5),
        (
            "while_the_driver_compiles",
            ["[True, False]", "status 0"] * 3 + ["worked on for ms: []"],
        ),
        ("pools", [str([[True, False]] * 4)] * 2 + ["[True, False]", "status 5", "status 0"]),
    ],
)
def test_a_fork_has_devices_of_its_own(scene: str, expected: list[str]) -> None:
    if scene != "no_device" and "SwiftShader" in hizvk.Device().adapter.name:
        pytest.skip(
            "SwiftShader's worker threads serve a whole process, and a fork has none of them"
        )
    forked = run(scene)
    assert (forked.returncode, forked.stderr) == (0, "")
    assert forked.stdout.splitlines() == expected


SILENT = {
    name: value
    for name, value in os.environ.items()
    if name not in ("NODEVICE_SELECT", "XDG_RUNTIME_DIR")
}


@pytest.mark.parametrize("command", [["info"], ["info", "--json"], ["doctor"]])
def test_nothing_is_said_on_stderr(command: list[str]) -> None:
    told = subprocess.run(
        [sys.executable, "-m", "hizvk", *command],
        capture_output=True,
        text=True,
        env=SILENT,
        timeout=GUARD_S,
        check=True,
    )
    assert told.stdout
    assert told.stderr == ""


ENVIRONMENT = """
import os, subprocess, threading, hizvk
def seen():
    # What Python sees, and what C's environment hands on to a child.
    told = subprocess.run(["printenv", "NODEVICE_SELECT"], capture_output=True, text=True)
    return os.environ.get("NODEVICE_SELECT"), told.stdout
before = seen()
threads = [threading.Thread(target=call) for call in (hizvk.Device, hizvk.adapters) * 4]
for thread in threads: thread.start()
for thread in threads: thread.join()
try:
    hizvk.Device("there is no such adapter")
except hizvk.NoAdapterError:
    pass
assert seen() == before, (seen(), before)
print(before)
"""


@pytest.mark.parametrize(("value", "expected"), [(None, "(None, '')"), ("0", "('0', '0\\n')")])
def test_the_environment_is_as_it_was(value: str | None, expected: str) -> None:
    environment = SILENT if value is None else {**SILENT, "NODEVICE_SELECT": value}
    told = subprocess.run(
        [sys.executable, "-c", ENVIRONMENT],
        capture_output=True,
        text=True,
        env=environment,
        timeout=GUARD_S,
        check=False,
    )
    assert told.returncode == 0, told.stderr
    assert told.stdout.strip() == expected
    if value is None:
        assert told.stderr == ""
