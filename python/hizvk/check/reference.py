"""The oracle: what a cull may and may not hide, by brute force and without a GPU.

It decides in float64 and exact arithmetic, and shares no code with the engine.
It looks at every pixel that an instance can meet, so it is slow.
Use it in tests, and for the last word about single instances.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from .. import _arguments
from .._core import reference_classify, reference_pyramid, reference_unoccluded
from .._types import Coverage, OwnDepth, words
from ..bounds import Bounds, as_arrays
from ..camera import Camera
from ..depth import checked_image
from ..progress import Progress
from ..tolerance import numbers_of

if TYPE_CHECKING:
    from collections.abc import Collection

    import numpy.typing as npt

    from .._types import DepthKind
    from ..progress import ProgressLike
    from ..tolerance import Tolerance

__all__ = [
    "COVERED",
    "HIDDEN",
    "INVALID",
    "UNDECIDED",
    "UNOCCLUDED",
    "VISIBLE",
    "classify",
    "pyramid",
    "unoccluded",
]

HIDDEN: Final = 1
"""Surely hidden: outside the view, or every pixel that it can meet shows something nearer."""
VISIBLE: Final = 2
"""Surely visible: some pixel meets the bounds and shows nothing nearer."""
INVALID: Final = 3
"""The bounds are invalid; a cull has to keep them."""
UNDECIDED: Final = 4
"""Too close to call: it depends on which of the two float32 around a converted depth is taken."""
COVERED: Final = 5
"""Not unoccluded: a part is outside the view, or some pixel that it meets is no farther."""
UNOCCLUDED: Final = 6
"""Surely shows as a whole: inside the view, and every pixel that it meets is farther."""


#: The least instances that are decided in one step.
PART: Final = 1024


def classify(
    bounds: Bounds,
    camera: Camera,
    depth: npt.ArrayLike,
    *,
    kind: DepthKind,
    scale: float = 1.0,
    invalid: Collection[float] | None = None,
    tolerance: Tolerance | None = None,
    coverage: Coverage = "area",
    own_depth: OwnDepth = "nearest",
    progress: ProgressLike = None,
) -> npt.NDArray[np.uint8]:
    """The truth about each instance.

    Parameters
    ----------
    bounds : Spheres, Boxes, OrientedBoxes or Points
        The N volumes.
    camera : Camera
        The camera that saw `depth`.
    depth : (height, width) array
        The depth image, row 0 on top.
    kind, scale, invalid
        What its numbers are, as in `Device.pyramid`.
        For ``"z"`` and ``"distance"`` the oracle finds the NDC depth by itself, exactly, between
        two neighbouring float32.
    tolerance : Tolerance, optional
        How far its depths may be off, in the world, as in `Device.pyramid`.
        The truth is then that of the image whose depths are moved away from the eye by so much.
        They are moved exactly, so a cull with the same tolerance hides nothing that this calls
        `VISIBLE`.
    coverage : "area" or "sample"
        Which part of a pixel counts: its closed square, or its centre.
    own_depth : "nearest" or "pixel"
        When a pixel hides the bounds.
        ``"nearest"``: if it is nearer than all of them; ``fit="rectangle"`` culls no more than
        that.
        ``"pixel"``: if it is nearer than the part of them that it can show; for ``fit="volume"``.
    progress : bool or function, optional
        As everywhere (`hizvk.progress`); a step is a part of the instances.

    Returns
    -------
    (N,) uint8 array
        `HIDDEN`, `VISIBLE`, `INVALID` or `UNDECIDED`.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    """
    bounds_kind, arrays = as_arrays("bounds", bounds)
    _arguments.instance("camera", camera, Camera, "a Camera")
    checked = checked_image("depth", depth, camera, kind, scale, invalid)
    asked = (
        _arguments.choice("coverage", coverage, words(Coverage)),
        _arguments.choice("own_depth", own_depth, words(OwnDepth)),
        numbers_of("tolerance", tolerance),
    )
    # The image as given: the tolerance for half floats is not part of the truth.
    image = (checked.floats(), checked.kind, checked.scale, checked.invalid)
    codes = np.empty(len(bounds), np.uint8)
    with Progress(progress, "asking the oracle") as steps:
        for part in steps.parts(len(bounds), PART):
            some = tuple(array[part] for array in arrays)
            codes[part] = reference_classify(bounds_kind, some, camera._inner, *image, *asked)
    return codes


def unoccluded(
    bounds: Bounds,
    camera: Camera,
    depth: npt.ArrayLike,
    *,
    kind: DepthKind,
    scale: float = 1.0,
    invalid: Collection[float] | None = None,
    coverage: Coverage = "area",
    progress: ProgressLike = None,
) -> npt.NDArray[np.uint8]:
    """Whether all of each instance shows, with nothing of the image before any part.

    An instance is unoccluded if

    - all of its bounds lie strictly inside the six planes of the view volume, and
    - every pixel that they touch holds a depth strictly farther than all of them.

    A pixel of exactly the far plane's depth is background.
    A pixel without a valid depth may hold anything, so nothing over it is unoccluded.
    View depth and distance beyond the far plane are background, infinity included.

    Parameters
    ----------
    bounds : Spheres, Boxes or OrientedBoxes
        The N volumes.
    camera : Camera
        The camera that saw `depth`.
    depth : (height, width) array
        The depth image, row 0 on top.
    kind, scale, invalid
        What its numbers are, as in `Device.pyramid`.
    coverage : "area" or "sample"
        Which part of a pixel is touched: its closed square, or its centre.
    progress : bool or function, optional
        As everywhere (`hizvk.progress`); a step is a part of the instances.

    Returns
    -------
    (N,) uint8 array
        `UNOCCLUDED`, `COVERED`, `INVALID` or `UNDECIDED`.
        `compare_unoccluded` compares a cull's verdicts with it.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> camera = hizvk.Camera.look_at(
    ...     (0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(90, 160), near=0.1
    ... )
    >>> spheres = hizvk.Spheres([[0, 0, -4], [0, 0, -10], [0, 0, 4]], 0.5)
    >>> wall = np.full(camera.size, 10.0)
    >>> codes = hizvk.reference.unoccluded(spheres, camera, wall, kind="z")
    >>> (codes == hizvk.reference.UNOCCLUDED).tolist()
    [True, False, False]
    """
    bounds_kind, arrays = as_arrays("bounds", bounds)
    _arguments.instance("camera", camera, Camera, "a Camera")
    checked = checked_image("depth", depth, camera, kind, scale, invalid)
    asked = _arguments.choice("coverage", coverage, words(Coverage))
    image = (checked.floats(), checked.kind, checked.scale, checked.invalid)
    codes = np.empty(len(bounds), np.uint8)
    with Progress(progress, "asking the oracle") as steps:
        for part in steps.parts(len(bounds), PART):
            some = tuple(array[part] for array in arrays)
            codes[part] = reference_unoccluded(bounds_kind, some, camera._inner, *image, asked)
    return codes


def pyramid(depth: npt.ArrayLike, *, reversed_z: bool) -> list[npt.NDArray[np.float32]]:
    """All levels of the depth pyramid of an NDC image, finest first.

    Parameters
    ----------
    depth : (height, width) float array
        NDC depth of at least one pixel. float64 is rounded to float32 first.
    reversed_z : bool
        True: 0 is far; False: 1 is far.

    Returns
    -------
    list of (height, width) float32 arrays
        Level ``k`` has ``ceil(side / 2^k)`` texels per side; the last is 1x1.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    """
    image = _arguments.floats("depth", depth, ("height", "width"), whole=False)
    if image.size == 0:
        raise ValueError(f"depth: expected at least one pixel, got {_arguments.describe(image)}")
    reversed_z = _arguments.flag("reversed_z", reversed_z)
    height, width = image.shape
    flat = np.ascontiguousarray(image, dtype=np.float32).reshape(-1)
    levels = reference_pyramid(flat, width, height, reversed_z)
    return [texels.reshape(size) for size, texels in levels]
