"""Large things in rows, with small things and eyes where the rows' corners are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from .grid import apart, on_grid
from .scene import Scene, View, box_mesh

if TYPE_CHECKING:
    import numpy.typing as npt

    from .grid import Floats

__all__ = ["Rows"]

#: The height of eyes, in metres.
EYE: Final = 1.703125


@dataclass(frozen=True)
class Rows:
    """A square of places for large things; small things and eyes stand between four of them."""

    side: int
    """Places along each side."""
    pitch: float
    """Metres from place to place."""

    @classmethod
    def of(cls, count: int, pitch: float) -> Rows:
        """The least square of `count` places."""
        return cls(int(np.ceil(np.sqrt(count))), pitch)

    @property
    def middles(self) -> Floats:
        """``(N, 2)``: x and y of the places, on the ground."""
        along = np.arange(self.side)
        cells = np.stack(np.meshgrid(along, along, indexing="ij"), -1).reshape(-1, 2)
        return np.asarray(cells * self.pitch, np.float64)

    def scene(
        self,
        rng: np.random.Generator,
        name: str,
        hiding: tuple[Floats, npt.NDArray[np.uint32]],
        *,
        things: int,
        beside: tuple[float, float],
        up_to: float,
        sizes: tuple[float, float],
        views: int,
        called: str,
    ) -> Scene:
        """The scene of what stands at the places, with things and eyes between.

        Parameters
        ----------
        rng : np.random.Generator
            Places things and eyes.
        name : str
            Of the scene.
        hiding : vertices and triangles
            What stands at the places.
        things : int
            Instances: boxes.
        beside, sizes : (least, most)
            How far a box begins from its corner, along x and y, and its sides.
        up_to : float
            How high above the ground a box may begin.
        views : int
            Eyes at corners without a box.
        called : str
            What an eye's name begins with.
        """
        places, corners = apart(rng, self.side, views, things)
        low = np.zeros((things, 3))
        corner = on_grid((corners + 0.5) * self.pitch)
        low[:, :2] = on_grid(corner + rng.uniform(*beside, (things, 2)))
        low[:, 2] = on_grid(rng.uniform(0.0, up_to, things))
        high = low + on_grid(rng.uniform(*sizes, (things, 3)))
        shape, faces = box_mesh(low, high)
        middle = 0.5 * (self.side - 1) * self.pitch
        return Scene(
            name=name,
            origin=(middle, middle, 0.0),
            vertices=hiding[0],
            triangles=hiding[1],
            instance_vertices=shape,
            instance_triangles=faces,
            owner=np.repeat(np.arange(things, dtype=np.int32), 12),
            box_min=low,
            box_max=high,
            views=tuple(
                _view(rng, f"{called} {number}", place)
                for number, place in enumerate((places + 0.5) * self.pitch)
            ),
        )


def _view(rng: np.random.Generator, name: str, place: Floats) -> View:
    """A view from eye height in any direction."""
    eye = on_grid([*place, EYE])
    heading = rng.uniform(0.0, 2.0 * np.pi)
    target = eye + np.array([10.0 * np.cos(heading), 10.0 * np.sin(heading), 0.0])
    return View(name, tuple(eye.tolist()), tuple(target.tolist()), 60.0, 0.125)
