"""Checks of arguments, in one place, so that every message reads the same.

A message is ``<parameter>: expected <what>, got <what came>``.
It is a `TypeError` when the type or the kind of dtype is wrong, and a `ValueError` when the shape
or the value is.
An array that already is as the engine takes it is not copied: float32 or float64, C order, native
byte order, aligned.
"""

from __future__ import annotations

import functools
import inspect
import math
import numbers
import operator
import os
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final, ParamSpec, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from . import foreign
from .errors import OutOfMemoryError

FloatArray: TypeAlias = npt.NDArray[np.float32] | npt.NDArray[np.float64]
Size: TypeAlias = tuple[int, int]
T = TypeVar("T")
P = ParamSpec("P")

#: The largest image side of a camera; a device may allow less (`Device.max_image_side`).
LARGEST_SIDE = 32768
#: Whole numbers up to here are exact in float64.
LARGEST_EXACT_INTEGER = 2**53
#: The coarsest level of the largest image.
COARSEST_LEVEL = 15
#: Rows that are checked together, so that no temporary array is as long as the argument.
BLOCK = 2**16


def describe(value: object) -> str:
    """What came, in a few words: ``(3, 100) int64`` for arrays, type and value for the rest."""
    if isinstance(value, (np.ndarray, np.generic)) and value.ndim > 0:
        return f"{_shape_text(value.shape)} {value.dtype}"
    if value is None:
        return "None"
    if hasattr(value, "__dlpack__") and not isinstance(value, (np.ndarray, np.generic)):
        return foreign.described(value)
    text = repr(value)
    if len(text) > 60:
        text = text[:57] + "..."
    return f"{type(value).__name__} {text}"


def _shape_text(shape: Sequence[int | str]) -> str:
    """``(N, 3)``: numpy's own spelling, with letters for the free sides."""
    inner = ", ".join(str(side) for side in shape)
    return f"({inner},)" if len(shape) == 1 else f"({inner})"


def explained(
    texts: Mapping[str, str] = MappingProxyType({}),
) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """A decorator that says more than Python does about keywords that are missing or unknown.

    `texts` has what follows ``<name>: `` in the `TypeError`.
    Its names are parameters without a default, or words that are no parameters and are often passed
    all the same.
    Of other words that are no parameters, the closest parameter is named.
    """

    def decorate(maker: Callable[P, T]) -> Callable[P, T]:
        parameters = inspect.signature(maker).parameters
        known = frozenset(parameters)
        told = [name for name in parameters if name not in ("self", "cls")]
        needed = [
            name
            for name in texts
            if name in parameters and parameters[name].default is inspect.Parameter.empty
        ]

        @functools.wraps(maker)
        def checked(*args: P.args, **kwargs: P.kwargs) -> T:
            missing = [name for name in needed if name not in kwargs] if needed else needed
            if missing or not known.issuperset(kwargs):
                for name in [*missing, *sorted(kwargs.keys() - known)]:
                    if name in texts:
                        raise TypeError(f"{name}: {texts[name]}")
                refuse_unknown(kwargs, told)
            return maker(*args, **kwargs)

        return checked

    return decorate


