"""What a cull is asked: how it decides (`CullOptions`) and what it makes (`Outputs`).

An option is a field here, with its default, its check and its paragraph of documentation.
The keywords of `Device.cull` and `visible` are these fields, and the compiled module takes the two
objects whole (``crates/hiz_py/src/options.rs``).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TypedDict, TypeVar

import numpy as np

from . import _arguments
from ._types import Coverage, Emit, Fit, Order, Output, Placement, words
from .errors import LimitError
from .light import DirectionalLight, light_or_none
from .lod import LodRule, lod_rule

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

__all__ = [
    "Coverage",
    "CullKeywords",
    "CullOptions",
    "DrawTemplate",
    "Emit",
    "Fit",
    "MeshLods",
    "OptionKeywords",
    "Order",
    "Output",
    "Outputs",
    "Placement",
]

#: How many texels per side a test may read of one level.
FOOTPRINTS: Final = (1, 2, 4, 8)
#: What a cull can make, by name.
OUTPUTS: Final = words(Output)
_LARGEST_U32: Final = 2**32 - 1

_Given = TypeVar("_Given", "CullOptions", "Outputs")


def _by(check: Callable[..., Any], **limits: Any) -> dict[str, Any]:
    """The metadata of a field that `check` takes, with the field's name, when an object is made."""
    return {"check": partial(check, **limits)}


def _check_fields(made: Any) -> None:
    """Puts every field of a new object through its check."""
    for one in fields(made):
        value = one.metadata["check"](one.name, getattr(made, one.name))
        object.__setattr__(made, one.name, value)


def _replaced(given: _Given, values: Mapping[str, Any]) -> _Given:
    """`dataclasses.replace`, but only the new values are checked.

    Each cull with keywords comes here, and a cull may take less than a millisecond.
    """
    made = object.__new__(type(given))
    made.__dict__.update(given.__dict__)
    for name, value in values.items():
        made.__dict__[name] = given.__dataclass_fields__[name].metadata["check"](name, value)
    return made


def _guard(name: str, value: object) -> float | None:
    if value is None:
        return None
    guard = _arguments.number(name, value, at_least=0.0, at_most=16.0)
    if guard * 256.0 != round(guard * 256.0):
        raise ValueError(f"{name}: expected a multiple of 1/256, got {guard}")
    return guard


def _footprint(name: str, value: object) -> int:
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if whole and value not in FOOTPRINTS:
        raise ValueError(f"{name}: expected one of 1, 2, 4, 8, got {value}")
    return _arguments.integer(name, value, low=1, high=8)


def _flag_or_none(name: str, value: object) -> bool | None:
    if value is not None and not isinstance(value, (bool, np.bool_)):
        got = _arguments.describe(value)
        raise TypeError(f"{name}: expected True, False or None, got {got}")
    return None if value is None else bool(value)


def _hierarchy(name: str, value: object) -> bool | int | None:
    if value is None or isinstance(value, (bool, np.bool_)):
        return None if value is None else bool(value)
    if not isinstance(value, (int, np.integer)):
        got = _arguments.describe(value)
        raise TypeError(f"{name}: expected True, False, None or a number of tiers, got {got}")
    return _arguments.integer(name, value, low=0, high=3)


def _capacity(name: str, value: object) -> int | None:
    return None if value is None else _arguments.integer(name, value, low=0, high=_LARGEST_U32)


def _pixel_budget(name: str, value: object) -> int | None:
    if value is None:
        return None
    return _arguments.integer(name, value, low=1, high=_LARGEST_U32)


def _draw(name: str, value: object) -> DrawTemplate | None:
    if value is None:
        return None
    return _arguments.instance(name, value, DrawTemplate, "a DrawTemplate or None")


def _meshes(name: str, value: object) -> tuple[MeshLods, ...] | None:
    if value is None:
        return None
    if isinstance(value, (str, MeshLods)) or not isinstance(value, Sequence):
        got = _arguments.describe(value)
        raise TypeError(f"{name}: expected a sequence of MeshLods or None, got {got}")
    if not value:
        raise ValueError(f"{name}: expected at least one MeshLods, got none")
    for mesh in value:
        _arguments.instance(name, mesh, MeshLods, "a MeshLods for each mesh")
    return tuple(value)


