"""Defects of published methods: each formula fails on a case, and the library does not.

The formulas are written out here in NumPy, from the texts, without any code of the library.
The truth comes from hand-made scenes, closed forms and the exact oracle `hizvk.reference`.

Cameras are at the origin and look along -z.
Depth images hold view depth (``kind="z"``), and infinity is a hole.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import pytest

import hizvk
from hizvk.reference import HIDDEN, VISIBLE

Image: TypeAlias = npt.NDArray[Any]
HOLE = math.inf
WALL = 10.0


def view(
    size: tuple[int, int],
    borders: tuple[float, float, float, float] = (-1, 1, -1, 1),
    *,
    reversed_z: bool = False,
) -> hizvk.Camera:
    """A camera with these left, right, bottom and top borders at depth 1."""
    left, right, bottom, top = borders
    return hizvk.Camera.frustum(
        (0, 0, 0), (0, 0, -1), left=left, right=right, bottom=bottom, top=top, near=0.125,
        size=size, reversed_z=reversed_z,
    )  # fmt: skip


def assert_kept(
    device: hizvk.Device, bounds: Any, camera: hizvk.Camera, depth: Image, kind: Any = "z"
) -> None:
    """Check that all bounds are truly visible, and kept with every footprint and descent."""
    assert (hizvk.reference.classify(bounds, camera, depth, kind=kind) == VISIBLE).all()
    for options in ({}, {"footprint": 8}, {"descent": 65536}):
        assert hizvk.visible(bounds, camera, depth=depth, kind=kind, device=device, **options).all()


def assert_hidden(
    device: hizvk.Device, bounds: Any, camera: hizvk.Camera, depth: Image, kind: Any = "z"
) -> None:
    """The counterpart of `assert_kept`, so that keeping everything does not pass."""
    assert (hizvk.reference.classify(bounds, camera, depth, kind=kind) == HIDDEN).all()
    assert not hizvk.visible(
        bounds, camera, depth=depth, kind=kind, device=device, descent=65536
    ).any()


def flat_box(
    camera_span: float, pixels: tuple[float, float, float, float], size: tuple[int, int]
) -> hizvk.Boxes:
    """A flat box at depth 20 that spans these pixels (left, top, right, bottom).

    The camera has symmetric borders.
    """
    height, width = size
    x0, y0, x1, y1 = pixels
    x = [(2 * p / width - 1) * 20 for p in (x0, x1)]
    y = [(1 - 2 * p / height) * 20 * camera_span for p in (y1, y0)]
    return hizvk.Boxes(np.array([[x[0], y[0], -20.0]]), np.array([[x[1], y[1], -20.0]]))


def blocks(image: Image, level: int) -> Image:
    """The farthest depth of each 2^level x 2^level block; the last blocks may be cut off."""
    step = 1 << level
    height, width = image.shape
    return np.array([[image[y : y + step, x : x + step].max() for x in range(0, width, step)]
                     for y in range(0, height, step)])  # fmt: skip


class TestRakos:
    """Daniel Rakos, Hierarchical-Z map based occlusion culling (2010)."""

    @staticmethod
    def taps(size: int, other: int) -> dict[tuple[int, int], set[tuple[int, int]]]:
        """Row R1: which texels of a level each texel of the next level reads, as printed.

        The level is `size` x `other`.
        It reads a sample at the next level's texel centre, and its left, lower and lower left
        neighbours.
        There are three more on ``x == size - 3`` of an odd side, in the branches as nested there.
        """

        def base(i: int, side: int) -> int:
            return (2 * i + 1) * side // (2 * max(side // 2, 1))

        read: dict[tuple[int, int], set[tuple[int, int]]] = {}
        for x in range(max(size // 2, 1)):
            for y in range(max(other // 2, 1)):
                offsets = {(0, 0), (-1, 0), (-1, -1), (0, -1)}
                if size % 2 and x == size - 3:
                    if other % 2 and y == other - 3:
                        offsets |= {(1, 1)}
                    offsets |= {(1, 0), (1, -1)}
                elif other % 2 and y == other - 3:
                    offsets |= {(0, 1), (-1, 1)}
                u, v = base(x, size), base(y, other)
                read[x, y] = {(u + i, v + j) for i, j in offsets}
        return read

    def test_r1_edge_texels_are_dropped_from_size_5_on(self) -> None:
        """Row R1: the condition should be ``2 (x + 1) == size - 1``.

        As printed it only holds for size 3.
        """
        for size in range(2, 100):
            read = set[int]().union(*({x for x, _ in taps} for taps in self.taps(size, 2).values()))
            missed = set(range(size)) - read
            assert missed == ({size - 1} if size % 2 and size >= 5 else set()), size

    def test_r1_the_corner_of_two_odd_sides_reads_7_of_9(self) -> None:
        """Row R1: the branches exclude one another, so two texels of the corner are never read."""
        assert len(self.taps(3, 3)[0, 0]) == 7
        assert set(self.taps(3, 3)[0, 0]) == {(x, y) for x in range(3) for y in range(3)} - {
            (0, 2),
            (1, 2),
        }

    @pytest.mark.parametrize(
        ("size", "hole"), [((5, 5), (2, 4)), ((5, 5), (4, 4)), ((3, 3), (2, 0)), ((3, 7), (1, 6))]
    )
    def test_r1_a_hole_that_it_misses_is_seen_through(
        self, device: hizvk.Device, size: tuple[int, int], hole: tuple[int, int]
    ) -> None:
        """The hole is in a texel that no texel of the next level has read."""
        height, width = size
        read = set[tuple[int, int]]().union(*self.taps(width, height).values())
        row, column = hole
        assert (column, row) not in read
        depth = np.full(size, WALL)
        depth[hole] = HOLE
        camera = view(size)
        box = flat_box(1.0, (0.25, 0.25, width - 0.25, height - 0.25), size)
        assert_kept(device, box, camera, depth)
        assert_hidden(device, box, camera, np.full(size, WALL))
        levels = device.pyramid(depth, camera, kind="z")
        for level in range(levels.num_levels):
            assert (np.isin(levels.level(level), 1.0) == np.isinf(blocks(depth, level))).all()

    @staticmethod
    def level(first: npt.NDArray[Any], last: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Row R4: ``ceil(log2(max(width, height) / 2))`` of the rectangle in pixels."""
        return np.maximum(np.ceil(np.log2((last - first) / 2)), 0).astype(int)

    def test_r4_the_level_skips_a_column_of_texels(self, device: hizvk.Device) -> None:
        """Row R4: for [252.95, 569.98] of 1024 pixels, level 8 reads texels 0 and 2 but not 1."""
        first, last = np.array(252.95), np.array(569.98)
        level = int(self.level(first, last))
        assert (level, int(first) >> level, int(last) >> level) == (8, 0, 2)
        size = (16, 1024)
        depth = np.full(size, WALL)
        depth[:, 300:500] = HOLE  # all of it in texel 1
        row = blocks(depth, level)[0]
        assert max(row[0], row[2]) == WALL  # the method reads this, and culls
        camera = view(size, (-1, 1, -1 / 64, 1 / 64))
        box = flat_box(1 / 64, (252.95, 2.0, 569.98, 14.0), size)
        assert_kept(device, box, camera, depth)
        assert_hidden(device, box, camera, np.full(size, WALL))

    def test_r4_does_so_for_38_7_percent_of_random_intervals(self) -> None:
        """Row R4: intervals of 1 to 1024 pixels, uniform in their order of magnitude."""
        rng = np.random.default_rng(1)
        length = 2.0 ** rng.uniform(0, 10, 1_000_000)
        first = rng.uniform(0, 1, length.size) * (1024 - length)
        level = self.level(first, first + length)
        skipped = (
            np.floor((first + length) / 2.0**level) - np.floor(first / 2.0**level) > 1
        ).mean()
        print(
            f"\nRakos R4: a texel column is skipped for {100 * skipped:.1f} % "
            f"of 1,000,000 intervals"
        )
        assert 0.38 < skipped < 0.395


