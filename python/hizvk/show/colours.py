"""Colours of all pictures, and depth in colours.

What was kept is white, and what was culled is red: they differ in lightness as well as in hue, so
readers who cannot tell red from green can tell them apart.
Depth has the colours of *viridis* (van der Walt and Smith 2015, CC0), whose lightness grows evenly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    _Image = npt.NDArray[np.uint8]
    _Doubles = npt.NDArray[np.float64]

__all__ = [
    "BACKGROUND", "CLASS_COLOURS", "FRUSTUM", "INK", "MARK", "SKY", "Scale", "depth_table", "grey",
    "rgb", "scale_of", "thinned",
]  # fmt: skip

BACKGROUND: Final = "#14181c"
INK: Final = "#e8edf2"
FRUSTUM: Final = "#ffd84a"
#: A rectangle of pixels, and a texel that decided.
MARK: Final = "#ff7de9"
#: What is infinitely far.
SKY: Final = "#eef2f6"
#: By class: kept, culled because hidden, culled because outside of the view.
CLASS_COLOURS: Final = ("#ffffff", "#ff4638", "#6c8fb8")
#: Viridis at ten places, the same distance apart, from dark to light.
VIRIDIS: Final = (
    "#440154", "#482878", "#3e4a89", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58",
    "#b5de2b", "#fde725",
)  # fmt: skip
#: Depth that spans a larger ratio than this gets a logarithmic scale.
LOGARITHMIC: Final = 6.0
#: The share of the pixels at each end that the scale does not wait for.
TAIL: Final = 0.005
#: The greys of near and far depth behind instances; darker than any of their colours.
NEAR_GREY, FAR_GREY, SKY_GREY = 118.0, 44.0, 24.0


def rgb(colour: str) -> tuple[int, int, int]:
    """``"#ff8000"`` -> (255, 128, 0)."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def depth_table() -> _Doubles:
    """``(256, 3)`` in 0..1: the colours of depth, from near (light) to far (dark)."""
    anchors = np.array([rgb(colour) for colour in reversed(VIRIDIS)]) / 255.0
    places = np.linspace(0.0, len(anchors) - 1.0, 256)
    return np.stack([np.interp(places, np.arange(len(anchors)), a) for a in anchors.T], axis=1)


class Scale(NamedTuple):
    """Which depths the two ends of the colours stand for."""

    low: float
    high: float
    is_logarithmic: bool

    def places(self, depth: npt.NDArray[np.floating]) -> _Doubles:
        """0 for `low` to 1 for `high`, clipped; NaN for depth that is not finite."""
        with np.errstate(invalid="ignore", divide="ignore"):
            values = np.asarray(depth, np.float64)
            low, high = self.low, self.high
            if self.is_logarithmic:
                values, low, high = np.log(values), float(np.log(low)), float(np.log(high))
            shares: _Doubles = np.clip((values - low) / (high - low), 0.0, 1.0)
        shares[~np.isfinite(depth)] = np.nan
        return shares

    def colours(self, depth: npt.NDArray[np.floating]) -> _Image:
        """``(height, width, 3)``: depth in colours, and `SKY` where it is not finite."""
        places = self.places(depth)
        table = np.concatenate([np.rint(255.0 * depth_table()), [rgb(SKY)]]).astype(np.uint8)
        return table[np.where(np.isnan(places), 256, np.rint(255.0 * places)).astype(np.intp)]


def scale_of(depth: npt.NDArray[np.floating]) -> Scale:
    """The scale for most of a depth image; logarithmic if its depths differ much."""
    finite = np.asarray(depth, np.float64)[np.isfinite(depth)]
    if len(finite) == 0:
        return Scale(0.0, 1.0, False)
    low, high = (float(end) for end in np.quantile(finite, (TAIL, 1.0 - TAIL)))
    if low > 0.0 and high > LOGARITHMIC * low:
        return Scale(low, high, True)
    if high - low <= 1e-6 * max(abs(low), abs(high)):  # a wall: any width will do
        wide = 0.1 * max(abs(low), 1e-3)
        return Scale(low - wide, high + wide, False)
    return Scale(low, high, False)


def thinned(depth: npt.NDArray[Any], most: int = 800) -> npt.NDArray[Any]:
    """Every n-th row and column, so that no side is longer than about `most`."""
    step = max(-(-max(depth.shape) // most), 1)
    return depth[::step, ::step]


def grey(depth: npt.NDArray[np.floating]) -> _Image:
    """``(height, width, 3)``: depth in dark greys, for what is drawn over it."""
    places = scale_of(depth).places(depth)
    shade = np.where(np.isnan(places), SKY_GREY, NEAR_GREY + (FAR_GREY - NEAR_GREY) * places)
    return np.repeat(shade.astype(np.uint8)[..., None], 3, axis=2)
