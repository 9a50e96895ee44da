"""Depth images of files and sensors: what means "no data", and what a message proposes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest

import hizvk

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

SIZE = (4, 6)
#: The classes of `hizvk.reference` by what a cull may make of them.
FAR, NEAR = hizvk.reference.VISIBLE, hizvk.reference.HIDDEN


def camera(
    *, near: float = 1.0, far: float = 1e6, reversed_z: bool = True, orthographic: bool = False
) -> hizvk.Camera:
    """Looks along -z from the origin."""
    eye, target = (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)
    if orthographic:
        return hizvk.Camera.orthographic(
            eye, target, height=4, near=near, far=far, size=SIZE, reversed_z=reversed_z
        )
    return hizvk.Camera.look_at(
        eye, target, fov_y_deg=90, near=near, far=far, size=SIZE, reversed_z=reversed_z
    )


def behind(depth: float) -> hizvk.Spheres:
    """A ball in each of the image's four quarters, at one and a half times the depth."""
    z = depth * 1.5
    spread = z / 4.0
    centers = np.array([[x * spread, y * spread, -z] for x in (-1, 1) for y in (-1, 1)])
    return hizvk.Spheres(centers, np.full(4, 1e-3))


class Faces:
    """Every face that takes a depth image; each says whether it hid what lies behind."""

    def __init__(self, device: hizvk.Device) -> None:
        self.device = device

    def hidden(self, image: Any, view: hizvk.Camera, bounds: hizvk.Spheres, **words: Any) -> bool:
        """The one answer of all faces for all balls, which is asserted."""
        pyramid = self.device.pyramid(image, view, **words)
        culled = self.device.cull(self.device.instances(bounds), view, pyramid).mask
        seen = hizvk.visible(bounds, view, depth=image, device=self.device, **words)
        truth = hizvk.reference.classify(bounds, view, image, **words)
        answers = {*(~culled).tolist(), *(~seen).tolist(), *(truth == NEAR).tolist()}
        assert len(answers) == 1, (culled, seen, truth)
        assert set(truth.tolist()) <= {FAR, NEAR}
        return bool(answers.pop())


@pytest.fixture(scope="module")
def faces(device: hizvk.Device) -> Faces:
    return Faces(device)


@pytest.mark.parametrize(
    ("dtype", "value", "invalid", "wall"),
    [
        (np.uint16, 5000, None, True),
        (np.uint16, 0, None, False),
        (np.uint16, 65535, None, False),
        (np.uint16, 65534, None, True),
        (np.uint16, 65535, (), True),
        (np.uint16, 65535, (0,), True),
        (np.uint16, 65534, (65534,), False),
        (np.uint16, 65535, (65534,), True),
        (np.uint16, 5000, np.array([5000], dtype=np.uint16), False),
        (np.uint16, 0, (), False),  # zero is no depth of a perspective
        (np.float16, 65504, None, False),
        (np.float16, 65504, (), True),
        (np.float16, 65472, None, True),
        (np.float16, 0.1, (0.1,), False),  # as a half-float holds it
        (np.float32, 65504, None, True),
        (np.float32, 65535, None, True),
        (np.float32, 40.1, {40.1}, False),  # as a float32 holds it
        (np.float32, 40.1, (40.2, np.nan, np.inf), True),
        (np.float64, 1e5, [1e5], False),
        (np.float64, 1e5, None, True),
    ],
)
@pytest.mark.parametrize("kind", ["z", "distance"])
def test_which_numbers_are_no_data(
    faces: Faces, dtype: Any, value: float, invalid: Collection[float] | None, wall: bool, kind: str
) -> None:
    image = np.full(SIZE, value, dtype)
    for scale in (1.0, 0.001) if value > 2000 else (1.0,):
        for reversed_z in (False, True):
            view = camera(near=max(value * scale, 0.05) / 100.0, reversed_z=reversed_z)
            bounds = behind(max(value * scale * 3.0, 1.0))
            assert (
                faces.hidden(image, view, bounds, kind=kind, scale=scale, invalid=invalid) == wall
            ), scale


