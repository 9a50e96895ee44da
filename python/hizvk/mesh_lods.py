"""Meshes as a cull sees them: how each level of detail is drawn, and how far off it is.

`Device.cull` takes them as ``meshes=`` and sorts what it keeps by mesh and level of detail.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from . import _arguments
from .errors import LimitError
from .options import DrawTemplate

__all__ = ["ABSENT", "NO_LOD", "MeshLods"]

#: The mesh id of an instance that is not there.
#: No cull keeps it.
ABSENT: Final = 2**32 - 1

#: The level of detail of an instance that a cull did not keep.
NO_LOD: Final = 255

#: The most levels of detail of a mesh.
MAX_LODS: Final = 8


@dataclass(frozen=True)
class MeshLods:
    """The levels of detail (LODs) of one mesh, from the finest to the coarsest.

    Parameters
    ----------
    draws : sequence of DrawTemplate
        How each level is drawn; 1 to 8 of them, and the first is the full mesh.
        Their ``first_instance`` is 0, because the cull writes it.
    errors : sequence of float, optional
        How far the surface of each level is from that of the full mesh at scale 1, at most, in
        world units.
        None: 0 for each.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    LimitError
        For more than 8 levels.

    Examples
    --------
    >>> import hizvk
    >>> fine, coarse = hizvk.DrawTemplate(3600), hizvk.DrawTemplate(300, first_index=3600)
    >>> tree = hizvk.MeshLods([fine, coarse], errors=[0.0, 0.02])
    >>> len(tree.draws)
    2
    """

    draws: tuple[DrawTemplate, ...]
    errors: tuple[float, ...]

    def __init__(
        self, draws: Sequence[DrawTemplate], errors: Sequence[float] | None = None
    ) -> None:
        if isinstance(draws, (str, DrawTemplate)) or not isinstance(draws, Sequence):
            expected = "a sequence of DrawTemplate"
            raise TypeError(f"draws: expected {expected}, got {_arguments.describe(draws)}")
        for draw in draws:
            _arguments.instance("draws", draw, DrawTemplate, "a DrawTemplate for each level")
            if draw.first_instance != 0:
                expected = "0 as first_instance, which the cull writes"
                raise ValueError(f"draws: expected {expected}, got {draw.first_instance}")
        if not draws:
            raise ValueError(f"draws: expected 1 to {MAX_LODS} levels of detail, got none")
        if len(draws) > MAX_LODS:
            raise LimitError("levels of detail of a mesh", len(draws), MAX_LODS)
        if errors is None:
            errors = (0.0,) * len(draws)
        if isinstance(errors, str) or not hasattr(errors, "__len__"):
            expected = "a sequence of numbers or None"
            raise TypeError(f"errors: expected {expected}, got {_arguments.describe(errors)}")
        if len(errors) != len(draws):
            expected = f"one for each of {len(draws)} levels of detail"
            raise ValueError(f"errors: expected {expected}, got {len(errors)}")
        checked = (_arguments.number("errors", e, at_least=0.0, at_most=2.0**59) for e in errors)
        object.__setattr__(self, "draws", tuple(draws))
        object.__setattr__(self, "errors", tuple(checked))

    def _raw(self) -> list[tuple[int, int, int, int, float]]:
        """The levels as the compiled module takes them."""
        return [
            (draw.index_count, draw.first_index, draw.base_vertex, draw.first_instance, error)
            for draw, error in zip(self.draws, self.errors, strict=True)
        ]


def checked_meshes(name: str, value: Any) -> tuple[MeshLods, ...] | None:
    """The meshes of a cull, or None."""
    if value is None:
        return None
    expected = "a sequence of MeshLods or None"
    if isinstance(value, (str, MeshLods)) or not isinstance(value, Sequence):
        raise TypeError(f"{name}: expected {expected}, got {_arguments.describe(value)}")
    if not value:
        raise ValueError(f"{name}: expected at least one MeshLods, got none")
    for mesh in value:
        _arguments.instance(name, mesh, MeshLods, "a MeshLods for each mesh")
    return tuple(value)
