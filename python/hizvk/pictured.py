"""How results, pyramids, depth images and explanations show themselves: base classes of theirs.

The drawing is in `hizvk.show`, which is loaded when something is drawn.
A notebook calls ``_repr_html_`` or ``_repr_png_`` of the last value of a cell.
"""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any

from . import _arguments
from ._types import DepthKind, Up, words
from .errors import HizError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    import numpy.typing as npt

    from ._types import DepthEnd
    from .bounds import Bounds
    from .mesh import MeshLike
    from .show.explained import Explained
    from .show.levels import Levels
    from .show.views import Views

    #: Reads one level as depth of a kind.
    _Read = Callable[[DepthKind | None], npt.NDArray[np.float32]]

__all__ = [
    "PicturedDepth", "PicturedExplanation", "PicturedPyramid", "PicturedResult", "PicturedViews",
]  # fmt: skip

#: The most instances in a figure and in a page, unless the caller says otherwise.
MOST = 20_000


class _Shown:
    """What a notebook asks for; nothing is shown if the device cannot be read any more."""

    def _picture(self) -> Any:
        """What has the methods ``picture`` and ``html``."""
        raise NotImplementedError

    def _is_drawable(self) -> bool:
        """Whether there is what a picture reads."""
        return True

    def _repr_png_(self) -> bytes | None:
        return self._unless_lost(lambda: self._picture().picture())  # type: ignore[no-any-return]

    def _repr_html_(self) -> str | None:
        return self._unless_lost(lambda: self._picture().html())  # type: ignore[no-any-return]

    def _unless_lost(self, make: Callable[[], Any]) -> Any:
        """What `make` returns, or None, for which a notebook falls back to `repr`."""
        try:
            return make() if self._is_drawable() else None
        except HizError:
            return None


def _levels(thing: Any, kind: DepthKind | None, unit: str, levels: dict[int, _Read]) -> Levels:
    """What is shown of a depth image or of a pyramid; None is view depth, if the camera says it."""
    from .show.levels import Levels
    from .view_depth import RayView

    unit = _arguments.text("unit", unit)
    if kind is None and not RayView(thing.camera).is_bare:
        kind = "z"
    made = [(k, read(kind)) for k, read in levels.items()]
    what = {"z": "view depth z", "distance": "distance along the ray"}.get(kind or "", "NDC depth")
    is_metric = kind in ("z", "distance")
    return Levels(repr(thing).strip("<>"), thing.size, made, what, unit if is_metric else "")


def _of_image(image: Any) -> dict[int, _Read]:
    return {0: lambda kind: image.numpy(kind=kind)}


def _of_pyramid(pyramid: Any, end: DepthEnd | None) -> dict[int, _Read]:
    return {
        k: lambda kind, k=k: pyramid.level(k, end, kind=kind)  # type: ignore[misc]
        for k in (0, *pyramid.levels)
    }


class PicturedDepth(_Shown):
    """`DepthImage` as a picture."""

    def _picture(self) -> Levels:
        return _levels(self, None, "m", _of_image(self))

    def plot(self, *, kind: DepthKind | None = None, unit: str = "m") -> Any:
        """Draws the image with a scale of its depth.

        Parameters
        ----------
        kind : {"z", "distance", "ndc", "reversed_ndc"}, optional
            What is shown; None: view depth, or NDC depth where the camera does not say view depth.
        unit : str
            The unit of world positions, for the scale.

        Returns
        -------
        matplotlib.figure.Figure
            A notebook shows it, and ``savefig(path)`` writes it.

        Raises
        ------
        ImportError
            If matplotlib is not installed; the text has the line that installs it.
        TypeError, ValueError
            They name the parameter, what it expects and what came.
        """
        return _levels(self, kind, unit, _of_image(self)).plot()


class PicturedPyramid(_Shown):
    """`Pyramid` as a picture."""

    def _picture(self) -> Levels:
        return _levels(self, None, "m", _of_pyramid(self, None))

    def plot(
        self, end: DepthEnd | None = None, *, kind: DepthKind | None = None, unit: str = "m"
    ) -> Any:
        """Draws level 0 and all stored levels, side by side with one scale of their depth.

        Parameters
        ----------
        end : {"farthest", "nearest"}, optional
            As for `level`.
        kind, unit : optional
            As for `DepthImage.plot`.

        Returns
        -------
        matplotlib.figure.Figure
            A notebook shows it, and ``savefig(path)`` writes it.

        Raises
        ------
        ImportError
            If matplotlib is not installed; the text has the line that installs it.
        TypeError, ValueError
            They name the parameter, what it expects and what came.

        Examples
        --------
        >>> import numpy as np, hizvk
        >>> device = hizvk.Device()
        >>> camera = hizvk.Camera.look_at(
        ...     (0, 0, 9), (0, 0, 0), fov_y_deg=60, size=(90, 160), near=0.1
        ... )
        >>> hiz = device.pyramid(np.full(camera.size, 20.0), camera, kind="z")
        >>> hiz._repr_html_().count("<tr>")  # what a notebook shows: a line per level
        10
        """
        return _levels(self, kind, unit, _of_pyramid(self, end)).plot()


