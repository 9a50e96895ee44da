"""What a cull did, as one HTML page that turns and zooms in any browser, without a network.

Two walls and the ground hide boxes on a plain.
With a path, such as seen.html, the script writes the page there.
`seen.plot()` and `hiz.plot()` draw figures, where matplotlib is installed; a notebook shows `seen`
and `hiz` as they are.
"""

import sys
from pathlib import Path

import numpy as np

import hizvk

if "--help" in sys.argv:
    print(__doc__)
    sys.exit()

device = hizvk.Device()
camera = hizvk.Camera.look_at((0, 1.7, 0), (0, 1.5, -1), fov_y_deg=60, size=(270, 480), near=0.1)
quads = np.array(
    [
        [(-6, 0, -10), (3, 0, -10), (3, 4, -10), (-6, 4, -10)],
        [(4, 0, -20), (12, 0, -20), (12, 6, -20), (4, 6, -20)],
        [(-60, 0, 0), (60, 0, 0), (60, 0, -90), (-60, 0, -90)],
    ],
    float,
)
walls = [hizvk.Mesh(quad, [(0, 1, 2), (0, 2, 3)]) for quad in quads]
hiz = device.pyramid(device.render_depth(device.occluders(walls), camera))

# 200 boxes before the first wall, and 200 behind it, where its shadow is wide enough for all.
rng = np.random.default_rng(1)
before = rng.uniform((-3, 0.2, -8), (2, 1.5, -5), (200, 3))
behind = rng.uniform((-6, 0.2, -25), (3, 1.5, -15), (200, 3))
low = np.concatenate([before, behind])
boxes = hizvk.Boxes(low, low + 0.3)
seen = device.cull(device.instances(boxes), camera, hiz)

# Depth is stored in NDC; people read metres.
print(f"level 3 begins at {hiz.level(3, kind='z').min():.1f} m")
told = seen.explain(300)
assert told.farthest_z is not None
assert told.nearest_z is not None
print(f"box 300 begins at {told.nearest_z:.1f} m, all before it ends at {told.farthest_z:.1f} m")

if len(sys.argv) > 1:
    page = Path(sys.argv[1])
    seen.save_html(page, occluders=walls, title="Boxes before and behind a wall")
    print(f"{page} has {page.stat().st_size // 1000} kB; open it in a browser")
stats = seen.stats
print(f"white: {stats.kept} kept, red: {stats.occluded} culled")
