"""Approximate culling: what can show in a few pixels alone is culled, with a bound on the loss."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ._processes import cached_property
from .pixels import pixels_of
from .result import shared

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._core import ApproximateCulling
    from ._on_device import Maker

__all__ = ["ApproximateResult"]


class ApproximateResult:
    """The answer of `Device.cull_approximate`, which is not certified as that of `Device.cull` is.

    What it culls may show, in at most `pixels_lost` pixels of a picture.
    It is made by `Device.cull_approximate` alone, and may be read from any thread.

    Examples
    --------
    A ball that shows in few pixels, beside a nearer one:

    >>> import numpy as np, hizvk
    >>> device = hizvk.Device()
    >>> balls = device.instances(hizvk.Spheres([(0, 0, -5), (1, 0, -50)], 0.5))
    >>> camera = hizvk.Camera.look_at(
    ...     (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(64, 64), near=0.1
    ... )
    >>> pyramid = device.pyramid(np.full(camera.size, 100.0), camera, kind="z")
    >>> seen = device.cull_approximate(balls, camera, pyramid, negligible_px=10)
    >>> seen.mask
    array([ True, False])
    >>> seen.approximate, 1 <= seen.pixels_lost <= 10
    (True, True)
    """

    #: What tells it from a certified result, which has no such attribute.
    approximate = True

    def __init__(self, device: Maker, culling: ApproximateCulling, negligible_px: int) -> None:
        self._device = device
        self._inner = culling
        self._negligible_px = negligible_px

    def __len__(self) -> int:
        """The number of instances that were tested."""
        return self._inner.num_instances()

    def __repr__(self) -> str:
        return f"<ApproximateResult of {len(self)} instances, {self.negligible_px} px negligible>"

    @property
    def negligible_px(self) -> int:
        """The most pixels in which an instance may show that was culled."""
        return self._negligible_px

    @cached_property
    def mask(self) -> npt.NDArray[np.bool_]:
        """``(N,)`` bool: True for what is kept."""
        return shared(self._inner.mask())  # type: ignore[no-any-return]

    @cached_property
    def indices(self) -> npt.NDArray[np.uint32]:
        """``(K,)`` uint32: the list of kept instances, ascending."""
        return shared(self._inner.indices())  # type: ignore[no-any-return]

    @property
    def count(self) -> int:
        """Instances that are kept."""
        return int(np.count_nonzero(self.mask))

    @cached_property
    def pixels(self) -> npt.NDArray[np.void]:
        """``(N,)`` of `PIXELS_DTYPE`: in how many pixels each instance is hidden, and may show."""
        return shared(pixels_of(self._inner.pixels()))  # type: ignore[no-any-return]

    @cached_property
    def negligible(self) -> npt.NDArray[np.bool_]:
        """``(N,)`` bool: True for what can show in at most `negligible_px` pixels."""
        return shared(self._inner.negligible())  # type: ignore[no-any-return]

    @property
    def pixels_lost(self) -> int:
        """The most pixels by which a picture of what is kept differs from one of everything.

        It is the sum of ``touched - hidden`` of what is `negligible`.
        It holds for a picture of the depth image's camera and size, with one sample per pixel, in
        which the bounds contain what is drawn.
        An antialiased picture has more samples: see ``docs/counts.md``.
        """
        lost = self.pixels[self.negligible]
        return int(np.sum(lost["touched"].astype(np.uint64) - lost["hidden"]))
