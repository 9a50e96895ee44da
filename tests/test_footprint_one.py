"""One texel: the finest one that encloses a rectangle, and a descent from there.

Rakos (2010) compares one texel with four; Greene, Kass and Miller (1993) begin at one.
Levels and texels are expected from loops that divide by two until one texel is left.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt
import pytest

import hizvk
from hizvk.bench import footprints

if TYPE_CHECKING:
    from pathlib import Path

Array: TypeAlias = npt.NDArray[Any]
SIZE = (77, 130)
ALL_OF_IT = 65536


def camera_at(x: float, *, reversed_z: bool = True) -> hizvk.Camera:
    return hizvk.Camera.look_at(
        (x, 0, 0), (x, 0, -1), fov_y_deg=60, size=SIZE, near=0.1, reversed_z=reversed_z
    )


def wall_with_holes(seed: int, share: float) -> Array:
    """View depth of a rough wall at 8 to 12, of which a share is open."""
    rng = np.random.default_rng(seed)
    depth = rng.uniform(8.0, 12.0, SIZE)
    depth[rng.uniform(size=SIZE) < share] = 100.0
    return depth.astype(np.float32)


def bounds_of(kind: str, count: int, seed: int = 3) -> Any:
    rng = np.random.default_rng(seed)
    z = rng.uniform(3.0, 40.0, count)
    x, y = rng.uniform(-1.1, 1.1, count) * z, rng.uniform(-0.7, 0.7, count) * z
    centers = np.stack([x, y, -z], axis=1)
    half = z[:, None] * 2.0 ** rng.uniform(-9.0, -2.0, (count, 1)) * rng.uniform(0.3, 1, (count, 3))
    if kind == "spheres":
        return hizvk.Spheres(centers, half[:, 0])
    if kind == "boxes":
        return hizvk.Boxes(centers - half, centers + half)
    if kind == "points":
        return hizvk.Points(centers)
    angles = rng.uniform(0.0, 360.0, count)
    return hizvk.OrientedBoxes.from_yaw(centers, half, yaw_deg=angles, up=(0, 1, 0))


def enclosing(rectangle: tuple[int, int, int, int]) -> tuple[int, tuple[int, int]]:
    """The finest level where the pixels x0, y0, x1, y1 lie in one texel, and that texel."""
    x0, y0, x1, y1 = rectangle
    level = 0
    while (x0, y0) != (x1, y1):
        x0, y0, x1, y1 = x0 // 2, y0 // 2, x1 // 2, y1 // 2
        level += 1
    return level, (x0, y0)


def test_it_reads_the_finest_texel_that_encloses(device: hizvk.Device) -> None:
    camera = camera_at(0.0)
    pyramid = device.pyramid(wall_with_holes(1, 0.02), camera, kind="z")
    result = device.cull(device.instances(bounds_of("boxes", 400)), camera, pyramid, footprint=1)
    levels = set()
    for i in range(len(result)):
        told = result.explain(i)
        if told.texels_read == 0:
            continue
        level, texel = enclosing(told.rectangle)
        assert (told.level, told.texels, told.texels_read) == (level, (texel,), 1)
        assert told.texel_depths == (float(pyramid.level(level)[texel[1], texel[0]]),)
        levels.add(level)
    # From single pixels to all of the image.
    assert levels >= {0, 1, 2, 3, 4, 5, 6, 8}


def test_it_counts_one_texel_for_each_test(device: hizvk.Device) -> None:
    camera = camera_at(0.0)
    pyramid = device.pyramid(wall_with_holes(1, 0.02), camera, kind="z")
    instances = device.instances(bounds_of("spheres", 500))
    options: dict[str, Any] = {"hierarchy": False, "statistics": True}
    one, four = (device.cull(instances, camera, pyramid, footprint=n, **options) for n in (1, 2))
    looked_up = sum(one.explain(i).texels_read > 0 for i in range(len(one)))
    assert one.stats.texels_read == looked_up
    assert looked_up < four.stats.texels_read <= 4 * looked_up
    assert one.count > four.count


@pytest.mark.parametrize(
    ("kind", "fit"),
    [
        ("spheres", "rectangle"),
        ("boxes", "rectangle"),
        ("boxes", "volume"),
        ("oriented_boxes", "rectangle"),
        ("points", "rectangle"),
    ],
)
def test_with_a_descent_it_answers_as_four(
    device: hizvk.Device, kind: str, fit: Literal["rectangle", "volume"]
) -> None:
    """Greene's test from one cell: the same verdicts; each kind in one of the conventions."""
    instances = device.instances(bounds_of(kind, 2000))
    camera = camera_at(0.0, reversed_z=kind != "spheres")
    pyramid = device.pyramid(wall_with_holes(2, 0.004), camera, kind="z", depths="both")
    options: dict[str, Any] = {"descent": ALL_OF_IT, "fit": fit, "hierarchy": kind == "boxes"}
    one, four = (device.cull(instances, camera, pyramid, footprint=n, **options) for n in (1, 2))
    assert (one.verdicts == four.verdicts).all()
    assert (one.verdicts == hizvk.Verdict.OCCLUDED).sum() > 100
    assert (one.verdicts == hizvk.Verdict.UNOCCLUDED).sum() > 10 or kind == "points"
    alone = device.cull(instances, camera, pyramid, footprint=1, hierarchy=False)
    assert (alone.verdicts == hizvk.Verdict.OCCLUDED).sum() > 10
    # What one texel hides, a descent hides, too.
    assert not (one.mask & ~alone.mask).any()