@_arguments.named
@dataclass(frozen=True)
class DrawTemplate:
    """The numbers of a draw of the kept instances that a cull does not find out.

    Parameters
    ----------
    index_count : int
        Indices of the mesh.
    first_index : int
        Where they start in the index buffer.
    base_vertex : int
        Added to each index; may be negative.
    first_instance : int
        The first instance id of the draw.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    """

    index_count: int = field(metadata=_by(_arguments.integer, low=0, high=_LARGEST_U32))
    first_index: int = field(default=0, metadata=_by(_arguments.integer, low=0, high=_LARGEST_U32))
    base_vertex: int = field(
        default=0, metadata=_by(_arguments.integer, low=-(2**31), high=2**31 - 1)
    )
    first_instance: int = field(
        default=0, metadata=_by(_arguments.integer, low=0, high=_LARGEST_U32)
    )

    def __post_init__(self) -> None:
        _check_fields(self)


#: The most levels of detail of a mesh.
MAX_LODS: Final = 8


@_arguments.named
@dataclass(frozen=True, init=False)
class MeshLods:
    """The levels of detail (LODs) of one mesh, from the finest to the coarsest.

    Parameters
    ----------
    draws : sequence of DrawTemplate
        How each level is drawn; 1 to 8 of them, and the first is the full mesh.
        Their ``first_instance`` is 0, because the cull writes it.
    errors : sequence of float, optional
        How far the surface of each level is from that of the full mesh at scale 1, at most, in
        world units.
        None: 0 for each.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    LimitError
        For more than 8 levels.

    Examples
    --------
    >>> import hizvk
    >>> fine, coarse = hizvk.DrawTemplate(3600), hizvk.DrawTemplate(300, first_index=3600)
    >>> tree = hizvk.MeshLods([fine, coarse], errors=[0.0, 0.02])
    >>> len(tree.draws)
    2
    """

    draws: tuple[DrawTemplate, ...]
    errors: tuple[float, ...]

    def __init__(
        self,
        draws: Sequence[DrawTemplate],
        errors: Sequence[float] | npt.NDArray[np.floating] | None = None,
    ) -> None:
        if isinstance(draws, str) or not isinstance(draws, Sequence):
            got = _arguments.describe(draws)
            raise TypeError(f"draws: expected a sequence of DrawTemplate, got {got}")
        for draw in draws:
            _arguments.instance("draws", draw, DrawTemplate, "a DrawTemplate for each level")
            if draw.first_instance != 0:
                got = f"{draw.first_instance}"
                raise ValueError(
                    f"draws: expected first_instance 0, which the cull sets, got {got}"
                )
        if not draws:
            raise ValueError(f"draws: expected 1 to {MAX_LODS} levels of detail, got none")
        if len(draws) > MAX_LODS:
            raise LimitError("draws", len(draws), MAX_LODS)
        if errors is None:
            errors = (0.0,) * len(draws)
        if isinstance(errors, str) or not isinstance(errors, (Sequence, np.ndarray)):
            got = _arguments.describe(errors)
            raise TypeError(f"errors: expected a sequence of numbers or None, got {got}")
        if len(errors) != len(draws):
            expected = f"one for each of {len(draws)} levels of detail"
            raise ValueError(f"errors: expected {expected}, got {len(errors)}")
        checked = (
            _arguments.number("errors", error, at_least=0.0, at_most=2.0**59) for error in errors
        )
        object.__setattr__(self, "draws", tuple(draws))
        object.__setattr__(self, "errors", tuple(checked))

    def _raw(self) -> list[tuple[int, int, int, int, float]]:
        """The levels as the compiled module takes them."""
        return [
            (draw.index_count, draw.first_index, draw.base_vertex, draw.first_instance, error)
            for draw, error in zip(self.draws, self.errors, strict=True)
        ]


