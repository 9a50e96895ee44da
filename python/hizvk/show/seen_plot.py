"""A cull's result as a figure: the view, and the scene from above."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from ..view_depth import RayView
from .colours import BACKGROUND, CLASS_COLOURS, FRUSTUM, INK, grey, thinned
from .lines import outlines
from .shapes import HIDDEN, KEPT, OUTSIDE, box_edges

if TYPE_CHECKING:
    import numpy.typing as npt

    from ..camera import Camera
    from .seen import Seen
    from .shapes import Shapes

    _Doubles = npt.NDArray[np.float64]

__all__ = ["UPS", "Above", "draw_view", "plot", "up_of"]

#: Which way is up: a world axis, with a minus where the axis points down.
UPS: Final = ("x", "y", "z", "-x", "-y", "-z")
#: More instances than this are dots from above.
MOST_OUTLINES: Final = 3000
#: The share of the instances at each end of an axis that the map does not wait for.
TAIL: Final = 0.005
#: How much farther than the farthest instance the drawn part of the view volume reaches.
PAST: Final = 1.05


class Above(NamedTuple):
    """How a map looks from above: which world axes go right and up, in which direction."""

    right: int
    top: int
    top_grows_down: bool

    @classmethod
    def of(cls, up: str) -> Above:
        """For one of `UPS`; right-handed worlds are not mirrored."""
        axis = "xyz".index(up[-1])
        right, top = {0: (1, 2), 1: (0, 2), 2: (0, 1)}[axis]
        # Seen against the axis: x cross y is z, and x cross z is -y.
        return cls(right, top, (axis == 1) != up.startswith("-"))


def up_of(camera: Camera) -> str:
    """The world axis that is up: nearest to the camera's `up=`, or to the top of its image."""
    name, arguments = camera._recipe
    if name == "resized":
        return up_of(dict(arguments)["camera"])
    given = dict(arguments).get("up")
    up = RayView(camera).up if given is None else np.asarray(given, float)
    axis = int(np.argmax(np.abs(up)))
    return ("-" if up[axis] < 0.0 else "") + "xyz"[axis]


def plot(seen: Seen, up: str, most: int) -> Any:
    """The figure.

    Parameters
    ----------
    seen : Seen
        With known bounds and classes.
    up : str
        One of `UPS`.
    most : int
        The most instances that are drawn.
    """
    from .figure import figure

    shapes = seen.shapes(most)
    height, width = seen.camera.size
    tall = 5.2
    wide = float(np.clip(tall * width / height, 3.0, 11.0))
    sheet = figure(wide + tall + 1.2, tall + 1.5)
    sheet.set_facecolor("white")
    left, right = sheet.subplots(1, 2, width_ratios=(wide, tall))
    draw_view(left, seen, shapes)
    _map(right, seen, shapes, Above.of(up))
    _legend(sheet, seen, shapes)
    sheet.suptitle(seen.title, size=11)
    return sheet


def draw_view(axis: Any, seen: Seen, shapes: Shapes) -> None:
    """Draws the depth image, and over it the outlines."""
    height, width = seen.camera.size
    axis.imshow(grey(thinned(seen.depth)), extent=(0, width, height, 0), interpolation="nearest")
    lines, owners = outlines(RayView(seen.camera), shapes)
    for one in (OUTSIDE, HIDDEN, KEPT):
        _draw(axis, lines[shapes.classes[owners] == one], one, width=1.0)
    axis.set_xlim(0, width)
    axis.set_ylim(height, 0)
    axis.set_title("the view: outlines over the depth image", size=9)
    axis.set_xlabel("column (pixels)", size=9)
    axis.set_ylabel("row (pixels)", size=9)
    axis.tick_params(labelsize=8)


