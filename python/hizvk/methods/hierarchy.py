"""Hierarchical visibility: an octree walked front to back against a pyramid that is kept.

Source: Greene, Kass and Miller, *Hierarchical Z-buffer visibility*, SIGGRAPH 1993.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from .. import _arguments
from .._core import HierarchicalVisibility as Core
from .._types import FaceCull, words
from ..camera import Camera
from ..mesh import A_MESH, MeshLike, meshes_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

__all__ = ["HIDDEN", "NODE_DTYPE", "NOT_VISITED", "OUTSIDE", "VISIBLE"]
__all__ += ["FlatFrame", "HierarchicalVisibility", "HierarchyFrame"]

#: A node of the tree.
#:
#: - ``min``, ``max``: the box around what it and the nodes below it hold, in world coordinates.
#: - ``parent``: the node above it; -1 for the root, which is node 0.
#: - ``level``: 0 for the root.
#: - ``meshlets``: how many it holds itself.
#: - ``triangles``: how many are in it and below it.
NODE_DTYPE: Final[np.dtype[np.void]] = np.dtype(
    [
        ("min", "<f8", 3),
        ("max", "<f8", 3),
        ("parent", "<i8"),
        ("level", "<u4"),
        ("meshlets", "<u4"),
        ("triangles", "<u8"),
    ]
)

#: States of a node in a frame.
NOT_VISITED: Final = 0
OUTSIDE: Final = 1
HIDDEN: Final = 2
VISIBLE: Final = 3

#: The largest threshold, and the deepest level.
MOST_MESHLETS: Final = 2**31 - 1
DEEPEST: Final = 30


@dataclass(frozen=True, eq=False)
class HierarchyFrame:
    """A frame that `HierarchicalVisibility.render` drew, and what it took."""

    camera: Camera
    """The camera that it was drawn for."""
    depth: npt.NDArray[np.float32]
    """``(height, width)``: NDC depth of the camera's kind, row 0 on top."""
    levels: tuple[npt.NDArray[np.float32], ...]
    """The levels of the pyramid; level 0 is `depth`."""
    states: npt.NDArray[np.uint8]
    """``(N,)``: what became of each node.

    0: a node above it was hidden or outside; 1: outside of the view; 2: hidden; 3: visible.
    """
    visible_leaves: npt.NDArray[np.uint32]
    """Nodes that hold meshlets and that the finished image does not hide, ascending.

    The next frame takes them as `previous`.
    """
    comparisons: int
    """Depths that the tests of nodes compared."""
    settled_by_one: int
    """Nodes whose test took one comparison."""
    triangles_outside: int
    """Triangles in boxes outside of the view."""
    triangles_in_hidden_nodes: int
    """Triangles in and below hidden nodes."""
    triangles_in_hidden_meshlets: int
    """Triangles of hidden meshlets in visible nodes."""
    triangles_drawn: int
    """Triangles of meshlets that were drawn."""
    meshlets_drawn: int
    """Meshlets that were drawn."""
    centres_in_view: int | None
    """Pixels' centres that all triangles in the view cover, each triangle by itself.

    None unless ``count=True``.
    """
    centres_drawn: int | None
    """The same for the triangles that were drawn."""
    milliseconds: float
    """Of the drawing, on its one thread."""

    @property
    def nodes_visited(self) -> int:
        """Nodes whose box was tested against the pyramid."""
        return int(np.count_nonzero(self.states >= HIDDEN))

    @property
    def nodes_hidden(self) -> int:
        """Nodes that went with all below them."""
        return int(np.count_nonzero(self.states == HIDDEN))

    @property
    def share_settled_by_one(self) -> float:
        """The share of the visited nodes whose test took one comparison."""
        return self.settled_by_one / max(self.nodes_visited, 1)

    @property
    def share_in_hidden_nodes(self) -> float:
        """The share of the triangles in the view that are in hidden nodes."""
        drawn = self.triangles_drawn + self.triangles_in_hidden_meshlets
        return self.triangles_in_hidden_nodes / max(self.triangles_in_hidden_nodes + drawn, 1)

    @property
    def depth_complexity(self) -> float:
        """How many triangles of the view cover a pixel's centre on average.

        NaN unless the frame was drawn with ``count=True``.
        """
        return self._per_pixel(self.centres_in_view)

    @property
    def depth_complexity_drawn(self) -> float:
        """How many drawn triangles cover a pixel's centre on average; NaN as above."""
        return self._per_pixel(self.centres_drawn)

    def _per_pixel(self, centres: int | None) -> float:
        return float("nan") if centres is None else centres / self.depth.size

    def __repr__(self) -> str:
        height, width = self.depth.shape
        return (
            f"HierarchyFrame({height}x{width}, {self.nodes_visited} nodes visited, "
            f"{self.nodes_hidden} hidden, {self.triangles_drawn} triangles drawn)"
        )


