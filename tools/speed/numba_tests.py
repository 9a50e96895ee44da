"""Tests of points by reversed depth on one thread, compiled by numba: what a caller would write."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    #: Positions, matrix and depth image; returns a mask.
    Test = Callable[[Any, Any, Any], Any]

__all__ = ["MISSING", "guarded_test", "z_test"]

#: Why numba's ways may be missing.
MISSING: Final = "numba is not installed (the dependency group dev has it)"
#: Pixels around a point that count in a cull by default.
GUARD: Final = 0.5


def z_test() -> Test | None:
    """Compares a point with the pixel that it lies in; None without numba."""

    def test(points: Any, matrix: Any, depth: Any) -> Any:
        height, width = depth.shape
        kept = np.empty(len(points), np.bool_)
        for i in range(len(points)):
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            w = matrix[3, 0] * x + matrix[3, 1] * y + matrix[3, 2] * z + matrix[3, 3]
            cx = matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z + matrix[0, 3]
            cy = matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z + matrix[1, 3]
            cz = matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z + matrix[2, 3]
            seen = False
            if w > 0.0 and abs(cx) <= w and abs(cy) <= w and 0.0 <= cz <= w:
                column = min(int((cx / w * 0.5 + 0.5) * width), width - 1)
                row = min(int((0.5 - cy / w * 0.5) * height), height - 1)
                seen = cz >= depth[row, column] * w
            kept[i] = seen
        return kept

    return _compiled(test)


def guarded_test() -> Test | None:
    """Compares a point with the farthest pixel within the guard, as a cull of points does.

    So it answers the cull's question, without room for float32; None without numba.
    """

    def test(points: Any, matrix: Any, depth: Any) -> Any:
        height, width = depth.shape
        kept = np.empty(len(points), np.bool_)
        for i in range(len(points)):
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            w = matrix[3, 0] * x + matrix[3, 1] * y + matrix[3, 2] * z + matrix[3, 3]
            cx = matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z + matrix[0, 3]
            cy = matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z + matrix[1, 3]
            cz = matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z + matrix[2, 3]
            seen = False
            if w > 0.0 and 0.0 <= cz <= w:
                column = (cx / w * 0.5 + 0.5) * width
                row = (0.5 - cy / w * 0.5) * height
                if -GUARD <= column <= width + GUARD and -GUARD <= row <= height + GUARD:
                    left = max(int(column - GUARD), 0)
                    right = min(int(column + GUARD), width - 1)
                    top = max(int(row - GUARD), 0)
                    bottom = min(int(row + GUARD), height - 1)
                    farthest = min(
                        min(depth[top, left], depth[top, right]),
                        min(depth[bottom, left], depth[bottom, right]),
                    )
                    seen = cz >= farthest * w
            kept[i] = seen
        return kept

    return _compiled(test)


def _compiled(test: Test) -> Test | None:
    try:
        import numba
    except ImportError:
        return None
    njit: Any = numba.njit
    compiled: Test = njit(test)
    return compiled
