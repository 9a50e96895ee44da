"""Every run says which adapter it is on, and stops when it is not the expected one."""

import pytest

import adapter_check

_description, _wrong = adapter_check.check()


def pytest_report_header() -> str:
    """The adapter, at the top of the report."""
    return _description


def pytest_sessionstart() -> None:
    """Results of another driver than the expected one are worth nothing."""
    if _wrong:
        pytest.exit(_wrong, returncode=1)
