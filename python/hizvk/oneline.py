"""One call from bounds and a depth image to a mask."""

from __future__ import annotations

import threading
import warnings
from typing import TYPE_CHECKING

from . import _arguments
from ._processes import per_process
from .bounds import Bounds, Points, are_points, as_arrays
from .building import check_side, of_arrays
from .camera import Camera
from .depth import checked_image
from .device import Device, maker_of
from .errors import HizWarning
from .hints import Counted, Question, Tally, middles_of
from .options import Outputs, cull_options
from .other_cameras import other_camera
from .resources import DepthImage, Pyramid
from .unit_hints import all_are_hidden, sampled

if TYPE_CHECKING:
    from collections.abc import Collection
    from typing import Unpack

    import numpy as np
    import numpy.typing as npt

    from ._types import DepthKind
    from .options import CullOptions, OptionKeywords
    from .tolerance import Tolerance

__all__ = ["visible"]


class _Default:
    """A device that is made once, at its first use."""

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.device: Device | None = None

    def get(self) -> Device:
        with self.lock:
            if self.device is None:
                self.device = Device()
            return self.device


#: The counts that hints look at.
_COUNTS = Outputs(mask=False, verdicts=True, indices=False, draws=False)

_defaults: dict[int, _Default] = {}


def default_device() -> Device:
    """The device of callers who bring none: one per process, made at its first use."""
    return per_process(_defaults, _Default).get()


def visible(
    bounds: Bounds,
    camera: Camera,
    *,
    depth: npt.ArrayLike | DepthImage,
    kind: DepthKind | None = None,
    scale: float = 1.0,
    invalid: Collection[float] | None = None,
    tolerance: Tolerance | None = None,
    device: Device | None = None,
    options: CullOptions | None = None,
    **keywords: Unpack[OptionKeywords],
) -> npt.NDArray[np.bool_]:
    """Which bounds can be seen.

    False is only what is surely outside the view or surely behind the depth image.
    For many calls with the same bounds, upload them once (`Device.instances`) and use
    `Device.cull`.

    The bounds are not sorted, since they are used once: ``hierarchy=None`` tests each by itself.
    They pass through the device in parts of 65,536, so the memory for them does not grow with N.
    The device keeps the image and its pyramid for the next call with an image of the same size.
    That is up to 64 MiB for the image and as much again for the pyramid.
    An image of more than 2^24 pixels is not kept.
    Calls from several threads at once each have their own.

    Parameters
    ----------
    bounds : Spheres, Boxes, OrientedBoxes or Points
        The N instances.
    camera : Camera
        The camera that saw `depth`.
    depth : (height, width) array or DepthImage
        The depth image, row 0 on top; its shape is the camera's size.
    kind : {"ndc", "reversed_ndc", "z", "distance"}
        What an array's numbers are (see `Device.pyramid`).
        Left out for a `DepthImage`.
    scale : float
        World units of one step of `depth`, for the kinds ``"z"`` and ``"distance"``.
    invalid : collection of float, optional
        Which numbers of an array mean "no data", before `scale`.
        None: those that are usual for its dtype, as in `Device.pyramid`.
    tolerance : Tolerance, optional
        How far the depths of an array may be off; None: not at all.
    device : Device, optional
        None: the device of `depth`, else one that is made at the first call and kept.
    options : CullOptions, optional
        How the cull decides; None takes the defaults.
    **keywords
        Any field of `CullOptions`, in the place of that of `options`.

    Returns
    -------
    (N,) bool array
        True for what is kept; invalid bounds (NaN, negative sizes) are kept.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    NoAdapterError
        Without a driver.

    Warns
    -----
    HizWarning
        If the call looks like a mistake, as in `CullResult.hints`: all bounds are outside of the
        view, points of size zero with ``coverage="sample"``, depth that is far everywhere or
        sparse, units that differ.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(90, 160), near=0.1)
    >>> image = np.full(camera.size, 12.0)  # a wall
    >>> centers = np.array([[0.0, 0.0, -5.0], [0.0, 0.0, -20.0]])
    >>> boxes = hizvk.Boxes(centers - 0.5, centers + 0.5)
    >>> hizvk.visible(boxes, camera, depth=image, kind="z").tolist()
    [True, False]
    """
    kind_and_arrays = as_arrays("bounds", bounds)
    _arguments.instance("camera", camera, Camera, "a Camera")
    options = cull_options(options, keywords, visible)
    if device is not None:
        _arguments.instance("device", device, Device, "a Device or None")
    if isinstance(depth, DepthImage):
        device = maker_of(depth) if device is None else device
        if camera != depth.camera:
            raise other_camera("camera", "the camera of depth", depth.camera, camera)
        for name, value in (("kind", kind), ("invalid", invalid), ("tolerance", tolerance)):
            if value is not None:
                got = _arguments.describe(value)
                raise TypeError(f"{name}: expected nothing beside a DepthImage, got {got}")
        pyramid = device.pyramid(depth, scale=scale)
        mask, counts = device._engine.cull_once(
            kind_and_arrays, camera._inner, pyramid._inner, options
        )

        def pyramid_again() -> Pyramid:
            return pyramid

        def depths() -> npt.NDArray[np.float64]:
            return Question(camera, pyramid, options, False).depths()

    else:
        if device is not None:
            check_side(device, camera)
        image = checked_image("depth", depth, camera, kind, scale, invalid, tolerance)
        maker = device = default_device() if device is None else device
        mask, counts = device._engine.cull_once(kind_and_arrays, camera._inner, image, options)
        stored = _arguments.stored_levels("levels", None)

        def pyramid_again() -> Pyramid:
            return of_arrays(maker, image, camera, stored)

        depths = sampled(image, camera)

    hints: tuple[str, ...] = ()
    # Points have a guard of their own.
    points = options.coverage == "sample" and not isinstance(bounds, Points) and are_points(bounds)
    # What hides some of the first bounds gives no cause for a hint.
    if points or not counts.occluded or 2 * counts.invalid > counts.tested:
        tally: Counted = Tally.of(counts)
        question = Question(camera, pyramid_again(), options, points)
        if tally.tested < len(bounds) and not points:
            instances = device.instances(bounds, order="given")
            tally = device.cull(instances, camera, question.pyramid, options, _COUNTS).stats
        hints = question.hints(tally, bounds)
    elif not mask.any():
        # Of all that is in view, nothing is kept.
        hints = all_are_hidden(camera, middles_of(bounds), depths, asked=False)
    for hint in hints:
        warnings.warn(hint, HizWarning, stacklevel=2)
    return mask