class TestDarnell:
    """Nick Darnell, Hierarchical Z-Buffer Occlusion Culling (2010).

    Spheres are tested against a 512 x 256 map.
    """

    SIZE = (256, 512)
    BORDERS = (-1.0, 1.0, -0.5, 0.5)

    @staticmethod
    def nearest_depth(centers: Image, radii: Image) -> Image:
        """View depth of the sphere's point nearest to the eye *in space*.

        The point is ``Cv - normalize(Cv) * radius``.
        """
        distance = np.linalg.norm(centers, axis=-1)
        return -centers[..., 2] * (1 - radii / distance)

    @classmethod
    def rectangle(cls, centers: Image, radii: Image) -> Image:
        """Left, right, bottom and top of four corners, at depth 1.

        The corners are offset along up and ``cross(eye - centre, up)`` by ``d tan(asin(r / d))``.
        """
        distance = np.linalg.norm(centers, axis=-1, keepdims=True)
        with np.errstate(invalid="ignore"):
            spread = distance * np.tan(np.arcsin(radii[..., None] / distance))
        up = np.array([0.0, 1.0, 0.0])
        right = np.cross(-centers, up)
        right /= np.linalg.norm(right, axis=-1, keepdims=True)
        corners = np.stack(
            [centers + i * spread * up + j * spread * right for i in (-1, 1) for j in (-1, 1)]
        )
        x, y = (corners[..., k] / -corners[..., 2] for k in (0, 1))
        return np.stack([x.min(0), x.max(0), y.min(0), y.max(0)], axis=-1)

    @staticmethod
    def exact_rectangle(centers: Image, radii: Image) -> Image:
        """The same for the sphere itself: where its tangents through the eye meet depth 1."""
        z = -centers[..., 2]
        sides = []
        for k in (0, 1):
            a = centers[..., k]
            root = radii * np.sqrt(a * a + z * z - radii * radii)
            sides += [
                (a * z - root) / (z * z - radii * radii),
                (a * z + root) / (z * z - radii * radii),
            ]
        return np.stack(sides, axis=-1)

    @classmethod
    def spheres(cls, number: int) -> tuple[Image, Image]:
        """Random spheres in the view beyond the near plane, radii of 1 to 20 % of the distance."""
        rng = np.random.default_rng(2)
        left, right, bottom, top = cls.BORDERS
        z = rng.uniform(2, 60, number)
        centers = np.stack(
            [rng.uniform(left, right, number) * z, rng.uniform(bottom, top, number) * z, -z],
            axis=-1,
        )
        radii = np.minimum(
            rng.uniform(0.01, 0.2, number) * np.linalg.norm(centers, axis=-1), 0.9 * z
        )
        return centers, radii

    def test_a_sphere_around_the_camera_is_visible(self, device: hizvk.Device) -> None:
        """The formula puts the nearest point behind the eye, and its depth beyond the far plane.

        So the sphere is culled in front of any wall.
        """
        center, radius = np.array([0.1, 0.2, -0.5]), np.array(2.0)
        z = self.nearest_depth(center, radius)
        near, far = 0.125, 100.0
        assert z < 0
        assert far / (far - near) * (1 - near / z) > 1  # no depth map holds more than 1
        assert np.isnan(self.rectangle(center, radius)).all()  # asin(r / d) is NaN, too
        depth = np.full(self.SIZE, 1.0)
        assert_kept(device, hizvk.Spheres(center[None], 2.0), view(self.SIZE, self.BORDERS), depth)

    def test_the_nearest_point_in_space_is_not_the_least_depth(self, device: hizvk.Device) -> None:
        """Only a sphere straight ahead has its least depth at that point."""
        centers, radii = self.spheres(40_000)
        farther = self.nearest_depth(centers, radii) > -centers[:, 2] - radii
        print(
            f"\nDarnell: the depth is farther than the least depth "
            f"in {farther.sum():,} of 40,000 spheres"
        )
        assert farther.sum() >= 39_960
        # One of them with a wall between the two depths: its front is nearer than the wall.
        center, radius = np.array([[6.0, 0.0, -10.0]]), np.array([3.0])
        assert -center[0, 2] - radius[0] == 7.0
        assert self.nearest_depth(center, radius)[0] > 7.4
        depth = np.full(self.SIZE, 7.2)
        camera = view(self.SIZE, self.BORDERS)
        assert_kept(device, hizvk.Spheres(center, radius), camera, depth)
        assert_hidden(device, hizvk.Spheres(center, radius), camera, np.full(self.SIZE, 6.9))

    def test_the_four_corners_do_not_span_the_sphere(self, device: hizvk.Device) -> None:
        """A hole above the corners' rectangle, but within the sphere's own rectangle.

        Even all pixels of the corners' rectangle would not show it.
        """
        centers, radii = self.spheres(40_000)
        height, width = self.SIZE
        published, exact = (
            r(centers, radii) * (width / 2) for r in (self.rectangle, self.exact_rectangle)
        )
        short = np.stack([
            published[:, 0] - exact[:, 0], exact[:, 1] - published[:, 1],
            published[:, 2] - exact[:, 2], exact[:, 3] - published[:, 3],
        ], axis=-1)  # fmt: skip
        under = (short > 1).any(axis=-1)
        share = under.mean()
        print(
            f"\nDarnell: the rectangle is short by more than a pixel "
            f"for {100 * share:.1f} % of 40,000 spheres"
        )
        assert share > 0.05
        camera = view(self.SIZE, self.BORDERS)
        tested = 0
        # To the sides it is right, because that offset is at right angles to the line of sight.
        assert short[:, :2].max() < 0.5
        for i in np.flatnonzero((short[:, 3] > 1.5) & (exact[:, 3] < height / 2 - 1))[:20]:
            # Holes fill the rows above the corners' upper end.
            # The sphere meets the lowest of these rows.
            last = math.ceil(height / 2 - published[i, 3]) - 1
            nearer = 0.9 * (-centers[i, 2] - radii[i])
            depth = np.full(self.SIZE, nearer)
            depth[: last + 1] = HOLE
            assert depth[last + 1 :].max() == nearer  # within the corners all is nearer: it culls
            bounds = hizvk.Spheres(centers[i : i + 1], radii[i : i + 1])
            if hizvk.reference.classify(bounds, camera, depth, kind="z")[0] == VISIBLE:
                assert_kept(device, bounds, camera, depth)
                tested += 1
        assert tested >= 3

    def test_none_of_its_spheres_is_wrongly_culled(self, device: hizvk.Device) -> None:
        """A thousand of the spheres above, at a wall with holes, against the oracle."""
        centers, radii = self.spheres(1000)
        depth = np.full(self.SIZE, 8.0)
        depth[40:200:7, 100:400:11] = HOLE
        camera, bounds = view(self.SIZE, self.BORDERS), hizvk.Spheres(centers, radii)
        truth = hizvk.reference.classify(bounds, camera, depth, kind="z")
        result = hizvk.compare(
            hizvk.visible(bounds, camera, depth=depth, kind="z", device=device), truth
        )
        assert result.false_culls.size == 0
        assert result.hidden > 50
        assert result.visible > 50


