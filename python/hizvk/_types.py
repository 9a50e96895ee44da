"""Type aliases that several modules share: the words that parameters take.

They stand below every other module, so that an alias never makes two modules import one another.
"""

from __future__ import annotations

from typing import Any, Literal, TypeAlias, get_args

# These are unions of single words because stubtest, at run time, takes Literal["a", "b"] for
# something else.

#: What the numbers of a depth image are; see `Device.pyramid`.
DepthKind: TypeAlias = Literal["ndc"] | Literal["reversed_ndc"] | Literal["z"] | Literal["distance"]
#: What rounded depth before it arrived: nothing, a conversion to float32, or one to float16.
Rounding: TypeAlias = Literal["none"] | Literal["single"] | Literal["half"]
#: Where a camera matrix has the centre of the first pixel: (0, 0) or (0.5, 0.5).
PixelCenter: TypeAlias = Literal["integer"] | Literal["half"]
#: Whether the scalar part of a quaternion comes first or last.
QuaternionOrder: TypeAlias = Literal["wxyz"] | Literal["xyzw"]
#: In which order the corners of a box come; see `OrientedBoxes.from_corners`.
CornerOrder: TypeAlias = (
    Literal["kitti"] | Literal["nuscenes"] | Literal["carla"] | Literal["open3d"]
)
#: How instances are stored on the device.
StoredOrder: TypeAlias = Literal["morton"] | Literal["given"]
#: Which faces of occluders are left out.
FaceCull: TypeAlias = Literal["none"] | Literal["back"] | Literal["front"]
#: What draws occluders; see `Device.render_depth`.
Rasteriser: TypeAlias = Literal["auto"] | Literal["device"] | Literal["host"]
#: Which levels of a pyramid are built; see `Device.pyramid`.
Levels: TypeAlias = int | tuple[int, int] | None
#: Which depths of each block a pyramid has; see `Device.pyramid`.
Depths: TypeAlias = (
    Literal["farthest"] | Literal["nearest"] | Literal["both"] | Literal["receivers"]
)
#: One of the two ends of a block's depths; see `Pyramid.level`.
DepthEnd: TypeAlias = Literal["farthest"] | Literal["nearest"]
#: The order of the list of kept instances; see `CullOptions`.
Order: TypeAlias = Literal["stable"] | Literal["any"]
#: Which part of a pixel counts; see `CullOptions`.
Coverage: TypeAlias = Literal["area"] | Literal["sample"]
#: What stands for the bounds in a test; see `CullOptions`.
Fit: TypeAlias = Literal["rectangle"] | Literal["volume"]
#: What a cull can make; see `Outputs`.
Output: TypeAlias = (
    Literal["mask"]
    | Literal["verdicts"]
    | Literal["indices"]
    | Literal["draws"]
    | Literal["pixels"]
)
#: How a cull lists what it keeps of several meshes; see `Outputs`.
Emit: TypeAlias = Literal["bins"] | Literal["instances"]
#: Where bins lie in the list; see `Outputs`.
Placement: TypeAlias = Literal["packed"] | Literal["reserved"]
#: Which depths a texel of a mip texture holds; see `Pyramid.mips`.
MipDepths: TypeAlias = Literal["farthest"] | Literal["nearest"] | Literal["both"]
#: How texels of a mip texture are looked up; see `Pyramid.mips`.
MipLookup: TypeAlias = Literal["normalized"] | Literal["edge_texel"]
#: What an image shows at a place: its pixel, or a mean of the four around; see `gather`.
Sampling: TypeAlias = Literal["nearest"] | Literal["bilinear"]
#: How the views of a point are weighted; see `colour_points`.
ColourWeight: TypeAlias = Literal["equal"] | Literal["near"]
#: Which world axis points up, or with a minus down; see `CullResult.plot`.
Up: TypeAlias = (
    Literal["x"] | Literal["y"] | Literal["z"] | Literal["-x"] | Literal["-y"] | Literal["-z"]
)
#: Which depth of the bounds a pixel of the oracle is compared with.
OwnDepth: TypeAlias = Literal["nearest"] | Literal["pixel"]


def words(alias: Any) -> tuple[str, ...]:
    """The words of one of the aliases above, in their order."""
    return tuple(get_args(word)[0] for word in get_args(alias))
