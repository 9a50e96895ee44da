"""The arguments of `hizvk.sweep`, checked."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .. import _arguments
from .._types import Rasteriser, words
from ..camera import Camera
from ..depth import checked_image
from ..resources import Instances, Occluders
from .result import Sweep

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = [
    "adapter_of",
    "block_of",
    "cameras_of",
    "depths_of",
    "executor_of",
    "groups_of",
    "meaning_of",
    "refuse_unsendable",
    "refuse_uploaded",
    "render_of",
    "resumed",
]

#: The most views of a block, and into how many blocks a sweep is cut at least where it can be.
_MOST_VIEWS: Final = 16
_LEAST_BLOCKS: Final = 16


def refuse_uploaded(bounds: object, occluders: object) -> None:
    """Refuses what lies on a device already: other processes cannot read it."""
    for name, value, kind, instead in (
        ("bounds", bounds, Instances, "Spheres, Boxes, OrientedBoxes or Points"),
        ("occluders", occluders, Occluders, "meshes"),
    ):
        if isinstance(value, kind):
            raise TypeError(
                f"{name}: expected {instead}, got {_arguments.describe(value)}; each worker "
                "uploads them to a device of its own, so pass them as they were before the upload"
            )


def cameras_of(cameras: object) -> tuple[Camera, ...]:
    """One camera or more."""
    expected = "a sequence of Camera"
    if isinstance(cameras, Camera):
        cameras = [cameras]
    if isinstance(cameras, str) or not isinstance(cameras, Sequence):
        way = "; pass list(cameras)" if isinstance(cameras, Iterable) else ""
        raise TypeError(f"cameras: expected {expected}, got {_arguments.describe(cameras)}{way}")
    if not cameras:
        raise ValueError(f"cameras: expected {expected}, got an empty one")
    for number, one in enumerate(cameras):
        if not isinstance(one, Camera):
            got = _arguments.describe(one)
            raise TypeError(f"cameras[{number}]: expected a Camera, got {got}")
    return tuple(cameras)


def depths_of(depths: Any, count: int) -> Any:
    """A function of the view's number, or as many arrays as cameras."""
    if callable(depths):
        return depths
    expected = f"{count} arrays, one for each camera, or a function of the view's number"
    if isinstance(depths, (str, bytes)) or not hasattr(depths, "__getitem__"):
        is_lazy = isinstance(depths, Iterator)
        way = "; pass list(depths), or a function that loads one" if is_lazy else ""
        raise TypeError(f"depths: expected {expected}, got {_arguments.describe(depths)}{way}")
    try:
        given = len(depths)
    except TypeError:
        raise TypeError(f"depths: expected {expected}, got {_arguments.describe(depths)}") from None
    if given != count:
        raise ValueError(f"depths: expected {expected}, got {given}")
    return depths


def meaning_of(
    cameras: Sequence[Camera], depths: Any, kind: Any, scale: Any, invalid: Any, tolerance: Any
) -> dict[str, Any]:
    """What the numbers of depth arrays are, as keywords of `Device.pyramid`; nothing without them.

    They are tried on an image of the first camera's size, so that no worker finds them wrong.
    """
    meaning = {"kind": kind, "scale": scale, "invalid": invalid, "tolerance": tolerance}
    if depths is not None:
        blank = np.broadcast_to(np.float32(0.5), cameras[0].size)
        checked_image("depths[0]", blank, cameras[0], kind, scale, invalid, tolerance)
        return meaning
    for name in ("kind", "invalid", "tolerance"):
        if meaning[name] is not None:
            got = _arguments.describe(meaning[name])
            raise TypeError(f"{name}: expected nothing beside occluders, got {got}")
    if _arguments.number("scale", scale, above=0.0) != 1.0:
        raise ValueError(f"scale: expected 1 beside occluders, got {scale:g}")
    return {}


def render_of(is_rendered: bool, conservative: Any, size: Any, rasteriser: Any) -> dict[str, Any]:
    """Keywords of `Device.render_depth`; nothing where depth is given."""
    conservative = _arguments.flag("conservative", conservative)
    rasteriser = _arguments.choice("rasteriser", rasteriser, words(Rasteriser))
    options: dict[str, Any] = {} if size is None else {"size": _arguments.size("size", size)}
    if not is_rendered:
        for name, value, default in (("conservative", conservative, False), ("size", size, None)):
            if value != default:
                got = _arguments.describe(value)
                raise ValueError(f"{name}: expected {default} beside depths, got {got}")
        return {}
    return options | ({"conservative": True} if conservative else {"rasteriser": rasteriser})


