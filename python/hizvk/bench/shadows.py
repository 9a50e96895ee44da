"""``hizvk bench --shadows``: how many shadow casters are kept in three views, by four ways.

It prints the table of ``docs/shadows.md``.
report.json holds ``{command, seed, adapter, versions, seconds, missing, descent, rows}``.

- *Needed*: casters with a visible point in their shadow, by a shadow ray from every pixel.
- *Frustum*: casters whose swept volume reaches into the view frustum.
- *Behind*: of these, the ones that the farthest depth of their rectangle does not hide.
- *Ours*: what `Device.cull` keeps with a `DirectionalLight`.

The second and the third are in float64, with each pixel's own depth and no margins.
So they are the best that such a cull can do.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

import hizvk

from ..commands import arguments as args
from ..commands import report
from ..commands.page import Page
from ..scenes.scene import box_mesh
from ..scenes.sunlit import sunlit
from . import frame

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import numpy.typing as npt

    from .._arguments import Size
    from ..progress import Progress
    from ..scenes.sunlit import Sunlit, SunView

    _Floats = npt.NDArray[np.float64]
    _Mask = npt.NDArray[np.bool_]

__all__ = ["Report", "Row", "main", "measure", "run"]

PROG: Final = "hizvk bench --shadows"
HEAD: Final = "view | casters | needed | frustum alone | behind alone | ours | lost | ms"
#: Of the town.
SEED: Final = 5
#: Small casters beside the houses.
SMALL: Final = 4000
#: Pixels of a view.
SIZE: Final = (90, 160)
NEAR: Final = 0.1
#: How much nearer or farther a shadow must be than a depth of float32, to count as such.
APART: Final = 1e-3
#: By how much a caster grows for the shadow rays, in metres.
TOUCHING: Final = 1e-4
#: Casters that are tested at a time, against all pixels.
AT_ONCE: Final = 64


@dataclass(frozen=True)
class Row:
    """The casters kept in one view."""

    view: str
    casters: int
    needed: int
    frustum: int
    behind: int
    ours: int
    lost: int
    """Needed, but not kept by ours: 0."""
    cull_ms: float


def measure(size: Size = SIZE, *, small: int = SMALL, descent: int = 0) -> list[Row]:
    """The numbers of each view of the town.

    Parameters
    ----------
    size : (height, width)
        Of the views.
    small : int
        How many small casters there are beside 1,600 houses.
    descent : int
        An option of the cull.
    """
    device, town = hizvk.Device(), sunlit(small=small)
    low, high = town.ground
    vertices, triangles = box_mesh(town.low, town.high)
    ground = np.array([low, [low[0], 0.0, high[2]], [high[0], 0.0, low[2]], high])
    occluders = device.occluders(
        [hizvk.Mesh(vertices, triangles), hizvk.Mesh(ground, np.array([[0, 1, 2], [1, 3, 2]]))]
    )
    casters = device.instances(hizvk.Boxes(town.low, town.high))
    return [_view(device, town, view, size, (occluders, casters), descent) for view in town.views]


def _view(
    device: hizvk.Device,
    town: Sunlit,
    view: SunView,
    size: Size,
    given: tuple[hizvk.Occluders, hizvk.Instances],
    descent: int,
) -> Row:
    occluders, casters = given
    camera = hizvk.Camera.look_at(view.eye, view.target, fov_y_deg=60, size=size, near=NEAR)
    depth = device.render_depth(occluders, camera)
    pyramid = device.pyramid(depth, depths="receivers")
    light = hizvk.DirectionalLight(view.light, receivers=town.receivers)
    kept = device.cull(casters, camera, pyramid, shadow=light, descent=descent).mask
    started = time.perf_counter()
    kept = device.cull(casters, camera, pyramid, shadow=light, descent=descent).mask
    cull_ms = 1e3 * (time.perf_counter() - started)

    clip = np.asarray(camera.clip_from_world)
    image = depth.numpy().astype(np.float64)
    points, distance = _points(clip, image)
    direction = np.asarray(view.light) / np.linalg.norm(view.light)
    needed = _needed(town, points[np.isfinite(points[:, 0])], direction)
    inside, behind = _by_rectangle(town, clip, distance.reshape(size), direction)
    return Row(
        view.name,
        len(town.low),
        int(needed.sum()),
        int(inside.sum()),
        int(behind.sum()),
        int(kept.sum()),
        int((needed & ~kept).sum()),
        cull_ms,
    )


def _points(clip: _Floats, image: _Floats) -> tuple[_Floats, _Floats]:
    """The point that each pixel shows and its w; NaN and infinity for background."""
    height, width = image.shape
    column, row = np.meshgrid(
        (np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2
    )
    ndc = np.stack([column, row, image, np.ones_like(image)], -1).reshape(-1, 4)
    with np.errstate(divide="ignore", invalid="ignore"):
        world = ndc @ np.linalg.inv(clip).T
        points = world[:, :3] / world[:, 3:]
    points[image.ravel() == 0.0] = np.nan
    w = np.concatenate([points, np.ones((len(points), 1))], 1) @ clip[3]
    return points, np.where(np.isfinite(w), w, np.inf)


def _needed(town: Sunlit, points: _Floats, direction: _Floats) -> _Mask:
    """Which casters stand between some point and the light."""
    needed = np.zeros(len(town.low), dtype=bool)
    for first in range(0, len(needed), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        with np.errstate(divide="ignore", invalid="ignore"):
            a = (points[None] - town.low[part, None] + TOUCHING) / direction
            b = (points[None] - town.high[part, None] - TOUCHING) / direction
        enter, leave = np.minimum(a, b).max(axis=2), np.maximum(a, b).min(axis=2)
        needed[part] = (np.maximum(enter, 0.0) <= leave).any(axis=1)
    return needed


def _by_rectangle(
    town: Sunlit, clip: _Floats, distance: _Floats, direction: _Floats
) -> tuple[_Mask, _Mask]:
    """Which swept volumes reach into the frustum, and which of them no depth hides."""
    height, width = distance.shape
    bits = (np.arange(8)[:, None] >> np.arange(3)) & 1
    corners = np.where(bits, town.high[:, None], town.low[:, None])
    # Down to the ground, below which nothing receives.
    length = town.high[:, 1] / -direction[1]
    hull = np.concatenate([corners, corners + length[:, None, None] * direction], 1)
    h = np.concatenate([hull, np.ones((*hull.shape[:2], 1))], 2) @ clip.T
    x, y, w = h[..., 0], h[..., 1], h[..., 3]
    outside: _Mask = np.asarray((w < NEAR).all(axis=1))
    for of in (x, y):
        outside |= (of > w).all(axis=1) | (of < -w).all(axis=1)
    inside: _Mask = np.logical_not(outside)
    behind = inside.copy()
    crossing = w.min(axis=1) <= NEAR
    columns = (x / np.maximum(w, 1e-9) + 1) / 2 * width
    rows = (1 - y / np.maximum(w, 1e-9)) / 2 * height
    for k in np.flatnonzero(inside & ~crossing):
        x0, y0 = (int(np.clip(np.floor(v[k].min()), 0, None)) for v in (columns, rows))
        x1, y1 = (int(np.clip(np.floor(v[k].max()), -1, None)) for v in (columns, rows))
        block = distance[y0 : y1 + 1, x0 : x1 + 1]
        behind[k] = not (w[k].min() > block * (1 + APART)).all()
    return inside, behind


@dataclass
class Report(frame.Run):
    """A run over all views."""

    descent: int = 0
    rows: list[Row] = field(default_factory=list)

    @property
    def passed(self) -> bool:
        """Whether something was measured, and no shadow is lost."""
        return bool(self.rows) and not any(row.lost for row in self.rows)

    def page(self) -> Page:
        """The table."""
        page = Page(PROG)
        page.items(*self.opening(f"Texels that a test may read: {self.descent or 256}"))
        page.table(HEAD, (cells(row) for row in self.rows))
        page.text("`lost` are casters that are needed and not kept by ours: 0 is promised.")
        return page


def cells(row: Row) -> list[str]:
    """A row of the table."""
    numbers = (row.casters, row.needed, row.frustum, row.behind, row.ours, row.lost)
    return [row.view, *(f"{number:,}" for number in numbers), f"{row.cull_ms:.1f}"]


def run(
    out: Path,
    *,
    size: Size = SIZE,
    small: int = SMALL,
    descent: int = 0,
    command: str = PROG,
) -> Report:
    """Leaves report.md and report.json in `out`.

    Parameters
    ----------
    out : Path
        A folder; made if it is not there.
    size, small, descent
        As for `measure`.
    command : str
        The command that the report names.

    Raises
    ------
    hizvk.HizError
        What the device refuses.
    """
    found = Report(command, SEED, hizvk.Device().adapter, descent=descent)

    def town(_key: str, _steps: Progress) -> None:
        found.rows = measure(size, small=small, descent=descent)

    found.over(out, ("town",), town, prog=PROG)
    report.write(out, found.as_data(), found.page())
    return found


def main(arguments: Sequence[str]) -> int:
    """Runs the command; exit code 1: it cannot run, or a shadow is lost."""
    parser = args.parser(
        PROG,
        "Shadow casters of a town that are needed, that the view volume or the depth alone keeps, "
        "and that a cull by the light keeps (exit code 1 if a needed one is culled).",
        out="out/bench-shadows",
        holds="report",
    )
    parser.add_argument(
        "--size", type=args.size, metavar="WIDTHxHEIGHT", help="of the views (default: 160x90)"
    )
    parser.add_argument(
        "--small", type=args.count, help=f"small casters beside the houses (default: {SMALL})"
    )
    parser.add_argument("--descent", type=args.count, help="texels that a test may read, from 256")
    options = {
        name: value
        for name, value in vars(parser.parse_args(list(arguments))).items()
        if value is not None
    }
    return frame.execute(PROG, run, {"scene": None, **options}, arguments, frame.print_page)
