"""`Sweep`: what many views keep, a bit each; and `SweepInterrupted`, with a part of one."""

from __future__ import annotations

import os
import zipfile
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal, overload

import numpy as np

from .. import _arguments
from .._processes import cached_property
from ..errors import HizError
from ..result import shared

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["Sweep", "SweepInterrupted"]

#: How many bits are set in each byte.
_SET_BITS: Final = np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1).sum(
    axis=1, dtype=np.uint8
)
#: Rows whose bits are counted together, so that no temporary array is as large as all of them.
_ROWS: Final = 256


@dataclass(frozen=True, eq=False, repr=False)
class Sweep:
    """Which of N instances each of V views keeps; made by `sweep` and `visible_sets`.

    With ``groups=``, a row is what any view of a group keeps.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> centers = [(-2.0, 0, -9), (0.0, 0, -9), (2.0, 0, -9)]
    >>> balls = hizvk.Spheres(centers, 0.1)
    >>> post = hizvk.Mesh([(-0.4, -9, -5), (0.4, -9, -5), (0, 9, -5)], [[0, 1, 2]])
    >>> eyes = [
    ...     hizvk.Camera.look_at((x, 0, 0), (x, 0, -1), fov_y_deg=60, size=(90, 90), near=0.1)
    ...     for x in (0.0, -2.0)
    ... ]
    >>> seen = hizvk.sweep(balls, eyes, occluders=post)
    >>> seen.mask(0).tolist(), seen.counts.tolist(), seen.visible_from(1).tolist()
    ([True, False, True], [2, 3], [1])
    >>> seen.union().tolist(), seen.csr()[1].tolist()
    ([True, True, True], [0, 2, 0, 1, 2])
    """

    bits: npt.NDArray[np.uint8]
    """``(V, ceil(N / 8))`` uint8, read-only: bit ``i % 8`` of byte ``i // 8`` is instance i.

    Bit 0 is the lowest: it is ``np.packbits(mask, axis=1, bitorder="little")``.
    """
    num_instances: int
    """N."""
    done: npt.NDArray[np.bool_]
    """Bool for each view that was asked for: whether its row is there; False leaves a row 0."""
    digest: str = field(default="")
    """Names scene, cameras and options; ``resume=`` compares it."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "bits", shared(self.bits))
        object.__setattr__(self, "done", shared(self.done))

    def __len__(self) -> int:
        """V, the number of rows."""
        return len(self.bits)

    def __repr__(self) -> str:
        part = "" if self.is_complete else f", {int(self.done.sum())} of {len(self.done)} done"
        return f"<Sweep: {len(self)} views of {self.num_instances} instances{part}>"

    @property
    def is_complete(self) -> bool:
        """Whether all views are done."""
        return bool(self.done.all())

    def mask(self, view: int) -> npt.NDArray[np.bool_]:
        """``(N,)`` bool: True for what a view keeps.

        Parameters
        ----------
        view : int
            ``0 <= view < V``.

        Raises
        ------
        TypeError, IndexError
            If it is no integer, and if there is no such view.
        """
        row = self.bits[_index("view", view, len(self))]
        return _unpacked(row, self.num_instances)

    @cached_property
    def counts(self) -> npt.NDArray[np.intp]:
        """``(V,)`` int: how many instances each view keeps."""
        counts = np.zeros(len(self), np.intp)
        for start in range(0, len(self), _ROWS):
            rows = self.bits[start : start + _ROWS]
            counts[start : start + _ROWS] = _SET_BITS[rows].sum(axis=1, dtype=np.intp)
        return shared(counts)  # type: ignore[no-any-return]

    @property
    def count(self) -> int:
        """How many pairs of a view and an instance it keeps are there: the sum of `counts`."""
        return int(self.counts.sum())

    def visible_from(self, index: int) -> npt.NDArray[np.intp]:
        """``(K,)`` int, ascending: the views that keep an instance.

        Parameters
        ----------
        index : int
            The instance, ``0 <= index < N``.

        Raises
        ------
        TypeError, IndexError
            If it is no integer, and if there is no such instance.
        """
        index = _index("index", index, self.num_instances)
        return np.flatnonzero(self.bits[:, index // 8] >> np.uint8(index % 8) & np.uint8(1))

    def union(self) -> npt.NDArray[np.bool_]:
        """``(N,)`` bool: True for what at least one view keeps."""
        row = np.zeros(self.bits.shape[1], np.uint8)
        np.bitwise_or.reduce(self.bits, axis=0, out=row)
        return _unpacked(row, self.num_instances)

    @overload
    def csr(
        self, *, scipy: Literal[False] = False
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int32]]: ...
    @overload
    def csr(self, *, scipy: Literal[True]) -> Any: ...

    def csr(self, *, scipy: bool = False) -> Any:
        """The sparse ``(V, N)`` matrix of what each view keeps, row by row.

        Parameters
        ----------
        scipy : bool
            True gives a ``scipy.sparse.csr_array`` of bool; SciPy has to be installed.

        Returns
        -------
        two integer arrays
            ``indptr``, ``(V + 1,)`` int64, and ``indices``, ``(count,)`` int32.
            View v keeps the instances ``indices[indptr[v]:indptr[v + 1]]``, in ascending order.

        Raises
        ------
        TypeError
            If `scipy` is neither True nor False.
        ModuleNotFoundError
            Without SciPy, if it is asked for.
        """
        scipy = _arguments.flag("scipy", scipy)
        indptr = np.zeros(len(self) + 1, np.int64)
        np.cumsum(self.counts, out=indptr[1:])
        indices = np.empty(int(indptr[-1]), np.int32)
        for view in range(len(self)):
            indices[indptr[view] : indptr[view + 1]] = np.flatnonzero(self.mask(view))
        if not scipy:
            return indptr, indices
        try:
            from scipy.sparse import csr_array
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(
                "scipy: expected SciPy to be installed for scipy=True, and it is not; "
                "pip install scipy, or take the arrays of csr()"
            ) from error
        values = np.ones(len(indices), np.bool_)
        return csr_array((values, indices, indptr), shape=(len(self), self.num_instances))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes everything into one file of NumPy's format ``.npz``, compressed.

        Parameters
        ----------
        path : str or path
            The file; it is written beside itself first, so that a kill leaves the old one whole.

        Raises
        ------
        TypeError, OSError
            For what is no path, and what cannot be written.
        """
        place = _path("path", path)
        beside = f"{place}.{os.getpid()}.part"
        try:
            with open(beside, "wb") as file:
                np.savez_compressed(
                    file,
                    bits=np.asarray(self.bits),
                    num_instances=np.int64(self.num_instances),
                    done=np.asarray(self.done),
                    digest=np.str_(self.digest),
                )
            os.replace(beside, place)
        finally:
            if os.path.exists(beside):
                os.unlink(beside)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Sweep:
        """Reads what `save` has written.

        Parameters
        ----------
        path : str or path
            The file.

        Raises
        ------
        TypeError, OSError, ValueError
            For what is no path, what cannot be read, and a file that `save` has not written.
        """
        place = _path("path", path)
        expected = "a file of Sweep.save"
        try:
            with np.load(place, allow_pickle=False) as parts:
                bits, done = parts["bits"], parts["done"]
                count, digest = int(parts["num_instances"]), str(parts["digest"])
        except (KeyError, TypeError, ValueError, EOFError, zipfile.BadZipFile) as error:
            raise ValueError(f"path: expected {expected}, got {place!r} ({error})") from None
        fits = bits.dtype == np.uint8 and bits.ndim == 2 and bits.shape[1] == -(-count // 8)
        if not fits or done.dtype != np.bool_ or done.ndim != 1:
            got = f"bits {bits.shape} {bits.dtype} of {count} instances"
            raise ValueError(f"path: expected {expected}, got {place!r} with {got}")
        return cls(bits, count, done, digest)


class SweepInterrupted(HizError):
    """A block of `hizvk.sweep` failed; its cause is in ``__cause__``.

    Attributes
    ----------
    partial : Sweep
        What is done; ``resume=`` of the same call goes on from there, and `Sweep.save` keeps it.
    why : str
        What happened.
    """

    def __init__(self, partial: Sweep, why: str) -> None:
        self.partial = partial
        self.why = why
        super().__init__(partial, why)

    def __str__(self) -> str:
        done = f"{int(self.partial.done.sum())} of {len(self.partial.done)} views are done"
        return f"{self.why}. {done}: the same call with resume=error.partial goes on from there"


def _unpacked(row: npt.NDArray[np.uint8], count: int) -> npt.NDArray[np.bool_]:
    return np.unpackbits(np.asarray(row), count=count, bitorder="little").view(np.bool_)


def _index(name: str, value: object, count: int) -> int:
    return _arguments.index(name, value, count, none="there are none")


def _path(name: str, value: object) -> str:
    if not isinstance(value, (str, os.PathLike)):
        raise TypeError(f"{name}: expected a path, got {_arguments.describe(value)}")
    return os.fspath(value)
