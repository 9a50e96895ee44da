"""The numbers of ``hizvk bench --maps`` as plain objects."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

__all__ = ["LIMITS", "NEGLIGIBLE", "PICTURE", "SIDE", "Found", "Row"]

#: Limits of the occluders that a view's maps draw; the best one of a scene is taken.
LIMITS: Final = (4, 16, 64, None)
#: Pixels of a hole that is negligible.
NEGLIGIBLE: Final = (0, 1, 4, 16, 64)
#: The finest map, as the text has it, and the larger picture in which losses are counted, too.
SIDE: Final = 256
PICTURE: Final = 1024


@dataclass
class Row:
    """What one way culls, summed over the views of a scene."""

    label: str
    negligible_px: int | None
    """None: the certified cull."""
    descent: int = 0
    """Of the certified cull."""
    hidden: int = 0
    """Instances in the view that no pixel of either picture shows."""
    hidden_kept: int = 0
    """How many of them are kept."""
    lost: int = 0
    """Instances that were culled and that a picture of the maps' size shows."""
    pixels: int = 0
    """The pixels of that picture that show them."""
    lost_large: int = 0
    """The same in the large picture, 16 times as many pixels."""
    pixels_large: int = 0
    ms_make: float = 0.0
    """To make the maps, or to render the depth and to build the pyramid; a view."""
    ms_cull: float = 0.0
    """To cull all instances, with the mask on the host; a view."""

    @property
    def share_kept(self) -> float:
        """The part of the hidden instances that is kept, 0 to 1."""
        return self.hidden_kept / max(self.hidden, 1)


@dataclass(frozen=True)
class Found:
    """What was found in one scene."""

    key: str
    name: str
    instances: int
    views: int
    occluders: int
    """Objects in the database of occluders."""
    limit: int | None
    """The most that maps draw in a view: the one of `LIMITS` that keeps the least."""
    chosen: int
    """How many the maps have drawn in a view, on the average."""
    pixels: int
    """Of the picture of the maps' size, all views."""
    farther: float
    """The estimated depth by the true one: the median over regions that are covered wholly."""
    rows: list[Row] = field(default_factory=list)
