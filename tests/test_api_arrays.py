"""Which arrays are taken, which are converted, and which are passed on as they are."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hizvk

# Positions that every kind of float holds exactly, so that all must give the same answer.
CENTERS = np.array([[0.0, 0, -5], [0, 0, -20], [0, 0, 20], [4, 0, -16], [-1, 0.5, -10]])
RADII = np.array([1.0, 1, 1, 0.5, 2])
EXPECTED = [
    True,
    False,
    False,
    False,
    True,
]  # before the wall, behind, behind the camera, behind, through it


def misaligned(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The same numbers at an odd address."""
    raw = np.zeros(array.nbytes + 1, dtype=np.uint8)[1:]
    result: npt.NDArray[Any] = np.frombuffer(raw.data, dtype=array.dtype).reshape(array.shape)
    result[...] = array
    assert not result.flags.aligned
    return result


def spaced(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Every second element of a larger array, along each axis."""
    large = np.full([2 * side for side in array.shape], 7, dtype=array.dtype)
    view = large[tuple(slice(None, None, 2) for _ in array.shape)]
    view[...] = array
    return view


def read_only(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    array = array.copy()
    array.setflags(write=False)
    return array


LAYOUTS: dict[str, Callable[[npt.NDArray[Any]], Any]] = {
    "float64": lambda a: a,
    "float32": lambda a: a.astype(np.float32),
    "float16": lambda a: a.astype(np.float16),
    "big-endian": lambda a: a.astype(">f8"),
    "big-endian float32": lambda a: a.astype(">f4"),
    "Fortran": np.asfortranarray,
    "spaced": spaced,
    "reversed twice": lambda a: a[::-1].copy()[::-1],
    "misaligned": misaligned,
    "read-only": read_only,
    "lists": lambda a: a.tolist(),
    "matrix subclass": lambda a: a.view(np.recarray) if a.ndim == 1 else a,
}


@pytest.fixture(scope="module")
def camera() -> hizvk.Camera:
    return hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(16, 24), near=0.125)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_means_the_same(
    device: hizvk.Device, camera: hizvk.Camera, layout: str
) -> None:
    change = LAYOUTS[layout]
    wall = change(np.full(camera.size, 10.0))
    sizes = np.repeat(RADII[:, None], 3, axis=1)
    turns = np.broadcast_to(np.eye(3), (5, 3, 3)).copy()
    for bounds in (
        hizvk.Spheres(change(CENTERS), change(RADII)),
        hizvk.Boxes(change(CENTERS - sizes), change(CENTERS + sizes)),
        hizvk.OrientedBoxes(change(CENTERS), change(sizes), change(turns)),
    ):
        assert len(bounds) == 5
        mask = hizvk.visible(bounds, camera, depth=wall, kind="z", device=device)
        assert mask.dtype == np.bool_
        assert mask.shape == (5,)
        assert mask.tolist() == EXPECTED


def test_ready_arrays_are_not_copied() -> None:
    for dtype in (np.float32, np.float64):
        centers, radii = CENTERS.astype(dtype), read_only(RADII.astype(dtype))
        spheres = hizvk.Spheres(centers, radii)
        assert spheres.centers is centers
        assert spheres.radii is radii
        assert hizvk.Boxes(centers, centers).max is centers
    assert (
        hizvk.Spheres(CENTERS.astype(np.float16), 1).centers.dtype == np.float32
    )  # exact, and the smallest there is


def test_mixed_dtypes(device: hizvk.Device, camera: hizvk.Camera) -> None:
    spheres = hizvk.Spheres(CENTERS, RADII.astype(np.float32))
    assert (
        hizvk.visible(
            spheres, camera, depth=np.full(camera.size, 10.0), kind="z", device=device
        ).tolist()
        == EXPECTED
    )


def test_one_radius_for_all() -> None:
    for radius in (2, 2.0, np.float32(2), np.int64(2), np.array(2.0)):
        assert hizvk.Spheres(CENTERS, radius).radii.tolist() == [2.0] * 5


@pytest.mark.parametrize("dtype", [np.uint16, np.dtype(">u2")])
def test_millimetres_of_a_sensor(
    device: hizvk.Device, camera: hizvk.Camera, dtype: npt.DTypeLike
) -> None:
    wall = np.full(camera.size, 10_000, dtype=dtype)
    spheres = hizvk.Spheres(CENTERS, RADII)
    mask = hizvk.visible(spheres, camera, depth=wall, kind="z", scale=0.001, device=device)
    assert mask.tolist() == EXPECTED
    wall[...] = 0  # no data anywhere: nothing hides
    mask = hizvk.visible(spheres, camera, depth=wall, kind="z", scale=0.001, device=device)
    assert mask.tolist() == [True, True, False, True, True]


def test_triangles_of_any_integer(device: hizvk.Device, camera: hizvk.Camera) -> None:
    corners = np.array([[-50.0, -50, -10], [50, -50, -10], [50, 50, -10], [-50, 50, -10]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    instances = device.instances(hizvk.Spheres(CENTERS, RADII))
    for dtype in (np.int8, np.int64, np.uint16, np.uint32, np.dtype(">i4")):
        walls = device.occluders(corners.astype(np.float32), np.asfortranarray(faces.astype(dtype)))
        pyramid = device.pyramid(device.render_depth(walls, camera))
        assert device.cull(instances, camera, pyramid).mask.tolist() == EXPECTED


def test_the_callers_array_is_never_changed(device: hizvk.Device, camera: hizvk.Camera) -> None:
    wall = np.full(camera.size, 10.0, dtype=np.float32)
    wall[0, :6] = [np.nan, np.inf, -np.inf, 0, -1, 1e-45]
    before = wall.tobytes()
    device.pyramid(wall, camera, kind="z").level(0)
    assert wall.tobytes() == before
