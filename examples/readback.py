"""Reads a cull's answer without waiting for it: the host works while the device culls.

A frame records its cull, does some work of its own, and then needs the mask.
With ``wait=False`` the answer comes to the host by itself, and the wait that is left is printed.
An event loop does the same by ``await``.
"""

import asyncio
import time

import numpy as np

import hizvk

FRAMES, BALLS, WORK_MS = 8, 200_000, 5.0


def work(milliseconds: float) -> None:
    """Keeps the host busy for so long."""
    end, numbers = time.perf_counter() + 1e-3 * milliseconds, np.arange(20_000)[::-1]
    while time.perf_counter() < end:
        np.sort(numbers)


async def _result(seen: hizvk.CullResult) -> hizvk.CullResult:
    return await seen


def main() -> None:
    """Moves a camera past a wall, and reads one mask per frame."""
    random = np.random.default_rng(5)
    device = hizvk.Device()
    wall = np.array([[-6, -6, -10], [6, -6, -10], [6, 6, -10], [-6, 6, -10]], np.float64)
    walls = device.occluders(wall, np.array([[0, 1, 2], [0, 2, 3]]))
    crowd = device.instances(
        hizvk.Spheres(random.uniform((-20, -8, -40), (20, 8, -12), (BALLS, 3)), 0.1)
    )

    def frame(number: int, *, wait: bool) -> hizvk.CullResult:
        eye = np.array([0.4 * number, 0.0, 0.0])
        camera = hizvk.Camera.look_at(eye, eye - (0, 0, 1), fov_y_deg=60, size=(90, 160), near=0.1)
        hiz = device.pyramid(device.render_depth(walls, camera))
        return device.cull(crowd, camera, hiz, outputs=["mask"], wait=wait)

    blocking, left, same = [], [], 0
    frame(0, wait=False).result()  # compiles
    for number in range(FRAMES):
        seen = frame(number, wait=True)
        start = time.perf_counter()
        expected = seen.mask
        blocking.append(time.perf_counter() - start)

        seen = frame(number, wait=False)
        work(WORK_MS)
        start = time.perf_counter()
        mask = seen.mask
        left.append(time.perf_counter() - start)
        same += int(np.array_equal(mask, expected))
    print(f"read at once:                   {1e3 * np.median(blocking):6.2f} ms of waiting")
    print(f"after {WORK_MS:.0f} ms of the host's work: {1e3 * np.median(left):6.2f} ms of waiting")

    async def two_frames() -> None:
        """Culls two views at a time while the event loop goes on."""
        culls = [asyncio.ensure_future(_result(frame(number, wait=False))) for number in (0, 1)]
        ticks = 0
        while not all(cull.done() for cull in culls):
            ticks += 1
            await asyncio.sleep(0)
        kept = [int(cull.result().count) for cull in culls]
        print(f"the event loop went round {ticks} times, and {kept} balls were kept")

    asyncio.run(two_frames())
    print(f"{same} of {FRAMES} masks are those of a blocking read")


if __name__ == "__main__":
    main()
