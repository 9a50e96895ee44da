"""``hizvk bench --texts``: what published tests lose, and how long they take, beside hizvk.

A published test proves nothing, and `hizvk.PublishedTest` runs each as its text prints it.
The time is that of one cull: from its recording to its end on the device, by the clock on the wall.
Depth image, pyramid and bounds are there beforehand, and the mask is read afterwards, for all.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import hizvk

from ..commands import arguments as args
from ..commands import figure, report
from ..measuring.configuration import DESCENT, Configuration
from ..measuring.spread import spread
from ..measuring.stopwatch import cull
from ..scenes.gates import gates
from ..scenes.truth import make_caster
from . import catalogue, frame
from .results import Row
from .score import look, score
from .texts_report import PROG, Found, Method, Report

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    import numpy.typing as npt

    from .._arguments import Size
    from ..progress import Progress
    from .catalogue import BenchScene

__all__ = ["NAMES", "main", "measure", "run"]

NAMES: Final = ("mountains", "city", "room", "gates", "castle")
INSTANCES: Final = {"mountains": 20_000, "city": 20_000, "room": 2_000, "gates": 4_000}
VIEWS: Final = {"mountains": 12, "city": 16, "room": 12, "gates": 32, "castle": 20}
SIZE: Final = (360, 640)
#: ARM's image and Darnell's, as (height, width); both have fewer pixels than the view.
SMALL: Final = (256, 256)
WIDE: Final = (256, 512)

#: Published tests: the label of each, its bounds, and its image (None: that of the view).
TEXTS: Final = {
    "rakos": ("Rakos 2010, boxes, 2x2", "boxes", None),
    "one_lookup": ("one lookup, boxes", "boxes", None),
    "arm": ("ARM, spheres, 256x256", "spheres", SMALL),
    "darnell": ("Darnell 2010, spheres, 512x256", "spheres", WIDE),
}
#: What hizvk itself makes of an image of fewer pixels.
LOW_RESOLUTION: Final = "hizvk, plain image of 256x256"
CONSERVATIVE: Final = "hizvk, conservative image of 256x256"
#: Certified culls of the same image.
OURS: Final = {
    f"hizvk, {one}": one
    for one in (
        Configuration(),
        Configuration(footprint=1),
        Configuration("spheres"),
        Configuration(fit="volume", descent=DESCENT),
    )
}


def _ways(
    device: hizvk.Device,
    camera: hizvk.Camera,
    occluders: hizvk.Occluders,
    bounds: dict[str, Any],
    instances: dict[str, hizvk.Instances],
) -> tuple[hizvk.DepthImage, dict[str, Callable[[], tuple[npt.NDArray[np.bool_], float]]]]:
    """The depth image of a view, and each way's mask and milliseconds, by label."""
    depth = device.render_depth(occluders, camera)
    pyramid = device.pyramid(depth)
    plain = {
        size: device.pyramid(device.render_depth(occluders, camera, size=size))
        for size in (SMALL, WIDE)
    }
    safe = device.pyramid(device.render_depth(occluders, camera, size=SMALL, conservative=True))

    def of_text(test: hizvk.PublishedTest) -> tuple[npt.NDArray[np.bool_], float]:
        device.wait()
        start = time.perf_counter()
        test.run()
        took = 1000.0 * (time.perf_counter() - start)
        return test.mask, took

    def of_ours(
        configuration: Configuration, pyramid: hizvk.Pyramid
    ) -> tuple[npt.NDArray[np.bool_], float]:
        return cull(device, instances[configuration.volume], pyramid, configuration)[:2]

    ways: dict[str, Any] = {}
    for text, (label, kind, size) in TEXTS.items():
        seen = pyramid if size is None else plain[size]
        given = bounds[kind], seen.camera, seen
        test = hizvk.PublishedTest(device, text, *given)  # type: ignore[arg-type]
        ways[label] = lambda test=test: of_text(test)
    ways[LOW_RESOLUTION] = lambda: of_ours(Configuration(), plain[SMALL])
    for label, configuration in OURS.items():
        ways[label] = lambda configuration=configuration: of_ours(configuration, pyramid)
    ways[CONSERVATIVE] = lambda: of_ours(Configuration(), safe)
    return depth, ways


