"""One measured configuration, and the choice among several."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from .. import _arguments
from ..device import maker_of
from ..options import CullOptions
from ..resources import DepthImage, Instances

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from .._arguments import Size
    from ..bounds import Bounds
    from ..camera import Camera
    from ..measuring.configuration import Configuration
    from ..measuring.spread import Spread
    from ..occluders import OccluderSelection
    from ..options import MeshLods
    from ..resources import Occluders
    from ..result import CullResult

__all__ = ["Candidate", "choose"]


@dataclass(frozen=True)
class Candidate:
    """One configuration, measured on the caller's scene.

    It holds what the calls need: `bounds`, `render_options`, `pyramid_options`, `cull_options`.
    `cull` makes the whole call.
    """

    configuration: Configuration
    ms: Spread
    """Milliseconds per camera: depth (if there are occluders to render), pyramid, cull and mask.

    The quartiles are those of cull and mask.
    """
    cull_ms: Spread
    """Milliseconds of the cull alone."""
    kept: int
    """Instances that it keeps, summed over all cameras."""
    on_front: bool
    """Whether no other candidate is better in time or number kept, and no worse in the other.

    Only candidates that may be recommended take part.
    """
    hides: int = 0
    """Instances that it culls and that the check found visible, summed over all cameras."""
    unclear: int = 0
    """Instances that it culls and that are neither proven hidden nor found visible, likewise."""
    proven: bool = True
    """Whether what was asked is also proven of it for other cameras.

    That is: for every ray (conservative depth, area coverage), or for the pixels of an image as
    given.
    """
    asked: bool = True
    """False for what is only shown for comparison: sample coverage, where every ray counts."""
    bounds: Bounds | Instances | None = field(default=None, repr=False, compare=False)
    """The given bounds of this kind, for `Device.instances` unless they are `Instances` already."""
    options: CullOptions = field(default=CullOptions(), repr=False)
    """How it culls, for `Device.cull`."""
    selection: OccluderSelection | None = field(default=None, repr=False, compare=False)
    """Which of the given meshes are its occluders; None: all of them."""
    mesh_lods: tuple[MeshLods, ...] | None = field(default=None, repr=False, compare=False)
    """The meshes for ``meshes=`` of `Device.cull`, if it has a rule for levels of detail."""
    triangles: int | None = None
    """Triangles that its lists draw, summed over all cameras; None without levels of detail."""

    @property
    def safe(self) -> bool:
        """Whether it may be recommended: all that it culls before the cameras given is hidden."""
        return self.asked and not self.hides and not self.unclear

    @property
    def volume(self) -> str:
        """Which bounds: ``"spheres"``, ``"boxes"``, ``"oriented_boxes"`` or ``"points"``."""
        return self.configuration.volume

    @property
    def cull_options(self) -> dict[str, Any]:
        """`options` as keyword arguments for `Device.cull`."""
        return asdict(self.options)

    @property
    def pyramid_options(self) -> dict[str, Any]:
        """Keyword arguments for `Device.pyramid`, beside the image and the kind of its numbers."""
        levels = self.configuration.depth.levels
        options: dict[str, Any] = {} if levels is None else {"levels": levels}
        depths = self.configuration.depth.depths
        return options | ({} if depths == "farthest" else {"depths": depths})

    def render_options(self, size: Size) -> dict[str, Any]:
        """Keyword arguments for `Device.render_depth` with a camera of `size`."""
        return self.configuration.render_options(size)

    def cull(
        self,
        instances: Instances,
        camera: Camera,
        occluders: Occluders | None = None,
        *,
        depth: DepthImage | npt.ArrayLike | None = None,
        **depth_options: Any,
    ) -> CullResult:
        """Makes the whole call: depth from the occluders (or as given), pyramid, cull.

        Parameters
        ----------
        instances : Instances
            Of the kind `volume`.
        camera : Camera
            The view, in the size of the large image.
        occluders : Occluders
            Of the same device; of a candidate with a `selection`, of the meshes that this keeps.
        depth : DepthImage or (height, width) array
            Instead of `occluders`.
            A candidate that renders depth of its own cannot take it.
        **depth_options
            ``kind`` and ``scale`` of an array, as in `Device.pyramid`.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        _arguments.instance("instances", instances, Instances, "Instances of Device.instances")
        if instances.kind != self.volume:
            raise ValueError(
                f"instances: expected {self.volume}, got {instances.kind}; "
                "upload the bounds that this candidate's volume names"
            )
        if (occluders is None) == (depth is None):
            got = "neither" if occluders is None else "both"
            raise TypeError(f"occluders, depth: expected exactly one of them, got {got}")
        device = maker_of(instances)
        if occluders is not None:
            depth = device.render_depth(occluders, camera, **self.render_options(camera.size))
        elif self.render_options(camera.size):
            got = _arguments.describe(depth)
            raise TypeError(
                f"depth: expected occluders instead, for {self.configuration.depth}, got {got}"
            )
        if isinstance(depth, DepthImage):
            pyramid = device.pyramid(depth, **self.pyramid_options)
        else:
            array: Any = depth
            pyramid = device.pyramid(array, camera, **depth_options, **self.pyramid_options)
        return device.cull(instances, pyramid.camera, pyramid, self.options, meshes=self.mesh_lods)

    def __str__(self) -> str:
        return str(self.configuration)


def choose(
    candidates: Sequence[Candidate],
    *,
    max_ms: float | None = None,
    kept_within: float = 1.05,
    least: int | None = None,
) -> tuple[Candidate, bool]:
    """The candidate to use, and whether it is within the budget.

    Only those that are `Candidate.safe` count.
    Of those within `max_ms`, it is the fastest that keeps at most `kept_within` times as many
    instances as the one that keeps fewest, or as `least` if that is fewer.
    If none keeps so few, it is the one that keeps fewest.
    If none is within the budget, it is the fastest of all.

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
    fewest = min(one.kept for one in able)
    limit = max(fewest, kept_within * (fewest if least is None else min(fewest, least)))
    return min((one for one in able if one.kept <= limit), key=lambda one: one.ms.median), True
