"""A cull's result as a picture and a table: the view with what was kept and what was culled."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from .. import _arguments
from ..bounds import Boxes, OrientedBoxes, Points, Spheres
from ..view_depth import RayView
from .colours import CLASS_COLOURS, grey, rgb
from .html import document, number
from .lines import draw, outlines
from .png import png
from .shapes import CLASSES, HIDDEN, KEPT, OUTSIDE, chosen, shapes_of

if TYPE_CHECKING:
    import numpy.typing as npt

    from ..bounds import Bounds
    from ..camera import Camera
    from .shapes import Shapes

__all__ = ["MOST_IN_PICTURE", "Seen", "seen_of"]

#: The most instances in a notebook's picture.
MOST_IN_PICTURE: Final = 2000
#: The longer side of that picture, in pixels.
SIDE: Final = 640
#: The codes of `Verdict.OUTSIDE` and `Verdict.OCCLUDED`.
_OUTSIDE, _OCCLUDED = 0, 1


class Seen(NamedTuple):
    """What is shown of a result."""

    title: str
    camera: Camera
    classes: npt.NDArray[np.uint8] | None
    """``(N,)``: `KEPT`, `HIDDEN` or `OUTSIDE`; None if the cull has made nothing that tells."""
    names: tuple[str, ...]
    """The names of the classes."""
    bounds: Bounds | None
    """What was tested, where it is known."""
    depth: npt.NDArray[np.float32]
    """``(height, width)``: view depth, or NDC where the camera does not say view depth."""
    numbers: list[tuple[str, str]]
    """More rows of the table."""
    unit: str
    hints: tuple[str, ...] = ()
    """What looks like a mistake of the caller, in sentences."""

    def counts(self) -> list[int]:
        """How many instances each class has."""
        assert self.classes is not None
        return [int(np.count_nonzero(self.classes == one)) for one in (KEPT, HIDDEN, OUTSIDE)]

    def shapes(self, most: int) -> Shapes:
        """The instances that are drawn, at most `most`."""
        assert self.bounds is not None
        assert self.classes is not None
        return shapes_of(self.bounds, self.classes, chosen(self.classes, most))

    def picture(self) -> bytes:
        """A PNG: depth in greys, and outlines of instances: hidden ones red, kept ones white."""
        return png(self.image(SIDE))

    def image(self, side: int) -> npt.NDArray[np.uint8]:
        """``(tall, wide, 3)``: the picture, with `side` pixels along the longer side."""
        view = RayView(self.camera)
        factor = side / max(view.size)
        tall, wide = (max(round(side * factor), 1) for side in view.size)
        rows = ((np.arange(tall) + 0.5) / factor).astype(np.intp).clip(max=view.size[0] - 1)
        columns = ((np.arange(wide) + 0.5) / factor).astype(np.intp).clip(max=view.size[1] - 1)
        image = grey(self.depth[rows][:, columns])
        if self.bounds is not None and self.classes is not None:
            shapes = self.shapes(MOST_IN_PICTURE)
            lines, owners = outlines(view, shapes)
            classes = shapes.classes[owners]
            for one in (HIDDEN, KEPT):  # kept ones on top
                draw(image, factor * lines[classes == one], rgb(CLASS_COLOURS[one]))
        return image

    def html(self) -> str:
        """The picture above a table of the counts."""
        rows, swatches, notes = [], [], []
        if self.classes is not None:
            for name, count, colour in zip(self.names, self.counts(), CLASS_COLOURS, strict=True):
                if name:
                    rows.append([name, f"{count:,}"])
                    swatches.append(colour)
            if self.bounds is None:
                notes.append(
                    "The bounds are not known any more; .plot(bounds) and .save_html(path, bounds) "
                    "draw them."
                )
            elif len(self.classes) > MOST_IN_PICTURE:
                notes.append(f"{MOST_IN_PICTURE:,} of {len(self.classes):,} instances are drawn.")
        notes += [f"Hint: {hint}" for hint in self.hints]
        rows += [list(row) for row in self.numbers]
        return document(
            self.title, self.picture(), table=((), rows), notes=notes, swatches=swatches
        )


def seen_of(result: Any, bounds: object, unit: str = "m", *, must_know: bool = True) -> Seen:
    """What is shown of a `CullResult`.

    Parameters
    ----------
    result : CullResult
        The result.
    bounds : Bounds, optional
        What was tested; None: those that the instances were uploaded with, where they are known.
    unit : str
        Of world positions.
    must_know : bool
        True: not to know the bounds is an error.

    Raises
    ------
    TypeError, ValueError
        They name the parameter ``bounds``, what it expects and what came.
    """
    count = len(result)
    known = bounds
    if bounds is None:
        remembered = result._question.remembered
        known = None if remembered is None else remembered.bounds()
        if known is None and must_know:
            raise ValueError(
                f"bounds: expected the bounds of the {count} instances that were tested, got None; "
                "the host does not know them any more: they were updated since the upload, or "
                "nothing else holds the object that was uploaded"
            )
    else:
        expected = "Spheres, Boxes, OrientedBoxes or Points"
        if not isinstance(bounds, (Spheres, Boxes, OrientedBoxes, Points)):
            is_path = isinstance(bounds, (str, os.PathLike))
            way = "; a path goes to plot().savefig(path), or to save_html(path)" if is_path else ""
            raise TypeError(f"bounds: expected {expected}, got {_arguments.describe(bounds)}{way}")
        if len(bounds) != count:
            raise ValueError(
                f"bounds: expected those of the {count} instances that were tested, "
                f"got {len(bounds)}"
            )
    classes, names = _classes(result)
    pyramid = result._question.pyramid
    kind = None if RayView(pyramid.camera).is_bare else "z"
    return Seen(
        title=repr(result).strip("<>"),
        camera=pyramid.camera,
        classes=classes,
        names=names,
        bounds=known,  # type: ignore[arg-type]
        depth=pyramid.level(0, kind=kind),
        numbers=_numbers(result, classes),
        unit=unit,
        hints=_hints(result),
    )


def _classes(result: Any) -> tuple[npt.NDArray[np.uint8] | None, tuple[str, ...]]:
    """The class of each instance, by verdicts, or else by the mask, if the cull made them."""
    try:
        verdicts = np.asarray(result.verdicts)
    except ValueError:
        try:
            mask = np.asarray(result.mask)
        except ValueError:
            return _classes_of_parts(result)
        return _of_mask(mask), (CLASSES[KEPT], "culled", "")
    classes = np.full(len(verdicts), KEPT, np.uint8)
    classes[verdicts == _OCCLUDED] = HIDDEN
    classes[verdicts == _OUTSIDE] = OUTSIDE
    return classes, CLASSES


def _classes_of_parts(
    result: Any,
) -> tuple[npt.NDArray[np.uint8] | None, tuple[str, ...]]:
    """The same of a cull that made counts of pixels or a list alone."""
    try:
        pixels = result.pixels
    except ValueError:
        pass
    else:
        may_show = pixels["touched"] > pixels["hidden"]
        return _of_mask(may_show), ("may show a pixel", "shows none", "")
    try:
        listed = np.asarray(result.indices)
        is_whole = result.demand == len(listed)
    except ValueError:  # no list, or a full one
        return None, ("", "", "")
    if not is_whole:
        return None, ("", "", "")
    mask = np.zeros(len(result), np.bool_)
    mask[listed] = True
    return _of_mask(mask), (CLASSES[KEPT], "culled", "")


def _of_mask(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
    return np.where(mask, KEPT, HIDDEN).astype(np.uint8)


def _hints(result: Any) -> tuple[str, ...]:
    try:
        hints: tuple[str, ...] = result.hints()
    except ValueError:  # without verdicts nothing is known
        return ()
    return hints


def _numbers(result: Any, classes: object) -> list[tuple[str, str]]:
    """Further rows of the table."""
    rows = []
    try:
        stats = result.stats
    except ValueError:
        stats = None
    if stats is not None:
        if stats.invalid:
            rows.append(("kept because their bounds are invalid", f"{stats.invalid:,}"))
        if stats.absent:
            rows.append(("absent", f"{stats.absent:,}"))
        if stats.wall_ms is not None:
            rows.append(("the call took", f"{number(stats.wall_ms)} ms"))
    elif classes is None:
        rows.append(("in the list", f"{result.count:,}"))
    height, width = result._question.pyramid.size
    rows.append(("depth image", f"{height} x {width} px"))
    return rows
