"""`Device.warm_up`: the first frame after it compiles nothing.

The Rust tests count the pipelines of every kind of frame (``crates/hiz_core/tests/warm_up.rs``).
"""

from typing import Any

import numpy as np
import pytest

import hizvk
from hizvk import _core

SIZE = (48, 64)
TRIANGLE = (np.array([[-3.0, -3, -4], [3, -3, -4], [0, 3, -4]]), np.array([[0, 1, 2]]))

FRAMES: dict[str, dict[str, Any]] = {
    "defaults": {},
    "mask alone": {"outputs": ["mask"]},
    "draws in any order": {"outputs": ["indices", "draws"], "order": "any", "capacity": 10},
    "groups": {"hierarchy": True, "statistics": True},
    "volumes": {"fit": "volume", "descent": 64, "footprint": 4},
    "samples": {"coverage": "sample", "hierarchy": True},
}


def bounds(kind: str) -> hizvk.Spheres | hizvk.Boxes:
    centers = np.random.default_rng(3).uniform(-9, 9, (300, 3))
    if kind == "spheres":
        return hizvk.Spheres(centers, 0.4)
    return hizvk.Boxes(centers - 0.4, centers + 0.4)


@pytest.mark.parametrize("is_drawn", [False, True], ids=["array", "rendered"])
@pytest.mark.parametrize("frame", FRAMES)
def test_the_first_frame_compiles_nothing(frame: str, is_drawn: bool) -> None:
    keywords = FRAMES[frame]
    crowd = bounds("boxes" if is_drawn else "spheres")
    # A device of its own has no pipelines yet.
    device = hizvk.Device()
    camera = hizvk.Camera.look_at((0, 0, 9), (0, 0, 0), fov_y_deg=60, size=SIZE, near=0.1)
    instances = device.instances(crowd)
    walls = device.occluders(*TRIANGLE) if is_drawn else None
    device.warm_up(instances, camera, occluders=walls, **keywords)

    moved = hizvk.Camera.look_at((1, 0, 9), (0, 1, 0), fov_y_deg=70, size=SIZE, near=0.2)
    if walls is None:
        pyramid = device.pyramid(np.full(SIZE, 8.0), moved, kind="z")
    else:
        pyramid = device.pyramid(device.render_depth(walls, moved))
    instances.update(0, crowd)
    seen = device.cull(instances, moved, pyramid, **keywords)
    assert seen._inner.timings()[1] == 0.0
    if "verdicts" in (keywords.get("outputs") or ["verdicts"]):
        assert seen.stats.compile_ms == 0.0


MORE: dict[str, dict[str, Any]] = {
    "two passes": {"two_passes": True},
    "two passes against both ends": {"two_passes": True, "depths": "both"},
    "views": {"views": 3},
    "samples": {"samples": 4},
    "samples, both ends": {"samples": 2, "depths": "both"},
    "all": {"two_passes": True, "views": 2, "samples": 4, "depths": "both"},
}


def frame_of(
    device: hizvk.Device, instances: hizvk.Instances, more: dict[str, Any], size: tuple[int, int]
) -> None:
    """A frame that does what `more` says, seen from another place than the warm-up's."""
    camera = hizvk.Camera.look_at((1, 0, 9), (0, 1, 0), fov_y_deg=70, size=size, near=0.2)
    samples = more.get("samples", 1)
    image = np.full(size if samples == 1 else (*size, samples), 8.0)
    keywords: dict[str, Any] = {"kind": "z", "depths": more.get("depths", "farthest")}
    pyramid = device.pyramid(image, camera, **keywords)
    assert device.cull(instances, camera, pyramid).mask.any()
    if more.get("two_passes"):
        for capacity in (None, 5):
            passes = device.temporal(instances, early_capacity=capacity)
            for early in ({}, {"largest_px": 1}, {"only": list(range(0, 300, 3))}):
                assert passes.early(camera, **early).mask.any()
            assert passes.late(camera, pyramid).mask.any()
            assert passes.early(camera).mask.any()
    if (views := more.get("views", 1)) > 1:
        assert device.cull(instances, [camera] * views, [pyramid] * views).any.any()


@pytest.mark.parametrize("what", MORE)
def test_the_first_frame_of_more_passes_makes_no_pipeline(what: str) -> None:
    more, size = MORE[what], (48, 64)
    device = hizvk.Device()
    made = _core.Yardstick(device._engine).pipelines_made
    instances = device.instances(bounds("spheres"))
    camera = hizvk.Camera.look_at((0, 0, 9), (0, 0, 0), fov_y_deg=60, size=size, near=0.1)
    device.warm_up(instances, camera)
    plain = made()
    device.warm_up(instances, camera, **more)
    warmed = made()
    # The farthest of several samples is one image, which is read as any other.
    assert warmed > plain > 0 or what == "samples", "a plain warm-up does not know these passes"
    frame_of(device, instances, more, size)
    assert made() == warmed


def test_what_cannot_be_warmed_up_is_refused(device: hizvk.Device) -> None:
    camera = hizvk.Camera.look_at((0, 0, 9), (0, 0, 0), fov_y_deg=60, size=SIZE, near=0.1)
    instances = device.instances(bounds("spheres"))
    with pytest.raises(ValueError, match="samples: expected one of"):
        device.warm_up(instances, camera, samples=3)
    with pytest.raises(ValueError, match="samples: expected 1 beside occluders, got 4"):
        device.warm_up(instances, camera, samples=4, occluders=device.occluders(*TRIANGLE))


def test_it_changes_no_instance(device: hizvk.Device) -> None:
    camera = hizvk.Camera.look_at((0, 0, 9), (0, 0, 0), fov_y_deg=60, size=SIZE, near=0.1)
    instances = device.instances(bounds("spheres"))
    pyramid = device.pyramid(np.full(SIZE, 8.0), camera, kind="z")
    before = device.cull(instances, camera, pyramid)
    mask = before.mask.copy()
    device.warm_up(instances, camera)
    after = device.cull(instances, camera, pyramid)
    assert (after.mask == mask).all()
    assert 0 < mask.sum() < len(mask)
    assert (before.verdicts == after.verdicts).all()
