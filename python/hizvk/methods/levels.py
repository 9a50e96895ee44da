"""Other ways to make a depth image's levels: fragment passes, and one coarse level alone.

Source: Mike Turitzin, *Hierarchical Depth Buffers*, 2020.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, TypeAlias

import numpy as np

from .. import _arguments, _core
from .._types import words
from ..camera import Camera
from ..device import Device

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

__all__ = ["SHAPES", "MethodLevels"]

#: How the levels are made.
_LevelWay: TypeAlias = (
    Literal["fragment"] | Literal["atomic"] | Literal["tree"] | Literal["mips"] | Literal["pyramid"]
)
#: Width and height of the workgroups of atomic minima; each makes a texel of 16x16 pixels.
SHAPES: Final = ((16, 16), (16, 8), (16, 4), (8, 8), (8, 4), (4, 4))


class MethodLevels:
    """Levels of some depth images of one size, made in one submission.

    The numbers are taken as they are, in reversed depth: the least is the farthest.
    Unlike `Device.pyramid` the atomic minima lose -0.0 and NaN, and count what is above 1 as 1.

    Parameters
    ----------
    device : Device
        Where.
    way : "fragment", "atomic", "tree", "mips" or "pyramid"
        - ``"fragment"``: all levels, by a fragment pass each; sides are rounded down
        - ``"atomic"``, ``"tree"``: level 4 alone, by one dispatch
        - ``"mips"``, ``"pyramid"``: what hizvk makes, to compare with
    images : sequence of (H, W) float32 arrays
        The depth images.
    shape : (width, height)
        The workgroup of ``"atomic"``, one of `SHAPES`.
    levels : (first, last)
        The levels of ``"pyramid"``.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    hizvk.HizError
        What the device refuses.

    Examples
    --------
    >>> import hizvk, numpy as np
    >>> from hizvk.methods import MethodLevels
    >>> image = np.linspace(0.25, 0.75, 32 * 48, dtype=np.float32).reshape(32, 48)
    >>> levels = MethodLevels(hizvk.Device(), "atomic", [image], shape=(8, 8))
    >>> levels.run()
    >>> bool((levels.level(0, 4) == image.reshape(2, 16, 3, 16).min(axis=(1, 3))).all())
    True
    """

    def __init__(
        self,
        device: Device,
        way: _LevelWay,
        images: Sequence[npt.NDArray[np.float32]],
        *,
        shape: tuple[int, int] = (16, 16),
        levels: tuple[int, int] = (1, 15),
    ) -> None:
        _arguments.instance("device", device, Device, "a Device")
        _arguments.choice("way", way, words(_LevelWay))
        if shape not in SHAPES:
            raise ValueError(f"shape: expected one of {SHAPES}, got {shape!r}")
        arrays = [
            np.ascontiguousarray(_arguments.floats("images", one, ("H", "W")), np.float32)
            for one in images
        ]
        if not arrays or any(one.shape != arrays[0].shape for one in arrays):
            sizes = [one.shape for one in arrays]
            raise ValueError(f"images: expected at least one, all of one size, got {sizes}")
        # Of no view: it says the size, and that depth is reversed.
        camera = Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=arrays[0].shape, near=0.1)
        numbers = levels if way == "pyramid" else shape
        self._inner = _core.MethodLevels(device._engine, way, numbers, camera._inner, arrays)

    def run(self) -> None:
        """Makes the levels of all images, and waits for them."""
        self._inner.run()

    def level(self, image: int, k: int) -> npt.NDArray[np.float32]:
        """Level `k` of an image as a ``(height, width)`` array.

        Parameters
        ----------
        image : int
            Which of the images.
        k : int
            4; of ways that make all levels any but 0.
        """
        height, width, texels = self._inner.level(image, k)
        return texels.reshape(height, width)