#: What is meant by words that others use, and that look like another parameter; the first that is
#: one.
_MEANT: Final[Mapping[str, tuple[str, ...]]] = {
    "depth_scale": ("scale",),
    "units": ("scale",),
    "unit": ("scale",),
    "depth_kind": ("kind",),
    "workers": ("executor",),
    "n_jobs": ("executor",),
    "processes": ("executor",),
    "threads": ("executor",),
    # Of cameras.
    **dict.fromkeys(
        ("fov", "fov_y", "fovy", "fov_deg", "vfov", "yfov"), ("fov_y_deg", "fov_x_deg", "height")
    ),
    **dict.fromkeys(("fov_x", "fovx", "hfov", "xfov"), ("fov_x_deg", "fov_y_deg", "width")),
    **dict.fromkeys(("K", "intrinsics", "intrinsic", "camera_matrix"), ("k",)),
    **dict.fromkeys(
        ("resolution", "shape", "image_size", "viewport", "width", "height"), ("size",)
    ),
    **dict.fromkeys(("position", "origin", "location", "pos"), ("eye", "centers", "positions")),
    **dict.fromkeys(("at", "lookat", "look_at", "direction", "forward"), ("target",)),
    **dict.fromkeys(("znear", "z_near", "near_plane", "clip_start"), ("near",)),
    **dict.fromkeys(("zfar", "z_far", "far_plane", "clip_end"), ("far",)),
    # The closest word would be the inverse.
    **dict.fromkeys(
        ("world_to_camera", "world_to_cam", "world2camera", "world2cam"), ("camera_from_world",)
    ),
    **dict.fromkeys(
        ("camera_to_world", "cam_to_world", "camera2world", "cam2world"), ("world_from_camera",)
    ),
    # Of meshes and points.
    **dict.fromkeys(("faces", "indices"), ("triangles",)),
    **dict.fromkeys(("points", "xyz"), ("positions", "vertices")),
    # Of the others.
    **dict.fromkeys(("extents", "sizes", "dimensions", "half_extents"), ("half_sizes",)),
    "absolute": ("abs",),
    "relative": ("rel",),
    "name": ("adapter",),
    "depth_image": ("depth", "depths"),
    "observer": ("eye",),
    "radius": ("radii", "angular_radius_deg", "radius_px"),
}
#: Words that are less alike have nothing to do with each other.
_ALIKE: Final = 0.5


def refuse_unknown(
    keywords: Iterable[str], known: Collection[str], of: Callable[..., object] | None = None
) -> None:
    """A `TypeError` for the first keyword that is not known; it names the closest one that is.

    `of` is the function that was called, whose own parameters are told, too.
    """
    for name in keywords:
        if name not in known:
            # Loaded here: only this error needs it.
            from difflib import get_close_matches

            told = [*(_own_names(of) if of is not None else ()), *known]
            meant = [word for word in _MEANT.get(name, ()) if word in told]
            closest = (meant or get_close_matches(name, told, 1, cutoff=_ALIKE))[:1]
            which = "".join(f"the closest is {word}, and " for word in closest)
            raise TypeError(f"{name}: expected no such parameter; {which}all are {', '.join(told)}")


def _own_names(function: Callable[..., object]) -> list[str]:
    """The names of a function's own parameters."""
    parameters = inspect.signature(function).parameters.values()
    return [one.name for one in parameters if one.kind is not inspect.Parameter.VAR_KEYWORD]


def named(made: type[T]) -> type[T]:
    """A decorator of data classes whose keywords are refused as those of `explained` are."""
    made.__init__ = explained()(made.__init__)  # type: ignore[method-assign]
    return made


def _wrong_type(name: str, expected: str, value: object) -> TypeError:
    return TypeError(f"{name}: expected {expected}, got {describe(value)}")


def _wrong_value(name: str, expected: str, value: object) -> ValueError:
    return ValueError(f"{name}: expected {expected}, got {describe(value)}")


def is_masked(value: object) -> bool:
    """Whether it is a masked array, or has rows that are: NumPy drops the masks of rows."""
    if isinstance(value, (list, tuple)):
        return any(isinstance(row, np.ma.MaskedArray) for row in value)
    return isinstance(value, np.ma.MaskedArray)


