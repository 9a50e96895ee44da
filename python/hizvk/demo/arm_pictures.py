"""Pictures of ARM's scene: bounds of what is culled in red, of what is kept in white.

Needs matplotlib (the extra ``viz``).
Nothing here decides anything.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ..explanation import Verdict
from ..scenes.scene import box_corners
from ..scenes.truth import SKY
from .pictures import CULLED, DARK, KEPT, OUTSIDE, save
from .shading import to_bytes

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

    from ..scenes.arm import ArmScene, BallSight
    from ..scenes.grid import Floats
    from ..scenes.scene import View
    from .shading import Image

__all__ = ["overview", "with_boxes"]

#: The twelve edges of a box, as the corners of `box_corners`.
EDGES: Final = tuple((a, a | bit) for a in range(8) for bit in (1, 2, 4) if not a & bit)
#: Where the light comes from.
LIGHT: Final = np.array([0.45, 0.8, 0.4]) / np.linalg.norm([0.45, 0.8, 0.4])
SKY_COLOUR: Final = (0.80, 0.87, 0.94)
PRISM: Final = (0.62, 0.58, 0.52)
#: Colours of near and far spheres: bluer with distance.
NEAR_BALL: Final = (0.90, 0.72, 0.30)
FAR_BALL: Final = (0.25, 0.42, 0.85)


def _picture(sight: BallSight) -> Image:
    """The view as the rays saw it."""
    shade = np.clip(sight.normal @ LIGHT, 0.0, 1.0) * 0.7 + 0.3
    image: Floats = np.empty((*sight.owner.shape, 3))
    image[...] = SKY_COLOUR
    prism = np.isfinite(sight.depth) & (sight.owner == SKY)
    image[prism] = np.array(PRISM) * shade[prism][:, None]
    ball = sight.owner != SKY
    share = np.clip(sight.depth[ball] / 16.0, 0.0, 1.0)[:, None]
    tint = (1.0 - share) * np.array(NEAR_BALL) + share * np.array(FAR_BALL)
    image[ball] = tint * shade[ball][:, None]
    return to_bytes(image)


def with_boxes(
    picture: Image, scene: ArmScene, view: View, verdicts: npt.NDArray[np.uint8]
) -> Image:
    """`picture` with the bounds of the spheres in the view as lines that shine through all else.

    Red ones are culled behind the prisms, white ones are kept.
    """
    from PIL import Image as pillow
    from PIL import ImageDraw

    height, width = picture.shape[:2]
    image = picture / 255.0
    scale = height / (2.0 * np.tan(np.radians(view.fov_y_deg) / 2.0))
    for chosen, colour, strength in (
        (verdicts == Verdict.OCCLUDED, CULLED, 0.6),
        (verdicts >= Verdict.VISIBLE, KEPT, 0.4),
    ):
        layer = pillow.new("L", (width, height))
        draw = ImageDraw.Draw(layer)
        reach = scene.radii[chosen, None].astype(np.float64)
        middle = scene.centers[chosen].astype(np.float64) - view.eye
        corners = box_corners(middle - reach, middle + reach) @ view.basis().T
        corners = corners[corners[..., 2].min(axis=1) > view.near]
        across = width / 2.0 + corners[..., 0] / corners[..., 2] * scale
        down = height / 2.0 - corners[..., 1] / corners[..., 2] * scale
        for x, y in zip(across.tolist(), down.tolist(), strict=True):
            for a, b in EDGES:
                draw.line((x[a], y[a], x[b], y[b]), fill=255)
        line = np.asarray(layer)[..., None] / 255.0 * strength
        image = image * (1.0 - line) + np.array(colour) * line
    return to_bytes(image)


def overview(
    path: Path,
    scene: ArmScene,
    view: View,
    sight: BallSight,
    verdicts: npt.NDArray[np.uint8],
    title: str,
) -> None:
    """Writes the view with its boxes and, at its side, the scene from above."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    picture = with_boxes(_picture(sight), scene, view, verdicts)
    height, width = picture.shape[:2]
    tall = 5.0
    wide = tall * width / height
    figure = Figure(figsize=(wide + tall + 0.1, tall + 0.4), dpi=100, facecolor=DARK)
    full_wide, full_tall = figure.get_size_inches()
    left = figure.add_axes((0.0, 0.0, wide / full_wide, tall / full_tall))
    left.imshow(picture, interpolation="lanczos", aspect="auto")
    left.set_axis_off()
    right = figure.add_axes((1.0 - tall / full_wide, 0.0, tall / full_wide, tall / full_tall))
    _from_above(right, scene, view, verdicts, width / height)
    figure.text(0.008, 1.0 - 0.2 / full_tall, title, color="white", fontsize=11, va="center")
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    save(path, np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3]), colours=128)


def _from_above(
    axis: Any, scene: ArmScene, view: View, verdicts: npt.NDArray[np.uint8], aspect: float
) -> None:
    """Prisms as squares and spheres as points, with the view's angle; -z is up."""
    from matplotlib.patches import Rectangle

    for low, high in zip(scene.prism_min, scene.prism_max, strict=True):
        corner, side = (low[0], -high[2]), high[0] - low[0]
        axis.add_patch(Rectangle(corner, side, side, color="#5b564e", linewidth=0))
    x, up = scene.centers[:, 0], -scene.centers[:, 2]
    for chosen, colour, label in (
        (verdicts == Verdict.OUTSIDE, OUTSIDE, "culled, outside the view"),
        (verdicts == Verdict.OCCLUDED, CULLED, "culled, in the view behind prisms"),
        (verdicts >= Verdict.VISIBLE, KEPT, "kept"),
    ):
        label = f"{int(chosen.sum()):,} {label}"
        axis.scatter(x[chosen], up[chosen], s=2.0, color=colour, linewidths=0, label=label)
    half = np.arctan(np.tan(np.radians(view.fov_y_deg) / 2.0) * aspect)
    heading = np.arctan2(view.eye[2] - view.target[2], view.target[0] - view.eye[0])
    for angle in (heading - half, heading + half):
        tip = 40.0 * np.array([np.cos(angle), np.sin(angle)])
        axis.plot([0.0, tip[0]], [0.0, tip[1]], color="#ffd84a", linewidth=1.1)
    axis.plot(0.0, 0.0, "o", color="#ffd84a", markersize=6)
    axis.set_xlim(-20.0, 20.0)
    axis.set_ylim(-20.0, 20.0)
    axis.set_axis_off()
    legend = axis.legend(
        loc="lower left", fontsize=8.5, markerscale=3.5, labelcolor="white", handletextpad=0.2
    )
    legend.get_frame().set(facecolor=DARK, alpha=0.85, edgecolor="none")
