"""Times and counts: every configuration and yardstick on every view of a scene, in turns.

A repetition goes through the views, and in each view through all configurations.
It begins with another configuration each time, so that whatever disturbs the machine for a while
disturbs all alike.
The yardsticks follow in the same way.

Each stage is waited for and timed by the wall clock, which includes what Python adds.
The first call of everything comes before and is reported apart.
Counts come from culls of their own, because counting costs time.
The timed culls have to keep the same instances.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ..bounds import Spheres
from ..measuring.configuration import Configuration, DepthVariant
from ..measuring.spread import spread
from ..measuring.stopwatch import Stopwatch, cull, rendered
from ..scenes import embree
from ..scenes.truth import make_caster
from . import numpy_hiz
from .rays import Rays
from .results import STAGES, Row, SceneResult
from .score import ViewTruth, look, score

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .._arguments import Size
    from ..device import Device
    from ..resources import DepthImage
    from .catalogue import BenchScene

__all__ = ["measure"]

Mask: TypeAlias = npt.NDArray[np.bool_]


class _Run:
    """One scene on the device."""

    def __init__(
        self,
        bench: BenchScene,
        size: Size,
        configurations: Sequence[Configuration],
        repetitions: int,
        device: Device,
    ) -> None:
        self.device, self.size, self.repetitions = device, size, repetitions
        self.scene = bench.scene
        self.configurations = configurations
        self.variants = sorted(
            {DepthVariant(), *(one.depth for one in configurations)}, key=DepthVariant.cost
        )
        self.cameras = [view.camera(size) for view in self.scene.views]
        watch = Stopwatch(device)
        self.occluders = device.occluders(self.scene.vertices, self.scene.triangles)
        self.way_upload_ms = watch.lap()
        bounds = {
            kind: bench.bounds(kind) for kind in dict.fromkeys(one.volume for one in configurations)
        }
        bounds.setdefault("boxes", bench.bounds("boxes"))
        self.instances, self.upload_ms = {}, 0.0
        for kind, one in bounds.items():
            watch.lap()
            self.instances[kind] = device.instances(one)
            took = watch.lap()
            self.upload_ms += took
            self.way_upload_ms += took if kind == "boxes" else 0.0
        self.boxes32 = self.scene.box_min.astype(np.float32), self.scene.box_max.astype(np.float32)
        self.warm_up_ms = 0.0
        self.rays = Rays(self.scene) if embree.can_cast() else None
        self.caster = make_caster(self.scene)
        self.rows: list[Row] = []
        self.truths: list[ViewTruth] = []
        self.masks: list[list[Mask]] = []
        self.ms: list[dict[str, npt.NDArray[np.float64]]] = []

    def yardsticks(self) -> dict[str, Callable[[int, DepthImage], tuple[Mask, dict[str, float]]]]:
        """What is measured beside hizvk, by label.

        Each is called with a view's number and its depth image, and returns a mask and milliseconds
        by stage.
        """
        found: dict[str, Any] = {
            "numpy Hi-Z, float64": lambda k, depth: self._numpy(k, depth, np.float64),
            "numpy Hi-Z, float32": lambda k, depth: self._numpy(k, depth, np.float32),
        }
        if self.rays is not None:
            rays, small = self.rays, DepthVariant(4).size(self.size)
            found["Embree, one ray per pixel"] = lambda k, _: _timed(
                lambda: rays.image(self.scene.views[k], self.size)
            )
            found["Embree, one ray for 4x4 pixels"] = lambda k, _: _timed(
                lambda: rays.image(self.scene.views[k], small)
            )
            found["Embree, rays to 9 points of a box"] = lambda k, _: _timed(
                lambda: rays.points(self.scene.views[k], self.size)
            )
        return found

    def _numpy(
        self, k: int, depth: DepthImage, dtype: type[np.floating[Any]]
    ) -> tuple[Mask, dict[str, float]]:
        low, high = (
            self.boxes32 if dtype is np.float32 else (self.scene.box_min, self.scene.box_max)
        )
        matrix = self.cameras[k].clip_from_world.astype(dtype)
        start = time.perf_counter()
        pyramid = numpy_hiz.NumpyPyramid.build(depth.numpy().astype(dtype))
        built = time.perf_counter()
        mask = numpy_hiz.cull(low, high, matrix, pyramid, self.scene.views[k].near)
        done = time.perf_counter()
        return mask, {"reduce": 1000.0 * (built - start), "cull": 1000.0 * (done - built)}

    def count(self, step: Callable[[str], None]) -> None:
        """Makes the first call of everything; finds the truth, the masks and the texels."""
        self.rows = [Row(str(one), one) for one in self.configurations]
        texels = np.zeros(len(self.rows))
        self.masks = [[] for _ in self.rows]
        for k, (view, camera) in enumerate(zip(self.scene.views, self.cameras, strict=True)):
            step(f"counting, view {k}")
            made = {}
            for variant in self.variants:
                depth, pyramid, render, reduce = rendered(
                    self.device, self.occluders, camera, variant
                )
                made[variant] = depth, pyramid
                self.warm_up_ms += render + reduce if k == 0 else 0.0
            plain = made[DepthVariant()][0]
            self.truths.append(look(self.scene, view, self.size, plain.numpy(), self.caster))
            for number, one in enumerate(self.configurations):
                pyramid = made[one.depth][1]
                if k == 0:
                    self.rows[number].first_ms = cull(
                        self.device, self.instances[one.volume], pyramid, one
                    )[1]
                    self.warm_up_ms += self.rows[number].first_ms or 0.0
                seen = self.device.cull(
                    self.instances[one.volume],
                    pyramid.camera,
                    pyramid,
                    statistics=True,
                    **one.cull_options(),
                )
                self.masks[number].append(seen.mask)
                texels[number] += seen.stats.texels_read or 0
            for number, (label, ask) in enumerate(
                self.yardsticks().items(), len(self.configurations)
            ):
                mask, took = ask(k, plain)
                if k == 0:
                    self.rows.append(Row(label, None, first_ms=sum(took.values())))
                    self.masks.append([])
                self.masks[number].append(mask)
        for number, row in enumerate(self.rows[: len(self.configurations)]):
            row.texels_per_instance = float(texels[number]) / (len(self.scene) * len(self.cameras))
        self._add_untimed(
            "best rectangle test (float64, all pixels)", [truth.rectangle for truth in self.truths]
        )
        self._add_untimed(
            "view volume alone (float64)", [truth.projected.inside for truth in self.truths]
        )

    def _add_untimed(self, label: str, masks: list[Mask]) -> None:
        self.rows.append(Row(label, None))
        self.masks.append(masks)

    def time(self, step: Callable[[str], None]) -> None:
        """Times all repetitions; each has the configurations first and the yardsticks after them.

        The two stay apart, because whatever runs after a yardstick finds cold caches and sleeping
        threads.
        """
        shape = self.repetitions, len(self.cameras)
        yardsticks = list(self.yardsticks().values())
        timed = len(self.configurations) + len(yardsticks)
        stages = {variant: np.zeros((2, *shape)) for variant in self.variants}
        self.ms = [{} for _ in range(timed)]
        for repetition in range(self.repetitions):
            step(f"timing, repetition {repetition}")
            for k, camera in enumerate(self.cameras):
                if k == 0:
                    rendered(self.device, self.occluders, camera, DepthVariant())
                made = {}
                for variant in self.variants:
                    depth, pyramid, *took = rendered(self.device, self.occluders, camera, variant)
                    made[variant] = pyramid
                    stages[variant][:, repetition, k] = took
                begin = repetition * len(self.configurations) // self.repetitions + k
                for turn in range(len(self.configurations)):
                    number = (begin + turn) % len(self.configurations)
                    one = self.configurations[number]
                    mask, *both = cull(
                        self.device, self.instances[one.volume], made[one.depth], one
                    )
                    self._note(
                        number, repetition, k, mask, dict(zip(("cull", "read"), both, strict=True))
                    )
            for k, camera in enumerate(self.cameras):
                depth = self.device.render_depth(self.occluders, camera)
                self.device.wait()
                for number, ask in enumerate(yardsticks, len(self.configurations)):
                    mask, milliseconds = ask(k, depth)
                    self._note(number, repetition, k, mask, milliseconds)
        for number, row in enumerate(self.rows[:timed]):
            ms = self.ms[number]
            if row.configuration is not None:
                ms["render"], ms["reduce"] = stages[row.configuration.depth]
            elif "reduce" in ms:  # numpy reads the image that the device has rendered
                ms["render"] = stages[DepthVariant()][0]
            row.ms = {stage: spread(ms[stage]) if stage in ms else None for stage in STAGES}
            shared = sum(part.median for part in (row.ms["render"], row.ms["reduce"]) if part)
            own = np.sum([ms[stage] for stage in ("cull", "read") if stage in ms], axis=0)
            row.total_ms = spread(own, plus=shared)
            row.ns_per_instance = 1e6 * spread(ms["cull"]).median / len(self.scene)

    def _note(
        self, number: int, repetition: int, k: int, mask: Mask, took: dict[str, float]
    ) -> None:
        """Notes the times of one row in one view; its mask has to be the same as before."""
        if not np.array_equal(mask, self.masks[number][k]):
            raise RuntimeError(
                f"{self.rows[number].label}, view {k}: two culls of the same view differ"
            )
        for stage, value in took.items():
            self.ms[number].setdefault(stage, np.zeros((self.repetitions, len(self.cameras))))[
                repetition, k
            ] = value

    def one_instance(self) -> float:
        """The median milliseconds of culling one instance in the middle of the first view."""
        view = self.scene.views[0]
        point = np.add(view.eye, 10.0 * view.basis()[2])[None]
        instances = self.device.instances(Spheres(point, 0.1))
        pyramid = rendered(self.device, self.occluders, self.cameras[0], DepthVariant())[1]
        one = Configuration("spheres")
        return float(
            np.median([cull(self.device, instances, pyramid, one)[1] for _ in range(9)][1:])
        )


def measure(
    bench: BenchScene,
    size: Size,
    configurations: Sequence[Configuration],
    repetitions: int,
    device: Device,
    step: Callable[[str], None],
) -> SceneResult:
    """Measures one scene.

    Parameters
    ----------
    bench : BenchScene
        The scene.
    size : (height, width)
        Of the views.
    configurations : sequence of Configuration
        What to measure.
    repetitions : int
        How often everything is timed, beside the first call.
    device : Device
        Where.
    step : callable
        Is called with what comes next, ``len(views) + repetitions`` times.

    Raises
    ------
    hizvk.HizError
        What the device refuses.
    RuntimeError
        If two culls of the same view differ.
    """
    run = _Run(bench, size, configurations, repetitions, device)
    run.count(step)
    run.time(step)
    score(run.rows, run.masks, run.truths, run.caster)
    visible = sum(int(truth.visible.sum()) for truth in run.truths)
    scene = bench.scene
    found = SceneResult(
        key=bench.key,
        name=scene.name,
        instances=len(scene),
        occluder_triangles=len(scene.triangles),
        instance_triangles=len(scene.instance_triangles),
        views=len(scene.views),
        size=size,
        repetitions=repetitions,
        truth=run.caster.method,
        visible=visible,
        hidden=len(scene) * len(scene.views) - visible,
        inside=sum(int(truth.projected.inside.sum()) for truth in run.truths),
        one_instance_ms=run.one_instance(),
        upload_ms=run.upload_ms,
        way_upload_ms=run.way_upload_ms,
        warm_up_ms=run.warm_up_ms,
        rows=run.rows,
    )
    found.mark_front()
    return found


def _timed(ask: Callable[[], Mask]) -> tuple[Mask, dict[str, float]]:
    start = time.perf_counter()
    mask = ask()
    return mask, {"cull": 1000.0 * (time.perf_counter() - start)}
