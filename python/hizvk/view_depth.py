"""NDC depth as other kinds of depth, for people and their programs: view depth and distance.

No cull reads these numbers.
They are formed in float64 and rounded to float32 at the end.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from . import _arguments
from ._types import DepthKind, words

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._types import DepthEnd
    from .camera import Camera

    _Doubles = npt.NDArray[np.float64]

__all__ = ["RayView", "converted"]

#: A slope of NDC depth that is nearer than this to 0 or 1 is that of an infinite far plane.
EXACT: Final = 1e-14
#: Where the depth row differs from a multiple of the w row by this share, the near plane is
#: oblique.
OBLIQUE: Final = 1e-9


def converted(
    camera: Camera,
    depth: npt.NDArray[np.float32],
    kind: DepthKind | None,
    level: int = 0,
    end: DepthEnd = "farthest",
) -> npt.NDArray[np.float32]:
    """Depth of the camera's own kind as depth of another kind.

    Parameters
    ----------
    camera : Camera
        Whose depth it is.
    depth : (height, width) float32 array
        One level of its pyramid, in NDC.
    kind : {"ndc", "reversed_ndc", "z", "distance"}, optional
        The wanted kind; None: the camera's own.
    level : int
        Which level it is: a texel covers ``2^level`` pixels in each direction.
    end : {"farthest", "nearest"}
        Which end of a texel's depths it holds.

    Returns
    -------
    (height, width) float32 array
        Infinite for the depth of an infinite far plane.
        A ``distance`` bounds those of the texel's pixels: from above for the farthest end, from
        below for the nearest.
        With an oblique near plane, view depth is that at the middle of the texel.

    Raises
    ------
    TypeError, ValueError
        They name the parameter ``kind``; also where the camera does not say where view depth
        starts.
    """
    if kind is None or kind == camera.depth_kind:
        return depth
    _arguments.choice("kind", kind, words(DepthKind))
    if kind in ("ndc", "reversed_ndc"):
        return (1.0 - depth.astype(np.float64)).astype(np.float32)
    view = RayView(camera)
    if view.is_bare:
        raise ValueError(
            f'kind: expected "{camera.depth_kind}" for an orthographic camera made from a bare '
            f'matrix, which does not say where view depth starts, got "{kind}"; '
            "Camera.orthographic, or from_matrices with a pose, says it"
        )
    z = view.depth_of(depth.astype(np.float64), level)
    if kind == "distance" and not view.is_parallel:
        lengths = view.ray_lengths()
        reduce = np.maximum if end == "farthest" else np.minimum
        for axis, sides in enumerate(depth.shape):
            lengths = reduce.reduceat(lengths, np.arange(sides) << level, axis=axis)
        z *= lengths
    with np.errstate(over="ignore"):
        return z.astype(np.float32)


class RayView:
    """A camera's rays: its axes, what its depth means, and positions of places in its image.

    Rows of a matrix may have lengths far apart, so each is brought to length 1 before it is used.

    Parameters
    ----------
    camera : Camera
        Any camera.

    Raises
    ------
    ValueError
        If float64 cannot hold the rows about a w row of length 1.
    """

    def __init__(self, camera: Camera) -> None:
        inner: Any = camera._inner
        self.size = camera.size
        self.reversed_z = camera.reversed_z
        self._rows: _Doubles = np.array(inner.rows(), np.float64)
        #: The rows are about this point.
        self._origin: _Doubles = np.array(inner.origin(), np.float64)
        w_length = _length(self._rows[3, :3])
        self.is_parallel = w_length == 0.0
        self.is_bare = self.is_parallel and not inner.is_posed()
        longest = float(np.abs(self._rows).max())
        with np.errstate(over="ignore"):
            self._rows /= self._rows[3, 3] if self.is_parallel else w_length
        if not np.isfinite(self._rows).all():
            raise ValueError(
                "camera: expected a matrix whose w row is of about the size of the other rows, got "
                f"{w_length:g} beside {longest:g}; scale the rows of the projection alike"
            )
        if self.is_parallel:
            self._slope = _length(self._rows[2, :3]) * (-1.0 if self.reversed_z else 1.0)
            #: Unit vector along the view.
            self.forward: _Doubles = self._rows[2, :3] / self._slope
            self.eye: _Doubles | None = None
        else:
            self.forward = self._rows[3, :3]
            #: Where all rays start; None for parallel rays.
            directions, lengths = _directions(self._rows[[0, 1, 3], :3])
            with np.errstate(over="ignore"):
                constants = self._rows[[0, 1, 3], 3] / lengths
            self.eye = self._origin - np.linalg.solve(directions, constants)
        #: Unit vectors to the right and upwards in the image.
        self.right = _unit(self._rows[0, :3], self.forward)
        self.up = _unit(self._rows[1, :3], self.forward)

    def depth_of(self, ndc: _Doubles, level: int = 0) -> _Doubles:
        """View depth of the NDC depths of one level, in world units."""
        if self.is_parallel:
            with np.errstate(over="ignore"):
                parallel: _Doubles = (ndc - self._rows[2, 3]) / self._slope
            return parallel
        constant_of_w = self._rows[3, 3]
        slope = float(self._rows[2, :3] @ self.forward)
        if self._is_oblique():
            x, y = self._middles(ndc.shape, level)
            return _inverse_w(self._rows, x, y[:, None], ndc)
        for exact in (0.0, 1.0):
            slope = exact if abs(slope - exact) < EXACT else slope
        with np.errstate(divide="ignore"):
            # z_clip = slope * (w - constant_of_w) + rows[2, 3]; and the w row has length 1.
            z = (self._rows[2, 3] - slope * constant_of_w) / (ndc - slope)
        found: _Doubles = np.where(ndc == slope, np.inf, z)
        return found

    def depth_at(self, ndc: float, column: float, row: float) -> float:
        """View depth of one NDC depth at a place of the image, in pixels."""
        if self.is_parallel or not self._is_oblique():
            return float(self.depth_of(np.array([[ndc]])).item())
        height, width = self.size
        x, y = np.array(2.0 * column / width - 1.0), np.array(1.0 - 2.0 * row / height)
        return float(_inverse_w(self._rows, x, y, np.array(ndc)))

    def _is_oblique(self) -> bool:
        """Whether NDC depth depends on the pixel besides view depth."""
        depth_row = self._rows[2, :3]
        rest = depth_row - (depth_row @ self.forward) * self.forward
        return _length(rest) > OBLIQUE * max(_length(depth_row), 1.0)

    def clip_of(self, positions: _Doubles) -> _Doubles:
        """``(N, 4)``: clip coordinates of ``(N, 3)`` world positions, with w in world units."""
        clip: _Doubles = (positions - self._origin) @ self._rows[:, :3].T + self._rows[:, 3]
        return clip

    def ray_lengths(self) -> _Doubles:
        """``(height, width)``: how far one goes along the ray of a pixel per unit of view depth."""
        x, y = self._middles(self.size, 0)
        directions, row_lengths = _directions(self._rows[[0, 1, 3], :3])
        with np.errstate(over="ignore"):
            inverse = np.linalg.inv(directions) / row_lengths
            squares = [
                (inverse[axis, 0] * x + inverse[axis, 1] * y[:, None] + inverse[axis, 2]) ** 2
                for axis in range(3)
            ]
            lengths: _Doubles = np.sqrt(squares[0] + squares[1] + squares[2])
        return lengths

    def corners(self, reach: float) -> _Doubles:
        """``(8, 3)``: the corners of the view volume, which ends at the view depth `reach`.

        The four of the near plane come first: left bottom, right bottom, right top, left top.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            return self._corners(reach)

    def _corners(self, reach: float) -> _Doubles:
        x, y = np.array([-1.0, 1.0, 1.0, -1.0]), np.array([-1.0, -1.0, 1.0, 1.0])
        found = []
        for is_far in (False, True):
            ndc = float(is_far != self.reversed_z)
            if self.is_parallel:
                directions, lengths = _directions(self._rows[:3, :3])
                right_side = np.stack([x, y, np.full(4, ndc)]) - self._rows[:3, 3, None]
                places = np.linalg.solve(directions, right_side / lengths[:, None])
                found.append(places.T + self._origin)
                continue
            z = _inverse_w(self._rows, x, y, np.full(4, ndc))
            z = np.minimum(np.where(z > 0.0, z, np.inf), reach)
            directions, lengths = _directions(self._rows[[0, 1, 3], :3])
            right_side = np.stack([x * z, y * z, z]) / lengths[:, None]
            assert self.eye is not None
            found.append(np.linalg.solve(directions, right_side).T + self.eye)
        return np.concatenate(found)

    def _middles(self, shape: tuple[int, ...], level: int) -> tuple[_Doubles, _Doubles]:
        """NDC of the middles of a level's columns and rows, within the image."""
        places = []
        for sides, pixels in zip(shape, self.size, strict=True):
            first = np.arange(sides, dtype=np.float64) * 2**level
            last = np.minimum(first + 2**level, pixels)
            places.append((first + last) / pixels)
        return places[1] - 1.0, 1.0 - places[0]


def _inverse_w(rows: _Doubles, x: _Doubles, y: _Doubles, ndc: _Doubles) -> _Doubles:
    """The clip w of points at places of the image, by the inverse of the matrix."""
    whole, lengths = _directions(rows)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        a, b, c, d = np.linalg.inv(whole)[3] / lengths
        reciprocal = a * x + b * y + c * ndc + d
        w: _Doubles = np.where(np.abs(reciprocal) < EXACT * abs(c), np.inf, 1.0 / reciprocal)
        return w


def _length(row: _Doubles) -> float:
    """The length of a vector, where the squares of its coordinates may overflow or vanish."""
    greatest = float(np.abs(row).max())
    return greatest * float(np.linalg.norm(row / greatest)) if greatest else 0.0


def _directions(rows: _Doubles) -> tuple[_Doubles, _Doubles]:
    """Rows that are not 0 as unit vectors, and their lengths."""
    lengths = np.array([_length(row) for row in rows])
    return rows / lengths[:, None], lengths


def _unit(row: _Doubles, forward: _Doubles) -> _Doubles:
    """The part of `row` at right angles to `forward`, as a unit vector."""
    row = row / _length(row)
    across: _Doubles = row - (row @ forward) * forward
    return across / np.linalg.norm(across)
