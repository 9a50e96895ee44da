"""The compiled engine (Rust). Not public: its arguments are checked by the modules around it.

This describes the module of a checkout, as ``make setup`` builds it.
A wheel is built without the features ``testing`` and ``yardstick``: it has neither `options_text`
nor the yardsticks.
"""

from collections.abc import Sequence
from typing import Self, TypeAlias, final

import numpy as np
import numpy.typing as npt

from .options import CullOptions, Outputs

__all__ = [
    "ApproximateCulling",
    "BspTree",
    "Camera",
    "Counts",
    "Culling",
    "DepthImage",
    "DepthTiles",
    "Engine",
    "Explanation",
    "HierarchicalVisibility",
    "Instances",
    "MeshTable",
    "MethodLevels",
    "Occluders",
    "OcclusionMap",
    "PassAnswer",
    "Pyramid",
    "TextCull",
    "Tiled",
    "TwoPasses",
    "ViewsCulling",
    "Yardstick",
    "YardstickCull",
    "YardstickFromBuffer",
    "YardstickRaster",
    "YardstickReduction",
    "__build__",
    "__version__",
    "adapters",
    "add_colours",
    "after_fork",
    "before_fork",
    "check_bounds",
    "check_proxy",
    "depth_of_points",
    "frustum_matrix",
    "let_go",
    "mip_cull",
    "mip_lookup",
    "options_text",
    "reference_classify",
    "reference_pyramid",
    "reference_unoccluded",
    "takes_planted_faults",
]

__version__: str
__build__: str
mip_cull: str
mip_lookup: str
takes_planted_faults: bool

_Floats: TypeAlias = npt.NDArray[np.float32] | npt.NDArray[np.float64]
_Vector: TypeAlias = tuple[float, float, float]
_Matrix: TypeAlias = list[list[float]]
_Borders: TypeAlias = tuple[float, float, float, float]
_Size: TypeAlias = tuple[int, int]
_Mesh: TypeAlias = tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]
_Adapter: TypeAlias = tuple[int, str, str, str, str, str]

def adapters() -> list[_Adapter]: ...
def let_go() -> None: ...
def before_fork() -> None: ...
def after_fork() -> None: ...
def options_text(options: CullOptions | None, outputs: Outputs | None) -> tuple[str, str]: ...
def check_proxy(
    proxy: _Mesh, mesh: _Mesh
) -> tuple[list[int], list[list[float]], list[int], float]: ...
def check_bounds(
    kind: str,
    arrays: Sequence[_Floats],
    meshes: Sequence[_Mesh],
    transforms: npt.NDArray[np.float64],
    instances: Sequence[tuple[int, int | None]],
) -> npt.NDArray[np.float64]: ...
def add_colours(
    positions: _Floats,
    visible: npt.NDArray[np.bool_],
    camera: Camera,
    image: npt.NDArray[np.uint8] | npt.NDArray[np.float32],
    bilinear: bool,
    weight: str,
    colours: npt.NDArray[np.float32],
    weights: npt.NDArray[np.float32],
    counts: npt.NDArray[np.uint32],
) -> None: ...
def depth_of_points(
    positions: _Floats, camera: Camera, radius: float, radius_px: float
) -> npt.NDArray[np.float32]: ...
def frustum_matrix(
    borders: _Borders, near: float, far: float | None, reversed_z: bool, size: _Size
) -> _Matrix: ...
def reference_classify(
    bounds_kind: str,
    arrays: Sequence[_Floats],
    camera: Camera,
    image: _Floats,
    depth_kind: str,
    scale: float,
    invalid: Sequence[float],
    coverage: str,
    own_depth: str,
    tolerance: tuple[float, float],
) -> npt.NDArray[np.uint8]: ...
def reference_unoccluded(
    bounds_kind: str,
    arrays: Sequence[_Floats],
    camera: Camera,
    image: _Floats,
    depth_kind: str,
    scale: float,
    invalid: Sequence[float],
    coverage: str,
) -> npt.NDArray[np.uint8]: ...
def reference_pyramid(
    depth: npt.NDArray[np.float32], width: int, height: int, reversed_z: bool
) -> list[tuple[_Size, npt.NDArray[np.float32]]]: ...

