"""The depth reduction against a memcpy and one dispatch per level.

Rendered and uploaded images are reduced.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from .errors import OracleSample
from .rounds import in_turns
from .run import ALL_LEVELS

if TYPE_CHECKING:
    from collections.abc import Callable

    from hizvk import _core

    from .run import Run

__all__ = ["measure"]

#: Choices of levels by name, as `_core` takes them.
CHOICES: Final = {
    "all levels": ALL_LEVELS,
    "levels >= 2": (2, 15),
    "levels >= 3": (3, 15),
    "level 5 alone": (5, 5),
}
#: Memcpies of the input that a choice may take, by the image's name.
TARGETS: Final = {
    ("all levels", "1080p"): 3.0,
    ("all levels", "4K"): 2.0,
    ("levels >= 2", "1080p"): 2.0,
    ("levels >= 2", "4K"): 1.5,
}
#: Times of the farthest end alone that both may take, by the choice of levels.
BOTH_ENDS: Final = {"all levels": 1.5, "level 5 alone": 1.5}
#: One dispatch per level takes at least this many times the library's own reduction.
SHAPES: Final = {"buffer": 1.8, "textures": 4.0}


def measure(run: Run) -> None:
    """Times every choice of levels, and counts what the choices cost in kept instances."""
    for name, size in run.extent.images:
        scene = run.town(1, 0.0)
        rendered = run.depth(scene, size)
        numbers = rendered.numpy()
        camera = rendered.camera
        uploaded = run.device._engine.upload_depth(
            numbers, camera.depth_kind, 1.0, (), "none", (0.0, 0.0), camera._inner
        )
        for source, depth in (("rendered", rendered._inner), ("uploaded", uploaded)):
            run.step(f"reduction of a {source} image, {name}")
            _one(run, name, source, depth, numbers)
    run.step("what levels cost in kept instances")
    _errors(run)


def _one(
    run: Run,
    name: str,
    source: str,
    depth: _core.DepthImage,
    numbers: np.typing.NDArray[np.float32],
) -> None:
    part, target = f"reduction {name} {source}", np.empty_like(numbers)
    ways: dict[str, Callable[[], float]] = {
        "memcpy of the input": lambda: run.yardstick.memcpy_ms(numbers, target),
        "empty submit": run.yardstick.empty_submit_ms,
    }
    for choice, levels in CHOICES.items():
        ways[choice] = run.yardstick.reduction(depth, "own", levels).ms
    for choice in BOTH_ENDS:
        ways[f"both ends, {choice}"] = run.yardstick.reduction(
            depth, "own", CHOICES[choice], "both"
        ).ms
    for shape in SHAPES:
        ways[f"level by level, {shape}"] = run.yardstick.reduction(depth, shape, ALL_LEVELS).ms
    ms = in_turns(ways, run.extent.rounds)
    found, key = run.found, f"reduction.{name}.{source}"
    found.timed(part, ms)
    for choice in CHOICES:
        found.ratio(
            f"{key}.{choice}",
            f"{name}, {source}: {choice} / memcpy",
            ms[choice],
            ms["memcpy of the input"],
            TARGETS.get((choice, name)),
        )
    for choice, most in BOTH_ENDS.items():
        found.ratio(
            f"{key}.{choice}.both",
            f"{name}, {source}: both ends / farthest, {choice}",
            ms[f"both ends, {choice}"],
            ms[choice],
            most,
        )
    for shape, least in SHAPES.items():
        found.ratio(
            f"{key}.{shape}",
            f"{name}, {source}: level by level ({shape}) / all levels",
            ms[f"level by level, {shape}"],
            ms["all levels"],
            least,
            at_least=True,
        )


def _errors(run: Run) -> None:
    scene = run.town(run.extent.calls, 0.5)
    depth = run.depth(scene, run.extent.images[0][1])
    crowd = run.device.instances(scene.boxes)
    judge = OracleSample(run, scene.boxes, depth)
    for choice, levels in CHOICES.items():
        pyramid = run.device.pyramid(depth, levels=levels)
        judge.judge(
            "reduction",
            choice,
            run.device.cull(crowd, depth.camera, pyramid, outputs=["mask"]).mask,
        )