@_arguments.named
@dataclass(frozen=True, kw_only=True)
class CullOptions:
    """How a cull decides.

    Every combination keeps what could be seen in the depth image.
    The options trade time for how much that is hidden is kept, and say how exact the depth is.

    Parameters
    ----------
    order : "stable" or "any"
        The order of the list of kept instances.
        ``"stable"``: ascending.
        ``"any"``: as the device finishes, which is faster.
    coverage : "area" or "sample"
        ``"area"``: visible is what meets any part of a pixel.
        ``"sample"``: visible is what covers the centre of a pixel.
        The latter is right for an image with one sample per pixel, the same viewport and no jitter.

        A plain depth image speaks for the centres of its pixels in either case.
        Multisampling needs ``"area"`` and all samples (`Device.pyramid`).
        Jitter needs ``"area"`` and conservative depth (`Device.render_depth`).
    guard_px : float, optional
        Pixels by which bounds grow in the image: a multiple of 1/256, at most 16.
        None: 0 for ``coverage="area"``, 1/64 for ``coverage="sample"``.
        Of `Points`, None is 1/2 and 1: the pixels of the four centres around a point are read.
    depth_slack : float
        Relative error of the depth image, 0 to 0.5.
        The default, 2^-23, is one ulp: it covers depth that was rounded to float32.
    depth_slack_abs : float
        Absolute error of the depth image in NDC depth, 0 to 0.5, in addition to `depth_slack`.
        An orthographic camera needs it, because a rasteriser errs there by the same amount near and
        far.
        Any value above 0 counts 2^-23 more.
    transform_slack : float
        For depth images of a renderer that transforms in float32: how many ulps its matrix product
        may have cost, 0 to 1e6; about 4 for such a renderer.
    footprint : 1, 2, 4 or 8
        How many texels per side a test may read of one level.
        More texels mean a finer level, so less is kept and more is read.
        1 is the finest single texel that encloses the bounds' rectangle; with a descent from there
        the answer is that of 2 and a descent.
    descent : int
        How many texels of finer levels a test may read where the footprint cannot decide, 0 to
        65536.
        0 means none.
        With enough of them the answer is that of a test at full resolution.

        On processors (lavapipe, SwiftShader) a test reads at most 7,551 of them, with
        ``fit="volume"`` 943, with a pyramid of both ends 3,775 and 839, and more are kept where
        these do not suffice.
        lavapipe ends longer loops and loses what they had left to do (docs/accuracy.md, "Loops that
        a driver ends").
    fit : "rectangle" or "volume"
        What stands for the bounds.
        ``"rectangle"``: the rectangle around their projection, at their nearest depth.
        ``"volume"``: where the rectangle cannot decide, the outline of the bounds, and in each
        texel their own depth there.

        The latter keeps less and computes more; with a descent it goes down to single pixels.
    hierarchy : bool or int, optional
        Whether groups of 64 neighbouring instances are tested first.
        Only instances of the groups that remain are then tested one by one.
        None: where there are enough instances for it to pay.

        A number says how many tiers of boxes are tested, 0..3; True is 1, the boxes of groups.
        With 2, boxes around 64 groups are tested before them, and with 3 boxes around 64 of these.
        Where there are too few instances for so many tiers, there are fewer.

        With a pyramid of both ends, a box that surely shows keeps all that it holds, untested.
        What is kept differs by next to nothing, because the test of a group may read other texels.
        `CullResult.stats` says how many tests were spent.
    statistics : bool
        Whether to count the tests on each level and the texels that they read; this is slower.
    lod : LodByError, LodByDistance or LodBySize, optional
        Which level of detail of its mesh a kept instance is drawn with.
        It says nothing without `Outputs.meshes`, and as a keyword of a cull it is refused then.
        None: the full mesh, LOD 0.
    shadow : DirectionalLight, optional
        The instances are shadow casters of this light, and kept is what may shadow something that
        the camera sees.
        The pyramid is then one of ``depths="receivers"``, and ``fit="volume"`` is refused.
        At least 256 texels of finer levels may be read, whatever `descent` says.
        None: kept is what the camera may see.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import hizvk
    >>> exact = hizvk.CullOptions(footprint=4, descent=4096, fit="volume")
    >>> exact.footprint, exact.coverage
    (4, 'area')
    """

    order: Order = field(default="stable", metadata=_by(_arguments.choice, choices=words(Order)))
    coverage: Coverage = field(
        default="area", metadata=_by(_arguments.choice, choices=words(Coverage))
    )
    guard_px: float | None = field(default=None, metadata=_by(_guard))
    depth_slack: float = field(
        default=2.0**-23, metadata=_by(_arguments.number, at_least=0.0, at_most=0.5)
    )
    depth_slack_abs: float = field(
        default=0.0, metadata=_by(_arguments.number, at_least=0.0, at_most=0.5)
    )
    transform_slack: float = field(
        default=0.0, metadata=_by(_arguments.number, at_least=0.0, at_most=1e6)
    )
    footprint: int = field(default=2, metadata=_by(_footprint))
    descent: int = field(default=0, metadata=_by(_arguments.integer, low=0, high=65536))
    fit: Fit = field(default="rectangle", metadata=_by(_arguments.choice, choices=words(Fit)))
    hierarchy: bool | int | None = field(default=None, metadata=_by(_hierarchy))
    statistics: bool = field(default=False, metadata=_by(_arguments.flag))
    lod: LodRule | None = field(default=None, metadata=_by(lod_rule))
    shadow: DirectionalLight | None = field(default=None, metadata=_by(light_or_none))

    def __post_init__(self) -> None:
        _check_fields(self)


