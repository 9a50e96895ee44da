"""Measures the caller's own scene, checks what would be lost there, and says which configuration to use.

Some candidates are proven for every ray, others for the pixels of one image alone.
So each is held against what can be seen (`checking`), and one that hides something is never
recommended.
Of the others, the one that keeps less is right more often.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from .. import _arguments
from ..bounds import Boxes, OrientedBoxes, Spheres, are_points
from ..camera import Camera
from ..depth import DepthArray, checked_image
from ..device import Device, maker_of
from ..mesh import A_MESH, meshes_of
from ..oneline import default_device
from ..options import CullOptions, cull_options
from ..resources import DepthImage, Instances, Occluders
from . import checking
from .configurations import Configuration, DepthVariant, promised, render_options
from .pareto import front
from .results import Spread, spread
from .stages import Stopwatch, cull

if TYPE_CHECKING:
    from typing import Unpack

    import numpy.typing as npt

    from .._arguments import Size
    from .._types import DepthKind
    from ..bounds import Bounds
    from ..mesh import MeshLike
    from ..options import OptionKeywords
    from ..resources import Pyramid
    from ..result import CullResult

__all__ = ["Candidate", "Recommendation", "choose", "recommend"]

KINDS: Final = {"spheres": Spheres, "boxes": Boxes, "oriented_boxes": OrientedBoxes}
#: A depth image that takes longer than this is not rendered again.
DEAR_MS: Final = 200.0


@dataclass(frozen=True)
class Candidate:
    """One configuration, measured on the caller's scene.

    It holds all that the call needs: `bounds`, `render_options`, `pyramid_options`, `cull_options`;
    or `cull` does it.
    """

    configuration: Configuration
    ms: Spread
    """Milliseconds a camera: depth (if there are occluders to render) and pyramid, cull and mask; the quartiles are
    those of cull and mask."""
    cull_ms: Spread
    """Of the cull alone."""
    kept: int
    """Instances that it keeps, over all cameras."""
    on_front: bool
    """Whether no other candidate is better in time or in what is kept, and no worse in the other. Only candidates that
    may be recommended take part."""
    hides: int = 0
    """Instances that it culls and that the check found visible, over all cameras."""
    unclear: int = 0
    """Instances that it culls and that are neither proven to be hidden nor found visible, over all cameras."""
    proven: bool = True
    """Whether what was asked is proven of it for other cameras, too: for every ray (conservative depth, area coverage),
    or for the pixels of an image as given."""
    asked: bool = True
    """False for what is shown for comparison alone: sample coverage, where every ray counts."""
    bounds: Bounds | Instances | None = field(default=None, repr=False, compare=False)
    """What `recommend` was given of this kind: pass it to `Device.instances`, if it is not uploaded already."""
    options: CullOptions = field(default=CullOptions(), repr=False)
    """How it culls: pass it to `Device.cull`."""

    @property
    def safe(self) -> bool:
        """Whether it may be recommended: all that it culls before the cameras given is hidden, of what was asked."""
        return self.asked and not self.hides and not self.unclear

    @property
    def volume(self) -> str:
        """Which bounds: ``"spheres"``, ``"boxes"`` or ``"oriented_boxes"``."""
        return self.configuration.volume

    @property
    def cull_options(self) -> dict[str, Any]:
        """`options` as keyword arguments for `Device.cull`."""
        return asdict(self.options)

    @property
    def pyramid_options(self) -> dict[str, Any]:
        """Keyword arguments for `Device.pyramid`, beside the image and what its numbers are."""
        levels = self.configuration.depth.levels
        return {} if levels is None else {"levels": levels}

    def render_options(self, size: Size) -> dict[str, Any]:
        """Keyword arguments for `Device.render_depth` with a camera of `size`."""
        return render_options(self.configuration.depth, size)

    def cull(
        self,
        instances: Instances,
        camera: Camera,
        occluders: Occluders | None = None,
        *,
        depth: DepthImage | npt.ArrayLike | None = None,
        **depth_options: Any,
    ) -> CullResult:
        """The whole call: depth from the occluders (or as given), pyramid, cull.

        Parameters
        ----------
        instances : Instances
            Of the kind `volume`.
        camera : Camera
            The view, in the size of the large image.
        occluders : Occluders
            Of the same device.
        depth : DepthImage or (height, width) array
            Instead of `occluders`; a candidate that renders depth of its own cannot take it.
        **depth_options
            ``kind`` and ``scale`` of an array, as in `Device.pyramid`.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        _arguments.instance("instances", instances, Instances, "Instances of Device.instances")
        if instances.kind != self.volume:
            raise ValueError(f"instances: expected {self.volume}, got {instances.kind}")
        if (occluders is None) == (depth is None):
            got = "neither" if occluders is None else "both"
            raise TypeError(f"occluders, depth: expected exactly one of them, got {got}")
        device = maker_of(instances)
        if occluders is not None:
            depth = device.render_depth(occluders, camera, **self.render_options(camera.size))
        elif render_options(self.configuration.depth, camera.size):
            got = _arguments.describe(depth)
            raise TypeError(
                f"depth: expected occluders instead, for {self.configuration.depth}, got {got}"
            )
        if isinstance(depth, DepthImage):
            pyramid = device.pyramid(depth, **self.pyramid_options)
        else:
            pyramid = device.pyramid(depth, camera, **depth_options, **self.pyramid_options)  # type: ignore[arg-type]
        return device.cull(instances, pyramid.camera, pyramid, self.options)

    def __str__(self) -> str:
        return str(self.configuration)