def _as_array(name: str, expected: str, value: object) -> npt.NDArray[Any]:
    """`value` as an array of numbers, itself if it is one; lists of Python ints become float64."""
    if is_masked(value):
        # Only floats have a NaN to fill with, and only some parameters take a NaN.
        is_float = isinstance(value, np.ma.MaskedArray) and value.dtype.kind == "f"
        way = "fill it first, e.g. with " + (
            ".filled(np.nan)" if is_float else ".astype(np.float64).filled(np.nan)"
        )
        if "finite" in expected:
            way = "leave out what is masked"
        raise TypeError(f"{name}: expected {expected}, got a masked array; {way}")
    if isinstance(value, (str, bytes)) or value is None:
        raise _wrong_type(name, expected, value)
    value = foreign.as_numpy(name, expected, value)
    try:
        array = np.asarray(value)
    except ValueError as error:  # a ragged list
        raise ValueError(
            f"{name}: expected {expected}, got a sequence that is no array ({error})"
        ) from None
    if array.dtype.kind in "iu" and not hasattr(value, "dtype"):
        if array.size and max(abs(int(array.min())), abs(int(array.max()))) > LARGEST_EXACT_INTEGER:
            raise ValueError(f"{name}: expected {expected}, got integers that float64 cannot hold")
        array = array.astype(np.float64)
    return array


def _without_rows(value: object, shape: Sequence[int | str]) -> object:
    """An empty list or tuple as an array of no rows, where that is a shape; else as it came."""
    if isinstance(value, (list, tuple)) and not value and len(shape) > 1:
        rest = [side for side in shape[1:] if isinstance(side, int)]
        if (isinstance(shape[0], str) or shape[0] == 0) and len(rest) == len(shape) - 1:
            return np.zeros((0, *rest))
    return value


def _fits(shape: Sequence[int | str], sides: Sequence[int]) -> bool:
    """Whether an array of these sides has this shape (letters are free sides)."""
    return len(sides) == len(shape) and all(
        isinstance(wanted, str) or wanted == side for wanted, side in zip(shape, sides, strict=True)
    )


def shape_hint(shape: Sequence[int | str], sides: Sequence[int]) -> str:
    """The index that makes the shape right, if there is one."""
    if sides and sides[-1] == 1 and _fits(shape, sides[:-1]):
        return "; drop the last axis with [..., 0]"
    if sides and sides[0] == 1 and _fits(shape, sides[1:]):
        return "; drop the first axis with [0]"
    # Two free or two fixed sides (an image) may be in the wrong order elsewhere.
    if len(sides) == 2 and len({type(side) for side in shape}) == 2 and _fits(shape, sides[::-1]):
        return "; it looks transposed, pass .T"
    rest = [side for side in shape[1:] if isinstance(side, int) and side > 0]
    if len(sides) == 1 and rest and len(rest) == len(shape) - 1:
        # One row, several of them in a line, or none at all.
        rows, over = divmod(sides[0], math.prod(rest))
        if not over and (isinstance(shape[0], str) or shape[0] == rows):
            first = -1 if isinstance(shape[0], str) and rows else rows
            return f"; pass .reshape({first}, {', '.join(map(str, rest))})"
    if len(sides) == 2 and shape == ("N", 3) and sides[1] > 3:
        return "; pass [:, :3], if these columns are x, y, z"
    return ""


def _as_code(name: str, value: object, hint: str) -> str:
    """A hint at an index, as code for what came: lists and data frames become arrays first."""
    first = f"numpy.asarray({name})" if isinstance(value, (list, tuple)) else ""
    first = f"{name}.to_numpy()" if hasattr(value, "to_numpy") else first
    for start in (" .", " ["):
        hint = hint.replace(start, f" {first}{start[1:]}") if first else hint
    return hint


def _check_shape(
    name: str,
    expected: str,
    array: npt.NDArray[Any],
    shape: Sequence[int | str],
    hint: str = "",
    value: object = None,
) -> None:
    """Refuses another shape; `value` is what became the array."""
    if not _fits(shape, array.shape):
        hint = _as_code(name, value, shape_hint(shape, array.shape)) or hint
        raise ValueError(
            f"{name}: expected {expected}, got {_shape_text(array.shape)} {array.dtype}{hint}"
        )


