"""What is compared: which volume, how much is read, what of a pixel counts, which depth image, which order.

All combinations would be hundreds, so each dimension is varied about the same middle (boxes, 2x2
texels, area coverage, full resolution, all levels, any order), and in full with those that it
depends on.
``--full`` takes the whole product.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._arguments import Size
    from .._types import Levels
    from ..options import CullOptions

__all__ = ["DESCENT", "Configuration", "DepthVariant", "matrix", "promised", "render_options"]

#: Texels that a descent may read: enough to finish at these image sizes.
DESCENT: Final = 4096
#: ``(footprint, descent)``, from the least that is read to the most.
READS: Final = ((2, 0), (4, 0), (8, 0), (2, DESCENT))
#: Pyramids that lack levels: the finest, the two finest, all but one.
SOME_LEVELS: Final[tuple[Levels, ...]] = (2, 3, (4, 4))


@dataclass(frozen=True)
class DepthVariant:
    """Which depth image the occluders are rendered into, and what of its pyramid is built."""

    divisor: int = 1
    """The image's sides are those of the view divided by this."""
    conservative: bool = False
    """True: what is rendered hides only what occluders cover at the view's full resolution as well."""

    levels: Levels = None
    """Which levels of the pyramid are built, as in `Device.pyramid`."""

    def size(self, full: Size) -> Size:
        """``(height, width)`` of the image for a view of `full` pixels."""
        return max(1, full[0] // self.divisor), max(1, full[1] // self.divisor)

    def __str__(self) -> str:
        return ", ".join(word for word in (self._image(), self._levels()) if word)

    def _image(self) -> str:
        if self.divisor == 1:
            return "depth conservative" if self.conservative else ""
        return f"depth 1/{self.divisor}{' conservative' if self.conservative else ''}"

    def _levels(self) -> str:
        if self.levels is None:
            return ""
        first, last = (self.levels, None) if isinstance(self.levels, int) else self.levels
        if last is None:
            return f"levels >= {first}"
        return f"level {first} alone" if first == last else f"levels {first} to {last}"

    def cost(self) -> tuple[int, bool, str]:
        """For sorting: the largest image first, and of its pyramids that of all levels."""
        return self.divisor, self.conservative, self._levels()


@dataclass(frozen=True)
class Configuration:
    """One way to cull."""

    volume: str = "boxes"
    """``"spheres"``, ``"boxes"`` or ``"oriented_boxes"``."""
    footprint: int = 2
    descent: int = 0
    coverage: str = "area"
    order: str = "any"
    fit: str = "rectangle"
    """What is compared at a texel: ``"rectangle"``, the nearest depth of the bounds everywhere in their rectangle; or
    ``"volume"``, their own outline and depth there."""
    depth: DepthVariant = DepthVariant()
    guard_px: float | None = None
    """Pixels by which the bounds grow, as in `Device.cull`."""

    def __str__(self) -> str:
        words = [
            self.volume.replace("oriented_boxes", "oriented"),
            f"{self.footprint}x{self.footprint}",
        ]
        words += ["descent"] if self.descent else []
        words += ["volume fit"] if self.fit == "volume" else []
        words += [self.coverage] if self.coverage != "area" else []
        words += [self.order] if self.order != "any" else []
        words += [f"guard {self.guard_px:g} px"] if self.guard_px is not None else []
        words += [str(self.depth)] if self.depth != DepthVariant() else []
        return ", ".join(words)

    @property
    def promises(self) -> bool:
        """Whether the promise reaches to the view's own pixels.

        It does not for a smaller image of plain samples, nor for one whose own pixel centres are
        all that counts.
        """
        return self.depth.divisor == 1 or self.promises_rays

    @property
    def promises_rays(self) -> bool:
        """Whether the promise reaches to every ray: to any size, sample positions and jitter, and to bare points."""
        return self.depth.conservative and self.coverage == "area"

    def cull_options(self) -> dict[str, Any]:
        """The keyword arguments of `Device.cull`."""
        options = {
            name: getattr(self, name)
            for name in ("footprint", "descent", "fit", "coverage", "order")
        }
        return options | ({} if self.guard_px is None else {"guard_px": self.guard_px})

    def options(self, base: CullOptions) -> CullOptions:
        """`base`, with what this configuration says in the place of its fields."""
        return replace(base, **self.cull_options())

    def render_options(self, full: Size) -> dict[str, Any]:
        """The keyword arguments of `Device.render_depth` for a view of `full` pixels."""
        return render_options(self.depth, full)

    def as_data(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self)


def render_options(depth: DepthVariant, full: Size) -> dict[str, Any]:
    """The keyword arguments of `Device.render_depth` for a view of `full` pixels."""
    options: dict[str, Any] = {} if depth.divisor == 1 else {"size": depth.size(full)}
    return options | ({"conservative": True} if depth.conservative else {})


def matrix(extent: str) -> tuple[Configuration, ...]:
    """The configurations to measure, in the report's order.

    Parameters
    ----------
    extent : "quick", "default" or "full"
        How many.
    """
    if extent == "full":
        chosen = _full()
    elif extent == "quick":
        chosen = [
            Configuration(volume, *read)
            for volume in ("spheres", "boxes")
            for read in (READS[0], READS[-1])
        ]
        chosen += [Configuration(depth=depth) for depth in (DepthVariant(2), DepthVariant(2, True))]
        chosen += [
            Configuration(fit="volume"),
            Configuration(coverage="sample"),
            Configuration(order="stable"),
        ]
    else:
        chosen = _default()
    return tuple(dict.fromkeys(chosen))


def promised(
    volumes: Sequence[str], coverage: str, *, rendered: bool, points: bool = False
) -> list[Configuration]:
    """What `hizvk.recommend` tries: whatever can be right for some renderer.

    Parameters
    ----------
    volumes : sequence of str
        The kinds of bounds that there are.
    coverage : "area" or "sample"
        What counts: every ray of the view, or the pixels' centres alone.
    rendered : bool
        Whether depth is rendered from occluders, so that it can be conservative, or smaller.
    points : bool
        Whether the bounds are bare points, which lie on what a given image shows more often than
        not.
    """
    plain, full = DepthVariant(), DepthVariant(1, True)
    ends = (READS[0], READS[-1])
    fits = ("rectangle", "volume")
    chosen = []
    if coverage == "area" or not rendered:
        chosen += [
            Configuration(volume, *read, fit=fit, coverage=coverage)
            for volume, fit, read in product(volumes, fits, READS)
        ]
    if rendered:
        chosen += [
            Configuration(volume, *read, fit=fit, depth=depth)
            for depth, volume, fit, read in product(
                (full, DepthVariant(2, True), DepthVariant(4, True)), volumes, fits, READS
            )
        ]
        chosen += [
            Configuration(volume, *read, fit=fit, coverage="sample")
            for volume, fit, read in product(volumes, fits, READS if coverage == "sample" else ends)
        ]
    some = [replace(plain, levels=levels) for levels in SOME_LEVELS]
    some += [replace(full, levels=levels) for levels in SOME_LEVELS] if rendered else []
    chosen += [
        Configuration(
            volume, *read, depth=depth, coverage="area" if depth.conservative else coverage
        )
        for depth, volume, read in product(some, volumes, ends)
    ]
    if points and not rendered and coverage == "area":
        chosen += [
            Configuration(volume, *read, guard_px=0.5) for volume, read in product(volumes, READS)
        ]
    return list(dict.fromkeys(chosen))


def _default() -> list[Configuration]:
    volumes = ("spheres", "boxes", "oriented_boxes")
    ends = (READS[0], READS[-1])
    smaller = [
        DepthVariant(divisor, conservative) for divisor in (2, 4) for conservative in (False, True)
    ]
    chosen = [Configuration(volume, *read) for volume, read in product(volumes, READS)]
    chosen += [
        Configuration(volume, *read, fit="volume") for volume, read in product(volumes, ends)
    ]
    chosen += [Configuration("boxes", *read, coverage="sample") for read in ends]
    chosen += [Configuration(order="stable")]
    chosen += [Configuration("boxes", *read, depth=depth) for depth, read in product(smaller, ends)]
    chosen += [
        Configuration("boxes", *read, depth=DepthVariant(levels=some))
        for some, read in product(SOME_LEVELS, ends)
    ]
    return chosen


def _full() -> list[Configuration]:
    depths = [
        DepthVariant(),
        *(DepthVariant(d, c) for d in (1, 2, 4) for c in (False, True) if (d, c) != (1, False)),
    ]
    chosen = [
        Configuration(volume, *read, coverage=coverage, fit=fit, depth=depth)
        for volume, read, coverage, fit, depth in product(
            ("spheres", "boxes", "oriented_boxes"),
            READS,
            ("area", "sample"),
            ("rectangle", "volume"),
            depths,
        )
        if coverage == "area" or depth == DepthVariant()
    ]
    chosen += [
        Configuration("boxes", *read, depth=DepthVariant(levels=some))
        for some, read in product(SOME_LEVELS, READS)
    ]
    return [*chosen, Configuration(order="stable")]
