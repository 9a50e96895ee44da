"""Draws docs/images/conventions.png, the picture of docs/conventions.md: `conventions_figure.py`.

Image axes, camera axes, view depth against distance, and standard against reversed Z.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt
import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TARGET = Path(__file__).resolve().parents[1] / "docs" / "images" / "conventions.png"
BLUE, ORANGE, GREY, INK = "#1f77b4", "#d9640d", "#9aa3ad", "#222222"


def arrow(ax: Axes, start: tuple[float, float], end: tuple[float, float], color: str) -> None:
    """An arrow between two points of the axes' data."""
    style = {"arrowstyle": "-|>", "color": color, "lw": 1.8, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", xy=end, xytext=start, arrowprops=style)


def image_axes(ax: Axes) -> None:
    """The pixel grid, with the axes of array indices and of NDC."""
    width, height = 6, 4
    for x in range(width + 1):
        ax.plot([x, x], [0, height], color=GREY, lw=0.8)
    for y in range(height + 1):
        ax.plot([0, width], [y, y], color=GREY, lw=0.8)
    ax.plot(0.5, 0.5, "o", color=ORANGE, ms=6)
    ax.annotate(
        "first centre (0.5, 0.5)", (0.5, 0.5), (1.1, 0.62), color=ORANGE, va="center", fontsize=9
    )
    arrow(ax, (0, -0.45), (width, -0.45), ORANGE)
    arrow(ax, (-0.45, 0), (-0.45, height), ORANGE)
    ax.text(width / 2, -0.75, "column, 0 to width", color=ORANGE, ha="center", fontsize=9)
    ax.text(-0.75, height / 2, "row, 0 on top", color=ORANGE, va="center", rotation=90, fontsize=9)
    middle = (width / 2, height / 2)
    arrow(ax, middle, (width, height / 2), BLUE)
    arrow(ax, middle, (width / 2, 0.95), BLUE)
    ax.text(width - 0.1, height / 2 + 0.35, "NDC x = 1", color=BLUE, ha="right", fontsize=9)
    ax.text(width / 2 + 0.12, 1.2, "NDC y, up", color=BLUE, fontsize=9)
    ax.text(0.1, height - 0.2, "NDC (-1, -1)", color=BLUE, fontsize=9)
    ax.set(xlim=(-1.2, width + 0.4), ylim=(height + 0.4, -1.2), aspect="equal")
    ax.set_title("image: row 0 on top; NDC: x right, y up")


def camera_axes(ax: Axes) -> None:
    """The two conventions of camera axes."""
    for left, name, y_end, y_name, z_name in (
        (0.0, "CV (OpenCV)", 1.1, "y down", "z forward"),
        (5.0, "GL (OpenGL)", -1.1, "y up", "z backward"),
    ):
        origin = (left + 0.6, 0.0)
        arrow(ax, origin, (left + 2.0, 0.0), INK)
        arrow(ax, origin, (left + 0.6, y_end), INK)
        ax.text(left + 2.05, 0.06, "x right", va="center", fontsize=9)
        ax.text(left + 0.6, y_end + np.sign(y_end) * 0.22, y_name, ha="center", fontsize=9)
        ax.add_patch(plt.Circle(origin, 0.17, fill=False, color=BLUE, lw=1.8))
        if z_name == "z forward":  # an arrow's feathers: away from the reader
            d = 0.12
            ax.plot([origin[0] - d, origin[0] + d], [-d, d], color=BLUE, lw=1.8)
            ax.plot([origin[0] - d, origin[0] + d], [d, -d], color=BLUE, lw=1.8)
        else:  # its tip: towards the reader
            ax.plot(*origin, "o", color=BLUE, ms=5)
        ax.text(origin[0] - 0.25, 0.0, z_name, color=BLUE, ha="right", va="center", fontsize=9)
        ax.text(left + 0.9, -1.85, name, ha="center", fontsize=10, weight="bold")
    note = "seen from behind the camera; cross: into the page, dot: out of it"
    ax.text(3.4, 1.75, note, ha="center", fontsize=8.5, color=INK)
    ax.set(xlim=(-1.2, 8.2), ylim=(2.0, -2.2), aspect="equal")
    ax.set_title("camera axes")


def depth_kinds(ax: Axes) -> None:
    """A point seen from the side: its depth along the axis and its distance along the ray."""
    near, far, z, up = 1.0, 8.0, 5.5, 2.1
    ax.plot([0, far], [0, 0], color=GREY, lw=0.8, ls=":")
    slope = 0.5
    for side in (-slope, slope):
        ax.plot([0, far], [0, side * far], color=GREY, lw=0.8)
    for plane, name in ((near, "near"), (far, "far")):
        ax.plot([plane, plane], [-slope * plane, slope * plane], color=GREY, lw=1.4)
        ax.text(plane, slope * plane + 0.2, name, ha="center", color=INK, fontsize=9)
    ax.plot([z, z], [1.35, 2.6], color=INK, lw=4, solid_capstyle="butt")
    ax.text(z + 0.15, 1.4, "surface", fontsize=9)
    arrow(ax, (0, 0), (z, up), ORANGE)
    ax.text(3.6, 0.62, '"distance"', color=ORANGE, rotation=21, ha="center", va="center")
    arrow(ax, (0, -0.25), (z, -0.25), BLUE)
    ax.text(3.3, -0.85, '"z": view depth', color=BLUE, ha="center", fontsize=10)
    ax.plot([z, z], [-0.25, 1.35], color=GREY, lw=0.8, ls=":")
    ax.plot(0, 0, "o", color=INK, ms=7)
    ax.text(-0.15, 0.0, "eye", ha="right", va="center", fontsize=9)
    ax.set(xlim=(-1.0, 8.6), ylim=(-4.2, 4.9), aspect="equal")
    ax.set_title("depth in world units, from the side")


def z_conventions(ax: Axes) -> None:
    """NDC depth by view depth, for both conventions."""
    near, far = 1.0, 8.0
    z = np.linspace(near, far, 200)
    standard = far * (z - near) / (z * (far - near))
    ax.plot(z, standard, color=BLUE, lw=2)
    ax.plot(z, 1.0 - standard, color=ORANGE, lw=2)
    ax.text(4.0, 0.78, '"ndc"\nreversed_z=False', color=BLUE, ha="left", va="top", fontsize=9)
    ax.text(4.0, 0.22, '"reversed_ndc"\nreversed_z=True', color=ORANGE, va="bottom", fontsize=9)
    ax.set_xticks([near, far], ["near", "far"])
    ax.set_yticks([0.0, 1.0])
    ax.set(xlabel="view depth", ylabel="NDC depth", xlim=(near, far), ylim=(0, 1))
    ax.set_title("NDC depth: standard and reversed Z")


def main() -> None:
    """Draws the four panels."""
    plt.rcParams.update({"font.family": "DejaVu Sans", "axes.titlesize": 11})
    figure, axes = plt.subplots(2, 2, figsize=(9.6, 7.2), dpi=100)
    panels = (image_axes, camera_axes, depth_kinds, z_conventions)
    for ax, draw in zip(axes.flat, panels, strict=True):
        draw(ax)
        if draw is not z_conventions:
            ax.axis("off")
    figure.tight_layout(h_pad=2.0, w_pad=2.0)
    figure.savefig(TARGET, metadata={"Software": None})
    print(TARGET)


if __name__ == "__main__":
    main()
