"""What all objects on a device have in common: the device that made them, their memory, a text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, NoReturn, Protocol, TypeVar

from . import _arguments

if TYPE_CHECKING:
    from collections.abc import Callable

    from ._core import Engine as CoreEngine
    from .adapter import Adapter

__all__ = ["Allocated", "Maker", "OnDevice", "StaysInProcess", "check_owner", "owned"]


class Maker(Protocol):
    """The `Device` that made an object, as this object's module knows it.

    `Device` returns instances, depth images and results, so their modules cannot import it.
    """

    _engine: CoreEngine

    @property
    def adapter(self) -> Adapter: ...
    @property
    def max_image_side(self) -> int: ...
    @property
    def instances(self) -> Callable[..., Any]: ...
    @property
    def occluders(self) -> Callable[..., Any]: ...
    @property
    def render_depth(self) -> Callable[..., Any]: ...
    @property
    def pyramid(self) -> Callable[..., Any]: ...
    @property
    def cull(self) -> Callable[..., Any]: ...
    def wait(self) -> None: ...


class _HasBytes(Protocol):
    def device_bytes(self) -> int: ...


_Inner = TypeVar("_Inner")
_Thing = TypeVar("_Thing", bound="OnDevice[Any]")
_InnerWithBytes = TypeVar("_InnerWithBytes", bound=_HasBytes)


class StaysInProcess:
    """What pickle refuses, with what to send instead."""

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            f"a {type(self).__name__} stays in its process: send bounds, cameras, meshes and NumPy "
            "arrays such as a mask, and make a Device in the other process; hizvk.sweep does so"
        )


class OnDevice(StaysInProcess, Generic[_Inner]):
    """An object on a device: the compiled module's object, and the `Device` that made it."""

    def __init__(self, device: Maker, inner: _Inner) -> None:
        self._device = device
        self._inner = inner

    @property
    def device(self) -> Maker:
        """The `Device` that made it."""
        return self._device

    def _summary(self) -> str:
        """What `repr` says after the name of the class."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"<{type(self).__name__}{self._summary()}>"


class Allocated(OnDevice[_InnerWithBytes]):
    """An object whose memory on the device can be asked for."""

    @property
    def device_bytes(self) -> int:
        """Bytes that it takes on the device."""
        return self._inner.device_bytes()


def check_owner(name: str, thing: OnDevice[Any], device: object) -> None:
    """A `ValueError` if `thing` was made by another device."""
    if thing.device is not device:
        raise ValueError(
            f"{name}: expected {type(thing).__name__} of this device, got one of another Device"
        )


def owned(
    name: str, thing: object, wanted: type[_Thing], expected: str, hint: str = "", *, device: object
) -> _Thing:
    """An object of this class that `device` has made; see `_arguments.instance`."""
    if isinstance(thing, wanted) and thing._device is device:
        return thing  # as nearly always
    found = _arguments.instance(name, thing, wanted, expected, hint)
    check_owner(name, found, device)
    return found
