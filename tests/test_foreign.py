"""Arrays and meshes of other libraries: stand-ins that have what these have, and the real ones.

The real libraries are tried where they are installed.
Expectations are the plain arrays that everything is made of.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import hizvk
from hizvk.scenes import box_mesh

CAMERA = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(24, 32), near=0.1)
CENTERS = np.array([[0.0, 0, -5], [0, 0, -20], [0, 0, 20]])
DEPTH = np.full(CAMERA.size, 10.0, np.float32)
SEEN = [True, False, False]

QUAD = np.array([[-9.0, -9, -10], [9, -9, -10], [9, 9, -10], [-9, 9, -10]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


class ByDlpack:
    """An array that has DLPack alone, as tensors of Open3D have; by default on the host."""

    def __init__(self, array: Any, device: tuple[int, int] = (1, 0)) -> None:
        self.array, self.on = np.asarray(array), device
        self.shape, self.dtype = self.array.shape, self.array.dtype

    def __dlpack__(self, **options: Any) -> Any:
        assert self.on == (1, 0), "memory of a device was read"
        return self.array.__dlpack__()

    def __dlpack_device__(self) -> tuple[int, int]:
        return self.on


class ByInterface:
    """An array that has NumPy's interface alone."""

    def __init__(self, array: Any) -> None:
        self.__array_interface__ = np.asarray(array).__array_interface__
        self.kept = array


WAYS = [ByDlpack, ByInterface, memoryview, np.asarray]


# -- arrays ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", WAYS)
def test_arrays_of_any_library(device: hizvk.Device, way: Any) -> None:
    for bounds in (
        hizvk.Spheres(way(CENTERS), way(np.full(3, 0.5))),
        hizvk.Boxes(way(CENTERS - 0.5), way(CENTERS + 0.5)),
        hizvk.OrientedBoxes.from_yaw(way(CENTERS), 0.5, way(np.zeros(3)), up=(0, 0, 1)),
    ):
        seen = hizvk.visible(bounds, CAMERA, depth=way(DEPTH), kind="z", device=device)
        assert seen.tolist() == SEEN
    walls = device.occluders(way(QUAD), way(FACES))
    crowd = device.instances(hizvk.Spheres(CENTERS, 0.5))
    hiz = device.pyramid(device.render_depth(walls, CAMERA))
    among = way(np.array([False, True, True]))
    assert device.cull(crowd, CAMERA, hiz).mask.tolist() == SEEN
    assert not device.cull(crowd, CAMERA, hiz, among=among).mask.any()
    assert hizvk.compare(way(np.array(SEEN)), way(np.array(SEEN))).kept == 1
    assert CAMERA.project(way(CENTERS)).inside.tolist() == [True, True, False]
    image = way(np.arange(6.0).reshape(2, 3))
    assert hizvk.gather(image, [(0.5, 0.5), (2.5, 1.5)]).tolist() == [0.0, 5.0]


def test_arrays_without_a_copy() -> None:
    for way in (ByDlpack, ByInterface, memoryview):
        assert np.shares_memory(hizvk.Points(way(CENTERS)).positions, CENTERS)  # type: ignore[arg-type]


def test_an_array_on_a_gpu_is_refused_before_it_is_read() -> None:
    on_cuda: Any = ByDlpack(CENTERS, (2, 0))
    with pytest.raises(
        TypeError, match=r"^positions: expected float \(N, 3\) in the memory of the "
    ):
        hizvk.Points(on_cuda)
    with pytest.raises(
        TypeError, match=r"^depth: .* got .*ByDlpack .*; copy it first, by numpy\.a"
    ):
        hizvk.visible(hizvk.Points(CENTERS), CAMERA, depth=on_cuda, kind="z")
    with pytest.raises(TypeError, match=r"^vertices: .*copy it first"):
        hizvk.Mesh(on_cuda, FACES)


def test_a_tensor_of_torch_is_told_what_torch_calls_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ByDlpack, "__module__", "torch")
    on_cuda: Any = ByDlpack(CENTERS, (2, 0))
    on_cuda.device = "cuda:0"
    with pytest.raises(
        TypeError,
        match=r"got torch\.ByDlpack \(3, 3\) float64 on cuda:0; copy it first, by \.cpu\(\)$",
    ):
        hizvk.Points(on_cuda)


