"""Levels of a depth pyramid, or one depth image, as a picture, a table and a figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from .colours import SKY, VIRIDIS, depth_table, scale_of, thinned
from .html import document, number
from .png import png

if TYPE_CHECKING:
    import numpy.typing as npt

    from .._arguments import Size
    from .colours import Scale, _Image

    _Floats = npt.NDArray[np.float32]

__all__ = ["Levels", "colour_bar"]

#: The longer side of level 0 in a picture, in pixels.
SIDE: Final = 512
#: The gap between levels, in pixels.
GAP: Final = 4
#: The panels per row of a figure.
COLUMNS: Final = 4


class Levels(NamedTuple):
    """What is shown: levels with their numbers, and what the depths are."""

    title: str
    """What it is, such as ``Pyramid 90x160, 8 levels``."""
    size: Size
    """``(height, width)`` of level 0."""
    levels: list[tuple[int, _Floats]]
    """Number and depths of each level, level 0 first."""
    what: str
    """What the numbers are, such as ``view depth z``."""
    unit: str
    """Their unit; empty for NDC."""

    @property
    def label(self) -> str:
        """The label of a scale."""
        return f"{self.what} ({self.unit})" if self.unit else self.what

    @property
    def scale(self) -> Scale:
        """One scale for all levels."""
        return scale_of(thinned(self.levels[0][1]))

    def picture(self) -> bytes:
        """A PNG: level 0 at the left, and the others below one another, each at its own scale."""
        scale = self.scale
        height, width = self.size
        shrunk = max(height, width) / SIDE
        tall, wide = max(round(height / shrunk), 1), max(round(width / shrunk), 1)
        first = scale.colours(_resized(self.levels[0][1], tall, wide))
        if len(self.levels) == 1:
            return png(first)
        # A mip chain: half as tall each time; what is smaller than 2 pixels is left out.
        rest: list[_Image] = []
        for k, texels in self.levels[1:]:
            sides = round(tall / 2.0**k), round(wide / 2.0**k)
            if min(sides) < 2:
                break
            rest.append(scale.colours(_resized(texels, *sides)))
        below = sum(len(one) + GAP for one in rest)
        across = max((one.shape[1] for one in rest), default=0)
        sheet = np.full((max(tall, below), wide + GAP + across, 3), 255, np.uint8)
        sheet[:tall, :wide] = first
        top = 0
        for one in rest:
            sheet[top : top + len(one), wide + GAP : wide + GAP + one.shape[1]] = one
            top += len(one) + GAP
        return png(sheet)

    def html(self) -> str:
        """The picture with its scale, and a table of the levels."""
        scale = self.scale
        rows = []
        for k, texels in self.levels:
            finite = texels[np.isfinite(texels)]
            ends = (
                [number(float(end)) for end in (finite.min(), finite.max())]
                if len(finite)
                else (["infinite"] * 2)
            )
            if len(finite) < texels.size:
                ends[1] = "infinite"
            rows.append([str(k), f"{texels.shape[0]} x {texels.shape[1]}", *ends])
        unit = f" {self.unit}" if self.unit else ""
        key = (
            f"{number(scale.low)}{unit}",
            ", ".join(reversed(VIRIDIS)),
            f"{number(scale.high)}{unit}",
            self.what + (", logarithmic" if scale.is_logarithmic else ""),
        )
        head = ["level", "texels", f"nearest{unit and ' (' + self.unit + ')'}", "farthest"]
        return document(self.title, self.picture(), table=(head, rows), depth_key=key, sky=SKY)

    def plot(self) -> Any:
        """A figure with a panel per level, all with the same axes and one scale."""
        from .figure import figure

        scale = self.scale
        count = len(self.levels)
        columns = min(COLUMNS, count)
        rows = -(-count // columns)
        height, width = self.size
        panel = 3.3 if count > 1 else 7.0
        tall = min(max(panel * height / width, 0.6), 2.0 * panel)
        sheet = figure(panel * columns + 1.2, (tall + 0.55) * rows + 0.7)
        axes = sheet.subplots(rows, columns, squeeze=False)
        for place, axis in enumerate(axes.flat):
            if place >= count:
                axis.set_axis_off()
                continue
            k, texels = self.levels[place]
            # A texel covers 2^k pixels, so the last ones may reach past the image.
            axis.imshow(
                scale.colours(thinned(texels)),
                interpolation="nearest",
                extent=(0, texels.shape[1] << k, texels.shape[0] << k, 0),
            )
            axis.set_xlim(0, width)
            axis.set_ylim(height, 0)
            if count > 1:
                axis.set_title(f"level {k}: {texels.shape[0]} x {texels.shape[1]} texels", size=9)
            axis.tick_params(labelsize=8)
            axis.locator_params(nbins=5)
            if place % columns == 0:
                axis.set_ylabel("row (pixels)", size=9)
            if place + columns >= count:
                axis.set_xlabel("column (pixels)", size=9)
        colour_bar(sheet, axes, scale, f"{self.label}; near-white: infinitely far")
        sheet.suptitle(self.title, size=11)
        return sheet


def colour_bar(sheet: Any, axes: Any, scale: Scale, label: str) -> None:
    """A scale of depth beside `axes`, near on top."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, LogNorm, Normalize
    from matplotlib.ticker import LogLocator, NullLocator

    norm = (LogNorm if scale.is_logarithmic else Normalize)(scale.low, scale.high)
    bar = sheet.colorbar(
        ScalarMappable(norm, ListedColormap(depth_table())), ax=axes, label=label, shrink=0.85
    )
    if scale.is_logarithmic:
        bar.ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        bar.ax.yaxis.set_minor_locator(NullLocator())
    bar.ax.yaxis.set_major_formatter("{x:g}")
    bar.ax.invert_yaxis()  # near is light, and on top


def _resized(texels: _Floats, tall: int, wide: int) -> _Floats:
    """The level at another size, by its nearest texels."""
    rows = ((np.arange(tall) + 0.5) * texels.shape[0] / tall).astype(np.intp)
    columns = ((np.arange(wide) + 0.5) * texels.shape[1] / wide).astype(np.intp)
    resized: _Floats = texels[rows][:, columns]
    return resized
