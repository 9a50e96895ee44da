"""The oracle's tolerance: `hizvk.reference.classify` moves depths as `Device.pyramid` does.

Expected are exact rationals of this file.
Cameras stand at the origin and look along -z, so view depth is -z, and NDC depth is a rational.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hizvk
from hizvk.reference import HIDDEN, UNDECIDED, VISIBLE

if TYPE_CHECKING:
    from collections.abc import Iterator

SIZE = (1, 1)
NEAR, FAR = Fraction(1, 4), Fraction(64)
TOLERANCES = ((0.0, 0.0), (0.25, 0.0), (0.0, 0.75), (0.01, 0.02), (0.5, 3.0))


def cameras() -> Iterator[tuple[hizvk.Camera, str]]:
    """Of one pixel, whose middle is the axis of the view."""
    eye, target = (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)
    for reversed_z in (False, True):
        for far in (None, float(FAR)):
            yield (
                hizvk.Camera.look_at(
                    eye,
                    target,
                    fov_y_deg=90,
                    size=SIZE,
                    near=float(NEAR),
                    far=far,
                    reversed_z=reversed_z,
                ),
                "endless" if far is None else "perspective",
            )
        yield (
            hizvk.Camera.orthographic(
                eye,
                target,
                height=2,
                size=SIZE,
                near=float(NEAR),
                far=float(FAR),
                reversed_z=reversed_z,
            ),
            "parallel",
        )


def exact_rows(camera: hizvk.Camera) -> tuple[Fraction, Fraction, Fraction, Fraction]:
    """``(a, b, c, d)`` of clip z = a z + b and clip w = c z + d, as the camera has them."""
    z, w = camera.clip_from_world[2], camera.clip_from_world[3]
    assert not np.any([z[:2], w[:2]])
    return Fraction(z[2]), Fraction(z[3]), Fraction(w[2]), Fraction(w[3])


def ndc_of(camera: hizvk.Camera, view_depth: Fraction) -> Fraction:
    a, b, c, d = exact_rows(camera)
    return (b - a * view_depth) / (d - c * view_depth)


def depth_of(camera: hizvk.Camera, ndc: Fraction) -> Fraction | None:
    """View depth of an NDC depth; None at infinity or beyond it."""
    a, b, c, d = exact_rows(camera)
    if ndc * c == a:
        return None
    depth = (b - ndc * d) / (a - ndc * c)
    return depth if depth > 0 or c == 0 else None


def expected(camera: hizvk.Camera, point: float, moved: Fraction | None) -> int:
    """What a point at a view depth is, behind a surface at another; None hides nothing."""
    if moved is None:
        return VISIBLE
    return HIDDEN if Fraction(point) > moved else VISIBLE


def around(depth: Fraction) -> list[float]:
    """Depths next to one, and a little before and behind it."""
    near = float(depth)
    return [near * (1 + off) for off in (-1e-3, -1e-6, -1e-9, 1e-9, 1e-6, 1e-3)] + [
        np.nextafter(near, 0),
        near,
        np.nextafter(near, np.inf),
    ]


def check(camera: hizvk.Camera, number: float, moved: Fraction | None, **meaning: Any) -> int:
    """Compares the oracle with rationals; returns how many cases it decides."""
    guess = Fraction(number) if moved is None else moved
    depths = [d for d in around(guess) if NEAR < Fraction(d) < FAR]
    if not depths:
        return 0
    points = hizvk.Points([(0.0, 0.0, -d) for d in depths])
    image = np.full(SIZE, number)
    codes = hizvk.reference.classify(points, camera, image, coverage="sample", **meaning)
    for depth, code in zip(depths, codes, strict=True):
        if code == UNDECIDED:
            # Between the two float32 around the moved depth, which are a part in 2^23 apart.
            assert moved is not None
            apart = abs(ndc_of(camera, Fraction(depth)) - ndc_of(camera, moved))
            assert apart <= Fraction(1, 2**23)
        else:
            assert code == expected(camera, depth, moved), (camera, number, meaning, depth)
    return int((codes != UNDECIDED).sum())


def test_metric_depth_is_moved_exactly() -> None:
    decided = 0
    for camera, which in cameras():
        for kind in ("z", "distance"):
            for rel, absolute in TOLERANCES:
                tolerance = hizvk.Tolerance(rel=rel, abs=absolute)
                for number, scale in ((0.3, 1.0), (2.0, 1.0), (2500.0, 0.001), (50.0, 1.0)):
                    value = Fraction(number) * Fraction(scale)
                    moved: Fraction | None = value * (1 + Fraction(rel)) + Fraction(absolute)
                    if which != "endless" and moved is not None and moved > FAR:
                        moved = None
                    decided += check(
                        camera, number, moved, kind=kind, scale=scale, tolerance=tolerance
                    )
    assert decided > 800


def test_ndc_depth_is_moved_as_the_view_depth_that_it_stands_for() -> None:
    decided = 0
    for camera, _ in cameras():
        kind = "reversed_ndc" if camera.reversed_z else "ndc"
        for rel, absolute in TOLERANCES:
            tolerance = hizvk.Tolerance(rel=rel, abs=absolute)
            for number in (0.9, 0.5, 0.999, 0.01):
                depth = depth_of(camera, Fraction(number))
                moved = None
                if depth is not None:
                    moved = depth * (1 + Fraction(rel)) + Fraction(absolute)
                    moved = moved if ndc_inside(camera, moved) else None
                decided += check(camera, number, moved, kind=kind, tolerance=tolerance)
    assert decided > 150


def ndc_inside(camera: hizvk.Camera, view_depth: Fraction) -> bool:
    return 0 < ndc_of(camera, view_depth) < 1


def test_what_is_no_depth_is_not_moved() -> None:
    """Before the near plane, far, infinite, and listed: nothing is hidden."""
    for camera, _ in cameras():
        own = "reversed_ndc" if camera.reversed_z else "ndc"
        far = 0.0 if camera.reversed_z else 1.0
        point = hizvk.Points([(0.0, 0.0, -60.0)])
        tolerance = hizvk.Tolerance(rel=0.5, abs=0.3)
        for number, kind in (
            (0.2, "z"),
            (np.nan, "z"),
            (np.inf, "distance"),
            (7.0, "z"),
            (far, own),
            (1.5, own),
        ):
            codes = hizvk.reference.classify(
                point, camera, np.full(SIZE, number), kind=kind, invalid=[7.0], tolerance=tolerance
            )
            assert codes.tolist() == [VISIBLE], (number, kind)


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("kind", ["z", "distance", "ndc"])
def test_no_cull_with_a_tolerance_is_false(
    device: hizvk.Device, kind: Any, reversed_z: bool
) -> None:
    rng = np.random.default_rng(8)
    eye, forward = np.array([3.0, 1, 2]), np.array([2.0, -1, -9]) / np.sqrt(86)
    near, far = 0.2, 80.0
    camera = hizvk.Camera.look_at(
        eye, eye + forward, fov_y_deg=70, size=(24, 32), near=near, far=far, reversed_z=reversed_z
    )
    image = rng.choice([4.0, 9.0, 20.0, 79.0], camera.size) * rng.uniform(0.999, 1, camera.size)
    if kind == "ndc":
        image = far / (far - near) * (1 - near / image)
        image, kind = (1 - image, "reversed_ndc") if reversed_z else (image, "ndc")
    z = rng.choice([4.0, 9.0, 20.0], 600) * rng.uniform(0.95, 1.3, 600)
    right = np.cross(forward, (0, 1, 0))
    right /= np.linalg.norm(right)
    at = rng.uniform(-0.6, 0.6, (2, 600)) * z
    points = hizvk.Points(
        eye
        + at[0][:, None] * right
        + at[1][:, None] * np.cross(right, forward)
        + z[:, None] * forward
    )
    culled = shown = 0
    for rel, absolute in TOLERANCES[1:]:
        tolerance = hizvk.Tolerance(rel=rel, abs=absolute)
        pyramid = device.pyramid(image, camera, kind=kind, tolerance=tolerance)
        seen = device.cull(device.instances(points), camera, pyramid, guard_px=0)
        truth = hizvk.reference.classify(points, camera, image, kind=kind, tolerance=tolerance)
        compared = hizvk.compare(seen.mask, truth)
        assert not len(compared.false_culls), (rel, absolute, compared)
        # Without the tolerance more is hidden, and some of it shows.
        plain = hizvk.reference.classify(points, camera, image, kind=kind)
        shown += int(((plain == HIDDEN) & (truth == VISIBLE)).sum())
        assert not ((plain == VISIBLE) & (truth == HIDDEN)).any()
        culled += int((~seen.mask).sum())
    assert culled > 50
    assert shown > 50


def test_a_camera_without_view_depth_is_refused() -> None:
    camera = hizvk.Camera.from_matrices(np.diag([1.0, 1, 0.1, 1]), size=SIZE, reversed_z=False)
    point, image = hizvk.Points([(0.0, 0, 0.5)]), np.full(SIZE, 0.5)
    assert hizvk.reference.classify(point, camera, image, kind="ndc").tolist() == [VISIBLE]
    with pytest.raises(ValueError, match="does not say where view depth starts"):
        hizvk.reference.classify(
            point, camera, image, kind="ndc", tolerance=hizvk.Tolerance(abs=0.1)
        )
