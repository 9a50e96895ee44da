"""Pictures of `hizvk bench --maps`: the curve, the maps, and the depth-estimation buffer.

Needs matplotlib (the extra ``viz``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from ..commands import figure as figures
from ..scenes.truth import linear_depth
from .maps_results import NEGLIGIBLE, SIDE

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    import numpy.typing as npt

    from ..device import Device
    from ..resources import Occluders
    from ..scenes import View
    from .maps_results import Found, Row

__all__ = ["curve", "maps"]

COLOURS: Final = ("#2a78b8", "#d9822b", "#3a9150", "#8a4fae", "#b5403c", "#666666")


def curve(folder: Path, scenes: Sequence[Found]) -> str:
    """Four curves over the pixels of a negligible hole, a line for each scene; the file's name."""
    sheet = figures.sheet(10.0, 7.2)
    axes = sheet.subplots(2, 2, sharex=True).ravel()
    panels: tuple[tuple[str, Callable[[Row], float]], ...] = (
        ("hidden instances kept, %", lambda row: 100.0 * row.share_kept),
        ("visible instances lost", lambda row: row.lost),
        (f"pixels lost of {SIDE}x{SIDE}, all views", lambda row: row.pixels),
        ("ms to cull a view", lambda row: row.ms_cull),
    )
    for axis, (title, value) in zip(axes, panels, strict=True):
        for scene, colour in zip(scenes, COLOURS, strict=False):
            rows = [row for row in scene.rows if row.negligible_px is not None]
            certified = [row for row in scene.rows if row.negligible_px is None]
            axis.plot([value(row) for row in rows], "o-", color=colour, label=scene.key, ms=4)
            axis.axhline(value(certified[-1]), color=colour, linestyle=":", linewidth=1.0)
        axis.set_title(title, fontsize=9)
        axis.set_xticks(range(len(NEGLIGIBLE)), [str(hole) for hole in NEGLIGIBLE])
        axis.grid(True, color="#eeeeee", zorder=-1)
    for axis in axes[2:]:
        axis.set_xlabel("pixels of a hole that is negligible")
    axes[3].set_yscale("log")
    axes[3].yaxis.set_major_formatter("{x:g}")
    axes[3].yaxis.set_minor_formatter(lambda x, _: f"{x:g}" if f"{x:e}"[0] in "235" else "")
    axes[0].legend(title="dotted: certified, with descent", fontsize=8, title_fontsize=8)
    figures.save(sheet, "hierarchical occlusion maps; lower is better", folder / "curve.png")
    return "curve.png"


def maps(
    folder: Path, key: str, device: Device, walls: Occluders, view: View, limit: int | None
) -> str:
    """The maps of a view from 256x256 to the least size, and the estimation buffer.

    `KEY-maps.png`, whose name is returned, shows all of them.
    The farthest depth of the pyramid stands there beside the buffer.
    `KEY-map-SIDE.png` and `KEY-estimate.png` have one pixel for each of the map or the buffer.
    """
    from matplotlib.image import imsave

    camera = view.camera((SIDE, SIDE))
    made = device.occlusion_map(walls, camera, size=(SIDE, SIDE), max_occluders=limit)
    opacities = [made.opacity(level) for level in range(made.num_levels)]
    pyramid = device.pyramid(device.render_depth(walls, camera))
    level = int(np.log2(SIDE // len(made.estimate)))
    true = linear_depth(pyramid.level(level), view.near, view.far)
    estimate = made.estimate
    both = np.concatenate([estimate[np.isfinite(estimate)], true[np.isfinite(true)]])
    range_ = (float(both.min(initial=np.inf)), float(both.max(initial=view.near)))
    for opacity in opacities:
        file = folder / f"{key}-map-{len(opacity)}.png"
        imsave(file, opacity, cmap="gray", vmin=0.0, vmax=1.0)
    near = _nearness(estimate, range_)
    imsave(folder / f"{key}-estimate.png", near, cmap="gray", vmin=0.0, vmax=1.0)
    sheet = figures.sheet(12.8, 6.6)
    axes = sheet.subplots(2, (len(opacities) + 3) // 2).ravel()
    shown = [(f"{len(each)}x{len(each)}", each) for each in opacities]
    shown.append(("depth-estimation buffer", near))
    shown.append(("farthest depth of the pyramid", _nearness(true, range_)))
    for axis in axes:
        axis.axis("off")
    for axis, (title, image) in zip(axes, shown, strict=False):
        axis.imshow(image, cmap="gray", vmin=0.0, vmax=1.0, interpolation="nearest")
        axis.set_title(title, fontsize=9)
    name = f"{key}-maps.png"
    figures.save(sheet, f"{key}: occlusion maps; depths are white where near", folder / name)
    return name


def _nearness(
    depth: npt.NDArray[np.float64], range_: tuple[float, float]
) -> npt.NDArray[np.float64]:
    """1 at the least depth of a range, 0.2 at the greatest, and 0 where nothing is."""
    least, most = range_
    share = np.clip((depth - least) / max(most - least, 1e-9), 0.0, 1.0)
    return np.where(np.isfinite(depth), 1.0 - 0.8 * share, 0.0)
