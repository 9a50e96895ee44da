"""Pictures of a cull: the view, the depth, the pyramid's levels with linear depth, and who was culled, from above.

Needs matplotlib (the extra ``viz``).
Nothing here decides anything: it draws what `truth.Sight` and a cull's verdicts say.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from .explanation import Verdict
from .scenes import MAP_CORNER
from .truth import OCCLUDER, SKY, RayCaster, linear_depth

if TYPE_CHECKING:
    from pathlib import Path

    from ._arguments import Size
    from .scenes import Floats, Scene, Terrain, View
    from .truth import Caster, Sight

__all__ = [
    "colour_depth",
    "depth_span",
    "overview",
    "pyramid_sheet",
    "save",
    "top_picture",
    "view_picture",
    "with_culled",
]

Image: TypeAlias = npt.NDArray[np.uint8]

SUN: Final = np.array([0.55, -0.48, 0.62]) / np.linalg.norm([0.55, -0.48, 0.62])
#: Maps are lit from the north-west, or valleys look like ridges.
MAP_LIGHT: Final = np.array([-0.55, 0.55, 0.63]) / np.linalg.norm([-0.55, 0.55, 0.63])
SUNLIGHT: Final = np.array([1.22, 1.06, 0.82])
SKYLIGHT: Final = np.array([0.40, 0.48, 0.60])
HAZE: Final = np.array([0.70, 0.79, 0.88])
ZENITH: Final = np.array([0.27, 0.47, 0.74])
#: The distance in metres after which 1/e of a colour is left.
HAZE_LENGTH: Final = 13_000.0
CULLED: Final = (1.0, 0.16, 0.12)
OUTSIDE: Final = (0.52, 0.13, 0.11)
KEPT: Final = (1.0, 1.0, 1.0)


def save(path: Path, image: Image, *, colours: int | None = None) -> None:
    """Writes a ``(height, width, 3)`` picture as PNG; with `colours`, as a palette of so many (a smaller file)."""
    from PIL import Image as pillow  # matplotlib brings it

    picture = pillow.fromarray(image)
    if colours is not None:
        picture = picture.quantize(
            colours, method=pillow.Quantize.MEDIANCUT, dither=pillow.Dither.NONE
        )
    picture.save(path, optimize=colours is not None)


def view_picture(
    scene: Scene, view: View, sight: Sight, caster: Caster, *, samples: int = 1
) -> Image:
    """The scene in sunlight, as the rays saw it; ``(height, width, 3)``.

    Parameters
    ----------
    scene, view, sight
        What is seen from where.
    caster
        Who saw it.
        A `RayCaster` also tells what lies in the shade, and may be asked again:
    samples : int
        Points a side of each pixel that are averaged, for smooth edges.
    """
    size: Size = sight.owner.shape
    if samples == 1 or not isinstance(caster, RayCaster):
        return _to_bytes(_colours(scene, view, sight, caster, view.rays(size)))
    total = np.zeros((*size, 3))
    for k in range(samples**2):
        shift = ((k % samples + 0.5) / samples - 0.5, (k // samples + 0.5) / samples - 0.5)
        closer = caster.look_shifted(view, size, shift)
        total += _colours(scene, view, closer, caster, view.rays(size, shift))
    return _to_bytes(total / samples**2)


def with_culled(
    picture: Image, scene: Scene, view: View, sight: Sight, verdicts: npt.NDArray[np.uint8]
) -> Image:
    """`picture` with the occluded instances shining through the ground as red triangles.

    Those are in the view: what is outside is not occluded (`Verdict`).
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
    return _to_bytes(image)


