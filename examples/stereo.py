"""Culls for the two eyes of a headset in one call, and draws one list for both.

A pillar stands before the eyes.
Each eye sees balls that the other one does not: a list of what one eye sees would let them vanish.
"""

import numpy as np

import hizvk

BALLS, APART = 4000, 0.064  # metres between the eyes


def main() -> None:
    """Compares the list of both eyes with those of one eye each."""
    random = np.random.default_rng(8)
    device = hizvk.Device()
    corners = [[-0.3, -3, -1.5], [0.3, -3, -1.5], [0.3, 3, -1.5], [-0.3, 3, -1.5]]
    pillar = device.occluders(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]))
    crowd = device.instances(
        hizvk.Spheres(random.uniform((-4, -2, -20), (4, 2, -3), (BALLS, 3)), 0.02)
    )

    eyes = [
        hizvk.Camera.look_at((x, 0, 0), (x, 0, -1), fov_y_deg=90, size=(400, 400), near=0.05)
        for x in (-APART / 2, APART / 2)
    ]
    pyramids = [device.pyramid(device.render_depth(pillar, eye)) for eye in eyes]

    # One submission and one readback: a mask per eye, and one list for a draw of both.
    seen = device.cull(crowd, eyes, pyramids, outputs=["mask", "indices", "draws"])
    left, right = seen.mask
    print(
        f"left eye: {left.sum()}, right eye: {right.sum()}, drawn: {seen.draws['instance_count']}"
    )
    assert np.array_equal(seen.indices, np.flatnonzero(left | right))

    # A shader that draws the list for both eyes reads these two bits of each instance.
    bits = left[seen.indices] + 2 * right[seen.indices]
    one_eye = [int(np.count_nonzero(bits == eye)) for eye in (1, 2)]
    print(f"only the left eye sees {one_eye[0]}, only the right eye {one_eye[1]}")

    for eye, pyramid, mask in zip(eyes, pyramids, seen.mask, strict=True):
        assert np.array_equal(device.cull(crowd, eye, pyramid).mask, mask)
    print(f"a list of one eye would lose balls of the other: {min(one_eye) > 0}")


if __name__ == "__main__":
    main()
