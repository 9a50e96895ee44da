"""Ten spheres in a line: test, render, update, one after the other.

The camera looks along the line, so the first sphere hides the other nine.
The depth image and its pyramid stay on the device: no depth is read back.
With a path, the script writes a PNG of the depth complexity: how many spheres each pixel shows or
hides, of all of them on the left and of those that were drawn on the right.
"""

import struct
import sys
import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt

import hizvk

if "--help" in sys.argv:
    print(__doc__)
    sys.exit()

N, SIDE, SIZE = 10, 24, (180, 240)

# A sphere of 24 meridians and 23 circles, and ten copies of it along the view.
phi, theta = np.meshgrid(np.arange(SIDE) * 2 * np.pi / SIDE, np.linspace(0, np.pi, SIDE))
ball = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], -1)
a = np.arange(SIDE * (SIDE - 1)).reshape(-1, SIDE)
b, c, d = np.roll(a, -1, axis=1), a + SIDE, np.roll(a, -1, axis=1) + SIDE
triangles = np.stack([a, c, b, b, c, d], -1).reshape(-1, 3)
centers = np.array([(0.0, 0.0, -4.0 - 4.0 * i) for i in range(N)])
places = np.tile(np.eye(4), (N, 1, 1))
places[:, :3, 3] = centers

device = hizvk.Device()
camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.1)
spheres = device.occluders(hizvk.Mesh(ball.reshape(-1, 3), triangles, places))
tested = [device.instances(hizvk.Spheres(center[None], 1.0)) for center in centers]
depth = device.render_depth(spheres, camera, only=[])
hiz = device.pyramid(depth)

drawn = []
for i in range(N):
    if device.cull(tested[i], camera, hiz, outputs=["mask"], descent=64).mask[0]:
        touched = device.render_depth(spheres, into=depth, only=[i])
        hiz.update(depth, touched)
        drawn.append(i)


def complexity(indices: list[int]) -> npt.NDArray[np.uint8]:
    """Spheres per pixel, by the rays through the pixels' centres."""
    rows, columns = np.indices(SIZE)
    scale = np.tan(np.radians(30)) / (SIZE[0] / 2)
    x, y = (columns + 0.5 - SIZE[1] / 2) * scale, (rows + 0.5 - SIZE[0] / 2) * scale
    # A ray meets a ball on the axis at an angle whose sine is at most radius / distance.
    sine = np.sqrt((x * x + y * y) / (1 + x * x + y * y))
    count: npt.NDArray[np.uint8] = np.zeros(SIZE, np.uint8)
    for i in indices:
        count += sine <= 1.0 / -centers[i, 2]
    return count


for path in sys.argv[1:]:
    image = 25 * np.hstack([complexity(list(range(N))), complexity(drawn)])
    chunks = {b"IHDR": struct.pack(">2I5B", *image.shape[::-1], 8, 0, 0, 0, 0)}
    chunks |= {
        b"IDAT": zlib.compress(b"".join(b"\0" + row.tobytes() for row in image)),
        b"IEND": b"",
    }
    packed = (
        struct.pack(">I", len(v)) + k + v + struct.pack(">I", zlib.crc32(k + v))
        for k, v in chunks.items()
    )
    Path(path).write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(packed))

print(f"{len(drawn)} drawn, {N - len(drawn)} skipped")
