"""Sweeps: the same bits by whoever runs the blocks, and what is made of them.

The expectation is a loop over `Device.cull`, packed by numpy.
"""

from __future__ import annotations

import os
import pickle
import random
import re
import tempfile
import threading
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import documented
import hizvk
from hizvk.bench import sweeps as bench
from hizvk.sweeping import blocks as handing
from hizvk.sweeping import spool
from hizvk.sweeping.workers import Answer, Block, Task

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

VIEWS, COUNT = 24, 1003
SIZE = (48, 64)
EYES = [(0.3 * k - 3.0, 0.2 * (k % 5), 4.0) for k in range(VIEWS)]
CAMERAS = [
    hizvk.Camera.look_at(eye, (0.0, 0.0, -20.0), fov_y_deg=60, size=SIZE, near=0.1) for eye in EYES
]
CENTERS = np.random.default_rng(5).uniform((-15, -8, -40), (15, 8, 0), (COUNT, 3))
BALLS = hizvk.Spheres(CENTERS, 0.15)
WALLS = [
    hizvk.Mesh([(x, -5, -9), (x + 3, -5, -8), (x + 3, 5, -9), (x, 5, -10)], [[0, 1, 2], [0, 2, 3]])
    for x in (-9.0, -4.0, 1.0, 6.0)
]


@dataclass(frozen=True)
class Depths:
    """View depth for each number, from any process; one call may do something first."""

    at: int = -1
    marker: str = ""
    first: str = ""

    def __call__(self, view: int) -> np.ndarray:
        if view == self.at and not Path(self.marker).exists():
            Path(self.marker).write_text(str(os.getpid()))
            if self.first == "die":
                os._exit(3)
            raise OSError("the disk is gone")
        depth = np.full(SIZE, 30.0, np.float32)
        depth[:, 2 * view : 2 * view + 20] = 8.0
        return depth


