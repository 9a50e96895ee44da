"""What the numbers of a depth image mean, and checks of an image against its camera."""

from __future__ import annotations

import numbers
from collections.abc import Collection
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import _arguments, foreign
from ._types import DepthKind, Rounding, words
from .tolerance import numbers_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from ._arguments import FloatArray
    from .camera import Camera

__all__ = [
    "DEPTH_KINDS",
    "METRIC",
    "DepthArray",
    "DepthKind",
    "checked_image",
    "no_data_of",
    "whole_numbers",
]

#: The kinds of depth that an array can hold; see `Device.pyramid`.
DEPTH_KINDS = words(DepthKind)

#: The kinds that have units.
METRIC = ("z", "distance")

#: What sensors and their files write where they saw nothing, by dtype.
NO_DATA: dict[str, tuple[float, ...]] = {"uint16": (0.0, 65535.0), "float16": (65504.0,)}


class DepthArray(NamedTuple):
    """A checked depth image."""

    image: FloatArray | npt.NDArray[np.uint16]
    """float32, float64 or uint16, in the camera's shape; float16 as its bits, in uint16."""
    kind: DepthKind
    """What its numbers are."""
    scale: float
    """World units of one step."""
    invalid: tuple[float, ...]
    """The numbers that mean "no data", as the array's own dtype holds them."""
    rounding: Rounding
    """What its dtype may have rounded, which the upload counts as a tolerance.

    Half floats of every kind count, and float32 of metric kinds.
    For NDC depth `CullOptions.depth_slack` covers float32."""
    tolerance: tuple[float, float] = (0.0, 0.0)
    """How far the upload moves depth away from the eye: a share of it, and world units."""

    def numbers(self) -> npt.NDArray[Any]:
        """The image in a dtype that says what its numbers are: float16 is not in bits here."""
        are_bits = self.rounding == "half" and self.image.dtype == np.uint16
        return self.image.view(np.float16) if are_bits else self.image

    def floats(self) -> FloatArray:
        """The numbers as float32 or float64, which hold all of them exactly."""
        numbers = self.numbers()
        return numbers.astype(np.float32) if numbers.itemsize == 2 else numbers


def checked_image(
    name: str,
    value: object,
    camera: Camera,
    kind: object,
    scale: object,
    invalid: object = None,
    tolerance: object = None,
) -> DepthArray:
    """The image as the engine takes it, and what its numbers mean; or an error that says why."""
    if kind is None:
        listed = ", ".join(f'"{word}"' for word in DEPTH_KINDS)
        raise TypeError(
            f"kind: expected one of {listed}, got None; "
            "there is no default, a wrong guess hides things"
        )
    kind_: DepthKind = _arguments.choice("kind", kind, DEPTH_KINDS)  # type: ignore[assignment]
    if kind_ not in METRIC and kind_ != camera.depth_kind:
        meaning = {"ndc": "0 near and 1 far", "reversed_ndc": "1 near and 0 far"}
        raise ValueError(
            f'kind: expected "{camera.depth_kind}" ({meaning[camera.depth_kind]}) for a camera '
            f'with reversed_z={camera.reversed_z}, got "{kind_}" ({meaning[kind_]})'
        )
    scale_ = _arguments.number("scale", scale, above=0.0)
    if scale_ != 1.0 and kind_ not in METRIC:
        raise ValueError(
            f'scale: expected 1 for the kind "{kind_}", got {scale_:g}; '
            'only "z" and "distance" have units'
        )
    mask: npt.NDArray[np.bool_] | None = None
    if _arguments.is_masked(value):
        value = np.ma.array(value)  # numpy.asarray would drop the masks of rows
    if isinstance(value, np.ma.MaskedArray):
        mask = None if value.mask is np.ma.nomask else np.asarray(value.mask)
        value = value.data
    elif not isinstance(value, (np.ndarray, list, tuple, str, bytes, type(None))):
        # An image of another library, or a buffer: its dtype counts as that of an array does.
        expected = f"float {camera.size} (the camera's size)"
        array = np.asarray(foreign.as_numpy(name, expected, value))
        value = array if array.ndim else value
    elif isinstance(value, (list, tuple)):
        value = _from_rows(name, value)
    if isinstance(value, np.ndarray):
        value = _without_channel(value, camera.size)
        mask = None if mask is None else _without_channel(mask, camera.size)
        _refuse_dtype(name, value, kind_)
        _refuse_shape(name, value, camera)
        value = whole_numbers(name, value, kind_, invalid)
    dtype = value.dtype if isinstance(value, np.ndarray) else np.dtype(np.float64)
    image: FloatArray | npt.NDArray[np.uint16]
    if dtype.kind in "uf" and dtype.itemsize == 2:
        narrow = _arguments.copied(name, value, dtype.newbyteorder("="))  # type: ignore[arg-type]
        if mask is not None and mask.any():
            # Exact, and has a NaN for what is masked.
            narrow = narrow.astype(np.float32)
        image = narrow if narrow.dtype.kind == "u" else _bits_or_floats(narrow)
    else:
        image = _arguments.floats(name, value, camera.size, why=" (the camera's size)")
    if mask is not None and mask.any():
        # What is masked is "no data", whatever number lies there.
        image = np.where(mask, image.dtype.type(np.nan), image)
    moved = numbers_of("tolerance", tolerance)
    no_data = no_data_of(invalid, dtype)
    return DepthArray(image, kind_, scale_, no_data, _rounding(dtype, kind_), moved)


