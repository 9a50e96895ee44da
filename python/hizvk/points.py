"""Points and the images that see them: colours of a cloud, and depth images of one.

Which points are visible in an image is decided by a cull, with its promise.
What is added up afterwards is plain arithmetic.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sized
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from . import _arguments, foreign
from ._core import add_colours as core_add_colours
from ._core import depth_of_points
from ._types import ColourWeight, DepthKind, Sampling, words
from .bounds import Points
from .camera import Camera
from .device import Device, maker_of
from .errors import HizWarning
from .oneline import default_device
from .options import Outputs, cull_options
from .progress import Progress
from .resources import DepthImage
from .sparse import is_sparse

if TYPE_CHECKING:
    from collections.abc import Collection
    from typing import Unpack

    import numpy.typing as npt

    from .options import CullOptions, OptionKeywords
    from .progress import ProgressLike
    from .tolerance import Tolerance

__all__ = ["PointColours", "colour_points", "depth_from_points"]


#: What `points` takes.
_A_CLOUD: Final = "Points, as hizvk.Points(xyz) makes them"
#: Fewer pixels with a depth than this are a trial and not a cloud.
_LEAST_KNOWN: Final = 32
#: What a cull makes here.
_MASK: Final = Outputs(mask=True, verdicts=False, indices=False, draws=False)


class PointColours(NamedTuple):
    """The colours of points; made by `colour_points`."""

    colours: npt.NDArray[np.float32]
    """``(N, 3)`` float32: the weighted mean over the views that see the point.

    In the units of the images; 0 where no view sees it."""
    counts: npt.NDArray[np.uint32]
    """``(N,)`` uint32: how many views see the point."""
    weights: npt.NDArray[np.float32]
    """``(N,)`` float32: the sum of the weights."""

    def bytes(self) -> npt.NDArray[np.uint8]:
        """``(N, 3)`` uint8: the colours of images of 0 to 255, rounded.

        Of images of 0 to 1, it is ``numpy.rint(255 * seen.colours)`` instead.
        """
        return np.clip(np.rint(self.colours), 0.0, 255.0).astype(np.uint8)


def colour_points(
    points: Points,
    views: Iterable[tuple[Camera, npt.ArrayLike | DepthImage, npt.ArrayLike]],
    *,
    kind: DepthKind | None = None,
    scale: float = 1.0,
    invalid: Collection[float] | None = None,
    tolerance: Tolerance | None = None,
    sampling: Sampling = "bilinear",
    weight: ColourWeight = "equal",
    device: Device | None = None,
    options: CullOptions | None = None,
    progress: ProgressLike = None,
    **keywords: Unpack[OptionKeywords],
) -> PointColours:
    """Colours each point from the images that see it.

    The points are uploaded once.
    Each view then takes one cull against its depth image, and adds the colours of what it keeps
    inside of the image.
    Views are asked for one at a time, so a generator may load them from files.

    Parameters
    ----------
    points : Points
        The N points.
    views : iterable of (Camera, depth, image)
        ``depth`` is an array of the camera's size, or a `DepthImage` of the device.
        ``image`` is ``(height, width, 3)``, uint8 or float, of the camera's size.
    kind, scale, invalid, tolerance
        What the numbers of depth arrays are, as in `Device.pyramid`.
        `kind` is left out where every view has a `DepthImage`.
        Measured points and depth need a `Tolerance`, or what is visible counts as hidden.
    sampling : "bilinear" or "nearest"
        As in `gather`.
    weight : "equal" or "near"
        ``"equal"``: each view that sees a point counts alike.
        ``"near"``: by the inverse square of its view depth.
        An orthographic camera shows nothing larger from nearby, so there it is as ``"equal"``.
    device : Device, optional
        None: the device of the first view's depth, else the default one of `visible`.
    options : CullOptions, optional
        How the culls decide; None takes the defaults, which are a guard of half a pixel for points.
    progress : bool or function, optional
        As everywhere (`hizvk.progress`); a step is a view.
    **keywords
        Any field of `CullOptions`, in the place of that of `options`.

    Returns
    -------
    PointColours

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    LimitError, OutOfMemoryError
        If the device cannot hold the points or an image.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(90, 160), near=0.1)
    >>> wall, red = np.full(camera.size, 10.0), np.full((90, 160, 3), (200, 0, 0), np.uint8)
    >>> points = hizvk.Points([(0.0, 0.0, -10.0), (0.0, 0.0, -12.0)])
    >>> some = hizvk.Tolerance(abs=0.01)
    >>> seen = hizvk.colour_points(points, [(camera, wall, red)], kind="z", tolerance=some)
    >>> seen.counts.tolist(), seen.bytes().tolist()
    ([1, 0], [[200, 0, 0], [0, 0, 0]])
    """
    points = _arguments.instance("points", points, Points, _A_CLOUD)
    sampling = _arguments.choice("sampling", sampling, words(Sampling))  # type: ignore[assignment]
    weight = _arguments.choice("weight", weight, words(ColourWeight))  # type: ignore[assignment]
    options = cull_options(options, keywords, colour_points)
    if device is not None:
        _arguments.instance("device", device, Device, "a Device or None")
    if not isinstance(views, Iterable) or isinstance(views, (str, bytes, np.ndarray)):
        got = _arguments.describe(views)
        raise TypeError(f"views: expected an iterable of (Camera, depth, image), got {got}")
    maker, cloud = device, None
    count = len(points)
    colours, weights = np.zeros(3 * count, np.float32), np.zeros(count, np.float32)
    counts = np.zeros(count, np.uint32)
    meaning: dict[str, Any] = {
        "kind": kind, "scale": scale, "invalid": invalid, "tolerance": tolerance,
    }  # fmt: skip
    total = len(views) if isinstance(views, Sized) else None
    with Progress(progress, "colouring points", total) as steps:
        for view in views:
            camera, depth, image = _view(view)
            if maker is None:
                maker = maker_of(depth) if isinstance(depth, DepthImage) else default_device()
            if cloud is None:
                cloud = maker.instances(points)
            if isinstance(depth, DepthImage):
                hiz = maker.pyramid(depth)
            else:
                hiz = maker.pyramid(depth, camera, **meaning)
            seen = maker.cull(cloud, camera, hiz, options, _MASK)
            core_add_colours(
                points.positions, seen.mask, camera._inner, image, sampling == "bilinear", weight,
                colours, weights, counts,
            )  # fmt: skip
            steps.step()
    mean = colours.reshape(count, 3)
    np.divide(mean, weights[:, None], out=mean, where=weights[:, None] > 0.0)
    return PointColours(mean, counts, weights)


def _other_shape(image: npt.NDArray[Any], size: tuple[int, int]) -> str:
    """What to do about an image of another shape; empty where that is not clear."""
    if image.shape in (size, (*size, 1)):
        return "; a grey one goes as np.dstack([image] * 3)"
    if image.shape == (*size, 4):
        return "; without the alpha it is image[..., :3]"
    if image.ndim == 3 and image.shape[2] == 3:
        return "; an image of another size goes with camera.resized and a depth image of that size"
    return ""


def _view(
    view: object,
) -> tuple[Camera, npt.ArrayLike | DepthImage, npt.NDArray[Any]]:
    """A checked view; its image is uint8 or float32 in C order."""
    if not isinstance(view, (tuple, list)) or len(view) != 3:
        got = _arguments.describe(view)
        raise TypeError(f"views: expected tuples (Camera, depth, image), got {got}")
    camera, depth, image = view
    _arguments.instance("views", camera, Camera, "a Camera first in each view")
    expected = (*camera.size, 3)
    image = foreign.as_numpy("views", f"uint8 or float images {expected}", image)
    array = np.asarray(image)
    if array.dtype.kind not in "uf" or (array.dtype.kind == "u" and array.dtype.itemsize > 1):
        got = _arguments.describe(image)
        hint = "; pass image / 257.0, which is 0 to 255" if array.dtype == np.uint16 else ""
        raise TypeError(f"views: expected uint8 or float images {expected}, got {got}{hint}")
    if array.shape != expected:
        got = _arguments.describe(image)
        raise ValueError(
            f"views: expected images {expected} (the camera's size), got {got}"
            + _other_shape(array, camera.size)
        )
    wanted = np.uint8 if array.dtype.kind == "u" else np.float32
    return camera, depth, np.require(array, wanted, ["C", "A"])


@_arguments.explained()
def depth_from_points(
    points: Points, camera: Camera, *, radius: float = 0.0, radius_px: float = 0.0
) -> npt.NDArray[np.float32]:
    """A depth image of points: each is a disc that faces the camera, and the nearest one wins.

    The image is as good as the discs stand for the surface.

    - Where they leave holes, pixels stay far, and nothing behind them is hidden.
      A radius of half the points' spacing closes most holes.
      Without a radius each point covers one pixel alone, so an image of more pixels than points
      hides next to nothing.
    - Where they reach beyond the surface, or cut a corner of it, they hide what may be seen there:
      up to the radius beside a silhouette.

    So the promise holds for this image, and not for the surface that the points were measured on.
    Add a `Tolerance` of about the radius for surfaces that are seen at a slant.

    Parameters
    ----------
    points : Points
        The points; those that are not finite make no disc.
    camera : Camera
        Whose image it is.
    radius : float
        Of the discs, in world units: half the distance between neighbours, or a little more.
    radius_px : float
        The least radius in the image, in pixels; 0.5 to 1.5 close the holes between close points.
        With 0 and without `radius`, each point covers the pixel that it lies in.

    Returns
    -------
    (height, width) float32 array
        NDC depth of the kind `Camera.depth_kind`, for `Device.pyramid`; far where no disc is.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Warns
    -----
    HizWarning
        If there is no radius, and hardly any pixel with a depth is beside another.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> camera = hizvk.Camera.look_at((0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(8, 8), near=1.0)
    >>> image = hizvk.depth_from_points(hizvk.Points([(0.5, 0.5, -4.0)]), camera, radius_px=1)
    >>> int((image > 0).sum()), float(image.max())
    (5, 0.25)
    """
    points = _arguments.instance("points", points, Points, _A_CLOUD)
    camera = _arguments.instance("camera", camera, Camera, "a Camera")
    radius = _arguments.number("radius", radius, at_least=0.0)
    radius_px = _arguments.number("radius_px", radius_px, at_least=0.0, at_most=1024.0)
    flat = depth_of_points(points.positions, camera._inner, radius, radius_px)
    image: npt.NDArray[np.float32] = flat.reshape(camera.size)
    if not radius and not radius_px:
        known = image > 0.0 if camera.reversed_z else image < 1.0
        if known.sum() >= _LEAST_KNOWN and is_sparse(known):
            warnings.warn(
                f"radius: each point covers one pixel, and {100.0 * known.mean():.1f} % of the "
                "pixels have a depth, so next to nothing can be hidden; pass radius=, half the "
                "distance between neighbours, or radius_px=1",
                HizWarning,
                stacklevel=3,
            )
    return image