@final
class Camera:
    @staticmethod
    def perspective(
        eye: _Vector,
        target: _Vector,
        up: _Vector,
        fov_y: float,
        near: float,
        far: float | None,
        reversed_z: bool,
        size: _Size,
    ) -> Camera: ...
    @staticmethod
    def frustum(
        eye: _Vector,
        target: _Vector,
        up: _Vector,
        borders: _Borders,
        near: float,
        far: float | None,
        reversed_z: bool,
        size: _Size,
    ) -> Camera: ...
    @staticmethod
    def orthographic(
        eye: _Vector,
        target: _Vector,
        up: _Vector,
        borders: _Borders,
        near: float,
        far: float,
        reversed_z: bool,
        size: _Size,
    ) -> Camera: ...
    @staticmethod
    def from_clip_from_world(clip_from_world: _Matrix, reversed_z: bool, size: _Size) -> Camera: ...
    @staticmethod
    def from_clip_from_camera(
        clip_from_camera: _Matrix, camera_from_world: _Matrix, reversed_z: bool, size: _Size
    ) -> Camera: ...
    @staticmethod
    def from_clip_from_camera_pose(
        clip_from_camera: _Matrix, world_from_camera: _Matrix, reversed_z: bool, size: _Size
    ) -> Camera: ...
    def with_size(self, size: _Size) -> Camera: ...
    def size(self) -> _Size: ...
    def reversed_z(self) -> bool: ...
    def is_posed(self) -> bool: ...
    def rows(self) -> _Matrix: ...
    def origin(self) -> list[float]: ...
    def clip_from_world(self) -> _Matrix: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class Engine:
    def __new__(cls, adapter: str | None) -> Self: ...
    def adapter(self) -> _Adapter: ...
    def max_image_side(self) -> int: ...
    def instances(
        self,
        kind: str,
        arrays: Sequence[_Floats],
        strict_and_order: tuple[bool, str],
        mesh_ids: npt.NDArray[np.uint32] | None,
        scales: _Floats | None,
    ) -> Instances: ...
    def mesh_table(
        self, meshes: Sequence[Sequence[tuple[int, int, int, int, float]]]
    ) -> MeshTable: ...
    def update(
        self, instances: Instances, first: int, kind: str, arrays: Sequence[_Floats], strict: bool
    ) -> None: ...
    def occluders(
        self, meshes: Sequence[tuple[_Floats, npt.NDArray[np.uint32], _Floats | None]], cull: str
    ) -> Occluders: ...
    def render_depth(
        self,
        occluders: Occluders,
        camera: Camera,
        rasteriser: str,
        only: npt.NDArray[np.bool_] | None,
        max_triangles: int | None,
        max_occluders: int | None,
    ) -> DepthImage: ...
    def render_depth_into(
        self,
        depth: DepthImage,
        occluders: Occluders,
        only: npt.NDArray[np.bool_] | None,
        max_triangles: int | None,
        max_occluders: int | None,
    ) -> tuple[int, int, int, int] | None: ...
    def render_depth_conservative(
        self, occluders: Occluders, camera: Camera, refinement: int
    ) -> DepthImage: ...
    def upload_depth(
        self,
        image: _Floats | npt.NDArray[np.uint16],
        kind: str,
        scale: float,
        invalid: Sequence[float],
        rounding: str,
        tolerance: tuple[float, float],
        camera: Camera,
        depths: str = ...,
    ) -> DepthImage: ...
    def upload_samples(
        self,
        images: Sequence[_Floats | npt.NDArray[np.uint16]],
        kind: str,
        scale: float,
        invalid: Sequence[float],
        rounding: str,
        tolerance: tuple[float, float],
        camera: Camera,
        depths: str = ...,
    ) -> DepthImage: ...
    def receiver_mask(
        self,
        depth: DepthImage,
        light: Camera,
        filter_radius: float,
        reach_px: float,
        slacks: tuple[float, float],
    ) -> DepthImage: ...
    def renew(
        self, pyramid: Pyramid, depth: DepthImage, rectangle: tuple[int, int, int, int]
    ) -> None: ...
    def replace_depth(
        self,
        pyramid: Pyramid,
        depth: DepthImage,
        rectangle: tuple[int, int, int, int],
        images: Sequence[_Floats | npt.NDArray[np.uint16]],
        kind: str,
        scale: float,
        invalid: Sequence[float],
        rounding: str,
        tolerance: tuple[float, float],
    ) -> None: ...
    def pyramid(self, depth: DepthImage, levels: tuple[int, int], depths: str = ...) -> Pyramid: ...
    def cull(
        self,
        instances: Instances,
        camera: Camera,
        pyramid: Pyramid,
        options: CullOptions,
        outputs: Outputs,
        meshes: MeshTable | None,
        among: npt.NDArray[np.bool_] | Culling | ViewsCulling | None,
        ahead: bool,
    ) -> Culling: ...
    def cull_approximate(
        self,
        instances: Instances,
        camera: Camera,
        pyramid: Pyramid,
        options: CullOptions,
        outputs: Outputs,
        negligible_px: int,
    ) -> ApproximateCulling: ...
    def cull_views(
        self,
        instances: Instances,
        cameras: Sequence[Camera],
        pyramids: Sequence[Pyramid],
        options: CullOptions,
        outputs: Outputs,
        among: npt.NDArray[np.bool_] | Culling | ViewsCulling | None,
        ahead: bool,
    ) -> ViewsCulling: ...
    def warm_up(
        self,
        instances: Instances,
        camera: Camera,
        occluders: Occluders | None,
        stored: tuple[tuple[int, int], str],
        options: CullOptions,
        outputs: Outputs,
        meshes: MeshTable | None,
        more: tuple[bool, int, int],
    ) -> None: ...
    def cull_once(
        self,
        bounds: tuple[str, Sequence[_Floats]],
        camera: Camera,
        depth: Pyramid
        | tuple[
            _Floats | npt.NDArray[np.uint16],
            str,
            float,
            Sequence[float],
            str,
            tuple[float, float],
        ],
        options: CullOptions,
    ) -> tuple[npt.NDArray[np.bool_], Counts]: ...
    def start_timing(self) -> None: ...
    def stop_timing(self) -> list[tuple[str, int, float | None]]: ...
    def wait(self) -> None: ...
    def wait_without_guard(self) -> None: ...

