"""A fresh process up to its first mask: `first_mask.py SCENE`, where SCENE is an npz file.

Prints seconds as a JSON list:

- the import of numpy and hizvk,
- opening the device,
- the way from arrays to the first mask,
- the same way once more.

Reading the scene is not counted.
Nothing is imported before the clock starts but what the interpreter needs.
"""
# ruff: noqa: E402  (the order of imports is what is measured)

import json
import sys
import time

start = time.perf_counter()
import numpy as np

after_numpy = time.perf_counter()
scene = np.load(sys.argv[1])
arrays = [scene[name] for name in ("low", "high", "vertices", "triangles")]
loaded = time.perf_counter()
import hizvk

imported = time.perf_counter()
device = hizvk.Device()
opened = time.perf_counter()


def way() -> None:
    """From arrays to a mask."""
    low, high, vertices, triangles = arrays
    camera = hizvk.Camera.look_at(
        (0, 0, 2), (0, 100, 2), up=(0, 0, 1), fov_y_deg=60, size=(1080, 1920), near=0.125
    )
    depth = device.render_depth(device.occluders(vertices, triangles), camera)
    crowd = device.instances(hizvk.Boxes(low, high))
    _ = device.cull(crowd, camera, device.pyramid(depth)).mask


way()
first = time.perf_counter()
way()
second = time.perf_counter()
imports = after_numpy - start + imported - loaded
print(json.dumps([imports, opened - imported, first - opened, second - first]))
