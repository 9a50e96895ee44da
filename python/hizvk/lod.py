"""Which level of detail (LOD) of its mesh an instance is drawn with: three rules.

LOD 0 is the full mesh, and each further one is coarser.
A rule chooses the coarsest LOD that it allows together with all finer ones.
It rests on a certificate (``docs/accuracy.md``, "Levels of detail"), so what it says holds for the
exact bounds.
Where they cross the plane of the eye, it chooses LOD 0.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from . import _arguments

__all__ = ["LodByDistance", "LodByError", "LodBySize", "LodRule"]

_Numbers: TypeAlias = Sequence[float] | npt.NDArray[Any]

#: Twins: `MAX_LODS`, `PIXELS` and `FARTHEST` in ``crates/hiz_core/src/cull/lod.rs``.
_MAX_LODS: Final = 8
_LEAST_PIXELS: Final = 1.0 / 1024.0
_MOST_PIXELS: Final = 32768.0
_FARTHEST: Final = 2.0**50


def _list(
    name: str, value: object, *, at_least: float, at_most: float, ascending: bool
) -> tuple[float, ...]:
    """One to seven numbers in order, without equal ones."""
    way = "ascending" if ascending else "descending"
    expected = f"1 to {_MAX_LODS - 1} {way} numbers"
    if isinstance(value, (str, bytes)) or not isinstance(value, (Sequence, np.ndarray)):
        raise TypeError(f"{name}: expected {expected}, got {_arguments.describe(value)}")
    if (isinstance(value, np.ndarray) and value.ndim != 1) or not 0 < len(value) < _MAX_LODS:
        raise ValueError(f"{name}: expected {expected}, got {_arguments.describe(value)}")
    given = tuple(_arguments.number(name, one, at_least=at_least, at_most=at_most) for one in value)
    in_order = given if ascending else given[::-1]
    if any(one >= following for one, following in itertools.pairwise(in_order)):
        raise ValueError(
            f"{name}: expected {expected} without equal ones, "
            f"got {_arguments.describe(list(given))}"
        )
    return given


@_arguments.named
@dataclass(frozen=True)
class LodByError:
    """The coarsest LOD whose error in the image is at most so many pixels.

    No point of the drawn LOD that shows is farther than `pixels` from its counterpart on the full
    mesh.
    This holds under three conditions:

    - The bounds contain the full mesh and all its LODs.
    - The error of each LOD bounds how far any point of either surface is from the other surface, at
      scale 1.
    - The scale of an instance is the largest factor by which it stretches its mesh.

    ``result_error`` of meshoptimizer is an estimate, no such bound.
    With it the error in pixels is an estimate as well.

    Parameters
    ----------
    pixels : float
        The largest error in pixels, 1/1024 to 32768.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import hizvk
    >>> hizvk.LodByError(pixels=1)
    LodByError(pixels=1.0)
    """

    pixels: float

    def __post_init__(self) -> None:
        pixels = _arguments.number(
            "pixels", self.pixels, at_least=_LEAST_PIXELS, at_most=_MOST_PIXELS
        )
        object.__setattr__(self, "pixels", pixels)


@_arguments.named
@dataclass(frozen=True)
class LodByDistance:
    """LOD l + 1 where all of the bounds are farther than ``thresholds[l]``.

    Distance is view depth, measured along the camera's axis.
    An orthographic camera shows nothing smaller from farther away, so a cull with one raises a
    ``ValueError``.

    Parameters
    ----------
    thresholds : sequence of float
        View depths in world units, ascending: 1 to 7 numbers, 0 to 2^50.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import hizvk
    >>> hizvk.LodByDistance([10, 20, 40])
    LodByDistance(thresholds=(10.0, 20.0, 40.0))
    """

    thresholds: tuple[float, ...]

    def __init__(self, thresholds: _Numbers) -> None:
        checked = _list("thresholds", thresholds, at_least=0.0, at_most=_FARTHEST, ascending=True)
        object.__setattr__(self, "thresholds", checked)

    @classmethod
    def at_ndc_depths(
        cls,
        depths: _Numbers,
        *,
        near: float,
        far: float | None = None,
        reversed_z: bool = True,
    ) -> LodByDistance:
        """The rule whose thresholds are given as NDC depths of a perspective camera.

        Parameters
        ----------
        depths : sequence of float
            1 to 7 NDC depths, 0 to 1, from near to far: descending for reversed Z, otherwise
            ascending.
        near : float
            View depth of the near plane in world units, above 0.
        far : float, optional
            View depth of the far plane in world units, above `near`; None: infinitely far.
        reversed_z : bool
            Whether NDC depth is 1 at the near plane, as in `Camera.look_at`.

        Returns
        -------
        LodByDistance

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.

        Examples
        --------
        >>> import hizvk
        >>> rule = hizvk.LodByDistance.at_ndc_depths(
        ...     [0.8, 0.9, 0.95], near=1.0, far=500.0, reversed_z=False
        ... )
        >>> [round(depth, 2) for depth in rule.thresholds]
        [4.96, 9.82, 19.27]
        """
        near = _arguments.number("near", near, above=0.0)
        share = 0.0 if far is None else near / _arguments.number("far", far, above=near)
        is_reversed = _arguments.flag("reversed_z", reversed_z)
        given = _list("depths", depths, at_least=0.0, at_most=1.0, ascending=not is_reversed)
        from_far = [depth if is_reversed else 1.0 - depth for depth in given]
        if share == 0.0 and from_far[-1] == 0.0:
            raise ValueError(f"depths: expected less than infinitely far, got {given[-1]:g}")
        return cls([near / (depth + (1.0 - depth) * share) for depth in from_far])


@_arguments.named
@dataclass(frozen=True)
class LodBySize:
    """LOD l + 1 where the bounds are less than ``pixels[l]`` wide in every direction.

    Precisely, no two points of the bounds are farther apart in the image, if one of them shows.

    Parameters
    ----------
    pixels : sequence of float
        Widths in pixels, descending: 1 to 7 numbers, 1/1024 to 32768.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import hizvk
    >>> hizvk.LodBySize(pixels=[200, 50, 12])
    LodBySize(pixels=(200.0, 50.0, 12.0))
    """

    pixels: tuple[float, ...]

    def __init__(self, pixels: _Numbers) -> None:
        checked = _list(
            "pixels", pixels, at_least=_LEAST_PIXELS, at_most=_MOST_PIXELS, ascending=False
        )
        object.__setattr__(self, "pixels", checked)


LodRule: TypeAlias = LodByError | LodByDistance | LodBySize


def lod_rule(name: str, value: object) -> LodRule | None:
    """A rule, or None for LOD 0 everywhere."""
    if value is None:
        return None
    expected = "a LodByError, LodByDistance, LodBySize or None"
    if not isinstance(value, LodRule):
        raise TypeError(f"{name}: expected {expected}, got {_arguments.describe(value)}")
    return value