class PicturedResult(_Shown):
    """`CullResult` as a picture."""

    def _picture(self) -> Any:
        from .show.seen import seen_of

        return seen_of(self, None, must_know=False)

    def plot(
        self,
        bounds: Bounds | None = None,
        *,
        up: Up | None = None,
        most: int = 2000,
        unit: str = "m",
    ) -> Any:
        """Draws what was kept (white) and culled (red): in the view, and from above.

        Parameters
        ----------
        bounds : Spheres, Boxes, OrientedBoxes or Points, optional
            What was tested.
            None: the object that was uploaded, with its arrays as they are now.
            It is known for up to 65,536 instances, and for more while something else holds it; not
            after an update.
        up : {"x", "y", "z", "-x", "-y", "-z"}, optional
            The world axis that points up; None: the one nearest to the camera's own.
        most : int
            At most so many instances are drawn, evenly chosen; the legend has all counts.
        unit : str
            The unit of world positions, for the axes.

        Returns
        -------
        matplotlib.figure.Figure
            A notebook shows it, and ``savefig(path)`` writes it.

        Raises
        ------
        ImportError
            If matplotlib is not installed; the text has the line that installs it.
        TypeError, ValueError
            They name the parameter, what it expects and what came; also if the cull made neither
            mask nor verdicts.
        """
        from .show import seen_plot
        from .show.seen import seen_of

        seen = _with_classes(seen_of(self, bounds, _arguments.text("unit", unit)))
        most = _arguments.integer("most", most, low=1, high=2**31 - 1)
        up_ = seen_plot.up_of(seen.camera) if up is None else _arguments.choice("up", up, words(Up))
        return seen_plot.plot(seen, up_, most)

    def save_html(
        self,
        path: str | PathLike[str],
        bounds: Bounds | None = None,
        *,
        occluders: MeshLike | Sequence[MeshLike] | None = None,
        up: Up | None = None,
        most: int = MOST,
        unit: str = "m",
        title: str | None = None,
    ) -> None:
        """Writes one HTML page that turns and zooms in a browser, without a network.

        It shows kept (white) and culled (red) instances, the view volume, and the numbers.

        Parameters
        ----------
        path : str or path
            The file; what is there is replaced.
        bounds : Spheres, Boxes, OrientedBoxes or Points, optional
            As for `plot`.
        occluders : Mesh or list of them, also of another library; optional
            What hides things, to be shown as triangles; at most 40,000, the largest ones.
        up : {"x", "y", "z", "-x", "-y", "-z"}, optional
            As for `plot`.
        most : int
            At most so many instances are in the page, evenly chosen; the page says how many.
            One takes 4 to 64 bytes of it.
        unit : str
            The unit of world positions.
        title : str, optional
            The heading; None: the text of the result.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came; also if the cull made neither
            mask nor verdicts.
        OSError
            If the file cannot be written.

        Examples
        --------
        >>> import numpy as np, hizvk, tempfile, pathlib
        >>> device = hizvk.Device()
        >>> balls = hizvk.Spheres([(0, 0, -5), (0, 0, -30)], 0.5)
        >>> camera = hizvk.Camera.look_at(
        ...     (0, 0, 0), (0, 0, -1), fov_y_deg=60, size=(90, 160), near=0.1
        ... )
        >>> wall = device.pyramid(np.full(camera.size, 20.0), camera, kind="z")
        >>> seen = device.cull(device.instances(balls), camera, wall)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     page = pathlib.Path(folder, "seen.html")
        ...     seen.save_html(page)
        ...     page.read_text(encoding="utf-8").startswith("<!doctype html>")
        True
        """
        from pathlib import Path

        from .show.web import page

        if not isinstance(path, (str, PathLike)):
            raise TypeError(f"path: expected a path, got {_arguments.describe(path)}")
        text = page(self, bounds, occluders=occluders, up=up, most=most, unit=unit, title=title)
        Path(path).write_text(text, encoding="utf-8")


def _with_classes(seen: Any) -> Any:
    if seen.classes is None:
        raise ValueError(
            'outputs: expected "mask" or "verdicts" of a cull that is drawn, got neither'
        )
    return seen


class PicturedViews(_Shown):
    """`ViewsResult` as a picture: its views in rows, and a table of their counts."""

    def _picture(self) -> Views:
        from .show.views import views_of

        return views_of(self, None, must_know=False)

    def plot(self, bounds: Bounds | None = None, *, most: int = 500, unit: str = "m") -> Any:
        """Draws each view with what it kept (white) and culled (red); of many views, twelve.

        ``result[v].plot()`` draws one view, and the scene from above.

        Parameters
        ----------
        bounds : Spheres, Boxes, OrientedBoxes or Points, optional
            As for `CullResult.plot`.
        most : int
            At most so many instances are drawn in each view, evenly chosen.
        unit : str
            The unit of world positions.

        Returns
        -------
        matplotlib.figure.Figure
            A notebook shows it, and ``savefig(path)`` writes it.

        Raises
        ------
        ImportError
            If matplotlib is not installed; the text has the line that installs it.
        TypeError, ValueError
            They name the parameter, what it expects and what came; also if the cull made neither
            masks nor verdicts.
        """
        from .show.views import views_of

        views = views_of(self, bounds, _arguments.text("unit", unit))
        _with_classes(views.seen[0][1])
        return views.plot(_arguments.integer("most", most, low=1, high=2**31 - 1))


class PicturedExplanation(_Shown):
    """`Explanation` as a picture; its pyramid is known to the explanation that a cull made."""

    def _picture(self) -> Explained:
        return self._explained("m")

    def _explained(self, unit: str) -> Explained:
        raise NotImplementedError

    def plot(self, *, unit: str = "m") -> Any:
        """Draws the test: pixels, texels and their depths, and the instance's nearest depth.

        Parameters
        ----------
        unit : str
            The unit of world positions, for the axes.

        Returns
        -------
        matplotlib.figure.Figure
            A notebook shows it, and ``savefig(path)`` writes it.

        Raises
        ------
        ImportError
            If matplotlib is not installed; the text has the line that installs it.
        TypeError
            For a `unit` that is no text.
        ValueError
            If the explanation was copied or pickled, and has lost its pyramid.
        """
        return self._explained(_arguments.text("unit", unit)).plot()
