"""Times every candidate on every camera, in turns."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from .. import _arguments
from ..building import of_arrays
from ..depth import DepthArray
from ..measuring.configuration import DepthVariant
from ..measuring.spread import spread
from ..measuring.stopwatch import Stopwatch, cull, drawn_triangles

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy.typing as npt

    from ..camera import Camera
    from ..device import Device
    from ..measuring.configuration import Configuration
    from ..measuring.spread import Spread
    from ..options import CullOptions, MeshLods
    from ..progress import Progress
    from ..resources import DepthImage, Instances, Occluders, Pyramid

__all__ = ["SLOW_MS", "DepthSource", "Times", "number_of_steps", "once", "time_all"]

#: A depth image that takes longer than this is not rendered again.
SLOW_MS: Final = 200.0


class DepthSource:
    """Where depth comes from: occluders that are rendered, or the images that were given.

    Parameters
    ----------
    device : Device
        Where pyramids are made.
    walls : Occluders, optional
        None: `images` are there.
    views : sequence of Camera
        One for each image.
    images : sequence of DepthArray, optional
        None: `walls` are rendered.
    """

    def __init__(
        self,
        device: Device,
        walls: Occluders | None,
        views: Sequence[Camera],
        images: Sequence[DepthArray] | None,
    ) -> None:
        self.device, self.views = device, views
        self._walls, self._images = walls, images
        self.selections: dict[int, Occluders] = {}
        """The occluders of `DepthVariant.selected`."""
        self._turn: dict[DepthVariant, tuple[DepthImage, float]] = {}
        self._slow: dict[tuple[DepthVariant, int], tuple[DepthImage, float]] = {}

    def pyramids(
        self, variants: Sequence[DepthVariant], k: int
    ) -> dict[DepthVariant, tuple[Pyramid, float]]:
        """The pyramids of view k, each with the milliseconds of its image and itself."""
        self._turn.clear()
        return {variant: self._pyramid(variant, k) for variant in variants}

    def full_image(self, k: int) -> DepthArray:
        """The full-size image of view k, and what its numbers are: as given, or plain depth."""
        if self._images is not None:
            return self._images[k]
        assert self._walls is not None
        depth = self.device.render_depth(self._walls, self.views[k])
        return DepthArray(depth.numpy(), depth.kind, 1.0, (), "none")

    def _pyramid(self, variant: DepthVariant, k: int) -> tuple[Pyramid, float]:
        if self._images is not None:
            watch = Stopwatch(self.device)
            stored = _arguments.stored_levels("levels", variant.levels)
            image, view = self._images[k], self.views[k]
            pyramid = of_arrays(self.device, image, view, stored, depths=variant.depths)
            return pyramid, watch.lap()
        depth, took = self._depth(variant, k)
        watch = Stopwatch(self.device)
        pyramid = self.device.pyramid(depth, levels=variant.levels, depths=variant.depths)
        return pyramid, took + watch.lap()

    def _depth(self, variant: DepthVariant, k: int) -> tuple[DepthImage, float]:
        """The image, rendered once a turn; only once in all if that is slow."""
        assert self._walls is not None
        key = variant.image()
        if key not in self._turn and (key, k) in self._slow:
            self._turn[key] = self._slow[key, k]
        if key not in self._turn:
            walls = self._walls
            if variant.selected is not None:
                walls = self.selections[variant.selected]
            watch = Stopwatch(self.device)
            camera = self.views[k]
            options = variant.render_options(camera.size)
            depth = self.device.render_depth(walls, camera, **options)
            self._turn[key] = depth, watch.lap()
            if self._turn[key][1] > SLOW_MS:
                self._slow[key, k] = self._turn[key]
        return self._turn[key]


@dataclass(frozen=True, eq=False)
class Times:
    """Milliseconds and masks of the candidates; every ``ms`` array is (repetitions, views)."""

    configurations: Sequence[Configuration]
    depth: dict[DepthVariant, npt.NDArray[np.float64]]
    """Image and pyramid."""
    cull: npt.NDArray[np.float64]
    """``(candidates, repetitions, views)``."""
    read: npt.NDArray[np.float64]
    """``(candidates, repetitions, views)``: the mask to the host."""
    masks: list[list[npt.NDArray[np.bool_]]]
    """By candidate and view."""
    triangles: list[int | None]
    """By candidate: what it draws in all views, if it has a rule for levels of detail."""

    def total(self, k: int) -> Spread:
        """The whole way of one candidate; the quartiles are those of cull and read."""
        shared = spread(self.depth[self.configurations[k].depth]).median
        return spread(self.cull[k] + self.read[k], plus=shared)


def number_of_steps(
    chosen: Sequence[Configuration], views: Sequence[Camera], repetitions: int
) -> int:
    """How many steps `time_all` takes: culls and depth images."""
    once = len(chosen) + len({one.depth for one in chosen})
    return once * len(views) * (repetitions + 1)


def once(
    device: Device,
    instances: Instances,
    pyramid: Pyramid,
    one: Configuration,
    base: CullOptions,
    meshes: Sequence[MeshLods] | None,
) -> tuple[npt.NDArray[np.bool_], float, float, int | None]:
    """One cull: mask, milliseconds of cull and read, and the triangles that its lists draw."""
    if one.lod is None:
        return *cull(device, instances, pyramid, one, base), None
    assert meshes is not None
    return drawn_triangles(device, instances, pyramid, one.options(base), meshes)


def time_all(
    chosen: Sequence[Configuration],
    volumes: Mapping[str, Instances],
    source: DepthSource,
    repetitions: int,
    base: CullOptions,
    steps: Progress,
    meshes: Sequence[MeshLods] | None = None,
    until: float = math.inf,
) -> Times:
    """Times every candidate `repetitions` times on every view.

    One more repetition comes first: it compiles, gives the masks, and is not counted.
    At least one more follows; others end at `until`, a time of `time.monotonic`.
    """
    rounds, views = repetitions + 1, len(source.views)
    variants = sorted({one.depth for one in chosen}, key=DepthVariant.cost)
    depth_ms = {variant: np.zeros((rounds, views)) for variant in variants}
    culling, reading = np.zeros((2, len(chosen), rounds, views))
    masks: list[list[npt.NDArray[np.bool_]]] = [[] for _ in chosen]
    triangles: list[int | None] = [None] * len(chosen)
    for repetition in range(rounds):
        if repetition > 1 and time.monotonic() > until:
            rounds = repetition
            break
        for k in range(views):
            made = source.pyramids(variants, k)
            for variant, (_, took) in made.items():
                depth_ms[variant][repetition, k] = took
                steps.step("timing")
            for turn in range(len(chosen)):
                number = (turn + repetition * len(chosen) // rounds + k) % len(chosen)
                one = chosen[number]
                instances, pyramid = volumes[one.volume], made[one.depth][0]
                mask, *both, drawn = once(source.device, instances, pyramid, one, base, meshes)
                culling[number, repetition, k], reading[number, repetition, k] = both
                if repetition == 0:
                    masks[number].append(mask)
                    if drawn is not None:
                        triangles[number] = (triangles[number] or 0) + drawn
                steps.step("timing")
    counted = {variant: ms[1:rounds] for variant, ms in depth_ms.items()}
    return Times(chosen, counted, culling[:, 1:rounds], reading[:, 1:rounds], masks, triangles)
