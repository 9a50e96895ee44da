"""What `Device.warm_up` is asked for beside one cull, checked."""

from __future__ import annotations

from typing import Final

from . import _arguments
from .samples import COUNTS
from .views import MOST_VIEWS

__all__ = ["checked_more"]

#: How many samples per pixel depth may have, with one for an image without multisampling.
_SAMPLES: Final = (1, *COUNTS)


def checked_more(
    two_passes: object, samples: object, views: object, *, is_drawn: bool
) -> tuple[bool, int, int]:
    """Whether there are two passes, then samples per pixel and views of one call."""
    passes = _arguments.flag("two_passes", two_passes)
    count = _arguments.integer("samples", samples, low=1, high=_SAMPLES[-1])
    if count not in _SAMPLES:
        raise ValueError(f"samples: expected one of {_SAMPLES}, got {count}")
    if is_drawn and count > 1:
        raise ValueError(
            f"samples: expected 1 beside occluders, got {count}; rendered depth has one sample per "
            "pixel"
        )
    return passes, count, _arguments.integer("views", views, low=1, high=MOST_VIEWS)
