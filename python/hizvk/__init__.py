"""Occlusion culling on the GPU that never hides what can be seen.

How data flows, and which object holds it::

    triangles ─ Device.occluders ─> Occluders ─┐
                                               │ Device.render_depth
    depth array (kind= says what it holds)     └─> DepthImage
                      │                                │
                      └──────── Device.pyramid ────────┴─> Pyramid ─┐
    Spheres, Boxes, OrientedBoxes,                                  │
    Points ───────────────── Device.instances ─> Instances ─────────┤ Device.cull
    Camera ─────────────────────────────────────────────────────────┤
    CullOptions, Outputs ───────────────────────────────────────────┘
                                                                    │
                                                                    v
    CullResult: .mask .verdicts .indices .count .stats .explain(i)
                .draws (indirect draw arguments)

Level k of a pyramid holds the farthest depth of every block of 2^k x 2^k pixels.
A cull reads the few texels that cover the bounds of an instance.
It hides the instance if all of the bounds are provably farther than those texels.
The other instances are appended to the list that an indirect draw takes.

The promise: for the numbers as given, whatever could show in a pixel of the depth image is kept.
`reference` holds the oracle, which is slow and exact.
`compare` counts false culls, of which there are none, and false keeps, which are a cost.
`compare_unoccluded` does the same for what a cull says surely shows.
A small depth image holds for larger ones if it was rendered with ``conservative=True``.
`check_proxy` and `check_bounds` say whether occluders and bounds are what they should be.
`split_mesh`, `inner_boxes`, `inner_prisms` and `select_occluders` make occluders of meshes.

    >>> import hizvk
    >>> import numpy as np
    >>> centers = np.array([[0.0, 2.0, -6.0], [0.0, 2.0, -30.0], [0.0, 2.0, 30.0]])
    >>> vertices = [[-8.0, 0.0, -12.0], [8.0, 0.0, -12.0], [8.0, 6.0, -12.0], [-8.0, 6.0, -12.0]]
    >>> triangles = [[0, 1, 2], [0, 2, 3]]
    >>> camera = hizvk.Camera.look_at(
    ...     (0, 2, 0), (0, 2, -1), fov_y_deg=60, size=(540, 960), near=0.1
    ... )
    >>> device = hizvk.Device()
    >>> crowd = device.instances(hizvk.Spheres(centers, 0.5))
    >>> hiz = device.pyramid(device.render_depth(device.occluders(vertices, triangles), camera))
    >>> seen = device.cull(crowd, camera, hiz)
    >>> seen.mask.tolist(), seen.indices.tolist()
    ([True, False, False], [0])
    >>> [hizvk.Verdict(code).name for code in seen.verdicts]
    ['VISIBLE', 'OCCLUDED', 'OUTSIDE']

`visible` does all of it in one call, with a depth image of one's own.

Conventions:

- Matrices are C-order (4, 4) for column vectors.
- NDC is x right, y up, z in 0..1.
- Sizes are (height, width), row 0 of an image is its top, and the first pixel's centre is at
  (0.5, 0.5).

A bad argument raises a `TypeError` or `ValueError` that names the parameter.
Everything that the device refuses is a `HizError`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

# The compiled module comes first: devices are let go of after whatever was registered later.
from ._core import __version__
from ._processes import driver_is_asked as _driver_is_asked  # noqa: F401 - it minds forks
from .errors import (
    DeviceLostError,
    HizError,
    HizWarning,
    LimitError,
    NoAdapterError,
    OutOfMemoryError,
)

if TYPE_CHECKING:
    from . import reference
    from .adapter import Adapter, adapters
    from .approximate import ApproximateResult
    from .bounds import Boxes, OrientedBoxes, Points, Spheres
    from .camera import Camera
    from .check import (
        BoundsCheck,
        Comparison,
        ProxyCheck,
        UnoccludedComparison,
        check_bounds,
        check_proxy,
        compare,
        compare_unoccluded,
    )
    from .device import Device
    from .explanation import Explanation, Verdict
    from .light import DirectionalLight
    from .lod import LodByDistance, LodByError, LodBySize
    from .mesh import Mesh
    from .methods import (
        BspTiling,
        HierarchicalVisibility,
        HierarchyFrame,
        MapResult,
        OcclusionMap,
        PublishedTest,
        TiledCoverage,
    )
    from .mips import mip_texel, wgsl
    from .occluders import (
        InnerBoxes,
        InnerPrisms,
        OccluderSelection,
        SplitMesh,
        inner_boxes,
        inner_prisms,
        select_occluders,
        split_mesh,
    )
    from .oneline import visible
    from .options import CullOptions, DrawTemplate, MeshLods, Outputs
    from .pixels import PIXELS_DTYPE, visible_fraction
    from .points import PointColours, colour_points, depth_from_points
    from .projection import Projected, gather
    from .recommendation import Recommendation, recommend
    from .resources import DepthImage, Instances, Occluders, Pyramid
    from .result import ABSENT, DRAW_DTYPE, NO_LOD, CullResult
    from .sparse import fill_depth
    from .stats import CullStats
    from .sweeping import Sweep, SweepInterrupted, cube, sweep, viewshed, visible_sets
    from .temporal import PassResult, Temporal
    from .timing import StageTime, StageTimes
    from .tolerance import Tolerance
    from .views import ViewsResult

__all__ = [
    "ABSENT",
    "DRAW_DTYPE",
    "NO_LOD",
    "PIXELS_DTYPE",
    "Adapter",
    "ApproximateResult",
    "BoundsCheck",
    "Boxes",
    "BspTiling",
    "Camera",
    "Comparison",
    "CullOptions",
    "CullResult",
    "CullStats",
    "DepthImage",
    "Device",
    "DeviceLostError",
    "DirectionalLight",
    "DrawTemplate",
    "Explanation",
    "HierarchicalVisibility",
    "HierarchyFrame",
    "HizError",
    "HizWarning",
    "InnerBoxes",
    "InnerPrisms",
    "Instances",
    "LimitError",
    "LodByDistance",
    "LodByError",
    "LodBySize",
    "MapResult",
    "Mesh",
    "MeshLods",
    "NoAdapterError",
    "OccluderSelection",
    "Occluders",
    "OcclusionMap",
    "OrientedBoxes",
    "OutOfMemoryError",
    "Outputs",
    "PassResult",
    "PointColours",
    "Points",
    "Projected",
    "ProxyCheck",
    "PublishedTest",
    "Pyramid",
    "Recommendation",
    "Spheres",
    "SplitMesh",
    "StageTime",
    "StageTimes",
    "Sweep",
    "SweepInterrupted",
    "Temporal",
    "TiledCoverage",
    "Tolerance",
    "UnoccludedComparison",
    "Verdict",
    "ViewsResult",
    "__version__",
    "adapters",
    "check_bounds",
    "check_proxy",
    "colour_points",
    "compare",
    "compare_unoccluded",
    "cube",
    "depth_from_points",
    "fill_depth",
    "gather",
    "inner_boxes",
    "inner_prisms",
    "mip_texel",
    "recommend",
    "reference",
    "select_occluders",
    "split_mesh",
    "sweep",
    "viewshed",
    "visible",
    "visible_fraction",
    "visible_sets",
    "wgsl",
]


#: Where the other names come from.
#: They are loaded at their first use, so that an import costs little, and a cull no more than it
#: needs.
_LATER = {
    "ABSENT": "result",
    "Adapter": "adapter",
    "ApproximateResult": "approximate",
    "BoundsCheck": "check",
    "Boxes": "bounds",
    "BspTiling": "methods",
    "Camera": "camera",
    "Comparison": "check",
    "CullOptions": "options",
    "CullResult": "result",
    "CullStats": "stats",
    "DRAW_DTYPE": "result",
    "DepthImage": "resources",
    "Device": "device",
    "DirectionalLight": "light",
    "DrawTemplate": "options",
    "Explanation": "explanation",
    "HierarchicalVisibility": "methods",
    "HierarchyFrame": "methods",
    "InnerBoxes": "occluders",
    "InnerPrisms": "occluders",
    "Instances": "resources",
    "LodByDistance": "lod",
    "LodByError": "lod",
    "LodBySize": "lod",
    "MapResult": "methods",
    "Mesh": "mesh",
    "MeshLods": "options",
    "NO_LOD": "result",
    "OccluderSelection": "occluders",
    "Occluders": "resources",
    "OcclusionMap": "methods",
    "OrientedBoxes": "bounds",
    "Outputs": "options",
    "PIXELS_DTYPE": "pixels",
    "PassResult": "temporal",
    "PointColours": "points",
    "Points": "bounds",
    "Projected": "projection",
    "ProxyCheck": "check",
    "PublishedTest": "methods",
    "Pyramid": "resources",
    "Recommendation": "recommendation",
    "Spheres": "bounds",
    "SplitMesh": "occluders",
    "StageTime": "timing",
    "StageTimes": "timing",
    "Sweep": "sweeping",
    "SweepInterrupted": "sweeping",
    "Temporal": "temporal",
    "TiledCoverage": "methods",
    "Tolerance": "tolerance",
    "UnoccludedComparison": "check",
    "Verdict": "explanation",
    "ViewsResult": "views",
    "adapters": "adapter",
    "check_bounds": "check",
    "check_proxy": "check",
    "colour_points": "points",
    "compare": "check",
    "compare_unoccluded": "check",
    "cube": "sweeping",
    "depth_from_points": "points",
    "fill_depth": "sparse",
    "gather": "projection",
    "inner_boxes": "occluders",
    "inner_prisms": "occluders",
    "mip_texel": "mips",
    "recommend": "recommendation",
    "select_occluders": "occluders",
    "split_mesh": "occluders",
    "sweep": "sweeping",
    "viewshed": "sweeping",
    "visible": "oneline",
    "visible_fraction": "pixels",
    "visible_sets": "sweeping",
    "wgsl": "mips",
}
#: Modules that are attributes of the package without an import of their own.
_MODULES = {*_LATER.values(), "progress", "reference"}


def __getattr__(name: str) -> Any:
    """The names of `_LATER` and the modules, loaded at their first use."""
    if name in _LATER:
        globals()[name] = getattr(import_module(f".{_LATER[name]}", __name__), name)
        return globals()[name]
    if name in _MODULES:
        return import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