def _bits_or_floats(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The bits of float16; float32 as it is."""
    return array.view(np.uint16) if array.dtype.itemsize == 2 else array


def _rounding(dtype: np.dtype[Any], kind: DepthKind) -> Rounding:
    """What the dtype may have rounded, in any byte order; whole numbers and float64 are exact."""
    if dtype.kind != "f" or dtype.itemsize > 4:
        return "none"
    if dtype.itemsize == 2:
        return "half"
    return "single" if kind in METRIC else "none"


def _from_rows(name: str, rows: Sequence[Any]) -> Any:
    """Listed rows or numbers of NumPy, at any depth, as an array of their dtype.

    Python's own numbers stay as they are.
    Several dtypes are refused: NumPy would make a wider one of them, which does not say what the
    narrower ones had rounded.
    """
    try:
        array = np.asarray(rows)
    except ValueError:
        return rows  # ragged; refused elsewhere
    has_a_dtype = array.dtype not in (np.float64, np.int64, np.bool_)
    left: list[Any] = [rows]
    while left:
        item = left.pop()
        if isinstance(item, (list, tuple)):
            left.extend(item)
        elif hasattr(item, "dtype"):
            has_a_dtype = True
            of_item = np.asarray(item).dtype
            if of_item.newbyteorder("=") != array.dtype.newbyteorder("="):
                raise TypeError(
                    f"{name}: expected numbers of one dtype, got a list of {array.dtype} with "
                    f"{of_item} in it; make one array of the dtype that they were rounded to"
                )
    return array if has_a_dtype else rows


def _without_channel(array: npt.NDArray[Any], size: tuple[int, int]) -> npt.NDArray[Any]:
    """An image whose one channel has an axis of its own, last or first, without this axis."""
    if array.shape == (*size, 1):
        return array[..., 0]
    return array[0] if array.shape == (1, *size) else array


def whole_numbers(name: str, array: Any, kind: object, invalid: object) -> npt.NDArray[Any]:
    """Wide whole numbers as uint16 if all fit, or else as float64; other arrays as they are.

    Pillow reads a 16-bit image as int32 (its mode I), with a sensor's two numbers for "no data".
    Negative numbers are no depth in any kind.
    """
    is_wide = array.dtype.kind in "iu" and array.dtype.itemsize > 1 and array.dtype.name != "uint16"
    if not is_wide or kind not in METRIC or not array.size:
        return array  # type: ignore[no-any-return]
    if invalid is None and array.max() <= np.iinfo(np.uint16).max:
        return np.where(array < 0, 0, array).astype(np.uint16)
    return _arguments.floats(name, array, array.shape)


def _refuse_dtype(name: str, array: npt.NDArray[Any], kind: DepthKind) -> None:
    """Refuses truth values, whole numbers of 8 bits, and those of a kind that is not metric."""
    metric = kind in METRIC
    if array.dtype.kind not in "iub" or (
        metric and array.dtype.kind != "b" and array.dtype.itemsize > 1
    ):
        return
    hint = ""
    if not metric and array.dtype.name == "uint16":
        hint = (
            f"; the numbers of a 16-bit depth buffer become depth by {name} / 65535, which a cull "
            "takes with depth_slack_abs=1 / 65535"
        )
    elif metric and array.dtype.kind != "b":
        hint = (
            "; an image of 8 bits is a picture of depth, not depth: read the file that has the "
            "sensor's numbers, or pass .astype(np.float32) if these are in units of scale"
        )
    raise TypeError(
        f"{name}: expected float (height, width), or whole numbers of 16 bits or more for the "
        f'kinds "z" and "distance", got {_arguments.describe(array)} of kind "{kind}"{hint}'
    )


def _refuse_shape(name: str, array: npt.NDArray[Any], camera: Camera) -> None:
    size = camera.size
    if array.ndim == 0 or array.shape == size:
        return  # a single number is refused elsewhere
    expected = "uint16" if array.dtype.kind == "u" else "float"
    hint = ""
    if array.ndim == 2 and 0 not in array.shape and max(array.shape) <= _arguments.LARGEST_SIDE:
        hint = (
            f"; a smaller or larger image of the same view goes with camera.resized({name}.shape)"
        )
        if array.shape == size[::-1]:
            hint = f"; it looks transposed, and a turned image needs a turned camera{hint}"
    elif array.shape[:2] == size and array.ndim == 3:
        hint = f"; if all channels are the same depth, pass {name}[..., 0]"
    elif array.shape == (size[0] * size[1],):
        hint = f"; pass {name}.reshape(camera.size), if it is stored row by row"
    got = _arguments.describe(array)
    raise ValueError(f"{name}: expected {expected} {size} (the camera's size), got {got}{hint}")


def no_data_of(invalid: object, dtype: np.dtype[Any]) -> tuple[float, ...]:
    """The caller's values as `dtype` holds them, or for None the convention of the dtype."""
    if invalid is None:
        return NO_DATA.get(dtype.name, ())
    expected = (
        "None or a collection of the numbers that mean no data, "
        "in the array's own units (before scale)"
    )
    if isinstance(invalid, np.ndarray) and invalid.ndim == 1 and invalid.dtype.kind in "fiu":
        invalid = invalid.tolist()
    if isinstance(invalid, (str, bytes, np.ndarray)) or not isinstance(invalid, Collection):
        hint = f"; pass [{invalid}]" if isinstance(invalid, (int, float)) else ""
        got = _arguments.describe(invalid)
        raise TypeError(f"invalid: expected {expected}, got {got}{hint}")
    found = []
    for value in invalid:
        if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
            raise TypeError(f"invalid: expected {expected}, got {_arguments.describe(value)} in it")
        if float(value) == np.inf and dtype.kind == "f":
            found.append(np.inf)  # otherwise it means that nothing is there
            continue
        if not np.isfinite(float(value)):
            continue  # never a depth in any case
        held = float(value)
        if dtype.kind == "u":
            if held != int(held) or not 0 <= held <= np.iinfo(dtype).max:
                raise ValueError(
                    f"invalid: expected {expected}, got {value!r}, which no {dtype} is"
                )
        else:
            with np.errstate(over="ignore"):
                held = float(np.asarray(value, dtype=np.float64).astype(dtype))
            if not np.isfinite(held):
                raise ValueError(
                    f"invalid: expected {expected}, got {value!r}, which no {dtype} is"
                )
        found.append(held)
    return tuple(found)