def test_groups_and_views_answer_alike(device: hizvk.Device) -> None:
    instances = device.instances(bounds_of("boxes", 5000))
    cameras = [camera_at(x) for x in (-2.0, 0.0, 3.0)]
    pyramids = [
        device.pyramid(wall_with_holes(7 + k, 0.003), one, kind="z")
        for k, one in enumerate(cameras)
    ]
    views = device.cull(instances, cameras, pyramids, footprint=1)
    for k, (camera, pyramid) in enumerate(zip(cameras, pyramids, strict=True)):
        flat = device.cull(instances, camera, pyramid, footprint=1, hierarchy=False)
        grouped = device.cull(instances, camera, pyramid, footprint=1, hierarchy=True)
        # A group may hide what one texel of a member does not; never the other way round.
        assert not (grouped.mask & ~flat.mask).any()
        assert not (views[k].mask & ~flat.mask).any()
        assert (views[k].mask != flat.mask).sum() < 50


@pytest.mark.parametrize(
    ("coverage", "levels", "kind"),
    [
        ("area", None, "spheres"),
        ("area", 2, "boxes"),
        ("sample", (2, 4), "boxes"),
        ("sample", None, "oriented_boxes"),
        ("area", (2, 4), "points"),
    ],
)
def test_nothing_visible_is_hidden(
    device: hizvk.Device, coverage: Literal["area", "sample"], levels: Any, kind: str
) -> None:
    """Against the oracle, also where the level that encloses is not stored."""
    camera, depth = camera_at(0.0), wall_with_holes(4, 0.004)
    bounds = bounds_of(kind, 400)
    truth = hizvk.reference.classify(bounds, camera, depth, kind="z", coverage=coverage)
    pyramid = device.pyramid(depth, camera, kind="z", levels=levels)
    for descent in (0, 12):
        result = device.cull(
            device.instances(bounds), camera, pyramid, footprint=1, descent=descent,
            coverage=coverage,
        )  # fmt: skip
        compared = hizvk.compare(result.mask, truth)
        assert compared.false_culls.size == 0
        assert compared.hidden > 30


