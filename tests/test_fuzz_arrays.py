"""Arrays of every layout and dtype for every parameter that takes one.

The outcome is a result or a named error, never a crash, and never a huge copy.

The parameters, and valid arguments beside them, are those of bad_values/.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import hizvk
from bad_values import TABLES

if TYPE_CHECKING:
    from collections.abc import Callable

#: The parameters that take arrays, vectors or matrices.
ARRAYS = [
    ("Points", "positions"),
    ("Spheres", "centers"),
    ("Spheres", "radii"),
    ("Boxes", "min"),
    ("Boxes", "max"),
    ("Boxes.from_corners", "corners"),
    ("OrientedBoxes.from_corners", "corners"),
    ("OrientedBoxes", "centers"),
    ("OrientedBoxes", "half_sizes"),
    ("OrientedBoxes", "rotations"),
    ("OrientedBoxes.from_yaw", "centers"),
    ("OrientedBoxes.from_yaw", "half_sizes"),
    ("OrientedBoxes.from_yaw", "yaw_deg"),
    ("OrientedBoxes.from_yaw", "up"),
    ("OrientedBoxes.from_quaternions", "quaternions"),
    ("OrientedBoxes.from_transforms", "world_from_box"),
    ("OrientedBoxes.from_transforms", "half_sizes"),
    ("Mesh", "vertices"),
    ("Mesh", "triangles"),
    ("Mesh", "transforms"),
    ("Mesh.of", "mesh"),
    ("Mesh.of", "transforms"),
    ("Device.occluders", "vertices"),
    ("Device.occluders", "triangles"),
    ("Device.occluders", "transforms"),
    ("Device.cull_map", "copies"),
    ("Device.pyramid", "depth"),
    ("Pyramid.update", "array"),
    ("LodByDistance", "thresholds"),
    ("LodByDistance.at_ndc_depths", "depths"),
    ("LodBySize", "pixels"),
    ("visible", "depth"),
    ("reference.classify", "depth"),
    ("reference.unoccluded", "depth"),
    ("reference.pyramid", "depth"),
    ("compare", "mask"),
    ("split_mesh", "vertices"),
    ("split_mesh", "triangles"),
    ("SplitMesh.mesh", "mask"),
    ("inner_boxes", "vertices"),
    ("inner_prisms", "up"),
    ("compare", "truth"),
    ("compare_unoccluded", "verdicts"),
    ("compare_unoccluded", "truth"),
    ("Camera.look_at", "eye"),
    ("Camera.look_at", "target"),
    ("Camera.look_at", "up"),
    ("Camera.look_at", "size"),
    ("Camera.frustum", "eye"),
    ("Camera.orthographic", "eye"),
    ("Camera.from_opencv", "k"),
    ("Camera.from_opencv", "camera_from_world"),
    ("Camera.from_opencv", "distortion"),
    ("Camera.from_colmap", "params"),
    ("Camera.from_colmap", "qvec"),
    ("Camera.from_colmap", "tvec"),
    ("Camera.from_opengl", "projection"),
    ("Camera.from_opengl", "camera_from_world"),
    ("Camera.from_matrices", "clip_from_world"),
    ("Camera.resized", "size"),
    ("Camera.project", "xyz"),
    ("gather", "pixels"),
    ("fill_depth", "depth"),
    ("DirectionalLight", "direction"),
    ("cube", "eye"),
    ("sweep", "groups"),
    ("viewshed", "heights"),
    ("viewshed", "cell_size"),
    ("viewshed", "eye"),
    ("HierarchicalVisibility.render", "previous"),
]

DTYPES = [
    "<f4", ">f4", "<f8", ">f8", "<f2", ">f2", "g", "i1", ">i4", "i8", "u1", ">u2", "u8", "?",
    "c8", "c16", "O", "U3", "S2", "M8[s]", "m8[s]", "V4", [("x", "f4"), ("y", "f4")],
]  # fmt: skip

SHAPES: list[tuple[int, ...]] = [
    (), (0,), (1,), (2,), (3,), (4,), (0, 3), (1, 3), (2, 3), (3, 2), (3, 3), (4, 4), (6, 8),
    (8, 6), (0, 0), (48, 64), (2, 4, 4), (0, 4, 4), (2, 3, 3), (1, 2, 3, 3), (6, 8, 1), (1, 6, 8),
]  # fmt: skip

#: Shapes of views of one number that claim far more memory than any machine has.
CLAIMS: list[tuple[int, ...]] = [
    (2**58,),
    (2**40, 3),
    (2**40, 4, 4),
    (2**38, 3, 3),
    (2**29, 2**29),
    (2, 2**50),
]

NUMBERS = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    3.0,
    np.nan,
    np.inf,
    -np.inf,
    1e-310,
    1e-45,
    1e300,
    -1e30,
    2.0**61,
    65504.0,
]


def filled(draw: Callable[..., Any], shape: tuple[int, ...], dtype: Any) -> Any:
    """An array of that shape with special numbers in it, as far as the dtype can hold them."""
    size = int(np.prod(shape))
    values = np.array([draw(st.sampled_from(NUMBERS)) for _ in range(min(size, 12))] or [0.0])
    with np.errstate(all="ignore"):
        try:
            return np.resize(values, shape).astype(dtype)
        except (TypeError, ValueError, OverflowError):
            return np.zeros(shape, dtype)


def dressed(draw: Callable[..., Any], array: Any) -> Any:
    """The array in another layout or class."""
    how = draw(st.sampled_from([
        "plain", "fortran", "strided", "reversed", "readonly", "misaligned", "list", "tuple",
        "memoryview", "subclass", "masked", "scalar", "broadcast", "transposed",
    ]))  # fmt: skip
    if how == "fortran":
        return np.asfortranarray(array)
    if how == "strided" and array.ndim:
        return np.repeat(array, 3, axis=-1)[..., ::3]
    if how == "reversed" and array.ndim:
        return array[::-1][..., ::-1] if array.ndim > 1 else array[::-1]
    if how == "readonly":
        array.setflags(write=False)
    if how == "misaligned" and array.dtype.kind in "fiu":
        raw = np.zeros(array.nbytes + 1, np.uint8)[1:]
        view = raw.view(array.dtype).reshape(array.shape)
        view[...] = array
        return view
    if how == "list":
        return array.tolist()
    if how == "tuple" and array.ndim:
        return tuple(array)
    if how == "memoryview" and array.dtype.kind in "fiu" and array.dtype.isnative and array.size:
        return memoryview(np.ascontiguousarray(array))
    if how == "subclass" and array.ndim <= 2:
        return np.asmatrix(array) if array.ndim == 2 else array.view(np.recarray)
    if how == "masked":
        return np.ma.masked_array(array)
    if how == "scalar" and array.size:
        return array.ravel()[0]
    if how == "broadcast" and array.size:
        return np.broadcast_to(array.ravel()[0], array.shape)
    if how == "transposed":
        return array.T
    return array


def attempt(device: hizvk.Device, function: str, parameter: str, value: Any) -> Any:
    """The function's result, or None for an error that names the fault."""
    call, arguments = TABLES[function].make(device)
    # The fault may show in another argument, such as a longer array, or the camera as a whole.
    words = (*TABLES[function].bad, "camera")
    caught: Exception | None = None
    try:
        return call(**{**arguments, parameter: value})
    except (TypeError, ValueError, hizvk.HizError) as error:
        caught = error
    assert isinstance(caught, hizvk.HizError) or str(caught).startswith(words), str(caught)
    return None


