"""The oracle under its public name: see `hizvk.check.reference`."""

from __future__ import annotations

from .check.reference import (
    COVERED,
    HIDDEN,
    INVALID,
    UNDECIDED,
    UNOCCLUDED,
    VISIBLE,
    classify,
    pyramid,
    unoccluded,
)

__all__ = [
    "COVERED",
    "HIDDEN",
    "INVALID",
    "UNDECIDED",
    "UNOCCLUDED",
    "VISIBLE",
    "classify",
    "pyramid",
    "unoccluded",
]
