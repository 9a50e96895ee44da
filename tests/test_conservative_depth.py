"""Conservative occluder depth of a small image holds for large images of the same view.

Culls that use it hide nothing that the large images show.

`crates/hiz_core/tests/conservative_depth` decides exactly whether the depth is right for every
single ray.
Here real scenes are compared with large rasterised images, and with rays at the real geometry.
"""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import documented
import hizvk
from hizvk import scenes
from hizvk.scenes import truth

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

SMALL = (144, 256)
SIZES = pytest.mark.parametrize(
    "size",
    [
        pytest.param(SMALL, id="256x144"),
        pytest.param((288, 512), id="512x288", marks=pytest.mark.slow),
    ],
)
#: The size of the image whose truth judges culls by small images.
LARGE = (864, 1536)
#: How many times as large the rasterised image is that the small one is compared with.
TIMES = 16


@dataclass(frozen=True)
class Case:
    """A view of occluders; its camera depends on the image's size and the depth convention."""

    name: str
    vertices: np.ndarray
    triangles: np.ndarray
    camera: Callable[[tuple[int, int], bool], hizvk.Camera]


def view_cases(scene: scenes.Scene, views: tuple[scenes.View, ...]) -> Iterator[Case]:
    for view in views:

        def camera(
            size: tuple[int, int], reversed_z: bool, view: scenes.View = view
        ) -> hizvk.Camera:
            return hizvk.Camera.look_at(
                view.eye, view.target, up=view.up, fov_y_deg=view.fov_y_deg, size=size,
                near=view.near, reversed_z=reversed_z,
            )  # fmt: skip

        yield Case(view.name, scene.vertices, scene.triangles, camera)


def castle_cases(judge: Any, names: tuple[str, ...]) -> Iterator[Case]:
    scene = judge.load_scene(Path(judge.__file__).with_name("castle.npz"))
    for seen in scene.cameras:
        if seen.name in names:

            def camera(size: tuple[int, int], reversed_z: bool, seen: Any = seen) -> hizvk.Camera:
                matrix = judge.view_projection(seen, size, "reversed" if reversed_z else "standard")
                return hizvk.Camera.from_matrices(matrix, size=size, reversed_z=reversed_z)

            yield Case(seen.name, scene.occluder_vertices, scene.occluder_triangles, camera)


def blocked(case: Case, camera: hizvk.Camera, at: tuple[Fraction, Fraction], depth: float) -> bool:
    """Whether the ray through image point `at` meets a triangle at `depth` or nearer.

    Decided in exact fractions.
    """
    height, width = camera.size
    matrix = camera.clip_from_world
    x, y = 2 * at[0] / width - 1, 1 - 2 * at[1] / height
    # Triangles that the ray misses by far are left out in float64.
    vertices = np.asarray(case.vertices, np.float64)
    clip = np.concatenate([vertices, np.ones((len(vertices), 1))], axis=1) @ matrix.T
    across = np.stack(
        [clip[:, 0] - float(x) * clip[:, 3], clip[:, 1] - float(y) * clip[:, 3]], axis=1
    )
    corners = across[case.triangles]
    room = 1e-6 * np.abs(corners).max(axis=(1, 2), keepdims=False)[:, None]
    near = ((corners.min(axis=1) <= room) & (corners.max(axis=1) >= -room)).all(axis=1)
    rows = [[Fraction(v) for v in row] for row in camera._inner.rows()]
    origin = [Fraction(v) for v in camera._inner.origin()]
    for triangle in np.flatnonzero(near):
        points = []
        for vertex in case.triangles[triangle]:
            d = [Fraction(float(p)) - o for p, o in zip(vertices[vertex], origin, strict=True)] + [
                Fraction(1)
            ]
            points.append([sum(m * v for m, v in zip(row, d, strict=True)) for row in rows])
        u = [(p[0] - x * p[3], p[1] - y * p[3]) for p in points]
        weights = [
            u[(k + 1) % 3][0] * u[(k + 2) % 3][1] - u[(k + 1) % 3][1] * u[(k + 2) % 3][0]
            for k in range(3)
        ]
        if min(weights) < 0 < max(weights) or not any(weights):
            continue
        total = sum(weights)
        z, w = (sum(s * p[k] for s, p in zip(weights, points, strict=True)) / total for k in (2, 3))
        if (
            w > 0
            and 0 <= z <= w
            and (z >= Fraction(depth) * w if camera.reversed_z else z <= Fraction(depth) * w)
        ):
            return True
    return False


