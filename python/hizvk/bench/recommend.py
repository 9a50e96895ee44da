"""Measures the caller's own scene, and says which configuration to use there.

No truth is needed for it: none of the candidates hides what can be seen, so the one that keeps less is right more
often.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .. import _arguments
from ..bounds import Boxes, OrientedBoxes, Spheres
from ..camera import Camera
from ..depth import checked_image
from ..device import Device
from ..oneline import default_device
from ..resources import Instances, Mesh, Occluders
from .configurations import Configuration, DepthVariant, promised, render_options
from .pareto import front
from .results import Spread, spread
from .stages import Stopwatch, cull, rendered

if TYPE_CHECKING:
    import numpy.typing as npt

    from .._arguments import Size
    from ..bounds import Bounds
    from ..depth import DepthArray, DepthKind
    from ..device import Coverage
    from ..resources import Pyramid

__all__ = ["Candidate", "Recommendation", "choose", "recommend"]

KINDS: Final = {"spheres": Spheres, "boxes": Boxes, "oriented_boxes": OrientedBoxes}


@dataclass(frozen=True)
class Candidate:
    """One configuration, measured on the caller's scene."""

    configuration: Configuration
    ms: Spread
    """Milliseconds a camera: depth (if there are occluders to render) and pyramid, cull and mask; the quartiles are
    those of cull and mask."""
    cull_ms: Spread
    """Of the cull alone."""
    kept: int
    """Instances that it keeps, over all cameras."""
    on_front: bool
    """Whether no other candidate is better in time or in what is kept, and no worse in the other."""

    @property
    def volume(self) -> str:
        """Which bounds: ``"spheres"``, ``"boxes"`` or ``"oriented_boxes"``."""
        return self.configuration.volume

    @property
    def cull_options(self) -> dict[str, Any]:
        """Keyword arguments for `Device.cull`."""
        return self.configuration.cull_options()

    def render_options(self, size: Size) -> dict[str, Any]:
        """Keyword arguments for `Device.render_depth` with a camera of `size`."""
        return render_options(self.configuration.depth, size)

    def __str__(self) -> str:
        return str(self.configuration)


@dataclass(frozen=True, eq=False)
class Recommendation:
    """What `recommend` found; ``print`` shows it as a table."""

    best: Candidate
    """What to use."""
    within_budget: bool
    """False if no candidate is within ``max_ms``; `best` is the fastest one then."""
    candidates: tuple[Candidate, ...]
    """All of them, the fastest first."""
    tested: int
    """Instances times cameras."""
    adapter: str
    """Where it was measured; another device may have another order."""

    @property
    def front(self) -> tuple[Candidate, ...]:
        """The Pareto front of time and instances kept, the fastest first."""
        return tuple(one for one in self.candidates if one.on_front)

    def __str__(self) -> str:
        lines = [f"on {self.adapter}: {self.best}" + ("" if self.within_budget else " (over the budget, as all are)")]
        lines.append("    ms a camera        kept   (* the Pareto front)")
        for one in self.candidates:
            share = 100.0 * one.kept / max(self.tested, 1)
            mark = "*" if one.on_front else " "
            lines.append(f"  {mark} {one.ms.median:11.2f}  {share:8.2f} %   {one}")
        return "\n".join(lines)


def choose(
    candidates: Sequence[Candidate], *, max_ms: float | None = None, kept_within: float = 1.05
) -> tuple[Candidate, bool]:
    """The candidate to use, and whether it is within the budget.

    Of those within `max_ms`, the fastest that keeps at most `kept_within` times what the least of them keeps. If none
    is within it, the fastest of all.
    """
    able = [one for one in candidates if max_ms is None or one.ms.median <= max_ms]
    if not able:
        return min(candidates, key=lambda one: one.ms.median), False
    limit = kept_within * min(one.kept for one in able)
    return min((one for one in able if one.kept <= limit), key=lambda one: one.ms.median), True


