"""What can go wrong beyond a bad argument: every error of the device is a `HizError`.

A bad argument raises a plain exception whose text names the parameter, what it expects and what
came:

- `TypeError` for a wrong type or kind of dtype,
- `ValueError` for a wrong shape, a camera with NaN, or a pyramid of another camera.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence
__all__ = [
    "DeviceLostError",
    "HizError",
    "HizWarning",
    "LimitError",
    "NoAdapterError",
    "OutOfMemoryError",
]


class HizError(Exception):
    """The base of all errors of the device, its driver and its limits."""


class HizWarning(UserWarning):
    """A call is right as it was asked, but looks like a mistake: see `CullResult.hints`."""


class NoAdapterError(HizError):
    """There is no adapter, or none of the name that was asked for.

    Attributes
    ----------
    seen : tuple of str
        The adapters that were found, one line each.
        It is empty if there is no driver.
    hint : str
        What to do: how to choose one of those seen, or the line that installs a software driver.
    request : str
        What was asked for, in words.
    """

    def __init__(self, seen: Sequence[str] = (), hint: str = "", request: str = "") -> None:
        self.seen = tuple(seen)
        self.hint = hint
        self.request = request
        super().__init__(self.seen, hint, request)

    def __str__(self) -> str:
        found = ", ".join(self.seen) if self.seen else "none"
        wanted = f" {self.request}" if self.request else ""
        return f"no adapter{wanted}; seen: {found}. {self.hint}".rstrip()


class LimitError(HizError):
    """Something is larger than this device can hold.

    Attributes
    ----------
    name : str
        The limit.
    requested, allowed : int
        What was asked for, and the most that the device allows.
    """

    def __init__(self, name: str, requested: int, allowed: int) -> None:
        self.name = name
        self.requested = requested
        self.allowed = allowed
        super().__init__(name, requested, allowed)

    def __str__(self) -> str:
        return f"{self.name}: {self.requested} requested, this device allows {self.allowed}"


class DeviceLostError(HizError):
    """The driver lost the device (a reset, a removed GPU): make a new `Device` and upload again."""


class OutOfMemoryError(HizError):
    """The device has no memory for what was asked, or this machine none for a copy of an array."""
