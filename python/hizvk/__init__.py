"""Occlusion culling on the GPU that never hides what can be seen.

How data flows, and which object holds it::

    triangles ── Device.occluders ──> Occluders ─┐ Device.render_depth
                                                 ├──> DepthImage ── Device.pyramid ──> Pyramid ─┐
    depth array (kind= says what it holds) ──────┘                                              │ Device.cull
    Spheres, Boxes, OrientedBoxes ── Device.instances ──> Instances ────────────────────────────┤
    Camera ─────────────────────────────────────────────────────────────────────────────────────┘
                                                                                                v
                        CullResult: .mask .verdicts .indices .count .draws (indirect draw arguments)
                        .stats .explain(i)

A pyramid keeps the farthest depth of every 2^k x 2^k block of pixels on its level k.
A cull looks up the few texels that cover an instance's bounds; when all of the bounds are provably
farther than those, it hides the instance, and the others are appended to the list that an indirect
draw takes.
The promise: for the numbers as given, whatever could show in one pixel of the depth image is kept.
`reference` holds the slow exact oracle, and `compare` counts false culls (there are none) and false
keeps (a cost).
A small depth image promises for larger ones if it was rendered with ``conservative=True``;
`check_proxy` and `check_bounds` say whether occluders and bounds are what they should be.

    >>> import hizvk
    >>> import numpy as np
    >>> centers = np.array([[0.0, 2.0, -6.0], [0.0, 2.0, -30.0], [0.0, 2.0, 30.0]])
    >>> vertices = [[-8.0, 0.0, -12.0], [8.0, 0.0, -12.0], [8.0, 6.0, -12.0], [-8.0, 6.0, -12.0]]
    >>> triangles = [[0, 1, 2], [0, 2, 3]]
    >>> camera = hizvk.Camera.look_at((0, 2, 0), (0, 2, -1), fov_y_deg=60, size=(540, 960), near=0.1)
    >>> device = hizvk.Device()
    >>> crowd = device.instances(hizvk.Spheres(centers, 0.5))
    >>> hiz = device.pyramid(device.render_depth(device.occluders(vertices, triangles), camera))
    >>> seen = device.cull(crowd, camera, hiz)
    >>> seen.mask.tolist(), seen.indices.tolist(), [hizvk.Verdict(code).name for code in seen.verdicts]
    ([True, False, False], [0], ['VISIBLE', 'OCCLUDED', 'OUTSIDE'])

or in one call, with a depth image of one's own, `visible`.

Conventions: matrices are C-order (4, 4) for column vectors, NDC is x right, y up, z in 0..1, sizes
are (height, width), row 0 of an image is its top, and the first pixel's centre is at (0.5, 0.5).
Bad arguments raise `TypeError` or `ValueError` with the parameter's name; everything that the
device refuses is a `HizError`.
"""

from typing import TYPE_CHECKING, Any

from . import reference
from ._core import __version__
from .adapter import Adapter, adapters
from .bounds import Boxes, OrientedBoxes, Spheres
from .camera import Camera
from .check import BoundsCheck, Comparison, ProxyCheck, check_bounds, check_proxy, compare
from .device import Device
from .errors import (
    DeviceLostError,
    HizError,
    HizWarning,
    LimitError,
    NoAdapterError,
    OutOfMemoryError,
)
from .explanation import Explanation, Verdict
from .mesh import Mesh
from .oneline import visible
from .options import CullOptions, DrawTemplate, Outputs
from .resources import DepthImage, Instances, Occluders, Pyramid
from .result import DRAW_DTYPE, CullResult
from .stats import CullStats

if TYPE_CHECKING:
    from .bench.recommend import Recommendation, recommend

__all__ = [
    "DRAW_DTYPE",
    "Adapter",
    "BoundsCheck",
    "Boxes",
    "Camera",
    "Comparison",
    "CullOptions",
    "CullResult",
    "CullStats",
    "DepthImage",
    "Device",
    "DeviceLostError",
    "DrawTemplate",
    "Explanation",
    "HizError",
    "HizWarning",
    "Instances",
    "LimitError",
    "Mesh",
    "NoAdapterError",
    "Occluders",
    "OrientedBoxes",
    "OutOfMemoryError",
    "Outputs",
    "ProxyCheck",
    "Pyramid",
    "Recommendation",
    "Spheres",
    "Verdict",
    "__version__",
    "adapters",
    "check_bounds",
    "check_proxy",
    "compare",
    "recommend",
    "reference",
    "visible",
]


def __getattr__(name: str) -> Any:
    """`recommend` and `Recommendation` at their first use: culling needs nothing of what they load."""
    if name in ("recommend", "Recommendation"):
        from .bench import recommend as module

        globals()[name] = getattr(module, name)
        return globals()[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
