"""A scene with known geometry: occluders, instances with their real triangles, and views."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..camera import Camera

if TYPE_CHECKING:
    import numpy.typing as npt

    from .._arguments import Size
    from .grid import Floats
    from .terrain import Terrain

__all__ = ["Scene", "View", "box_corners", "box_mesh"]


@dataclass(frozen=True)
class View:
    """A pinhole view, independent of `hizvk.Camera`: rays must not come from the code under test.

    Parameters
    ----------
    name : str
        For reports.
    eye, target : tuple of three float
        World positions.
    fov_y_deg : float
        The full vertical angle of view.
    near : float
        Distance of the near plane.
    up : tuple of three float
        What is up in the image.
    far : float, optional
        Distance of the far plane; None: infinitely far.
    """

    name: str
    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    fov_y_deg: float
    near: float
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    far: float | None = None

    def camera(self, size: Size) -> Camera:
        """The library's camera for this view, reversed Z."""
        return Camera.look_at(
            self.eye,
            self.target,
            up=self.up,
            fov_y_deg=self.fov_y_deg,
            size=size,
            near=self.near,
            far=self.far,
        )

    def basis(self) -> Floats:
        """``(3, 3)``: the unit vectors right, up and forward as rows."""
        forward = np.subtract(self.target, self.eye)
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(right, forward), forward])

    def rays(self, size: Size, shift: tuple[float, float] = (0.0, 0.0)) -> Floats:
        """``(height, width, 3)``: directions through the pixel centres, of view depth 1.

        `shift` moves the centres, in pixels to the right and down.
        """
        height, width = size
        tangent = np.tan(np.radians(self.fov_y_deg) / 2.0)
        x = ((np.arange(width) + 0.5 + shift[0]) / width * 2.0 - 1.0) * tangent * width / height
        y = (1.0 - (np.arange(height) + 0.5 + shift[1]) / height * 2.0) * tangent
        right, up, forward = self.basis()
        rays: Floats = x[None, :, None] * right + y[:, None, None] * up + forward
        return rays


@dataclass(frozen=True, eq=False)
class Scene:
    """Occluders, instances with their real triangles and exact boxes, and views."""

    name: str
    """What it is, and where its data is from."""
    origin: tuple[float, float, float]
    """A point amid the scene; positions relative to it are exact in float32."""
    vertices: Floats
    """``(V, 3)``: of the occluders."""
    triangles: npt.NDArray[np.uint32]
    """``(T, 3)``: of the occluders."""
    instance_vertices: Floats
    """``(M, 3)``: of all instances."""
    instance_triangles: npt.NDArray[np.uint32]
    """``(K, 3)``: of all instances."""
    owner: npt.NDArray[np.int32]
    """``(K,)``: the instance that each triangle belongs to."""
    box_min: Floats
    """``(N, 3)``: the least corner of each instance, exactly."""
    box_max: Floats
    """``(N, 3)``: the greatest corner of each instance, exactly."""
    views: tuple[View, ...]
    """From where to look."""
    terrain: Terrain | None = None
    """The height field of the occluders, if they are one."""

    def __len__(self) -> int:
        """The number of instances."""
        return len(self.box_min)


def box_corners(low: npt.ArrayLike, high: npt.ArrayLike) -> Floats:
    """``(N, 8, 3)``: the corners of axis-aligned boxes, from their extremes ``(N, 3)``."""
    low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
    upper = (np.arange(8)[:, None] >> np.arange(3)) & 1
    return np.where(upper, high[:, None], low[:, None])


def box_mesh(low: npt.ArrayLike, high: npt.ArrayLike) -> tuple[Floats, npt.NDArray[np.uint32]]:
    """Vertices and triangles of axis-aligned boxes whose front faces look outwards.

    Parameters
    ----------
    low, high : (N, 3)
        Corners.

    Returns
    -------
    vertices : (8 N, 3) float64 array
        Eight in a row for each box.
    triangles : (12 N, 3) uint32 array
        Twelve in a row for each box.
    """
    vertices = box_corners(low, high).reshape(-1, 3)
    sides = np.array(
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    )
    one = np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]])
    triangles = (one + 8 * np.arange(len(vertices) // 8)[:, None, None]).reshape(-1, 3)
    return vertices, triangles.astype(np.uint32)
