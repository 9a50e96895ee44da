"""What culling costs and what it leaves: the command ``hizvk bench``, and `hizvk.recommend` for scenes of one's own.

====================  ==========================================================================
`scenes`, `city`      the scenes; `volumes` has the bounds of their instances
`configurations`      what is compared
`stages`, `measure`   times and counts
`numpy_hiz`, `rays`   what a Python user would otherwise do
`score`, `rectangle`  false culls, hidden instances kept, the best rectangle test
`pareto`, `results`   what nothing beats; the numbers as plain objects
`report`, `plots`     report.json (its schema stands there), report.md, a picture for each scene
`recommend`           the same measurement on the caller's own scene
`checking`, `clear`   what its candidates are held against: rays at the triangles, or the oracle
`speed`               ``hizvk bench --speed``: times against yardsticks and targets
====================  ==========================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs ``hizvk bench`` and returns its exit code."""
    from .command import main as run  # scenes and plots are not loaded by `import hizvk`

    return run(arguments)