@final
class Instances:
    def num_instances(self) -> int: ...
    def kind(self) -> str: ...
    def num_pieces(self) -> int: ...
    def invalid(self) -> npt.NDArray[np.uint64]: ...
    def host_bytes(self) -> int: ...
    def device_bytes(self) -> int: ...

@final
class Occluders:
    def move(self, mesh: int, transforms: _Floats | None) -> None: ...
    def host_bytes(self) -> int: ...
    def surface(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32], str]: ...
    def num_triangles(self) -> int: ...
    def num_parts(self) -> int: ...
    def device_bytes(self) -> int: ...

@final
class DepthImage:
    def read(self) -> npt.NDArray[np.float32]: ...
    def rasteriser(self) -> str | None: ...

@final
class Pyramid:
    def num_levels(self) -> int: ...
    def stored_levels(self) -> tuple[int, int] | None: ...
    def read_level(self, k: int, nearest: bool) -> tuple[_Size, npt.NDArray[np.float32]]: ...
    def mips(self, depths: str, lookup: str) -> list[tuple[_Size, npt.NDArray[np.float32]]]: ...
    def device_bytes(self) -> int: ...

@final
class Counts:
    @property
    def tested(self) -> int: ...
    @property
    def absent(self) -> int: ...
    @property
    def outside(self) -> int: ...
    @property
    def occluded(self) -> int: ...
    @property
    def visible(self) -> int: ...
    @property
    def unoccluded(self) -> int: ...
    @property
    def invalid(self) -> int: ...
    @property
    def demand(self) -> int: ...
    @property
    def written(self) -> int: ...
    @property
    def tested_groups(self) -> int: ...
    @property
    def tested_boxes(self) -> list[int]: ...
    @property
    def tested_instances(self) -> int: ...
    @property
    def accepted_instances(self) -> int: ...
    @property
    def levels(self) -> list[int]: ...
    @property
    def texels_read(self) -> int: ...