@dataclass(frozen=True, eq=False)
class FlatFrame:
    """The same image by the rasteriser's own list of meshlets, sorted front to back."""

    depth: npt.NDArray[np.float32]
    """``(height, width)``: NDC depth of the camera's kind, row 0 on top."""
    meshlets_drawn: int
    """Meshlets that were drawn."""
    triangles_drawn: int
    """Their triangles."""
    milliseconds: float
    """Of the drawing, on one thread."""


class HierarchicalVisibility:
    """The algorithm of Greene, Kass and Miller (1993) over the meshlets of triangle meshes.

    It is here to compare with: `Device.render_depth` draws the same image, and `Device.cull` is
    what hides instances.
    ``docs/methods.md`` says what differs from the text, and has figures.

    - An octree holds the meshlets (at most 128 neighbouring triangles) of all copies of the meshes.
      Nothing small is held by a large node.
    - The nodes are visited front to back.
      Each node's box is tested against the pyramid of what was drawn so far.
      A hidden node goes with all below it.
    - What a visible node holds is drawn at once, and tiles that get nearer are propagated upward.

    The image has the same bits as one that was drawn without skipping.
    No device is needed.

    Parameters
    ----------
    meshes : Mesh, a mesh of trimesh, Open3D or PyVista, or a list of them
        A list may also hold tuples as `Device.occluders` takes them.
    threshold : int
        A node of more meshlets is split; at least 1.
    deepest : int
        Nodes of this level are not split; 0..30, where the root has level 0.
    cull : "none", "back" or "front"
        Which faces are left out.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import hizvk
    >>> import numpy as np
    >>> corners = [[-20.0, -20, -10], [20, -20, -10], [-20, 20, -10], [20, 20, -10]]
    >>> wall = hizvk.Mesh(corners, [[0, 1, 2], [2, 1, 3]])
    >>> places = np.tile(np.eye(4), (16, 1, 1))
    >>> places[:, 0, 3], places[:, 2, 3] = np.arange(-8, 8), -30.0  # in a row behind the wall
    >>> flags = hizvk.Mesh([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], places)
    >>> scene = hizvk.HierarchicalVisibility([wall, flags], threshold=1)
    >>> camera = hizvk.Camera.look_at(
    ...     (0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(48, 64), near=0.1
    ... )
    >>> frame = scene.render(camera)
    >>> frame.triangles_drawn, frame.triangles_in_hidden_nodes
    (2, 16)
    >>> scene.render(camera, previous=frame).triangles_drawn
    2
    """

    def __init__(
        self,
        meshes: MeshLike | Sequence[MeshLike | tuple[npt.ArrayLike, ...]],
        *,
        threshold: int = 4,
        deepest: int = 16,
        cull: FaceCull = "none",
    ) -> None:
        listed = meshes_of("meshes", meshes, f"{A_MESH}, or a list of them")
        self._threshold = _arguments.integer("threshold", threshold, low=1, high=MOST_MESHLETS)
        self._deepest = _arguments.integer("deepest", deepest, low=0, high=DEEPEST)
        mode = _arguments.choice("cull", cull, words(FaceCull))
        raw = [(mesh.vertices, mesh.triangles, mesh.transforms) for mesh in listed]
        self._inner = Core(raw, mode, self._threshold, self._deepest)
        self._nodes: npt.NDArray[np.void] | None = None

    @property
    def threshold(self) -> int:
        """The most meshlets of a node that is not split."""
        return self._threshold

    @property
    def deepest(self) -> int:
        """The level whose nodes are not split."""
        return self._deepest

    @property
    def num_triangles(self) -> int:
        """Triangles, counted once for each copy of their mesh."""
        return self._inner.num_triangles()

    @property
    def num_meshlets(self) -> int:
        """Meshlets, counted once for each copy of their mesh."""
        return self._inner.num_meshlets()

    @property
    def nodes(self) -> npt.NDArray[np.void]:
        """The tree as an array of `hizvk.methods.NODE_DTYPE`; parents come before children."""
        if self._nodes is None:
            low, high, parent, level, meshlets, triangles = self._inner.nodes()
            nodes = np.zeros(len(parent), NODE_DTYPE)
            nodes["min"], nodes["max"] = low.reshape(-1, 3), high.reshape(-1, 3)
            nodes["parent"], nodes["level"] = parent, level
            nodes["meshlets"], nodes["triangles"] = meshlets, triangles
            nodes.flags.writeable = False
            self._nodes = nodes
        return self._nodes

    def render(
        self,
        camera: Camera,
        *,
        previous: HierarchyFrame | npt.ArrayLike | None = None,
        count: bool = False,
    ) -> HierarchyFrame:
        """Draws what the camera sees.

        Parameters
        ----------
        camera : Camera
            It may be another one in every call.
        previous : HierarchyFrame or (K,) integer array, optional
            The last frame, or nodes of the tree.
            The visible leaves are drawn first and untested, so that the pyramid is nearly complete
            when the walk begins.
            It changes no pixel.
        count : bool
            Whether the depth complexity is counted, which takes longer than the frame.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        camera = _arguments.instance("camera", camera, Camera, "a Camera")
        leaves = self._leaves(previous)
        counted = _arguments.flag("count", count)
        depth, levels, states, visible, counts, centres, milliseconds = self._inner.render(
            camera._inner, leaves, counted
        )
        image = depth.reshape(camera.size)
        above = tuple(texels.reshape(size) for size, texels in levels)
        in_view, drawn = (None, None) if centres is None else centres
        return HierarchyFrame(
            camera, image, (image, *above), states, visible, *counts, in_view, drawn, milliseconds
        )

    def render_flat(self, camera: Camera) -> FlatFrame:
        """Draws the same image by the rasteriser's own list, on one thread.

        Parameters
        ----------
        camera : Camera

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        camera = _arguments.instance("camera", camera, Camera, "a Camera")
        depth, meshlets, triangles, milliseconds = self._inner.render_flat(camera._inner)
        return FlatFrame(depth.reshape(camera.size), meshlets, triangles, milliseconds)

    def _leaves(self, previous: HierarchyFrame | npt.ArrayLike | None) -> npt.NDArray[np.uint32]:
        if previous is None:
            return np.zeros(0, np.uint32)
        if not isinstance(previous, HierarchyFrame):
            return _arguments.indices("previous", previous, len(self.nodes), "nodes")
        if len(previous.states) != len(self.nodes):
            raise ValueError(
                f"previous: expected a frame of this tree of {len(self.nodes)} nodes, "
                f"got one of {len(previous.states)}"
            )
        return previous.visible_leaves

    def __repr__(self) -> str:
        return (
            f"HierarchicalVisibility({self.num_triangles} triangles, "
            f"{self.num_meshlets} meshlets, {len(self.nodes)} nodes)"
        )