def colour_depth(depth: npt.NDArray[np.float32], near: float, span: tuple[float, float]) -> Image:
    """Linear depth in colours: bright is near, dark is far on a logarithmic scale, and what shows nothing is white.

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
    return _to_bytes(colours)


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
    """Writes a contact sheet of all levels of a pyramid, each as large as the first, with a scale in kilometres."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, NullLocator

    span = depth_span(levels[0], near)
    columns = 4
    rows = -(-len(levels) // columns)
    height, width = levels[0].shape
    figure = Figure(
        figsize=(13.0, 13.0 / columns * height / width * rows * 0.86 + 0.25 * rows + 0.4),
        layout="constrained",
        dpi=90,
    )
    axes = figure.subplots(rows, columns, squeeze=False)
    for k, axis in enumerate(axes.flat):
        axis.set_axis_off()
        if k < len(levels):
            texels = levels[k]
            # A texel covers 2^k pixels, so the last column and row reach past the image.
            axis.imshow(
                colour_depth(texels, near, span), interpolation="nearest",
                extent=(0, texels.shape[1] << k, texels.shape[0] << k, 0),
            )  # fmt: skip
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
    figure.suptitle(title, fontsize=11)
    figure.savefig(path)


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
    figure = Figure(figsize=(wide + tall + 0.12, tall + 0.42), dpi=100, facecolor="#14181c")
    full_wide, full_tall = figure.get_size_inches()
    left = figure.add_axes((0.0, 0.0, wide / full_wide, tall / full_tall))
    left.imshow(picture, interpolation="lanczos", aspect="auto")
    left.set_axis_off()
    right = figure.add_axes((1.0 - tall / full_wide, 0.0, tall / full_wide, tall / full_tall))
    _top_view(right, scene, view, verdicts, picture.shape[1] / picture.shape[0])
    figure.text(0.008, 1.0 - 0.21 / full_tall, title, color="white", fontsize=11, va="center")
    if note:
        left.text(
            0.012, 0.025, note, transform=left.transAxes, color="white", fontsize=9,
            bbox={"facecolor": "#14181c", "alpha": 0.75, "edgecolor": "none", "pad": 4.0},
        )  # fmt: skip
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
    """Instances from above in kilometres east and north, with the view's angle, over a dark relief."""
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
    legend.get_frame().set(facecolor="#14181c", alpha=0.85, edgecolor="none")


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


def _colours(scene: Scene, view: View, sight: Sight, caster: Caster, rays: Floats) -> Floats:
    """Light of each pixel, not yet clipped."""
    owner = sight.owner
    seen = owner != SKY
    up = rays[..., 2] / np.linalg.norm(rays, axis=-1)
    image: Floats = HAZE + (ZENITH - HAZE) * (np.clip(up, 0.0, 0.55) / 0.55)[..., None] ** 0.7
    depth = sight.depth[seen]
    points = rays[seen] * depth[:, None] + view.eye
    normal = sight.normal[seen].astype(np.float64)
    is_ground = owner[seen] == OCCLUDER
    albedo = _leaves(owner[seen])
    if scene.terrain is not None:
        albedo[is_ground], normal[is_ground] = _ground(
            scene.terrain, points[is_ground], depth[is_ground]
        )
    sun = np.clip(normal @ SUN, 0.0, 1.0)
    if isinstance(caster, RayCaster):
        sun *= caster.in_light(points + normal * (0.05 + 2e-4 * depth)[:, None], SUN)
    light = sun[:, None] * SUNLIGHT + (0.55 + 0.45 * normal[:, 2:]) * SKYLIGHT
    clear = np.exp(-depth / HAZE_LENGTH)[:, None]
    image[seen] = albedo * light * clear + HAZE * (1.0 - clear)
    return image


def _leaves(owner: npt.NDArray[np.int32]) -> Floats:
    """A green of its own for each instance."""
    vary = (owner.astype(np.uint32) * np.uint32(2654435761) >> np.uint32(8)).astype(
        np.float64
    ) / 2.0**24
    green: Floats = np.array([0.13, 0.25, 0.12]) + vary[:, None] * np.array([0.15, 0.14, 0.04])
    return green


def _ground(terrain: Terrain, points: Floats, distance: Floats) -> tuple[Floats, Floats]:
    """Colour and normal of the ground: meadows below, brown heights, bare slopes, all in patches."""
    x, y, z = points.T
    normal = terrain.normal_at(x, y)
    patch, fine = np.zeros(len(x)), np.zeros(len(x))
    for length, heading in (
        (1900.0, 0.4),
        (1130.0, 1.9),
        (690.0, 2.7),
        (410.0, 0.9),
        (233.0, 2.2),
        (129.0, 1.4),
    ):
        patch += (
            np.cos((x * np.cos(heading) + y * np.sin(heading)) * 2.0 * np.pi / length + 3.0 * patch)
            / 6.0
        )
    for length, heading in ((83.0, 0.2), (47.0, 1.7), (29.0, 2.9), (17.0, 1.1)):
        fade = np.exp(-distance * 1.2 / (30.0 * length))  # before it is finer than the pixels
        fine += fade * np.cos(
            (x * np.cos(heading) + y * np.sin(heading)) * 2.0 * np.pi / length
            + 4.0 * patch
            + 2.0 * fine
        )
    high = np.clip((z - 470.0) / 480.0 + 0.45 * patch, 0.0, 1.0)[:, None]
    steep = np.clip((0.95 - normal[:, 2]) * 5.0 + 0.5 * patch, 0.0, 1.0)[:, None]
    colour = (1.0 - high) * np.array([0.33, 0.44, 0.19]) + high * np.array([0.53, 0.47, 0.27])
    colour = (1.0 - 0.6 * steep) * colour + 0.6 * steep * np.array([0.36, 0.34, 0.22])
    return colour * (1.0 + 0.16 * patch + 0.035 * fine)[:, None], normal


def _to_bytes(image: Floats) -> Image:
    return (np.clip(image, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
