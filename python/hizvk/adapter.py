"""The adapters of this machine."""

from __future__ import annotations

from dataclasses import dataclass

from ._core import adapters as found_adapters
from ._processes import driver_is_asked

__all__ = ["Adapter", "adapters"]


@dataclass(frozen=True)
class Adapter:
    """An adapter: a GPU, or a software driver, as one graphics interface offers it."""

    index: int
    """Its place in the list of `adapters`."""
    name: str
    """The adapter's name."""
    driver: str
    """The driver's name."""
    driver_info: str
    """The driver's version."""
    backend: str
    """The graphics interface: ``"vulkan"``; ``"metal"`` on macOS, and also ``"dx12"`` on Windows.

    Tests run on Vulkan alone.
    """
    device_type: str
    """``"discrete_gpu"``, ``"integrated_gpu"``, ``"virtual_gpu"``, ``"cpu"`` or ``"other"``."""

    def __str__(self) -> str:
        driver = " ".join(part for part in (self.driver, self.driver_info) if part)
        return f"{self.index}: {self.name} [{self.device_type}, {driver}]"


def adapters() -> list[Adapter]:
    """The adapters of this machine; an empty list without a driver."""
    with driver_is_asked():
        return [Adapter(*summary) for summary in found_adapters()]