@pytest.mark.parametrize("reversed_z", [False, True])
def test_ndc_values_can_be_no_data_too(faces: Faces, reversed_z: bool) -> None:
    view = camera(reversed_z=reversed_z)
    image = np.full(SIZE, 0.5, np.float32)
    assert faces.hidden(image, view, behind(1e3), kind=view.depth_kind)
    assert not faces.hidden(image, view, behind(1e3), kind=view.depth_kind, invalid=[0.5])


@pytest.mark.parametrize("dtype", [np.uint16, np.float16, np.float32, np.float64, np.dtype(">f4")])
def test_masked_is_no_data(faces: Faces, dtype: npt.DTypeLike) -> None:
    image = np.ma.masked_array(np.full(SIZE, 40, dtype), mask=np.zeros(SIZE, bool))
    whole = np.ma.masked_array(np.full(SIZE, 40, dtype))
    view = camera()
    assert faces.hidden(image, view, behind(80.0), kind="z")
    assert faces.hidden(whole, view, behind(80.0), kind="distance")
    before = image.data.copy()
    image[:, :] = np.ma.masked
    assert not faces.hidden(image, view, behind(80.0), kind="z")
    np.testing.assert_array_equal(image.data, before)  # the caller's own numbers are left alone


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("kind", ["z", "distance"])
def test_depth_behind_an_orthographic_eye(faces: Faces, reversed_z: bool, kind: str) -> None:
    view = camera(near=-100.0, far=100.0, reversed_z=reversed_z, orthographic=True)
    quarters = np.array([[x, y, 0.0] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    for value, dtype, invalid, wall in [
        (-50.0, np.float32, None, True),
        (0.0, np.float64, None, True),
        (-0.0, np.float32, None, True),
        (0.0, np.float32, (0,), False),
        (-50.0, np.float64, (-50,), False),
        (-101.0, np.float32, None, False),
        (0, np.uint16, None, False),
        (0, np.uint16, (), True),
        (3, np.uint16, None, True),
        (np.nan, np.float32, None, False),
        (-np.inf, np.float32, None, False),
    ]:
        image = np.full(SIZE, value, dtype)
        low = value if np.isfinite(value) else 0.0
        bounds = hizvk.Spheres(quarters - (0.0, 0.0, low + 10.0), np.full(4, 0.1))
        assert faces.hidden(image, view, bounds, kind=kind, invalid=invalid) == wall, (
            value,
            dtype,
            invalid,
        )
    # From a near plane at the eye on, nothing changes.
    view = camera(near=0.0, far=100.0, reversed_z=reversed_z, orthographic=True)
    for value in (0.0, -50.0):
        assert not faces.hidden(
            np.full(SIZE, value),
            view,
            hizvk.Spheres(quarters - (0.0, 0.0, 20.0), np.full(4, 0.1)),
            kind=kind,
        )


def test_a_buffer_means_what_its_dtype_does(device: hizvk.Device) -> None:
    class Picture:
        """An image of another library."""

        def __init__(self, array: npt.NDArray[Any]) -> None:
            self.__array_interface__ = array.__array_interface__
            self.array = array

    saturated = np.full(SIZE, 65535, np.uint16)
    for value in (Picture(saturated), memoryview(saturated)):
        assert hizvk.visible(behind(2e5), camera(), depth=value, kind="z", device=device).all()  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="uint8"):
        hizvk.visible(
            behind(80.0),
            camera(),
            depth=Picture(saturated.astype(np.uint8)),
            kind="z",
            device=device,
        )  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("image", "fragment"),
    [
        (np.ones(SIZE, np.uint8), ".astype(np.float32)"),
        (np.ones((8, 12)), "camera.resized(depth.shape)"),
        (np.ones(SIZE[::-1]), "looks transposed"),
    ],
)
def test_a_message_proposes_what_works(
    device: hizvk.Device, image: npt.NDArray[Any], fragment: str
) -> None:
    """The call accepts what each message proposes."""
    ways: dict[str, Callable[[], tuple[Any, hizvk.Camera]]] = {
        ".astype(np.float32)": lambda: (image.astype(np.float32), camera()),
        "camera.resized(depth.shape)": lambda: (image, camera().resized(image.shape)),
        "looks transposed": lambda: (image, camera().resized(image.shape)),
    }
    with pytest.raises((TypeError, ValueError)) as caught:
        device.pyramid(image, camera(), kind="z")
    assert fragment in str(caught.value)
    device.pyramid(*ways[fragment](), kind="z")