def test_what_numpy_cannot_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    class Gradient:
        requires_grad = True

        def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
            raise RuntimeError("Can't call numpy() on Tensor that requires grad.")

    class Brain(Gradient):
        requires_grad = False
        dtype = "torch.bfloat16"

    with pytest.raises(TypeError, match=r"^positions: .*, by \.detach\(\)$"):
        hizvk.Points(Gradient())
    with pytest.raises(TypeError, match=r"^positions: .*NumPy has no bfloat16, pass \.float\(\)$"):
        hizvk.Points(Brain())


@pytest.mark.parametrize(
    "dtype", [np.int8, np.uint8, np.int16, np.uint16, ">i4", np.int32, np.int64]
)
def test_whole_numbers_are_exact(dtype: Any) -> None:
    whole = np.array([[1, 2, 3], [100, 5, 6]], dtype)
    wide = np.dtype(dtype).itemsize > 2
    for made in (
        hizvk.Points(whole).positions,
        hizvk.Boxes(whole, whole).max,
        hizvk.Spheres(whole, whole[:, 0]).radii.reshape(2, 1),
        hizvk.Mesh(whole, [[0, 1, 1]]).vertices,
        hizvk.OrientedBoxes(whole, whole, np.stack([np.eye(3, dtype=int)] * 2)).half_sizes,
    ):
        assert made.dtype == (np.float64 if wide else np.float32)
        assert np.array_equal(made, whole[:, : made.shape[1]])
    assert hizvk.Spheres(whole, np.array(3)).radii.tolist() == [3.0, 3.0]


def test_whole_numbers_that_no_float_holds_are_refused() -> None:
    fits, none = np.full((2, 3), 2**53), np.full((2, 3), -(2**53) - 1)
    assert (hizvk.Points(fits).positions == 2.0**53).all()
    with pytest.raises(ValueError, match=r"^positions: .*int64 with 9007199254740993 in it, which"):
        hizvk.Points(none)
    with pytest.raises(ValueError, match="with 18446744073709551615 in it"):
        hizvk.Points(np.full((1, 3), 2**64 - 1, np.uint64))
    with pytest.raises(TypeError, match="got \\(2, 3\\) bool"):
        hizvk.Points(np.ones((2, 3), bool))


# -- depth -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(*CAMERA.size, 1), (1, *CAMERA.size)])
def test_depth_with_an_axis_of_channels(device: hizvk.Device, shape: Any) -> None:
    bounds = hizvk.Spheres(CENTERS, 0.5)
    sparse = DEPTH.copy()
    sparse[::2] = 7.0
    expected = device.pyramid(sparse, CAMERA, kind="z").level(0)
    got = device.pyramid(sparse.reshape(shape), CAMERA, kind="z")
    assert np.array_equal(got.level(0), expected)
    masked = np.ma.masked_array(sparse, sparse == 7.0).reshape(shape)
    some = device.pyramid(masked, CAMERA, kind="z").level(0)
    assert ((some == 0.0) == (sparse == 7.0)).all()
    seen = hizvk.visible(bounds, CAMERA, depth=DEPTH.reshape(shape), kind="z", device=device)
    assert seen.tolist() == SEEN
    codes = hizvk.reference.classify(bounds, CAMERA, DEPTH.reshape(shape), kind="z")
    assert codes[0] == hizvk.reference.VISIBLE


@pytest.mark.parametrize("dtype", [np.int16, np.int32, ">i4", np.uint32, np.int64, np.uint64])
def test_whole_depth_of_16_bits_in_a_wider_dtype(device: hizvk.Device, dtype: Any) -> None:
    """What Pillow's mode I holds means what the file's uint16 means, no data included."""
    narrow = np.full(CAMERA.size, 10_000, np.uint16)
    narrow[0, :4] = [0, 65535, 1, 30_000]
    if np.dtype(dtype).itemsize == 2:
        narrow[0, 1] = 0
    told = {"kind": "z", "scale": 0.001}
    expected = device.pyramid(narrow, CAMERA, **told).level(0)  # type: ignore[call-overload]
    wide = narrow.astype(dtype)
    got = device.pyramid(wide, CAMERA, **told)  # type: ignore[call-overload]
    assert np.array_equal(got.level(0), expected)
    samples = np.stack([wide, wide], -1)
    got = device.pyramid(samples, CAMERA, **told)  # type: ignore[call-overload]
    assert np.array_equal(got.level(0), expected)
    if wide.dtype.kind == "i":
        wide[0, 0] = -7
        got = device.pyramid(wide, CAMERA, **told)  # type: ignore[call-overload]
        assert np.array_equal(got.level(0), expected)