def test_one_texel_keeps_more_trees(device: hizvk.Device, tmp_path: Path) -> None:
    """The text's figure: one texel keeps more than four, and four more than sixteen."""
    found = footprints.measure(device, trees=3000, size=(180, 320))
    one, four, sixteen, _, one_down, four_down = found.rows
    assert one.kept.sum() > 1.1 * four.kept.sum() > 1.1 * sixteen.kept.sum()
    assert (one_down.kept == four_down.kept).all()
    assert one.texels < four.texels < sixteen.texels
    assert all(row.lost == 0 for row in found.rows)
    footprints.draw(tmp_path / "trees.png", found)
    assert (tmp_path / "trees.png").stat().st_size > 10_000


# -- front faces -----------------------------------------------------------------------------------


def front_faces(low: Array, high: Array) -> list[tuple[Array, Array]]:
    """The faces of a box that look at the origin, each as a box without thickness."""
    found = []
    for axis in range(3):
        for end, other in ((low, high), (high, low)):
            # Outside of the face's plane, on the side away from the box.
            if (end[axis] - other[axis]) * (0.0 - end[axis]) > 0:
                a, b = low.copy(), high.copy()
                a[axis] = b[axis] = end[axis]
                found.append((a, b))
    return found


def test_what_all_front_faces_hide_a_volume_fit_hides(device: hizvk.Device) -> None:
    """Moller and Haines (1999) call a box occluded if all of its front faces are.

    Each face is tested on its own at full resolution.
    """
    camera = camera_at(0.0)
    rng = np.random.default_rng(11)
    count, by_faces, by_rectangle = 0, 0, 0
    for near in (3.0, 5.0):
        # A slanted wall: boxes in front of its far end have faces that recede beside it.
        depth = np.broadcast_to(np.geomspace(near, 30.0, SIZE[1]), SIZE).astype(np.float32)
        z = rng.uniform(6.0, 30.0, 400)
        middle = np.stack([rng.uniform(-0.8, 0.8, 400) * z, rng.uniform(-0.5, 0.5, 400) * z, -z], 1)
        half = rng.uniform(0.02, 0.25, (400, 3)) * z[:, None]
        low, high = middle - half, middle + half
        faces = [front_faces(a, b) for a, b in zip(low, high, strict=True)]
        owner = np.repeat(np.arange(400), [len(of_box) for of_box in faces])
        flat = np.array([face for of_box in faces for face in of_box])
        pyramid = device.pyramid(depth, camera, kind="z")

        def hidden(boxes: hizvk.Boxes, pyramid: hizvk.Pyramid = pyramid, **more: Any) -> Array:
            seen = device.cull(device.instances(boxes), camera, pyramid, descent=ALL_OF_IT, **more)
            return np.asarray(~seen.mask)

        face_hidden = hidden(hizvk.Boxes(flat[:, 0], flat[:, 1]))
        all_faces = np.bincount(owner, weights=~face_hidden, minlength=400) == 0
        volume = hidden(hizvk.Boxes(low, high), fit="volume")
        rectangle = hidden(hizvk.Boxes(low, high))
        assert not (all_faces & ~volume).any()
        assert not (rectangle & ~volume).any()
        count += int(volume.sum())
        by_faces += int(all_faces.sum())
        by_rectangle += int(rectangle.sum())
    print(f"\nhidden: rectangle {by_rectangle}, all front faces {by_faces}, volume fit {count}")
    assert by_rectangle < by_faces < count


def test_a_box_around_the_camera_has_no_front_face(device: hizvk.Device) -> None:
    """So "all front faces are occluded" is true of it, and yet it is visible."""
    low, high = np.array([-1.0, -1.0, -2.0]), np.array([1.0, 2.0, 3.0])
    assert front_faces(low, high) == []
    camera = camera_at(0.0)
    box = device.instances(hizvk.Boxes([low], [high]))
    pyramid = device.pyramid(np.full(SIZE, 0.5, np.float32), camera, kind="z")
    for footprint in (1, 2):
        for fit in ("rectangle", "volume"):
            options: dict[str, Any] = {"footprint": footprint, "fit": fit, "descent": 64}
            assert device.cull(box, camera, pyramid, **options).mask.tolist() == [True]