def packed(masks: list[np.ndarray]) -> np.ndarray:
    """The bits by hand: instance i is bit i % 8 of byte i // 8."""
    bits = np.zeros((len(masks), (COUNT + 7) // 8), np.uint8)
    for row, mask in zip(bits, masks, strict=True):
        for index in np.flatnonzero(mask):
            row[index // 8] |= 1 << (index % 8)
    return bits


@pytest.fixture(scope="module")
def by_depths() -> list[np.ndarray]:
    device = hizvk.Device()
    crowd = device.instances(BALLS)
    masks = []
    for view, camera in enumerate(CAMERAS):
        hiz = device.pyramid(Depths()(view), camera, kind="z")
        masks.append(device.cull(crowd, camera, hiz, descent=64).mask)
    return masks


@pytest.fixture(scope="module")
def by_walls() -> list[np.ndarray]:
    device = hizvk.Device()
    crowd, walls = device.instances(BALLS), device.occluders(WALLS)
    masks = []
    for camera in CAMERAS:
        hiz = device.pyramid(device.render_depth(walls, camera, rasteriser="host"))
        masks.append(device.cull(crowd, camera, hiz).mask)
    return masks


def swept(**more: Any) -> hizvk.Sweep:
    given = {"depths": Depths(), "kind": "z", "descent": 64, **more}
    return hizvk.sweep(BALLS, CAMERAS, **given)


# -- what it holds ---------------------------------------------------------------------------------


def test_the_bits_are_those_of_a_loop(by_walls: list[np.ndarray]) -> None:
    calls: list[tuple[int, int | None]] = []
    seen = hizvk.sweep(
        BALLS, CAMERAS, occluders=WALLS, block=5, progress=lambda *told: calls.append(told)
    )
    assert 0 < seen.counts.min() <= seen.counts.max() < COUNT
    np.testing.assert_array_equal(seen.bits, packed(by_walls))
    assert calls == [(done, VIEWS) for done in (5, 10, 15, 20, 24)]
    assert (len(seen), seen.num_instances, seen.is_complete) == (VIEWS, COUNT, True)
    full = np.stack(by_walls)
    for view in range(VIEWS):
        np.testing.assert_array_equal(seen.mask(view), full[view])
    assert seen.counts.tolist() == full.sum(axis=1).tolist()
    assert seen.count == full.sum()
    np.testing.assert_array_equal(seen.union(), full.any(axis=0))
    for index in (0, 7, 8, 500, COUNT - 1):
        np.testing.assert_array_equal(seen.visible_from(index), np.flatnonzero(full[:, index]))
    indptr, indices = seen.csr()
    view, index = np.nonzero(full)
    np.testing.assert_array_equal(indices, index)
    np.testing.assert_array_equal(np.repeat(np.arange(VIEWS), np.diff(indptr)), view)
    assert not seen.bits.flags.writeable
    assert repr(seen) == "<Sweep: 24 views of 1003 instances>"


def test_scipy_gets_its_own_matrix_or_a_line_what_to_do(by_walls: list[np.ndarray]) -> None:
    seen = hizvk.sweep(BALLS, CAMERAS[:2], occluders=WALLS)
    try:
        import scipy  # noqa: F401
    except ModuleNotFoundError:
        with pytest.raises(ModuleNotFoundError, match="pip install scipy, or take the arrays"):
            seen.csr(scipy=True)
        return
    np.testing.assert_array_equal(seen.csr(scipy=True).toarray(), np.stack(by_walls[:2]))


def test_views_of_a_group_share_a_row(by_depths: list[np.ndarray]) -> None:
    groups = [k % 3 for k in range(VIEWS)]
    seen = swept(groups=groups, block=4)
    joined = [np.logical_or.reduce(by_depths[k::3]) for k in range(3)]
    np.testing.assert_array_equal(seen.bits, packed(joined))
    assert seen.done.shape == (VIEWS,)


def test_no_instances_and_one_camera() -> None:
    none = hizvk.Spheres(np.zeros((0, 3)), 0.0)
    seen = hizvk.sweep(none, CAMERAS[0], occluders=WALLS)  # type: ignore[arg-type]
    assert (seen.bits.shape, seen.count, seen.union().shape) == ((1, 0), 0, (0,))


class Workers(Executor):
    """Workers that know the scene once they have seen it; calls go to any of them by `choose`."""

    def __init__(self, count: int, choose: Callable[[int], int], sees: bool = False) -> None:
        self.know = [False] * count
        self.copies, self.ran, self.sent = 0, list[int](), set[str]()
        self._choose, self._sees = choose, sees

    def submit(self, fn: Any, /, task: Any, block: Block, scene: Any = None) -> Any:
        worker = self._choose(len(self.know))
        self.copies += scene is not None
        self.sent |= {type(scene).__name__} if scene is not None else set()
        self.know[worker] |= scene is not None
        rows = None
        if self.know[worker]:
            self.ran.append(block.number)
            rows = np.zeros((1, 1), np.uint8)
        future: Future[Answer] = Future()
        future.set_result(Answer(str(worker), block.number, rows, self._sees))
        return future


def pieces(count: int) -> list[Block]:
    return [Block(number, range(number, number + 1), ()) for number in range(count)]


# -- who runs the blocks ---------------------------------------------------------------------------


@pytest.mark.parametrize("block", [1, 7, None])
def test_threads(by_depths: list[np.ndarray], block: int | None) -> None:
    with ThreadPoolExecutor(3) as threads:
        seen = swept(executor=threads, block=block)
    np.testing.assert_array_equal(seen.bits, packed(by_depths))


def test_own_processes_and_one_that_dies(by_depths: list[np.ndarray], tmp_path: Path) -> None:
    marker = tmp_path / "died"
    seen = swept(executor=2, block=2, depths=Depths(11, str(marker), "die"))
    assert marker.exists()
    np.testing.assert_array_equal(seen.bits, packed(by_depths))


def test_a_pool_that_breaks_keeps_what_is_done(by_depths: list[np.ndarray], tmp_path: Path) -> None:
    depths = Depths(17, str(tmp_path / "died"), "die")
    with (
        ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool,
        pytest.raises(hizvk.SweepInterrupted, match="a process of the pool died") as caught,
    ):
        swept(executor=pool, block=2, depths=depths)
    assert "resume=error.partial" in str(caught.value)
    partial = caught.value.partial
    # One process runs the blocks in order, and the ninth has view 17.
    assert partial.done.tolist() == [view < 16 for view in range(VIEWS)]
    np.testing.assert_array_equal(partial.bits[:16], packed(by_depths)[:16])
    assert not partial.bits[16:].any()
    path = tmp_path / "sweep.npz"
    partial.save(path)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["died", "sweep.npz"]
    again = hizvk.Sweep.load(path)
    asked: list[int] = []

    def told(view: int) -> np.ndarray:
        asked.append(view)
        return Depths()(view)

    seen = swept(depths=told, resume=again, block=3)
    assert asked == list(range(16, VIEWS))
    np.testing.assert_array_equal(seen.bits, packed(by_depths))


def test_an_error_of_a_view_keeps_what_is_done(tmp_path: Path) -> None:
    depths = Depths(9, str(tmp_path / "failed"), "raise")
    with pytest.raises(hizvk.SweepInterrupted, match="OSError: the disk is gone") as caught:
        swept(depths=depths, block=3)
    assert isinstance(caught.value.__cause__, OSError)
    assert caught.value.partial.done.sum() == 9
    assert "9 of 24 done" in repr(caught.value.partial)
    assert swept(depths=depths, block=3, resume=caught.value.partial).is_complete


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    """Dask's client of two worker processes."""
    distributed = pytest.importorskip(
        "distributed", reason='Dask is not installed: pip install "dask[distributed]"'
    )
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def test_a_cluster_whose_worker_dies(
    client: Any, by_depths: list[np.ndarray], tmp_path: Path
) -> None:
    marker = tmp_path / "died"
    before = set(client.run(os.getpid).values())
    depths = Depths(7, str(marker), "die")
    seen = swept(executor=client.get_executor(), block=1, depths=depths)
    assert int(marker.read_text()) in before
    np.testing.assert_array_equal(seen.bits, packed(by_depths))


@pytest.mark.parametrize("by_client", [False, True])
def test_a_cluster_that_sees_no_file(
    client: Any, by_walls: list[np.ndarray], monkeypatch: pytest.MonkeyPatch, by_client: bool
) -> None:
    """As on other machines: the scene goes with a block, or by the engine."""
    monkeypatch.setattr(spool.Spool, "__enter__", elsewhere)
    moved = [*WALLS, hizvk.Mesh(np.full((3, 3), 100.0 + by_client), [[0, 1, 2]])]  # a new scene
    executor = client if by_client else client.get_executor()
    seen = hizvk.sweep(BALLS, CAMERAS, occluders=moved, executor=executor, block=2)
    np.testing.assert_array_equal(seen.bits, packed(by_walls))


class Engine:
    """A client whose engine loses what it was given, the first few times."""

    def __init__(self, losses: int) -> None:
        self._losses = losses

    def scatter(self, scene: Any, **_: Any) -> Any:
        self._losses -= 1
        return "lost" if self._losses >= 0 else scene


@pytest.mark.parametrize("losses", [0, 1, 3, 100])
def test_a_scene_that_the_engine_loses_is_given_again(losses: int) -> None:
    class Losing(Workers):
        def submit(self, fn: Any, /, task: Any, block: Block, *scene: Any) -> Any:
            if scene == ("lost",):
                future: Future[Answer] = Future()
                future.cancel()
                future.set_running_or_notify_cancel()
                return future
            return super().submit(fn, task, block, *scene)

    job = handing.Job(Task("", hizvk.CullOptions()), "scene", Engine(losses))  # type: ignore[arg-type]
    workers = Losing(1, lambda _: 0)
    if losses == 100:
        with pytest.raises(RuntimeError, match="the executor cancelled a block"):
            list(handing.answers(workers, job, pieces(9)))
        return
    assert sorted(one.number for one in handing.answers(workers, job, pieces(9))) == list(range(9))
    assert sorted(workers.ran) == list(range(9))


def test_the_lines_for_a_cluster_run(
    client: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shown = set()
    for page in ("README.md", "docs/sweeps.md"):
        text = (Path(__file__).parents[1] / page).read_text(encoding="utf-8")
        shown |= {
            part for part in re.findall(r"```text\n(.*?)```", text, re.DOTALL) if "dask" in part
        }
    (lines,) = shown  # both pages show the same
    address = client.scheduler_info()["address"]
    assert lines.count('"tcp://scheduler:8786"') == 1
    monkeypatch.chdir(tmp_path)
    exec(lines.replace("tcp://scheduler:8786", address), {})
    seen = hizvk.Sweep.load("seen.npz")
    assert seen.is_complete
    # The wall hides some, and a view has a sixth of the directions.
    assert 0 < seen.union().sum() < seen.num_instances


def elsewhere(self: spool.Spool) -> spool.Spool:
    self._folder = tempfile.TemporaryDirectory()
    self.reference = spool.Reference(self._folder.name, "not here")
    return self


# -- how the scene travels -------------------------------------------------------------------------


def handed(workers: Executor, count: int) -> list[int]:
    job: Any = handing.Job(Task("", hizvk.CullOptions()), "scene")  # type: ignore[arg-type]
    return sorted(answer.number for answer in handing.answers(workers, job, pieces(count)))


@pytest.mark.parametrize("seed", range(8))
def test_whoever_runs_what_every_block_runs_once(seed: int) -> None:
    rng = random.Random(seed)
    count, sees = rng.choice([1, 2, 9, 40]), seed % 2 == 0
    workers = Workers(count, rng.randrange, sees)
    assert handed(workers, 300) == list(range(300))
    assert sorted(workers.ran) == list(range(300))
    assert sum(workers.know) <= workers.copies
    assert workers.sent == {"Reference" if sees else "str"}


def test_processes_of_this_machine_read_the_scene_from_a_file(
    by_walls: list[np.ndarray], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    sent: list[str] = []
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        original = pool.submit

        def counted(fn: Any, /, *given: Any) -> Any:
            sent.extend(type(one).__name__ for one in given[2:])
            # Bounds of 1003 spheres take 32 kB.
            assert len(pickle.dumps(given)) < 4000
            return original(fn, *given)

        monkeypatch.setattr(pool, "submit", counted)
        for _ in range(2):
            seen = hizvk.sweep(BALLS, CAMERAS, occluders=WALLS, executor=pool, block=2)
            np.testing.assert_array_equal(seen.bits, packed(by_walls))
    assert 1 <= len(sent) <= 6
    assert set(sent) == {"Reference"}
    assert not list(tmp_path.iterdir())


def test_a_process_uploads_a_scene_once(monkeypatch: pytest.MonkeyPatch) -> None:
    uploads: list[int] = []
    original = hizvk.Device.instances

    def counted(self: hizvk.Device, *given: Any, **more: Any) -> Any:
        uploads.append(threading.get_ident())
        return original(self, *given, **more)

    monkeypatch.setattr(hizvk.Device, "instances", counted)
    moved = hizvk.Spheres(CENTERS + 0.01, 0.15)
    with ThreadPoolExecutor(4) as threads:
        hizvk.sweep(moved, CAMERAS, depths=Depths(), kind="z", executor=threads, block=1)
        hizvk.sweep(moved, CAMERAS, depths=Depths(), kind="z", executor=threads, block=2)
    assert len(uploads) == 1


# -- errors ----------------------------------------------------------------------------------------


def test_what_was_swept_otherwise_is_no_beginning(tmp_path: Path) -> None:
    seen = swept()
    with pytest.raises(ValueError, match="resume: expected a Sweep of the same bounds, cameras"):
        swept(descent=0, resume=seen)
    with pytest.raises(ValueError, match="resume: expected a Sweep of the same"):
        hizvk.sweep(BALLS, CAMERAS[::-1], depths=Depths(), kind="z", descent=64, resume=seen)
    other = tmp_path / "other.npz"
    np.savez(other, bits=np.zeros(3))
    text = tmp_path / "text.npz"
    text.write_text("no archive")
    for path in (other, text):
        with pytest.raises(ValueError, match=re.escape("path: expected a file of Sweep.save")):
            hizvk.Sweep.load(path)
    for call in (seen.mask, seen.visible_from):
        with pytest.raises(IndexError, match=r"expected an integer in 0\.\."):
            call(5000)


def test_what_is_uploaded_already_is_refused_with_the_way_out() -> None:
    device = hizvk.Device()
    walls: Any = device.occluders(WALLS)
    crowd: Any = device.instances(BALLS)
    for bounds, occluders, name in ((crowd, WALLS, "bounds"), (BALLS, walls, "occluders")):
        with pytest.raises(TypeError, match=f"{name}: .*pass them as they were before the upload"):
            hizvk.sweep(bounds, CAMERAS, occluders=occluders)


@pytest.mark.parametrize("executor", [None, 1])
def test_a_bad_array_of_one_view_is_named(executor: int | None) -> None:
    if executor is not None:
        executor = ThreadPoolExecutor(1)  # type: ignore[assignment]
    images = [Depths()(view) for view in range(VIEWS)]
    images[13] = images[13][:, :-1]
    with pytest.raises(ValueError, match=r"depths\[13\]: .*expected float \(48, 64\)"):
        swept(depths=images, executor=executor)


def test_the_bench_counts_what_the_page_shows() -> None:
    """If this is red, run python -m hizvk.bench.sweeps --processes 2 and put the table there."""
    if not documented.is_of_this_driver(documented.page("performance.md")):
        pytest.skip("docs/sweeps.md was printed on another driver")
    shown = documented.table(documented.page("sweeps.md"), "instances", "kept per view")
    kept = {row["instances"]: row["kept per view"] for row in shown}
    rows = bench.measure((1_000, 10_000), rounds=0)
    assert [kept[f"{row.instances:,}"] for row in rows] == [f"{row.kept:,.1f}" for row in rows]