def test_whole_depth_of_more_than_16_bits(device: hizvk.Device) -> None:
    micrometres = np.full(CAMERA.size, 10_000_000, np.int32)
    micrometres[0, :3] = [0, -5, 99]
    expected = micrometres.astype(np.float64)
    told: Any = {"kind": "z", "scale": 1e-6}
    for invalid in (None, (99,), (10_000_000,)):
        one, other = (
            device.pyramid(image, CAMERA, invalid=invalid, **told).level(0)
            for image in (micrometres, expected)
        )
        assert np.array_equal(one, other)
    few = np.full(CAMERA.size, 200, np.int32)
    assert (device.pyramid(few, CAMERA, invalid=(200, 70_000), **told).level(0) == 0.0).all()


def test_pictures_of_depth_are_refused(device: hizvk.Device) -> None:
    image = np.ones(CAMERA.size, np.uint8)
    with pytest.raises(TypeError, match="an image of 8 bits is a picture of depth, not depth"):
        device.pyramid(image, CAMERA, kind="z")
    buffer = np.ones(CAMERA.size, np.uint16)
    with pytest.raises(TypeError, match=r"by depth / 65535, .* depth_slack_abs=1 / 65535$"):
        device.pyramid(buffer, CAMERA, kind="reversed_ndc")


# -- meshes ----------------------------------------------------------------------------------------


def trimesh_like() -> Any:
    return SimpleNamespace(vertices=QUAD, faces=FACES)


def open3d_like() -> Any:
    return SimpleNamespace(vertices=QUAD.data, triangles=FACES.astype(np.int32).data)


def tensors_like() -> Any:
    parts = {"positions": ByDlpack(QUAD.astype(np.float32))}, {"indices": ByDlpack(FACES)}
    return SimpleNamespace(vertex=parts[0], triangle=parts[1])


def pyvista_like(faces: Any = None, **more: Any) -> Any:
    listed = [3, 0, 1, 2, 3, 0, 2, 3] if faces is None else faces
    return SimpleNamespace(
        points=QUAD.astype(np.float32), faces=np.array(listed), n_points=4, triangulate=None, **more
    )


@pytest.mark.parametrize("make", [trimesh_like, open3d_like, tensors_like, pyvista_like])
def test_meshes_of_other_libraries(device: hizvk.Device, make: Any) -> None:
    mesh = hizvk.Mesh.of(make())
    assert np.array_equal(mesh.vertices, QUAD)
    assert np.array_equal(mesh.triangles, FACES)
    plain = device.render_depth(device.occluders(QUAD, FACES), CAMERA).numpy()
    moved = np.eye(4)
    moved[2, 3] = 5.0
    beside = device.render_depth(device.occluders(QUAD, FACES, transforms=moved), CAMERA).numpy()
    for given, expected in (
        ({"vertices": make()}, plain),
        ({"vertices": [make(), make()]}, plain),
        ({"vertices": make(), "transforms": moved}, beside),
    ):
        walls = device.occluders(**given)
        assert np.array_equal(device.render_depth(walls, CAMERA).numpy(), expected)
    assert hizvk.select_occluders([make()]).triangles.tolist() == [2]
    assert hizvk.check_bounds(hizvk.Boxes(QUAD[:1], QUAD[2:3]), make()).all_contained
    assert len(hizvk.split_mesh(make(), cell=100.0).triangles) == 2
    with pytest.raises(ValueError, match="a closed mesh"):
        hizvk.check_proxy(make(), make())


class Graph(dict[str, Any]):
    @property
    def nodes_geometry(self) -> list[str]:
        return list(self)


def scene_like(**geometry: Any) -> Any:
    """Two nodes of a quad, one of another, and one of a cloud, as a scene of trimesh has them."""
    one, two = np.eye(4), np.eye(4)
    two[:3, 3] = (100.0, 0.0, 0.0)
    half = np.diag([0.5, 0.5, 1.0, 1.0])
    nodes = {
        "a": (one, "quad"), "b": (half, "other"), "c": (two, "quad"), "d": (one, "cloud"),
    }  # fmt: skip
    other = SimpleNamespace(vertices=QUAD, faces=FACES[:1])
    cloud = SimpleNamespace(vertices=QUAD)

    parts = {"quad": trimesh_like(), "other": other, "cloud": cloud, "unused": other, **geometry}
    return SimpleNamespace(geometry=parts, graph=Graph(nodes))


