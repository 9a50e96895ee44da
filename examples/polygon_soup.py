"""Culls a polygon soup by itself: its triangles are the occluders, and the instances.

The soup has no connectivity and comes in random order.
`hizvk.split_mesh` cuts it into groups of neighbours, and a mask of groups leads back to triangles.
"""

import numpy as np
import numpy.typing as npt

import hizvk

Soup = npt.NDArray[np.float64]


def panel(random: np.random.Generator, half: float, z: float, count: int) -> Soup:
    """``(2 count^2, 3, 3)``: a square across the view, of triangles in random order."""
    step = 2.0 * half / count
    x, y = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
    low = np.stack([x, y], axis=-1).reshape(-1, 1, 2) * step - half
    corner = low + step * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    flat = np.concatenate([corner[:, [0, 1, 2]], corner[:, [0, 2, 3]]])
    soup = np.concatenate([flat, np.full((*flat.shape[:2], 1), z)], axis=2)
    return soup[random.permutation(len(soup))]


def main() -> None:
    """Cuts three panels into groups and culls them; the first one hides the last one."""
    random = np.random.default_rng(7)
    wall, beside = panel(random, 3.0, -10.0, 200), panel(random, 12.0, -30.0, 300)
    hidden = panel(random, 4.0, -20.0, 300)
    soup = np.concatenate([wall, beside, hidden])
    place = np.repeat(np.arange(3), [len(wall), len(beside), len(hidden)])
    mixed = random.permutation(len(soup))
    soup, place = soup[mixed], place[mixed]

    split = hizvk.split_mesh(soup, cell=1.0)
    print(f"{len(soup):,} triangles in {len(split):,} groups")

    device = hizvk.Device()
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(540, 960), near=0.1)
    depth = device.render_depth(device.occluders(split.mesh()), camera)
    seen = device.cull(device.instances(split.boxes), camera, device.pyramid(depth))
    kept = split.triangle_mask(seen.mask)

    # A renderer would draw these ranges of the index buffer `split.triangles`.
    first, count = 3 * split.offsets[:-1][seen.mask], 3 * np.diff(split.offsets)[seen.mask]
    print(f"{len(first):,} draws of {count.sum() // 3:,} triangles")
    shares = [f"{100 * kept[place == k].mean():.0f} %" for k in range(3)]
    print(f"kept: {shares[0]} of the wall, {shares[2]} of what it hides")


if __name__ == "__main__":
    main()
