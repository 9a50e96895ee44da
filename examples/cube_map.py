"""Culls for the six faces of a cube map in one call.

A lamp hangs in a room with one door.
What it lights lies in the room, or in the corridor as far as the door lets light through.
"""

import numpy as np

import hizvk

FACES = ("+x", "-x", "+y", "-y", "+z", "-z")


def room() -> tuple[np.ndarray, np.ndarray]:
    """A cube of 4 m, whose side at +x has a door of 1 m, all in quads."""
    a, door = 2.0, 0.5
    corners = [(x, y, z) for x in (-a, a) for y in (-a, a) for z in (-a, a)]
    quads = [(0, 1, 3, 2), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    for side in (-1, 1):
        first = len(corners)
        corners += [(a, y, side * z) for y, z in ((-a, door), (a, door), (a, a), (-a, a))]
        quads.append((first, first + 1, first + 2, first + 3))
    triangles = [t for p, q, r, s in quads for t in ((p, q, r), (p, r, s))]
    return np.array(corners), np.array(triangles)


def main() -> None:
    """Lights balls in the room, behind the door, and behind the walls."""
    device = hizvk.Device()
    walls = device.occluders(*room())
    random = np.random.default_rng(6)
    within = random.uniform(-1.5, 1.5, (500, 3))
    corridor = random.uniform((4, -1.5, -0.2), (8, 1.5, 0.2), (300, 3))
    behind = random.uniform((-9, -1.5, -1.5), (-4, 1.5, 1.5), (400, 3))
    balls = device.instances(hizvk.Spheres(np.concatenate([within, corridor, behind]), 0.05))

    cameras = hizvk.cube((0, 0, 0), size=256, near=0.01)
    pyramids = [device.pyramid(device.render_depth(walls, camera)) for camera in cameras]
    seen = device.cull(balls, cameras, pyramids, descent=256)
    for name, count in zip(FACES, seen.counts, strict=True):
        print(f"face {name}: {count} balls")
    lit = seen.any
    places = {"in the room": lit[:500], "behind the door": lit[500:800], "behind walls": lit[800:]}
    print("lit:", ", ".join(f"{part.sum()} {where}" for where, part in places.items()))


if __name__ == "__main__":
    main()
