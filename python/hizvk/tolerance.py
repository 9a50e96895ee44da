"""How far a depth image may be off, in the world: it is moved away from the eye by so much."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from . import _arguments

__all__ = ["Tolerance", "numbers_of"]


@_arguments.named
@dataclass(frozen=True)
class Tolerance:
    """How far the depths of an image may lie before the surfaces that they measure.

    The upload moves each depth away from the eye, by ``rel`` times the depth plus ``abs``, in
    float64, and rounds to far.

    - ``"z"`` and NDC depth move along the view.
    - ``"distance"`` moves along the pixel's ray.

    The background stays far, "no data" stays "no data", and so does what lies in front of the near
    plane.

    The promise then holds for the moved image: nothing is hidden that shows in it.
    So a point that lies up to the tolerance behind what was measured is kept.
    What surely shows (`Verdict.UNOCCLUDED`) lies before the measured depth, less the tolerance.
    With ``coverage="area"`` its pixels may show steps of depth, which no tolerance covers; `Points`
    have a guard for that.

    Parameters
    ----------
    rel : float
        Relative to the depth, 0 to 0.5: 0.01 is 1 %.
    abs : float
        World units, from 0 on: 0.02 is 2 cm where a world unit is a metre.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(90, 160), near=0.1)
    >>> wall, points = np.full(camera.size, 10.0), hizvk.Points([(0.0, 0, -10.1), (0, 0, -10.3)])
    >>> hizvk.visible(points, camera, depth=wall, kind="z").tolist()
    [False, False]
    >>> some = hizvk.Tolerance(rel=0.01, abs=0.02)  # 12 cm at 10 m
    >>> hizvk.visible(points, camera, depth=wall, kind="z", tolerance=some).tolist()
    [True, False]
    """

    rel: float = 0.0
    abs: float = 0.0

    def __post_init__(self) -> None:
        rel = _arguments.number("rel", self.rel, at_least=0.0, at_most=0.5)
        object.__setattr__(self, "rel", rel)
        object.__setattr__(self, "abs", _arguments.number("abs", self.abs, at_least=0.0))


def numbers_of(name: str, value: Any) -> tuple[float, float]:
    """``rel`` and ``abs`` of a tolerance; None: both 0."""
    if value is None:
        return 0.0, 0.0
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    hint = f"; pass hizvk.Tolerance(abs={value})" if is_number else ""
    given = _arguments.instance(name, value, Tolerance, "a hizvk.Tolerance or None", hint)
    return given.rel, given.abs
