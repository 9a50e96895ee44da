"""Doors that open and close and a bus that drives by: moved occluders hide nothing that shows.

Rays at the moved triangles say what shows, and the library takes no part in moving those.
"""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pytest

import hizvk
from hizvk.scenes import Scene, box_mesh
from hizvk.scenes.doors import Doors, Mover, doors
from hizvk.scenes.truth import RayCaster, Sight

SIZE: Final = (90, 160)
FRAMES: Final = 60
#: The images that a cull may take, as options of `Device.render_depth`.
IMAGES: Final[dict[str, dict[str, Any]]] = {
    "host": {"rasteriser": "host"},
    "device": {"rasteriser": "device"},
    "conservative": {"conservative": True, "size": (72, 128)},
}
SOME: Final = range(0, FRAMES, 6)

needs_rays = pytest.mark.skipif(
    importlib.util.find_spec("embreex") is None, reason="the truth is cast by embreex"
)


@dataclass(frozen=True, eq=False)
class Truth:
    """What rays see in the views of some frames."""

    doors: Doors
    casters: dict[int, RayCaster]
    sights: dict[int, list[Sight]]

    def visible(self, frame: int, k: int) -> np.ndarray:
        return self.sights[frame][k].pixels(len(self.doors.scene)) > 0

    def false_culls(self, frame: int, k: int, mask: np.ndarray) -> int:
        wrong = np.flatnonzero(self.visible(frame, k) & ~mask)
        sight, view = self.sights[frame][k], self.doors.scene.views[k]
        return int(self.casters[frame].firm(view, sight, None, wrong).sum()) if len(wrong) else 0


def seen_by_rays(frames: range) -> Truth:
    made = doors(frames=FRAMES)
    casters = {frame: RayCaster(made.at(frame)) for frame in frames}
    sights = {
        frame: [caster.look(view, SIZE) for view in made.scene.views]
        for frame, caster in casters.items()
    }
    return Truth(made, casters, sights)


@pytest.fixture(scope="module")
def some() -> Truth:
    return seen_by_rays(SOME)


def moved(occluders: hizvk.Occluders, made: Doors, frame: int) -> None:
    for number, mover in enumerate(made.movers, 1):
        occluders.move(number, mover.transforms[frame])


def count(device: hizvk.Device, truth: Truth, image: str, *, moves: bool = True) -> tuple[int, int]:
    """False culls, and hidden instances that were culled, over all frames and views."""
    made, scene = truth.doors, truth.doors.scene
    occluders = device.occluders(made.meshes(0))
    things = device.instances(hizvk.Boxes(scene.box_min, scene.box_max))
    cameras = [view.camera(SIZE) for view in scene.views]
    false_culls = hidden = 0
    for frame in truth.sights:
        if moves:
            moved(occluders, made, frame)
        for k, camera in enumerate(cameras):
            depth = device.render_depth(occluders, camera, **IMAGES[image])
            verdicts = device.cull(
                things, depth.camera, device.pyramid(depth), outputs=["verdicts"]
            ).verdicts
            kept = verdicts == hizvk.Verdict.VISIBLE
            false_culls += truth.false_culls(frame, k, kept)
            hidden += int(((verdicts == hizvk.Verdict.OCCLUDED) & ~truth.visible(frame, k)).sum())
    return false_culls, hidden


@needs_rays
def test_what_a_door_hides_shows_later(some: Truth) -> None:
    """Else a cull that ignores the moves could pass."""
    for k, view in enumerate(some.doors.scene.views):
        seen = np.array([some.visible(frame, k) for frame in SOME])
        assert (seen.any(axis=0) & ~seen.all(axis=0)).sum() >= 8, view.name


@needs_rays
@pytest.mark.parametrize("image", IMAGES)
def test_moved_occluders_hide_nothing_that_shows(
    device: hizvk.Device, some: Truth, image: str
) -> None:
    false_culls, hidden = count(device, some, image)
    assert false_culls == 0
    assert hidden > 5000  # of 24,000: they do hide


@needs_rays
@pytest.mark.slow
def test_sixty_frames_hide_nothing_that_shows(device: hizvk.Device) -> None:
    truth = seen_by_rays(range(FRAMES))
    for image in IMAGES:
        false_culls, hidden = count(device, truth, image)
        print(f"{image}: {FRAMES} frames, {false_culls} false culls, {hidden:,} hidden and culled")
        assert false_culls == 0