def _host_memory() -> int:
    """Bytes of memory of this machine; without bound where the system does not tell."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return sys.maxsize


def copied(name: str, array: npt.NDArray[Any], wanted: npt.DTypeLike) -> npt.NDArray[Any]:
    """The array in this dtype, native, aligned and in C order; itself where it is that.

    A broadcast view can have terabytes that are stored nowhere, so a copy that this machine cannot
    hold is refused before it is tried.
    """
    flags = array.flags
    if not (flags.c_contiguous and flags.aligned and array.dtype == wanted):
        needed, there = array.size * np.dtype(wanted).itemsize, _host_memory()
        if needed > there:
            got = describe(array)
            raise OutOfMemoryError(
                f"{name}: a copy of {got} takes {needed} bytes, this machine has {there}"
            )
    try:
        return np.require(array, dtype=wanted, requirements=["C", "A"])
    except MemoryError:
        raise OutOfMemoryError(f"{name}: no memory for a copy of {describe(array)}") from None


def _ready(name: str, array: npt.NDArray[Any]) -> FloatArray:
    """The array as the engine reads it: float32 or float64; itself where it is that."""
    # A float16 widens exactly.
    return copied(name, array, np.float64 if array.dtype.itemsize == 8 else np.float32)


def floats(
    name: str,
    value: object,
    shape: Sequence[int | str],
    *,
    why: str = "",
    hint: str = "",
    whole: bool = True,
) -> FloatArray:
    """A float array of this shape (letters are free sides), converted only where it has to be.

    `why` follows the expected shape in a message.
    `hint` ends the message of a wrong shape for which no index makes it right.
    With `whole` an array of whole numbers will do, if floats hold them exactly.
    """
    expected = f"float {_shape_text(shape)}{why}"
    array = _as_array(name, expected, _without_rows(value, shape))
    is_whole = whole and array.dtype.kind in "iu"
    if not is_whole and (array.dtype.kind != "f" or array.dtype.itemsize not in (2, 4, 8)):
        got = describe(array if array.ndim else value)
        way = (
            "; convert it with .astype(np.float64)"
            if array.dtype.kind in "iufO" and array.ndim
            else ""
        )
        if hasattr(value, "to_numpy") and hasattr(value, "columns"):
            # A data frame has names of columns beside the numbers, or texts.
            way = f'; pass {name}[["x", "y", "z"]].to_numpy(), with the names of its columns'
        raise TypeError(f"{name}: expected {expected}, got {got}{way}")
    _check_shape(name, expected, array, shape, hint, value)
    return _exact(name, expected, array) if is_whole else _ready(name, array)


def _exact(name: str, expected: str, array: npt.NDArray[Any]) -> FloatArray:
    """Whole numbers as floats: float32 holds 16 bits exactly, float64 53."""
    made = copied(name, array, np.float32 if array.dtype.itemsize <= 2 else np.float64)
    if array.dtype.itemsize == 8 and array.size:
        largest = max(abs(int(array.min())), abs(int(array.max())))
        if largest > LARGEST_EXACT_INTEGER:
            raise ValueError(
                f"{name}: expected {expected}, got {describe(array)} with {largest} in it, "
                "which float64 cannot hold"
            )
    return made


def _is_real(value: object) -> bool:
    """Whether it is one number; truth values and NumPy's durations claim to be, and are not."""
    return isinstance(value, numbers.Real) and not isinstance(
        value, (bool, np.bool_, np.timedelta64)
    )


def floats_or_scalar(name: str, value: object, count: int) -> FloatArray:
    """A float array ``(count,)``, or one number for all of them."""
    if _is_real(value):
        try:
            return np.full(count, float(value), dtype=np.float64)  # type: ignore[arg-type]
        except OverflowError:
            raise _wrong_value(name, f"float ({count},) or one number", value) from None
    array = foreign.as_numpy(name, f"float ({count},) or one number", value)
    if isinstance(array, np.ndarray) and array.ndim == 0 and array.dtype.kind in "fiu":
        return np.full(count, float(array), dtype=np.float64)
    return floats(name, value, (count,), why=" or one number")


