"""The way in: uploads, updates, bounds from a buffer, and when a new upload, which sorts, pays."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

import numpy as np

from hizvk.bounds import Boxes, Spheres

from .rounds import in_turns

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from hizvk.resources import Instances

    from .run import Run

    Floats32 = npt.NDArray[np.float32]

__all__ = ["measure"]

#: Shares of the instances that are replaced.
SHARES: Final = (0.01, 0.1, 1.0)
#: Shares of the instances that have changed places since the upload.
GONE: Final = (0.0, 0.001, 0.01, 0.1, 1.0)
#: A re-sort can pay if the tests are more than this times those after a new upload.
WORTH: Final = 1.02
#: The greatest metres by which all of them have moved along each axis.
DRIFT: Final = (1.0, 10.0)


def measure(run: Run) -> None:
    """Measures boxes in contiguous float32, 95 % hidden."""
    run.step("uploads and updates")
    _uploads(run)
    run.step("bounds from a buffer")
    _from_buffer(run)
    run.step("culls after instances have moved")
    _moved(run)


def _waited(run: Run, work: Callable[[], object]) -> Callable[[], float]:
    def timed() -> float:
        run.device.wait()
        start = time.perf_counter()
        made = work()
        run.device.wait()
        took = 1e3 * (time.perf_counter() - start)
        del made  # not timed
        return took

    return timed


def _uploads(run: Run) -> None:
    scene, device = run.town(run.extent.crowd, 0.95), run.device
    boxes, count = scene.boxes, len(scene.boxes)
    resident, copy = device.instances(boxes), np.empty_like(scene.low)

    def update(share: float) -> Callable[[], float]:
        part = Boxes(scene.low[: int(share * count)], scene.high[: int(share * count)])
        return _waited(run, lambda: resident.update(0, part))

    def memcpy() -> float:
        return sum(run.yardstick.memcpy_ms(part, copy) for part in (scene.low, scene.high))

    ways = {
        "memcpy of the input": memcpy,
        "upload, Morton order": _waited(run, lambda: device.instances(boxes)),
        "upload, given order": _waited(run, lambda: device.instances(boxes, order="given")),
        **{f"update of {100 * share:g} %": update(share) for share in SHARES},
    }
    ms = in_turns(ways, max(3, run.extent.rounds // 3))
    run.found.timed("transfers", ms)
    for order in ("Morton", "given"):
        way = f"upload, {order} order"
        run.found.spread(
            f"transfers.upload.{order}", f"{way}, per instance", 1e6 * ms[way] / count, "ns"
        )
        run.found.ratio(
            f"transfers.memcpies.{order}",
            f"{way} / memcpy of the input",
            ms[way],
            ms["memcpy of the input"],
        )
    for share in SHARES:
        way = f"update of {100 * share:g} %"
        each = 1e6 * ms[way] / int(share * count)
        run.found.spread(
            f"transfers.update.{100 * share:g}", f"{way}, per moved instance", each, "ns"
        )


def _from_buffer(run: Run) -> None:
    """Bounds that a shader has written: records and group boxes, beside copies of their bytes."""
    scene, device = run.town(run.extent.crowd, 0.95), run.device
    count = len(scene.boxes)
    centers = 0.5 * (scene.low + scene.high)
    radii = 0.5 * np.linalg.norm(scene.high - scene.low, axis=1).astype(np.float32)
    kinds: tuple[tuple[str, tuple[Floats32, Floats32], Spheres | Boxes], ...] = (
        ("spheres", (centers, radii), Spheres(centers, radii)),
        ("boxes", (scene.low, scene.high), scene.boxes),
    )
    for name, arrays, bounds in kinds:
        on_device = run.yardstick.bounds_in_buffer(name, arrays)
        resident = device.instances(bounds, order="given")
        copies = [np.empty_like(part) for part in arrays]

        def memcpy(
            arrays: tuple[Floats32, Floats32] = arrays, copies: list[Floats32] = copies
        ) -> float:
            pairs = zip(arrays, copies, strict=True)
            return sum(run.yardstick.memcpy_ms(part, copy) for part, copy in pairs)

        def update(resident: Instances = resident, bounds: Spheres | Boxes = bounds) -> None:
            resident.update(0, bounds)

        ways = {
            "memcpy of the input": memcpy,
            "copy on the device": on_device.copy_ms,
            "from a buffer": on_device.ms,
            "update from the host": _waited(run, update),
        }
        ms = in_turns(ways, run.extent.rounds)
        run.found.timed(f"bounds from a buffer: {name}", ms)
        way = f"{count:,} {name} from a buffer"
        run.found.spread(
            f"transfers.from_buffer.{name}",
            f"{way}, per instance",
            1e6 * ms["from a buffer"] / count,
            "ns",
        )
        for other in ("memcpy of the input", "copy on the device", "update from the host"):
            run.found.ratio(
                f"transfers.from_buffer.{name}.{other}",
                f"{way} / {other}",
                ms["from a buffer"],
                ms[other],
            )


def _moved(run: Run) -> None:
    """Culls with groups: moved instances in their old order, beside those of a new upload."""
    scene, device = run.town(run.extent.crowd, 0.95), run.device
    depth = run.depth(scene, run.extent.images[0][1])
    pyramid = device.pyramid(depth)
    rng = np.random.default_rng(run.seed)
    worlds = {
        f"{100 * share:g} % gone elsewhere": _elsewhere(rng, scene.boxes, share) for share in GONE
    }
    worlds |= {
        f"all moved by up to {metres:g} m": _drifted(rng, scene.boxes, metres) for metres in DRIFT
    }
    resort = float(
        np.median([_waited(run, lambda: device.instances(scene.boxes))() for _ in range(3)])
    )
    for label, boxes in worlds.items():
        old, fresh = device.instances(scene.boxes), device.instances(boxes)
        old.update(0, boxes)
        ways = {
            "updated": run.cull(old, depth.camera, pyramid, groups=True).ms,
            "uploaded anew": run.cull(fresh, depth.camera, pyramid, groups=True).ms,
        }
        ms = in_turns(ways, run.extent.rounds)
        run.found.timed(f"moved: {label}", ms)
        run.found.ratio(
            f"moved.{label}",
            f"{label}: cull, updated / uploaded anew",
            ms["updated"],
            ms["uploaded anew"],
        )
        tests = [
            device.cull(
                one, depth.camera, pyramid, hierarchy=True, outputs=["verdicts"]
            ).stats.comparisons
            for one in (old, fresh)
        ]
        run.found.number(
            f"moved.tests.{label}",
            f"{label}: tests spent, updated / uploaded anew",
            tests[0] / tests[1],
            "x",
        )
        saved = float(np.median(ms["updated"]) - np.median(ms["uploaded anew"]))
        if tests[0] > WORTH * tests[1] and saved > 0.0:
            run.found.number(
                f"moved.pays.{label}", f"{label}: a re-sort pays after", resort / saved, "culls"
            )


def _elsewhere(rng: np.random.Generator, boxes: Boxes, share: float) -> Boxes:
    """The boxes after a share of them has changed places; as many are hidden as before."""
    which = rng.permutation(len(boxes))[: int(share * len(boxes))]
    low, high = boxes.min.copy(), boxes.max.copy()
    low[which], high[which] = low[np.roll(which, 1)], high[np.roll(which, 1)]
    return Boxes(low, high)


def _drifted(rng: np.random.Generator, boxes: Boxes, metres: float) -> Boxes:
    """The boxes, each moved along the ground in its own direction."""
    shift = rng.uniform(-metres, metres, (len(boxes), 3)).astype(np.float32) * np.array(
        [1.0, 1.0, 0.0], np.float32
    )
    return Boxes(boxes.min + shift, boxes.max + shift)
