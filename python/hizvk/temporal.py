"""Two passes a frame: what was visible is drawn first, and hides much of the rest.

`Device.temporal` makes a `Temporal`, which keeps what was visible from frame to frame.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import _arguments
from ._core import PassAnswer as CorePassAnswer
from ._core import TwoPasses as CoreTwoPasses
from ._on_device import Allocated, OnDevice, check_owner
from ._processes import cached_property
from .camera import Camera
from .naming import named
from .options import cull_options
from .other_cameras import other_camera
from .resources import DepthImage, Pyramid
from .result import CullResult, shared

if TYPE_CHECKING:
    from collections.abc import Collection
    from typing import Unpack

    import numpy.typing as npt

    from ._on_device import Maker
    from ._types import DepthKind, Levels
    from .options import CullOptions, OptionKeywords
    from .resources import Instances

__all__ = ["PassResult", "Temporal"]

#: The largest side of what `Temporal.early` takes by size, in pixels.
_LARGEST_SIDE = 2**31 - 1


class PassResult(OnDevice[CorePassAnswer]):
    """What one pass of `Temporal` draws; reading any part of it waits for the device.

    It stays as it is while later passes run.
    ``render_depth(only=result)`` draws it.
    """

    def __len__(self) -> int:
        """The number of instances, drawn or not."""
        return self._inner.num_instances()

    @cached_property
    def mask(self) -> npt.NDArray[np.bool_]:
        """``(N,)`` bool: True for what this pass draws."""
        return shared(self._inner.mask())  # type: ignore[no-any-return]

    @cached_property
    def indices(self) -> npt.NDArray[np.uint32]:
        """``(count,)`` uint32, ascending: what this pass draws."""
        return shared(np.flatnonzero(self.mask).astype(np.uint32))  # type: ignore[no-any-return]

    @property
    def count(self) -> int:
        """How many instances this pass draws."""
        return len(self.indices)

    def _summary(self) -> str:
        return f" of {len(self)} instances"


class Temporal(Allocated[CoreTwoPasses]):
    """Two passes per frame for one view; made by `Device.temporal`.

    A frame goes like this:

    1. `early` says what is drawn first: what the last frame has found visible.
       Draw it into an empty depth image.
    2. `late` tests all instances against that depth.
       It says what else is visible; draw it into the same image.

    The depth then equals that of all instances, bit for bit, whatever the early pass drew.
    So instances may move, appear and disappear, and the camera may jump: that costs time alone.

    The conditions, which ``docs/accuracy.md`` proves to be enough:

    - Everything that `early` names is drawn, and writes depth, before `late`.
    - Both passes of a frame have the same camera, and no update comes between them.
    - What is drawn lies within the bounds, without a bias of depth towards the eye.
    - The options of `late` allow for the renderer's errors: `CullOptions.depth_slack`,
      ``transform_slack`` and ``guard_px``.

    Sample coverage has to name its guard here, because a rasteriser has moved the corners of what
    was drawn: at least half its sub-pixel step, and 0.002 px more.
    ``guard_px=9/256`` covers the 4 bits that every Vulkan driver has (SwiftShader's), and 1/256
    covers 8 bits, as of this package's rasteriser on the host and of lavapipe.

    Examples
    --------
    Two boxes that are their own occluders, the small one behind the large one:

    >>> import numpy as np, hizvk
    >>> device = hizvk.Device()
    >>> camera = hizvk.Camera.look_at(
    ...     (0, 0, 9), (0, 0, 0), fov_y_deg=60, size=(90, 160), near=0.1
    ... )
    >>> low, high = np.array([[-3, -3, 0], [-2, -2, -9]]), np.array([[3, 3, 1], [2, 2, -8]])
    >>> crowd = device.instances(hizvk.Boxes(low * 1.0, high * 1.0))
    >>> corners = 1.0 * np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    >>> sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    >>> triangles = [side[i] for side in sides for i in (0, 1, 2, 0, 2, 3)]
    >>> drawn = device.occluders(
    ...     [(low[i] + corners * (high - low)[i], np.reshape(triangles, (-1, 3))) for i in (0, 1)]
    ... )
    >>> culler = device.temporal(crowd)
    >>> for frame in range(2):
    ...     early = culler.early(camera)
    ...     depth = device.render_depth(drawn, camera, only=early)
    ...     late = culler.late(camera, depth, depth_slack=1e-4)
    ...     touched = device.render_depth(drawn, into=depth, only=late)
    ...     print(early.indices, late.indices)
    [0 1] []
    [0] []
    >>> np.array_equal(depth.numpy(), device.render_depth(drawn, camera).numpy())
    True
    """

    def __init__(self, device: Maker, inner: CoreTwoPasses, instances: Instances) -> None:
        super().__init__(device, inner)
        self._instances = instances

    def early(
        self,
        camera: Camera,
        *,
        only: CullResult | PassResult | npt.ArrayLike | None = None,
        largest_px: int | None = None,
    ) -> PassResult:
        """Says what is drawn first; any set gives the right image, and what hides much saves most.

        Without `only` and `largest_px` it is what the last late pass found visible.
        In the first frame and after `reset` it is what is at least 12 pixels wide or high.
        What is outside of the view is left out of each set.

        Parameters
        ----------
        camera : Camera
            The camera of this frame.
        only : CullResult, PassResult, (N,) bool array or integer array, optional
            A set of your own, as a mask or as numbers of instances.
        largest_px : int, optional
            What is at least so many pixels wide or high, by its bounds; not beside `only`.
            Take it in the first frame after a camera cut.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        OutOfMemoryError
            If the device has no room for the answer.
        """
        _arguments.instance("camera", camera, Camera, "a Camera")
        if only is not None and largest_px is not None:
            raise ValueError(f"largest_px: expected None beside only, got {largest_px!r}")
        if largest_px is not None:
            largest_px = _arguments.integer("largest_px", largest_px, low=0, high=_LARGEST_SIDE)
        mask = None
        if isinstance(only, PassResult):
            only = only.mask
        if only is not None:
            mask = named("only", only, len(self._instances), "instance")
        return PassResult(self._device, self._inner.early(camera._inner, largest_px, mask))

    def late(
        self,
        camera: Camera,
        depth: Pyramid | DepthImage | npt.ArrayLike,
        *,
        kind: DepthKind | None = None,
        scale: float = 1.0,
        invalid: Collection[float] | None = None,
        levels: Levels = None,
        options: CullOptions | None = None,
        **keywords: Unpack[OptionKeywords],
    ) -> PassResult:
        """Says what else is visible: all that this depth does not hide, without the early set.

        Parameters
        ----------
        camera : Camera
            That of this frame's `early`.
        depth : DepthImage, Pyramid or (height, width) array
            The depth of what `early` named.
            Arrays need `kind`, as for `Device.pyramid`.
        kind, scale, invalid, levels
            As for `Device.pyramid`.
        options : CullOptions, optional
            How the cull decides; None takes the defaults.
            ``order="any"`` is refused, because two passes list from their masks.
            ``lod`` is refused, because masks do not tell levels of detail.
            `Device.cull` with ``meshes=``, ``lod=`` and ``among=late`` lists a pass by level.
        **keywords
            Any field of `CullOptions`, which takes the place of that of `options`.

        Returns
        -------
        PassResult
            Without an `early` before it, everything that is visible.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
            Also for another camera than that of `early`, for an update in between, and for sample
            coverage without a guard.
        LimitError, OutOfMemoryError
            If the device cannot hold the image.
        """
        _arguments.instance("camera", camera, Camera, "a Camera")
        chosen = cull_options(options, keywords, self.late, lists_levels=True)
        if chosen.lod is not None:
            raise ValueError(
                "lod: expected None, because the passes answer masks, which tell no levels of "
                f"detail, got {chosen.lod!r}; list what a pass draws by level with "
                "Device.cull(..., meshes=, lod=, among=late)"
            )
        pyramid = self._pyramid(camera, depth, kind, scale, invalid, levels)
        if pyramid.camera != camera:
            raise other_camera("camera", "the camera of depth", pyramid.camera, camera)
        return PassResult(self._device, self._inner.late(camera._inner, pyramid._inner, chosen))

    def _pyramid(
        self,
        camera: Camera,
        depth: Any,
        kind: DepthKind | None,
        scale: float,
        invalid: Collection[float] | None,
        levels: Levels,
    ) -> Pyramid:
        more: dict[str, Any] = {"kind": kind, "scale": scale, "invalid": invalid, "levels": levels}
        if isinstance(depth, Pyramid):
            check_owner("depth", depth, self._device)
            for name, default in (
                ("kind", None),
                ("scale", 1.0),
                ("invalid", None),
                ("levels", None),
            ):
                if more[name] != default:
                    got = _arguments.describe(more[name])
                    raise TypeError(f"{name}: expected nothing beside a Pyramid, got {got}")
            return depth
        if isinstance(depth, DepthImage):
            return self._device.pyramid(depth, **more)  # type: ignore[no-any-return]
        return self._device.pyramid(depth, camera, **more)  # type: ignore[no-any-return]

    def reset(self) -> None:
        """Forgets what was visible, as after a camera cut.

        The next `early` draws by size.
        Without it the image is right as well, but one frame draws what was visible before the cut.
        """
        self._inner.reset()

    def __len__(self) -> int:
        """The number of instances."""
        return len(self._instances)

    def _summary(self) -> str:
        return f" of {len(self)} instances"
