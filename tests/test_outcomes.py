"""The named outcomes of docs/accuracy.md as Python sees them, row by row and bit by bit.

The camera is at the origin and looks along -z, 90 degrees wide, with the near plane at 1.
The wall is at depth 4 unless a test says otherwise.
Every expectation is worked out by hand.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import hizvk
from hizvk import Verdict

NAN, INF = math.nan, math.inf
SIZE = (16, 16)
EYE3 = np.eye(3)


def view(
    *, reversed_z: bool, far: float | None = None, size: tuple[int, int] = SIZE
) -> hizvk.Camera:
    return hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=size, near=1.0, far=far, reversed_z=reversed_z
    )


BOTH = pytest.mark.parametrize("reversed_z", [False, True], ids=["standard", "reversed"])


def sphere(x: Any, y: Any, z: Any, r: Any) -> hizvk.Spheres:
    return hizvk.Spheres(np.array([[x, y, z]], np.float64), np.array([r], np.float64))


def box(low: Any, high: Any) -> hizvk.Boxes:
    return hizvk.Boxes(np.array([low], np.float64), np.array([high], np.float64))


def oriented(half: Any, rotation: Any, center: Any = (0, 0, -8)) -> hizvk.OrientedBoxes:
    return hizvk.OrientedBoxes(*(np.array([part], np.float64) for part in (center, half, rotation)))


FLAT = np.diag([1.0, 1, 0])
MIRROR = np.diag([-1.0, 1, 1])
SINGULAR = np.array([[1.0, 1, 0], [1, 1, 0], [0, 0, 0]])

#: A name, the bounds, and their verdict with a wall at depth 4.
BOUNDS: list[tuple[str, Any, Verdict]] = [
    ("behind", sphere(0, 0, -8, 1), Verdict.OCCLUDED),
    # NaN, infinite, overflowing, negative and inverted bounds are kept and counted.
    ("NaN centre", sphere(NAN, 0, -8, 1), Verdict.INVALID),
    ("infinite centre", sphere(0, -INF, -8, 1), Verdict.INVALID),
    ("overflowing centre", sphere(0, 0, -1e300, 1), Verdict.INVALID),
    ("NaN radius", sphere(0, 0, -8, NAN), Verdict.INVALID),
    ("infinite radius", sphere(0, 0, -8, INF), Verdict.INVALID),
    ("overflowing radius", sphere(0, 0, -8, 1e39), Verdict.INVALID),
    ("negative radius", sphere(0, 0, -8, -1), Verdict.INVALID),
    ("a hair negative radius", sphere(0, 0, -8, -1e-300), Verdict.INVALID),
    ("min above max", box((1, -1, -6), (-1, 1, -5)), Verdict.INVALID),
    ("min above max by a bit", box((0, 0, -5), (0, 0, np.nextafter(-5, -6))), Verdict.INVALID),
    ("NaN corner", box((-1, -1, -6), (1, NAN, -5)), Verdict.INVALID),
    ("infinite corner", box((-1, -1, -INF), (1, 1, -5)), Verdict.INVALID),
    ("negative half size", oriented((1, -1, 1), EYE3), Verdict.INVALID),
    ("NaN rotation", oriented((1, 1, 1), np.full((3, 3), NAN)), Verdict.INVALID),
    ("infinite rotation", oriented((1, 1, 1), np.full((3, 3), INF)), Verdict.INVALID),
    ("beyond the camera's coordinates", sphere(0, 0, -(2.0**55), 1), Verdict.INVALID),
    # Bounds without size, flat, mirrored and singular ones are valid.
    ("a point behind", sphere(0, 0, -8, 0), Verdict.OCCLUDED),
    ("minus zero radius", sphere(0, 0, -8, -0.0), Verdict.OCCLUDED),
    ("subnormal radius", sphere(0, 0, -8, 1e-310), Verdict.OCCLUDED),
    ("a point before", sphere(0, 0, -2, 0), Verdict.VISIBLE),
    ("a box of no size behind", box((0, 0, -8), (0, 0, -8)), Verdict.OCCLUDED),
    ("a flat box behind", oriented((1, 1, 0), EYE3), Verdict.OCCLUDED),
    ("a flat matrix behind", oriented((1, 1, 1), FLAT), Verdict.OCCLUDED),
    ("mirrored behind", oriented((1, 1, 1), MIRROR), Verdict.OCCLUDED),
    ("singular behind", oriented((1, 1, 1), SINGULAR), Verdict.OCCLUDED),
    ("singular before", oriented((1, 1, 9), SINGULAR, (0, 0, -2)), Verdict.VISIBLE),
    ("a zero matrix behind", oriented((1, 1, 1), np.zeros((3, 3))), Verdict.OCCLUDED),
    # Around the eye, with w <= 0 somewhere, and across the near plane.
    ("around the eye", sphere(0, 0, 0, 10), Verdict.VISIBLE),
    ("the eye on its skin", sphere(0, 0, -3, 3), Verdict.VISIBLE),
    ("a box around the eye", box((-1, -1, -1), (1, 1, 1)), Verdict.VISIBLE),
    ("an oriented box around the eye", oriented((2, 2, 2), EYE3, (0, 0, 0)), Verdict.VISIBLE),
    ("from behind the eye through the wall", box((-0.1, -0.1, -8), (0.1, 0.1, 1)), Verdict.VISIBLE),
    ("across the near plane", sphere(0, 0, -1, 0.25), Verdict.VISIBLE),
    (
        "across the near plane, to beyond the wall",
        box((-0.1, -0.1, -8), (0.1, 0.1, -0.5)),
        Verdict.VISIBLE,
    ),
    # At equal depth, and a hair behind it.
    ("equal depth", box((-1, -1, -5), (1, 1, -4)), Verdict.VISIBLE),
    ("touching from behind", sphere(0, 0, -5, 1), Verdict.VISIBLE),
    ("a hair behind", box((-1, -1, -5), (1, 1, -4.001)), Verdict.OCCLUDED),
    # Outside.
    ("before the near plane", sphere(0, 0, -0.5, 0.25), Verdict.OUTSIDE),
    ("behind the eye", sphere(0, 0, 5, 1), Verdict.OUTSIDE),
    ("to the left", sphere(-9, 0, -4, 1), Verdict.OUTSIDE),
]


@BOTH
@pytest.mark.parametrize(
    ("bounds", "verdict"), [row[1:] for row in BOUNDS], ids=[row[0] for row in BOUNDS]
)
def test_bounds(device: hizvk.Device, bounds: Any, verdict: Verdict, reversed_z: bool) -> None:
    camera = view(reversed_z=reversed_z)
    pyramid = device.pyramid(np.full(SIZE, 4.0), camera, kind="z")
    instances = device.instances(bounds)
    for options in ({}, {"footprint": 8}, {"descent": 4096}, {"order": "any"}):
        seen = device.cull(instances, camera, pyramid, **options)
        assert seen.verdicts.tolist() == [verdict]
        kept = verdict in (Verdict.VISIBLE, Verdict.INVALID)
        assert (seen.mask.tolist(), seen.indices.tolist()) == ([kept], [0] if kept else [])
        assert seen.stats.invalid == (verdict == Verdict.INVALID)


def of_bits(bits: int) -> np.float32:
    return np.array([bits], np.uint32).view(np.float32)[0]


#: The bits of a depth image's pixel and their meaning.
#: None: the number itself; "zero": the near end 0; "one": 1; "far": no depth.
BITS: list[tuple[int, str | None]] = [
    (0x3F000000, None),  # 1/2
    (0x00800000, None),  # the least normal number
    (0x3F7FFFFF, None),  # the last before 1
    (0x00000000, "zero"),
    (0x80000000, "zero"),  # -0
    (0x00000001, "zero"),  # subnormals
    (0x007FFFFF, "zero"),
    (0x80000001, "far"),  # negative, subnormal
    (0x80800000, "far"),
    (0xBF000000, "far"),
    (0x3F800000, "one"),
    (0x3F800001, "far"),  # above 1
    (0x40000000, "far"),
    (0x7F7FFFFF, "far"),
    (0x7F800000, "far"),  # infinities
    (0xFF800000, "far"),
    (0x7FC00000, "far"),  # NaN: quiet, signalling, with signs and payloads
    (0x7F800001, "far"),
    (0xFFC01234, "far"),
    (0xFF800001, "far"),
    (0x7FFFFFFF, "far"),
    (0xFFFFFFFF, "far"),
]


@BOTH
@pytest.mark.parametrize(("bits", "meaning"), BITS, ids=[f"{bits:08x}" for bits, _ in BITS])
def test_depth_bits(device: hizvk.Device, bits: int, meaning: str | None, reversed_z: bool) -> None:
    """Every level has the cleaned number, and so does the oracle's pyramid."""
    camera = view(reversed_z=reversed_z)
    far = 0.0 if reversed_z else 1.0
    clean = {None: of_bits(bits), "zero": 0.0, "one": 1.0, "far": far}[meaning]
    depth = np.full(SIZE, of_bits(bits))
    levels = device.pyramid(depth, camera, kind=camera.depth_kind)
    expected = np.float32(clean).view(np.uint32)
    for level in range(levels.num_levels):
        assert (levels.level(level).view(np.uint32) == expected).all()
    for level in hizvk.reference.pyramid(depth, reversed_z=reversed_z)[1:]:
        assert (level.view(np.uint32) == expected).all()