def measure(
    bench: BenchScene,
    size: Size,
    repetitions: int,
    device: hizvk.Device,
    step: Callable[[str], None],
) -> Found:
    """All ways on all views of a scene, in turns.

    Parameters
    ----------
    bench : BenchScene
        The scene.
    size : (height, width)
        Of its views.
    repetitions : int
        How often everything is timed, after a first call that is not.
    device : Device
        Where.
    step : callable
        Is told the name of each view before it is measured.
    """
    scene, caster = bench.scene, make_caster(bench.scene)
    occluders = device.occluders(scene.vertices, scene.triangles)
    bounds = {kind: bench.bounds(kind) for kind in ("boxes", "spheres")}
    instances = {kind: device.instances(one) for kind, one in bounds.items()}
    labels = [*(label for label, *_ in TEXTS.values()), LOW_RESOLUTION, *OURS, CONSERVATIVE]
    masks: list[list[npt.NDArray[np.bool_]]] = [[] for _ in labels]
    ms = np.empty((len(labels), repetitions, len(scene.views)))
    truths = []
    for k, view in enumerate(scene.views):
        step(f"{bench.key}, view {k}")
        depth, ways = _ways(device, view.camera(size), occluders, bounds, instances)
        truths.append(look(scene, view, size, depth.numpy(), caster))
        for number, label in enumerate(labels):
            masks[number].append(ways[label]()[0])
        for repetition in range(repetitions):
            # Each begins with another way, so that a disturbance meets all alike.
            for turn in range(len(labels)):
                number = (turn + repetition) % len(labels)
                ms[number, repetition, k] = ways[labels[number]]()[1]
    rows = [Row(label, None) for label in labels]
    score(rows, masks, truths, caster)
    visible = sum(int(truth.visible.sum()) for truth in truths)
    return Found(
        key=bench.key,
        name=scene.name,
        instances=len(scene),
        views=len(scene.views),
        size=size,
        repetitions=repetitions,
        visible=visible,
        hidden=len(scene) * len(scene.views) - visible,
        truth=caster.method,
        rows=[
            Method(
                label=row.label,
                promises=row.label in OURS or row.label == CONSERVATIVE,
                lost=row.false_culls,
                hairs=row.hairs,
                hidden_kept_in_view=row.hidden_kept_in_view,
                ms=spread(of_row),
            )
            for row, of_row in zip(rows, ms, strict=True)
        ],
    )


def _scene(key: str, count: int, views: int, seed: int, castle: Path | None) -> BenchScene:
    if key == "gates":
        return catalogue.BenchScene(key, gates(count, views, seed=seed))
    return catalogue.make(key, count, views, seed, castle)


def run(
    out: Path,
    *,
    keys: Sequence[str] = NAMES,
    castle: Path | None = None,
    seed: int = 2010,
    instances: int | None = None,
    views: int | None = None,
    size: Size = SIZE,
    repetitions: int = 5,
    command: str = PROG,
) -> Report:
    """Leaves report.md, report.json and texts.png in `out`.

    Parameters
    ----------
    out : Path
        A folder; made if it is not there.
    keys : sequence of str
        Of `NAMES`.
    castle : Path, optional
        The castle's file.
    seed : int
        Same seed, same scenes.
    instances, views : int, optional
        For every scene.
    size : (height, width)
        Of the views.
    repetitions : int
        How often everything is timed.
    command : str
        The command that the report names.

    Raises
    ------
    hizvk.HizError
        What the device refuses.
    """
    device = hizvk.Device()
    found = Report(command=command, seed=seed, adapter=device.adapter)

    def of_scene(key: str, steps: Progress) -> None:
        count = instances or INSTANCES.get(key, 1)
        bench = _scene(key, count, views or VIEWS[key], seed, castle)
        found.scenes.append(measure(bench, size, repetitions, device, steps.step))

    found.over(out, keys, of_scene, prog=PROG, steps=sum(views or VIEWS[key] for key in keys))
    page = found.page()
    if figure.can_draw() and found.scenes:
        from .texts_plot import draw

        draw(out / "texts.png", found)
        page.picture("visible lost against time", "texts.png")
    else:
        found.missing.append(figure.missing())
    report.write(out, found.as_data(), page)
    return found


def main(arguments: Sequence[str]) -> int:
    """Runs the command; exit code 1: a promise was broken, or it cannot run."""
    parser = frame.parser(
        PROG,
        "What published visibility tests lose and how long they take, beside certified culls of "
        "the same depth image.",
        out="out/bench-texts",
        holds="report and plot",
        names=NAMES,
        seed=2010,
    )
    frame.add_castle(parser)
    parser.add_argument(
        "--size", type=args.size, default=SIZE, metavar="WIDTHxHEIGHT", help="of the views"
    )
    parser.add_argument("--repetitions", type=args.count, default=5, help="of each time")
    options = vars(parser.parse_args(list(arguments)))
    return frame.execute(PROG, run, options, arguments, frame.print_page)
