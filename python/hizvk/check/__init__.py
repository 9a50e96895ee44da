"""Checks that need no device, of what a cull answers and of what it is given.

===============  ================================================================================
`reference`      the oracle: which instances are hidden, in float64 and exact arithmetic
`comparison`     a mask beside the truth: false culls and false keeps
`unoccluded`     verdicts beside the truth: what surely shows
`containment`    whether occluder proxies lie inside their mesh, and meshes inside their bounds
===============  ================================================================================
"""

from __future__ import annotations

from .comparison import Comparison, compare
from .containment import BoundsCheck, ProxyCheck, check_bounds, check_proxy
from .unoccluded import UnoccludedComparison, compare_unoccluded

__all__ = [
    "BoundsCheck",
    "Comparison",
    "ProxyCheck",
    "UnoccludedComparison",
    "check_bounds",
    "check_proxy",
    "compare",
    "compare_unoccluded",
]
