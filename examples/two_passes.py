"""Draws each frame in two passes: what was visible first, then what that does not hide.

A door opens in a street of boxes.
Last frame's answer as this frame's loses what the door has hidden.
As an early set it loses nothing, since the late pass tests all the others.
"""

import numpy as np

import hizvk

FRAMES = 12
OPENS = 6
NEAR_BOXES, FAR_BOXES = 40, 400

CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
TRIANGLES = np.array([[side[i] for i in (0, 1, 2, 0, 2, 3)] for side in SIDES]).reshape(-1, 3)


def boxes(frame: int) -> tuple[np.ndarray, np.ndarray]:
    """Centres and half sizes: the door, boxes in front of it, and boxes behind it."""
    random = np.random.default_rng(2)
    near = random.uniform((-6.0, -3.0, -9.0), (6.0, 3.0, -5.0), (NEAR_BOXES, 3))
    far = random.uniform((-9.0, -5.0, -40.0), (9.0, 5.0, -14.0), (FAR_BOXES, 3))
    door = [[0.0 if frame < OPENS else 80.0, 0.0, -12.0]]
    half = np.full((1 + NEAR_BOXES + FAR_BOXES, 3), 0.3)
    half[0] = (40.0, 40.0, 0.1)
    return np.concatenate([door, near, far]), half


def transforms(center: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Matrices that put a cube of side 2 there."""
    matrices = np.zeros((len(center), 4, 4))
    matrices[:, range(3), range(3)], matrices[:, :3, 3], matrices[:, 3, 3] = half, center, 1.0
    return matrices


def main() -> None:
    """Draws each frame in two ways, and counts the pixels that differ from all boxes."""
    device = hizvk.Device()
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(135, 240), near=0.1)
    center, half = boxes(0)
    crowd = device.instances(hizvk.Boxes(center - half, center + half))
    drawn = device.occluders(hizvk.Mesh(CORNERS, TRIANGLES, transforms(center, half)))
    culler = device.temporal(crowd)
    seen = np.ones(len(crowd), bool)
    lost = np.zeros(3, int)

    for frame in range(FRAMES):
        center, half = boxes(frame)
        crowd.update(0, hizvk.Boxes(center - half, center + half))
        drawn.move(0, transforms(center, half))
        all_of_it = device.render_depth(drawn, camera).numpy()

        # Right: what was visible is drawn early, and the late pass finds the rest.
        early = culler.early(camera)
        depth = device.render_depth(drawn, camera, only=early)
        late = culler.late(camera, depth, depth_slack=1e-4)
        device.render_depth(drawn, into=depth, only=late)

        # Wrong: the answer of the frame before is drawn, and nothing else.
        stale = device.render_depth(drawn, camera, only=seen)
        # The same mask is a fine early set, by hand: draw it, cull, and draw what is new.
        by_hand = device.render_depth(drawn, camera, only=seen)
        kept = device.cull(crowd, camera, device.pyramid(by_hand), depth_slack=1e-4).mask
        device.render_depth(drawn, into=by_hand, only=kept & ~seen)
        seen = kept

        lost += [int((image.numpy() != all_of_it).sum()) for image in (depth, by_hand, stale)]
        print(f"frame {frame}: {early.count} drawn early and {late.count} late of {len(crowd)}")
    print(
        f"pixels lost: {lost[0]} by two passes, {lost[1]} by hand; "
        f"the stale answer loses some: {lost[2] > 0}"
    )


if __name__ == "__main__":
    main()
