"""What `Pyramid.update` takes: a rectangle that was drawn into, or an array that replaces one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import _arguments, foreign
from .samples import checked_samples

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._core import DepthImage as CoreDepthImage
    from .camera import Camera
    from .depth import DepthArray

__all__ = ["Source", "rectangle", "replacement"]

Rectangle = tuple[int, int, int, int]


class Source(NamedTuple):
    """The depth image of a pyramid, and of an uploaded one what its numbers meant."""

    image: CoreDepthImage
    """The image on the device."""
    given: DepthArray | None = None
    """The array as it was checked, without its numbers; None for an image of `render_depth`."""
    dtype: str = ""
    """The array's dtype."""
    samples: int = 1
    """How many samples a pixel had."""
    invalid: Any = None
    """The caller's values for "no data"."""

    @classmethod
    def uploaded(cls, image: CoreDepthImage, given: Sequence[DepthArray], invalid: Any) -> Source:
        """The source of a pyramid of these images, one for each sample."""
        first = given[0]
        empty = first._replace(image=first.image[:0])
        return cls(image, empty, first.numbers().dtype.name, len(given), invalid)


def rectangle(name: str, value: object, size: tuple[int, int]) -> Rectangle | None:
    """``(x0, y0, x1, y1)`` within an image of `size`, both ends included."""
    if value is None:
        return None
    height, width = size
    expected = (
        f"(x0, y0, x1, y1) with 0 <= x0 <= x1 < {width} and 0 <= y0 <= y1 < {height}, both ends "
        "included, or None"
    )
    if isinstance(value, (str, bytes)) or not isinstance(value, (Sequence, np.ndarray)):
        raise TypeError(f"{name}: expected {expected}, got {_arguments.describe(value)}")
    try:
        x0, y0, x1, y1 = (_arguments.integer(name, v, low=0, high=2**31) for v in value)
    except ValueError:
        raise ValueError(f"{name}: expected {expected}, got {_arguments.describe(value)}") from None
    if not (x0 <= x1 < width and y0 <= y1 < height):
        raise ValueError(f"{name}: expected {expected}, got {_arguments.describe(value)}")
    return x0, y0, x1, y1


def replacement(
    source: Source, camera: Camera, row: object, column: object, array: Any
) -> tuple[Rectangle, list[DepthArray]]:
    """The rectangle that an array replaces, and whole rows of the image for each sample.

    Beside the rectangle's columns the rows hold zeros, which are not used.
    """
    height, width = camera.size
    given = source.given
    if given is None:
        raise ValueError(
            "array: expected None for a pyramid of a DepthImage of render_depth, which is updated "
            f"by hiz.update(depth, rectangle), got {_arguments.describe(array)}"
        )
    row = _arguments.integer("row", row, low=0, high=height - 1)
    column = _arguments.integer("column", column, low=0, high=width - 1)
    array = _checked_shape(source, array, (height - row, width - column), (row, column))
    part = camera.resized(array.shape[:2])
    planes = checked_samples("array", array, part, given.kind, given.scale, source.invalid)
    planes = [plane._replace(tolerance=given.tolerance) for plane in planes]
    rows, columns = array.shape[:2]
    return (
        (column, row, column + columns - 1, row + rows - 1),
        [plane._replace(image=_widened(plane.image, column, width)) for plane in planes],
    )


def _checked_shape(
    source: Source, array: Any, most: tuple[int, int], begin: tuple[int, int]
) -> npt.NDArray[Any]:
    """The array, of the dtype and the number of samples of the pyramid's own."""
    samples = f", {source.samples}" if source.samples > 1 else ""
    expected = (
        f"{source.dtype} (height, width{samples}) with 1 <= height <= {most[0]} and "
        f"1 <= width <= {most[1]}, which is what lies from row {begin[0]} and column {begin[1]} on"
    )
    array = foreign.as_numpy("array", expected, array)
    if not isinstance(array, np.ndarray):
        raise TypeError(f"array: expected {expected}, got {_arguments.describe(array)}")
    if array.dtype.name != source.dtype:
        raise TypeError(
            f"array: expected {expected}, as the pyramid's own image, got "
            f"{_arguments.describe(array)}"
        )
    has_samples = array.shape[2:] == ((source.samples,) if source.samples > 1 else ())
    fits = all(1 <= side <= limit for side, limit in zip(array.shape, most, strict=False))
    if array.ndim < 2 or not has_samples or not fits:
        raise ValueError(f"array: expected {expected}, got {_arguments.describe(array)}")
    return array


def _widened(part: npt.NDArray[Any], column: int, width: int) -> npt.NDArray[Any]:
    """Whole rows with the part from `column` on."""
    rows = np.zeros((part.shape[0], width), part.dtype)
    rows[:, column : column + part.shape[1]] = part
    return rows
