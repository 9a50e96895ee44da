"""The command line, and the package on a machine without a Vulkan driver."""

import importlib.machinery
import json
import os
import pickle
import signal
import subprocess
import sys
import types
from pathlib import Path
from typing import Any

import pytest

import hizvk
from hizvk import _core, cli, doctor
from hizvk.commands import pipes

ROOT = Path(__file__).parents[1]
INSTALL_LINE = "apt install libvulkan1 mesa-vulkan-drivers"


def test_info(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["info"]) == 0
    text = capsys.readouterr().out
    assert hizvk.__version__ in text
    for adapter in hizvk.adapters():
        assert str(adapter) in text
    assert cli.main(["info", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["hizvk"] == hizvk.__version__
    assert told["build"] in ("development", "release")
    assert [hizvk.Adapter(**adapter) for adapter in told["adapters"]] == hizvk.adapters()


def test_doctor(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["doctor", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["healthy"] is True
    found = {check["name"]: check["detail"] for check in told["checks"]}
    assert (
        found["cull (reversed depth)"]
        == found["cull (standard depth)"]
        == "visible, occluded, outside"
    )
    assert cli.main(["doctor"]) == 0
    assert "ok   cull (standard depth): visible, occluded, outside" in capsys.readouterr().out


def test_doctor_tells_what_is_wrong(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HIZVK_ADAPTER", "no such adapter")
    assert cli.main(["doctor"]) == 1
    text = capsys.readouterr().out
    assert "FAIL device" in text
    assert "HIZVK_ADAPTER has to name one of the adapters" in text
    monkeypatch.delenv("HIZVK_ADAPTER")
    monkeypatch.setenv("VK_DRIVER_FILES", "/nowhere/driver.json")
    assert any(check.name == "vulkan drivers" and not check.passed for check in doctor.checks())


@pytest.mark.parametrize("name", ["demo", "bench"])
def test_other_commands_are_modules_of_their_own(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[list[str]] = []
    module = types.ModuleType(f"hizvk.{name}")
    module.__spec__ = importlib.machinery.ModuleSpec(f"hizvk.{name}", None)
    module.main = lambda arguments: seen.append(arguments) or 7  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, f"hizvk.{name}", module)
    assert cli.main([name, "--json", "--help", "x"]) == 7
    assert seen == [["--json", "--help", "x"]]
    monkeypatch.setattr(cli.importlib.util, "find_spec", lambda _: None)  # type: ignore[attr-defined]
    assert cli.main([name]) == 2
    assert f"hizvk {name}: not part of this build" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [[], ["nonsense"], ["info", "--nonsense"]])
def test_wrong_usage(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        cli.main(arguments)
    assert caught.value.code == 2
    assert "usage: hizvk" in capsys.readouterr().err


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        cli.main(["--help"])
    assert caught.value.code == 0
    text = capsys.readouterr().out
    for command in ("info", "doctor", "demo", "bench"):
        assert command in text


def with_a_closed_pipe(*command: str, unbuffered: str, streams: tuple[str, ...]) -> int:
    """The exit code of a module; it has nothing to say on stderr, where that is open."""
    reader, writer = os.pipe()
    os.close(reader)
    others = {"stderr": subprocess.PIPE} | dict.fromkeys(streams, writer)
    run = subprocess.run(
        [sys.executable, "-m", *command],
        cwd=ROOT,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": unbuffered},
        **others,  # type: ignore[call-overload]
    )
    os.close(writer)
    assert not run.stderr
    return int(run.returncode)


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("streams", [("stdout",), ("stdout", "stderr")])
def test_a_closed_pipe_is_no_error(unbuffered: str, streams: tuple[str, ...]) -> None:
    """As behind ``| head -1``; the exit code is that of a program which the signal ends."""
    code = with_a_closed_pipe("hizvk", "info", "--json", unbuffered=unbuffered, streams=streams)
    assert code == 128 + signal.SIGPIPE


@pytest.mark.parametrize(
    "module", ["hizvk.methods.turitzin", "hizvk.bench.sweeps", "tools.speed", "tools.jobs"]
)
def test_every_command_has_that_way_out(module: str) -> None:
    code = with_a_closed_pipe(module, "--help", unbuffered="", streams=("stdout",))
    assert code == 128 + signal.SIGPIPE


def test_another_pipe_s_error_stays_one(capsys: pytest.CaptureFixture[str]) -> None:
    def breaks() -> int:
        raise BrokenPipeError("a worker's")

    with pytest.raises(BrokenPipeError, match="a worker's"):
        pipes.run(breaks)
    assert pipes.run(lambda: None) == 0
    assert pipes.run(lambda: 3) == 3


@pytest.mark.parametrize("name", ["colour_points", "model_visibility", "pictures", "ten_spheres"])
def test_examples_with_arguments_have_help(name: str, tmp_path: Path) -> None:
    script = ROOT / "examples" / f"{name}.py"
    assert "sys.argv" in script.read_text()
    run = subprocess.run(
        [sys.executable, script, "--help"], cwd=tmp_path, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.startswith(script.read_text().partition("\n")[0].strip('"'))
    assert not list(tmp_path.iterdir())


def test_every_example_with_arguments_is_listed() -> None:
    takes = {path.stem for path in ROOT.glob("examples/*.py") if "sys.argv" in path.read_text()}
    assert takes == {"colour_points", "model_visibility", "pictures", "ten_spheres"}


WITHOUT_DRIVER = """
import hizvk
assert hizvk.adapters() == []
camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(4, 6), near=0.1)
codes = hizvk.reference.classify(hizvk.Spheres([[0.0, 0, 5]], 1), camera, [[9.0] * 6] * 4, kind="z")
assert codes.tolist() == [1]
try:
    hizvk.Device()
except hizvk.NoAdapterError as error:
    print(error)
    print(error.hint)
"""


def test_without_a_driver() -> None:
    environment = {
        **os.environ,
        "VK_DRIVER_FILES": "/nowhere.json",
        "VK_ICD_FILENAMES": "/nowhere.json",
    }
    environment.pop("VK_ADD_DRIVER_FILES", None)
    ran = subprocess.run(
        [sys.executable, "-c", WITHOUT_DRIVER],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    text, hint = ran.stdout.strip().rsplit("\n", 1)
    assert text.startswith("no adapter")
    assert INSTALL_LINE in text
    assert INSTALL_LINE in hint
    told = subprocess.run(
        [sys.executable, "-m", "hizvk", "doctor"],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert told.returncode == 1
    assert INSTALL_LINE in told.stdout
    assert "Traceback" not in told.stdout + told.stderr


def test_an_adapter_that_is_not_there() -> None:
    with pytest.raises(hizvk.NoAdapterError) as caught:
        hizvk.Device("no such adapter")
    assert "no such adapter" in str(caught.value)
    # The advice fits: there are adapters to choose from, so there is no driver to install.
    assert caught.value.seen == tuple(
        f"{one.index}: {one.name} ({one.device_type}, {one.driver} {one.driver_info})"
        for one in hizvk.adapters()
    )
    assert "by its number" in caught.value.hint
    assert "HIZVK_ADAPTER" in caught.value.hint
    assert INSTALL_LINE not in str(caught.value)
    with pytest.raises(hizvk.NoAdapterError):
        hizvk.Device(10_000)


def test_an_adapter_by_index_and_by_name() -> None:
    chosen = hizvk.Device().adapter
    assert hizvk.Device(chosen.index).adapter == chosen
    assert (
        hizvk.Device(chosen.name[:6].upper())
        .adapter.name.lower()
        .startswith(chosen.name[:6].lower())
    )


def test_errors_are_one_family_and_can_be_pickled() -> None:
    errors = [
        hizvk.NoAdapterError(["0: one"], "install it", "called two"),
        hizvk.LimitError("image side", 70_000, 16_384),
        hizvk.DeviceLostError("gone"),
        hizvk.OutOfMemoryError("full"),
    ]
    for error in errors:
        assert isinstance(error, hizvk.HizError)
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error)
        assert str(again) == str(error)
        assert vars(again) == vars(error)
    assert str(errors[0]) == "no adapter called two; seen: 0: one. install it"
    assert str(errors[1]) == "image side: 70000 requested, this device allows 16384"


def test_a_limit_has_a_name_and_numbers() -> None:
    device = hizvk.Device()
    side = device.max_image_side + 1
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(1, side), near=0.1)
    with pytest.raises(hizvk.LimitError) as caught:
        device.render_depth(device.occluders([]), camera)
    assert caught.value.requested == side
    assert caught.value.allowed == device.max_image_side


def test_doctor_says_what_each_finding_means(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = doctor.checks()
    assert {check.name.partition(" (")[0] for check in found} <= doctor.MEANINGS.keys()
    assert cli.main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    for check in found:
        at = lines.index(f"ok   {check.name}: {check.detail}")
        assert lines[at + 1] == f"     {check.meaning}"
        if check.advice:
            assert lines[at + 2] == f"     -> {check.advice}"
    assert lines[-1] == "all is well: culls work here"
    assert any("development build" in check.detail for check in found) == (
        _core.__build__ == "development"
    )
    # llvmpipe is a software driver, and this build is not the one that is released.
    assert any("a software driver" in check.advice for check in found)

    class NoSuchPackage:
        @staticmethod
        def find_spec(name: str) -> None:
            return None

    monkeypatch.setattr(doctor.importlib, "util", NoSuchPackage)  # type: ignore[attr-defined]
    absent = doctor._extras()
    assert absent.passed
    assert absent.advice.startswith("without matplotlib")
    assert "pip install" in absent.advice


def test_whatever_does_not_pass_has_advice(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A device that cannot be made, one that is wrong, and one that fails."""

    class Wrong(hizvk.Device):
        def pyramid(self, *args: object, **kwargs: object) -> Any:
            raise hizvk.HizError("out of order")

    monkeypatch.setattr(doctor, "_stage_times", lambda _: doctor.DoctorCheck("extras", True, ""))
    monkeypatch.setattr(hizvk, "Device", Wrong)
    found = doctor.checks()
    assert [check.name for check in found if not check.passed] == [
        "cull (reversed depth)", "cull (standard depth)",
    ]  # fmt: skip
    assert all(check.advice for check in found if not check.passed)
    assert cli.main(["doctor"]) == 1
    assert f"2 of {len(found)} failed; the line with ->" in capsys.readouterr().out

    def none() -> Any:
        raise hizvk.HizError("no device")

    monkeypatch.setattr(hizvk, "Device", none)
    monkeypatch.delenv("HIZVK_ADAPTER", raising=False)
    assert "another adapter may work" in doctor.checks()[-1].advice
