"""What the parts of a run share: the device, the yardsticks, the extent, and what was found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from hizvk import _core
from hizvk.options import CullOptions, Outputs

from . import town as towns

if TYPE_CHECKING:
    from collections.abc import Callable

    from hizvk._arguments import Size
    from hizvk.camera import Camera
    from hizvk.device import Device
    from hizvk.lod import LodRule
    from hizvk.resources import DepthImage, Instances, Pyramid

    from .figures import Found

__all__ = ["ALL_LEVELS", "MASK", "WORKLOADS", "Run", "Workload"]

#: Levels as `_core` takes them.
ALL_LEVELS: Final = (1, 15)
#: Outputs as `_core` takes them: the mask alone.
MASK: Final = (True, False, False, False)


@dataclass(frozen=True)
class Workload:
    """How much is measured."""

    images: tuple[tuple[str, Size], ...]
    """Names and sizes of the depth images of the reduction."""
    crowd: int
    """Instances of the culls."""
    calls: int
    """Instances of the calls from Python."""
    rounds: int
    sample: int
    """Instances that the oracle judges."""
    processes: int
    """Fresh processes for each state of the cache."""
    counts: tuple[int, ...]
    """Numbers of instances."""
    sides: tuple[int, ...]
    """Of square depth images."""
    large: int | None
    """The number of instances that is compared with `crowd`."""
    small_image: Size = (720, 1280)
    """The size of the smallest depth image that is uploaded."""
    scenes: tuple[str, ...] = ("mountains", "city", "castle")
    """Of `hizvk.bench.catalogue`: whose occluders are drawn."""
    views: int = 4
    """Of each of these scenes."""
    plain_sizes: int = 2
    """How many sizes of plain images are drawn."""


HD: Final = ("1080p", (1080, 1920))
UHD: Final = ("4K", (2160, 3840))

_COUNTS: Final = (1_000, 10_000, 100_000, 1_000_000, 4_000_000)
_MORE_COUNTS: Final = (8_000_000, 10_000_000, 16_000_000, 32_000_000, 50_000_000)
_SIDES: Final = (256, 512, 1024, 2048, 4096)

WORKLOADS: Final = {
    "quick": Workload(
        images=(HD,),
        crowd=100_000,
        calls=100_000,
        rounds=3,
        sample=200,
        processes=1,
        counts=_COUNTS[:3],
        sides=_SIDES[:2],
        large=None,
        scenes=("city",),
        views=1,
        plain_sizes=1,
    ),
    "default": Workload(
        images=(HD, UHD),
        crowd=1_000_000,
        calls=100_000,
        rounds=15,
        sample=2_000,
        processes=3,
        counts=_COUNTS,
        sides=_SIDES,
        large=16_000_000,
    ),
    "full": Workload(
        images=(HD, UHD),
        crowd=1_000_000,
        calls=100_000,
        rounds=25,
        sample=5_000,
        processes=5,
        counts=(*_COUNTS, *_MORE_COUNTS),
        sides=(*_SIDES, 8192),
        large=16_000_000,
    ),
}


@dataclass
class Run:
    """One run."""

    device: Device
    extent: Workload
    seed: int
    found: Found
    step: Callable[[str], None]
    """Shows what is done next."""

    def __post_init__(self) -> None:
        self.yardstick = _core.Yardstick(self.device._engine)

    def town(self, count: int, hidden: float) -> towns.Town:
        """A town of this run's seed."""
        return towns.make(count, hidden, self.seed)

    def depth(self, scene: towns.Town, size: Size) -> DepthImage:
        """The walls as they are rendered."""
        return self.device.render_depth(
            self.device.occluders(scene.vertices, scene.triangles), scene.view.camera(size)
        )

    def cull(
        self,
        instances: Instances,
        camera: Camera,
        pyramid: Pyramid,
        *,
        certified: bool = True,
        groups: bool | int | None = False,
        order: str = "stable",
        outputs: tuple[bool, bool, bool, bool] = MASK,
        depth: DepthImage | None = None,
        bins: Outputs | None = None,
        lod: LodRule | None = None,
    ) -> _core.YardstickCull:
        """A cull that was recorded into buffers of its own; ``.ms()`` submits it and waits.

        `bins` says what it makes of meshes, in place of `outputs`.
        """
        mask, verdicts, indices, draws = outputs
        made = Outputs(mask=mask, verdicts=verdicts, indices=indices, draws=draws)
        return self.yardstick.cull(
            instances._inner,
            camera._inner,
            pyramid._inner,
            certified,
            CullOptions(order=order, hierarchy=groups, lod=lod),  # type: ignore[arg-type]
            made if bins is None else bins,
            None if depth is None else depth._inner,
            None if bins is None else self.device._mesh_table(bins.meshes),
        )
