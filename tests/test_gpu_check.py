"""`make gpu-check`: what it runs, what it says without a GPU, and what its report holds."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
from pathlib import Path

import pytest

import hizvk
from tools import gpu_check

ROOT = Path(__file__).resolve().parents[1]
GPU = hizvk.Adapter(1, "A GPU of 3 | parts", "driver", "1.2", "vulkan", "discrete_gpu")
SOFTWARE = dataclasses.replace(GPU, device_type="cpu")
#: What each part prints in the runs of these tests.
OUTPUTS = {
    "doctor": "ok   package: hizvk\nok   device: A GPU, images up to 16384 per side\n",
    "Rust tests": "test result: ok. 3 passed; 0 failed; 1 ignored\n"
    "test result: FAILED. 4 passed; 2 failed; 0 ignored\n",
    "Python tests": "....\n======= 5 passed, 1 skipped in 2.00s =======\n",
    "speed": "  reduction  1.2 x\n3 of 4 targets met\nlook at  out\n",
    "demo": "culled   1 of 2\ncheck    passed: 0 of 9 visible instances culled\nlook at  out\n",
}


def run_with(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    adapter: hizvk.Adapter | str,
    failing: str = "",
    *arguments: str,
) -> tuple[int, list[gpu_check.Part], dict[str, str]]:
    """Runs the check without any process: exit code, the parts, and their environment."""
    seen: list[gpu_check.Part] = []
    environment: dict[str, str] = {}

    def run(part: gpu_check.Part, given: dict[str, str]) -> gpu_check.Result:
        seen.append(part)
        environment.update(given)
        return gpu_check.Result(part, int(part.name == failing), 1.0, OUTPUTS[part.name])

    monkeypatch.setattr(gpu_check, "_adapter", lambda: adapter)
    return gpu_check.main(["--out", str(tmp_path), *arguments], run), seen, environment


def test_here_it_says_that_there_is_no_gpu() -> None:
    """The tests' driver is a processor, unless they run on a GPU."""
    if hizvk.Device().adapter.device_type != "cpu":
        pytest.skip("this adapter is a GPU")
    environment = {key: value for key, value in os.environ.items() if key != gpu_check.VARIABLE}
    ran = subprocess.run(
        [sys.executable, "-m", "tools.gpu_check"],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == gpu_check.NO_GPU == 3
    assert "there is no GPU here" in ran.stderr
    assert hizvk.Device().adapter.name in ran.stderr
    assert "HIZVK_ALLOW_SOFTWARE=1" in ran.stderr
    assert ran.stdout == ""


@pytest.mark.parametrize("adapter", [SOFTWARE, "no adapter was found; seen: none"])
def test_without_a_gpu_nothing_is_run(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    adapter: hizvk.Adapter | str,
) -> None:
    monkeypatch.delenv(gpu_check.VARIABLE, raising=False)
    status, seen, _ = run_with(monkeypatch, tmp_path, adapter)
    assert (status, seen) == (3, [])
    assert str(adapter) in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
    # Without any adapter the variable has nothing to allow.
    monkeypatch.setenv(gpu_check.VARIABLE, "1")
    status, seen, _ = run_with(monkeypatch, tmp_path, adapter)
    assert (status, len(seen)) == ((0, 5) if adapter is SOFTWARE else (3, 0))


def test_a_gpu_is_looked_for_alone(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, seen, _ = run_with(monkeypatch, tmp_path, GPU, "", "--only-look")
    assert (status, seen) == (0, [])
    assert GPU.name in capsys.readouterr().out


def test_every_part_runs_on_the_adapter_and_is_reported(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "speed").mkdir()
    (tmp_path / "speed" / "report.md").write_text("# Speed\n\n![times](scale.png)\n\n## Cull\n")
    status, seen, environment = run_with(monkeypatch, tmp_path, GPU)
    assert status == 0
    assert [part.name for part in seen] == list(OUTPUTS)
    assert environment["HIZVK_EXPECT_ADAPTER"] == GPU.name
    page = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert page.startswith(f"# gpu-check: {GPU.name}\n")
    rows = [line for line in page.splitlines() if line.startswith("| ")][1:]
    assert rows == [
        "| doctor | passed | 1 | A GPU, images up to 16384 per side |",
        "| Rust tests | passed | 1 | 7 passed, 2 failed |",
        "| Python tests | passed | 1 | 5 passed, 1 skipped in 2.00s |",
        "| speed | passed | 1 | 3 of 4 targets met |",
        "| demo | passed | 1 | passed: 0 of 9 visible instances culled |",
    ]
    assert "software" not in page
    assert "## Speed\n\n![times](speed/scale.png)\n\n### Cull" in page
    assert (tmp_path / "rust-tests.log").read_text() == OUTPUTS["Rust tests"]


@pytest.mark.parametrize("failing", list(OUTPUTS))
def test_a_part_that_fails_fails_the_check_and_shows_its_end(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, failing: str
) -> None:
    status, seen, _ = run_with(monkeypatch, tmp_path, GPU, failing)
    # The parts after it run all the same.
    assert (status, len(seen)) == (1, len(OUTPUTS))
    page = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert f"| {failing} | FAILED (1) |" in page
    assert f"## {failing}, its end\n\n```text\n{OUTPUTS[failing]}```" in page


def test_a_software_driver_is_named_in_the_report(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv(gpu_check.VARIABLE, "1")
    status, _, _ = run_with(monkeypatch, tmp_path, SOFTWARE, "", "--quick")
    assert status == 0
    page = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "**This is a software driver: the report says nothing about a GPU.**" in page
    assert "`--quick`" in page


def test_nextest_s_summary_is_read() -> None:
    part = gpu_check.Part("Rust tests", ())
    text = "------------\n     Summary [ 61.0s] 546 tests run: 545 passed, 1 failed, 20 skipped\n"
    assert gpu_check.says(gpu_check.Result(part, 0, 1.0, text)) == (
        "546 tests run: 545 passed, 1 failed, 20 skipped"
    )
    assert gpu_check.says(gpu_check.Result(part, 1, 1.0, "")) == "nothing"


def test_what_it_runs_is_there() -> None:
    for quick in (True, False):
        for part in gpu_check.parts(Path("out"), quick=quick):
            for word in part.command:
                if word.startswith("tests/"):
                    assert (ROOT / word).is_file()
    named = gpu_check.QUICK_RUST[1::2]
    for name in named:
        assert (ROOT / "crates" / "hiz_core" / "tests" / f"{name}.rs").is_file()