@settings(
    max_examples=800, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_any_array_is_an_answer_or_a_named_error(device: hizvk.Device, data: st.DataObject) -> None:
    function, parameter = data.draw(st.sampled_from(ARRAYS))
    shape, dtype = data.draw(st.sampled_from(SHAPES)), data.draw(st.sampled_from(DTYPES))
    value = dressed(data.draw, filled(data.draw, shape, dtype))
    answer = attempt(device, function, parameter, value)
    if answer is None:
        return
    if isinstance(answer, hizvk.Spheres | hizvk.Boxes | hizvk.OrientedBoxes | hizvk.Points):
        # Accepted bounds can be culled, and invalid bounds are kept.
        instances = device.instances(answer)
        camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(6, 8), near=0.1)
        seen = device.cull(instances, camera, device.pyramid(np.ones((6, 8)), camera, kind="z"))
        assert seen.mask.shape == (len(answer),)
        assert seen.mask[instances.invalid.astype(np.intp)].all()
    if isinstance(answer, hizvk.Mesh):
        device.occluders([answer])
    if isinstance(answer, hizvk.Camera):
        with contextlib.suppress(ValueError, hizvk.HizError):
            device.pyramid(np.ones(answer.size), answer, kind=answer.depth_kind).level(0)


def address_space() -> int:
    """The size of this process's address space in bytes; 0 where the system does not tell."""
    try:
        text = Path("/proc/self/statm").read_text(encoding="ascii")
    except OSError:
        return 0
    return int(text.split()[0]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.parametrize("claim", CLAIMS, ids=str)
@pytest.mark.parametrize(("function", "parameter"), ARRAYS, ids=lambda word: str(word))
def test_views_that_claim_more_than_there_is_are_refused(
    device: hizvk.Device, function: str, parameter: str, claim: tuple[int, ...]
) -> None:
    """Strides of 0: one number in memory, terabytes by their shape.

    They are refused at once, before anything is copied.
    """
    before = address_space()
    for dtype in ("f4", "f8", "f2", "i8", "?", "u2", "u1"):
        value = np.broadcast_to(np.zeros((), dtype), claim)
        assert attempt(device, function, parameter, value) is None
    assert address_space() - before < 1 << 30


@pytest.mark.parametrize("side", [16385, 32768])
def test_images_beyond_the_devices_limit_are_refused_before_they_are_copied(
    device: hizvk.Device, side: int
) -> None:
    if side <= device.max_image_side:
        pytest.skip("this device holds such an image")
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(side, side), near=0.1)
    before = address_space()
    for image in (np.broadcast_to(1.0, camera.size), np.broadcast_to(np.uint16(1), camera.size)):
        with pytest.raises(hizvk.LimitError) as caught:
            device.pyramid(image, camera, kind="z")
        assert (caught.value.requested, caught.value.allowed) == (side, device.max_image_side)
        with pytest.raises(hizvk.LimitError):
            hizvk.visible(
                hizvk.Spheres(np.zeros((1, 3)), 1), camera, depth=image, kind="z", device=device
            )
    with pytest.raises(hizvk.LimitError):
        device.render_depth(device.occluders(np.zeros((3, 3)), [[0, 1, 2]]), camera)
    assert address_space() - before < 1 << 30


def test_every_array_parameter_is_fuzzed() -> None:
    """A parameter takes arrays if its table has a bad shape."""
    listed = {
        (function, parameter)
        for function, table in TABLES.items()
        for parameter, values in table.bad.items()
        if any(isinstance(value, np.ndarray) and "got (" in text for value, _, text in values)
    }
    objects = {"bounds", "points", "camera", "light_camera", "instances", "pyramid", "occluders"}
    # An image to gather from may have any size.
    objects |= {"depth", "image"}
    fuzzed = {parameter for _, parameter in ARRAYS}
    # Vectors and matrices of all cameras share one check each, so one of each is enough.
    assert {parameter for _, parameter in listed} - objects <= fuzzed | {
        "world_from_camera",
        "clip_from_camera",
    }


def test_this_process_still_has_its_device(device: hizvk.Device) -> None:
    """The device survives all of the tests above."""
    device.wait()
    assert hizvk.Device().adapter == device.adapter