def test_a_scene_of_trimesh_is_placed_by_its_graph(device: hizvk.Device) -> None:
    walls = device.occluders(scene_like())
    by_hand = device.occluders(
        [
            hizvk.Mesh(QUAD, FACES, [np.eye(4), scene_like().graph["c"][0]]),
            hizvk.Mesh(QUAD, FACES[:1], np.diag([0.5, 0.5, 1.0, 1.0])),
        ]
    )
    wide = hizvk.Camera.look_at((50, 0, 60), (50, 0, 0), fov_y_deg=90, size=(40, 60), near=0.1)
    for camera in (CAMERA, wide):
        one, other = (device.render_depth(some, camera).numpy() for some in (walls, by_hand))
        assert (one > 0).any()
        assert np.array_equal(one, other)
    joined = hizvk.Mesh.of(scene_like())
    corners = joined.vertices[joined.triangles]
    assert sorted(corners[:, 0, 0].tolist()) == [-9.0, -9.0, -4.5, 91.0, 91.0]
    assert hizvk.select_occluders([scene_like(), trimesh_like()]).triangles.tolist() == [4, 1, 2]
    with pytest.raises(TypeError, match="expected nothing beside a list of meshes, a Mesh or"):
        device.occluders(scene_like(), transforms=np.eye(4))
    with pytest.raises(TypeError, match=r"; of a trimesh scene pass scene\.to_mesh\(\)$"):
        hizvk.split_mesh(scene_like(), cell=1.0)


@pytest.mark.parametrize(
    ("mesh", "way"),
    [
        (pyvista_like([4, 0, 1, 2, 3]), "mesh.triangulate()"),
        (pyvista_like([3, 0, 1, 2, 4, 0, 1, 2, 3, 3, 0, 1]), "mesh.triangulate()"),
        (pyvista_like(n_strips=1), "mesh.triangulate()"),
        (
            SimpleNamespace(points=QUAD, extract_surface=None),
            "grid.extract_surface().triangulate()",
        ),
        (
            pyvista_like(celltypes=np.array([5]), extract_surface=None),
            "grid.extract_surface().triangulate()",
        ),
        (SimpleNamespace(points=QUAD, has_points=None), "hizvk.depth_from_points("),
    ],
)
def test_what_is_no_mesh_of_triangles_is_told_the_way(
    device: hizvk.Device, mesh: Any, way: str
) -> None:
    with pytest.raises((TypeError, ValueError), match=r"^vertices: expected ") as caught:
        device.occluders(mesh)
    assert f"pass {way}" in str(caught.value)
    with pytest.raises((TypeError, ValueError), match=r"^vertices\[1\]: expected "):
        device.occluders([trimesh_like(), mesh])


# -- the libraries themselves, where they are ------------------------------------------------------


def test_trimesh_itself(device: hizvk.Device) -> None:
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box(extents=(2.0, 4.0, 6.0))
    moved = np.eye(4)
    moved[:3, 3] = (0.0, 0.0, -20.0)
    scene = trimesh.Scene()
    scene.add_geometry(box, transform=moved)
    scene.add_geometry(box, transform=moved @ np.diag([2.0, 1, 1, 1]))
    scene.add_geometry(trimesh.PointCloud(QUAD))
    images = [
        device.render_depth(device.occluders(some), CAMERA).numpy()
        for some in (scene, scene.to_mesh(), [box.copy().apply_transform(moved), scene])
    ]
    assert (images[0] > 0).any()
    assert np.array_equal(images[0], images[1])
    assert np.array_equal(images[0], images[2])
    assert hizvk.check_proxy(box, box).inside


