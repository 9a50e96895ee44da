"""Pictures of a cull: the view, its depth, the pyramid's levels, and the scene from above.

Needs matplotlib (the extra ``viz``).
Nothing here decides anything: the pictures show what `truth.Sight` and a cull's verdicts say.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ..commands import figure as figures
from ..explanation import Verdict
from ..scenes.massif import MAP_CORNER
from ..scenes.truth import OCCLUDER, linear_depth
from .shading import to_bytes

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

    from ..scenes import Scene, Terrain, View
    from ..scenes.grid import Floats
    from ..scenes.truth import Sight
    from .shading import Image

__all__ = [
    "colour_depth",
    "depth_span",
    "overview",
    "pyramid_sheet",
    "save",
    "top_picture",
    "with_culled",
]

#: The background of the overview and of what is written on it.
DARK: Final = "#14181c"
#: Maps are lit from the north-west; otherwise valleys look like ridges.
MAP_LIGHT: Final = np.array([-0.55, 0.55, 0.63]) / np.linalg.norm([-0.55, 0.55, 0.63])
CULLED: Final = (1.0, 0.16, 0.12)
OUTSIDE: Final = (0.52, 0.13, 0.11)
KEPT: Final = (1.0, 1.0, 1.0)


def save(path: Path, image: Image, *, colours: int | None = None) -> None:
    """Writes a ``(height, width, 3)`` picture as PNG.

    Parameters
    ----------
    path : Path
        The file.
    image : (height, width, 3) uint8 array
        The picture.
    colours : int, optional
        The size of a palette, for a smaller file; None: no palette.
    """
    from PIL import Image as pillow  # matplotlib brings it

    picture = pillow.fromarray(image)
    if colours is not None:
        picture = picture.quantize(
            colours, method=pillow.Quantize.MEDIANCUT, dither=pillow.Dither.NONE
        )
    picture.save(path, optimize=colours is not None)


def with_culled(
    picture: Image, scene: Scene, view: View, sight: Sight, verdicts: npt.NDArray[np.uint8]
) -> Image:
    """`picture` with the occluded instances shining through the ground as red triangles.

    All of them are in the view, because `Verdict.OCCLUDED` excludes what is outside.
    """
    height, width = picture.shape[:2]
    occluded = np.flatnonzero(verdicts == Verdict.OCCLUDED)
    foot = (scene.box_min[occluded] + scene.box_max[occluded]) / 2.0 - view.eye
    foot[:, 2] = scene.box_min[occluded, 2] - view.eye[2]
    x, y, z = (foot @ view.basis().T).T
    scale = height / (2.0 * np.tan(np.radians(view.fov_y_deg) / 2.0)) / z
    size = (scene.box_max - scene.box_min)[occluded] * scale[:, None]
    red = np.zeros((height, width))
    columns, bottoms = width / 2.0 + x * scale, height / 2.0 - y * scale
    for column, bottom, wide, tall in zip(columns, bottoms, size[:, 0], size[:, 2], strict=True):
        tall = max(tall, 3.0)
        for row in range(max(int(bottom - tall), 0), min(int(bottom), height)):
            half = max(0.5 * wide * (row + 1.0 - bottom + tall) / tall, 0.5)
            here = red[row, max(round(column - half), 0) : max(round(column + half), 0)]
            np.minimum(here + 0.45, 0.85, out=here)
    red[sight.owner != OCCLUDER] = 0.0
    image = picture / 255.0 * (1.0 - red[..., None]) + np.array(CULLED) * red[..., None]
    return to_bytes(image)


def colour_depth(depth: npt.NDArray[np.float32], near: float, span: tuple[float, float]) -> Image:
    """Linear depth in colours on a logarithmic scale: bright is near, dark is far, sky is white.

    Parameters
    ----------
    depth : (height, width) float32 array
        Reversed NDC with an infinite far plane.
    near : float
        The near plane's distance.
    span : (float, float)
        The distances of the two ends of the scale.
    """
    from matplotlib import colormaps

    linear = linear_depth(depth, near)
    low, high = np.log(span)
    with np.errstate(invalid="ignore"):
        place = np.clip((np.log(linear) - low) / (high - low), 0.0, 1.0)
    place[~np.isfinite(linear)] = 0.0
    colours = colormaps["magma_r"](0.05 + 0.9 * place)[..., :3]
    colours[~np.isfinite(linear)] = (0.93, 0.95, 0.97)
    return to_bytes(colours)


def depth_span(depth: npt.NDArray[np.float32], near: float) -> tuple[float, float]:
    """The distances between which most of a depth image lies."""
    linear = linear_depth(depth, near)
    seen = linear[np.isfinite(linear)]
    if not len(seen):
        return near, 2.0 * near
    low, high = np.quantile(seen, (0.005, 0.995))
    return float(low), float(max(high, 1.01 * low))


def pyramid_sheet(
    path: Path, levels: list[npt.NDArray[np.float32]], near: float, title: str
) -> None:
    """Writes all levels of a pyramid side by side in one size, with a scale in kilometres."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import LogLocator, NullLocator

    span = depth_span(levels[0], near)
    columns = 4
    rows = -(-len(levels) // columns)
    height, width = levels[0].shape
    tall = 13.0 / columns * height / width * rows * 0.86 + 0.25 * rows + 0.4
    figure = figures.sheet(13.0, tall, dpi=90)
    axes = figure.subplots(rows, columns, squeeze=False)
    for k, axis in enumerate(axes.flat):
        axis.set_axis_off()
        if k < len(levels):
            texels = levels[k]
            # A texel covers 2^k pixels, so the last column and row reach past the image.
            axis.imshow(
                colour_depth(texels, near, span),
                interpolation="nearest",
                extent=(0, texels.shape[1] << k, texels.shape[0] << k, 0),
            )
            axis.set_xlim(0, width)
            axis.set_ylim(height, 0)
            axis.set_title(f"level {k}: {texels.shape[1]}x{texels.shape[0]}", fontsize=9)
    scale = ScalarMappable(LogNorm(span[0] / 1000.0, span[1] / 1000.0), "magma_r")
    bar = figure.colorbar(
        scale, ax=axes, label="km to the farthest point of the texel (white: sky)", shrink=0.8
    )
    bar.ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    bar.ax.yaxis.set_major_formatter("{x:g}")
    bar.ax.yaxis.set_minor_locator(NullLocator())
    figures.save(figure, title, path)


def overview(
    path: Path,
    picture: Image,
    scene: Scene,
    view: View,
    verdicts: npt.NDArray[np.uint8],
    title: str,
    *,
    note: str = "",
    colours: int | None = None,
) -> None:
    """Writes the view and, at its side, the scene from above: culled red, kept white.

    Parameters
    ----------
    path : Path
        A PNG file.
    picture : (height, width, 3) uint8 array
        The view.
    scene, view, verdicts
        What was culled, from where, and how it came out.
    title, note : str
        The line above, and one in the view's corner.
    colours : int, optional
        As in `save`.
    """
    from matplotlib.figure import Figure

    height, width = picture.shape[:2]
    tall = 4.3
    wide = tall * width / height
    figure = Figure(figsize=(wide + tall + 0.12, tall + 0.42), dpi=100, facecolor=DARK)
    full_wide, full_tall = figure.get_size_inches()
    left = figure.add_axes((0.0, 0.0, wide / full_wide, tall / full_tall))
    left.imshow(picture, interpolation="lanczos", aspect="auto")
    left.set_axis_off()
    right = figure.add_axes((1.0 - tall / full_wide, 0.0, tall / full_wide, tall / full_tall))
    _top_view(right, scene, view, verdicts, picture.shape[1] / picture.shape[0])
    figure.text(0.008, 1.0 - 0.21 / full_tall, title, color="white", fontsize=11, va="center")
    if note:
        left.text(
            0.012,
            0.025,
            note,
            transform=left.transAxes,
            color="white",
            fontsize=9,
            bbox={"facecolor": DARK, "alpha": 0.75, "edgecolor": "none", "pad": 4.0},
        )
    save(path, _rendered(figure), colours=colours)


def top_picture(
    path: Path, scene: Scene, view: View, verdicts: npt.NDArray[np.uint8], aspect: float
) -> None:
    """Writes the scene from above alone: culled red, kept white."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 8.0), dpi=100)
    _top_view(figure.add_axes((0.0, 0.0, 1.0, 1.0)), scene, view, verdicts, aspect)
    save(path, _rendered(figure))


def _rendered(figure: Any) -> Image:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3])


def _top_view(
    axis: Any, scene: Scene, view: View, verdicts: npt.NDArray[np.uint8], aspect: float
) -> None:
    """Instances from above over a dark relief, in kilometres, with the view's angle."""
    middle = (scene.box_min + scene.box_max)[:, :2] / 2.0 - MAP_CORNER[:2]
    centre = (middle.min(axis=0) + middle.max(axis=0)) / 2.0
    reach = 1.06 * float(np.max(middle.max(axis=0) - centre))
    eye = np.subtract(view.eye, MAP_CORNER)[:2]
    reach = max(reach, 1.05 * float(np.abs(eye - centre).max()))
    low, high = (centre - reach) / 1000.0, (centre + reach) / 1000.0
    if scene.terrain is not None:
        axis.imshow(
            _relief(scene.terrain, low, high),
            extent=(low[0], high[0], low[1], high[1]),
            origin="lower",
        )
    east, north = (middle / 1000.0).T
    groups = (
        (verdicts == Verdict.OUTSIDE, OUTSIDE, 1.2, "culled, outside the view"),
        (verdicts == Verdict.OCCLUDED, CULLED, 2.2, "culled, in the view behind a ridge"),
        (verdicts >= Verdict.VISIBLE, KEPT, 2.2, "kept"),
    )
    for chosen, colour, area, label in groups:
        label = f"{int(chosen.sum()):,} {label}"
        axis.scatter(
            east[chosen],
            north[chosen],
            s=area,
            color=colour,
            linewidths=0,
            label=label,
            rasterized=True,
        )
    half = np.arctan(np.tan(np.radians(view.fov_y_deg) / 2.0) * aspect)
    heading = np.arctan2(view.target[1] - view.eye[1], view.target[0] - view.eye[0])
    for angle in (heading - half, heading + half):
        tip = eye / 1000.0 + 40.0 * np.array([np.cos(angle), np.sin(angle)])
        axis.plot(
            [eye[0] / 1000.0, tip[0]], [eye[1] / 1000.0, tip[1]], color="#ffd84a", linewidth=1.1
        )
    axis.plot(eye[0] / 1000.0, eye[1] / 1000.0, "o", color="#ffd84a", markersize=6)
    axis.set_xlim(low[0], high[0])
    axis.set_ylim(low[1], high[1])
    axis.set_axis_off()
    legend = axis.legend(
        loc="lower left", fontsize=8.5, markerscale=3.5, labelcolor="white", handletextpad=0.2
    )
    legend.get_frame().set(facecolor=DARK, alpha=0.85, edgecolor="none")


def _relief(terrain: Terrain, low: Floats, high: Floats) -> Floats:
    """A dark hill shading of the square between two corners, given in kilometres."""
    spot = (np.arange(700) + 0.5) / 700.0
    x, y = np.meshgrid(
        *(1000.0 * (low[k] + spot * (high[k] - low[k])) + MAP_CORNER[k] for k in range(2))
    )
    light = np.clip(terrain.normal_at(x, y) @ MAP_LIGHT, 0.0, 1.0)
    tall = (terrain.height_at(x, y) - 250.0) / 800.0
    grey = 0.10 + 0.42 * light**1.6 * (0.55 + 0.6 * tall)
    relief: Floats = np.clip(grey[..., None] * np.array([0.86, 0.96, 1.0]), 0.0, 1.0)
    return relief