@_arguments.named
@dataclass(frozen=True, kw_only=True)
class Outputs:
    """What a cull makes.

    What is not asked for is neither computed nor stored.
    A `CullResult` that is asked for it later raises a `ValueError`, except for `indices` and
    `draws`: these can be made from a mask.

    Parameters
    ----------
    mask : bool
        A bit for each instance: kept or not.
    verdicts : bool
        The `Verdict` of each instance, and the counts of `CullResult.stats`.
    indices : bool, optional
        The list of the kept instances.
        None: with ``order="any"`` during the cull; otherwise when the list is first read.
    draws : bool, optional
        The indirect draw arguments.
        None: as for `indices`.
    pixels : bool
        In how many pixels each instance is hidden, and in how many it may show
        (`CullResult.pixels`).
        A pass of its own looks at all instances, down to single pixels.
    pixel_budget : int, optional
        How many rows of four texels that pass may read for each instance, 1 to 2^32 - 1.
        The pixels that are left count as ``inside`` and ``undecided``.
        None: as many as it takes.
    capacity : int, optional
        The most instances in the list, 0 to 2^32 - 1; None leaves room for all.
        Too small a capacity shows as ``count < demand``; mask and verdicts stay complete.
    draw : DrawTemplate, optional
        The other numbers of the draw arguments; None leaves them 0.
    meshes : sequence of MeshLods, optional
        The meshes that the ``mesh_ids`` of the instances name.
        What is kept is then sorted by mesh and level of detail (LOD), with a draw for each.
        None: one list with one draw.
    emit : "bins" or "instances"
        What a draw is, beside `meshes`.
        Without these, as a keyword of a cull, it is refused, and so is `placement`.
        ``"bins"``: all that is kept of one mesh at one LOD.
        ``"instances"``: one kept instance; the draws ascend by index.
    placement : "packed" or "reserved"
        Where the bins lie in the list.
        ``"packed"``: one behind the other; the draws of bins without instances are left out.
        ``"reserved"``: each has room for all instances of its mesh, and its draw has a fixed place.
        A cull with ``order="any"`` has bins for one mesh alone, and needs ``"reserved"``.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.

    Examples
    --------
    >>> import hizvk
    >>> hizvk.Outputs(verdicts=False, capacity=1000, draw=hizvk.DrawTemplate(36)).capacity
    1000
    """

    mask: bool = field(default=True, metadata=_by(_arguments.flag))
    verdicts: bool = field(default=True, metadata=_by(_arguments.flag))
    indices: bool | None = field(default=None, metadata=_by(_flag_or_none))
    draws: bool | None = field(default=None, metadata=_by(_flag_or_none))
    pixels: bool = field(default=False, metadata=_by(_arguments.flag))
    pixel_budget: int | None = field(default=None, metadata=_by(_pixel_budget))
    capacity: int | None = field(default=None, metadata=_by(_capacity))
    draw: DrawTemplate | None = field(default=None, metadata=_by(_draw))
    meshes: Sequence[MeshLods] | None = field(default=None, metadata=_by(_meshes))
    emit: Emit = field(default="bins", metadata=_by(_arguments.choice, choices=words(Emit)))
    placement: Placement = field(
        default="packed", metadata=_by(_arguments.choice, choices=words(Placement))
    )

    def __post_init__(self) -> None:
        _check_fields(self)


def _outputs_of(names: object) -> Outputs:
    """The outputs of these names, and no others."""
    if type(names) is list and len(names) == 1 and type(names[0]) is str and names[0] in _SINGLE:
        return _SINGLE[names[0]]
    if isinstance(names, str) or not isinstance(names, Collection):
        expected = f"None or a collection of {', '.join(map(repr, OUTPUTS))}, or an Outputs"
        hint = f'; pass ["{names}"]' if names in OUTPUTS else ""
        raise TypeError(f"outputs: expected {expected}, got {_arguments.describe(names)}{hint}")
    asked = frozenset(_arguments.choice("outputs", name, OUTPUTS) for name in names)
    made = _NAMED.get(asked)
    if made is None:
        made = _NAMED[asked] = _replaced(_OUTPUTS, {name: name in asked for name in OUTPUTS})
    return made