def test_values_that_the_dtype_cannot_hold(device: hizvk.Device) -> None:
    for image, bad in [
        (np.ones(SIZE, np.uint16), (65.535,)),
        (np.ones(SIZE, np.uint16), (-1,)),
        (np.ones(SIZE, np.uint16), (65536,)),
        (np.ones(SIZE, np.float16), (1e6,)),
        (np.ones(SIZE, np.float32), (1e300,)),
    ]:
        with pytest.raises(
            ValueError,
            match=r"invalid: expected .*own units.*, which no (uint16|float16|float32) is",
        ):
            device.pyramid(image, camera(), kind="z", invalid=bad)
    depth = device.render_depth(device.occluders(np.zeros((3, 3)), np.array([[0, 1, 2]])), camera())
    with pytest.raises(TypeError, match="invalid: expected nothing beside a DepthImage"):
        device.pyramid(depth, invalid=(0,))  # type: ignore[call-overload]
    with pytest.raises(TypeError, match="invalid: expected nothing beside a DepthImage"):
        hizvk.visible(behind(2.0), camera(), depth=depth, invalid=(0,))


def test_equal_depth_is_visible_and_the_oracle_says_what_it_does_not_know(
    device: hizvk.Device,
) -> None:
    """Standard Z, near 1, no far plane: depth is 1 - 1/z.

    float32 holds it for z = 8 and not for z = 3.
    """
    eye = ((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    view = hizvk.Camera.look_at(*eye, fov_y_deg=90, near=1.0, size=SIZE, reversed_z=False)
    for wall, at_it in ((8.0, hizvk.reference.VISIBLE), (3.0, hizvk.reference.UNDECIDED)):
        fronts = np.array([wall * (1 - 1e-6), wall, wall * (1 + 1e-6)])
        boxes = hizvk.Boxes(
            np.stack([[-0.1, -0.1, -f - 1.0] for f in fronts]),
            np.stack([[0.1, 0.1, -f] for f in fronts]),
        )
        image = np.full(SIZE, wall)
        truth = hizvk.reference.classify(boxes, view, image, kind="z")
        assert truth.tolist() == [hizvk.reference.VISIBLE, at_it, hizvk.reference.HIDDEN]
        assert hizvk.visible(boxes, view, depth=image, kind="z", device=device)[:2].all()


def test_a_scale_beside_what_has_its_own_units_is_refused(device: hizvk.Device) -> None:
    """It used to be ignored: a rendered image has no units."""
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(4, 4), near=0.1)
    wall = hizvk.Mesh([[-8.0, -8, -12], [8.0, -8, -12], [0.0, 8, -12]], [[0, 1, 2]])
    depth = device.render_depth(device.occluders([wall]), camera)
    ball = hizvk.Spheres([[0.0, 0.0, -20.0]], 0.5)
    with pytest.raises(
        ValueError, match=r"scale: expected 1 beside a DepthImage, whose depth is NDC, got 0\.001"
    ):
        device.pyramid(depth, scale=0.001)
    with pytest.raises(ValueError, match="scale: expected 1 beside a DepthImage"):
        hizvk.visible(ball, camera, depth=depth, scale=0.001)
    with pytest.raises(ValueError, match="scale: expected 1 beside occluders"):
        hizvk.recommend(ball, camera, occluders=wall, scale=0.001)
