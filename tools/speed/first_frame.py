"""The first frames of a fresh process: `first_frame.py SCENE KIND`, where SCENE is an npz file.

KIND is ``warmed`` to record and run a warm-up before them, or ``unwarmed``.
The frames are a renderer's, recorded in Rust: occluders, reduction, cull.
Prints milliseconds as a JSON list:

- the warm-up; 0 without it,
- the longest `record_*` call of the first frame,
- the first frame on the device,
- the longest `record_*` call and the device's time of the later frames, as medians.
"""

import json
import sys

import numpy as np

import hizvk
from hizvk import _core

FRAMES = 12

scene = np.load(sys.argv[1])
device = hizvk.Device()
occluders = device.occluders(scene["vertices"], scene["triangles"])
crowd = device.instances(hizvk.Boxes(scene["low"], scene["high"]))
# The camera moves from frame to frame.
cameras = [
    hizvk.Camera.look_at(
        (0.1 * number, 0, 2),
        (0.1 * number, 100, 2),
        up=(0, 0, 1),
        fov_y_deg=60,
        size=(1080, 1920),
        near=0.125,
    )._inner
    for number in range(FRAMES)
]
device.wait()
warm_up, frames = _core.Yardstick(device._engine).frames(
    crowd._inner, occluders._inner, cameras, sys.argv[2] == "warmed"
)
longest = [max(recorded) for *recorded, _ in frames]
on_device = [frame[-1] for frame in frames]
later = [float(np.median(times[1:])) for times in (longest, on_device)]
print(json.dumps([warm_up, longest[0], on_device[0], *later]))
