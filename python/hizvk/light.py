"""Lights whose shadow casters are culled (``docs/shadows.md``)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy.typing as npt

from . import _arguments

__all__ = ["DirectionalLight"]

_Vector: TypeAlias = Sequence[float] | npt.NDArray[Any]

#: Twins: `WIDEST` and `LARGEST` in ``crates/hiz_core/src/input/light.rs``.
_WIDEST_DEG: Final = 30.0
_LARGEST: Final = 2.0**60


def _corner(name: str, value: object) -> tuple[float, float, float]:
    corner = _arguments.vector(name, value)
    if any(abs(v) >= _LARGEST for v in corner):
        raise ValueError(f"{name}: expected numbers below 2^60, got {corner}")
    return corner


@_arguments.named
@dataclass(frozen=True)
class DirectionalLight:
    """A light at infinity, such as the sun, and what can receive its shadows.

    ``device.cull(casters, camera, receivers, shadow=light)`` keeps the casters whose shadow may
    fall on something that the camera sees.
    `receivers` is a pyramid of ``depths="receivers"``, of the depth of *all* that receives shadows.
    An image of occluders alone has holes, and shadows that fall through them would be lost.

    Parameters
    ----------
    direction : (3,) floats
        The direction in which the light travels, of any length above 0.
    receivers : pair of (3,) floats
        The least and greatest corner of a box around everything that can receive a shadow, in world
        units.
        A smaller box culls more.
    angular_radius_deg : float
        The angular radius of the light's disc, 0 to 30 degrees; the sun's is 0.27.
        0: hard shadows.
    filter_radius : float
        How far from a point the lookup of its shadow reaches, in world units, at least 0.
        That is the radius of the filter's kernel, the diagonal of a texel of the shadow map, and
        the bias, added.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    A camera looks down at flat ground, and light comes from the left.
    The shadow of the first box reaches into the view, and that of the second does not.

    >>> import numpy as np, hizvk
    >>> device = hizvk.Device()
    >>> camera = hizvk.Camera.orthographic(
    ...     (0, 10, 0), (0, 0, 0), up=(0, 0, -1), height=8, size=(64, 64), near=0, far=20
    ... )
    >>> ground = np.full((64, 64), 10.0, np.float32)
    >>> receivers = device.pyramid(ground, camera, kind="z", depths="receivers")
    >>> casters = device.instances(
    ...     hizvk.Boxes([[-6.5, 1, -0.5], [-9.5, 1, -0.5]], [[-5.5, 2, 0.5], [-8.5, 2, 0.5]])
    ... )
    >>> sun = hizvk.DirectionalLight((2, -1, 0), receivers=((-50, 0, -50), (50, 0, 50)))
    >>> device.cull(casters, camera, receivers, shadow=sun).mask
    array([ True, False])
    """

    direction: _Vector
    receivers: tuple[_Vector, _Vector]
    angular_radius_deg: float = 0.0
    filter_radius: float = 0.0

    def __post_init__(self) -> None:
        direction = _arguments.vector("direction", self.direction)
        if not any(direction):
            raise ValueError(f"direction: expected a vector that is not 0, got {direction}")
        object.__setattr__(self, "direction", direction)
        object.__setattr__(self, "receivers", _box("receivers", self.receivers))
        degrees = _arguments.number(
            "angular_radius_deg", self.angular_radius_deg, at_least=0.0, at_most=_WIDEST_DEG
        )
        object.__setattr__(self, "angular_radius_deg", degrees)
        radius = _arguments.number(
            "filter_radius", self.filter_radius, at_least=0.0, at_most=_LARGEST / 2
        )
        object.__setattr__(self, "filter_radius", radius)


def _box(name: str, value: object) -> tuple[tuple[float, float, float], ...]:
    """The two corners of a box."""
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__"):
        got = _arguments.describe(value)
        raise TypeError(f"{name}: expected a pair (least, greatest) of corners, got {got}")
    if len(value) != 2:
        got = _arguments.describe(value)
        raise ValueError(f"{name}: expected a pair (least, greatest) of corners, got {got}")
    low, high = (_corner(f"{name}[{k}]", value[k]) for k in (0, 1))  # type: ignore[index]
    if any(a > b for a, b in zip(low, high, strict=True)):
        raise ValueError(f"{name}: expected least <= greatest on each axis, got {low} and {high}")
    return low, high


def light_or_none(name: str, value: object) -> DirectionalLight | None:
    """The field `shadow` of `CullOptions`."""
    if value is None:
        return None
    return _arguments.instance(name, value, DirectionalLight, "a DirectionalLight or None")