@dataclass(frozen=True, eq=False)
class Recommendation:
    """What `recommend` found; ``print`` shows it as a table."""

    best: Candidate
    """What to use. It is `Candidate.safe`."""
    within_budget: bool
    """False if no candidate that may be recommended is within ``max_ms``; `best` is the fastest of them then."""
    candidates: tuple[Candidate, ...]
    """All of them, the fastest first."""
    tested: int
    """Instances times cameras."""
    adapter: str
    """Where it was measured; another device may have another order."""
    check: str = ""
    """How candidates were checked, and how much of what they cull was looked at."""
    notes: tuple[str, ...] = ()
    """What to know about it: why candidates were dropped, and what is proven of the best."""

    @property
    def front(self) -> tuple[Candidate, ...]:
        """The Pareto front of time and instances kept, the fastest first."""
        return tuple(one for one in self.candidates if one.on_front)

    def __str__(self) -> str:
        over = (
            "" if self.within_budget else " (over the budget, as all are that may be recommended)"
        )
        lines = [f"on {self.adapter}: {self.best}{over}"]
        lines.append(
            "    ms a camera        kept     hides   unclear   (* the Pareto front; - not for what was asked)"
        )
        for one in self.candidates:
            share = 100.0 * one.kept / max(self.tested, 1)
            mark = "*" if one.on_front else " " if one.asked else "-"
            lines.append(
                f"  {mark} {one.ms.median:11.2f}  {share:8.2f} %  {one.hides:8,}  {one.unclear:8,}   {one}"
            )
        lines += [f"checked by {self.check}"] if self.check else []
        return "\n".join([*lines, *self.notes])


def choose(
    candidates: Sequence[Candidate], *, max_ms: float | None = None, kept_within: float = 1.05
) -> tuple[Candidate, bool]:
    """The candidate to use, and whether it is within the budget.

    Only those that are `Candidate.safe` count.
    Of those within `max_ms`, the fastest that keeps at most `kept_within` times what the least of
    them keeps.
    If none is within it, the fastest of all.

    Raises
    ------
    ValueError
        If no candidate is safe.
    """
    safe = [one for one in candidates if one.safe]
    if not safe:
        raise ValueError(
            "candidates: expected one that hides nothing that was found visible, got none"
        )
    able = [one for one in safe if max_ms is None or one.ms.median <= max_ms]
    if not able:
        return min(safe, key=lambda one: one.ms.median), False
    limit = kept_within * min(one.kept for one in able)
    return min((one for one in able if one.kept <= limit), key=lambda one: one.ms.median), True


