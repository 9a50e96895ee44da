"""Arrays of every layout and dtype give the same result or an error that names the parameter.

They never crash, and never give another result.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import hizvk

SIZE = (6, 8)
FUZZ = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)

#: Dtypes that hold positions and depth, and some that do not.
FLOATS = ["<f4", ">f4", "<f8", ">f8", "<f2"]
WHOLE = ["i4", "u1"]
OTHERS = ["?", "c8", "U3", "O", "M8[s]"]


@pytest.fixture(scope="module")
def camera() -> hizvk.Camera:
    return hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.5, reversed_z=False
    )


@pytest.fixture(scope="module")
def hiz(device: hizvk.Device, camera: hizvk.Camera) -> hizvk.Pyramid:
    return device.pyramid(np.full(SIZE, 4.0), camera, kind="z")


def dressed(draw: Any, values: np.ndarray, dtype: str) -> np.ndarray:
    """The same numbers in another layout: strides, order, byte order, or read-only."""
    array = values.astype(dtype)
    how = draw(st.sampled_from(["plain", "fortran", "strided", "reversed", "readonly", "sliced"]))
    if how == "fortran":
        return np.asfortranarray(array)
    if how == "strided":
        return np.repeat(array, 2, axis=0)[::2]
    if how == "reversed":
        return np.ascontiguousarray(array[::-1])[::-1]
    if how == "readonly":
        array.flags.writeable = False
    if how == "sliced":
        wide = np.zeros((*array.shape[:-1], array.shape[-1] + 2), array.dtype)
        wide[..., 1:-1] = array
        return wide[..., 1:-1]
    return array


@FUZZ
@given(data=st.data())
def test_every_layout_gives_the_same_answer(
    device: hizvk.Device, camera: hizvk.Camera, hiz: hizvk.Pyramid, data: st.DataObject
) -> None:
    n = data.draw(st.integers(0, 40))
    seed = data.draw(st.integers(0, 2**32 - 1))
    # Quarters are exact in float16, too.
    numbers = np.random.default_rng(seed).integers(-40, 40, (n, 3)) / 4
    low, high = np.minimum(numbers, numbers[::-1]), np.maximum(numbers, numbers[::-1]) + 0.25
    plain = device.cull(device.instances(hizvk.Boxes(low, high)), camera, hiz)
    low = dressed(data.draw, low, data.draw(st.sampled_from(FLOATS)))
    high = dressed(data.draw, high, data.draw(st.sampled_from(FLOATS)))
    again = device.cull(device.instances(hizvk.Boxes(low, high)), camera, hiz)
    np.testing.assert_array_equal(plain.verdicts, again.verdicts)
    np.testing.assert_array_equal(plain.indices, np.flatnonzero(again.mask))


@FUZZ
@given(data=st.data())
def test_any_bits_are_an_answer_and_never_hide_bad_bounds(
    device: hizvk.Device, camera: hizvk.Camera, hiz: hizvk.Pyramid, data: st.DataObject
) -> None:
    n = data.draw(st.integers(1, 60))
    raw = data.draw(st.binary(min_size=16 * n, max_size=16 * n))
    numbers = np.frombuffer(raw, "<f4").reshape(n, 4)
    seen = device.cull(device.instances(hizvk.Spheres(numbers[:, :3], numbers[:, 3])), camera, hiz)
    bad = ~np.isfinite(numbers).all(1) | (numbers[:, 3] < 0)
    assert seen.mask[bad].all()
    assert (seen.verdicts[bad] == hizvk.Verdict.INVALID).all()
    assert len(seen.verdicts) == n


@FUZZ
@given(data=st.data())
def test_wrong_arrays_are_named(
    device: hizvk.Device, camera: hizvk.Camera, data: st.DataObject
) -> None:
    shape = data.draw(st.lists(st.integers(0, 4), min_size=0, max_size=3).map(tuple))
    dtype = data.draw(st.sampled_from(FLOATS + WHOLE + OTHERS))
    array = np.zeros(shape, dtype)
    right = dtype in FLOATS + WHOLE and len(shape) == 2 and shape[1] == 3
    if right:
        assert len(hizvk.Spheres(array, 1.0)) == shape[0]
    else:
        with pytest.raises((TypeError, ValueError), match="centers"):
            hizvk.Spheres(array, 1.0)
    depth_right = dtype in FLOATS and shape == SIZE
    if not depth_right:
        with pytest.raises((TypeError, ValueError), match="depth"):
            device.pyramid(array, camera, kind="z")