@final
class Explanation:
    @property
    def verdict(self) -> int: ...
    @property
    def reason(self) -> str: ...
    @property
    def rectangle(self) -> list[int] | None: ...
    @property
    def level(self) -> int | None: ...
    @property
    def texels(self) -> list[tuple[int, int, int, float]]: ...
    @property
    def texels_read(self) -> int: ...
    @property
    def decisive(self) -> int | None: ...
    @property
    def farthest(self) -> float | None: ...
    @property
    def nearest(self) -> float | None: ...
    @property
    def farthest_z(self) -> float | None: ...
    @property
    def nearest_z(self) -> float | None: ...
    @property
    def in_front_of(self) -> float | None: ...
    @property
    def in_front_of_z(self) -> float | None: ...
    @property
    def stale(self) -> bool: ...
    @property
    def group(self) -> Explanation | None: ...

@final
class MeshTable: ...

@final
class Culling:
    def num_instances(self) -> int: ...
    def is_ready(self) -> bool: ...
    def wait(self) -> None: ...
    def mask(self) -> npt.NDArray[np.bool_]: ...
    def verdicts(self) -> npt.NDArray[np.uint8]: ...
    def indices(self) -> npt.NDArray[np.uint32]: ...
    def draws(self) -> bytes: ...
    def draw_counts(self) -> list[int]: ...
    def lods(self) -> npt.NDArray[np.uint8]: ...
    def pixels(self) -> npt.NDArray[np.uint32]: ...
    def bin(self, mesh: int, lod: int) -> npt.NDArray[np.uint32]: ...
    def counts(self) -> Counts: ...
    def demand_and_written(self) -> tuple[int | None, int]: ...
    def timings(self) -> tuple[float, float, float, float]: ...
    def stage_times(self) -> list[tuple[str, int, float | None]] | None: ...
    def explain(self, index: int) -> Explanation: ...

@final
class ApproximateCulling:
    def num_instances(self) -> int: ...
    def mask(self) -> npt.NDArray[np.bool_]: ...
    def indices(self) -> npt.NDArray[np.uint32]: ...
    def pixels(self) -> npt.NDArray[np.uint32]: ...
    def negligible(self) -> npt.NDArray[np.bool_]: ...

@final
class OcclusionMap:
    def __new__(
        cls,
        occluders: Occluders,
        camera: Camera,
        least: int,
        regions: int,
        max_triangles: int | None,
        max_copies: int | None,
    ) -> Self: ...
    def num_levels(self) -> int: ...
    def level(self, level: int) -> tuple[_Size, npt.NDArray[np.uint32]]: ...
    def estimate(self) -> tuple[_Size, npt.NDArray[np.float64]]: ...
    def least_counts(self, negligible_px: int) -> list[int]: ...
    def chosen(self) -> npt.NDArray[np.uint32]: ...
    def num_triangles(self) -> int: ...
    def cull(
        self,
        kind: str,
        arrays: Sequence[_Floats],
        negligible_px: int,
        never: npt.NDArray[np.bool_] | None,
    ) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint32], int]: ...

@final
class BspTree:
    def __new__(cls, occluders: Occluders, leaf: int | None, most_parts: float) -> Self: ...
    def numbers(self) -> tuple[int, int, int, int]: ...
    def is_octree(self) -> bool: ...
    def draw(self, occluders: Occluders, camera: Camera) -> Tiled: ...

@final
class Tiled:
    def coverage(self) -> npt.NDArray[np.bool_]: ...
    def numbers(self) -> tuple[int, int, int, int, int]: ...

@final
class DepthTiles:
    def __new__(cls, size: _Size) -> Self: ...
    def draw(self, occluders: Occluders, camera: Camera) -> None: ...
    def coverage(self) -> npt.NDArray[np.bool_]: ...
    def bytes(self) -> int: ...

@final
class TwoPasses:
    def __new__(cls, engine: Engine, instances: Instances, early_capacity: int | None) -> Self: ...
    def early(
        self, camera: Camera, pixels: int | None, mask: npt.NDArray[np.bool_] | None
    ) -> PassAnswer: ...
    def late(self, camera: Camera, pyramid: Pyramid, options: CullOptions) -> PassAnswer: ...
    def reset(self) -> None: ...
    def device_bytes(self) -> int: ...

@final
class PassAnswer:
    def num_instances(self) -> int: ...
    def mask(self) -> npt.NDArray[np.bool_]: ...

