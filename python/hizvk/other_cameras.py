"""What tells a camera from the one that was expected, for errors.

Matrices are as long as their shapes in a camera's text, so two cameras may have the same text.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .camera import Camera

__all__ = ["difference", "other_camera"]


def other_camera(
    name: str, wanted: str, expected: Camera, got: Camera, way: str = ""
) -> ValueError:
    """The error for another camera than `wanted`, which says in words where that one comes from."""
    told = difference(expected, got)
    return ValueError(f"{name}: expected {wanted}, {expected!r}, got {told}{way and f'; {way}'}")


def difference(expected: Camera, got: Camera) -> str:
    """In which arguments a camera differs, or the whole of it if it was made in another way."""
    parts = _parts(expected, got)
    return f"one whose {', whose '.join(parts)}" if parts else repr(got)


def _parts(expected: Camera, got: Camera) -> list[str]:
    """Each argument that differs, with both; nothing if the calls have others."""
    (name, arguments), (other_name, others) = expected._recipe, got._recipe
    here, there = dict(arguments), dict(others)
    if name != other_name or here.keys() != there.keys():
        return []
    parts = []
    for key, value in here.items():
        if key == "camera":  # of `resized`
            parts += _parts(value, there[key])
        elif isinstance(value, np.ndarray):
            apart = np.abs(value - there[key]) if value.shape == there[key].shape else value
            at = np.unravel_index(int(apart.argmax()), apart.shape)
            if apart[at]:
                place = ", ".join(map(str, at))
                parts.append(f"{key}[{place}] is {there[key][at]:.17g} and not {value[at]:.17g}")
        elif value != there[key]:
            parts.append(f"{key} is {there[key]!r} and not {value!r}")
    return parts
