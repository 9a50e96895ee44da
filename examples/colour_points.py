"""Colours a point cloud from posed images: each point by the images that see it.

The cloud lies on both faces of a wall, which is red in front and blue behind.
Without the depth images each point would get both colours, and be purple.
"""

import numpy as np

import hizvk

RED, BLUE = (200, 30, 30), (30, 30, 200)
#: The wall's half sizes: 8 m wide, 4 m high and 40 cm thick.
HALF = np.array([4.0, 2.0, 0.2])


def wall() -> tuple[np.ndarray, np.ndarray]:
    """The vertices and triangles of the wall."""
    corners = HALF * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    quads = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
    return corners, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def main() -> None:
    """Takes five pictures from each side, and gives their colours to the points."""
    random = np.random.default_rng(5)
    positions = HALF * random.uniform(-0.99, 0.99, (50_000, 3))
    is_front = np.arange(len(positions)) % 2 == 0
    positions[:, 2] = np.where(is_front, HALF[2], -HALF[2])
    cloud = hizvk.Points(positions.astype(np.float32))

    device = hizvk.Device()
    mesh = device.occluders(*wall())
    views = []
    for x in (-6.0, -3.0, 0.0, 3.0, 6.0):
        for z, colour in ((7.0, RED), (-7.0, BLUE)):
            camera = hizvk.Camera.look_at(
                (x, 1.0, z), (0, 0, 0), fov_y_deg=60, size=(240, 320), near=0.1
            )
            depth = device.render_depth(mesh, camera)
            picture = np.full((*camera.size, 3), colour, np.uint8)
            views.append((camera, depth.numpy(), picture))

    # The points were rounded to float32, and so was the depth: a millimetre is plenty.
    seen = hizvk.colour_points(
        cloud,
        views,
        kind="reversed_ndc",
        tolerance=hizvk.Tolerance(abs=0.001),
        device=device,
        progress=lambda done, total: print(f"view {done} of {total}"),
    )
    truth = np.where(is_front[:, None], RED, BLUE)
    right = (seen.bytes() == truth).all(axis=1)
    mixed = (seen.colours[:, 0] > 31) & (seen.colours[:, 2] > 31)
    print(f"{len(cloud):,} points of {device.instances(cloud).device_bytes / len(cloud):.1f} bytes")
    print(f"red or blue as they are: {right.mean():.1%}; of both colours: {mixed.sum()}")


if __name__ == "__main__":
    main()