def test_open3d_itself(device: hizvk.Device) -> None:
    o3d = pytest.importorskip("open3d")
    legacy = o3d.geometry.TriangleMesh.create_box()
    for mesh in (legacy, o3d.t.geometry.TriangleMesh.from_legacy(legacy)):
        assert hizvk.Mesh.of(mesh).vertices.max(axis=0).tolist() == [1.0, 1.0, 1.0]
        assert hizvk.check_proxy(mesh, mesh).inside
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(CENTERS))
    assert np.array_equal(hizvk.Points(cloud.point.positions).positions, CENTERS)
    turned = o3d.geometry.OrientedBoundingBox([1, 2, 3], np.eye(3)[[1, 2, 0]], [2, 4, 6])
    boxes = hizvk.OrientedBoxes.from_corners([np.asarray(turned.get_box_points())], order="open3d")
    assert np.allclose(boxes.half_sizes, [[1, 2, 3]])
    assert np.allclose(boxes.rotations, [turned.R])


def test_pyvista_itself(device: hizvk.Device) -> None:
    pv = pytest.importorskip("pyvista")
    cube = pv.Cube()
    with pytest.raises(ValueError, match=r"pass mesh\.triangulate\(\)$"):
        device.occluders(cube)
    assert hizvk.Mesh.of(cube.triangulate().clean()).vertices.max() == 0.5
    with pytest.raises(TypeError, match=r"extract_surface\(\)\.triangulate\(\)$"):
        device.occluders(pv.ImageData(dimensions=(2, 2, 2)))
    blocks = pv.MultiBlock([cube.triangulate(), pv.Sphere()])
    counts = hizvk.select_occluders(blocks).triangles.tolist()
    assert counts == [12, pv.Sphere().n_cells]
    grid = pv.ImageData(dimensions=(2, 2, 2)).extract_surface().triangulate()
    assert len(hizvk.Mesh.of(grid).triangles) == 12


def test_torch_itself(device: hizvk.Device) -> None:
    torch = pytest.importorskip("torch")
    bounds = hizvk.Boxes(torch.from_numpy(CENTERS - 0.5), torch.from_numpy(CENTERS + 0.5).float())
    assert np.shares_memory(hizvk.Points(torch.from_numpy(CENTERS)).positions, CENTERS)
    depth = torch.full((1, *CAMERA.size), 10.0)
    assert hizvk.visible(bounds, CAMERA, depth=depth, kind="z", device=device).tolist() == SEEN
    hiz = device.pyramid(depth, CAMERA, kind="z")
    seen = device.cull(device.instances(bounds), CAMERA, hiz)
    for array in (seen.mask, seen.verdicts, seen.indices, hiz.level(0)):
        tensor = torch.from_dlpack(array)
        assert np.array_equal(tensor.numpy(), array)
    assert torch.from_dlpack(seen.mask).dtype == torch.bool
    with pytest.raises(TypeError, match=r"^positions: .*\.detach\(\)$"):
        hizvk.Points(torch.zeros(2, 3, requires_grad=True))
    with pytest.raises(TypeError, match=r"^positions: .*bfloat16.*\.float\(\)$"):
        hizvk.Points(torch.zeros(2, 3, dtype=torch.bfloat16))


# -- corners ---------------------------------------------------------------------------------------


def kitti(length: float, width: float, height: float) -> Any:
    """computeBox3D of KITTI's development kit, before the turn."""
    x = [length / 2, length / 2, -length / 2, -length / 2] * 2
    y = [0.0] * 4 + [-height] * 4
    z = [width / 2, -width / 2, -width / 2, width / 2] * 2
    return np.stack([x, y, z], -1)


def nuscenes(length: float, width: float, height: float) -> Any:
    """Box.corners of the nuScenes kit, before the turn."""
    x = length / 2 * np.array([1, 1, 1, 1, -1, -1, -1, -1])
    y = width / 2 * np.array([1, -1, -1, 1, 1, -1, -1, 1])
    z = height / 2 * np.array([1, 1, -1, -1, 1, 1, -1, -1])
    return np.stack([x, y, z], -1)


def carla(length: float, width: float, height: float) -> Any:
    """GetLocalVertices of CARLA."""
    x, y, z = length / 2, width / 2, height / 2
    return np.array([[a * x, b * y, c * z] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])


def turned(rng: np.random.Generator, count: int) -> Any:
    """Random rotation matrices."""
    q, _ = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    return q * np.sign(np.linalg.det(q))[:, None, None]


