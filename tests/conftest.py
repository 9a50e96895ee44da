"""Every run reports its adapter, and stops if it is not the expected one."""

import importlib.util
import os
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

import adapter_check
import hizvk

# Every run has the same examples, so that a red test is due to a change.
# `make soak` tries others (HIZVK_FUZZ=random).
settings.register_profile(
    "hizvk", derandomize=os.environ.get("HIZVK_FUZZ") != "random", database=None
)
settings.load_profile("hizvk")

_description, _wrong = adapter_check.check()


def pytest_report_header() -> str:
    """The adapter, at the top of the report."""
    return _description


def pytest_sessionstart() -> None:
    """Results of a driver other than the expected one are worth nothing."""
    if _wrong:
        pytest.exit(_wrong, returncode=1)


@pytest.fixture(scope="module")
def device() -> hizvk.Device:
    """A device for the tests of one file."""
    return hizvk.Device()


@pytest.fixture(scope="session")
def judge() -> Any:
    """The judge of Intel's castle, with `castle.npz` beside its file.

    Neither is part of the repository.
    """
    folder = Path(__file__).resolve().parents[2] / "shared" / "judge"
    if not (folder / "castle.npz").exists():
        pytest.skip("the castle and its judge are not beside this checkout (../shared/judge)")
    if importlib.util.find_spec("embreex") is None:
        pytest.skip("the judge casts rays with embreex, which is not installed")
    spec = importlib.util.spec_from_file_location("judge", folder / "judge.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["judge"] = module
    spec.loader.exec_module(module)
    return module
