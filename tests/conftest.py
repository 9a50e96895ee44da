"""Every run says which adapter it is on, and stops when it is not the expected one."""

import os

import pytest
from hypothesis import settings

import adapter_check

# The same examples in every run: a change is red for its own sake. `make soak` tries others (HIZVK_FUZZ=random).
settings.register_profile("hizvk", derandomize=os.environ.get("HIZVK_FUZZ") != "random", database=None)
settings.load_profile("hizvk")

_description, _wrong = adapter_check.check()


def pytest_report_header() -> str:
    """The adapter, at the top of the report."""
    return _description


def pytest_sessionstart() -> None:
    """Results of another driver than the expected one are worth nothing."""
    if _wrong:
        pytest.exit(_wrong, returncode=1)
