"""An explanation as a picture and a figure: rectangle, texels, their depths, the nearest depth."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from ..view_depth import RayView, converted
from .colours import CLASS_COLOURS, MARK, rgb, scale_of, thinned
from .html import document, number
from .lines import draw
from .png import png

if TYPE_CHECKING:
    import numpy.typing as npt

    from ..camera import Camera
    from .colours import _Doubles, _Image

__all__ = ["Explained", "explained_of"]

#: Pixels around the rectangle that a picture shows, as a share of its longer side,
AROUND: Final = 0.6
#: and at least so many.
LEAST_AROUND: Final = 6
#: The longer side of the picture in a notebook, in pixels.
SIDE: Final = 420
#: Outlines of texels in pictures of dark and of light depth.
TEXEL: Final = "#14181c"
#: The outline of the rectangle, between dark lines.
BOUNDS: Final = "#ffffff"
#: More texels than this get no number in a figure.
MOST_LABELS: Final = 40
#: How many texels the second panel of a figure shows: the farthest ones and the decisive one.
MOST_DOTS: Final = 24


class Explained(NamedTuple):
    """What is shown of an `Explanation`."""

    lines: list[str]
    """Its text."""
    title: str
    is_culled: bool
    rectangle: tuple[int, int, int, int] | None
    camera: Camera
    depth: npt.NDArray[np.float32]
    """Level 0 in NDC."""
    texels: npt.NDArray[np.intp]
    """``(T, 3)``: level, column and row of each texel that was read."""
    texel_depths: npt.NDArray[np.float32]
    """``(T,)``: their NDC depths."""
    decisive: int | None
    nearest: float | None
    """The nearest depth of the bounds: view depth, or NDC where the camera does not say it."""
    unit: str

    @property
    def _is_metric(self) -> bool:
        return not RayView(self.camera).is_bare

    @property
    def _label(self) -> str:
        return f"view depth z ({self.unit})" if self._is_metric else "NDC depth"

    def _metric(self, depth: npt.NDArray[np.float32], level: int = 0) -> npt.NDArray[np.float32]:
        return converted(self.camera, depth, "z" if self._is_metric else None, level)

    def _depths(self) -> _Doubles:
        """``(T,)``: depths of the texels as they are shown."""
        if len(self.texels) == 0:
            return np.zeros(0)
        view = RayView(self.camera)
        ndc = self.texel_depths.astype(np.float64)
        if view.is_bare:
            return ndc
        return np.array(
            [view.depth_at(d, *self._middle(t)) for d, t in zip(ndc, self.texels, strict=True)]
        )

    def _middle(self, texel: npt.NDArray[np.intp]) -> tuple[float, float]:
        x0, y0, x1, y1 = self._pixels(texel)
        return 0.5 * (x0 + x1), 0.5 * (y0 + y1)

    def _pixels(self, texel: npt.NDArray[np.intp]) -> tuple[int, int, int, int]:
        """The pixels of a texel, from the first column and row to before the last."""
        level, x, y = (int(one) for one in texel)
        height, width = self.camera.size
        ends = min((x + 1) << level, width), min((y + 1) << level, height)
        return x << level, y << level, *ends

    def _window(self) -> tuple[int, int, int, int]:
        """The part of the image that is shown: x0, y0 to before x1, y1."""
        height, width = self.camera.size
        if self.rectangle is None:
            return 0, 0, width, height
        x0, y0, x1, y1 = self.rectangle
        boxes = [(x0, y0, x1 + 1, y1 + 1), *(self._pixels(texel) for texel in self.texels)]
        left, top = min(b[0] for b in boxes), min(b[1] for b in boxes)
        right, bottom = max(b[2] for b in boxes), max(b[3] for b in boxes)
        room = max(int(AROUND * max(x1 - x0, y1 - y0)), LEAST_AROUND)
        return (
            max(left - room, 0), max(top - room, 0),
            min(right + room, width), min(bottom + room, height),
        )  # fmt: skip

    def picture(self) -> bytes:
        """A PNG of the depth around the rectangle (white), with the texels that were read."""
        x0, y0, x1, y1 = self._window()
        depth = self._metric(self.depth)
        shown = scale_of(thinned(depth)).colours(depth[y0:y1, x0:x1])
        factor = max(SIDE // max(x1 - x0, y1 - y0), 1)
        step = max(max(x1 - x0, y1 - y0) // SIDE, 1)
        image = shown[::step, ::step].repeat(factor, axis=0).repeat(factor, axis=1)
        scale = factor / step
        for place, texel in enumerate(self.texels):
            if place != self.decisive:
                _frame(image, self._pixels(texel), (x0, y0), scale, TEXEL)
        if self.decisive is not None:
            _frame(image, self._pixels(self.texels[self.decisive]), (x0, y0), scale, MARK)
        if self.rectangle is not None:
            a, b, c, d = self.rectangle
            _frame(image, (a, b, c + 1, d + 1), (x0, y0), scale, TEXEL)
            _frame(image, (a, b, c + 1, d + 1), (x0, y0), scale, BOUNDS, inwards=1)
        return png(np.ascontiguousarray(image))

    def html(self) -> str:
        """The picture above the text."""
        notes = ["white: pixels that the bounds can meet; dark: texels that were read"]
        if self.decisive is not None:
            notes[0] += "; pink: the texel that decided"
        return document(
            self.title,
            self.picture(),
            notes=[*(notes if self.rectangle is not None else []), *self.lines],
        )

    def plot(self) -> Any:
        """A figure: at the left the depth around the rectangle, at the right all depths."""
        from .figure import figure

        sheet = figure(12.0, 5.6)
        left, right = sheet.subplots(1, 2, width_ratios=(1.35, 1.0))
        self._place(sheet, left)
        self._compare(right)
        sheet.suptitle(self.title, size=11)
        return sheet

    def _place(self, sheet: Any, axis: Any) -> None:
        from matplotlib.lines import Line2D
        from matplotlib.patches import Rectangle
        from matplotlib.patheffects import withStroke

        from .levels import colour_bar

        x0, y0, x1, y1 = self._window()
        depth = self._metric(self.depth)
        scale = scale_of(thinned(depth))
        axis.imshow(
            scale.colours(depth[y0:y1, x0:x1]), interpolation="nearest", extent=(x0, x1, y1, y0)
        )
        depths = self._depths()
        edges = [Line2D([], [], color="black", linewidth=1.0, label="texels that were read")]
        for place, texel in enumerate(self.texels):
            a, b, c, d = self._pixels(texel)
            decides = place == self.decisive
            axis.add_patch(
                Rectangle(
                    (a, b), c - a, d - b, fill=False, zorder=4 if decides else 3,
                    edgecolor=MARK if decides else "black", linewidth=2.4 if decides else 1.0,
                )
            )  # fmt: skip
            if len(self.texels) <= MOST_LABELS:
                box = {"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1.0}
                text = number(float(depths[place])) if np.isfinite(depths[place]) else "far"
                axis.text(
                    (a + c) / 2, (b + d) / 2, text, ha="center", va="center", size=8, bbox=box,
                    zorder=7, clip_on=True,
                )  # fmt: skip
        if self.decisive is not None:
            edges.append(Line2D([], [], color=MARK, linewidth=2.4, label="the one that decided"))
        if self.rectangle is None:
            axis.set_title("no rectangle: the test ended before", size=9)
        else:
            a, b, c, d = self.rectangle
            axis.add_patch(
                Rectangle(
                    (a, b), c + 1 - a, d + 1 - b, fill=False, edgecolor="black", linewidth=3.4,
                    zorder=5,
                )
            )  # fmt: skip
            axis.add_patch(
                Rectangle(
                    (a, b), c + 1 - a, d + 1 - b, fill=False, edgecolor=BOUNDS, linewidth=1.8,
                    zorder=6,
                )
            )  # fmt: skip
            dark = [withStroke(linewidth=4.0, foreground="black")]
            named: dict[str, Any] = {"color": BOUNDS, "linewidth": 2.0, "path_effects": dark}
            edges.insert(0, Line2D([], [], label="pixels of the bounds", **named))
            axis.legend(
                handles=edges, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3,
                fontsize=8, frameon=False,
            )  # fmt: skip
            axis.set_title("the depth image around the instance", size=9)
        axis.set_xlim(x0, x1)
        axis.set_ylim(y1, y0)
        axis.set_xlabel("column (pixels)", size=9)
        axis.set_ylabel("row (pixels)", size=9)
        axis.tick_params(labelsize=8)
        axis.locator_params(integer=True, nbins=7)
        colour_bar(sheet, axis, scale, self._label)

    def _compare(self, axis: Any) -> None:
        """Depths of the texels as dots, and the nearest depth of the instance as a line."""
        depths = self._depths()
        order = np.argsort(-np.nan_to_num(depths, posinf=np.inf), kind="stable")[:MOST_DOTS]
        if self.decisive is not None and self.decisive not in order:
            order[-1] = self.decisive
        finite = depths[order][np.isfinite(depths[order])]
        values = [*finite, *([] if self.nearest is None else [self.nearest])]
        axis.tick_params(labelsize=8)
        axis.set_xlabel(self._label, size=9)
        if not values and len(order) == 0:
            axis.set_axis_off()
            text = "No texel was read, because the test ended before."
            axis.text(0.5, 0.5, text, ha="center", size=10, transform=axis.transAxes)
            return
        low, high = (min(values), max(values)) if values else (0.0, 1.0)
        room = 0.12 * (high - low) + 0.02 * max(abs(high), 1e-6)
        axis.set_xlim(low - room, high + 2.0 * room)
        edge = high + 1.4 * room
        for line, place in enumerate(order):
            far = not np.isfinite(depths[place])
            axis.plot(
                edge if far else depths[place], line, marker=">" if far else "o", linestyle="none",
                color=MARK if place == self.decisive else "black",
                markeredgecolor="black", markersize=9 if place == self.decisive else 6,
            )  # fmt: skip
        names = [
            f"level {k}, ({x}, {y})" + (": far" if not np.isfinite(depths[place]) else "")
            for place, (k, x, y) in zip(order, self.texels[order], strict=True)
        ]
        axis.set_yticks(range(len(order)), names)
        axis.set_ylim(max(len(order), 1) - 0.4, -0.6)
        if self.nearest is not None:
            colour = CLASS_COLOURS[1] if self.is_culled else "#2a6fb0"
            text = f"nearest depth of the instance: {number(self.nearest)}"
            axis.axvline(self.nearest, color=colour, linewidth=2.0, label=text)
            axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.11), fontsize=8, frameon=False)
        axis.grid(axis="x", color="#dddddd")
        more = len(depths) - len(order)
        axis.set_title(
            "hidden if every texel is nearer than the line"
            + (f" (the {len(order)} farthest of {len(depths)})" if more else ""),
            size=9,
        )


def explained_of(told: Any, camera: Camera, depth: npt.NDArray[np.float32], unit: str) -> Explained:
    """What is shown of an `Explanation`: `told`, of a camera's depth image in NDC."""
    lines = str(told).splitlines()
    texels = [(k, x, y) for k, (x, y) in zip(told.texel_levels, told.texels, strict=True)]
    is_bare = RayView(camera).is_bare
    title = f"instance {told.index}: {told.verdict.name.lower()} ({told.reason})"
    if told.group is not None and told.group.rectangle is not None:
        title += "\nits group of 64 was hidden as a whole; .group.plot() draws that test"
    return Explained(
        lines=lines[1:],
        title=title,
        is_culled=told.verdict.name in ("OUTSIDE", "OCCLUDED"),
        rectangle=told.rectangle,
        camera=camera,
        depth=depth,
        texels=np.array(texels, np.intp).reshape(-1, 3),
        texel_depths=np.array(told.texel_depths, np.float32),
        decisive=told.decisive,
        nearest=told.nearest if is_bare else told.nearest_z,
        unit=unit,
    )


def _frame(
    image: _Image,
    box: tuple[int, int, int, int],
    origin: tuple[int, int],
    scale: float,
    colour: str,
    inwards: int = 0,
) -> None:
    """Draws the outline of a box of pixels within it, or so many pixels farther inwards."""
    x0, y0, x1, y1 = (scale * (one - origin[axis % 2]) for axis, one in enumerate(box))
    x0, y0 = x0 + inwards, y0 + inwards
    x1, y1 = max(x1 - 1.0 - inwards, x0), max(y1 - 1.0 - inwards, y0)
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]])
    draw(image, np.stack([corners[:-1], corners[1:]], axis=1), rgb(colour))
