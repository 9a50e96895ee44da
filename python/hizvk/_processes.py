"""What ending processes, forks and the driver's environment demand of this package.

A lock that another thread holds at a fork is never released in the child.
So no part of the package waits for a lock of another process: an object with a lock belongs to one
process (`per_process`), and `cached_property` has no lock.
"""

from __future__ import annotations

import ctypes
import os
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Generic, TypeVar, overload

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Self

__all__ = ["cached_property", "driver_is_asked", "per_process"]

_T = TypeVar("_T")

#: Mesa's layer of this name prints "error: XDG_RUNTIME_DIR is invalid" where there is no desktop.
#: Where the variable is set, the Vulkan loader leaves the layer out.
_NO_DEVICE_SELECT = "NODEVICE_SELECT"


class cached_property(Generic[_T]):
    """`functools.cached_property` without its lock: Python 3.11 has one for all objects of a class.

    Two threads may both compute the value; all see the one that was stored first.
    """

    def __init__(self, compute: Callable[[Any], _T]) -> None:
        self._compute = compute
        self.__doc__ = compute.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...

    @overload
    def __get__(self, instance: object, owner: type) -> _T: ...

    def __get__(self, instance: object | None, owner: type) -> Self | _T:
        if instance is None:
            return self
        value: _T = instance.__dict__.setdefault(self._name, self._compute(instance))
        return value


def per_process(of: dict[int, _T], make: Callable[[], _T]) -> _T:
    """The value of `of` for this process.

    A forked child makes its own, and keeps its parent's as it is.
    """
    try:
        return of[os.getpid()]
    except KeyError:
        return of.setdefault(os.getpid(), make())


class _Environment:
    """How many calls of this process ask the driver now, and whether they set the variable."""

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.calls = 0
        self.is_ours = False

    def enter(self) -> None:
        with self.lock:
            if self.calls == 0 and _NO_DEVICE_SELECT not in os.environ:
                os.environ[_NO_DEVICE_SELECT] = "1"
                self.is_ours = True
            self.calls += 1

    def leave(self) -> None:
        with self.lock:
            self.calls -= 1
            if self.calls == 0:
                self.restore()

    def restore(self) -> None:
        if self.is_ours:
            os.environ.pop(_NO_DEVICE_SELECT, None)
            self.is_ours = False


_environments: dict[int, _Environment] = {}


@contextmanager
def driver_is_asked() -> Iterator[None]:
    """For calls that make a Vulkan instance: its layers print nothing on stderr.

    Afterwards the environment is as before.
    """
    environment = per_process(_environments, _Environment)
    environment.enter()
    try:
        yield
    finally:
        environment.leave()


def _c_functions() -> tuple[Any, Any] | None:
    """The C library's `on_exit` and `__cxa_atexit`, bound before any fork; None without them."""
    if not hasattr(os, "register_at_fork"):
        return None
    libc = ctypes.CDLL(None)
    try:
        return libc.on_exit, libc.__cxa_atexit
    except AttributeError:
        return None


_at_exit = _c_functions()
if _at_exit is not None:
    _exit, _fflush = (
        ctypes.cast(f, ctypes.c_void_p) for f in (ctypes.CDLL(None)._exit, ctypes.CDLL(None).fflush)
    )


def _after_fork_in_child() -> None:
    """Restores the environment, and lets the child end without its parent's drivers; takes no lock.

    Mesa joins its threads when a C program exits.
    In a fork these threads do not exist, so it crashes or waits for ever.
    So the child of a process that has asked a driver skips its parent's C exit handlers, once
    Python has ended.
    `multiprocessing` ends its children in this way in any case.
    """
    if not _environments:
        return
    for environment in _environments.values():
        environment.restore()
    if _at_exit is not None:
        on_exit, cxa_atexit = _at_exit
        # The last handler runs first: C's streams are written, then the process ends with its
        # status.
        on_exit(_exit, None)
        cxa_atexit(_fflush, None, None)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork_in_child)
