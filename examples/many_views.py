"""What can be seen from the views of a camera path: their potentially visible set.

The cameras go around a house.
Balls stand inside of the house and around it.
The union of the masks says what these views need; it says nothing about views between them.
"""

import numpy as np
import numpy.typing as npt

import hizvk

VIEWS, INSIDE, AROUND = 24, 100, 60


def house() -> hizvk.Mesh:
    """A closed box, 8 m wide and 4 m high."""
    sides = np.array([(x, y, z) for x in (-4, 4) for y in (0, 4) for z in (-4, 4)], np.float64)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return hizvk.Mesh(sides, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def balls() -> hizvk.Spheres:
    """First those inside, then a ring around the house."""
    inside = np.random.default_rng(2).uniform((-3, 1, -3), (3, 3, 3), (INSIDE, 3))
    angle = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    ring = np.stack([8.0 * np.cos(angle), np.full(AROUND, 1.0), 8.0 * np.sin(angle)], axis=1)
    return hizvk.Spheres(np.concatenate([inside, ring]), 0.2)


def path() -> list[hizvk.Camera]:
    """Cameras on a circle of 20 m, 6 m above the ground, that look at the house."""
    angles = 2.0 * np.pi * np.arange(VIEWS) / VIEWS
    return [
        hizvk.Camera.look_at(
            (20.0 * np.cos(a), 6.0, 20.0 * np.sin(a)),
            (0.0, 2.0, 0.0),
            fov_y_deg=60,
            size=(360, 640),
            near=0.1,
        )
        for a in angles
    ]


def report(name: str, ever: npt.NDArray[np.bool_]) -> None:
    """Says how many balls of each kind are seen."""
    print(f"seen from {name}: {ever[:INSIDE].sum()} inside, {ever[INSIDE:].sum()} around")


def main() -> None:
    """Culls once per camera; executor=4 would do it in four processes."""
    seen = hizvk.sweep(balls(), path(), occluders=house(), descent=256)
    report("the first view", seen.mask(0))
    report(f"{VIEWS} views", seen.union())


if __name__ == "__main__":
    main()
