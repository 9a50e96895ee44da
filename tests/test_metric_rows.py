"""Metric depth in images wider than what is converted together, against exact fractions.

The NDC depth is never nearer than that of the number, moved by what its dtype rounds.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import hizvk

SIZE = (3, 521)
#: A power of two, so that the planes' ratio is exact.
NEAR = 0.125
#: How far a dtype may have rounded: relative and absolute.
ROUNDED = {
    "float16": (Fraction(1, 2**10), Fraction(1, 2**24)),
    "float32": (Fraction(1, 2**24), Fraction(1, 2**149)),
    "float64": (Fraction(0), Fraction(0)),
    "uint16": (Fraction(0), Fraction(0)),
}


def numbers(dtype: str, scale: float) -> Any:
    """Numbers across the whole range, some of them at the near plane and some no depth."""
    rng = np.random.default_rng(11)
    values = NEAR * np.exp(rng.uniform(-0.2, 9.0, SIZE)) / scale
    values[0, ::7] = NEAR / scale
    values[1, ::11] = 0.0
    if dtype == "uint16":
        return np.clip(values, 0, 65535).astype(np.uint16)
    values[1, 1::13], values[1, 2::17], values[1, 3::19] = np.nan, np.inf, -1.0
    values[2, ::5] = np.nextafter(NEAR / scale, 0.0)
    return np.minimum(values, 60000.0).astype(dtype)


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("dtype", ["float16", "float32", "float64", "uint16"])
def test_view_depth_is_the_nearest_float32_that_is_not_nearer(
    device: hizvk.Device, dtype: str, reversed_z: bool
) -> None:
    """A quotient alone is float32 (reversed Z without a far plane), and loses a few steps."""
    share = Fraction(8, 2**24) if reversed_z and dtype != "float64" else Fraction(0)
    scale = 0.0078125 if dtype == "uint16" else 1.0
    camera = hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=60, near=NEAR, size=SIZE, reversed_z=reversed_z
    )
    image = numbers(dtype, scale)
    got = device.pyramid(image, camera, kind="z", scale=scale, invalid=()).level(0)
    far = 0.0 if reversed_z else 1.0
    relative, absolute = ROUNDED[dtype]
    seen = 0
    for value, depth in zip(image.ravel().tolist(), got.ravel().tolist(), strict=True):
        if not np.isfinite(value) or value <= 0.0:
            assert depth == far, value
            continue
        number = Fraction(value)
        nearest = (number - number * relative - absolute) * Fraction(scale)
        at_plane = abs(nearest / Fraction(NEAR) - 1) < Fraction(1, 2**40)
        if nearest < Fraction(NEAR) and not at_plane:
            assert depth == far, value
            continue
        if at_plane and depth == far:
            continue  # closer to the plane than float64 can tell
        ratio = Fraction(NEAR) / ((number + number * relative + absolute) * Fraction(scale))
        exact = ratio if reversed_z else 1 - ratio
        towards_far = -np.inf if reversed_z else np.inf
        before = float(np.nextafter(np.float32(depth), np.float32(-towards_far)))
        assert Fraction(depth) <= exact if reversed_z else Fraction(depth) >= exact, value
        # The next float32 is nearer than the exact depth, but for float64's own roundings.
        # Close to the near plane a tolerance counts twice in its square.
        slack = ratio * (Fraction(1, 2**45) + 4 * relative**2 + share) + Fraction(1, 2**49)
        assert (
            Fraction(before) > exact - slack if reversed_z else Fraction(before) < exact + slack
        ), value
        seen += 1
    assert seen > 500


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("dtype", ["float16", "float32", "float64", "uint16"])
def test_distance_is_not_nearer_and_hardly_farther(
    device: hizvk.Device, dtype: str, reversed_z: bool
) -> None:
    """A sensor whose middle is aside; rays in float64, whose error is far below float32's."""
    scale = 0.0078125 if dtype == "uint16" else 1.0
    fx, fy, cx, cy = 300.0, 280.0, 200.0, 1.25
    camera = hizvk.Camera.from_opencv(
        np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]),
        size=SIZE,
        near=NEAR,
        pixel_center="half",
        world_from_camera=np.eye(4),
        reversed_z=reversed_z,
    )
    image = numbers(dtype, scale)
    got = device.pyramid(image, camera, kind="distance", scale=scale, invalid=()).level(0)
    x = (np.arange(SIZE[1]) + 0.5 - cx) / fx
    y = (np.arange(SIZE[0]) + 0.5 - cy) / fy
    rays = np.sqrt(1.0 + x**2 + y[:, None] ** 2)
    relative, absolute = (float(part) for part in ROUNDED[dtype])
    with np.errstate(all="ignore"):
        value = image.astype(np.float64)
        farthest = (value * (1.0 + relative) + absolute) * scale / rays
        nearest = (value * (1.0 - relative) - absolute) * scale / rays
        inside = np.isfinite(value) & (value > 0.0) & (nearest > NEAR * (1 + 1e-6))
        ratio = NEAR / farthest
    shown = got.astype(np.float64) if reversed_z else 1.0 - got.astype(np.float64)
    assert inside.sum() > 500
    assert (shown[inside] <= ratio[inside] + 1e-15).all()
    # 20 roundings of float32 are counted at most, and one step of the result.
    # A tolerance counts twice in its square close to the near plane.
    share = 20 / 2**24 + 4 * relative**2
    least = ratio[inside] * (1.0 - share) - (0.0 if reversed_z else 1 / 2**24) - 1e-15
    assert (shown[inside] >= least).all()
    no_depth = ~(np.isfinite(value) & (value > 0.0))
    assert (got[no_depth] == (0.0 if reversed_z else 1.0)).all()