def check_against_large_image(
    device: hizvk.Device, cases: Iterator[Case], most_loss: float
) -> None:
    """Check that no sample of an image `TIMES` as large is farther than the small image's depth.

    At most the share `most_loss` of covered pixels may lack a depth.
    """
    full_pixels = shown = 0
    for case in cases:
        occluders = device.occluders(case.vertices, case.triangles)
        for reversed_z in (True, False):
            small = case.camera(SMALL, reversed_z)
            depth = (
                device.render_depth(occluders, small, conservative=True).numpy().astype(np.float64)
            )
            size = (SMALL[0] * TIMES, SMALL[1] * TIMES)
            samples = device.render_depth(occluders, small, size=size).numpy()
            blocks = (
                samples.reshape(SMALL[0], TIMES, SMALL[1], TIMES)
                .transpose(0, 2, 1, 3)
                .reshape(*SMALL, -1)
            )
            sign = -1.0 if reversed_z else 1.0
            at = (sign * blocks).argmax(axis=2)
            farthest = np.take_along_axis(blocks, at[..., None], 2)[..., 0].astype(np.float64)
            far = 0.0 if reversed_z else 1.0
            known, full = depth != far, farthest != far
            suspects = np.argwhere(known & (sign * farthest > sign * depth))
            # A rasteriser moves corners and rounds depths.
            # Where its sample is farther, that has to be its own error.
            # The exact ray through that very sample is blocked.
            assert len(suspects) < 200, f"{case.name}: {len(suspects)} pixels"
            for row, column in suspects:
                sub_row, sub_column = divmod(int(at[row, column]), TIMES)
                point = (
                    Fraction(2 * (int(column) * TIMES + sub_column) + 1, 2 * TIMES),
                    Fraction(2 * (int(row) * TIMES + sub_row) + 1, 2 * TIMES),
                )
                assert blocked(case, small, point, float(depth[row, column])), (
                    f"{case.name}: pixel {row}, {column}"
                )
            full_pixels += int(full.sum())
            shown += int((known & full).sum())
            looseness = (
                np.abs(farthest - depth)[known & full] / np.abs(farthest - far)[known & full]
            )
            print(
                f"{case.name}, reversed_z={reversed_z}: "
                f"of {full.sum()} covered pixels {(known & full).sum()} have a depth, "
                f"{np.median(looseness):.2e} farther in the median "
                f"(relative to the distance to far), "
                f"{np.quantile(looseness, 0.9):.2e} at 90 %; "
                f"{len(suspects)} samples were the rasteriser's error"
            )
    assert shown >= (1.0 - most_loss) * full_pixels


def test_no_sample_of_a_large_image_of_the_room_is_farther(device: hizvk.Device) -> None:
    room = scenes.room()
    check_against_large_image(device, view_cases(room, room.views), 0.002)


def test_no_sample_of_a_large_image_of_the_mountains_is_farther(device: hizvk.Device) -> None:
    pytest.importorskip("matplotlib", reason="the elevation model is matplotlib's")
    mountains = scenes.mountains(trees=10, views=4)
    check_against_large_image(device, view_cases(mountains, mountains.views[::2]), 0.002)


def test_no_sample_of_a_large_image_of_the_castle_is_farther(
    device: hizvk.Device, judge: Any
) -> None:
    names = ("intel_default", "street6", "high0", "tight3", "nearcut2", "wide120")
    check_against_large_image(device, castle_cases(judge, names), 0.005)


@SIZES
def test_culls_of_castle_by_small_images_hide_nothing_of_the_large_one(
    device: hizvk.Device, judge: Any, size: tuple[int, int]
) -> None:
    scene = judge.load_scene(Path(judge.__file__).with_name("castle.npz"))
    boxes = device.instances(hizvk.Boxes(scene.instance_aabb_min, scene.instance_aabb_max))
    occluders = device.occluders(scene.occluder_vertices, scene.occluder_triangles)
    names = ("intel_default", "street6", "high0")
    counts = {False: [0, 0, 0], True: [0, 0, 0]}
    for seen in (camera for camera in scene.cameras if camera.name in names):
        sight = judge.render_truth(scene, seen, LARGE)
        camera = hizvk.Camera.from_matrices(
            judge.view_projection(seen, size, "reversed"), size=size, reversed_z=True
        )
        for conservative, count in counts.items():
            pyramid = device.pyramid(
                device.render_depth(occluders, camera, conservative=conservative)
            )
            mask = device.cull(boxes, camera, pyramid, footprint=8, descent=4096).mask
            wrong = judge.score(mask, sight)["wrongly_culled"]
            count[0] += len(wrong)
            count[1] += int((mask & ~sight["visible"]).sum())
            count[2] += int(sight["visible"].sum())
    report("castle", size, counts)


