"""`sweep`: the visibility of N instances from V cameras, in blocks that any executor may run."""

from __future__ import annotations

from concurrent.futures import BrokenExecutor
from contextlib import closing
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _arguments
from .._types import FaceCull, words
from ..bounds import as_arrays
from ..mesh import A_MESH, meshes_of
from ..options import cull_options
from ..progress import Progress
from . import arguments, blocks
from .result import Sweep, SweepInterrupted
from .scene import SceneData, digest_of, words_of
from .workers import Block, Task, offered

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence
    from concurrent.futures import Executor
    from typing import Unpack

    import numpy.typing as npt

    from .._arguments import Size
    from .._types import DepthKind, Rasteriser
    from ..bounds import Bounds
    from ..camera import Camera
    from ..mesh import MeshLike
    from ..options import CullOptions, OptionKeywords
    from ..progress import ProgressLike
    from ..tolerance import Tolerance
    from .workers import Answer

__all__ = ["sweep"]


def sweep(
    bounds: Bounds,
    cameras: Sequence[Camera],
    *,
    occluders: MeshLike | Sequence[MeshLike] | None = None,
    depths: Sequence[npt.ArrayLike] | Callable[[int], npt.ArrayLike] | None = None,
    kind: DepthKind | None = None,
    scale: float = 1.0,
    invalid: Collection[float] | None = None,
    tolerance: Tolerance | None = None,
    cull: FaceCull = "none",
    conservative: bool = False,
    size: Size | None = None,
    rasteriser: Rasteriser = "host",
    groups: npt.ArrayLike | None = None,
    executor: Executor | int | None = None,
    block: int | None = None,
    adapter: str | int | None = None,
    resume: Sweep | None = None,
    progress: ProgressLike = None,
    options: CullOptions | None = None,
    **keywords: Unpack[OptionKeywords],
) -> Sweep:
    """Tests N instances from V cameras, on this machine or on many.

    Each camera has depth of its own, so each view keeps the promise of `Device.cull`.
    The instances are uploaded once per process, and a view costs one depth image, its pyramid and
    one cull.

    **Executors.**
    The sweep is cut into blocks of views, and `executor` runs them:

    - None: this thread.
    - A number: so many processes of this machine.
      If one dies, new ones run the blocks that are left.
      A script needs ``if __name__ == "__main__":`` around its calls, as for every pool of
      processes.
    - A ``concurrent.futures.Executor``: threads, processes (start them with ``spawn``), or
      ``Client(...).get_executor()`` of Dask on a cluster; also the ``Client`` itself.
      A worker that dies costs time alone where the engine runs its blocks again, as Dask does.
      A pool of processes breaks instead: a `SweepInterrupted` then has what is done, and
      ``resume=`` goes on from there.

    Each process opens one device, at its first block, and asks for the scene once: it returns that
    block, and gets it back with bounds and occluders.
    On this machine it reads them from a file.
    Elsewhere they come with the block, or from another worker if `executor` is a Dask ``Client``.

    **The same bits.**
    They do not depend on executor, block size, or the order in which blocks are done.
    They may differ between drivers, which may keep different hidden instances; what can be seen is
    kept on each.

    Parameters
    ----------
    bounds : Spheres, Boxes, OrientedBoxes or Points
        The N instances.
    cameras : sequence of Camera
        The V views.
    occluders : Mesh, a mesh of trimesh, Open3D or PyVista, or a sequence of meshes
        What hides: every view renders its depth.
    depths : sequence of V arrays, or function
        Instead of `occluders`: the depth image of each view.
        A function takes the number of a view and returns its array.
        It runs where the block runs, so it can load a file there.
        Other processes need one of a module that they can import, no lambda.
    kind, scale, invalid, tolerance
        What the numbers of `depths` are, as in `Device.pyramid`.
    cull : "none", "back" or "front"
        Which faces of the occluders are left out, as in `Device.occluders`.
    conservative : bool
        True renders conservative depth, as in `Device.render_depth`: then what is culled is hidden
        from every ray of the view, and not only at the centres of its pixels.
    size : (height, width), optional
        The size of rendered depth; None: that of each camera.
    rasteriser : "host", "device" or "auto"
        What renders plain depth.
        ``"host"`` draws the same depth on every machine.
    groups : (V,) integer array, optional
        Views with the same number share a row of the result: what any of them keeps.
        Numbers start at 0.
        None: each view has its row.
    executor : concurrent.futures.Executor, int, or Dask Client; optional
        Who runs the blocks.
    block : int, optional
        Views per block; None: 1 to 16, so that there are 16 blocks if that many views are there.
    adapter : str or int, optional
        Which adapter every process opens, as in `Device`.
        None: the variable ``HIZVK_ADAPTER`` of its environment, else its best.
    resume : Sweep, optional
        What an interrupted sweep of the same arguments has done (`SweepInterrupted.partial`).
        Views that are done are not run again.
        The arrays of `depths` are not compared.
    progress : None, bool or function
        What shows how far it is: see `hizvk.progress`.
        A function is called after each block with the number of views done, and V.
    options : CullOptions, optional
        How the culls decide; None takes the defaults.
    **keywords
        Any field of `CullOptions`, in the place of that of `options`; not `shadow`.

    Returns
    -------
    Sweep
        The bits, ``(V, ceil(N / 8))``.

    Raises
    ------
    TypeError, ValueError
        They name the parameter, what it expects and what came.
    SweepInterrupted
        If a block failed: a worker died, its device refused, a function of `depths` raised.

    Examples
    --------
    >>> import numpy as np, hizvk
    >>> boxes = hizvk.Boxes([(-1.0, 0, -9), (-1.0, 0, 8)], [(1.0, 2, -8), (1.0, 2, 9)])
    >>> wall = hizvk.Mesh([(-9, -9, -5), (9, -9, -5), (0, 9, -5)], [[0, 1, 2]])
    >>> seen = hizvk.sweep(boxes, hizvk.cube((0, 1, 0), size=64, near=0.1), occluders=wall)
    >>> seen, seen.union().tolist()
    (<Sweep: 6 views of 2 instances>, [False, True])
    """
    chosen = cull_options(options, keywords, sweep)
    arguments.refuse_uploaded(bounds, occluders)
    as_arrays("bounds", bounds)
    views = arguments.cameras_of(cameras)
    if (occluders is None) == (depths is None):
        got = "neither" if occluders is None else "both"
        raise TypeError(f"occluders, depths: expected exactly one of them, got {got}")
    if depths is not None:
        depths = arguments.depths_of(depths, len(views))
    meaning = arguments.meaning_of(views, depths, kind, scale, invalid, tolerance)
    render = arguments.render_of(depths is None, conservative, size, rasteriser)
    faces: Any = _arguments.choice("cull", cull, words(FaceCull))
    rows = arguments.groups_of(groups, len(views))
    runner, engine = arguments.executor_of(executor)
    arguments.refuse_unsendable(depths, runner)
    per_block = arguments.block_of(block, len(views))
    if chosen.shadow is not None:
        got = _arguments.describe(chosen.shadow)
        raise ValueError(f"shadow: expected None in a sweep, got {got}")
    meshes = None
    if occluders is not None:
        expected = f"{A_MESH}, or a sequence of them"
        meshes = tuple(meshes_of("occluders", occluders, expected))
    scene = SceneData(bounds, meshes, faces)
    adapter = arguments.adapter_of(adapter)
    task = Task(
        scene.digest,
        chosen,
        adapter,
        render,
        meaning,
        depth_of=depths if callable(depths) else None,
    )
    digest = digest_of(
        [scene.digest, chosen, render, meaning, rows]
        + [word for camera in views for word in words_of(camera)]
    )
    count = len(bounds)
    bits, done = arguments.resumed(resume, digest, int(rows.max()) + 1, count, len(views))
    job = blocks.Job(task, scene, engine, None if callable(depths) else depths)
    pieces = list(_pieces(views, done, per_block))

    def answers() -> Iterator[Answer]:
        """Those of the blocks; an error of one comes with what is done."""
        try:
            with closing(blocks.answers(runner, job, pieces)) as made:
                yield from made
        except (TypeError, ValueError) as error:
            if str(error).startswith("depths["):
                raise
            raise _interrupted(Sweep(bits, count, done, digest), error, runner) from error
        except Exception as error:
            raise _interrupted(Sweep(bits, count, done, digest), error, runner) from error

    with offered(scene), Progress(progress, "sweeping views", len(views)) as told:
        told.done = int(done.sum())
        for answer in answers():
            piece = pieces[answer.number]
            assert answer.rows is not None
            for view, row in zip(piece.views, answer.rows, strict=True):
                bits[rows[view]] |= row
                done[view] = True
            told.step(count=len(piece.views))
    return Sweep(bits, count, done, digest)


def _pieces(
    views: tuple[Camera, ...], done: npt.NDArray[np.bool_], per_block: int
) -> Iterator[Block]:
    """The blocks of views that are not done; the views of a block follow one another."""
    left = np.flatnonzero(~done)
    number = 0
    for run in np.split(left, np.flatnonzero(np.diff(left) > 1) + 1):
        for start in range(0, len(run), per_block):
            some = run[start : start + per_block]
            of = range(int(some[0]), int(some[-1]) + 1)
            yield Block(number, of, views[of.start : of.stop])
            number += 1


def _interrupted(partial: Sweep, error: Exception, runner: Executor | int | None) -> Exception:
    """The error that has what is done, why no more is, and how to go on."""
    why = f"{type(error).__name__}: {error}".rstrip(": ")
    if isinstance(error, BrokenExecutor):
        why = "a process of the pool died, and all of its blocks with it"
        if not partial.done.any():
            why += "; spawned processes import the script anew, so it needs its calls below " + (
                'if __name__ == "__main__":'
            )
        elif not isinstance(runner, int):
            why += "; a pool of the sweep's own is made anew (executor=4 for four processes)"
    return SweepInterrupted(partial, why)
