"""`recommend`: from the caller's scene to one configuration."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Final

from .. import _arguments
from ..bounds import are_points
from ..device import Device
from ..oneline import default_device
from ..options import cull_options
from ..progress import Progress, check_progress
from ..resources import Instances
from . import checking
from .answer import Recommendation, notes_on
from .arguments import (
    alternatives_of,
    as_points,
    cameras_of,
    device_of,
    images_of,
    lods_of,
    occluders_on,
    selections_of,
    upload,
)
from .axes import Facts
from .search import Question, Search
from .timing import DepthSource
from .tried import promised

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence
    from typing import Unpack

    import numpy.typing as npt

    from .._types import DepthKind
    from ..bounds import Bounds
    from ..camera import Camera
    from ..lod import LodRule
    from ..mesh import MeshLike
    from ..options import CullOptions, MeshLods, OptionKeywords
    from ..progress import ProgressLike
    from ..resources import Occluders

__all__ = ["recommend"]

#: The part of the time that selecting occluders may take.
SELECTING: Final = 0.2


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
    meshes: Sequence[MeshLods] | None = None,
    mesh_ids: npt.ArrayLike | None = None,
    lods: Sequence[LodRule] | None = None,
    max_seconds: float | None = 120.0,
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

    Then one axis after the other is tried, each from the best so far:

    ================  =============================================================================
    points            `Points`, if the bounds are points of another kind
    rasteriser        the device's and the host's, for plain depth
    max_triangles     a half, an eighth and a 32nd of the triangles are drawn, for plain depth
    select_occluders  the meshes that `select_occluders` keeps, also with a quarter of the triangles
    depths            a pyramid of both ends, so that groups that surely show need no test
    hierarchy         flat, groups, and two or three tiers, as far as there are so many instances
    lod               the rules for levels of detail, if there are `meshes`
    ================  =============================================================================

    It takes seconds to minutes (`max_seconds`).
    Each candidate culls `repetitions` times for each camera, and conservative depth of the full
    size is slow where there are many triangles.

    Parameters
    ----------
    bounds : Spheres, Boxes, OrientedBoxes, Points or Instances; or a sequence of them
        The N instances.
        Several kinds of bounds of the same instances are compared with one another.
        `Points` beside others stand for these, so they may not hide what shows of them.
        The host knows no numbers of `Instances`, so no rays are cast at them: what conservative
        depth does not hide stays unclear.
    cameras : Camera or sequence of Camera
        Typical views.
    occluders : Occluders, Mesh, one of trimesh, Open3D or PyVista, or a sequence of them
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
    meshes : sequence of MeshLods, optional
        The meshes that are drawn, with their levels of detail.
    mesh_ids : (N,) integer array, optional
        The mesh of each instance, as in `Device.instances`; of `Instances`, their own.
    lods : sequence of LodByError, LodByDistance or LodBySize; optional
        The rules that you would draw by.
        Of these, the one whose lists draw the fewest triangles is recommended.
        None: an error of one pixel if `meshes` have errors, else halves of the size.
    max_seconds : float, optional
        About how long it may take; None: no limit.
        No row begins that would not be done by then, as long as the last such row took.
        One row is always measured, and some of what it culls is checked.
        `Recommendation.notes` says what was left out.
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
    options = cull_options(options, keywords, recommend)
    alternatives = alternatives_of(bounds)
    views = cameras_of(cameras)
    if (occluders is None) == (depths is None):
        got = "neither" if occluders is None else "both"
        raise TypeError(f"occluders, depths: expected exactly one of them, got {got}")
    coverage = options.coverage
    if max_ms is not None:
        max_ms = _arguments.number("max_ms", max_ms, above=0.0)
    kept_within = _arguments.number("kept_within", kept_within, at_least=1.0)
    repetitions = _arguments.integer("repetitions", repetitions, low=1, high=10_000)
    check_progress(progress)
    until = math.inf
    if max_seconds is not None:
        until = time.monotonic() + _arguments.number("max_seconds", max_seconds, at_least=0.0)
    levels, rules = lods_of(meshes, lods)
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
    volumes = {name: upload(one, device, mesh_ids) for name, one in alternatives.items()}
    points = any(
        one._points if isinstance(one, Instances) else are_points(one)
        for one in alternatives.values()
    )

    first = promised(tuple(volumes), coverage, rendered=walls is not None, points=points)
    source = DepthSource(device, walls, views, images)
    every_ray = walls is not None and coverage == "area"
    if walls is not None and every_ray:
        judge = checking.by_rays(walls, views)
    else:
        judge = checking.by_oracle(source.full_image, views, coverage)
    bare = as_points(alternatives)
    if bare is not None:
        alternatives["points"] = bare
        volumes["points"] = upload(bare, device, mesh_ids)
    triangles = None if walls is None else walls.num_triangles
    now = time.monotonic()
    selections = selections_of(occluders, triangles or 0, now + SELECTING * (until - now))
    source.selections = {budget: device.occluders(some) for budget, (_, some) in selections.items()}
    count = len(next(iter(volumes.values())))
    facts = Facts(count, triangles, tuple(selections), bare is not None, rules)
    question = Question(
        alternatives=alternatives,
        volumes=volumes,
        source=source,
        judge=judge,
        every_ray=every_ray,
        coverage=coverage,
        options=options,
        repetitions=repetitions,
        max_ms=max_ms,
        kept_within=kept_within,
        meshes=levels,
        selections={budget: selection for budget, (selection, _) in selections.items()},
        until=until,
    )
    with Progress(progress, "trying candidates") as steps:
        search = Search(question, steps)
        steps.total = search.planned(first, facts)
        candidates, picked, within, check = search.run(first, facts)
        # What was left out for want of time counts as done.
        steps.step(count=max(0, steps.total - steps.done))
    return Recommendation(
        best=picked,
        within_budget=within,
        candidates=tuple(candidates),
        tested=count * len(views),
        adapter=str(device.adapter),
        check=check.words(),
        axes=search.axes(candidates),
        notes=notes_on(
            candidates,
            picked,
            check,
            coverage=coverage,
            points=points,
            rendered=walls is not None,
            left_out=search.left_out,
        ),
    )
