"""The sky of metric images: what is infinite or beyond the far plane hides nothing.

The exact oracle says what is unoccluded.
``crates/hiz_core/src/input/tell_apart.rs`` has the numbers next to the far plane, and faults.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hizvk
from hizvk import Verdict

SIZE = (48, 64)
FAR = 60.0
KINDS = ("z", "distance")


def look(which: str, *, reversed_z: bool) -> hizvk.Camera:
    eye, target = (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)
    if which == "perspective":
        return hizvk.Camera.look_at(
            eye, target, fov_y_deg=60, size=SIZE, near=0.1, far=FAR, reversed_z=reversed_z
        )
    if which == "endless":
        return hizvk.Camera.look_at(
            eye, target, fov_y_deg=60, size=SIZE, near=0.1, far=None, reversed_z=reversed_z
        )
    near = -5.0 if which == "from behind" else 0.1
    return hizvk.Camera.orthographic(
        eye, target, height=12, size=SIZE, near=near, far=FAR, reversed_z=reversed_z
    )


CAMERAS = ("perspective", "endless", "parallel", "from behind")
#: Small spheres within all four views, over the middle of the image's two halves.
LEFT, RIGHT = (-1.0, 0.0, -4.0), (1.0, 0.0, -4.0)


def told(
    device: hizvk.Device, image: npt.NDArray[Any], camera: hizvk.Camera, **meaning: Any
) -> list[str]:
    """The verdicts over the left half and over the right one."""
    spheres = hizvk.Spheres([LEFT, RIGHT], 0.2)
    pyramid = device.pyramid(image, camera, depths="both", **meaning)
    seen = device.cull(device.instances(spheres), camera, pyramid)
    truth = hizvk.reference.unoccluded(spheres, camera, image, **meaning)
    assert not len(hizvk.compare_unoccluded(seen.verdicts, truth).false_claims)
    assert not len(hizvk.compare_unoccluded(seen.verdicts, truth).missed)
    return [Verdict(code).name for code in seen.verdicts]


def halves(wall: float, sky: float, dtype: str = "float64") -> npt.NDArray[Any]:
    """A wall in all of the left half, and a sky behind all of the right one."""
    image = np.full(SIZE, wall, dtype)
    image[:, SIZE[1] // 2 :] = sky
    return image


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("which", CAMERAS)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("dtype", ["float64", "float32", "float16", "uint16"])
def test_nothing_is_hidden_by_the_sky(
    device: hizvk.Device, dtype: str, kind: Any, which: str, reversed_z: bool
) -> None:
    camera = look(which, reversed_z=reversed_z)
    skies = [5_000.0] if dtype == "uint16" else [np.inf, 5_000.0]
    for sky in skies:
        names = told(device, halves(8, sky, dtype), camera, kind=kind)
        assert names == ["UNOCCLUDED", "UNOCCLUDED"], sky
    # A wall before the spheres hides them, with or without a sky.
    names = told(device, halves(2, skies[0], dtype), camera, kind=kind)
    assert names == ["OCCLUDED", "UNOCCLUDED"]


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("which", CAMERAS)
@pytest.mark.parametrize("kind", KINDS)
def test_no_data_may_hide_anything(
    device: hizvk.Device, kind: Any, which: str, reversed_z: bool
) -> None:
    camera = look(which, reversed_z=reversed_z)
    for pixel in (np.nan, -np.inf, -9.0):
        names = told(device, halves(8, pixel), camera, kind=kind)
        assert names == ["UNOCCLUDED", "VISIBLE"], pixel
    if which != "from behind":  # such a camera sees depth of either sign
        assert told(device, halves(8, 0.0), camera, kind=kind)[1] == "VISIBLE"
    # What the caller lists, whatever it is.
    for pixel in (np.inf, 5_000.0):
        names = told(device, halves(8, pixel), camera, kind=kind, invalid=[pixel])
        assert names == ["UNOCCLUDED", "VISIBLE"], pixel
    # The usual numbers of these dtypes.
    for dtype, pixel in (("uint16", 0), ("uint16", 65_535), ("float16", 65_504)):
        names = told(device, halves(8, pixel, dtype), camera, kind=kind)
        assert names == ["UNOCCLUDED", "VISIBLE"], (dtype, pixel)
    masked = np.ma.masked_greater(halves(8, 5_000.0), 100)
    spheres = hizvk.Spheres([LEFT, RIGHT], 0.2)
    pyramid = device.pyramid(masked, camera, kind=kind, depths="both")
    codes = device.cull(device.instances(spheres), camera, pyramid).verdicts
    assert [Verdict(code).name for code in codes] == ["UNOCCLUDED", "VISIBLE"]


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("which", ["perspective", "parallel"])
def test_next_to_the_far_plane_no_claim_is_false(
    device: hizvk.Device, which: str, reversed_z: bool
) -> None:
    """Walls within a few roundings of the far plane, and spheres up to it."""
    rng = np.random.default_rng(3)
    camera = look(which, reversed_z=reversed_z)
    off = rng.choice([0.0, 1e-16, 1e-9, 1e-7, 1e-6, 1e-4, 1e-2, np.inf], SIZE)
    image = FAR * (1 + off * rng.choice([-1, 1], SIZE))
    image[~np.isfinite(image)] = np.inf
    z = FAR - 0.02 - 10.0 ** rng.uniform(-7, 0, 400)
    aside = rng.uniform(-4, 4, (2, 400))
    spheres = hizvk.Spheres(np.stack([*aside, -z], axis=1), 0.01)
    crowd = device.instances(spheres)
    found = 0
    for dtype in ("float64", "float32"):
        for rel, absolute in ((0.0, 0.0), (1e-3, 0.0), (0.0, 0.05)):
            stored = image.astype(dtype)
            tolerance = hizvk.Tolerance(rel=rel, abs=absolute)
            pyramid = device.pyramid(stored, camera, kind="z", depths="both", tolerance=tolerance)
            for descent in (0, 256):
                seen = device.cull(crowd, camera, pyramid, descent=descent)
                # The surfaces may lie nearer by the tolerance.
                nearest = stored.astype(np.float64)
                finite = np.isfinite(nearest)
                nearest[finite] -= nearest[finite] * rel + absolute
                truth = hizvk.reference.unoccluded(spheres, camera, nearest, kind="z")
                compared = hizvk.compare_unoccluded(seen.verdicts, truth)
                assert not len(compared.false_claims), (dtype, rel, absolute)
                found += compared.claimed
    print(f"{which}, reversed {reversed_z}: {found} found")
    assert found > 50


@pytest.mark.parametrize("reversed_z", [False, True])
def test_groups_over_a_sky_are_accepted(device: hizvk.Device, reversed_z: bool) -> None:
    rng = np.random.default_rng(5)
    camera = look("perspective", reversed_z=reversed_z)
    crowd = device.instances(hizvk.Spheres(rng.uniform((-2, 0.5, -9), (2, 2, -5), (9000, 3)), 0.01))
    image = np.full(SIZE, 12.0)
    image[: SIZE[0] // 2] = np.inf
    spent = {}
    for name, array in (("sky", image), ("no data", np.where(np.isinf(image), np.nan, image))):
        pyramid = device.pyramid(array, camera, kind="z", depths="both")
        spent[name] = device.cull(crowd, camera, pyramid, hierarchy=True).stats
    assert spent["sky"].kept == spent["no data"].kept == 9000
    assert spent["sky"].accepted_instances > 8000
    assert spent["no data"].accepted_instances == 0


def test_one_looks_through_bounds_before_the_sky(device: hizvk.Device) -> None:
    """Counts of pixels: the sky is open, with one end of the pyramid and with both."""
    camera = look("perspective", reversed_z=True)
    ball = device.instances(hizvk.Spheres([RIGHT], 0.5))
    image = halves(8, np.inf)
    counts = [
        device.cull(
            ball, camera, device.pyramid(image, camera, kind="z", depths=depths), outputs=["pixels"]
        ).pixels[0]
        for depths in ("farthest", "both")
    ]
    assert counts[0].tolist() == counts[1].tolist()
    assert counts[0]["open"] > 0.8 * counts[0]["touched"]