def _map(axis: Any, seen: Seen, shapes: Shapes, above: Above) -> None:
    axis.set_facecolor(BACKGROUND)
    view = RayView(seen.camera)
    plane = [above.right, above.top]
    centers = shapes.centers[:, plane]
    as_dots = len(centers) > MOST_OUTLINES or not shapes.radii.any()
    for one in (OUTSIDE, HIDDEN, KEPT):
        mine = shapes.classes == one
        if as_dots:
            colour = CLASS_COLOURS[one]
            axis.scatter(*centers[mine].T, s=3.0, color=colour, linewidths=0, zorder=2 + one % 2)
        elif shapes.axes is not None:
            starts, ends, owners = box_edges(shapes)
            chosen = mine[owners]
            _draw(axis, np.stack([starts[chosen][:, plane], ends[chosen][:, plane]], 1), one, 0.8)
        else:
            turn = np.linspace(0.0, 2.0 * np.pi, 25)
            ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
            rims = centers[mine][:, None] + shapes.radii[mine][:, None, None] * ring
            _draw(axis, np.stack([rims[:, :-1], rims[:, 1:]], axis=2).reshape(-1, 2, 2), one, 0.8)
    eye = view.eye if view.eye is not None else view.corners(1.0)[:4].mean(axis=0)
    depths = (shapes.centers - eye) @ view.forward
    in_view = depths[(shapes.classes != OUTSIDE) & (depths > 0.0)]
    corners = view.corners(PAST * float(in_view.max() if len(in_view) else 1.0))[:, plane]
    for start, end in [*((i, i + 4) for i in range(4)), (4, 5), (5, 6), (6, 7), (7, 4)]:
        axis.plot(*corners[[start, end]].T, color=FRUSTUM, linewidth=1.0, zorder=4)
    axis.plot(*eye[plane], "o", color=FRUSTUM, markersize=6, zorder=5)
    # A few stray instances do not squeeze the map.
    around = np.concatenate([_most_of(centers), eye[plane][None]])
    low, high = around.min(axis=0), around.max(axis=0)
    middle, half = 0.5 * (low + high), 0.56 * max(float((high - low).max()), 1e-6)
    axis.set_xlim(middle[0] - half, middle[0] + half)
    axis.set_ylim(middle[1] - half, middle[1] + half)
    if above.top_grows_down:
        axis.invert_yaxis()
    axis.set_aspect("equal")
    axis.set_title("from above, with the view volume", size=9)
    axis.set_xlabel(f"{'xyz'[above.right]} ({seen.unit})", size=9)
    axis.set_ylabel(f"{'xyz'[above.top]} ({seen.unit})", size=9)
    axis.tick_params(labelsize=8)
    axis.grid(color="#39424c", linewidth=0.5)
    axis.set_axisbelow(True)


def _most_of(centers: _Doubles) -> _Doubles:
    """``(2, 2)``: the corners of a rectangle around all but the outermost centres."""
    if len(centers) == 0:
        return np.zeros((0, 2))
    ends: _Doubles = np.quantile(centers, (TAIL, 1.0 - TAIL), axis=0)
    return ends


def _draw(axis: Any, lines: _Doubles, one: int, width: float) -> None:
    """Draws lines of one class; lines of length 0 are dots."""
    from matplotlib.collections import LineCollection

    order = 2 + (HIDDEN, KEPT).index(one) if one != OUTSIDE else 1
    dots = (lines[:, 0] == lines[:, 1]).all(axis=1)
    axis.add_collection(
        LineCollection(
            list(lines[~dots]), colors=CLASS_COLOURS[one], linewidths=width, zorder=order
        ),
        autolim=False,
    )
    axis.scatter(*lines[dots, 0].T, s=3.0, color=CLASS_COLOURS[one], linewidths=0, zorder=order)


def _legend(sheet: Any, seen: Seen, shapes: Shapes) -> None:
    from matplotlib.lines import Line2D

    handles = []
    for one in (KEPT, HIDDEN, OUTSIDE):
        if not seen.names[one]:
            continue
        count, drawn = seen.counts()[one], int(np.count_nonzero(shapes.classes == one))
        some = f" ({drawn:,} drawn)" if drawn < count else ""
        label = f"{seen.names[one]}: {count:,}{some}"
        handles.append(Line2D([], [], color=CLASS_COLOURS[one], linewidth=2.5, label=label))
    handles.append(Line2D([], [], color=FRUSTUM, linewidth=2.5, label="eye and view volume"))
    legend = sheet.legend(
        handles=handles, loc="outside lower center", ncols=len(handles), fontsize=9,
        labelcolor=INK, frameon=True,
    )  # fmt: skip
    legend.get_frame().set(facecolor=BACKGROUND, alpha=1.0, edgecolor="none")