@needs_rays
@pytest.mark.parametrize("image", IMAGES)
def test_an_occluder_that_stays_behind_is_seen(
    device: hizvk.Device, some: Truth, image: str
) -> None:
    """A planted fault: the meshes move and their occluders do not."""
    false_culls, _ = count(device, some, image, moves=False)
    assert false_culls > 20


@pytest.mark.parametrize("image", IMAGES)
def test_a_moved_mesh_is_drawn_as_an_uploaded_one(device: hizvk.Device, image: str) -> None:
    made = doors(frames=FRAMES)
    there = device.occluders(made.meshes(0))
    camera = made.scene.views[1].camera(SIZE)
    images = []
    for frame in (30, 15, 0):
        moved(there, made, frame)
        anew = device.occluders(made.meshes(frame))
        images.append(device.render_depth(there, camera, **IMAGES[image]).numpy())
        again = device.render_depth(anew, camera, **IMAGES[image]).numpy()
        if image == "conservative":
            # A moved copy shares no edge with another one, so some pixels are farther (reversed Z).
            # Where it is taken as a whole, its faces are a rounding of their corners farther.
            assert (images[-1] <= again).all()
            assert (images[-1] >= again * (1 - 1e-5)).mean() > 0.99
        else:
            assert np.array_equal(images[-1], again)
    assert not np.array_equal(images[0], images[1])


def test_the_scene_in_a_frame_by_hand() -> None:
    shape, faces = box_mesh([[0.0, 0.0, 0.0]], [[1.0, 0.5, 2.0]])
    turn = np.eye(4)
    turn[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]  # a quarter to the left
    turn[:3, 3] = (10.0, 0.0, 0.0)
    mover = Mover(shape, faces, np.stack([np.eye(4), turn])[:, None])
    vertices, triangles = mover.placed(1)
    assert vertices.min(axis=0).tolist() == [9.5, 0.0, 0.0]
    assert vertices.max(axis=0).tolist() == [10.0, 1.0, 2.0]
    assert np.array_equal(triangles, faces)
    made = doors(things=6, frames=4)
    assert len(made) == 4
    whole: Scene = made.at(3)
    boxes = len(made.scene.triangles) // 12 + 6 + 6 + 1
    assert whole.triangles.shape == (12 * boxes, 3)
    assert len(np.unique(whole.triangles)) == len(whole.vertices) == 8 * boxes


def test_closed_doors_fill_their_doorways() -> None:
    made = doors(frames=FRAMES)
    hinged, sliding, _ = made.movers
    for mover, near in ((hinged, -1.0625), (sliding, 1.25)):
        first = 1.5 + 4.0 * np.arange(6)
        shut = 0
        for frame in range(FRAMES):
            boxes = mover.placed(frame)[0].reshape(6, 8, 3)
            closed = np.isclose(boxes[:, :, 0].min(axis=1), first) & np.isclose(
                boxes[:, :, 1].max(axis=1) - boxes[:, :, 1].min(axis=1), 0.0625
            )
            for low, high, x in zip(
                boxes[closed].min(axis=1), boxes[closed].max(axis=1), first[closed], strict=True
            ):
                assert np.allclose(low, (x, near, 0.0))
                assert np.allclose(high, (x + 1.0, near + 0.0625, 2.25))
                shut += 1
        assert 0.4 * 6 * FRAMES < shut < 0.6 * 6 * FRAMES


@pytest.mark.parametrize("rasteriser", ["host", "device"])
def test_no_pixel_changes_outside_of_the_rectangle(device: hizvk.Device, rasteriser: Any) -> None:
    """Squares that end at borders of pixels, at their centres, and at those of the image."""
    camera = hizvk.Camera.orthographic(
        (0, 0, 0), (0, 0, -1), height=16, size=(16, 16), near=0, far=10
    )
    for low, high in [(3.0, 8.0), (3.5, 7.5), (0.0, 16.0), (-2.0, 18.0), (12.0, 16.0), (0.0, 1.0)]:
        x, y = np.array([low, high, high, low]) - 8.0, np.array([low, low, high, high]) - 8.0
        corners = np.stack([x, y, np.full(4, -5.0)], axis=1)
        square = device.occluders(corners, [[0, 1, 2], [0, 2, 3]])
        depth = device.render_depth(square, camera, rasteriser=rasteriser, only=[])
        assert not depth.numpy().any()
        touched = device.render_depth(square, into=depth)
        rows, columns = np.nonzero(depth.numpy())
        assert touched is not None
        assert touched[0] <= columns.min() <= columns.max() <= touched[2] < 16, (low, high)
        assert touched[1] <= rows.min() <= rows.max() <= touched[3] < 16, (low, high)
