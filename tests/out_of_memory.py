"""Runs one call in a process with a limited address space; test_out_of_memory.py starts it.

``out_of_memory.py CALL MEBIBYTES`` prepares everything without a limit.
Then the call may take that much more.
It prints the exception's class.
After that it prints what the next device keeps of two spheres, in front of and behind a wall.
"""

import resource
import sys
from collections.abc import Callable

import numpy as np

import hizvk

SIDE = 8192
COUNT = 12_000_000


def camera(side: int) -> hizvk.Camera:
    """A camera that looks along -z."""
    return hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(side, side), near=0.1)


def works(device: hizvk.Device) -> list[bool]:
    """Which of two spheres the device keeps: one in front of a wall, one behind it."""
    spheres = hizvk.Spheres(np.array([[0.0, 0, -5], [0, 0, -20]]), 1.0)
    view = camera(64)
    pyramid = device.pyramid(np.full(view.size, 10.0), view, kind="z")
    seen: list[bool] = device.cull(device.instances(spheres), view, pyramid).mask.tolist()
    return seen


def prepared(device: hizvk.Device, call: str) -> Callable[[], object]:
    """The call, with its arguments prepared."""
    view = camera(SIDE)
    if call == "instances":
        spheres = hizvk.Spheres(np.zeros((COUNT, 3), np.float32), np.ones(COUNT, np.float32))
        return lambda: device.instances(spheres)
    if call == "occluders":
        vertices, triangles = np.zeros((COUNT, 3)), np.zeros((COUNT, 3), np.uint32)
        return lambda: device.occluders(vertices, triangles)
    if call == "convert":
        image = np.full(view.size, 10.0, np.float32)
        return lambda: device.pyramid(image, view, kind="z")
    if call == "upload":
        image = np.full(view.size, 0.1, np.float32)
        return lambda: device.pyramid(image, view, kind="reversed_ndc")
    if call == "cull":
        # So many instances that all levels would be copied into one texture of 100 MB.
        view = camera(4096)
        pyramid = device.pyramid(np.full(view.size, 10.0), view, kind="z")
        centers = np.zeros((6_000_000, 3), np.float32)
        centers[:, 2] = -20.0
        crowd = device.instances(
            hizvk.Spheres(centers, np.ones(len(centers), np.float32)), order="given"
        )
        few = device.instances(hizvk.Spheres(centers[:100], np.ones(100, np.float32)))
        # Of the memory that wgpu has already taken, these leave less than that texture needs.
        others = device.instances(hizvk.Spheres(centers[:2_000_000], 1.0), order="given")

        def cull(instances: hizvk.Instances) -> int:
            result = device.cull(instances, view, pyramid, hierarchy=False, outputs=["mask"])
            return int(np.count_nonzero(result.mask))

        # Done before the limit, because compilers take memory of their own.
        assert cull(few) == 0
        without = pyramid.device_bytes

        def cull_many() -> str:
            kept = cull(crowd)
            copied = pyramid.device_bytes - without
            return f"{kept} kept, {copied} bytes copied beside {len(others)} others"

        return cull_many
    assert call == "render"
    occluders = device.occluders(np.zeros((3, 3)), [[0, 1, 2]])
    return lambda: device.render_depth(occluders, view).numpy()


def main(call: str, mebibytes: int) -> None:
    """Run the call; the module's docstring says what is printed."""
    device = hizvk.Device()
    works(device)
    run = prepared(device, call)
    with open("/proc/self/statm", encoding="ascii") as file:
        now = int(file.read().split()[0]) * resource.getpagesize()
    unlimited = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (now + (mebibytes << 20), unlimited[1]))
    try:
        print("no error:", run())
    except hizvk.HizError as error:
        print(type(error).__name__)
    resource.setrlimit(resource.RLIMIT_AS, unlimited)
    print("next device:", works(hizvk.Device()))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
