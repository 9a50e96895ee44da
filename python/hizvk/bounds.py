"""The bounds that are tested: spheres, boxes, oriented boxes and points, an array row each.

The arrays are kept as they come, float32 and float64 in C order without a copy.
They are read when they are uploaded (`Device.instances`).
Positions may be float64: the engine subtracts the eye before it rounds to float32.

Invalid bounds are not an error here: NaN, infinite, a negative radius or half size, min > max.
A cull keeps them visible and counts them, or `Device.instances(..., strict=True)` refuses them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np

from . import _arguments, _corners, _rotations

if TYPE_CHECKING:
    from typing import Self

    import numpy.typing as npt

    from ._arguments import FloatArray
    from ._types import CornerOrder, QuaternionOrder

__all__ = ["Boxes", "OrientedBoxes", "Points", "Spheres"]


_ORDERS = (
    '"wxyz" (nuScenes, COLMAP, Blender, trimesh, MuJoCo) or "xyzw" (SciPy, ROS, glTF, PyBullet, '
    "pycolmap's rotation.quat)"
)
#: Bounds that are looked at before all of them are.
_FEW: Final = 64
_NO_DEFAULT = "there is no default, for a wrong guess hides things"
#: What `_arguments.explained` says about keywords of the constructors of `OrientedBoxes`.
_KEYWORDS: Final = {
    "order": f"expected {_ORDERS}, got nothing; {_NO_DEFAULT}",
    "up": "expected the axis of the turn, (0, 0, 1) where z is up (nuScenes, CARLA, Waymo) or "
    "(0, 1, 0) (KITTI's rotation_y in camera coordinates, worlds whose y is up), "
    f"got nothing; {_NO_DEFAULT}",
    "yaw": "expected yaw_deg, in degrees: np.degrees(yaw)",
}
_OTHER_ROTATIONS = (
    "; angles, quaternions and matrices with a translation are taken by "
    "OrientedBoxes.from_yaw, .from_quaternions and .from_transforms"
)


#: The same for `OrientedBoxes.from_corners`.
_KEYWORDS_OF_CORNERS: Final = {"order": f"expected {_corners.ORDERS}, got nothing; {_NO_DEFAULT}"}


@dataclass(frozen=True, eq=False, repr=False)
class Spheres:
    """Bounding spheres.

    Parameters
    ----------
    centers : (N, 3) float array
        World positions.
    radii : (N,) float array or one number
        World units; 0 is a point.

    Raises
    ------
    TypeError
        For a dtype that is not float16, float32 or float64.
    ValueError
        For another shape.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> hizvk.Spheres(np.zeros((4, 3)), 0.5)
    Spheres(4 of float64)
    """

    centers: FloatArray
    radii: FloatArray

    @_arguments.explained()
    def __init__(self, centers: npt.ArrayLike, radii: npt.ArrayLike) -> None:
        centers = _arguments.floats("centers", centers, ("N", 3))
        object.__setattr__(self, "centers", centers)
        object.__setattr__(self, "radii", _arguments.floats_or_scalar("radii", radii, len(centers)))

    def __len__(self) -> int:
        return len(self.centers)

    def __repr__(self) -> str:
        return f"Spheres({len(self)} of {self.centers.dtype})"


@dataclass(frozen=True, eq=False, repr=False)
class Boxes:
    """Axis-aligned boxes.

    Parameters
    ----------
    min, max : (N, 3) float array
        The two corners in world units; a side may have length 0.

    Raises
    ------
    TypeError
        For a dtype that is not float16, float32 or float64.
    ValueError
        For another shape.
    """

    min: FloatArray
    max: FloatArray

    @_arguments.explained()
    def __init__(self, min: npt.ArrayLike, max: npt.ArrayLike) -> None:
        low = _arguments.floats("min", min, ("N", 3))
        object.__setattr__(self, "min", low)
        object.__setattr__(self, "max", _arguments.floats("max", max, (len(low), 3)))

    @classmethod
    @_arguments.explained()
    def from_corners(cls, corners: npt.ArrayLike) -> Self:
        """The axis-aligned boxes around corners, in any order.

        A turned box gets a larger one around it; `OrientedBoxes.from_corners` keeps it as it is.

        Parameters
        ----------
        corners : (N, 8, 3) float array
            World positions.
            A corner that is NaN makes an invalid box: a cull keeps it and counts it.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.

        Examples
        --------
        >>> import numpy as np, hizvk
        >>> corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)])
        >>> hizvk.Boxes.from_corners([corners]).max.tolist()
        [[1.0, 2.0, 3.0]]
        """
        checked = _arguments.floats("corners", corners, ("N", 8, 3), hint=_corners.hint(corners))
        return cls(checked.min(axis=1), checked.max(axis=1))

    def __len__(self) -> int:
        return len(self.min)

    def __repr__(self) -> str:
        return f"Boxes({len(self)} of {self.min.dtype})"


@dataclass(frozen=True, eq=False, repr=False)
class OrientedBoxes:
    """Boxes with axes of their own.

    `from_yaw`, `from_quaternions` and `from_transforms` make them from what data sets hold instead
    of `rotations`.
    They form float64 matrices, and a cull promises what it promises about the boxes with those
    matrices.
    The matrices are off an exact turn by about 1e-16, which moves a corner of a box with a half
    size of 1 km by 1e-13 m.

    Parameters
    ----------
    centers : (N, 3) float array
        World positions.
    half_sizes : (N, 3) float array
        Half the side along each of the box's own axes.
    rotations : (N, 3, 3) float array
        Column ``k`` is the world direction of the box's axis ``k``:
        ``world = center + rotation @ local``.
        Any matrix is allowed: scaled, sheared, mirrored, flat.

    Raises
    ------
    TypeError
        For a dtype that is not float16, float32 or float64.
    ValueError
        For another shape.
    """

    centers: FloatArray
    half_sizes: FloatArray
    rotations: FloatArray

    @_arguments.explained()
    def __init__(
        self, centers: npt.ArrayLike, half_sizes: npt.ArrayLike, rotations: npt.ArrayLike
    ) -> None:
        centers = _arguments.floats("centers", centers, ("N", 3))
        count = len(centers)
        object.__setattr__(self, "centers", centers)
        object.__setattr__(
            self, "half_sizes", _arguments.floats("half_sizes", half_sizes, (count, 3))
        )
        checked = _arguments.floats("rotations", rotations, (count, 3, 3), hint=_OTHER_ROTATIONS)
        object.__setattr__(self, "rotations", checked)

    @classmethod
    @_arguments.explained(_KEYWORDS)
    def from_yaw(
        cls,
        centers: npt.ArrayLike,
        half_sizes: npt.ArrayLike,
        yaw_deg: npt.ArrayLike,
        *,
        up: npt.ArrayLike,
    ) -> Self:
        """Boxes that are turned about one axis, as in most driving data.

        Parameters
        ----------
        centers : (N, 3) float array
            World positions of the boxes' centres.
            KITTI's labels hold the middle of the lower face instead.
        half_sizes : (N, 3) or (3,) float array, or one number
            Half the side along each of the box's own axes, which are the world's at an angle of 0.
        yaw_deg : (N,) float array or one number
            Degrees by which the boxes turn about `up`, by the right-hand rule.
            For ``up=(0, 0, 1)`` that is from x towards y, also in CARLA's left-handed coordinates.
            Of radians pass ``np.degrees(yaw)``.
            Whole quarter turns are exact.
        up : three numbers
            The axis, of any length: ``(0, 0, 1)`` where z is up.
            There is no default.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.

        Examples
        --------
        >>> import numpy as np, hizvk
        >>> yaws = [0.0, 30.0]
        >>> hizvk.OrientedBoxes.from_yaw(np.zeros((2, 3)), [2.0, 1.0, 0.8], yaws, up=(0, 0, 1))
        OrientedBoxes(2 of float64)
        """
        centers = _arguments.floats("centers", centers, ("N", 3))
        half_sizes = _for_each("half_sizes", half_sizes, len(centers))
        angles = _arguments.floats_or_scalar("yaw_deg", yaw_deg, len(centers))
        _rotations.warn_of_radians("yaw_deg", angles)
        axis = _arguments.vector("up", up)
        if not any(axis):
            raise ValueError(f"up: expected a direction, got {axis}")
        return cls(centers, half_sizes, _rotations.about(axis, angles))

    @classmethod
    @_arguments.explained(_KEYWORDS)
    def from_quaternions(
        cls,
        centers: npt.ArrayLike,
        half_sizes: npt.ArrayLike,
        quaternions: npt.ArrayLike,
        *,
        order: QuaternionOrder,
    ) -> Self:
        """Boxes that are turned by quaternions (Hamilton's: ``i j = k``).

        Parameters
        ----------
        centers : (N, 3) float array
            World positions.
        half_sizes : (N, 3) or (3,) float array, or one number
            Half the side along each of the box's own axes.
        quaternions : (N, 4) float array
            The turn from the box's axes to the world's.
            They are normalised, so they may have any length but 0.
            One of length 0, or not finite, makes an invalid box: a cull keeps it and counts it.
        order : {"wxyz", "xyzw"}
            Where the scalar part is.
            There is no default.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        if not isinstance(order, str):
            raise TypeError(
                f"order: expected {_ORDERS}, got {_arguments.describe(order)}; {_NO_DEFAULT}"
            )
        if order not in ("wxyz", "xyzw"):
            raise ValueError(f"order: expected {_ORDERS}, got {_arguments.describe(order)}")
        centers = _arguments.floats("centers", centers, ("N", 3))
        half_sizes = _for_each("half_sizes", half_sizes, len(centers))
        columns = _arguments.floats("quaternions", quaternions, (len(centers), 4)).T
        w, x, y, z = (
            columns if order == "wxyz" else (columns[3], columns[0], columns[1], columns[2])
        )
        return cls(centers, half_sizes, _rotations.from_quaternions(w, x, y, z))

    @classmethod
    @_arguments.explained()
    def from_transforms(
        cls, world_from_box: npt.ArrayLike, half_sizes: npt.ArrayLike = 0.5
    ) -> Self:
        """Boxes that are placed by matrices: cubes of a scene graph, poses of a tracker.

        Parameters
        ----------
        world_from_box : (N, 4, 4) or (N, 3, 4) float array; or one matrix without the N
            ``world = M @ [x, y, z, 1]`` for column vectors.
            Any turn, scale, shear or mirroring will do; the last row of a ``(4, 4)`` is 0, 0, 0, 1.
            A matrix that is not finite makes an invalid box: a cull keeps it and counts it.
        half_sizes : (N, 3) or (3,) float array, or one number
            Half the side along each of the box's own axes, before the matrix.
            The default is the cube from -0.5 to 0.5.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came.

        Examples
        --------
        >>> import numpy as np, hizvk
        >>> hizvk.OrientedBoxes.from_transforms(np.eye(4))
        OrientedBoxes(1 of float64)
        """
        name = "world_from_box"
        sides = _sides(world_from_box) or ()
        rows = 3 if sides[-2:] == (3, 4) else 4
        free: tuple[int | str, ...] = () if len(sides) == 2 else ("N",)
        matrices = _arguments.floats(name, world_from_box, (*free, rows, 4)).reshape(-1, rows, 4)
        centers = matrices[:, :3, 3]
        if rows == 4:
            known = np.asarray(np.isfinite(matrices[:, 3]).all(axis=1))
            _arguments.check_affine(name, matrices[known])
            centers = np.where(known[:, None], centers, np.nan)
        return cls(centers, _for_each("half_sizes", half_sizes, len(matrices)), matrices[:, :3, :3])

    @classmethod
    @_arguments.explained(_KEYWORDS_OF_CORNERS)
    def from_corners(cls, corners: npt.ArrayLike, *, order: CornerOrder) -> Self:
        """Boxes from their eight corners, in the order of a data set.

        The box is a little larger than the corners where these are rounded, and contains them up to
        the roundings of float64.

        Parameters
        ----------
        corners : (N, 8, 3) float array
            World positions.
            A corner that is not finite makes an invalid box: a cull keeps it and counts it.
        order : {"kitti", "nuscenes", "carla", "open3d"}
            Where the corners lie along the box's axes x, y and z.
            There is no default.

            - ``"kitti"``: the development kit's ``computeBox3D``; the corners of the lower face
              one after the other, then those of the upper face.
            - ``"nuscenes"``: ``Box.corners().T``; the front face one after the other, then the
              back face.
            - ``"carla"``: ``BoundingBox.get_world_vertices``; x changes after four, y after two,
              z after each.
            - ``"open3d"``: ``OrientedBoundingBox.get_box_points``.

            Other data sets share them: a ring of four and the ring opposite is ``"kitti"``, as
            PyTorch3D has it.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came; also where the corners are not
            those of a box in this order, with the order that they are in.
        """
        return cls(*_corners.boxes(corners, order))

    def __len__(self) -> int:
        return len(self.centers)

    def __repr__(self) -> str:
        return f"OrientedBoxes({len(self)} of {self.centers.dtype})"


@dataclass(frozen=True, eq=False, repr=False)
class Points:
    """Points: a cloud, or the vertices of a mesh.

    On the device a point takes 16 bytes where float32 holds all positions exactly, else 32.
    So float64 positions that came from float32 take no more than these.

    A cull of points has a guard of half a pixel by default (`CullOptions.guard_px`).
    A depth image knows depth at its pixels' centres alone, so the pixels of the four centres around
    a point decide about it.
    Without the guard a third of the visible vertices of a mesh are lost.

    Points that were not measured by the camera itself need a `Tolerance` as well.

    Parameters
    ----------
    positions : (N, 3) float array
        World positions.

    Raises
    ------
    TypeError
        For a dtype that is not float16, float32 or float64.
    ValueError
        For another shape.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> device = hizvk.Device()
    >>> cloud = device.instances(hizvk.Points(np.zeros((65536, 3), np.float32)))
    >>> cloud
    <Instances: 65536 points>
    >>> round(cloud.device_bytes / len(cloud), 1)  # 16, and a share of the boxes of groups
    16.8
    """

    positions: FloatArray

    @_arguments.explained()
    def __init__(self, positions: npt.ArrayLike) -> None:
        checked = _arguments.floats("positions", positions, ("N", 3))
        object.__setattr__(self, "positions", checked)

    def __len__(self) -> int:
        return len(self.positions)

    def __repr__(self) -> str:
        return f"Points({len(self)} of {self.positions.dtype})"


def _sides(value: Any) -> tuple[int, ...] | None:
    """The shape of anything that has one; None for a ragged list, which `_arguments` refuses."""
    try:
        return tuple(np.shape(value))
    except ValueError:
        return None


def _for_each(name: str, value: npt.ArrayLike, count: int) -> FloatArray:
    """``(count, 3)``, also from one row or one number for all."""
    sides = _sides(value)
    if sides is None or len(sides) > 1 or (sides == (0,) and not count):
        return _arguments.floats(name, value, (count, 3))
    row = np.asarray(_arguments.floats_or_scalar(name, value, 3), np.float64)
    return np.broadcast_to(row, (count, 3))


Bounds: TypeAlias = Spheres | Boxes | OrientedBoxes | Points


def as_arrays(name: str, bounds: object) -> tuple[str, tuple[FloatArray, ...]]:
    """The engine's word for the kind of bounds, and the arrays; a `TypeError` for other objects."""
    match bounds:
        case Spheres():
            return "spheres", (bounds.centers, bounds.radii)
        case Boxes():
            return "boxes", (bounds.min, bounds.max)
        case OrientedBoxes():
            return "oriented_boxes", (bounds.centers, bounds.half_sizes, bounds.rotations)
        case Points():
            return "points", (bounds.positions,)
    got = _arguments.describe(bounds)
    ways = {
        (3,): f"hizvk.Points({name})",
        (6,): f"hizvk.Boxes({name}[:, :3], {name}[:, 3:])",
        (8, 3): f"hizvk.Boxes.from_corners({name})",
        (4, 4): f"hizvk.OrientedBoxes.from_transforms({name})",
    }
    way = ways.get((_sides(bounds) or ())[1:])
    hint = f"; pass {way}, if that is what the numbers are" if way else ""
    if isinstance(bounds, tuple) and len(bounds) == 2:
        hint = f"; pass hizvk.Boxes(*{name}) or hizvk.Spheres(*{name})"
    raise TypeError(f"{name}: expected Spheres, Boxes, OrientedBoxes or Points, got {got}{hint}")


def are_points(bounds: Bounds) -> bool:
    """Whether there are bounds, and all of them have size zero."""
    with np.errstate(invalid="ignore"):  # signalling NaN
        match bounds:
            case Spheres():
                return len(bounds) > 0 and not np.any(bounds.radii)
            case Boxes():
                # The first few tell nearly always, and the arrays may be large.
                return len(bounds) > 0 and all(
                    np.array_equal(bounds.min[:some], bounds.max[:some])
                    for some in (_FEW, len(bounds))
                )
            case Points():
                return len(bounds) > 0
        return len(bounds) > 0 and not np.any(bounds.half_sizes)