@final
class ViewsCulling:
    def num_instances(self) -> int: ...
    def num_views(self) -> int: ...
    def is_ready(self) -> bool: ...
    def wait(self) -> None: ...
    def masks(self) -> npt.NDArray[np.bool_]: ...
    def any(self) -> npt.NDArray[np.bool_]: ...
    def any_indices(self) -> npt.NDArray[np.uint32]: ...
    def any_draws(self) -> bytes: ...
    def view(self, view: int) -> Culling: ...

@final
class TextCull:
    def __new__(
        cls,
        engine: Engine,
        text: str,
        bounds: npt.NDArray[np.float32],
        camera: tuple[npt.NDArray[np.float32], float],
        sizes: Sequence[tuple[int, int]],
        texels: npt.NDArray[np.float32],
    ) -> Self: ...
    def run(self) -> None: ...
    def mask(self) -> npt.NDArray[np.bool_]: ...

@final
class MethodLevels:
    def __new__(
        cls,
        engine: Engine,
        way: str,
        shape: tuple[int, int],
        camera: Camera,
        images: Sequence[npt.NDArray[np.float32]],
    ) -> Self: ...
    def run(self) -> None: ...
    def level(self, image: int, k: int) -> tuple[int, int, npt.NDArray[np.float32]]: ...

@final
class Yardstick:
    def __new__(cls, engine: Engine) -> Self: ...
    @staticmethod
    def profile() -> str: ...
    def empty_submit_ms(self) -> float: ...
    def pipelines_made(self) -> int: ...
    @staticmethod
    def memcpy_ms(source: npt.NDArray[np.float32], target: npt.NDArray[np.float32]) -> float: ...
    def reduction(
        self, depth: DepthImage, shape: str, levels: tuple[int, int], depths: str = ...
    ) -> YardstickReduction: ...
    def region(
        self, depth: DepthImage, rectangle: tuple[int, int, int, int]
    ) -> YardstickReduction: ...
    def resolve(self, camera: Camera, samples: int) -> YardstickReduction: ...
    def mips(self, depth: DepthImage, depths: str, lookup: str) -> YardstickReduction: ...
    def frames(
        self,
        instances: Instances,
        occluders: Occluders,
        cameras: Sequence[Camera],
        is_warmed: bool,
    ) -> tuple[float, list[list[float]]]: ...
    def bounds_in_buffer(self, kind: str, arrays: Sequence[_Floats]) -> YardstickFromBuffer: ...
    def raster(self, occluders: Occluders, camera: Camera, threads: int) -> YardstickRaster: ...
    def cull(
        self,
        instances: Instances,
        camera: Camera,
        pyramid: Pyramid,
        certified: bool,
        options: CullOptions,
        outputs: Outputs,
        depth: DepthImage | None,
        meshes: MeshTable | None,
    ) -> YardstickCull: ...

@final
class YardstickReduction:
    def ms(self) -> float: ...

@final
class YardstickFromBuffer:
    def ms(self) -> float: ...
    def copy_ms(self) -> float: ...

@final
class YardstickRaster:
    def ms(self) -> float: ...

@final
class YardstickCull:
    def emit_ms(self) -> float: ...
    def ms(self) -> float: ...
    def mask(self) -> npt.NDArray[np.bool_]: ...
    def device_bytes(self) -> int: ...

_HierarchyNodes: TypeAlias = tuple[
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.int64],
    npt.NDArray[np.uint32],
    npt.NDArray[np.uint32],
    npt.NDArray[np.uint64],
]
_HierarchyFrame: TypeAlias = tuple[
    npt.NDArray[np.float32],
    list[tuple[_Size, npt.NDArray[np.float32]]],
    npt.NDArray[np.uint8],
    npt.NDArray[np.uint32],
    tuple[int, int, int, int, int, int, int],
    tuple[int, int] | None,
    float,
]

@final
class HierarchicalVisibility:
    def __new__(
        cls,
        meshes: Sequence[tuple[_Floats, npt.NDArray[np.uint32], _Floats | None]],
        cull: str,
        threshold: int,
        deepest: int,
    ) -> Self: ...
    def nodes(self) -> _HierarchyNodes: ...
    def num_triangles(self) -> int: ...
    def num_meshlets(self) -> int: ...
    def render(
        self, camera: Camera, previous: npt.NDArray[np.uint32], count: bool
    ) -> _HierarchyFrame: ...
    def render_flat(self, camera: Camera) -> tuple[npt.NDArray[np.float32], int, int, float]: ...
