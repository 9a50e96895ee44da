"""Hands blocks to an executor, and the scene to each worker that asks for it.

**How the scene travels.**
A worker that lacks the scene says so in its answer, and the block is sent again, with one of these:

- a reference to a file, if the worker sees the folder of the sweep, as on the same machine;
- a future of the engine, if the caller gave a Dask client: the engine then hands the scene on from
  worker to worker, once to each;
- otherwise the scene itself.

Executors choose who runs what, so a block with the scene may reach a worker that has it.
So no more of them are on their way than workers have asked and not been served.
Blocks that come back beyond that wait until one of those is done.
A process that was started anew asks anew.

**How many blocks are handed out.**
Two for each worker that has answered so far, and four more.
So workers that join later are found, and no executor has to be asked how many it has.

**What is tried again.**
An engine such as Dask runs the blocks of a lost worker elsewhere, and nothing is seen of it here.
Only if all workers die that hold the scene, it has to be given to the engine again.
A pool of processes breaks as a whole.
A pool of our own is then made anew, and runs the blocks that are left.
"""

from __future__ import annotations

import warnings
from collections import deque
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, ProcessPoolExecutor, wait
from dataclasses import dataclass, replace
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any, Final

from .spool import Spool
from .workers import cull_block

if TYPE_CHECKING:
    from collections.abc import Collection, Generator, Iterator
    from concurrent.futures import Future

    from .scene import SceneData
    from .workers import Answer, Block, Task

__all__ = ["Job", "answers"]

#: Pools in a row that may break before any of them has finished a block.
FRUITLESS: Final = 3
#: How often a block is sent whose scene the engine has lost.
MOST_ATTEMPTS: Final = 8


@dataclass(frozen=True)
class Job:
    """What is to be done, beside the blocks."""

    task: Task
    scene: SceneData
    engine: Any = None
    """A Dask client, or None."""
    images: Any = None
    """The depth arrays of all views; those of a block are taken when it is handed out."""

    def filled(self, block: Block) -> Block:
        """The block with its depth arrays."""
        if self.images is None:
            return block
        return replace(block, images=tuple(self.images[view] for view in block.views))


def answers(
    executor: Executor | int | None, job: Job, blocks: Collection[Block]
) -> Generator[Answer]:
    """The answers of all blocks, as they come: of this thread, a pool of our own, or an executor.

    An error of a block is raised once all answers that have come are handed out.
    What is still to come is then cancelled.
    """
    if executor is None:
        for block in blocks:
            yield cull_block(job.task, job.filled(block))
    elif isinstance(executor, int):
        yield from _in_own_pool(executor, job, blocks)
    else:
        yield from _on_executor(executor, job, blocks)


def _in_own_pool(processes: int, job: Job, blocks: Collection[Block]) -> Iterator[Answer]:
    """From a pool of processes that is made anew if one of them dies."""
    left = {block.number: block for block in blocks}
    fruitless = 0
    while left:
        before = len(left)
        # Spawned processes inherit no device of this one, and no lock.
        pool = ProcessPoolExecutor(min(processes, before), mp_context=get_context("spawn"))
        try:
            for answer in _on_executor(pool, job, list(left.values())):
                del left[answer.number]
                yield answer
        except BrokenExecutor:
            fruitless = 0 if len(left) < before else fruitless + 1
            if fruitless == FRUITLESS:
                raise
        finally:
            pool.shutdown(cancel_futures=True)


def _on_executor(executor: Executor, job: Job, blocks: Collection[Block]) -> Iterator[Answer]:
    with Spool(job.scene) as spool:
        yield from _handed_out(_Queue(executor, job, blocks, spool))


def _handed_out(queue: _Queue) -> Iterator[Answer]:
    try:
        while queue.fill():
            done, _ = wait(queue.running, return_when=FIRST_COMPLETED)
            failed: BaseException | None = None
            for future in done:
                block, carries = queue.running.pop(future)
                if future.cancelled() and carries and queue.scatters_again(block):
                    continue
                error = None if future.cancelled() else future.exception()
                if future.cancelled() or error is not None:
                    failed = failed or error or RuntimeError("the executor cancelled a block")
                    continue
                answer = future.result()
                if answer.rows is None:
                    assert not carries
                    queue.asks(answer, block)
                else:
                    queue.has_scene(answer.worker, carries)
                    yield answer
            if failed is not None:
                yield from queue.arrived()
                raise failed
    finally:
        for future in queue.running:
            future.cancel()


class _Queue:
    """The blocks that wait, those that run, and which workers have the scene."""

    def __init__(
        self, executor: Executor, job: Job, blocks: Collection[Block], spool: Spool
    ) -> None:
        self._executor, self._job, self._spool = executor, job, spool
        self._task = replace(job.task, spool=spool.reference)
        self._scattered: Any = None
        self._waiting = deque(blocks)
        #: Blocks to be sent with the scene, and whether a reference to its file is enough.
        self._carriers: deque[tuple[Block, bool]] = deque()
        #: Each running block, and whether it carries the scene.
        self.running: dict[Future[Answer], tuple[Block, bool]] = {}
        self._served: set[str] = set()
        self._asking: set[str] = set()
        self._held = False

    def fill(self) -> bool:
        """Hands out blocks; False if none runs any more."""
        while self._carriers:
            block, by_file = self._carriers.popleft()
            self._submit(block, self._spool.written() if by_file else self._sent())
        room = 4 + 2 * len(self._served | self._asking)
        while self._waiting and not self._held and len(self.running) < room:
            self._submit(self._waiting.popleft())
        return bool(self.running)

    def asks(self, answer: Answer, block: Block) -> None:
        """A worker has sent the block back, because it lacks the scene."""
        self._served.discard(answer.worker)
        self._asking.add(answer.worker)
        again = replace(block, attempt=block.attempt + 1)
        if self._on_their_way() < len(self._asking):
            self._carriers.append((again, answer.sees_spool))
        else:
            self._waiting.appendleft(again)
            self._held = True

    def scatters_again(self, block: Block) -> bool:
        """Sends a block again that the engine dropped, because all workers with the scene died."""
        if self._job.engine is None or block.attempt >= MOST_ATTEMPTS:
            return False
        self._scattered = None
        self._carriers.append((replace(block, attempt=block.attempt + 1), False))
        return True

    def has_scene(self, worker: str, carried: bool) -> None:
        """A worker has run a block, so it has the scene."""
        self._asking.discard(worker)
        self._served.add(worker)
        if carried:
            self._held = False

    def arrived(self) -> Iterator[Answer]:
        """Answers that are there already, beside a block that has failed."""
        for future in list(self.running):
            if future.done() and not future.cancelled() and future.exception() is None:
                del self.running[future]
                answer = future.result()
                if answer.rows is not None:
                    yield answer

    def _on_their_way(self) -> int:
        return len(self._carriers) + sum(carries for _, carries in self.running.values())

    def _sent(self) -> Any:
        """The scene, or the engine's future of it."""
        if self._job.engine is None:
            return self._job.scene
        if self._scattered is None:
            self._scattered = self._job.engine.scatter(self._job.scene, broadcast=True, hash=False)
        return self._scattered

    def _submit(self, block: Block, scene: Any = None) -> None:
        sent = self._job.filled(block)
        if scene is None:
            future = self._executor.submit(cull_block, self._task, sent)
        else:
            with warnings.catch_warnings():
                # Dask's, about arguments of more than 10 MB: this one is meant to be sent.
                warnings.filterwarnings("ignore", "Sending large graph", UserWarning)
                future = self._executor.submit(cull_block, self._task, sent, scene)
        self.running[future] = (block, scene is not None)
