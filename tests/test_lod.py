"""Rules for levels of detail: what Python takes, and what arrives in the engine.

What they choose is tested against their definitions, in numpy.
``crates/hiz_core/tests/lod.rs`` has the cases that only some ulps decide.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hizvk
from hizvk import _core

SIZE = (8, 8)


def in_rust(rule: hizvk.LodByError | hizvk.LodByDistance | hizvk.LodBySize | None) -> str:
    text, _ = _core.options_text(hizvk.CullOptions(lod=rule), hizvk.Outputs())
    return text.partition("lod: ")[2]


def test_rules_arrive() -> None:
    assert in_rust(None).startswith("Finest")
    assert in_rust(hizvk.LodByError(2)).startswith("Error { pixels: 2.0 }")
    rule = hizvk.LodByDistance(np.array([1.0, 2.5], dtype=np.float32))
    assert in_rust(rule).startswith("Distance { thresholds: [1.0, 2.5] }")
    assert in_rust(hizvk.LodBySize((9, 0.5))).startswith("Size { pixels: [9.0, 0.5] }")


def test_rules_are_frozen_and_compare() -> None:
    rule = hizvk.LodByDistance([1, 2])
    assert rule == hizvk.LodByDistance(np.array([1.0, 2.0]))
    assert len({rule, hizvk.LodByDistance((1.0, 2.0)), hizvk.LodBySize([2, 1])}) == 2
    with pytest.raises(dataclasses.FrozenInstanceError):
        rule.thresholds = ()  # type: ignore[misc]


@pytest.mark.parametrize("reversed_z", [False, True])
@pytest.mark.parametrize("far", [None, 500.0])
def test_ndc_depths_are_those_of_the_camera(reversed_z: bool, far: float | None) -> None:
    """A point at a threshold's view depth has the NDC depth that was asked for."""
    camera = hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.5, far=far, reversed_z=reversed_z
    )
    depths = np.array([0.1, 0.6, 0.8, 0.95])
    if reversed_z:
        depths = depths[::-1]
    rule = hizvk.LodByDistance.at_ndc_depths(depths, near=0.5, far=far, reversed_z=reversed_z)
    points = np.array([[0.0, 0.0, -z, 1.0] for z in rule.thresholds])
    clip = points @ camera.clip_from_world.T
    np.testing.assert_allclose(clip[:, 2] / clip[:, 3], depths, rtol=1e-12)


def test_arms_thresholds() -> None:
    """View depth is n f / (f - (f - n) z)."""
    rule = hizvk.LodByDistance.at_ndc_depths(
        [0.8, 0.9, 0.95], near=1.0, far=500.0, reversed_z=False
    )
    np.testing.assert_allclose(rule.thresholds, [500 / 100.8, 500 / 50.9, 500 / 25.95], rtol=1e-12)


@pytest.mark.parametrize(("depth", "reversed_z"), [(0.0, True), (1.0, False)])
def test_nothing_is_infinitely_far(depth: float, reversed_z: bool) -> None:
    with pytest.raises(ValueError, match="depths: expected less than infinitely far, got"):
        hizvk.LodByDistance.at_ndc_depths([depth], near=1.0, reversed_z=reversed_z)
    at_far = hizvk.LodByDistance.at_ndc_depths([depth], near=1.0, far=7.0, reversed_z=reversed_z)
    np.testing.assert_allclose(at_far.thresholds, [7.0], rtol=1e-12)


def test_distances_need_a_perspective_camera() -> None:
    device = hizvk.Device()
    camera = hizvk.Camera.orthographic(
        (0, 0, 0), (0, 0, -1), height=4.0, size=SIZE, near=0.0, far=10.0
    )
    pyramid = device.pyramid(np.full(SIZE, 5.0), camera, kind="z")
    crowd = device.instances(hizvk.Spheres(np.array([[0.0, 0.0, -2.0]]), 0.5))
    with pytest.raises(ValueError, match="lod: expected a rule by error or by size"):
        device.cull(crowd, camera, pyramid, hizvk.CullOptions(lod=hizvk.LodByDistance([1.0])))
    for rule in (hizvk.LodByError(1.0), hizvk.LodBySize([10.0]), None):
        options = hizvk.CullOptions(lod=rule)
        assert device.cull(crowd, camera, pyramid, options).mask.tolist() == [True]


