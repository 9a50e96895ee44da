"""Shadow casters: those of the sun and of a lamp whose shadows the camera can see.

Only the ground receives shadows here, so the depth image is that of the ground.
The sun's casters are culled along its direction.
The lamp has a shadow map with six faces, and each face has a receiver mask.
"""

import numpy as np

import hizvk

CASTERS = 20_000
SUN, LAMP = np.array([0.6, -0.7, 0.2]), np.array([3.0, 8.0, 6.0])
AXES = np.concatenate([np.eye(3), -np.eye(3)])


def shadowed(
    points: np.ndarray, rays: np.ndarray, centers: np.ndarray, radius: float
) -> np.ndarray:
    """Which points have a sphere between them and the light; `rays` lead to the light."""
    far = np.linalg.norm(rays, axis=1)
    toward = rays / far[:, None]
    found = np.zeros(len(points), bool)
    for center in centers:
        along = ((center - points) * toward).sum(axis=1)
        beside = np.linalg.norm(center - points - along[:, None] * toward, axis=1)
        found |= (beside <= radius) & (along > 0) & (along < far)
    return found


def main() -> None:
    """Culls casters of both lights, and counts the pixels whose shadow is lost."""
    random = np.random.default_rng(7)
    device = hizvk.Device()
    camera = hizvk.Camera.look_at((0, 6, 20), (0, 0, 0), fov_y_deg=50, size=(54, 96), near=0.1)
    ground = np.array([[-300.0, 0, -300], [-300, 0, 300], [300, 0, -300], [300, 0, 300]])
    depth = device.render_depth(device.occluders(ground, np.array([[0, 1, 2], [1, 3, 2]])), camera)
    centers = random.uniform((-150, 0.5, -150), (150, 25, 150), (CASTERS, 3))
    casters = device.instances(hizvk.Spheres(centers, 0.4))

    # The sun: everything that receives lies in a flat box.
    sun = hizvk.DirectionalLight(SUN, receivers=((-300, 0, -300), (300, 0, 300)))
    receivers = device.pyramid(depth, depths="receivers")
    of_sun = device.cull(casters, camera, receivers, shadow=sun).mask
    print(f"sun: {of_sun.sum()} of {CASTERS} casters are drawn")

    # The lamp: six cameras, each with the farthest receivers that it sees.
    faces = [
        hizvk.Camera.look_at(LAMP, LAMP + axis, up=up, fov_y_deg=90, size=(256, 256), near=0.1)
        for axis in AXES
        for up in [(0, 0, 1) if axis[1] else (0, 1, 0)]
    ]
    masks = [device.receiver_mask(depth, camera, face, filter_radius=0.05) for face in faces]
    seen = device.cull(casters, faces, [device.pyramid(mask) for mask in masks])
    of_lamp = seen.mask.any(axis=0)
    print("lamp:", ", ".join(str(count) for count in seen.counts), "casters in its six faces")

    # What the camera sees of the ground, and its shadows with all casters and without the culled.
    image = depth.numpy().astype(float)
    height, width = image.shape
    x, y = np.meshgrid(
        (np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2
    )
    ndc = np.stack([x, y, image, np.ones_like(image)], -1)[image > 0]
    world = ndc @ np.linalg.inv(np.asarray(camera.clip_from_world)).T
    points = world[:, :3] / world[:, 3:]
    to_sun = np.broadcast_to(-1e3 * SUN, points.shape)
    lost = []
    for rays, kept in ((to_sun, of_sun), (LAMP - points, of_lamp)):
        lost.append(shadowed(points, rays, centers[~kept], 0.4).sum())
    print(f"pixels that lose a shadow: {lost[0]} of the sun's, {lost[1]} of the lamp's")


if __name__ == "__main__":
    main()
