"""The cull's own time on the device: certified, uncertified and grouped, and by what is asked for.

Nothing is read back.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from hizvk.errors import LimitError, OutOfMemoryError

from . import town
from .errors import OracleSample
from .rounds import in_turns
from .run import MASK

if TYPE_CHECKING:
    from collections.abc import Callable

    from hizvk.resources import DepthImage, Pyramid

    from .run import Run

__all__ = ["HIDDEN", "measure"]

#: The shares of the crowd that are hidden, about.
HIDDEN: Final = (0.95, 0.5, 0.0)
#: The greatest share of instances that may be kept with groups only, or without groups only.
SAME_KEPT: Final = 0.001
#: ``(order, outputs)`` as `_core` takes them.
OUTPUTS: Final = {
    "mask": ("stable", MASK),
    "verdicts": ("stable", (False, True, False, False)),
    "draws": ("any", (False, False, False, True)),
    "indices, any order": ("any", (False, False, True, True)),
    "indices, stable": ("stable", (False, False, True, True)),
    "everything, any order": ("any", (True, True, True, True)),
    "everything, stable": ("stable", (True, True, True, True)),
}


def measure(run: Run) -> None:
    """Measures all of it, at 1080p and with all levels."""
    for hidden in HIDDEN:
        run.step(f"culls of {run.extent.crowd:,} instances, about {100 * hidden:.0f} % hidden")
        _by_share(run, hidden)
    run.step("culls by what is asked for")
    _by_output(run)
    if run.extent.large is not None:
        run.step(f"culls of {run.extent.large:,} instances")
        try:
            _large(run, run.extent.large)
        except (MemoryError, OutOfMemoryError, LimitError) as error:
            run.found.notes.append(
                f"culls of {run.extent.large:,} instances were left out: {error}"
            )


def _ready(run: Run, scene: town.Town) -> tuple[DepthImage, Pyramid]:
    depth = run.depth(scene, run.extent.images[0][1])
    return depth, run.device.pyramid(depth)


def _by_share(run: Run, hidden: float) -> None:
    scene = run.town(run.extent.crowd, hidden)
    depth, pyramid = _ready(run, scene)
    judge = OracleSample(run, scene.boxes, depth)
    boxes = run.device.instances(scene.boxes)
    name = f"{100 * hidden:.0f} % hidden"
    culls = {
        "boxes, uncertified": run.cull(boxes, depth.camera, pyramid, certified=False),
        "boxes, flat": run.cull(boxes, depth.camera, pyramid),
        "boxes, groups": run.cull(boxes, depth.camera, pyramid, groups=True),
    }
    if hidden == HIDDEN[0]:
        culls["boxes, groups, with their reduction"] = run.cull(
            boxes, depth.camera, run.device.pyramid(depth), groups=True, depth=depth
        )
        for kind, bounds in (
            ("spheres", town.spheres(scene)),
            ("oriented boxes", town.oriented(scene, run.seed)),
        ):
            instances = run.device.instances(bounds)
            culls[f"{kind}, flat"] = run.cull(instances, depth.camera, pyramid)
            culls[f"{kind}, groups"] = run.cull(instances, depth.camera, pyramid, groups=True)
    ways: dict[str, Callable[[], float]] = {label: cull.ms for label, cull in culls.items()}
    ms = in_turns(ways | {"empty submit": run.yardstick.empty_submit_ms}, run.extent.rounds)
    found, key, part = run.found, f"cull.hidden{100 * hidden:.0f}", f"cull, {name}"
    found.timed(part, ms)
    found.number(
        f"{key}.share", f"{name}: hidden in truth, of a sample", judge.hidden_share, "share"
    )
    found.ratio(
        f"{key}.flat_over_uncertified",
        f"{name}: flat, certified / uncertified",
        ms["boxes, flat"],
        ms["boxes, uncertified"],
        1.25 if hidden == HIDDEN[0] else None,
    )
    found.ratio(
        f"{key}.groups_over_flat",
        f"{name}: groups / flat",
        ms["boxes, groups"],
        ms["boxes, flat"],
        1.1 if hidden == 0.0 else None,
    )
    for label in culls:
        found.spread(
            f"{key}.ns.{label}",
            f"{name}: {label}, per instance",
            1e6 * ms[label] / len(boxes),
            "ns",
        )
    masks = {
        label: culls[label].mask()
        for label in ("boxes, flat", "boxes, groups", "boxes, uncertified")
    }
    for label, mask in masks.items():
        judge.judge(part, label, mask, promises="uncertified" not in label)
    differing = masks["boxes, flat"] != masks["boxes, groups"]
    found.number(
        f"{key}.differing",
        f"{name}: kept with groups or without, not both",
        float(differing.mean()),
        "share",
        SAME_KEPT,
    )
    stats = run.device.cull(
        boxes, depth.camera, pyramid, hierarchy=True, outputs=["verdicts"]
    ).stats
    found.number(
        f"{key}.tests", f"{name}: tests spent, groups / flat", stats.comparisons / stats.tested, "x"
    )


def _by_output(run: Run) -> None:
    scene = run.town(run.extent.crowd, HIDDEN[0])
    depth, pyramid = _ready(run, scene)
    boxes = run.device.instances(scene.boxes)
    for way, groups in (("flat", False), ("groups", True)):
        ways = {
            label: run.cull(
                boxes, depth.camera, pyramid, groups=groups, order=order, outputs=outputs
            ).ms
            for label, (order, outputs) in OUTPUTS.items()
        }
        ms = in_turns(ways, run.extent.rounds)
        run.found.timed(f"outputs, {way}", ms)
        for label in OUTPUTS:
            run.found.ratio(
                f"outputs.{way}.{label}",
                f"{way}: {label} / everything, stable",
                ms[label],
                ms["everything, stable"],
            )


def _large(run: Run, large: int) -> None:
    def flat_and_groups(count: int) -> dict[str, Callable[[], float]]:
        scene = run.town(count, HIDDEN[0])
        depth, pyramid = _ready(run, scene)
        boxes = run.device.instances(scene.boxes)
        return {
            f"{way}, {count:,}": run.cull(boxes, depth.camera, pyramid, groups=groups).ms
            for way, groups in (("flat", False), ("groups", True))
        }

    ms = in_turns(
        flat_and_groups(run.extent.crowd) | flat_and_groups(large), max(3, run.extent.rounds // 3)
    )
    run.found.timed("cull, many", ms)
    for way in ("flat", "groups"):
        run.found.ratio(
            f"cull.many.{way}",
            f"{way}: {large / 1e6:g}M / {run.extent.crowd / 1e6:g}M instances",
            ms[f"{way}, {large:,}"],
            ms[f"{way}, {run.extent.crowd:,}"],
            large / run.extent.crowd,
        )
