"""What a GPU says of this tree: ``make gpu-check``, or ``python -m tools.gpu_check``.

It runs `hizvk doctor`, the fast tests, the speed tool and the demo on one adapter.
It leaves one report, ``out/gpu/report.md``, and a log of each part beside it.

Exit codes:

- 0: every part passed
- 1: a part failed
- 2: wrong usage
- 3: there is no GPU, so nothing was run; ``HIZVK_ALLOW_SOFTWARE=1`` runs on a software driver
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import hizvk
from hizvk import _core
from hizvk.commands import pipes
from hizvk.commands.report import adapter_words, version_words

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hizvk import Adapter

__all__ = ["NO_GPU", "Part", "Result", "main", "parts", "report"]

PROG: Final = "python -m tools.gpu_check"
ROOT: Final = Path(__file__).resolve().parent.parent
#: The exit code that says that there is no GPU.
NO_GPU: Final = 3
#: Set to 1, it runs on a software driver.
VARIABLE: Final = "HIZVK_ALLOW_SOFTWARE"
#: The tests of `--quick`: pyramid, lists, outcomes and results.
QUICK_RUST: Final = ("--test", "pyramid", "--test", "lists", "--test", "outcomes")
QUICK_PYTHON: Final = ("tests/test_api_results.py", "tests/test_outcomes.py")


@dataclass(frozen=True)
class Part:
    """One thing that is run."""

    name: str
    command: tuple[str, ...]


@dataclass(frozen=True)
class Result:
    """How a part went."""

    part: Part
    status: int
    seconds: float
    output: str

    @property
    def passed(self) -> bool:
        """Whether it ended well."""
        return self.status == 0


def parts(out: Path, *, quick: bool) -> list[Part]:
    """Everything that is run, in this order."""
    python = sys.executable
    cargo = ("cargo", "test", "--workspace", "--no-fail-fast")
    if not quick and shutil.which("cargo-nextest"):
        rust: tuple[str, ...] = ("cargo", "nextest", "run", "--workspace", "--no-fail-fast")
    else:
        rust = (*cargo, *(QUICK_RUST if quick else ("--tests", "--examples")))
    tests = QUICK_PYTHON if quick else ()
    few = ("--quick", "--part", "reduction", "--part", "bounds") if quick else ()
    return [
        Part("doctor", (python, "-m", "hizvk", "doctor")),
        Part("Rust tests", rust),
        Part("Python tests", (python, "-m", "pytest", "-q", "-m", "not slow", *tests)),
        Part("speed", (python, "-m", "tools.speed", "--out", str(out / "speed"), *few)),
        Part(
            "demo",
            (python, "-m", "hizvk", "demo", "--out", str(out / "demo"), *["--quick"] * quick),
        ),
    ]


def _run(part: Part, environment: dict[str, str]) -> Result:
    started = time.perf_counter()
    ran = subprocess.run(
        part.command,
        cwd=ROOT,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    return Result(part, ran.returncode, time.perf_counter() - started, ran.stdout)


def says(result: Result) -> str:
    """The line that sums a part up."""
    lines = [line.strip("= ") for line in result.output.splitlines() if line.strip()]
    if result.part.name == "Rust tests":
        # One line per binary: "test result: ok. 3 passed; 0 failed; ...".
        ended = [line for line in lines if line.startswith("test result:")]
        counts = [re.findall(r"(\d+) (passed|failed)", line) for line in ended]
        if ended:
            total = {"passed": 0, "failed": 0}
            for count, what in (each for line in counts for each in line):
                total[what] += int(count)
            return f"{total['passed']} passed, {total['failed']} failed"
    wanted = {
        "doctor": r"^(ok|FAIL) +device: (?P<said>.*)",
        "Rust tests": r"^Summary .*\] +(?P<said>.*)",
        "Python tests": r"(?P<said>.*\d+ (?:passed|failed).*)",
        "speed": r"(?P<said>\d+ of \d+ targets met.*)",
        "demo": r"^check +(?P<said>.*)",
    }[result.part.name]
    found = [match["said"] for line in lines if (match := re.search(wanted, line))]
    said = found[-1] if found else (lines[-1] if lines else "nothing")
    return said.replace("|", "/")


def report(adapter: Adapter, results: Sequence[Result], out: Path, *, quick: bool) -> str:
    """The report as Markdown."""
    is_software = adapter.device_type == "cpu"
    lines = [
        f"# gpu-check: {adapter.name}",
        "",
        f"- {adapter_words(adapter)}; {adapter.backend}",
        f"- {version_words()}; {os.cpu_count()} cores of {platform.processor() or 'this machine'}",
        f"- the extension module is a {_core.Yardstick.profile()} build; {_now()}",
    ]
    if quick:
        lines.append("- `--quick`: few tests and short measurements")
    if is_software:
        lines += ["", "**This is a software driver: the report says nothing about a GPU.**"]
    lines += ["", "| part | result | s | what it says |", "|---|---|---:|---|"]
    lines += [
        f"| {each.part.name} | {'passed' if each.passed else f'FAILED ({each.status})'} "
        f"| {each.seconds:.0f} | {says(each)} |"
        for each in results
    ]
    for each in results:
        if not each.passed:
            tail = each.output.splitlines()[-30:]
            lines += ["", f"## {each.part.name}, its end", "", "```text", *tail, "```"]
    speed = out / "speed" / "report.md"
    if speed.exists():
        # Its headings go one deeper, under one of this page.
        text = re.sub(r"^#", "##", speed.read_text(encoding="utf-8"), flags=re.MULTILINE)
        lines += ["", text.replace("](", "](speed/").rstrip()]
    return "\n".join(lines) + "\n"


def _now() -> str:
    return time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime())


def _adapter() -> Adapter | str:
    """The adapter that everything will run on, or why there is none."""
    try:
        return hizvk.Device().adapter
    except hizvk.NoAdapterError as error:
        return str(error)


def _no_gpu(what: str) -> int:
    print(
        f"gpu-check: there is no GPU here: {what}\n"
        "Nothing was run.\n"
        "`hizvk info` lists the adapters; a GPU needs its driver, and in a container its files.\n"
        f"{VARIABLE}=1 runs on a software driver, which says nothing about a GPU.",
        file=sys.stderr,
    )
    return NO_GPU


def main(
    arguments: Sequence[str] | None = None,
    run: Callable[[Part, dict[str, str]], Result] = _run,
) -> int:
    """Runs all parts and leaves the report; `run` runs one of them."""
    parser = argparse.ArgumentParser(
        prog=PROG,
        description="Runs doctor, the fast tests, the speed tool and the demo on the GPU, and "
        "leaves one report (exit code 3: there is none).",
    )
    parser.add_argument("--out", type=Path, default=Path("out/gpu"), help="folder for the report")
    parser.add_argument("--quick", action="store_true", help="few tests, short measurements")
    parser.add_argument(
        "--only-look", action="store_true", help="say which adapter it would be, and end"
    )
    given = parser.parse_args(arguments)
    adapter = _adapter()
    if isinstance(adapter, str):
        return _no_gpu(adapter)
    if adapter.device_type == "cpu" and os.environ.get(VARIABLE) != "1":
        return _no_gpu(f"the best adapter is a software driver, {adapter}")
    print(f"gpu-check: {adapter}", flush=True)
    if given.only_look:
        return 0
    out: Path = given.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    # A test on any other adapter than this one would fail.
    environment = os.environ | {"HIZVK_EXPECT_ADAPTER": adapter.name}
    results = []
    for part in parts(out, quick=given.quick):
        print(f"== {part.name}: {' '.join(part.command)}", flush=True)
        result = run(part, environment)
        (out / f"{part.name.lower().replace(' ', '-')}.log").write_text(result.output, "utf-8")
        print(f"-- {'passed' if result.passed else 'FAILED'}: {says(result)}", flush=True)
        results.append(result)
    page = out / "report.md"
    page.write_text(report(adapter, results, out, quick=given.quick), encoding="utf-8")
    print(f"look at  {page}")
    return 0 if all(result.passed for result in results) else 1


if __name__ == "__main__":
    sys.exit(pipes.run(main))
