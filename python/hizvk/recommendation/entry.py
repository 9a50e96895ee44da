"""`recommend`: from the caller's scene to one configuration."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from .. import _arguments
from ..bounds import are_points
from ..device import Device
from ..measuring.pareto import front
from ..measuring.spread import spread
from ..oneline import default_device
from ..options import cull_options
from ..progress import Progress, check_progress
from ..resources import Instances
from . import checking
from .answer import Recommendation, notes_on
from .arguments import alternatives_of, cameras_of, device_of, images_of, occluders_on, upload
from .candidate import Candidate, choose
from .timing import DepthSource, number_of_steps, time_all
from .tried import promised

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence
    from typing import Unpack

    import numpy.typing as npt

    from .._types import DepthKind
    from ..bounds import Bounds
    from ..camera import Camera
    from ..mesh import MeshLike
    from ..options import CullOptions, OptionKeywords
    from ..progress import ProgressLike
    from ..resources import Occluders

__all__ = ["recommend"]


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
    progress: ProgressLike = None,
    **keywords: Unpack[OptionKeywords],
) -> Recommendation:
    """Measures configurations on the caller's scene, checks them there, and recommends one.

    Candidates differ in speed, in how many hidden instances they keep, and in what is proven of
    them.
    Conservative depth with area coverage is proven for every ray.
    A plain depth image knows the depth only at its pixels' centres.
    What shows between them may be culled, and so may points that lie on their own occluder.
    So each candidate is checked before the cameras given, and **one that hides what the check finds
    visible, or cannot show to be hidden, is never recommended**.

    What conservative depth hides is hidden.
    Whatever else a candidate culls is checked by rays in float64, from the camera to the bounds, at
    the occluders' triangles.
    A bare point gets one ray, to the point itself; a volume gets rays to 27 of its points.
    At most 60,000 rays are cast for each camera and kind of bounds.
    What they find visible is visible (`Candidate.hides`).
    The rest is unclear (`Candidate.unclear`), except for points, where a ray decides either way.
    So a plain image that is recommended is right before the cameras given.
    Before other cameras, only conservative depth is proven.

    With `depths`, or with ``coverage="sample"``, the promise is about the image as it is.
    Then the exact oracle (`hizvk.reference`) takes the rays' place, for 400 instances or 10,800
    bare points of each camera and kind.
    Bare points before a given depth image mostly lie on what it shows, so the image cannot tell
    whether they are hidden.
    Those that only a guard of half a pixel keeps count as visible; that guard is a good guess and
    no proof.

    It takes seconds to minutes.
    Each candidate culls `repetitions` times for each camera, and conservative depth of the full
    size is slow where there are many triangles.

    Parameters
    ----------
    bounds : Spheres, Boxes, OrientedBoxes, Points or Instances; or a sequence of them
        The N instances.
        Several kinds of bounds of the same instances are compared with one another.
        The host knows no numbers of `Instances`, so no rays are cast at them: what conservative
        depth does not hide stays unclear.
    cameras : Camera or sequence of Camera
        Typical views.
    occluders : Occluders, Mesh, a mesh of trimesh, Open3D or PyVista, or a sequence of meshes
        What hides.
        Then rendering is part of the time, and conservative depth images, small ones too, are among
        the candidates.
    depths : sequence of (height, width) arrays
        Instead of `occluders`: the depth image of each camera.
    kind, scale, invalid
        What the numbers of `depths` are, as in `Device.pyramid`.
    device : Device, optional
        None: that of the occluders or instances, else one that is made at the first call and kept.
    options : CullOptions, optional
        What every candidate has in common; None takes the defaults.
        Candidates differ in ``footprint``, ``descent``, ``fit`` and ``order``, so theirs take the
        place of those given.

        ``coverage`` says what counts as seen.
        ``"area"``: what any ray of the view meets.
        It is right for multisampling, jitter, larger images, and points.
        Then candidates of sample coverage are shown for comparison and never recommended.
        ``"sample"``: what covers a pixel's centre.
        It is right for a renderer with one sample per pixel, the same viewport and no jitter.
        Plain depth is proven for that.
    max_ms : float, optional
        Budget for each camera in milliseconds.
    kept_within : float
        How much more than the least may be kept for the sake of speed: 1.05 allows 5 %, and 1 takes
        the candidate that keeps least.
    repetitions : int
        How often each is timed, beside the first call.
    progress : bool or function, optional
        As everywhere (`hizvk.progress`); a step is a cull, a depth image or a check.
    **keywords
        Any field of `CullOptions`, in the place of that of `options`.

    Returns
    -------
    Recommendation
        `Recommendation.best` has the options and makes the whole call (`Candidate.cull`).
        `Recommendation.front` has the alternatives, `Recommendation.notes` what to know.

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
    alternatives = alternatives_of(bounds)
    views = cameras_of(cameras)
    if (occluders is None) == (depths is None):
        got = "neither" if occluders is None else "both"
        raise TypeError(f"occluders, depths: expected exactly one of them, got {got}")
    options = cull_options(options, keywords)
    coverage = options.coverage
    if max_ms is not None:
        max_ms = _arguments.number("max_ms", max_ms, above=0.0)
    kept_within = _arguments.number("kept_within", kept_within, at_least=1.0)
    repetitions = _arguments.integer("repetitions", repetitions, low=1, high=10_000)
    check_progress(progress)
    if device is not None:
        _arguments.instance("device", device, Device, "a Device or None")
    images = None if depths is None else images_of(depths, views, kind, scale, invalid)
    for name, value in (("kind", kind), ("invalid", invalid)):
        if depths is None and value is not None:
            got = _arguments.describe(value)
            raise TypeError(f"{name}: expected nothing beside occluders, got {got}")
    if depths is None and _arguments.number("scale", scale, above=0.0) != 1.0:
        raise ValueError(f"scale: expected 1 beside occluders, got {scale:g}")
    device = device or device_of(occluders, alternatives) or default_device()
    walls = None if occluders is None else occluders_on(device, occluders)
    volumes = {name: upload(one, device) for name, one in alternatives.items()}
    points = any(
        one._points if isinstance(one, Instances) else are_points(one)
        for one in alternatives.values()
    )

    chosen = promised(tuple(volumes), coverage, rendered=walls is not None, points=points)
    source = DepthSource(device, walls, views, images)
    every_ray = walls is not None and coverage == "area"
    if walls is not None and every_ray:
        judge = checking.by_rays(walls, views)
    else:
        judge = checking.by_oracle(source.full_image, views, coverage)
    total = number_of_steps(chosen, views, repetitions) + len(alternatives) * len(views)
    with Progress(progress, "trying candidates", total) as steps:
        times = time_all(chosen, volumes, source, repetitions, options, steps)
        check = checking.hold(
            chosen, times.masks, alternatives, judge, every_ray=every_ray, steps=steps
        )
    kept = [sum(int(mask.sum()) for mask in masks) for masks in times.masks]
    candidates = [
        Candidate(
            one,
            ms=times.total(k),
            cull_ms=spread(times.cull[k]),
            kept=kept[k],
            on_front=False,
            hides=check.hides[k],
            unclear=check.unclear[k],
            proven=one.promises_rays or not every_ray,
            asked=coverage == "sample" or one.coverage == "area",
            bounds=alternatives[one.volume],
            options=one.options(options),
        )
        for k, one in enumerate(chosen)
    ]
    best = front([one.ms.median for one in candidates], kept, [one.safe for one in candidates])
    candidates = [replace(one, on_front=bool(on)) for one, on in zip(candidates, best, strict=True)]
    candidates.sort(key=lambda one: one.ms.median)
    picked, within = choose(candidates, max_ms=max_ms, kept_within=kept_within)
    return Recommendation(
        best=picked,
        within_budget=within,
        candidates=tuple(candidates),
        tested=len(next(iter(volumes.values()))) * len(views),
        adapter=str(device.adapter),
        check=check.words(),
        notes=notes_on(
            candidates,
            picked,
            check,
            coverage=coverage,
            points=points,
            rendered=walls is not None,
        ),
    )