@SIZES
@pytest.mark.parametrize("name", ["mountains", "room"])
def test_culls_by_small_images_hide_nothing_of_the_large_one(
    device: hizvk.Device, name: str, size: tuple[int, int]
) -> None:
    pytest.importorskip("matplotlib", reason="the elevation model is matplotlib's")
    pytest.importorskip("embreex", reason="rays are cast with embreex")
    scene = scenes.mountains(trees=4000, views=3) if name == "mountains" else scenes.room()
    caster = truth.RayCaster(scene)
    boxes = device.instances(hizvk.Boxes(scene.box_min, scene.box_max))
    occluders = device.occluders(scene.vertices, scene.triangles)
    counts = {False: [0, 0, 0], True: [0, 0, 0]}
    for view in scene.views:
        sight = caster.look(view, LARGE)
        visible = sight.pixels(len(scene)) > 0
        camera = view.camera(size)
        for conservative, count in counts.items():
            pyramid = device.pyramid(
                device.render_depth(occluders, camera, conservative=conservative)
            )
            mask = device.cull(boxes, camera, pyramid, footprint=8, descent=4096).mask
            wrong = [
                k for k in np.flatnonzero(visible & ~mask) if caster.firm(view, sight, None, int(k))
            ]
            count[0] += len(wrong)
            count[1] += int((mask & ~visible).sum())
            count[2] += int(visible.sum())
    report(name, size, counts, plain_has_to_fail=name == "mountains" and size == SMALL)


def report(
    name: str,
    size: tuple[int, int],
    counts: dict[bool, list[int]],
    *,
    plain_has_to_fail: bool = True,
) -> None:
    for conservative, (wrong, idle, visible) in counts.items():
        kind = "conservative" if conservative else "plain"
        print(
            f"{name}, {kind} {size[1]}x{size[0]}: "
            f"of {visible} visible at {LARGE[1]}x{LARGE[0]}, {wrong} culled; "
            f"{idle} kept that are not visible"
        )
    assert counts[True][0] == 0
    # The test proves nothing unless the plain image fails.
    assert counts[False][0] > 0 or not plain_has_to_fail
    text = documented.page("occluders.md")
    if not documented.is_of_this_driver(text):
        return
    rows = documented.table(text, "scene", "image", "visible")
    [row] = [row for row in rows if (row["scene"], row["image"]) == (name, f"{size[1]}x{size[0]}")]
    said = [int(cell) for cell in list(row.values())[2:]]
    (plain, plain_idle, visible), (wrong, idle, _) = counts[False], counts[True]
    assert said == [visible, plain, wrong, plain_idle, idle]


@pytest.mark.slow
@pytest.mark.parametrize("size", [SMALL, (288, 512)], ids=["256x144", "512x288"])
def test_refinement_keeps_no_more(device: hizvk.Device, judge: Any, size: tuple[int, int]) -> None:
    """Print what refinement gains and costs over all cameras of the castle.

    No step may keep more than the step before.
    """
    scene = judge.load_scene(Path(judge.__file__).with_name("castle.npz"))
    boxes = device.instances(hizvk.Boxes(scene.instance_aabb_min, scene.instance_aabb_max))
    occluders = device.occluders(scene.occluder_vertices, scene.occluder_triangles)
    cameras = [
        hizvk.Camera.from_matrices(
            judge.view_projection(seen, size, "reversed"), size=size, reversed_z=True
        )
        for seen in scene.cameras
    ]
    pictures: list[dict[str, Any]] = [
        {},
        *({"conservative": True, "refinement": k} for k in range(5)),
    ]
    kept = []
    for options in pictures:
        device.render_depth(occluders, cameras[0], **options)
        count, seconds = 0, 0.0
        for camera in cameras:
            start = time.process_time()
            depth = device.render_depth(occluders, camera, **options)
            seconds += time.process_time() - start
            count += device.cull(
                boxes, camera, device.pyramid(depth), footprint=8, descent=4096
            ).count
        kept.append(count)
        milliseconds = (
            f", {1000 * seconds / len(cameras):.0f} ms of CPU an image" if options else ""
        )
        print(f"{size[1]}x{size[0]} {options or 'plain'}: {count} kept{milliseconds}")
    assert all(finer <= coarser for coarser, finer in itertools.pairwise(kept[1:]))
    text = documented.page("occluders.md")
    if documented.is_of_this_driver(text):
        [row] = [
            row
            for row in documented.table(text, "image", "plain")
            if row["image"] == f"{size[1]}x{size[0]}"
        ]
        assert [int(cell.split(",")[0]) for cell in list(row.values())[1:]] == kept, row


