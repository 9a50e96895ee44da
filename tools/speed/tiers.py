"""Tiers of boxes: the time against a flat cull, and the depths compared against one a pixel.

With both ends of the pyramid groups that surely show are accepted, so these culls have both.
The other side of the ratios is the flat cull with the farthest end alone, which is the quicker one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from hizvk.bounds import Boxes
from hizvk.scenes.scene import box_corners

from .figures import Figure
from .rounds import in_turns

if TYPE_CHECKING:
    from collections.abc import Callable

    from hizvk.camera import Camera
    from hizvk.resources import Instances, Pyramid

    from .run import Run
    from .town import Town

__all__ = ["measure"]

#: The shares of the crowd that are hidden, about.
HIDDEN: Final = (0.95, 0.0)
#: At most so much of the flat cull's time where nothing is hidden.
NOTHING_HIDDEN: Final = 0.5
#: By so many metres a crowd is lifted, so that no group touches the ground before its far side.
LIFT: Final = 4.5
#: At least so many times fewer depths are compared than pixels of all rectangles.
FEWER: Final = 100.0
#: Boxes that are projected at once.
BATCH: Final = 1 << 16


def measure(run: Run) -> None:
    """Measures all of it, at 1080p and with all levels."""
    for hidden in HIDDEN:
        run.step(f"tiers of {run.extent.crowd:,} instances, about {100 * hidden:.0f} % hidden")
        _by_share(run, hidden)
    run.step(f"tiers of {run.extent.crowd:,} instances above the ground")
    _above_the_ground(run)


def _above_the_ground(run: Run) -> None:
    """Nothing is hidden, and nothing of the image is before the far side of a group.

    On the ground a group's box has ground before it that is nearer than the box's far side.
    So its depth cannot prove that all of the group shows, and its members are tested.
    """
    scene = run.town(run.extent.crowd, 0.0)
    depth = run.depth(scene, run.extent.images[0][1])
    one, both = run.device.pyramid(depth), run.device.pyramid(depth, depths="both")
    lift = np.float32([0.0, 0.0, LIFT])
    boxes = run.device.instances(Boxes(scene.low + lift, scene.high + lift))
    ms = in_turns(
        {
            "flat": run.cull(boxes, depth.camera, one).ms,
            "1 tier, both ends": run.cull(boxes, depth.camera, both, groups=True).ms,
        },
        run.extent.rounds,
    )
    name, key = "nothing hidden, above the ground", "tiers.above"
    run.found.timed(f"tiers, {name}", ms)
    run.found.ratio(
        f"{key}.1 tier, both ends",
        f"{name}: 1 tier, both ends / flat",
        ms["1 tier, both ends"],
        ms["flat"],
        NOTHING_HIDDEN,
    )
    _accepted(run, boxes, both, (key, name))


def _accepted(run: Run, boxes: Instances, pyramid: Pyramid, of: tuple[str, str]) -> None:
    key, name = of
    stats = run.device.cull(
        boxes, pyramid.camera, pyramid, hierarchy=True, outputs=["verdicts"]
    ).stats
    share = stats.accepted_instances / stats.tested
    run.found.number(f"{key}.accepted", f"{name}: accepted with their groups", share, "share")


def _by_share(run: Run, hidden: float) -> None:
    scene = run.town(run.extent.crowd, hidden)
    depth = run.depth(scene, run.extent.images[0][1])
    one, both = run.device.pyramid(depth), run.device.pyramid(depth, depths="both")
    boxes = run.device.instances(scene.boxes)
    name, key = f"{100 * hidden:.0f} % hidden", f"tiers.hidden{100 * hidden:.0f}"
    tiers = ["1 tier, both ends", "2 tiers, both ends", "3 tiers, both ends"]
    ways: dict[str, Callable[[], float]] = {
        "flat": run.cull(boxes, depth.camera, one).ms,
        "flat, both ends": run.cull(boxes, depth.camera, both).ms,
        "1 tier": run.cull(boxes, depth.camera, one, groups=True).ms,
        "2 tiers": run.cull(boxes, depth.camera, one, groups=2).ms,
    }
    for n, label in enumerate(tiers, 1):
        ways[label] = run.cull(boxes, depth.camera, both, groups=n).ms
    ms = in_turns(ways, run.extent.rounds)
    found = run.found
    found.timed(f"tiers, {name}", ms)
    for label in [*ways][1:]:
        target = NOTHING_HIDDEN if hidden == 0.0 and label == tiers[0] else None
        found.ratio(f"{key}.{label}", f"{name}: {label} / flat", ms[label], ms["flat"], target)
    _accepted(run, boxes, both, (key, name))
    pixels = _pixels(scene, depth.camera)
    for label, pyramid in (("farthest end", one), ("both ends", both)):
        spent = _compared(run, boxes, pyramid)
        target = FEWER if hidden == HIDDEN[0] and label == "farthest end" else None
        found.figures.append(
            Figure(
                f"{key}.fewer.{label}",
                f"{name}: pixels of the rectangles / depths compared, 2 tiers, {label}",
                pixels / spent,
                "x",
                target=target,
                at_least=True,
            )
        )


def _compared(run: Run, boxes: Instances, pyramid: Pyramid) -> int:
    stats = run.device.cull(
        boxes, pyramid.camera, pyramid, hierarchy=2, outputs=["verdicts"], statistics=True
    ).stats
    return stats.texels_read or 1


def _pixels(scene: Town, camera: Camera) -> float:
    """Pixels of the rectangles around all boxes inside the view: one comparison each."""
    edges = np.array(camera.size[::-1])
    sum_of_all = 0.0
    for first in range(0, len(scene.low), BATCH):
        part = slice(first, first + BATCH)
        corners = box_corners(scene.low[part], scene.high[part])
        clip = np.concatenate([corners, np.ones((*corners.shape[:2], 1))], axis=2)
        clip = clip @ camera.clip_from_world.T
        w = clip[..., 3:]
        xy = clip[..., :2]
        inside = ~np.any([(side > w).all(axis=1) for side in (xy, -xy)], axis=0).any(axis=1)
        at = (np.where(w > 0.0, xy / w, np.nan) + 1.0) / 2.0 * edges
        low = np.floor(np.maximum(at.min(axis=1), 0.0))
        high = np.ceil(np.minimum(at.max(axis=1), edges))
        area = np.prod(np.maximum(high - low, 0.0), axis=1)
        # What crosses the plane of the eye may touch every pixel.
        area[np.isnan(area)] = np.prod(edges)
        sum_of_all += float(area[inside].sum())
    return sum_of_all
