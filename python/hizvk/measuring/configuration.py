"""One way to cull: bounds, depth image, pyramid and options, as one object."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from .._arguments import Size
    from .._types import Depths, Levels, Rasteriser
    from ..lod import LodRule
    from ..options import CullOptions

__all__ = ["DESCENT", "READS", "SOME_LEVELS", "Configuration", "DepthVariant"]

#: Texels that a descent may read: enough to finish at the image sizes used here.
DESCENT: Final = 4096
#: ``(footprint, descent)``, from the fewest texels to the most.
READS: Final = ((2, 0), (4, 0), (8, 0), (2, DESCENT))
#: Pyramids that lack levels: the finest, the two finest, all but one.
SOME_LEVELS: Final[tuple[Levels, ...]] = (2, 3, (4, 4))


@dataclass(frozen=True)
class DepthVariant:
    """The depth image that occluders are rendered into, and the levels of its pyramid."""

    divisor: int = 1
    """The image's sides are those of the view divided by this."""
    conservative: bool = False
    """True: a pixel hides only what occluders also cover at the view's full resolution."""

    levels: Levels = None
    """Which levels of the pyramid are built, as in `Device.pyramid`."""
    rasteriser: Rasteriser = "auto"
    """What draws a plain image, as in `Device.render_depth`."""
    max_triangles: int | None = None
    """At most so many triangles are drawn in each view, as in `Device.render_depth`."""
    selected: int | None = None
    """The occluders are those of `select_occluders`, with at most so many triangles."""
    depths: Depths = "farthest"
    """Which ends the pyramid has, as in `Device.pyramid`."""

    def size(self, full: Size) -> Size:
        """``(height, width)`` of the image for a view of `full` pixels."""
        return max(1, full[0] // self.divisor), max(1, full[1] // self.divisor)

    def render_options(self, full: Size) -> dict[str, Any]:
        """The keyword arguments of `Device.render_depth` for a view of `full` pixels."""
        options: dict[str, Any] = {} if self.divisor == 1 else {"size": self.size(full)}
        options |= {} if self.rasteriser == "auto" else {"rasteriser": self.rasteriser}
        options |= {} if self.max_triangles is None else {"max_triangles": self.max_triangles}
        return options | ({"conservative": True} if self.conservative else {})

    def __str__(self) -> str:
        words = [self._image()]
        words += [] if self.rasteriser == "auto" else [f"drawn by {self.rasteriser}"]
        if self.max_triangles is not None:
            words.append(f"at most {self.max_triangles:,} triangles drawn")
        if self.selected is not None:
            words.append(f"at most {self.selected:,} triangles selected")
        words.append(self._levels())
        words += [] if self.depths == "farthest" else [f"{self.depths} ends"]
        return ", ".join(word for word in words if word)

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

    def image(self) -> DepthVariant:
        """The variant of the image alone, whatever its pyramid."""
        return replace(self, levels=None, depths="farthest")

    def cost(self) -> tuple[int, bool, str, str, str]:
        """A key for sorting: the largest image first, and of its pyramids that of all levels."""
        return self.divisor, self.conservative, self._levels(), self.rasteriser, str(self)


@dataclass(frozen=True)
class Configuration:
    """One way to cull."""

    volume: str = "boxes"
    """``"spheres"``, ``"boxes"``, ``"oriented_boxes"`` or ``"points"``."""
    footprint: int = 2
    descent: int = 0
    coverage: str = "area"
    order: str = "any"
    fit: str = "rectangle"
    """What is compared with a texel.

    ``"rectangle"``: the nearest depth of the bounds, everywhere in their rectangle.
    ``"volume"``: the bounds' own outline and their depth at the texel.
    """
    depth: DepthVariant = DepthVariant()
    guard_px: float | None = None
    """Pixels by which the bounds grow, as in `Device.cull`."""
    hierarchy: bool | int | None = None
    """How many tiers of boxes are tested before the instances, as in `CullOptions`."""
    lod: LodRule | None = None
    """Which level of detail is drawn, as in `CullOptions`."""

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
        if self.hierarchy is not None:
            tiers = int(self.hierarchy)
            words.append({0: "flat", 1: "groups"}.get(tiers, f"{tiers} tiers"))
        words += [str(self.lod)] if self.lod is not None else []
        return ", ".join(words)

    @property
    def promises(self) -> bool:
        """Whether the promise reaches the view's own pixels.

        Two kinds of image give no such promise: a smaller image of plain samples, and a smaller
        image of which only the pixel centres count.
        """
        return self.depth.divisor == 1 or self.promises_rays

    @property
    def promises_rays(self) -> bool:
        """Whether the promise reaches every ray: any size, sample position, jitter, and points."""
        return self.depth.conservative and self.coverage == "area"

    def cull_options(self) -> dict[str, Any]:
        """The keyword arguments of `Device.cull`."""
        options = {
            name: getattr(self, name)
            for name in ("footprint", "descent", "fit", "coverage", "order")
        }
        for name in ("guard_px", "hierarchy", "lod"):
            # None leaves what the caller's options say.
            options |= {} if getattr(self, name) is None else {name: getattr(self, name)}
        return options

    def options(self, base: CullOptions) -> CullOptions:
        """`base`, with the fields of this configuration in the place of its own."""
        return replace(base, **self.cull_options())

    def render_options(self, full: Size) -> dict[str, Any]:
        """The keyword arguments of `Device.render_depth` for a view of `full` pixels."""
        return self.depth.render_options(full)

    def as_data(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self)
