"""Draws boxes front to back, and leaves out each one that is hidden by those before it."""

import numpy as np

import hizvk

rng = np.random.default_rng(1)
centers = rng.uniform((-6, -4, -30), (6, 4, -6), (60, 3))
half = rng.uniform(0.5, 2.0, (60, 3))
corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
triangles = [[a, b, c] for a, b, c, d in faces] + [[a, c, d] for a, b, c, d in faces]

device = hizvk.Device()
camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(180, 320), near=0.1)
boxes = device.occluders([(c + h * corners, triangles) for c, h in zip(centers, half, strict=True)])
depth = device.render_depth(boxes, camera, only=[])
hiz = device.pyramid(depth)

drawn = []
for i in np.argsort(-centers[:, 2]):  # the view runs along -z
    box = hizvk.Boxes(centers[[i]] - half[[i]], centers[[i]] + half[[i]])
    if device.cull(device.instances(box), camera, hiz, outputs=["mask"]).mask[0]:
        touched = device.render_depth(boxes, into=depth, only=[i])
        hiz.update(depth, touched)
        drawn.append(i)

anew = device.pyramid(depth)
same = all(np.array_equal(hiz.level(k), anew.level(k)) for k in range(hiz.num_levels))
everything = device.render_depth(boxes, camera).numpy()
print(f"{len(drawn)} of {len(centers)} boxes drawn")
print(f"levels as of a new pyramid: {same}")
print(f"depth as of all boxes: {np.array_equal(depth.numpy(), everything)}")