def groups_of(groups: Any, count: int) -> npt.NDArray[np.intp]:
    """The row of each view."""
    if groups is None:
        return np.arange(count)
    expected = f"integer ({count},), a number from 0 on for each camera"
    try:
        array = np.asarray(groups)
    except ValueError as error:
        raise ValueError(f"groups: expected {expected}, got no array ({error})") from None
    if array.dtype.kind not in "iu":
        got = _arguments.describe(array if array.ndim else groups)
        raise TypeError(f"groups: expected {expected}, got {got}")
    if array.shape != (count,):
        raise ValueError(f"groups: expected {expected}, got {_arguments.describe(array)}")
    if array.min() < 0 or array.max() >= count:
        wrong = int(array.min()) if array.min() < 0 else int(array.max())
        raise ValueError(f"groups: expected numbers in 0..{count - 1}, got {wrong}")
    return array.astype(np.intp)


def block_of(block: Any, count: int) -> int:
    """How many views a block has."""
    if block is None:
        return max(1, min(_MOST_VIEWS, count // _LEAST_BLOCKS))
    return _arguments.integer("block", block, low=1, high=2**31 - 1)


def executor_of(executor: Any) -> tuple[Executor | int | None, Any]:
    """None, a number of processes, or an executor; and the Dask client if that was given."""
    if executor is None or isinstance(executor, Executor):
        return executor, None
    if isinstance(executor, (int, np.integer)) and not isinstance(executor, bool):
        return _arguments.integer("executor", executor, low=1, high=4096), None
    if hasattr(executor, "get_executor") and hasattr(executor, "scatter"):
        made = executor.get_executor()
        if isinstance(made, Executor):
            return made, executor
    raise TypeError(
        "executor: expected None, a number of processes, a concurrent.futures.Executor or a Dask "
        f"Client, got {_arguments.describe(executor)}"
    )


def refuse_unsendable(depths: Any, runner: Executor | int | None) -> None:
    """Refuses a function that other processes cannot look up; engines with ways of their own can.

    Processes look a function up by the name of its module and its own.
    """
    if not callable(depths) or not isinstance(runner, (int, ProcessPoolExecutor)):
        return
    expected = (
        "a function on the top level of a module that other processes can import, or an instance "
        "of a class there"
    )
    way = (
        "pass such a function, a list of arrays, or threads: "
        "concurrent.futures.ThreadPoolExecutor(n) as executor"
    )
    try:
        pickle.dumps(depths)
    except Exception as error:  # whatever the object's own way of pickling raises
        got = f"{_arguments.describe(depths)} ({error})"
        raise TypeError(f"depths: expected {expected}, got {got}; {way}") from None
    # A notebook's has no file, and that of a script on stdin is none.
    is_interactive = not Path(getattr(sys.modules["__main__"], "__file__", "<>")).is_file()
    if is_interactive and getattr(depths, "__module__", "") == "__main__":
        got = f"{_arguments.describe(depths)} of an interactive session"
        raise TypeError(f"depths: expected {expected}, got {got}; {way}")


def adapter_of(adapter: Any) -> str | int | None:
    """As `Device` takes it; each worker looks for it on its own machine."""
    if adapter is None or (isinstance(adapter, str) and adapter.strip()):
        return adapter
    if isinstance(adapter, (int, np.integer)) and not isinstance(adapter, bool):
        return _arguments.integer("adapter", adapter, low=0, high=2**31 - 1)
    expected = "an adapter's index, a part of its name, or None"
    wrong = ValueError if isinstance(adapter, str) else TypeError
    raise wrong(f"adapter: expected {expected}, got {_arguments.describe(adapter)}")


def resumed(
    resume: Any, digest: str, rows: int, count: int, views: int
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.bool_]]:
    """The bits to begin with, and which views are done."""
    if resume is None:
        return np.zeros((rows, -(-count // 8)), np.uint8), np.zeros(views, np.bool_)
    _arguments.instance("resume", resume, Sweep, "a Sweep or None")
    if resume.digest != digest:
        raise ValueError(
            "resume: expected a Sweep of the same bounds, cameras, occluders and options, got "
            f"one of others: {resume!r}"
        )
    return np.array(resume.bits), np.array(resume.done)
