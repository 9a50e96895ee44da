"""Published visibility tests on the device: each formula as printed, and each with its defect.

The expected masks come from plain loops over instances in float64, written here from the texts.
The scenes that show a defect are made by hand, and a certified cull keeps what each test loses.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt
import pytest

import hizvk
from hizvk.bench import texts
from hizvk.bench.texts_report import Found, Method, Report, table
from hizvk.measuring.spread import Spread

if TYPE_CHECKING:
    from pathlib import Path

    from hizvk.methods.texts import _Text

Array: TypeAlias = npt.NDArray[Any]
NEAR = 0.125


def view(size: tuple[int, int], borders: tuple[float, float, float, float]) -> hizvk.Camera:
    """A camera at the origin that looks along -z, with these borders at depth 1."""
    left, right, bottom, top = borders
    return hizvk.Camera.frustum(
        (0, 0, 0), (0, 0, -1), left=left, right=right, bottom=bottom, top=top, near=NEAR, size=size
    )


def kept(
    device: hizvk.Device, text: _Text, bounds: Any, camera: hizvk.Camera, depth: Array
) -> Array:
    """What a published test keeps before this view depth."""
    test = hizvk.PublishedTest(
        device, text, bounds, camera, device.pyramid(depth, camera, kind="z")
    )
    test.run()
    return test.mask


def certified(device: hizvk.Device, bounds: Any, camera: hizvk.Camera, depth: Array) -> Array:
    return hizvk.visible(bounds, camera, depth=depth, kind="z", device=device)


# -- the formulas, in loops ------------------------------------------------------------------------


class Loops:
    """The four tests, one instance at a time, for a centred camera at the origin."""

    def __init__(self, depth: Array, tangent: float) -> None:
        height, width = depth.shape
        self.size, self.tangent = (width, height), (tangent * width / height, tangent)
        self.levels = [NEAR / depth]  # reversed: 1 is near, 0 is far
        while self.levels[-1].size > 1:
            self.levels.append(self.coarser(self.levels[-1]))

    @staticmethod
    def coarser(level: Array) -> Array:
        """Sides are halved and rounded down; a texel takes three along an odd side."""
        rows, columns = (max(side // 2, 1) for side in level.shape)
        odd = [side % 2 for side in level.shape]
        return np.array(
            [
                [
                    level[2 * y : 2 * y + 2 + odd[0], 2 * x : 2 * x + 2 + odd[1]].min()
                    for x in range(columns)
                ]
                for y in range(rows)
            ]
        )

    def uv(self, point: Array) -> tuple[float, float]:
        x, y, z = point
        return 0.5 + 0.5 * x / -z / self.tangent[0], 0.5 - 0.5 * y / -z / self.tangent[1]

    def level(self, lod: float) -> Array:
        return self.levels[int(min(max(lod, 0), len(self.levels) - 1))]

    def lookup(self, u: float, v: float, lod: float) -> float:
        level = self.level(lod)
        rows, columns = level.shape
        row, column = math.floor(v * rows), math.floor(u * columns)
        return float(level[min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)])

    def rectangle(self, low: Array, high: Array) -> tuple[Array, Array, float]:
        corners = [
            np.array([(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]])
            for i in (0, 1)
            for j in (0, 1)
            for k in (0, 1)
        ]
        places = np.array([self.uv(corner) for corner in corners])
        return places.min(axis=0), places.max(axis=0), max(NEAR / -c[2] for c in corners)

    def rakos(self, low: Array, high: Array) -> bool:
        (u0, v0), (u1, v1), nearest = self.rectangle(low, high)
        pixels = max((u1 - u0) * self.size[0], (v1 - v0) * self.size[1])
        lod = math.ceil(math.log2(pixels / 2))
        return nearest >= min(self.lookup(u, v, lod) for u in (u0, u1) for v in (v0, v1))

    def one_lookup(self, low: Array, high: Array) -> bool:
        (u0, v0), (u1, v1), nearest = self.rectangle(low, high)
        pixels = max((u1 - u0) * self.size[0], (v1 - v0) * self.size[1])
        return nearest >= self.lookup((u0 + u1) / 2, (v0 + v1) / 2, math.ceil(math.log2(pixels)))

    def arm(self, center: Array, radius: float) -> bool:
        ends = []
        for axis in (0, 1):
            # The angles of the tangents, in place of the text's products of cosines and sines.
            middle = math.atan2(center[axis], -center[2])
            spread = math.asin(radius / math.hypot(center[axis], center[2]))
            ends.append(
                sorted(
                    0.5 + (0.5, -0.5)[axis] * math.tan(middle + s * spread) / self.tangent[axis]
                    for s in (-1, 1)
                )
            )
        pixels = max(self.size[k] * (ends[k][1] - ends[k][0]) for k in (0, 1))
        level = self.level(math.ceil(math.log2(max(pixels, 1.0))))
        rows, columns = level.shape
        x, y = sum(ends[0]) / 2 * columns - 0.5, sum(ends[1]) / 2 * rows - 0.5
        texels = [
            level[min(max(j, 0), rows - 1), min(max(i, 0), columns - 1)]
            for j in (math.floor(y), math.ceil(y))
            for i in (math.floor(x), math.ceil(x))
        ]
        return NEAR / (-center[2] - radius) >= min(texels)

    def darnell(self, center: Array, radius: float) -> bool:
        distance = math.sqrt(float(center @ center))
        spread = distance * math.tan(math.asin(radius / distance))
        up = np.array([0.0, spread, 0.0])
        right = np.cross(-center, [0.0, 1.0, 0.0])
        right *= spread / np.linalg.norm(right)
        places = [self.uv(center + i * up + j * right) for i in (1, -1) for j in (-1, 1)]
        side = math.dist(places[0], places[1]) * max(self.size)
        lod = math.ceil(math.log2(side))
        nearest = NEAR / (-center[2] * (1 - radius / distance))
        return nearest >= min(self.lookup(u, v, lod) for u, v in places)


def random_scene(seed: int, count: int) -> tuple[Array, Array, Array]:
    """A wall with holes, and spheres wholly in the view beyond the near plane."""
    rng = np.random.default_rng(seed)
    depth = np.where(rng.uniform(size=(61, 90)) < 0.01, 200.0, rng.uniform(9.0, 12.0, (61, 90)))
    z = rng.uniform(5.0, 40.0, count)
    radii = z * 2.0 ** rng.uniform(-8.0, -3.0, count)
    x = rng.uniform(-0.6, 0.6, count) * z
    y = rng.uniform(-0.35, 0.35, count) * z
    return depth.astype(np.float32), np.stack([x, y, -z], axis=1), radii


@pytest.mark.parametrize("text", ["rakos", "one_lookup", "arm", "darnell"])
def test_each_test_is_its_formula(device: hizvk.Device, text: _Text) -> None:
    """The device works in float32, so one in a hundred may differ by a rounding."""
    depth, centers, radii = random_scene(5, 1500)
    tangent = 0.5
    wide = tangent * 90 / 61
    camera = view((61, 90), (-wide, wide, -tangent, tangent))
    loops = Loops(depth.astype(np.float64), tangent)
    if text in ("rakos", "one_lookup"):
        low, high = centers - radii[:, None], centers + radii[:, None]
        bounds: Any = hizvk.Boxes(low, high)
        expected = [getattr(loops, text)(a, b) for a, b in zip(low, high, strict=True)]
    else:
        bounds = hizvk.Spheres(centers, radii)
        expected = [getattr(loops, text)(c, float(r)) for c, r in zip(centers, radii, strict=True)]
    mask = kept(device, text, bounds, camera, depth)
    differ = int((mask != expected).sum())
    print(f"\n{text}: keeps {mask.sum()} of {len(mask)}, {differ} unlike the loops")
    assert differ <= 15
    assert 200 < mask.sum() < 1300


# -- their defects ---------------------------------------------------------------------------------


def interval(first: float, last: float) -> tuple[hizvk.Camera, hizvk.Boxes]:
    """A view of 1024 columns, and a thin box at depth 20 from one column to the other."""
    camera = view((16, 1024), (-1, 1, -1 / 64, 1 / 64))
    x = [(2 * p / 1024 - 1) * 20 for p in (first, last)]
    y = [(1 - 2 * p / 16) * 20 / 64 for p in (8.1, 7.9)]
    return camera, hizvk.Boxes([[x[0], y[0], -20.0]], [[x[1], y[1], -20.0]])


def test_rakos_misses_the_middle_texel(device: hizvk.Device) -> None:
    """[252.95, 569.98] of 1024 pixels: level 8 is read at texels 0 and 2, and texel 1 is a hole."""
    camera, box = interval(252.95, 569.98)
    depth = np.full((16, 1024), 10.0, np.float32)
    depth[:, 256:512] = np.inf
    assert kept(device, "rakos", box, camera, depth).tolist() == [False]
    assert certified(device, box, camera, depth).tolist() == [True]
    # With the hole where it looks, it sees it.
    depth = np.full((16, 1024), 10.0, np.float32)
    depth[:, 0:256] = np.inf
    assert kept(device, "rakos", box, camera, depth).tolist() == [True]


def test_rakos_skips_a_column_of_38_7_percent_of_intervals(device: hizvk.Device) -> None:
    """Intervals of 1 to 1024 pixels, uniform in their order of magnitude, each with a hole.

    The hole is what no lookup reads: all columns of the interval but those of its end texels.
    """
    rng = np.random.default_rng(7)
    lost, count = 0, 240
    for _ in range(count):
        length = 2.0 ** rng.uniform(0, 10)
        first = rng.uniform(0, 1) * (1024 - length)
        camera, box = interval(first, first + length)
        step = 1 << max(math.ceil(math.log2(length / 2)), 0)
        begin = (int(first) // step + 1) * step
        end = int(first + length) // step * step
        if end <= begin:
            continue
        depth = np.full((16, 1024), 10.0, np.float32)
        depth[:, begin:end] = np.inf
        assert not kept(device, "rakos", box, camera, depth)[0]
        assert certified(device, box, camera, depth)[0]
        lost += 1
    print(f"\nRakos: {100 * lost / count:.1f} % of {count} intervals skip a column on the device")
    assert 0.32 < lost / count < 0.46


def test_darnell_culls_a_sphere_around_the_camera(device: hizvk.Device) -> None:
    camera = view((256, 512), (-1, 1, -0.5, 0.5))
    ball = hizvk.Spheres([(0.1, 0.2, -0.5)], 2.0)
    depth = np.full(camera.size, 50.0, np.float32)
    assert kept(device, "darnell", ball, camera, depth).tolist() == [False]
    assert certified(device, ball, camera, depth).tolist() == [True]


def test_darnell_takes_the_nearest_point_in_space(device: hizvk.Device) -> None:
    """The front of the sphere is at depth 7, and the point that is nearest in space at 7.43."""
    camera = view((256, 512), (-1, 1, -0.5, 0.5))
    ball = hizvk.Spheres([(6.0, 0.0, -10.0)], 3.0)
    depth = np.full(camera.size, 7.2, np.float32)
    assert 10 * (1 - 3 / math.hypot(6, 10)) > 7.4
    assert kept(device, "darnell", ball, camera, depth).tolist() == [False]
    assert certified(device, ball, camera, depth).tolist() == [True]
    assert kept(device, "darnell", ball, camera, np.full(camera.size, 7.5, np.float32)).all()


def test_arm_looks_beside_an_off_centre_sphere(device: hizvk.Device) -> None:
    """The borders are -0.2 and 1.8, so its columns are 25.6 of 64 pixels off."""
    ball = hizvk.Spheres([(3.0, 0.0, -20.0)], 1.0)
    for borders, expected in [((-0.2, 1.8), False), ((-1.0, 1.0), True)]:
        camera = view((16, 64), (*borders, -0.25, 0.25))
        # The sphere's own columns, from its tangents through the eye.
        spread = math.asin(1 / math.hypot(3, 20))
        ends = [math.tan(math.atan2(3, 20) + s * spread) for s in (-1, 1)]
        first, last = (int(64 * (end - borders[0]) / 2) for end in ends)
        depth = np.full(camera.size, 10.0, np.float32)
        depth[:, first : last + 1] = np.inf
        assert certified(device, ball, camera, depth).tolist() == [True]
        assert kept(device, "arm", ball, camera, depth).tolist() == [expected]


def test_one_lookup_misses_what_lies_beside_its_texel(device: hizvk.Device) -> None:
    """Pixels 30 to 61 need level 5, whose texels end at pixel 32; the middle is in the second."""
    camera, box = interval(30.2, 61.8)
    depth = np.full((16, 1024), 10.0, np.float32)
    depth[:, 30:32] = np.inf
    assert kept(device, "one_lookup", box, camera, depth).tolist() == [False]
    assert certified(device, box, camera, depth).tolist() == [True]


def test_a_small_image_misses_a_small_gap(device: hizvk.Device) -> None:
    """A gap of 2 of 640 columns between the centres of 256, so the small image has no hole."""
    camera = view((360, 640), (-1, 1, -0.5625, 0.5625))
    edges = [2 * column / 640 - 1 for column in (304, 306)]
    centres = (np.arange(256) + 0.5) / 256 * 2 - 1
    assert not ((centres > edges[0]) & (centres < edges[1])).any()
    low, high = (
        [[-20, -20, -10.5], [10 * edges[1], -20, -10.5]],
        [[10 * edges[0], 20, -10], [20, 20, -10]],
    )
    walls = device.occluders(*hizvk.scenes.box_mesh(low, high))
    ball = device.instances(hizvk.Spheres([(30 * (edges[0] + edges[1]) / 2, 0.0, -30.0)], 0.05))
    full = device.pyramid(device.render_depth(walls, camera))
    small = device.pyramid(device.render_depth(walls, camera, size=(256, 256)))
    assert device.cull(ball, camera, full).mask.tolist() == [True]
    assert device.cull(ball, small.camera, small).mask.tolist() == [False]


# -- the bench -------------------------------------------------------------------------------------


def test_the_bench_counts_what_is_lost(tmp_path: Path) -> None:
    """Behind gates the published tests lose instances, and the certified culls none."""
    found = texts.run(tmp_path, keys=("gates",), views=4, repetitions=1, size=(180, 320))
    (scene,) = found.scenes
    by_label = {row.label: row for row in scene.rows}
    assert found.passed
    assert by_label["Darnell 2010, spheres, 512x256"].lost > 3
    assert scene.visible > 25
    assert sum(row.promises for row in scene.rows) == 5
    assert all(row.lost == 0 for row in scene.rows if row.promises)
    page = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "| gates | **hizvk, boxes, 2x2** | 0 | 0.00 % |" in page
    assert (tmp_path / "texts.png").stat().st_size > 10_000


def test_a_lost_instance_fails_the_bench(device: hizvk.Device) -> None:
    """The report passes only while no row with the promise loses anything."""

    def report_of(promises: bool, lost: int) -> Report:
        row = Method("a row", promises, lost, 0, 0.5, Spread(1.0, 1.0, 1.0))
        scene = Found("gates", "gates", 9, 1, (4, 4), 1, 8, 1, "by hand", [row])
        return Report("command", 1, device.adapter, scenes=[scene])

    assert report_of(promises=True, lost=0).passed
    assert report_of(promises=False, lost=2).passed
    assert not report_of(promises=True, lost=1).passed
    assert not Report("command", 1, device.adapter).passed
    assert table(report_of(promises=False, lost=2))[0][1:4] == ["a row", "2", "25.00 %"]