class OptionKeywords(TypedDict, total=False):
    """The fields of `CullOptions` as keywords, for type checkers."""

    order: Order
    coverage: Coverage
    guard_px: float | None
    depth_slack: float
    depth_slack_abs: float
    transform_slack: float
    footprint: int
    descent: int
    fit: Fit
    hierarchy: bool | int | None
    statistics: bool
    lod: LodRule | None
    shadow: DirectionalLight | None


class CullKeywords(OptionKeywords, total=False):
    """The keywords of `Device.cull`: those of `CullOptions`, and these of `Outputs`."""

    pixel_budget: int | None
    capacity: int | None
    draw: DrawTemplate | None
    meshes: Sequence[MeshLods] | None
    emit: Emit
    placement: Placement


_OPTIONS: Final = CullOptions()
_OUTPUTS: Final = Outputs()
#: The outputs of each set of names; there are 32 of them.
_NAMED: Final[dict[frozenset[str], Outputs]] = {}
#: Those of one name alone, as most culls ask for them: found in a tenth of the time.
_SINGLE: Final = {name: _outputs_of((name,)) for name in OUTPUTS}


def cull_options(
    options: object,
    keywords: Mapping[str, Any],
    of: Callable[..., object],
    *,
    lists_levels: bool = False,
) -> CullOptions:
    """The options (None: the defaults), with `keywords` in the place of their fields.

    `of` is the function that takes both, for the error of an unknown keyword.
    Where it does not list by level of detail, the keyword ``lod`` would do nothing, so it is
    refused; options that several calls share may have one.
    """
    chosen = _OPTIONS
    if options is not None:
        chosen = _arguments.instance("options", options, CullOptions, "a CullOptions or None")
    if not keywords:
        return chosen
    _arguments.refuse_unknown(keywords, OptionKeywords.__annotations__, of)
    made = _replaced(chosen, keywords)
    if not lists_levels and keywords.get("lod") is not None:
        raise ValueError(
            f"lod: expected None, because {of.__name__} lists nothing by level of detail, got "
            f"{_arguments.describe(keywords['lod'])}; Device.cull(..., meshes=, lod=) does"
        )
    return made


def cull_request(
    options: object, outputs: object, keywords: Mapping[str, Any], of: Callable[..., object]
) -> tuple[CullOptions, Outputs]:
    """Both objects of a cull, from what `of` was given, such as `Device.cull`."""
    if keywords:
        _arguments.refuse_unknown(keywords, CullKeywords.__annotations__, of)
    if outputs is None:
        outputs = _OUTPUTS
    made = outputs if isinstance(outputs, Outputs) else _outputs_of(outputs)
    if options is None and not keywords:
        return _OPTIONS, made  # as most culls are asked
    names = ("pixel_budget", "capacity", "draw", "meshes", "emit", "placement")
    of_outputs = {name: keywords[name] for name in names if name in keywords}
    of_options = {name: keywords[name] for name in keywords if name not in of_outputs}
    chosen = cull_options(options, of_options, of, lists_levels=True)
    if of_outputs:
        made = _replaced(made, of_outputs)
    if keywords:
        _refuse_silent(keywords, made)
    return chosen, made


def _refuse_silent(keywords: Mapping[str, Any], outputs: Outputs) -> None:
    """A `ValueError` for a keyword that does nothing beside these outputs."""
    if keywords.get("pixel_budget") is not None and not outputs.pixels:
        raise ValueError(
            'pixel_budget: expected "pixels" among the outputs beside it, because it is the budget '
            f"of their pass, got {keywords['pixel_budget']} without; pass outputs=[..., "
            '"pixels"], or leave it out'
        )
    if outputs.meshes is not None:
        return
    for name, silent in (("lod", None), ("emit", _OUTPUTS.emit), ("placement", _OUTPUTS.placement)):
        given = keywords.get(name, silent)
        if given != silent:
            raise ValueError(
                f"{name}: expected meshes= beside it, because one list has neither meshes nor "
                f"levels of detail, got {_arguments.describe(given)} without meshes; pass "
                "meshes=[...], a MeshLods for each mesh, or leave it out"
            )
