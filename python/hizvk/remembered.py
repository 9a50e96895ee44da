"""The bounds that instances were uploaded with, for pictures alone.

The device has its own copy, and no cull asks the host for bounds.
"""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from .bounds import Bounds

__all__ = ["MOST_HELD", "Remembered"]

#: The bounds of more instances are not kept alive for a picture: these have at most 8 MB.
MOST_HELD: Final = 65_536


class Remembered:
    """A reference to bounds.

    It keeps those of few instances alive.
    Of more it knows them for as long as something else holds the object.
    """

    def __init__(self, bounds: Bounds) -> None:
        self._held = bounds if len(bounds) <= MOST_HELD else None
        self._known = weakref.ref(bounds)

    def bounds(self) -> Bounds | None:
        """The bounds, or None if they are gone."""
        return self._known() if self._held is None else self._held