class TestTuritzin:
    """Mike Turitzin, Hierarchical Depth Buffers (2020)."""

    @staticmethod
    def taps(x: int, y: int, width: int, height: int) -> set[tuple[int, int]]:
        """Rows T1, T4: the texels that texel (x, y) of the next, floor-halved level reads.

        They are of a `width` x `height` level.
        """
        columns = range(3 if width % 2 else 2)
        rows = range(3 if height % 2 else 2)
        return {(2 * x + i, 2 * y + j) for i in columns for j in rows}

    @staticmethod
    def coarse_min(image: npt.NDArray[np.float32]) -> float:
        """Row T3: one texel by ``atomicMin`` on the bits of floats, from an initial 1.0."""
        bits = np.concatenate([np.float32([1.0]).view(np.uint32), image.ravel().view(np.uint32)])
        return float(bits.min(keepdims=True).view(np.float32)[0])

    @pytest.mark.parametrize("bad", [np.float32(-0.0), np.float32("nan")])
    def test_t3_minus_zero_and_nan_break_the_order_of_bits(
        self, device: hizvk.Device, bad: np.float32
    ) -> None:
        """In reversed depth, where far is 0, a pixel of -0.0 or NaN is a hole.

        Its bits are greater than any wall's.
        """
        size = (16, 16)
        near = np.float32(0.125)
        depth = np.full(size, near / np.float32(WALL), np.float32)
        assert self.coarse_min(depth) == depth[0, 0]
        depth[9, 3] = bad
        assert self.coarse_min(depth) == depth[0, 0]  # it misses the hole
        camera = view(size, reversed_z=True)
        box = flat_box(1.0, (1.0, 1.0, 15.0, 15.0), size)
        assert device.pyramid(depth, camera, kind="reversed_ndc").level(4).tolist() == [[0.0]]
        assert_kept(device, box, camera, depth, "reversed_ndc")
        depth[9, 3] = depth[0, 0]
        assert_hidden(device, box, camera, depth, "reversed_ndc")

    @pytest.mark.parametrize("bad", [0x80000001, 0xFF800000, 0xFFC00000, 0xBF000000])
    def test_t3_so_do_all_negative_bits(self, device: hizvk.Device, bad: int) -> None:
        """Negative numbers, negative infinity and NaN with a sign are no depth.

        So they are holes in both conventions.
        """
        for reversed_z in (False, True):
            camera = view((4, 4), reversed_z=reversed_z)
            depth = np.full((4, 4), 0.25, np.float32)
            depth[2, 1] = np.array([bad], np.uint32).view(np.float32)[0]
            assert device.pyramid(depth, camera, kind=camera.depth_kind).level(2) == (
                0.0 if reversed_z else 1.0
            )

    def test_t3_an_initial_one_caps_larger_depths(self, device: hizvk.Device) -> None:
        """With a map of view depths beyond 1, the least depth becomes 1."""
        size = (8, 8)
        depth = np.full(size, WALL, np.float32)
        assert self.coarse_min(depth) == 1.0
        for reversed_z in (False, True):
            camera = view(size, reversed_z=reversed_z)
            top = float(device.pyramid(depth, camera, kind="z").level(3)[0, 0])
            exact = 0.125 / WALL if reversed_z else 1 - 0.125 / WALL  # no far plane
            assert top == pytest.approx(exact, rel=1e-6)
            spheres = hizvk.Spheres(np.array([[0.0, 0, -5], [0, 0, -20]]), 1.0)
            assert hizvk.visible(
                spheres, camera, depth=depth, kind="z", device=device
            ).tolist() == [True, False]

    def test_t4_long_images_are_read_out_of_bounds(self) -> None:
        """Row T4: the listing reads rows that do not exist.

        It does so once one side is 1 and the other is not.
        """
        for width, height in [(8, 2), (16, 4), (1, 7), (640, 200)]:
            w, h = width, height
            outside = 0
            while (w, h) != (1, 1):
                coarser = max(w // 2, 1), max(h // 2, 1)
                for x in range(coarser[0]):
                    for y in range(coarser[1]):
                        outside += sum(not (u < w and v < h) for u, v in self.taps(x, y, w, h))
                w, h = coarser
            assert outside > 0, (width, height)

    @pytest.mark.parametrize(
        "size",
        [
            (1, 1),
            (1, 7),
            (7, 1),
            (2, 8),
            (4, 64),
            (3, 5),
            (5, 3),
            (13, 29),
            (31, 33),
            (1, 257),
            (129, 2),
        ],
    )
    @pytest.mark.parametrize("reversed_z", [False, True])
    def test_t1_t2_t4_every_size_keeps_its_farthest_texels(
        self, device: hizvk.Device, size: tuple[int, int], reversed_z: bool
    ) -> None:
        """Every level holds the farthest depth of its blocks, down to one texel.

        Odd sizes and long sizes do, too.
        """
        camera = view(size, reversed_z=reversed_z)
        depth = np.random.default_rng(3).uniform(0.01, 0.99, size).astype(np.float32)
        levels = device.pyramid(depth, camera, kind=camera.depth_kind)
        sign = -1 if reversed_z else 1
        for level in range(levels.num_levels):
            np.testing.assert_array_equal(levels.level(level), sign * blocks(sign * depth, level))
        assert levels.level(levels.num_levels - 1).shape == (1, 1)

    def test_t2_floor_halving_with_four_taps_loses_the_edge(self, device: hizvk.Device) -> None:
        """The defect that T1 and T2 correct: 5 columns become 2, and the fifth is in neither."""
        depth = np.full((4, 5), WALL)
        depth[1, 4] = HOLE
        naive = depth[:, :4].reshape(2, 2, 2, 2).max(axis=(1, 3))
        assert naive.max() == WALL
        camera = view((4, 5))
        assert_kept(device, flat_box(1.0, (0.5, 0.5, 4.9, 3.5), (4, 5)), camera, depth)


class TestArm:
    """ARM, Occlusion Culling with Hierarchical-Z (OpenGL ES SDK)."""

    @staticmethod
    def columns(center: Image, radius: float, scale: float, width: int) -> tuple[float, float]:
        """Row A1: first and last pixel of a sphere.

        They are its tangents (Mara and McGuire 2013) times ``P[0][0]`` alone.
        """
        x, z = center[0], -center[2]
        root = radius * math.sqrt(x * x + z * z - radius * radius)
        ends = [(x * z + sign * root) / (z * z - radius * radius) for sign in (-1, 1)]
        first, last = (width / 2 * (1 + scale * end) for end in ends)
        return first, last

    @pytest.mark.parametrize("reversed_z", [False, True])
    def test_a1_off_centre_projections(self, device: hizvk.Device, reversed_z: bool) -> None:
        """The borders are -0.2 and 1.8, so the formula's columns are 25 pixels off the sphere's."""
        size = (16, 64)
        width = size[1]
        left, right = -0.2, 1.8
        center, radius = np.array([3.0, 0.0, -20.0]), 1.0
        first, last = self.columns(center, radius, 2 / (right - left), width)
        shift = width / 2 * (right + left) / (right - left)
        assert shift == pytest.approx(25.6)
        true_first, true_last = first - shift, last - shift
        assert 1 < true_first < true_last < first - 1
        depth = np.full(size, WALL)
        depth[:, int(true_first) : int(true_last) + 1] = HOLE
        assert depth[:, int(first) : int(last) + 1].max() == WALL  # it reads this, and culls
        camera = view(size, (left, right, -0.25, 0.25), reversed_z=reversed_z)
        bounds = hizvk.Spheres(center[None], radius)
        assert_kept(device, bounds, camera, depth)
        # Holes where the formula looks do not matter.
        depth = np.full(size, WALL)
        depth[:, int(first) : int(last) + 1] = HOLE
        assert_hidden(device, bounds, camera, depth)
