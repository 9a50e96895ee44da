"""Tiling without depths: Greene, *Hierarchical polygon tiling with coverage masks* (1996).

Static triangles in the order of a BSP tree cover an image front to back.
A bit for each pixel takes the place of a depth.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .. import _arguments
from .._core import BspTree as CoreBspTree
from ..camera import Camera
from ..resources import Occluders

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from .._arguments import Size
    from .._core import Tiled as CoreTiled

__all__ = ["BspTiling", "TiledCoverage"]


class BspTiling:
    """Static triangles in the order of a BSP tree, or of an octree of BSP trees.

    Meshes that move after the tree was made are drawn where they stood then.
    The tree lies on the host; one thread draws.

    Parameters
    ----------
    occluders : Occluders
        The triangles, where they stand now.
    leaf : int, optional
        A cell of the octree with more triangles is divided; at least 1.
        None: one tree, unless it splits too much.
    most_parts : float
        One tree is given up once it has more than so many parts per triangle, at least 1.
        Then an octree with leaves of 64 triangles is made.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    LimitError
        If the triangles cut one another into more than 16 parts for each and 2^20 besides.

    Examples
    --------
    A wall over the whole view, and a triangle behind it:

    >>> import hizvk
    >>> device = hizvk.Device()
    >>> camera = hizvk.Camera.look_at(
    ...     (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(64, 64), near=0.1
    ... )
    >>> corners = [(-20, -20, -10), (20, -20, -10), (20, 20, -10), (-20, 20, -10)]
    >>> corners += [(0, 0, -20), (1, 0, -20), (0, 1, -20)]
    >>> walls = device.occluders(corners, [(0, 1, 2), (0, 2, 3), (4, 5, 6)])
    >>> tiling = hizvk.BspTiling(walls)
    >>> seen = tiling.draw(camera)
    >>> bool(seen.coverage.all()), seen.num_visible
    (True, 2)
    """

    def __init__(
        self, occluders: Occluders, *, leaf: int | None = None, most_parts: float = 2.0
    ) -> None:
        self._occluders = _arguments.instance(
            "occluders", occluders, Occluders, "Occluders of Device.occluders"
        )
        if leaf is not None:
            leaf = _arguments.integer("leaf", leaf, low=1, high=2**32 - 1)
        parts = _arguments.number("most_parts", most_parts, at_least=1.0)
        self._inner = CoreBspTree(occluders._inner, leaf, parts)

    def __repr__(self) -> str:
        kind = "an octree of BSP trees" if self.is_octree else "one BSP tree"
        return f"<BspTiling of {self.num_triangles} triangles in {self.num_parts} parts: {kind}>"

    @property
    def is_octree(self) -> bool:
        """Whether it is an octree of BSP trees."""
        return self._inner.is_octree()

    @property
    def num_triangles(self) -> int:
        """Triangles, counted once per transform of their mesh."""
        return self._inner.numbers()[0]

    @property
    def num_parts(self) -> int:
        """Triangles and parts of split ones."""
        return self._inner.numbers()[1]

    @property
    def num_nodes(self) -> int:
        """Planes of the tree."""
        return self._inner.numbers()[2]

    @property
    def host_bytes(self) -> int:
        """Bytes of the tree on the host."""
        return self._inner.numbers()[3]

    def draw(self, camera: Camera) -> TiledCoverage:
        """What the camera sees.

        Parameters
        ----------
        camera : Camera
            The view and the image's size.

        Raises
        ------
        TypeError
            For anything but a camera.
        """
        _arguments.instance("camera", camera, Camera, "a Camera")
        return TiledCoverage(self._inner.draw(self._occluders._inner, camera._inner), camera.size)


class TiledCoverage:
    """Which pixels triangles cover; made by `BspTiling.draw`, which has an example."""

    def __init__(self, inner: CoreTiled, size: Size) -> None:
        self._inner = inner
        self._size = size

    def __repr__(self) -> str:
        height, width = self._size
        return f"<TiledCoverage {width}x{height}: {self.num_visible} visible triangles>"

    @property
    def coverage(self) -> npt.NDArray[np.bool_]:
        """``(height, width)`` bool: whether a triangle covers each pixel's centre.

        It is that of ``render_depth(rasteriser="host")`` bit for bit, but a far plane cuts nothing.
        """
        return self._inner.coverage().reshape(self._size)

    @property
    def num_visible(self) -> int:
        """Triangles that cover a pixel before all others."""
        return self._inner.numbers()[0]

    @property
    def parts(self) -> int:
        """Parts of triangles that were tiled."""
        return self._inner.numbers()[1]

    @property
    def nodes(self) -> int:
        """Nodes of the tree that were looked at."""
        return self._inner.numbers()[2]

    @property
    def hidden_nodes(self) -> int:
        """How many of them were left out with all below, as hidden or outside."""
        return self._inner.numbers()[3]

    @property
    def image_bytes(self) -> int:
        """Bytes of the pyramid of coverage bits."""
        return self._inner.numbers()[4]
