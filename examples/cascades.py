"""Shadow casters of cascades: what the light sees, and then each slice of the view.

The light's cull runs once, against a depth image of what shades all of the scene.
Each cascade asks for what that cull has kept, within its own slice: light's verdict AND slice.
The light's answer stays on the device.
"""

import numpy as np

import hizvk

CASTERS, SLICES = 20_000, ((0.0, 30.0), (30.0, 90.0), (90.0, 200.0))


def light(x: float, half: float, size: int) -> hizvk.Camera:
    """Looks down on a square about `x`, with parallel rays."""
    return hizvk.Camera.orthographic(
        (x, 60, 0),
        (x, 0, 0),
        up=(0, 0, -1),
        height=2 * half,
        size=(size, size),
        near=0.0,
        far=100.0,
    )


def main() -> None:
    """Culls casters that stand under a roof and beside it."""
    random = np.random.default_rng(4)
    device = hizvk.Device()
    corners = [[0, 20, -40], [90, 20, -40], [90, 20, 40], [0, 20, 40]]
    roof = device.occluders(np.array(corners, float), np.array([[0, 1, 2], [0, 2, 3]]))
    centers = random.uniform((0, 0, -100), (200, 10, 100), (CASTERS, 3))
    casters = device.instances(hizvk.Spheres(centers, 0.5))

    whole = light(100.0, 110.0, 512)
    lit = device.cull(casters, whole, device.pyramid(device.render_depth(roof, whole)))
    print(f"the light sees {lit.count} of {CASTERS}: the roof shades the others")

    # The cascades have maps of their own; nothing is drawn into them yet, so nothing hides there.
    cameras = [light((a + b) / 2, (b - a) / 2, 256) for a, b in SLICES]
    empty = [device.pyramid(np.zeros(one.size), one, kind=one.depth_kind) for one in cameras]
    seen = device.cull(casters, cameras, empty, among=lit)
    alone = device.cull(casters, cameras, empty)
    for (a, b), of_light, of_slice in zip(SLICES, seen.counts, alone.counts, strict=True):
        print(f"{a:3.0f} to {b:3.0f} m: {of_slice} casters in the slice, {of_light} of them lit")
    assert np.array_equal(seen.mask, alone.mask & lit.mask)
    print(f"lit AND in the slice: {np.array_equal(seen.any, alone.any & lit.mask)}")


if __name__ == "__main__":
    main()
