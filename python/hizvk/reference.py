"""The oracle under its public name: see `hizvk.check.reference`."""

from __future__ import annotations

from .check.reference import HIDDEN, INVALID, UNDECIDED, VISIBLE, classify, pyramid

__all__ = ["HIDDEN", "INVALID", "UNDECIDED", "VISIBLE", "classify", "pyramid"]