def recommend(
    bounds: Bounds | Instances | Sequence[Bounds | Instances],
    cameras: Camera | Sequence[Camera],
    *,
    occluders: Occluders | MeshLike | Sequence[MeshLike] | None = None,
    depths: Sequence[npt.ArrayLike] | None = None,
    kind: DepthKind | None = None,
    scale: float = 1.0,
    invalid: Collection[float] | None = None,
    device: Device | None = None,
    options: CullOptions | None = None,
    max_ms: float | None = None,
    kept_within: float = 1.05,
    repetitions: int = 5,
    **keywords: Unpack[OptionKeywords],
) -> Recommendation:
    """Measures configurations on a scene of one's own, checks them there, and recommends one.

    Candidates differ in speed, in how much that is hidden they keep, and in what is proven of them.
    Conservative depth with area coverage is proven for every ray.
    A plain depth image knows the depth at its pixels' centres alone: what shows between them may be
    culled, and so may points that lie on their own occluder.
    So each candidate is checked on the cameras given, and **one that hides what the check finds
    visible, or cannot show to be hidden, is never recommended**.

    What conservative depth hides is hidden.
    What a candidate culls beyond that is looked at by rays in float64 at the occluders' triangles,
    from the camera to the bounds: to a bare point itself, else to 27 points of a volume, as many as
    60,000 rays for each camera and kind of bounds.
    What they find visible is visible (`Candidate.hides`).
    The rest is unclear (`Candidate.unclear`), but for points, of which a ray decides either.
    So a plain image that is recommended is right before the cameras given; before others, only
    conservative depth is proven.

    With `depths`, or where ``coverage="sample"``, the promise is about the image as it is.
    The exact oracle (`hizvk.reference`) takes the rays' place then, for 400 instances (10,800 bare
    points) each.
    Bare points before given depth mostly lie on what it shows.
    Those that only a guard of half a pixel keeps count as visible, for the image cannot tell; that
    guard is a good guess, and no proof.

    It takes seconds to minutes: each candidate culls `repetitions` times for each camera, and
    conservative depth of the full size is dear where there are many triangles.

    Parameters
    ----------
    bounds : Spheres, Boxes, OrientedBoxes or Instances; or a sequence of them
        The N instances; several kinds of bounds of the same instances are compared with one
        another.
        Of `Instances` the host knows no numbers, so no rays are cast: what conservative depth does
        not hide stays unclear.
    cameras : Camera or sequence of Camera
        Typical views.
    occluders : Occluders, Mesh, a mesh of trimesh or Open3D, or a sequence of meshes
        What hides; rendering is part of the time then, and conservative depth images, small ones
        too, are among the candidates.
    depths : sequence of (height, width) arrays
        Instead of `occluders`: the depth image of each camera.
    kind, scale, invalid
        What the numbers of `depths` are, as in `Device.pyramid`.
    device : Device, optional
        None: that of the occluders or instances, else one that is made at the first call and kept.
    options : CullOptions, optional
        What every candidate has in common; None takes the defaults.
        ``footprint``, ``descent``, ``fit`` and ``order`` are what candidates differ in, so theirs
        take the place of those given.

        ``coverage`` says what counts as seen.
        With ``"area"`` it is what any ray of the view meets, as for multisampling, jitter, larger
        images, and points.
        Candidates of sample coverage are then shown for comparison, and never recommended.
        With ``"sample"`` it is what covers the centre of a pixel: right for a renderer with one
        sample per pixel, the same viewport and no jitter.
        Plain depth is proven for that.
    max_ms : float, optional
        Budget for each camera in milliseconds.
    kept_within : float
        How much more than the least may be kept for the sake of speed: 1.05 is 5 %, 1 takes what
        keeps least.
    repetitions : int
        How often each is timed, beside the first call.
    **keywords
        Any field of `CullOptions`, in the place of that of `options`.

    Returns
    -------
    Recommendation
        `Recommendation.best` has the options, and the whole call (`Candidate.cull`); the whole
        front is there to choose otherwise, `Recommendation.notes` say what to know.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    hizvk.HizError
        What the device refuses.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> centers = np.array([[0.0, 0.0, -5.0], [0.0, 0.0, -20.0]])
    >>> boxes = hizvk.Boxes(centers - 0.5, centers + 0.5)
    >>> wall = hizvk.Mesh([[-8.0, -8, -12], [8.0, -8, -12], [0.0, 8, -12]], [[0, 1, 2]])
    >>> camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(90, 160), near=0.1)
    >>> found = hizvk.recommend(boxes, camera, occluders=wall, repetitions=1)
    >>> found.best.kept, found.tested
    (1, 2)
    >>> device = hizvk.Device()
    >>> crowd, walls = device.instances(found.best.bounds), device.occluders(wall)
    >>> found.best.cull(crowd, camera, walls).mask.tolist()
    [True, False]
    """
    alternatives = _alternatives(bounds)
    views = _cameras(cameras)
    if (occluders is None) == (depths is None):
        got = "neither" if occluders is None else "both"
        raise TypeError(f"occluders, depths: expected exactly one of them, got {got}")
    options = cull_options(options, keywords)
    coverage = options.coverage
    if max_ms is not None:
        max_ms = _arguments.number("max_ms", max_ms, above=0.0)
    kept_within = _arguments.number("kept_within", kept_within, at_least=1.0)
    repetitions = _arguments.integer("repetitions", repetitions, low=1, high=10_000)
    if device is not None:
        _arguments.instance("device", device, Device, "a Device or None")
    images = None if depths is None else _images(depths, views, kind, scale, invalid)
    for name, value in (("kind", kind), ("invalid", invalid)):
        if depths is None and value is not None:
            raise TypeError(
                f"{name}: expected nothing beside occluders, got {_arguments.describe(value)}"
            )
    if depths is None and _arguments.number("scale", scale, above=0.0) != 1.0:
        raise ValueError(f"scale: expected 1 beside occluders, got {scale:g}")
    device = device or _device_of(occluders, alternatives) or default_device()
    walls = None if occluders is None else _occluders(occluders, device)
    volumes = {name: _upload(one, device) for name, one in alternatives.items()}
    points = any(
        one._points if isinstance(one, Instances) else are_points(one)
        for one in alternatives.values()
    )

    chosen = promised(tuple(volumes), coverage, rendered=walls is not None, points=points)
    variants = sorted({one.depth for one in chosen}, key=DepthVariant.cost)
    source = _Source(device, walls, views, images)
    # The first repetition compiles, and is dropped.
    depth_ms = {variant: np.zeros((repetitions + 1, len(views))) for variant in variants}
    culling, reading = np.zeros((2, len(chosen), repetitions + 1, len(views)))
    masks: list[list[npt.NDArray[np.bool_]]] = [[] for _ in chosen]
    for repetition in range(repetitions + 1):
        for k in range(len(views)):
            made = source.pyramids(variants, k)
            for variant, (_, took) in made.items():
                depth_ms[variant][repetition, k] = took
            for turn in range(len(chosen)):
                number = (turn + repetition * len(chosen) // (repetitions + 1) + k) % len(chosen)
                one = chosen[number]
                mask, *both = cull(device, volumes[one.volume], made[one.depth][0], one, options)
                culling[number, repetition, k], reading[number, repetition, k] = both
                if repetition == 0:
                    masks[number].append(mask)
    every_ray = walls is not None and coverage == "area"
    tool = (
        checking.by_rays(walls, views)
        if walls is not None and every_ray
        else checking.by_oracle(source.full_image, views, coverage)
    )
    check = checking.hold(chosen, masks, alternatives, tool, every_ray=every_ray)
    shared = {variant: spread(ms[1:]).median for variant, ms in depth_ms.items()}
    total = [
        spread(culling[k, 1:] + reading[k, 1:], plus=shared[one.depth])
        for k, one in enumerate(chosen)
    ]
    kept = [sum(int(mask.sum()) for mask in of_one) for of_one in masks]
    candidates = [
        Candidate(
            one, total[k], spread(culling[k, 1:]), kept[k], False, check.hides[k], check.unclear[k],
            proven=one.promises_rays or not every_ray, asked=coverage == "sample" or one.coverage == "area",
            bounds=alternatives[one.volume], options=one.options(options),
        )
        for k, one in enumerate(chosen)
    ]  # fmt: skip
    best = front([one.ms.median for one in candidates], kept, [one.safe for one in candidates])
    candidates = [replace(one, on_front=bool(on)) for one, on in zip(candidates, best, strict=True)]
    candidates.sort(key=lambda one: one.ms.median)
    picked, within = choose(candidates, max_ms=max_ms, kept_within=kept_within)
    tested = len(next(iter(volumes.values()))) * len(views)
    looked = f"{check.method}: {check.looked:,} of {check.culled:,} that some candidate culls, {check.visible:,} visible"
    notes = _notes(
        candidates, picked, check, coverage=coverage, points=points, rendered=walls is not None
    )
    return Recommendation(
        picked, within, tuple(candidates), tested, str(device.adapter), looked, notes
    )


class _Source:
    """Where depth comes from: occluders that are rendered, or the images that were given."""

    def __init__(
        self,
        device: Device,
        walls: Occluders | None,
        views: list[Camera],
        images: list[DepthArray] | None,
    ) -> None:
        self._device, self._walls, self._views, self._images = device, walls, views, images
        self._turn: dict[tuple[int, bool], tuple[DepthImage, float]] = {}
        self._dear: dict[tuple[int, bool, int], tuple[DepthImage, float]] = {}

    def pyramids(
        self, variants: list[DepthVariant], k: int
    ) -> dict[DepthVariant, tuple[Pyramid, float]]:
        """The pyramids of view k, each with the milliseconds that it and its image take."""
        self._turn.clear()
        return {variant: self._pyramid(variant, k) for variant in variants}

    def full_image(self, k: int) -> DepthArray:
        """The image of view k in full size with what its numbers are: the one given, or the plain one."""
        if self._images is not None:
            return self._images[k]
        assert self._walls is not None
        depth = self._device.render_depth(self._walls, self._views[k])
        return DepthArray(depth.numpy(), depth.kind, 1.0, (), "none")

    def _pyramid(self, variant: DepthVariant, k: int) -> tuple[Pyramid, float]:
        if self._images is not None:
            watch = Stopwatch(self._device)
            pyramid = self._device._pyramid_of(
                self._images[k], self._views[k], _arguments.stored_levels("levels", variant.levels)
            )
            return pyramid, watch.lap()
        depth, took = self._depth(variant, k)
        watch = Stopwatch(self._device)
        return self._device.pyramid(depth, levels=variant.levels), took + watch.lap()

    def _depth(self, variant: DepthVariant, k: int) -> tuple[DepthImage, float]:
        """The image, rendered once a turn, and not again if it is dear."""
        assert self._walls is not None
        key = variant.divisor, variant.conservative
        if key not in self._turn and (*key, k) in self._dear:
            self._turn[key] = self._dear[*key, k]
        if key not in self._turn:
            watch = Stopwatch(self._device)
            camera = self._views[k]
            depth = self._device.render_depth(
                self._walls, camera, **render_options(variant, camera.size)
            )
            self._turn[key] = depth, watch.lap()
            if self._turn[key][1] > DEAR_MS:
                self._dear[*key, k] = self._turn[key]
        return self._turn[key]


def _notes(
    candidates: list[Candidate],
    best: Candidate,
    check: checking.Check,
    *,
    coverage: str,
    points: bool,
    rendered: bool,
) -> tuple[str, ...]:
    """What to know about a recommendation, a sentence or two each."""
    notes = []
    dropped = [one for one in candidates if one.asked and not one.safe]
    if dropped:
        asked = sum(one.asked for one in candidates)
        lost, unclear = max(one.hides for one in dropped), max(one.unclear for one in dropped)
        what = (
            [f"hide up to {lost:,} of the {check.visible:,} that the check found visible"]
            if lost
            else []
        )
        what += [f"cull up to {unclear:,} that are not shown to be hidden"] if unclear else []
        why = ""
        if rendered and coverage == "area":
            why = " Plain depth knows the depth at its pixels' centres alone."
        elif points:
            why = " The image knows the depth at its pixels' centres alone, and points lie on what it shows."
        notes.append(
            f"{len(dropped)} of {asked} candidates were dropped: they {', and '.join(what)}.{why}"
        )
    if best.configuration.guard_px:
        notes.append(
            "A guard of half a pixel is a good guess for points before an image, and no proof."
        )
    if not best.proven:
        notes.append(
            "The best is right before the cameras given: all that it culls there is hidden. Before other cameras, only "
            "conservative depth is proven for what shows between the pixels' centres."
        )
    if rendered and coverage == "area" and not points:  # points cover no pixel's centre
        notes.append(
            'If your image has one sample a pixel, at its centre and without jitter, ask with coverage="sample": plain '
            "depth of the full size is proven for that."
        )
    if not rendered and coverage == "area":
        notes.append(
            "It is right for the images as they are. With multisampling or jitter, a pixel has to hold the farthest "
            "depth of all its samples."
        )
    if points and coverage == "sample":
        notes.append('Points cover no pixel centre, so all are culled: ask with coverage="area".')
    return tuple(notes)


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
        raise ValueError(
            f"bounds: expected the same instances in each kind, got {sorted(counts)} of them"
        )
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


def _images(
    depths: Any, cameras: list[Camera], kind: Any, scale: Any, invalid: Any
) -> list[DepthArray]:
    if not isinstance(depths, (Sequence, np.ndarray)) or isinstance(depths, str):
        raise TypeError(
            f"depths: expected a sequence of (height, width) arrays, got {_arguments.describe(depths)}"
        )
    if len(depths) != len(cameras):
        raise ValueError(
            f"depths: expected {len(cameras)} images, one for each camera, got {len(depths)}"
        )
    return [
        checked_image("depths", image, camera, kind, scale, invalid)
        for image, camera in zip(depths, cameras, strict=True)
    ]


def _device_of(occluders: object, alternatives: dict[str, Any]) -> Device | None:
    """The device on which something lies already."""
    for thing in (occluders, *alternatives.values()):
        if isinstance(thing, (Occluders, Instances)):
            return maker_of(thing)
    return None


def _occluders(occluders: Any, device: Device) -> Occluders:
    if isinstance(occluders, Occluders):
        if occluders.device is not device:
            raise ValueError(
                "occluders: expected Occluders of this device, got one of another Device"
            )
        return occluders
    return device.occluders(
        meshes_of("occluders", occluders, f"Occluders, {A_MESH}, or a sequence of them")
    )


def _upload(bounds: Bounds | Instances, device: Device) -> Instances:
    if not isinstance(bounds, Instances):
        return device.instances(bounds)
    if bounds.device is not device:
        raise ValueError("bounds: expected Instances of this device, got one of another Device")
    return bounds