@BOTH
@pytest.mark.parametrize(
    "bits", [bits for bits, _ in BITS], ids=[f"{bits:08x}" for bits, _ in BITS]
)
def test_what_is_no_depth_is_a_hole(device: hizvk.Device, bits: int, reversed_z: bool) -> None:
    """One such pixel in a wall is a hole, unless it holds a depth in front of the box."""
    camera = view(reversed_z=reversed_z)
    wall = np.float32(0.25 if reversed_z else 0.75)  # depth 4
    depth = np.full(SIZE, wall)
    behind = box((-2, -2, -9), (2, 2, -8))  # 1/8, 7/8
    assert not hizvk.visible(
        behind, camera, depth=depth, kind=camera.depth_kind, device=device
    ).any()
    depth[8, 7] = of_bits(bits)
    with np.errstate(invalid="ignore"):
        value = float(depth[8, 7])
    hides = 0.125 < value <= 1.0 if reversed_z else 0.0 <= value < 0.875
    for options in ({}, {"footprint": 4}, {"descent": 4096}):
        seen = hizvk.visible(
            behind, camera, depth=depth, kind=camera.depth_kind, device=device, **options
        )
        assert seen.tolist() == [not hides]


@BOTH
@pytest.mark.parametrize("far_plane", [None, 100.0])
@pytest.mark.parametrize(
    "bad", [0.0, -0.0, -1.0, NAN, INF, -INF, 1e-310, 0.5, 180.0, 1e308], ids=str
)
def test_view_depth_and_distance_that_are_none_are_far(
    device: hizvk.Device, bad: float, far_plane: float | None, reversed_z: bool
) -> None:
    """Zero, negative, NaN and infinite depths count as far.

    So do depths outside near..far, which is 1 to 100.
    A distance of 180 is a view depth above 100 in every corner of the image.
    """
    if far_plane is None and bad > 100:
        pytest.skip("without a far plane that is a depth")
    camera = view(reversed_z=reversed_z, far=far_plane)
    for kind in ("z", "distance"):
        level = device.pyramid(np.full(SIZE, bad), camera, kind=kind).level(0)
        assert (level == (0.0 if reversed_z else 1.0)).all(), kind
        spheres = sphere(0, 0, -50, 1)
        assert hizvk.visible(
            spheres, camera, depth=np.full(SIZE, bad), kind=kind, device=device
        ).all()


