"""Compares culls with the exact oracle: false culls, which are bugs, and false keeps, which cost.

The oracle (`hizvk.reference`) looks at every pixel that an instance can meet.
It runs on the CPU, in float64 and exact arithmetic, and shares no code with the engine.
"""

from typing import Any

import numpy as np

import hizvk
from hizvk import reference


def city(random: np.random.Generator) -> list[hizvk.Mesh]:
    """40 towers: each is one square that faces the camera."""
    square = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 6.0, 0.0], [-1.0, 6.0, 0.0]])
    places = random.uniform((-12.0, -2.0, -30.0), (12.0, 0.0, -10.0), (40, 3))
    return [hizvk.Mesh(square + place, np.array([[0, 1, 2], [0, 2, 3]])) for place in places]


def main() -> None:
    """Culls in three ways, and asks the oracle about each."""
    random = np.random.default_rng(13)
    device = hizvk.Device()
    camera = hizvk.Camera.look_at((0, 2, 0), (0, 2, -1), fov_y_deg=60, size=(180, 320), near=0.1)
    depth = device.render_depth(device.occluders(city(random)), camera)
    hiz = device.pyramid(depth)
    centers = random.uniform((-15.0, -2.0, -50.0), (15.0, 6.0, -10.0), (2000, 3))
    balls = hizvk.Spheres(centers, random.uniform(0.1, 1.0, 2000))
    crowd = device.instances(balls)

    # "pixel" takes the depth that the bounds have in each pixel, as fit="volume" does.
    truth = reference.classify(
        balls, camera, depth.numpy(), kind=camera.depth_kind, own_depth="pixel"
    )

    ways: dict[str, dict[str, Any]] = {
        "default": {},
        "descent": {"descent": 4096},
        "volume": {"descent": 4096, "fit": "volume"},
    }
    false_culls, false_keeps = 0, []
    for name, options in ways.items():
        found = hizvk.compare(device.cull(crowd, camera, hiz, **options).mask, truth)
        print(f"{name:>8}: {found}")
        false_culls += len(found.false_culls)
        false_keeps.append(len(found.false_keeps))
    # Each way reads more than the one before it, and keeps less that is hidden.
    assert false_keeps == sorted(false_keeps, reverse=True)
    print(f"{false_culls} false culls; false keeps: {', '.join(map(str, false_keeps))}")


if __name__ == "__main__":
    main()
