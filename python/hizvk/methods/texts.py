"""Visibility tests as published texts print them, on the device; they hide what can be seen.

Sources:

- ``"rakos"``: Daniel Rakos, *Hierarchical-Z map based occlusion culling*, 2010.
- ``"arm"``: ARM, *Occlusion Culling with Hierarchical-Z* (OpenGL ES SDK), whose bounds of a sphere
  are those of Mara and McGuire, 2013.
- ``"darnell"``: Nick Darnell, *Hierarchical Z-Buffer Occlusion Culling*, 2010.
- ``"one_lookup"``: one texel at the middle of a rectangle, with which Rakos compares his four.

Each reads the same reversed depth as a certified cull, in a chain of levels that is exact.
So what they lose is due to the test alone, and not to how their texts reduce depth.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, TypeAlias

import numpy as np

from .. import _arguments, _core
from .._types import words
from ..bounds import Boxes, Spheres
from ..camera import Camera
from ..device import Device
from ..resources import Pyramid

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["PublishedTest"]

#: A published test, by its author.
_Text: TypeAlias = Literal["rakos"] | Literal["arm"] | Literal["darnell"] | Literal["one_lookup"]

#: The bounds that each test takes.
_TAKES: Final[dict[str, type[Boxes | Spheres]]] = {
    "rakos": Boxes,
    "arm": Spheres,
    "darnell": Spheres,
    "one_lookup": Boxes,
}


class PublishedTest:
    """A published test of bounds in one view, without any promise.

    Unlike `Device.cull` it hides some instances that can be seen.
    It exists to be compared with: ``hizvk bench --texts`` counts what each text loses.

    Parameters
    ----------
    device : Device
        Where it runs.
    text : "rakos", "arm", "darnell" or "one_lookup"
        Whose test.
    bounds : Boxes or Spheres
        N bounds: boxes for ``"rakos"`` and ``"one_lookup"``, spheres for the others.
        They are rounded to float32 in world coordinates, as the texts do.
    camera : Camera
        A perspective camera with reversed depth.
    pyramid : Pyramid
        Of this camera's depth; its image is read, and its levels are made anew.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    hizvk.HizError
        What the device refuses.

    Examples
    --------
    The sphere contains the camera, and Darnell's test culls it behind a wall at depth 5:

    >>> import hizvk, numpy as np
    >>> device = hizvk.Device()
    >>> camera = hizvk.Camera.look_at(
    ...     (0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(64, 64), near=0.1
    ... )
    >>> ball = hizvk.Spheres([(0.1, 0.2, -0.5)], 2.0)
    >>> pyramid = device.pyramid(np.full(camera.size, 5.0), camera, kind="z")
    >>> test = hizvk.PublishedTest(device, "darnell", ball, camera, pyramid)
    >>> test.run()
    >>> test.mask.tolist(), device.cull(device.instances(ball), camera, pyramid).mask.tolist()
    ([False], [True])
    """

    #: What tells it from a certified result, which has no such attribute.
    uncertified = True

    def __init__(
        self, device: Device, text: _Text, bounds: Boxes | Spheres, camera: Camera, pyramid: Pyramid
    ) -> None:
        _arguments.instance("device", device, Device, "a Device")
        chosen = _arguments.choice("text", text, words(_Text))
        wanted = _TAKES[chosen]
        _arguments.instance("bounds", bounds, wanted, f"{wanted.__name__} for {chosen!r}")
        _arguments.instance("camera", camera, Camera, "a Camera")
        _arguments.instance("pyramid", pyramid, Pyramid, "a Pyramid")
        if len(bounds) == 0:
            raise ValueError("bounds: expected at least one, got none")
        if pyramid.camera.size != camera.size or not camera.reversed_z:
            raise ValueError(
                f"camera: expected a camera with reversed depth of the pyramid's size "
                f"{pyramid.camera.size}, got {camera!r}"
            )
        rows, near = _camera_rows(camera)
        levels = pyramid.mips()
        texels = np.concatenate([level.reshape(-1) for level in levels])
        self._count = len(bounds)
        self._inner = _core.TextCull(
            device._engine,
            chosen,
            _vectors(bounds),
            (rows, near),
            [level.shape for level in levels],
            texels,
        )

    def __len__(self) -> int:
        """The number of instances."""
        return self._count

    def run(self) -> None:
        """Runs the test and waits for it."""
        self._inner.run()

    @property
    def mask(self) -> npt.NDArray[np.bool_]:
        """``(N,)`` bool: what the last `run` kept; nothing before the first one."""
        return self._inner.mask()


def _vectors(bounds: Boxes | Spheres) -> npt.NDArray[np.float32]:
    """Boxes as two rows of four numbers each, spheres as one."""
    if isinstance(bounds, Spheres):
        given = np.column_stack([bounds.centers, np.broadcast_to(bounds.radii, len(bounds))])
    else:
        corners = np.stack([bounds.min, bounds.max], axis=1).reshape(-1, 3)
        given = np.column_stack([corners, np.ones(len(corners))])
    return np.ascontiguousarray(given, np.float32)


def _camera_rows(camera: Camera) -> tuple[npt.NDArray[np.float32], float]:
    """The rows of a camera's matrices and planes, and the distance of its near plane."""
    clip = np.array(camera.clip_from_world)
    forward_size = float(np.linalg.norm(clip[3, :3]))
    if forward_size == 0.0:
        raise ValueError(f"camera: expected a perspective camera, got {camera!r}")
    clip /= forward_size
    forward = clip[3, :3]
    right, up = (row - (row @ forward) * forward for row in clip[:2, :3])
    axes = np.stack([right / np.linalg.norm(right), up / np.linalg.norm(up), -forward])
    # The rows of x, y and w all vanish at the eye.
    eye = np.linalg.solve(clip[[0, 1, 3], :3], -clip[[0, 1, 3], 3])
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = axes, -axes @ eye
    projection = clip @ np.linalg.inv(view)
    # At view depth n the clip depth b - a n is n itself.
    a, b = projection[2, 2], projection[2, 3]
    w = clip[3]
    planes = np.stack([w + clip[0], w - clip[0], w + clip[1], w - clip[1], w - clip[2], clip[2]])
    size = np.linalg.norm(planes[:, :3], axis=1)
    # The far plane of an infinite projection is a constant, which nothing is outside of.
    endless = size < 1e-9 * np.abs(planes[:, 3])
    planes[endless] = (0.0, 0.0, 0.0, np.finfo(np.float32).max)
    planes[~endless] /= size[~endless, None]
    rows = np.concatenate([clip, view, projection, planes, [[*eye, 1.0]], [[*axes[1], 0.0]]])
    return np.ascontiguousarray(rows, np.float32), float(b / (1.0 + a))
