"""One texel, four and sixteen: which trees of the mountains each footprint keeps.

``python -m hizvk.bench.footprints`` prints the numbers, and leaves a picture.

Source: Daniel Rakos, *Hierarchical-Z map based occlusion culling*, 2010, whose figure compares one
texel with four.
Here every footprint is certified: none of them hides a tree that can be seen.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from ..bounds import Boxes
from ..commands import figure, page, pipes
from ..device import Device
from ..explanation import Verdict
from ..scenes import mountains
from ..scenes.truth import linear_depth, make_caster

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from .._arguments import Size

__all__ = ["FOOTPRINTS", "Kept", "main", "measure"]

PROG: Final = "python -m hizvk.bench.footprints"
#: Footprint and descent of each row.
FOOTPRINTS: Final = ((1, 0), (2, 0), (4, 0), (8, 0), (1, 4096), (2, 4096))
#: Those of the picture.
DRAWN: Final = FOOTPRINTS[:3]
#: Trees, views, and which of them is drawn.
TREES: Final = 20_000
VIEWS: Final = 16
VIEW: Final = 8
SIZE: Final = (360, 640)


@dataclass(frozen=True, eq=False)
class Kept:
    """What one footprint keeps in a view."""

    label: str
    inside: int
    """Trees that are not outside of the view."""
    visible: int
    """Trees that own a pixel."""
    kept: npt.NDArray[np.bool_]
    """``(N,)``."""
    lost: int
    """Visible trees that are not kept: 0."""
    texels: int
    """Texels that the tests have read, of trees and of groups."""


@dataclass(frozen=True, eq=False)
class Found:
    """A view, and what each footprint keeps in it."""

    rows: list[Kept]
    depth: npt.NDArray[np.float64]
    """``(height, width)``: view depth of the terrain; infinite for the sky."""
    places: npt.NDArray[np.float64]
    """``(N, 2)``: column and row of each tree's middle."""
    visible: npt.NDArray[np.bool_]
    """``(N,)``: owns a pixel."""


def measure(
    device: Device, *, trees: int = TREES, views: int = VIEWS, view: int = VIEW, size: Size = SIZE
) -> Found:
    """What each footprint keeps.

    Parameters
    ----------
    device : Device
        Where.
    trees, views : int
        Of the scene.
    view : int
        Which view is taken.
    size : (height, width)
        Of the image.
    """
    scene = mountains(trees, views)
    one = scene.views[view]
    camera = one.camera(size)
    instances = device.instances(Boxes(scene.box_min, scene.box_max))
    depth = device.render_depth(device.occluders(scene.vertices, scene.triangles), camera)
    pyramid = device.pyramid(depth)
    given = linear_depth(depth.numpy(), one.near, one.far)
    caster = make_caster(scene)
    sight = caster.look(one, size, given)
    visible = sight.pixels(len(scene)) > 0
    rows = []
    for footprint, descent in FOOTPRINTS:
        result = device.cull(
            instances, camera, pyramid, footprint=footprint, descent=descent, statistics=True
        )
        wrong = np.flatnonzero(visible & ~result.mask)
        rows.append(
            Kept(
                label=f"{footprint}x{footprint}" + (" and descent" if descent else ""),
                inside=int((result.verdicts != Verdict.OUTSIDE).sum()),
                visible=int(visible.sum()),
                kept=result.mask,
                lost=int(caster.firm(one, sight, given, wrong).sum()),
                texels=result.stats.texels_read or 0,
            )
        )
    middle = (scene.box_min + scene.box_max) / 2.0
    places = camera.project(middle).pixels
    return Found(rows, given, np.asarray(places, np.float64), visible)


def draw(path: Path, found: Found) -> None:
    """Writes the picture: the terrain, what is seen in white, and what is kept in vain in red."""
    drawn = found.rows[: len(DRAWN)]
    height, width = found.depth.shape
    sheet = figure.sheet(5.2 * len(drawn), 3.4)
    axes = sheet.subplots(1, len(drawn), squeeze=False)[0]
    near = np.where(np.isfinite(found.depth), found.depth, np.nan)
    for axis, row in zip(axes, drawn, strict=True):
        axis.imshow(np.log(near), cmap="Greys", interpolation="nearest", vmin=2.0, vmax=11.0)
        for mask, colour in ((row.kept & ~found.visible, "#d62728"), (found.visible, "#1f77b4")):
            axis.scatter(*found.places[mask].T, s=2.0, color=colour, linewidths=0)
        axis.set(xlim=(0, width), ylim=(height, 0), xticks=[], yticks=[])
        axis.set_title(f"{row.label}: {int(row.kept.sum()):,} trees kept", fontsize=10)
    title = f"Of {drawn[0].inside:,} trees in view {drawn[0].visible:,} are seen (blue)"
    figure.save(sheet, f"{title}; red ones are kept in vain", path)


def table(found: Found) -> list[str]:
    """The rows as lines of Markdown."""
    return page.table(
        "texels | kept | of those in view | visible lost | texels read",
        (_cells(row, int(row.kept.sum())) for row in found.rows),
    )


def _cells(row: Kept, kept: int) -> list[str]:
    share = f"{100.0 * kept / max(row.inside, 1):.1f} %"
    return [row.label, f"{kept:,}", share, f"{row.lost:,}", f"{row.texels:,}"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Prints the table; exit code 1: a tree was lost."""
    parser = argparse.ArgumentParser(
        prog=PROG, description="Trees of the mountains that footprints of 1, 4, 16 texels keep."
    )
    parser.add_argument("--out", type=Path, default=Path("out/footprints.png"), help="the picture")
    parser.add_argument("--trees", type=int, default=TREES)
    parser.add_argument("--view", type=int, default=VIEW, help=f"0 to {VIEWS - 1}")
    parsed = parser.parse_args(arguments)
    found = measure(Device(), trees=parsed.trees, view=parsed.view)
    first = found.rows[0]
    print(f"{first.inside:,} of {parsed.trees:,} trees in view, {first.visible:,} visible")
    print("\n".join(table(found)))
    if figure.can_draw():
        parsed.out.parent.mkdir(parents=True, exist_ok=True)
        draw(parsed.out, found)
        print(f"look at {parsed.out}")
    return 1 if any(row.lost for row in found.rows) else 0


if __name__ == "__main__":
    sys.exit(pipes.run(main))