def finite_floats(name: str, value: object, shape: Sequence[int | str]) -> FloatArray:
    """`floats`, all of them finite."""
    if is_masked(value):
        expected = f"finite float {_shape_text(shape)}"
        raise TypeError(
            f"{name}: expected {expected}, got a masked array; leave out what is masked"
        )
    array = floats(name, value, shape)
    blocks = (array[start : start + BLOCK] for start in range(0, len(array), BLOCK))
    bad = sum(int(np.count_nonzero(~np.isfinite(block))) for block in blocks)
    if bad:
        raise ValueError(
            f"{name}: expected finite float {_shape_text(shape)}, got {bad} NaN or infinite numbers"
        )
    return array


def numbers_of_shape(
    name: str, value: object, *shapes: Sequence[int], of: str = "", hint: str = ""
) -> npt.NDArray[np.float64]:
    """A small float64 array of finite numbers, such as a vector or matrix of a camera.

    Integers are welcome here, and any of `shapes` will do.
    In a message `of` comes before the shapes, and `hint` after what came.
    """
    expected = f"{of}{' or '.join(map(_shape_text, shapes))} finite numbers"
    array = _as_array(name, expected, value)
    if array.dtype.kind not in "fiu" or array.dtype.itemsize > 8:
        raise TypeError(
            f"{name}: expected {expected}, got {describe(array if array.ndim else value)}"
        )
    if array.shape not in shapes:
        ways = (_as_code(name, value, shape_hint(shape, array.shape)) for shape in shapes)
        _check_shape(name, expected, array, shapes[-1], next(filter(None, ways), hint), value)
    result: npt.NDArray[np.float64] = np.array(array, dtype=np.float64, order="C")
    if not np.isfinite(result).all():
        raise ValueError(
            f"{name}: expected {expected}, got {' '.join(str(result.tolist()).split())}"
        )
    return result


def vector(name: str, value: object) -> tuple[float, float, float]:
    """Three finite numbers."""
    x, y, z = numbers_of_shape(name, value, (3,)).tolist()
    return (x, y, z)


def matrix(name: str, value: object) -> npt.NDArray[np.float64]:
    """A ``(4, 4)`` matrix of finite numbers that can be inverted."""
    result = numbers_of_shape(name, value, (4, 4))
    _refuse_singular(name, "an invertible (4, 4) matrix", result)
    return result


def pose(name: str, value: object) -> npt.NDArray[np.float64]:
    """An invertible ``(4, 4)`` matrix whose last row is 0, 0, 0, 1.

    `value` is such a matrix, ``(3, 4)`` without the last row, or a pair ``(R, t)``.
    """
    result = np.eye(4)
    if isinstance(value, (tuple, list)) and len(value) == 2:
        result[:3, :3], result[:3, 3] = _rotation_and_translation(name, *value)
    else:
        hint = "; pass a rotation and a translation as a pair, (R, t)"
        given = numbers_of_shape(name, value, (3, 4), (4, 4), hint=hint)
        result[: len(given)] = given
    _refuse_singular(name, "an invertible matrix", result)
    check_affine(name, result)
    return result


