"""What a cull answers: a mask, a list, draw arguments and counts, and how each verdict came about.

Nothing is read from the device before it is asked for, and what was read is kept.
Later reads get the same arrays, so they are read-only.
``.copy()`` makes one that can be written to, and DLPack (``torch.from_dlpack``) gets a copy.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from . import _arguments
from ._awaited import Awaited
from ._core import Counts as CoreCounts
from ._core import Culling as CoreCulling
from ._processes import cached_property
from .errors import HizWarning
from .explanation import explanation_of
from .options import MAX_LODS
from .pictured import PicturedResult
from .pixels import pixels_of, visible_fraction
from .stats import CullStats
from .timing import sum_of, table_of

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._on_device import Maker
    from .explanation import Explanation
    from .hints import Question

__all__ = ["ABSENT", "DRAW_DTYPE", "NO_LOD", "CullResult"]

#: The mesh id of an instance that is not there.
ABSENT: Final = 2**32 - 1

#: The level of detail of an instance that a cull did not keep.
NO_LOD: Final = 255

#: One record of Vulkan's ``VkDrawIndexedIndirectCommand`` (``DrawIndexedIndirect`` of WebGPU).
#: It has 20 bytes.
DRAW_DTYPE: np.dtype[np.void] = np.dtype(
    [
        ("index_count", "<u4"),
        ("instance_count", "<u4"),
        ("first_index", "<u4"),
        ("base_vertex", "<i4"),
        ("first_instance", "<u4"),
    ]
)


class SharedArray(np.ndarray):
    """A read-only array that every read returns.

    What is computed from it is a plain array, and an import by DLPack gets a copy.
    Older versions of DLPack cannot say that memory is read-only, so NumPy refuses to export such
    arrays.
    Newer versions can say it, but consumers need not heed it.
    """

    def __dlpack__(self, **options: Any) -> Any:
        """A capsule of a copy that can be written to; ``copy=False`` is refused as by NumPy."""
        if self.flags.writeable or options.get("copy") is False:
            return super().__dlpack__(**options)
        return np.array(self, copy=True, subok=False).__dlpack__(**options)

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        """The result of a ufunc is a plain array."""
        return array[()] if return_scalar or array.ndim == 0 else array.view(np.ndarray)

    def __reduce__(self) -> Any:
        return self.view(np.ndarray).__reduce__()

    def __repr__(self) -> str:
        return repr(self.view(np.ndarray))


def shared(array: npt.NDArray[np.generic]) -> Any:
    """The array as one that every read returns."""
    shared = array.view(SharedArray)
    shared.setflags(write=False)
    return shared


class CullResult(PicturedResult, Awaited[CoreCulling]):
    """The answer of `Device.cull`; reading any part of it waits for the device.

    It is made by `Device.cull` alone, and may be read from any thread.
    Whoever must not wait asks `ready` first, or awaits it.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> device = hizvk.Device()
    >>> crowd = device.instances(hizvk.Spheres(np.zeros((1000, 3)), 0.5))
    >>> camera = hizvk.Camera.look_at(
    ...     (0, 0, 9), (0, 0, 0), fov_y_deg=60, size=(90, 160), near=0.1
    ... )
    >>> pyramid = device.pyramid(np.full(camera.size, 20.0), camera, kind="z")
    >>> seen = device.cull(crowd, camera, pyramid, outputs=["mask"], wait=False)
    >>> while not seen.ready():
    ...     pass  # work of your own
    >>> seen.mask.sum()  # waits for nothing
    np.int64(1000)
    """

    def __init__(self, device: Maker, culling: CoreCulling, question: Question) -> None:
        super().__init__(device, culling)
        self._question = question

    def __len__(self) -> int:
        """The number of instances that were tested."""
        return self._inner.num_instances()

    @cached_property
    def verdicts(self) -> npt.NDArray[np.uint8]:
        """``(N,)`` uint8: the `Verdict` of each instance.

        They are about the bounds that were tested, also if these were updated before the read.
        """
        return shared(self._inner.verdicts())  # type: ignore[no-any-return]

    @cached_property
    def mask(self) -> npt.NDArray[np.bool_]:
        """``(N,)`` bool: True for what is kept; complete, whatever the capacity of the list."""
        return shared(self._inner.mask())  # type: ignore[no-any-return]

    @cached_property
    def indices(self) -> npt.NDArray[np.uint32]:
        """``(count,)`` uint32: the list of kept instances; ascending for ``order="stable"``.

        With ``meshes=`` it is what all bins list, ascending; `bin` has the list of one.
        """
        return shared(self._inner.indices())  # type: ignore[no-any-return]

    @cached_property
    def draws(self) -> npt.NDArray[np.void]:
        """``(D,)`` of `DRAW_DTYPE`: the indirect draw arguments.

        There is one record for each piece of the instances (`Instances.num_pieces`).
        With ``meshes=``, each piece has as many records as it could need, and zeros follow those
        that draw something (`draw_count`).
        Their ``first_instance`` counts in the list on the device, where one bin follows another,
        and not in `indices`.

        Raises
        ------
        ValueError
            If the cull was not asked for draws, and cannot make them of its mask: with ``meshes=``
            it cannot.
        """
        return np.frombuffer(self._inner.draws(), dtype=DRAW_DTYPE)

    @property
    def draw_count(self) -> int:
        """How many records of `draws` draw something, in all pieces together.

        They are the first ones of each piece, unless ``placement="reserved"`` gives each bin a
        fixed place.
        """
        return sum(self._inner.draw_counts())

    @cached_property
    def lods(self) -> npt.NDArray[np.uint8]:
        """``(N,)`` uint8: the level of detail of each instance; `hizvk.NO_LOD` if it is culled.

        Raises
        ------
        ValueError
            If the cull was not given ``meshes=``, was asked for neither draws nor indices, or had
            ``order="any"``.
        """
        return shared(self._inner.lods())  # type: ignore[no-any-return]

    def bin(self, *, mesh: int, lod: int) -> npt.NDArray[np.uint32]:
        """``(count,)`` uint32: what was listed of a mesh at one level of detail.

        It ascends for ``order="stable"``.

        Parameters
        ----------
        mesh : int
            Its place in ``meshes=``.
        lod : int
            The level of detail, from 0 on.

        Raises
        ------
        TypeError, ValueError
            They name the parameter, what it expects and what came; also if the cull was not given
            ``meshes=``, or had ``emit="instances"``.
        """
        mesh = _arguments.integer("mesh", mesh, low=0, high=2**16 - 1)
        lod = _arguments.integer("lod", lod, low=0, high=MAX_LODS - 1)
        return self._inner.bin(mesh, lod)

    @cached_property
    def pixels(self) -> npt.NDArray[np.void]:
        """``(N,)`` of `PIXELS_DTYPE`: in how many pixels each instance is hidden, and may show.

        The counts are complete, whether the cull has kept an instance or not.
        An instance that is outside touches nothing; so does one that was not asked for.
        One that crosses the plane of the eye, or has invalid bounds, counts as ``inside`` and
        ``undecided`` in all pixels of the image.

        Raises
        ------
        ValueError
            If the cull was not asked for pixels.

        Examples
        --------
        A box behind a wall that ends in the middle of the image:

        >>> import numpy as np, hizvk
        >>> device = hizvk.Device()
        >>> box = device.instances(hizvk.Boxes([(-1, -1, -6)], [(1, 1, -5)]))
        >>> camera = hizvk.Camera.look_at(
        ...     (0, 0, 0), (0, 0, -1), fov_y_deg=90, size=(100, 100), near=0.1
        ... )
        >>> wall = np.full(camera.size, np.inf)
        >>> wall[:, :50] = 2.0
        >>> pyramid = device.pyramid(wall, camera, kind="z")
        >>> seen = device.cull(box, camera, pyramid, outputs=["pixels"], coverage="sample")
        >>> seen.pixels[0].item()
        (400, 200, 0, 200, 0)
        >>> seen.visible_fraction(objects_in_depth=False)
        array([0.5])
        """
        return shared(pixels_of(self._inner.pixels()))  # type: ignore[no-any-return]

    def visible_fraction(self, *, objects_in_depth: bool = True) -> npt.NDArray[np.float64]:
        """``(N,)`` float64: the share of each object that can be seen, by its `pixels`.

        Parameters
        ----------
        objects_in_depth : bool
            Whether the objects themselves are in the depth image; `hizvk.visible_fraction` has the
            two formulas.

        Raises
        ------
        TypeError, ValueError
            For another type, and if the cull was not asked for pixels.

        Warns
        -----
        HizWarning
            If no instance has a pixel of its own surface, although nothing hides some of them: then
            the image most likely holds occluders alone.
        """
        pixels = np.asarray(self.pixels)
        fraction = visible_fraction(pixels, objects_in_depth=objects_in_depth)
        through = (pixels["open"] > 0) & (pixels["hidden"] == 0)
        if objects_in_depth and through.any() and not pixels["inside"].any():
            warnings.warn(
                "objects_in_depth: the depth image holds no surface of any instance, so each "
                "fraction is 0; if it holds occluders alone, pass objects_in_depth=False",
                HizWarning,
                stacklevel=2,
            )
        return fraction

    @cached_property
    def _counts(self) -> CoreCounts:
        return self._inner.counts()

    @cached_property
    def _demand_and_written(self) -> tuple[int | None, int]:
        return self._inner.demand_and_written()

    @property
    def count(self) -> int:
        """Instances in the list: `demand`, or fewer if the capacity was too small."""
        return self._demand_and_written[1]

    @property
    def demand(self) -> int:
        """Instances that were kept; more than `count` if the capacity was too small.

        Raises
        ------
        ValueError
            If the list is full and the cull made neither mask nor verdicts, which would tell.
        """
        demand = self._demand_and_written[0]
        if demand is None:
            raise ValueError(
                'outputs: expected "mask" or "verdicts" beside a list that is full, got neither'
            )
        return demand

    @property
    def stats(self) -> CullStats:
        """Counts and milliseconds.

        Raises
        ------
        ValueError
            If the cull was not asked for verdicts.
        """
        counts = self._counts
        counted = self._question.options.statistics
        record_ms, compile_ms, wall_ms, readback_ms = self._inner.timings()
        stages = table_of(self._inner.stage_times() or ())
        return CullStats(
            tested=counts.tested,
            absent=counts.absent,
            outside=counts.outside,
            occluded=counts.occluded,
            kept=counts.visible + counts.unoccluded + counts.invalid,
            unoccluded=counts.unoccluded,
            invalid=counts.invalid,
            tested_groups=counts.tested_groups,
            tested_instances=counts.tested_instances,
            levels=tuple(counts.levels) if counted else None,
            texels_read=counts.texels_read if counted else None,
            record_ms=record_ms,
            compile_ms=compile_ms,
            wall_ms=wall_ms,
            readback_ms=readback_ms,
            gpu_ms=sum_of(stages),
            stages=stages,
            tested_boxes=tuple(counts.tested_boxes),
            accepted_instances=counts.accepted_instances,
        )

    def hints(self) -> tuple[str, ...]:
        """What looks like a mistake, in sentences; empty if nothing does.

        It counts verdicts, so ``outputs`` of the cull have to name ``"verdicts"``, as the default
        does.

        - Everything is outside of the view.
        - The bounds are points of size zero, with ``coverage="sample"``.
        - Depth is far everywhere, or sparse.
        - Everything in view is hidden, or nothing is, and units that differ would be the reason.
          That all is hidden is also said where it may be right; `visible` does not warn of that.

        It is cheap beside a cull, except for an image that hides nothing, which may be read back.

        Raises
        ------
        ValueError
            If the cull was not asked for verdicts, as for `stats`.
        """
        return self._question.hints(self.stats)

    def explain(self, index: int) -> Explanation:
        """Pixel rectangle, level, texels, depths and verdict of one instance.

        The test is run again, on the current bounds.
        `Explanation.stale` says whether these are others than the cull tested.

        Parameters
        ----------
        index : int
            The instance, ``0 <= index < len(self)``.

        Raises
        ------
        TypeError
            If it is no integer.
        IndexError
            If there is no such instance.
        """
        index = _arguments.index("index", index, len(self), none="there are no instances")
        return explanation_of(index, self._inner.explain(index), self._question.pyramid)

    def _summary(self) -> str:
        return f" of {len(self)} instances"
