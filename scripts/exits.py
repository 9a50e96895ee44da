"""Ends processes that use a device, four at once, and counts those that abort.

A software driver frees memory on its own threads.
If nobody joins them, a process may crash while it ends.
Half of the processes here run a Rust test binary (`crates/hiz_core/tests/ends.rs`).
The others run the Python script `tests/processes.py`, with modules that still name everything,
results that nobody read, and daemons that cull.

    exits.py                     # 2000 of each
    exits.py --rust 80 --python 20
    exits.py --command PROGRAM [ARGUMENT ...]    # 2000 runs of another program (--runs)
"""

from __future__ import annotations

import argparse
import itertools
import json
import subprocess
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
AT_ONCE = 4
SCENES = ("end_plain", "end_unread", "end_cycle", "end_daemons", "end_daemons_open")
#: Seconds after which a process counts as hung; it takes about one.
GUARD_S = 300


def rust_binary() -> str:
    """The path of the test binary `ends`, which is built if necessary."""
    command = [
        "cargo",
        "test",
        "--workspace",
        "--test",
        "ends",
        "--no-run",
        "--message-format=json",
    ]
    built = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    for line in built.splitlines():
        message = json.loads(line)
        if message.get("target", {}).get("name") == "ends" and message.get("executable"):
            return str(message["executable"])
    raise SystemExit("error: cargo names no executable of the test `ends`")


def ended(command: list[str]) -> tuple[str, str]:
    """How a process ended, and the last line of its stderr if that was not in peace."""
    try:
        run = subprocess.run(
            command, cwd=ROOT, capture_output=True, text=True, errors="replace", timeout=GUARD_S
        )
    except subprocess.TimeoutExpired:
        return "hung", ""
    if run.returncode == 0:
        return "in peace", ""
    lines = run.stderr.strip().splitlines() or [""]
    how = f"signal {-run.returncode}" if run.returncode < 0 else f"status {run.returncode}"
    return how, lines[-1]


def main() -> int:
    """Runs all, prints a line for each kind, and returns 1 if any did not end in peace."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rust", type=int, default=2000, help="runs of the Rust binary")
    parser.add_argument("--python", type=int, default=2000, help="runs of the Python script")
    parser.add_argument("--runs", type=int, default=2000, help="runs of --command")
    parser.add_argument(
        "--command", nargs=argparse.REMAINDER, help="another program, in place of both"
    )
    given = parser.parse_args()
    jobs: dict[str, list[list[str]]] = {}
    if given.command:
        jobs[given.command[0]] = [given.command] * given.runs
    else:
        if given.rust:
            jobs["Rust"] = [[rust_binary()]] * given.rust
        scenes = itertools.islice(itertools.cycle(SCENES), given.python)
        jobs["Python"] = [
            [sys.executable, str(ROOT / "tests" / "processes.py"), scene] for scene in scenes
        ]
    # In turns, so that both kinds run under each other's load.
    mixed = [
        (kind, job)
        for row in itertools.zip_longest(*jobs.values())
        for kind, job in zip(jobs, row, strict=True)
        if job
    ]
    found: dict[str, Counter[str]] = {kind: Counter() for kind in jobs}
    words: list[str] = []
    with ThreadPoolExecutor(AT_ONCE) as pool:
        for (kind, _), (how, last) in zip(
            mixed, pool.map(lambda job: ended(job[1]), mixed), strict=True
        ):
            found[kind][how] += 1
            if how != "in peace":
                words.append(f"  {kind}: {how}: {last}")
    for kind, counts in found.items():
        told = ", ".join(f"{count} {how}" for how, count in counts.most_common())
        print(f"{kind}: {counts.total()} processes, {AT_ONCE} at once: {told}")
    print("\n".join(words[:20]), end="\n" if words else "")
    return 1 if words else 0


if __name__ == "__main__":
    sys.exit(main())
