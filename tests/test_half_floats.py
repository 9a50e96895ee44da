"""Depth in half floats and in float32: their rounding counts as slack, in every kind.

Every expectation is worked out by hand.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hizvk

# The kind, the stored number, and the view depth of a wall half a spacing behind it.
# That wall is stored as the same number.
# A spacing is 2^-7 from 8 to 16, 2^-11 from 0.5 to 1, and 2^-14 from 2^-4 to 2^-3.
CASES = [
    ("z", 10.0, 10.0 + 2.0**-8),
    ("distance", 10.0, 10.0 + 2.0**-8),
    ("ndc", 0.875, 1.0 / (0.125 - 2.0**-12)),
    ("reversed_ndc", 0.0625, 1.0 / (0.0625 - 2.0**-15)),
]


@pytest.mark.parametrize(("kind", "stored", "wall"), CASES, ids=[case[0] for case in CASES])
@pytest.mark.parametrize("way", ["device", "visible", "list", "big-endian"])
def test_what_a_half_float_rounds_is_counted(
    device: hizvk.Device, kind: Any, stored: float, wall: float, way: str
) -> None:
    camera = hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(1, 1), near=1.0, reversed_z=kind != "ndc"
    )
    # Flat boxes.
    # One is a quarter of that half spacing in front of the wall.
    # The other is far enough behind the stored number.
    step = wall - stored if kind in ("z", "distance") else wall - (8.0 if kind == "ndc" else 16.0)
    depths = np.array([wall - 0.25 * step, wall + 4.0 * step])
    low = np.stack([-0.1 * depths, -0.1 * depths, -depths], axis=1)
    high = np.stack([0.1 * depths, 0.1 * depths, -depths], axis=1)
    boxes = hizvk.Boxes(low, high)

    def seen(image: Any) -> list[bool]:
        if way == "visible":
            mask = hizvk.visible(boxes, camera, depth=image, kind=kind, device=device)
        else:
            pyramid = device.pyramid(image, camera, kind=kind)
            mask = device.cull(device.instances(boxes), camera, pyramid).mask
        return [bool(kept) for kept in mask]

    half = np.full((1, 1), stored, ">f2" if way == "big-endian" else np.float16)
    assert seen([[half[0, 0]]] if way == "list" else half) == [True, False]
    # If the wall is exactly at the stored number, the first box is hidden.
    assert seen(half.astype(np.float32)) == [False, False]


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("kind", ["z", "distance"])
def test_what_float32_rounds_of_a_metric_depth_is_counted(
    device: hizvk.Device, kind: Any, reversed_z: bool
) -> None:
    """Just behind a near plane 1024 units away.

    There no share of the NDC depth covers a share of the metric depth.
    """
    camera = hizvk.Camera.orthographic(
        (0, 0, 0), (0, 0, -1), height=2, size=(1, 1), near=1024, far=1056, reversed_z=reversed_z
    )
    # A spacing is 2^-13, and a wall just short of half a spacing behind 1025 is stored as 1025.
    wall = 1025.0 + 0.49 * 2.0**-13
    image = np.full((1, 1), wall).astype(np.float32)
    assert image[0, 0] == 1025.0
    points = np.array(
        [[0.0, 0.0, -(1025.0 + 0.45 * 2.0**-13)], [0.0, 0.0, -(1025.0 + 64.0 * 2.0**-13)]]
    )
    spheres = device.instances(hizvk.Spheres(points, 0.0))
    for form in (image, image.astype(">f4"), list(image), memoryview(image)):
        pyramid = device.pyramid(form, camera, kind=kind)
        assert device.cull(spheres, camera, pyramid, depth_slack=0.0).mask.tolist() == [
            True,
            False,
        ], type(form)


def test_rows_with_masks_are_masked(device: hizvk.Device) -> None:
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(8, 8), near=0.1)
    behind = hizvk.Spheres([[0.0, 0.0, -20.0]], 1.0)
    for dtype in (np.float32, np.uint16):
        image = np.ma.array(np.full(camera.size, 5, dtype), mask=True)
        with pytest.warns(hizvk.errors.HizWarning, match="every pixel is far"):
            assert hizvk.visible(
                behind, camera, depth=list(image), kind="z", device=device
            ).tolist() == [True]
        assert not hizvk.visible(
            behind, camera, depth=list(image.data), kind="z", device=device
        ).any()
    with pytest.raises(TypeError, match=r"centers: expected .* got a masked array"):
        hizvk.Spheres(list(np.ma.zeros((2, 3))), 1.0)


def test_listed_rows_are_refused_where_their_array_is(device: hizvk.Device) -> None:
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(8, 8), near=0.1)
    behind = hizvk.Spheres([[0.0, 0.0, -20.0]], 1.0)
    for dtype in (np.int8, np.uint8, np.bool_):
        image = np.full(camera.size, 1, dtype)
        for form in (image, list(image), [list(row) for row in image]):
            with pytest.raises(TypeError, match=r"^depth: expected "):
                hizvk.visible(behind, camera, depth=form, kind="z", device=device)
    # Python's own integers are metres.
    assert not hizvk.visible(behind, camera, depth=[[5] * 8] * 8, kind="z", device=device).any()


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.dtype(">f2")])
def test_lists_of_several_dtypes_are_refused(device: hizvk.Device, dtype: Any) -> None:
    """Promoted to float64 they would count as exact.

    Then the rounding of the half floats would hide visible things.
    """
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(2, 2), near=0.1)
    row = np.full(2, 10, dtype)
    mixtures: list[list[object]] = [
        [row, [10.0, 10.0]],
        [[10.0, 10.0], row],
        [[10.0, row[0]], row],
        [row, row.astype("f8")],
    ]
    for mixed in mixtures:
        with pytest.raises(
            TypeError, match=r"^depth: expected numbers of one dtype, got a list of float64 with "
        ):
            device.pyramid(mixed, camera, kind="z")  # type: ignore[arg-type]
    device.pyramid([row, list(row)], camera, kind="z")
    device.pyramid([row.astype("f8"), [10.0, 10.0]], camera, kind="z")


def test_what_masked_parameters_are_told_leads_somewhere(device: hizvk.Device) -> None:
    """Where NaN is refused, the hint does not suggest NaN."""
    vertices = np.ma.zeros((3, 3))
    with pytest.raises(TypeError, match=r"^vertices: .*masked array; leave out what is masked"):
        device.occluders(vertices, [[0, 1, 2]])
    with pytest.raises(
        TypeError, match=r"^triangles: .*masked array; leave out the triangles that are masked"
    ):
        device.occluders(vertices.data, np.ma.array([[0, 1, 2]]))
    with pytest.raises(TypeError, match=r"^eye: .*masked array; leave out what is masked"):
        hizvk.Camera.look_at(np.ma.zeros(3), (0, 0, -1), fov_y_deg=60, size=(8, 8), near=0.1)


def test_reference_takes_half_floats_as_they_are() -> None:
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(1, 1), near=1.0)
    boxes = hizvk.Boxes(np.array([[-1.0, -1.0, -10.003]]), np.array([[1.0, 1.0, -10.003]]))
    image = np.full((1, 1), 10.0, np.float16)
    assert hizvk.reference.classify(boxes, camera, image, kind="z")[0] == hizvk.reference.HIDDEN