# -- by hand ---------------------------------------------------------------------------------------


def wall(left: float, right: float) -> tuple[np.ndarray, np.ndarray]:
    """A wall at depth 4 that is higher than the image of `camera`."""
    corners = [[left, -9.0, -4.0], [right, -9.0, -4.0], [right, 9.0, -4.0], [left, 9.0, -4.0]]
    return np.array(corners), np.array([[0, 1, 2], [0, 2, 3]])


def is_at_the_wall(depth: np.ndarray) -> bool:
    """Whether depth is 1/4 or the next float32 farther.

    The bound is a rounding of float64 behind the wall.
    """
    return bool(
        ((depth == 0.25) | (depth == np.nextafter(np.float32(0.25), np.float32(0.0)))).all()
    )


@pytest.fixture
def camera() -> hizvk.Camera:
    """A camera 90 degrees wide: 8 pixels, each one world unit at depth 4; NDC depth is 1/z."""
    return hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(8, 8), near=1.0)


def test_gap_between_centres_shows_in_the_conservative_image_alone(
    device: hizvk.Device, camera: hizvk.Camera
) -> None:
    walls = device.occluders([wall(-9.0, 0.95), wall(0.99, 9.0)])
    assert (device.render_depth(walls, camera).numpy() == 0.25).all()
    depth = device.render_depth(walls, camera, conservative=True).numpy()
    assert (depth[:, 4] == 0.0).all()
    assert is_at_the_wall(np.delete(depth, 4, axis=1))


def test_walls_that_share_their_edge_leave_no_gap(
    device: hizvk.Device, camera: hizvk.Camera
) -> None:
    walls = device.occluders([wall(-9.0, 0.3), wall(0.3, 9.0)])
    assert is_at_the_wall(device.render_depth(walls, camera, conservative=True).numpy())
    assert is_at_the_wall(
        device.render_depth(walls, camera, size=(3, 5), conservative=True).numpy()
    )


def test_silhouettes_have_the_depth_of_what_is_behind(
    device: hizvk.Device, camera: hizvk.Camera
) -> None:
    post = np.array([[-0.4, -9.0, -2.0], [0.2, -9.0, -2.0], [0.2, 9.0, -2.0], [-0.4, 9.0, -2.0]])
    occluders = device.occluders([(post, wall(0, 0)[1]), wall(-9.0, 9.0)])
    # In the image the post spans columns 3.2 to 4.4.
    assert is_at_the_wall(device.render_depth(occluders, camera, conservative=True).numpy())
    assert (device.render_depth(occluders, camera).numpy()[:, 3] == 0.5).all()


def test_refinement_finds_what_two_surfaces_cover_together(
    device: hizvk.Device, camera: hizvk.Camera
) -> None:
    # The walls overlap in column 4, and neither of them covers it.
    # The left wall covers it up to 0.7, the right wall from 0.3 on.
    occluders = device.occluders([wall(-9.0, 0.7), wall(0.3, 9.0)])
    assert (
        device.render_depth(occluders, camera, conservative=True, refinement=0).numpy()[:, 4] == 0.0
    ).all()
    assert is_at_the_wall(
        device.render_depth(occluders, camera, conservative=True, refinement=2).numpy()
    )


def test_refinement_hardly_ever_loses(device: hizvk.Device) -> None:
    """A step finds more in sum, and loses more than 2 % in at most one of 1,000 pixels.

    A pixel whose depth is within 2 % of its farthest sample is not looked at again.
    The parts of a pixel are not proved by the same triangles as the whole.
    """
    scene = scenes.room()
    occluders = device.occluders(scene.vertices, scene.triangles)
    view = scene.views[0].camera((45, 80))
    depths = [
        device.render_depth(occluders, view, conservative=True, refinement=k).numpy()
        for k in range(4)
    ]
    for coarser, finer in itertools.pairwise(depths):
        assert (finer < 0.98 * coarser).mean() < 1e-3
        assert finer.sum() > 0.999 * coarser.sum()
    assert depths[3].sum() > depths[0].sum()
    assert occluders.host_bytes > 36 * len(scene.triangles)
