"""Which Vulkan adapter the tests run on, and whether it is the expected one.

`python tests/adapter_check.py` prints it and fails on a wrong one.
conftest.py does the same when pytest starts.
"""

import os
import sys

# lavapipe gives its driver this name.
# `HIZVK_EXPECT_ADAPTER=...` names another one: any part of its name or driver.
DEFAULT_EXPECTATION = "llvmpipe"


def check() -> tuple[str, str | None]:
    """A line that describes the adapter, and why it is wrong, or None if it is the right one."""
    import hizvk

    expected = os.environ.get("HIZVK_EXPECT_ADAPTER") or DEFAULT_EXPECTATION
    try:
        adapter = hizvk.Device().adapter
    except hizvk.HizError as error:
        return "adapter: none", f"no device: {error}"
    line = f"adapter: {adapter.name}; driver: {adapter.driver} {adapter.driver_info}"
    if expected.lower() not in line.lower():
        return (
            line,
            f"HIZVK_EXPECT_ADAPTER: expected an adapter or driver called {expected!r}, got {line}",
        )
    return line, None


if __name__ == "__main__":
    description, wrong = check()
    print(description)
    if wrong:
        sys.exit(f"error: {wrong}")