def _rotation_and_translation(
    name: str, rotation: object, translation: object
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    hint = "; a rotation vector becomes a matrix by cv2.Rodrigues(rvec)[0]"
    linear = numbers_of_shape(name, rotation, (3, 3), of="R of a pair (R, t) to be ", hint=hint)
    # Translations of OpenCV are columns.
    moved = numbers_of_shape(
        name, translation, (3, 1), (1, 3), (3,), of="t of a pair (R, t) to be "
    )
    return linear, moved.reshape(3)


def check_affine(name: str, matrices: npt.NDArray[Any]) -> None:
    """Refuses a last row other than 0, 0, 0, 1; the usual cause, a transposed matrix, is named."""
    if not (matrices[..., 3, :] == (0.0, 0.0, 0.0, 1.0)).all():
        rows = matrices[..., 3, :].reshape(-1, 4)
        bad = rows[(rows != (0.0, 0.0, 0.0, 1.0)).any(axis=1)][0].tolist()
        hint = ""
        if (matrices[..., :, 3] == (0.0, 0.0, 0.0, 1.0)).all():
            hint = "; it looks transposed: vectors are columns here, clip = M @ [x, y, z, 1]"
        raise ValueError(f"{name}: expected the last row to be 0, 0, 0, 1, got {bad}{hint}")


def _refuse_singular(name: str, expected: str, square: npt.NDArray[np.float64]) -> None:
    """Refuses a matrix that is singular in float64, whatever the scales of its rows and columns.

    They are brought to one scale first, so a far plane of 1e9 is fine.
    """
    scaled = square.copy()
    for axis in (1, 0, 1, 0):
        largest = np.abs(scaled).max(axis=axis, keepdims=True)
        if not (largest > 0.0).all():
            raise ValueError(
                f"{name}: expected {expected}, got a singular one (a row or column is zero)"
            )
        scaled = scaled / np.exp2(np.floor(np.log2(largest)))
    if np.linalg.svd(scaled, compute_uv=False)[-1] < 1e-15:
        raise ValueError(f"{name}: expected {expected}, got a singular one")


def number(
    name: str,
    value: object,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
) -> float:
    """One finite real number, within the given bounds."""
    parts = ["a finite number"]
    parts += [f"above {above:g}"] if above is not None else []
    parts += [f"at least {at_least:g}"] if at_least is not None else []
    parts += [f"below {below:g}"] if below is not None else []
    parts += [f"at most {at_most:g}"] if at_most is not None else []
    expected = parts[0] + (" " + " and ".join(parts[1:]) if len(parts) > 1 else "")
    if isinstance(value, np.ndarray) and value.ndim == 0 and value.dtype.kind in "fiu":
        value = value.item()
    if not _is_real(value):
        raise _wrong_type(name, expected, value)
    try:
        result = float(value)  # type: ignore[arg-type]
    except OverflowError:
        raise _wrong_value(name, expected, value) from None
    fits = math.isfinite(result)
    fits = fits and (above is None or result > above) and (below is None or result < below)
    fits = (
        fits and (at_least is None or result >= at_least) and (at_most is None or result <= at_most)
    )
    if not fits:
        raise _wrong_value(name, expected, value)
    return result


def integer(name: str, value: object, *, low: int, high: int) -> int:
    """One whole number of ``low..high``, both included."""
    expected = f"an integer in {low}..{high}"
    if isinstance(value, (bool, np.bool_)):
        raise _wrong_type(name, expected, value)
    try:
        result = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise _wrong_type(name, expected, value) from None
    if not low <= result <= high:
        raise _wrong_value(name, expected, value)
    return result


def index(name: str, value: object, count: int, *, what: str = "an integer", none: str) -> int:
    """One of ``0..count - 1``; an `IndexError` says what the number may have been meant to be.

    `none` says why there is nothing where `count` is 0.
    """
    try:
        return integer(name, value, low=0, high=count - 1)
    except ValueError:
        number = operator.index(value)  # type: ignore[arg-type]
        expected = f"{what} in 0..{count - 1}" if count else f"nothing, for {none}"
        hint = ""
        if -count <= number < 0:
            hint = f"; counted from the end that is {count + number}"
        elif number == count and count:
            hint = "; the first one is 0"
        raise IndexError(f"{name}: expected {expected}, got {number}{hint}") from None


def size(name: str, value: object) -> Size:
    """An image size ``(height, width)`` of at least one pixel."""
    expected = f"(height, width), two integers in 1..{LARGEST_SIDE}"
    if isinstance(value, (str, bytes)) or not isinstance(value, (Sequence, np.ndarray)):
        raise _wrong_type(name, expected, value)
    if (isinstance(value, np.ndarray) and value.ndim == 0) or len(value) != 2:
        hint = "; of an image with channels pass .shape[:2]" if np.shape(value) == (3,) else ""
        raise ValueError(f"{name}: expected {expected}, got {describe(value)}{hint}")
    sides = []
    for side in value:
        try:
            if isinstance(side, (bool, np.bool_)):
                raise TypeError
            sides.append(operator.index(side))
        except TypeError:
            raise _wrong_type(name, expected, value) from None
    if not all(1 <= side <= LARGEST_SIDE for side in sides):
        raise _wrong_value(name, expected, value)
    return (sides[0], sides[1])


def stored_levels(name: str, value: object) -> tuple[int, int]:
    """The first and the last level that a pyramid stores, of 1 to 15; None stores all of them."""
    if value is None:
        return 1, COARSEST_LEVEL
    if isinstance(value, (tuple, list)):
        if len(value) != 2:
            expected = "None, a level or a pair (first, last)"
            raise ValueError(f"{name}: expected {expected}, got {describe(value)}")
        first, last = (integer(name, k, low=1, high=COARSEST_LEVEL) for k in value)
        if first > last:
            raise ValueError(f"{name}: expected first <= last, got ({first}, {last})")
        return first, last
    return integer(name, value, low=1, high=COARSEST_LEVEL), COARSEST_LEVEL


def flag(name: str, value: object) -> bool:
    """True or False; other values that count as true are refused."""
    if not isinstance(value, (bool, np.bool_)):
        raise _wrong_type(name, "True or False", value)
    return bool(value)


def choice(name: str, value: object, choices: Iterable[str]) -> str:
    """One of a few words."""
    known = tuple(choices)
    # Each cull with keywords comes here, so the text is made for errors alone.
    if isinstance(value, str) and value in known:
        return value
    expected = "one of " + ", ".join(f'"{word}"' for word in known)
    if not isinstance(value, str):
        raise _wrong_type(name, expected, value)
    raise _wrong_value(name, expected, value)


def text(name: str, value: object) -> str:
    """A text."""
    if not isinstance(value, str):
        raise _wrong_type(name, "a text", value)
    return value


def instance(name: str, value: object, wanted: type[T], expected: str, hint: str = "") -> T:
    """An object of this class; `hint` ends the message where it is none."""
    if isinstance(value, wanted):
        return value
    if isinstance(value, (list, tuple)) and value and all(isinstance(one, wanted) for one in value):
        got = f"{type(value).__name__} of {len(value)}"
        raise TypeError(f"{name}: expected {expected}, got a {got}; pass one a call, in a loop")
    raise TypeError(f"{name}: expected {expected}, got {describe(value)}{hint}")


def bools(name: str, value: object, count: int | None) -> npt.NDArray[np.bool_]:
    """A ``(count,)`` bool array (any length for None)."""
    shape: tuple[int | str, ...] = ("N" if count is None else count,)
    expected = f"bool {_shape_text(shape)}"
    if is_masked(value):
        raise TypeError(
            f"{name}: expected {expected}, got a masked array; "
            "fill it first, with .filled(False) or (True)"
        )
    if isinstance(value, (str, bytes)) or value is None:
        raise _wrong_type(name, expected, value)
    given, value = value, foreign.as_numpy(name, expected, value)
    array = np.asarray(value)
    if array.size == 0 and not hasattr(value, "dtype"):
        array = array.astype(np.bool_)
    if array.dtype.kind != "b":
        way = "; pass numpy.asarray(...) != 0" if array.dtype.kind in "iuf" and array.ndim else ""
        if hasattr(value, "mask") and hasattr(value, "verdicts"):
            way = "; pass the result's .mask"
        raise TypeError(
            f"{name}: expected {expected}, got {describe(array if array.ndim else value)}{way}"
        )
    _check_shape(name, expected, array, shape, value=given)
    return copied(name, array, np.bool_)


def mesh_ids(
    name: str, value: object, count: int, what: str = "mesh ids"
) -> npt.NDArray[np.uint32]:
    """``(count,)`` mesh ids as uint32, or other numbers; any integer dtype comes in."""
    expected = f"integer ({count},)"
    if is_masked(value) or isinstance(value, (str, bytes)):
        raise _wrong_type(name, expected, value)
    given, value = value, foreign.as_numpy(name, expected, value)
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(
            f"{name}: expected {expected}, got a sequence that is no array ({error})"
        ) from None
    if array.size == 0 and not hasattr(value, "dtype"):
        array = array.astype(np.uint32)
    if array.dtype.kind not in "iu":
        got = describe(array if array.ndim else value)
        raise TypeError(f"{name}: expected {expected}, got {got}")
    _check_shape(name, expected, array, (count,), value=given)
    if array.size and not (int(array.min()) >= 0 and int(array.max()) < 2**32):
        wrong = int(array.min()) if array.min() < 0 else int(array.max())
        raise ValueError(f"{name}: expected {what} from 0 on, or hizvk.ABSENT, got {wrong}")
    return copied(name, array, np.uint32)


def indices(name: str, value: object, count: int, what: str) -> npt.NDArray[np.uint32]:
    """``(K,)`` numbers of some of `count` things, as uint32; any integer dtype comes in."""
    expected = "integer (K,)"
    if is_masked(value) or isinstance(value, (str, bytes)):
        raise _wrong_type(name, expected, value)
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(
            f"{name}: expected {expected}, got a sequence that is no array ({error})"
        ) from None
    if array.size == 0 and not hasattr(value, "dtype"):
        array = array.astype(np.uint32)
    if array.dtype.kind not in "iu":
        raise TypeError(
            f"{name}: expected {expected}, got {describe(array if array.ndim else value)}"
        )
    _check_shape(name, expected, array, ("K",), value=value)
    array = copied(name, array, array.dtype.newbyteorder("="))
    if array.size and not (int(array.min()) >= 0 and int(array.max()) < count):
        wrong = int(array.min()) if array.min() < 0 else int(array.max())
        raise ValueError(f"{name}: expected numbers of the {count} {what}, got {wrong}")
    return copied(name, array, np.uint32)


def triangles(name: str, value: object, vertex_count: int) -> npt.NDArray[np.uint32]:
    """``(T, 3)`` indices of vertices, as uint32; any integer dtype comes in."""
    expected = "integer (T, 3)"
    if is_masked(value):
        raise TypeError(
            f"{name}: expected {expected}, got a masked array; "
            "leave out the triangles that are masked"
        )
    if isinstance(value, (str, bytes)) or value is None:
        raise _wrong_type(name, expected, value)
    given, value = value, foreign.as_numpy(name, expected, value)
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(
            f"{name}: expected {expected}, got a sequence that is no array ({error})"
        ) from None
    if array.size == 0 and not hasattr(value, "dtype"):
        array = array.reshape(0, 3).astype(np.uint32)
    if array.dtype.kind not in "iu":
        way = "; convert it with .astype(np.int64)" if array.dtype.kind == "f" else ""
        raise TypeError(
            f"{name}: expected {expected}, got {describe(array if array.ndim else value)}{way}"
        )
    hint = "; split each face into triangles first" if array.shape[1:] == (4,) else ""
    _check_shape(name, expected, array, ("T", 3), hint, given)
    array = copied(name, array, array.dtype.newbyteorder("="))
    if array.size:
        low, high = int(array.min()), int(array.max())
        if low < 0 or high >= vertex_count:
            wrong = low if low < 0 else high
            # OBJ files count from 1.
            way = "; they seem to count from 1: subtract 1" if low and wrong == vertex_count else ""
            raise ValueError(
                f"{name}: expected vertex indices in 0..{vertex_count - 1}, got {wrong}{way}"
            )
    return copied(name, array, np.uint32)