def test_keywords_that_would_do_nothing_are_refused() -> None:
    device = hizvk.Device()
    camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=SIZE, near=0.1)
    wall = np.full(SIZE, 5.0)
    pyramid = device.pyramid(wall, camera, kind="z")
    spheres = hizvk.Spheres(np.array([[0.0, 0.0, -2.0]]), 0.5)
    crowd = device.instances(spheres)
    refused = {"lod": hizvk.LodByError(1.0), "emit": "instances", "placement": "reserved"}
    for name, value in refused.items():
        asked: dict[str, Any] = {name: value}
        with pytest.raises(ValueError, match=f"^{name}: expected meshes= beside it.*without mes"):
            device.cull(crowd, camera, pyramid, **asked)
        with pytest.raises(ValueError, match=rf"^{name}: expected meshes= beside it"):
            device.warm_up(crowd, camera, **asked)
    with pytest.raises(ValueError, match=r'^pixel_budget: expected "pixels" among the outputs'):
        device.cull(crowd, camera, pyramid, pixel_budget=8)
    # The defaults, and objects that calls with and without meshes share, say nothing.
    shared = hizvk.CullOptions(lod=refused["lod"]), hizvk.Outputs(placement="reserved")
    assert device.cull(crowd, camera, pyramid, *shared).mask.tolist() == [True]
    silent = device.cull(crowd, camera, pyramid, lod=None, emit="bins", placement="packed")
    assert silent.mask.tolist() == [True]
    with pytest.raises(ValueError, match=r"^lod: expected None, because visible lists nothing"):
        hizvk.visible(spheres, camera, depth=wall, kind="z", lod=refused["lod"])
    with pytest.raises(ValueError, match=r"^lod: expected None, because cull_approximate lists"):
        device.cull_approximate(crowd, camera, pyramid, negligible_px=1, lod=refused["lod"])


ERRORS = [[0.0, 0.004, 0.03, 0.2], [0.0, 0.1]]
CROWD = 3000


def crowd() -> tuple[npt.NDArray[Any], ...]:
    """Centres, radii, mesh ids and scales of spheres in view, at depths over two decades."""
    random = np.random.default_rng(5)
    depth = 10 ** random.uniform(0.0, 2.3, CROWD)
    aside = random.uniform(-0.5, 0.5, (2, CROWD)) * depth
    centers = np.stack([aside[0], aside[1], -depth], axis=1)
    radii = 10 ** random.uniform(-2.0, 0.3, CROWD)
    return centers, radii, random.integers(0, 2, CROWD), random.uniform(0.2, 3.0, CROWD)


def greatest_stretch(camera: hizvk.Camera) -> float:
    """Pixels times w per unit of length, at the image's corner where they are most."""
    height, width = camera.size
    rows = camera.clip_from_world[:, :3]
    x, y, w = rows[0] * width / 2, -rows[1] * height / 2, rows[3]
    corners = [(tx, ty) for tx in (-width / 2, width / 2) for ty in (-height / 2, height / 2)]
    return max(float(np.linalg.norm([x - tx * w, y - ty * w], 2)) for tx, ty in corners)


@pytest.mark.parametrize(
    "rule",
    [
        hizvk.LodByError(1.0),
        hizvk.LodByError(0.25),
        hizvk.LodByDistance([4.96, 9.82, 19.27]),
        hizvk.LodBySize([100.0, 20.0, 5.0]),
        None,
    ],
    ids=repr,
)
def test_what_a_cull_chooses(rule: hizvk.lod.LodRule | None) -> None:
    """The coarsest LOD that the definition allows; a finer one only within 1e-4 of a bound."""
    centers, radii, mesh_ids, scales = crowd()
    camera = hizvk.Camera.look_at(
        (0, 0, 0), (0, 0, -1), fov_y_deg=80, size=(360, 640), near=0.1, far=1e4
    )
    device = hizvk.Device()
    pyramid = device.pyramid(np.full((360, 640), np.inf), camera, kind="z")
    draws = [hizvk.DrawTemplate(36)] * 4
    meshes = [hizvk.MeshLods(draws[: len(errors)], errors=errors) for errors in ERRORS]
    bounds = hizvk.Spheres(centers, radii)
    instances = device.instances(bounds, mesh_ids=mesh_ids.astype(np.uint32), scales=scales)
    seen = device.cull(instances, camera, pyramid, meshes=meshes, lod=rule)

    stretch = greatest_stretch(camera)
    least_w = -centers[:, 2] - radii
    got = seen.lods
    assert (got[~seen.mask] == hizvk.NO_LOD).all()
    chosen = set()
    for i in np.flatnonzero(seen.mask):
        errors = np.array(ERRORS[mesh_ids[i]][1:])
        needs = np.full(len(errors), np.inf)
        if isinstance(rule, hizvk.LodByError):
            needs = errors * scales[i] * stretch / rule.pixels
        elif isinstance(rule, hizvk.LodByDistance):
            needs = np.array(rule.thresholds[: len(errors)])
        elif isinstance(rule, hizvk.LodBySize):
            needs = 2.0 * radii[i] * stretch / np.array(rule.pixels[: len(errors)])
        allowed, surely = (
            int(np.cumprod(least_w[i] > needs * factor).sum()) if least_w[i] > 0.0 else 0
            for factor in (1.0, 1.0001)
        )
        assert surely <= got[i] <= allowed, (i, got[i], surely, allowed)
        chosen.add(int(got[i]))
    assert chosen == ({0} if rule is None else {0, 1, 2, 3})
