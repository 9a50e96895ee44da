"""Draw arguments and lists as a renderer takes them.

A renderer in Rust binds these buffers on the device (`examples/simple.rs` of `hiz_core`).
This script reads them, for renderers that use another GPU interface.
"""

import numpy as np

import hizvk


def crowd() -> hizvk.Spheres:
    """600 balls in front of a wall at 10 m, then 400 behind it."""
    random = np.random.default_rng(5)
    before = random.uniform((-2.0, -1.0, -9.0), (2.0, 1.0, -4.0), (600, 3))
    behind = random.uniform((-5.0, -3.0, -40.0), (5.0, 3.0, -11.0), (400, 3))
    return hizvk.Spheres(np.concatenate([before, behind]), 0.1)


def main() -> None:
    """Culls with a list that is too small, then with one that is large enough."""
    device = hizvk.Device()
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(270, 480), near=0.1)
    hiz = device.pyramid(np.full(camera.size, 10.0), camera, kind="z")
    instances = device.instances(crowd())

    # The mesh of one instance; the cull adds the instance count.
    mesh = hizvk.DrawTemplate(index_count=36, first_index=12, base_vertex=-4)
    capacity = 256
    while True:
        seen = device.cull(
            instances,
            camera,
            hiz,
            outputs=["mask", "indices", "draws"],  # verdicts cost more, and are not drawn
            capacity=capacity,
            draw=mesh,
        )
        print(f"capacity {capacity}: {seen.count} of {seen.demand} kept instances are listed")
        if seen.count == seen.demand:
            break
        # A list that is too small ends at its capacity, and `demand` says what it needs.
        capacity = seen.demand

    # One record per piece, 20 bytes each, as in VkDrawIndexedIndirectCommand.
    draws, indices = seen.draws, seen.indices
    assert draws.dtype == hizvk.DRAW_DTYPE
    assert len(draws.tobytes()) == 20 * instances.num_pieces
    # The list holds the numbers of the instances: a vertex shader looks up their transforms.
    assert np.array_equal(indices, np.flatnonzero(seen.mask))
    index_count, instance_count, first_index, base_vertex, first_instance = draws[0]
    print(f"draw {instance_count} instances from {first_instance} on,", end=" ")
    print(f"{index_count} indices from {first_index} on, base vertex {base_vertex}")


if __name__ == "__main__":
    main()