@pytest.mark.parametrize("entry", [NAN, INF, -INF])
def test_cameras_of_nan_and_infinities_are_refused(entry: float) -> None:
    for place in np.ndindex(4, 4):
        matrix = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1], [0, 0, 1, 0]])
        matrix[place] = entry
        with pytest.raises(ValueError, match="clip_from_world: expected"):
            hizvk.Camera.from_matrices(matrix, size=SIZE, reversed_z=False)


def test_singular_cameras_and_rows_beyond_float32_are_refused(device: hizvk.Device) -> None:
    for matrix in (np.zeros((4, 4)), np.ones((4, 4)), np.diag([1.0, 0, 1, 1])):
        with pytest.raises(ValueError, match="clip_from_world: expected an invertible"):
            hizvk.Camera.from_matrices(matrix, size=SIZE, reversed_z=False)
    huge = np.array([[1e30, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1], [0, 0, 1, 0]])
    camera = hizvk.Camera.from_matrices(huge, size=SIZE, reversed_z=False)
    pyramid = device.pyramid(np.full(SIZE, 0.5, np.float32), camera, kind="ndc")
    with pytest.raises(
        ValueError, match=r"camera: expected rows whose coefficients stay below 2\^34"
    ):
        device.cull(device.instances(sphere(0, 0, 8, 1)), camera, pyramid)


def test_pyramids_of_another_size_camera_or_device_are_errors(device: hizvk.Device) -> None:
    """Python has no pyramid that was never built, because `Device.pyramid` builds it."""
    camera = view(reversed_z=True)
    pyramid = device.pyramid(np.full(SIZE, 4.0), camera, kind="z")
    instances = device.instances(sphere(0, 0, -8, 1))
    others = [
        view(reversed_z=True, size=(16, 17)),
        view(reversed_z=False),
        view(reversed_z=True, far=1e6),
        hizvk.Camera.look_at((0, 0, 1e-9), (0, 0, -1), fov_y_deg=90, size=SIZE, near=1.0),
    ]
    for other in others:
        with pytest.raises(ValueError, match="camera: expected the camera of the pyramid"):
            device.cull(instances, other, pyramid)
    elsewhere = hizvk.Device()
    with pytest.raises(ValueError, match="pyramid: expected Pyramid of this device"):
        elsewhere.cull(elsewhere.instances(sphere(0, 0, -8, 1)), camera, pyramid)
    # An equal camera counts as the same camera.
    assert device.cull(instances, view(reversed_z=True), pyramid).verdicts.tolist() == [
        Verdict.OCCLUDED
    ]