def recommend(
    bounds: Bounds | Instances | Sequence[Bounds | Instances],
    cameras: Camera | Sequence[Camera],
    *,
    occluders: Occluders | Mesh | Sequence[Mesh] | None = None,
    depths: Sequence[npt.ArrayLike] | None = None,
    kind: DepthKind | None = None,
    scale: float = 1.0,
    invalid: Collection[float] | None = None,
    device: Device | None = None,
    coverage: Coverage = "area",
    max_ms: float | None = None,
    kept_within: float = 1.05,
    repetitions: int = 5,
) -> Recommendation:
    """Measures configurations on a scene of one's own, and recommends one.

    Every candidate keeps the promise for the pixels of the cameras given; they differ in speed and in how much that is
    hidden they keep. It takes seconds: each candidate culls `repetitions` times for each camera.

    Parameters
    ----------
    bounds : Spheres, Boxes, OrientedBoxes or Instances; or a sequence of them
        The N instances; several kinds of bounds of the same instances are compared with one another.
    cameras : Camera or sequence of Camera
        Typical views.
    occluders : Occluders, Mesh or sequence of Mesh
        What hides; rendering is part of the time then, and smaller conservative depth images are among the candidates.
    depths : sequence of (height, width) arrays
        Instead of `occluders`: the depth image of each camera.
    kind, scale, invalid
        What the numbers of `depths` are, as in `Device.pyramid`.
    device : Device, optional
        None: that of the occluders or instances, else one that is made at the first call and kept.
    coverage : "area" or "sample"
        What the caller's renderer needs, as in `Device.cull`; it is not varied, for it changes the promise.
    max_ms : float, optional
        Budget for each camera in milliseconds.
    kept_within : float
        How much more than the least may be kept for the sake of speed: 1.05 is 5 %, 1 takes what keeps least.
    repetitions : int
        How often each is timed, beside the first call.

    Returns
    -------
    Recommendation
        `Recommendation.best` has the options; the whole front is there to choose otherwise.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    hizvk.HizError
        What the device refuses.

    Examples
    --------
    >>> found = hizvk.recommend([boxes, spheres], cameras, occluders=walls, max_ms=2.0)  # doctest: +SKIP
    >>> seen = device.cull(crowd, camera, hiz, **found.best.cull_options)  # doctest: +SKIP
    """
    alternatives = _alternatives(bounds)
    views = _cameras(cameras)
    if (occluders is None) == (depths is None):
        got = "neither" if occluders is None else "both"
        raise TypeError(f"occluders, depths: expected exactly one of them, got {got}")
    coverage = _arguments.choice("coverage", coverage, ("area", "sample"))  # type: ignore[assignment]
    if max_ms is not None:
        max_ms = _arguments.number("max_ms", max_ms, above=0.0)
    kept_within = _arguments.number("kept_within", kept_within, at_least=1.0)
    repetitions = _arguments.integer("repetitions", repetitions, low=1, high=10_000)
    if device is not None:
        _arguments.instance("device", device, Device, "a Device or None")
    images = None if depths is None else _images(depths, views, kind, scale, invalid)
    for name, value in (("kind", kind), ("invalid", invalid)):
        if depths is None and value is not None:
            raise TypeError(f"{name}: expected nothing beside occluders, got {_arguments.describe(value)}")
    device = device or _device_of(occluders, alternatives) or default_device()
    walls = None if occluders is None else _occluders(occluders, device)
    volumes = {name: _upload(one, device) for name, one in alternatives.items()}

    chosen = promised(tuple(volumes), coverage, smaller=walls is not None)
    variants = sorted({one.depth for one in chosen}, key=DepthVariant.cost)
    # The first repetition compiles, and is dropped.
    depth_ms = {variant: np.zeros((repetitions + 1, len(views))) for variant in variants}
    culling, reading = np.zeros((2, len(chosen), repetitions + 1, len(views)))
    kept = np.zeros(len(chosen), np.int64)
    for repetition in range(repetitions + 1):
        for k, camera in enumerate(views):
            made: dict[DepthVariant, Pyramid] = {}
            for variant in variants:
                if walls is not None:
                    _, pyramid, *took = rendered(device, walls, camera, variant)
                else:
                    assert images is not None
                    watch = Stopwatch(device)
                    image, kind_, scale_, invalid_ = images[k]
                    pyramid = device.pyramid(image, camera, kind=kind_, scale=scale_, invalid=invalid_)
                    took = [watch.lap()]
                made[variant] = pyramid
                depth_ms[variant][repetition, k] = sum(took)
            for turn in range(len(chosen)):
                number = (turn + repetition * len(chosen) // (repetitions + 1) + k) % len(chosen)
                one = chosen[number]
                mask, *both = cull(device, volumes[one.volume], made[one.depth], one)
                culling[number, repetition, k], reading[number, repetition, k] = both
                kept[number] += int(mask.sum()) if repetition == 0 else 0
    shared = {variant: spread(ms[1:]).median for variant, ms in depth_ms.items()}
    total = [spread(culling[k, 1:] + reading[k, 1:], plus=shared[one.depth]) for k, one in enumerate(chosen)]
    best = front([ms.median for ms in total], kept)
    candidates = [
        Candidate(one, total[k], spread(culling[k, 1:]), int(kept[k]), bool(best[k])) for k, one in enumerate(chosen)
    ]
    candidates.sort(key=lambda one: one.ms.median)
    picked, within = choose(candidates, max_ms=max_ms, kept_within=kept_within)
    tested = len(next(iter(volumes.values()))) * len(views)
    return Recommendation(picked, within, tuple(candidates), tested, str(device.adapter))


def _alternatives(bounds: Any) -> dict[str, Bounds | Instances]:
    """By kind: the bounds that came."""
    expected = "Spheres, Boxes, OrientedBoxes, Instances or a sequence of them"
    given = bounds if isinstance(bounds, Sequence) and not isinstance(bounds, str) else [bounds]
    found: dict[str, Bounds | Instances] = {}
    for one in given:
        if isinstance(one, Instances):
            name = one.kind
        else:
            names = [name for name, volume in KINDS.items() if isinstance(one, volume)]
            if not names:
                raise TypeError(f"bounds: expected {expected}, got {_arguments.describe(one)}")
            name = names[0]
        if name in found:
            raise ValueError(f"bounds: expected each kind once, got {name} twice")
        found[name] = one
    if not found:
        raise ValueError(f"bounds: expected {expected}, got an empty sequence")
    counts = {len(one) for one in found.values()}
    if len(counts) > 1:
        raise ValueError(f"bounds: expected the same instances in each kind, got {sorted(counts)} of them")
    return found


def _cameras(cameras: Any) -> list[Camera]:
    expected = "a Camera or a sequence of Camera"
    found = [cameras] if isinstance(cameras, Camera) else cameras
    if not isinstance(found, Sequence) or isinstance(found, str):
        raise TypeError(f"cameras: expected {expected}, got {_arguments.describe(cameras)}")
    if not found:
        raise ValueError(f"cameras: expected {expected}, got an empty sequence")
    for one in found:
        _arguments.instance("cameras", one, Camera, expected)
    return list(found)


def _images(depths: Any, cameras: list[Camera], kind: Any, scale: Any, invalid: Any) -> list[DepthArray]:
    if not isinstance(depths, (Sequence, np.ndarray)) or isinstance(depths, str):
        raise TypeError(f"depths: expected a sequence of (height, width) arrays, got {_arguments.describe(depths)}")
    if len(depths) != len(cameras):
        raise ValueError(f"depths: expected {len(cameras)} images, one for each camera, got {len(depths)}")
    return [
        checked_image("depths", image, camera, kind, scale, invalid)
        for image, camera in zip(depths, cameras, strict=True)
    ]


def _device_of(occluders: object, alternatives: dict[str, Any]) -> Device | None:
    """The device on which something lies already."""
    for thing in (occluders, *alternatives.values()):
        if isinstance(thing, (Occluders, Instances)):
            return thing.device
    return None


def _occluders(occluders: Any, device: Device) -> Occluders:
    if isinstance(occluders, Occluders):
        if occluders.device is not device:
            raise ValueError("occluders: expected Occluders of this device, got one of another Device")
        return occluders
    meshes = [occluders] if isinstance(occluders, Mesh) else occluders
    if not isinstance(meshes, Sequence) or not all(isinstance(mesh, Mesh) for mesh in meshes):
        got = _arguments.describe(occluders)
        raise TypeError(f"occluders: expected Occluders, a Mesh or a sequence of Mesh, got {got}")
    return device.occluders(list(meshes))


def _upload(bounds: Bounds | Instances, device: Device) -> Instances:
    if not isinstance(bounds, Instances):
        return device.instances(bounds)
    if bounds.device is not device:
        raise ValueError("bounds: expected Instances of this device, got one of another Device")
    return bounds
