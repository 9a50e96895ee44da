"""What answers of the device have in common: whether they are there, and how to wait for them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypeVar

from ._on_device import OnDevice

if TYPE_CHECKING:
    from collections.abc import Generator
    from typing import Any, Self

__all__ = ["Awaited"]


class _HasWait(Protocol):
    def is_ready(self) -> bool: ...
    def wait(self) -> None: ...


_Answer = TypeVar("_Answer", bound=_HasWait)


class Awaited(OnDevice[_Answer]):
    """An answer that is on its way; ``await`` gives the answer itself once it is there."""

    def ready(self) -> bool:
        """Whether the answer is there; this asks the device and does not wait.

        With ``wait=False`` that is all that was asked for, so no read of it waits.
        Otherwise the device is done, and a read makes copies.
        """
        return self._inner.is_ready()

    def result(self) -> Self:
        """Waits until `ready` without the interpreter lock, and returns this object."""
        self._inner.wait()
        return self

    def __await__(self) -> Generator[Any, None, Self]:
        """Waits on a thread of the running event loop's default executor."""
        if not self.ready():
            # Only this imports asyncio, which takes as long as the rest of the package.
            from asyncio import get_running_loop

            yield from get_running_loop().run_in_executor(None, self.result).__await__()
        return self