ORDERS: dict[Any, Any] = {"kitti": kitti, "nuscenes": nuscenes, "carla": carla}
#: Which of length, width and height lies along the box's axes x, y and z.
ALONG = {"kitti": [0, 2, 1], "nuscenes": [0, 1, 2], "carla": [0, 1, 2]}


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("order", ORDERS)
def test_boxes_from_corners_in_the_order_of_a_data_set(order: Any, dtype: Any) -> None:
    rng = np.random.default_rng(7)
    sizes = rng.uniform(0.5, 5.0, (200, 3))
    sizes[:3] = [[2.0, 2.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    turns, places = turned(rng, 200), rng.uniform(-500.0, 500.0, (200, 3))
    local = np.stack([ORDERS[order](*size) for size in sizes])
    corners = (local @ turns.swapaxes(1, 2) + places[:, None]).astype(dtype)
    boxes = hizvk.OrientedBoxes.from_corners(corners, order=order)
    small = 1e-9 if dtype == np.float64 else 2e-4
    assert np.allclose(boxes.half_sizes, sizes[:, ALONG[order]] / 2, atol=small)
    identity = boxes.rotations.swapaxes(1, 2) @ boxes.rotations
    assert np.allclose(identity, np.eye(3), atol=1e-12)
    # Every corner lies in its box, but for the roundings of float64.
    spokes = corners - boxes.centers[:, None]
    inside = np.abs(np.einsum("nkj,nck->ncj", boxes.rotations, spokes)) - boxes.half_sizes[:, None]
    assert inside.max() <= 1e-12
    ring = "kitti" if order == "nuscenes" else order
    for other in ORDERS.keys() - {order}:
        if {order, other} != {"kitti", "nuscenes"}:
            with pytest.raises(ValueError, match=f'that are no box in it.*fit order="{ring}"'):
                hizvk.OrientedBoxes.from_corners(corners[3:], order=other)
    low, high = hizvk.Boxes.from_corners(corners).min, hizvk.Boxes.from_corners(corners).max
    assert np.array_equal(low, corners.min(axis=1))
    assert np.array_equal(high, corners.max(axis=1))
    assert low.dtype == dtype


def test_corners_of_no_box_are_refused() -> None:
    corners = np.stack([carla(4, 2, 1)] * 3)
    corners[1, 0] += 0.5
    with pytest.raises(ValueError, match=r"1 of 3 .* first of them box 1, nor in another"):
        hizvk.OrientedBoxes.from_corners(corners, order="carla")
    corners[1, 0] = np.nan
    boxes = hizvk.OrientedBoxes.from_corners(corners, order="carla")
    assert np.isnan(boxes.centers[1]).all()
    assert np.allclose(boxes.half_sizes[[0, 2]], [[2, 1, 0.5]] * 2)


def test_shapes_of_corners() -> None:
    corners = np.stack([nuscenes(4, 2, 1)] * 2)
    with pytest.raises(ValueError, match=r"pass corners\.swapaxes\(-1, -2\)$"):
        hizvk.OrientedBoxes.from_corners(corners.swapaxes(1, 2), order="nuscenes")
    with pytest.raises(ValueError, match=r"of one box pass \[corners\]$"):
        hizvk.Boxes.from_corners(corners[0])
    assert len(hizvk.OrientedBoxes.from_corners(np.zeros((0, 8, 3)), order="kitti")) == 0


def test_a_box_from_corners_hides_as_the_box_does(device: hizvk.Device) -> None:
    rng = np.random.default_rng(5)
    turns, places = turned(rng, 300), rng.uniform((-8, -8, -20), (8, 8, -4), (300, 3))
    sizes = rng.uniform(0.1, 1.0, (300, 3))
    corners = np.stack([carla(*size) for size in 2 * sizes]) @ turns.swapaxes(1, 2)
    made = hizvk.OrientedBoxes.from_corners(corners + places[:, None], order="carla")
    given = hizvk.OrientedBoxes(places, sizes, turns)
    masks = [
        hizvk.visible(boxes, CAMERA, depth=DEPTH, kind="z", device=device)
        for boxes in (made, given)
    ]
    assert 0 < masks[0].sum() < 300
    assert np.array_equal(masks[0], masks[1])


def test_box_mesh_and_corners_agree() -> None:
    vertices, _ = box_mesh([[0, 0, 0]], [[1, 2, 3]])
    boxes = hizvk.Boxes.from_corners([vertices])
    assert boxes.max.tolist() == [[1.0, 2.0, 3.0]]
