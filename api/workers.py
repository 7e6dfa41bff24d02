"""The pool of worker processes: bounded, warmed up, with deadlines that are kept by killing."""

from __future__ import annotations

import asyncio
import multiprocessing
import time
from concurrent.futures.process import BrokenProcessPool
from threading import Thread
from typing import TYPE_CHECKING

import structlog
from pebble import CONSTS, ProcessExpired, ProcessPool

from api.errors import DeadlineExceeded, InternalError, Overloaded
from api.worker_main import Caps, execute, initialize, is_alive

if TYPE_CHECKING:
    from concurrent.futures import Future

    from api.settings import Settings
    from api.worker_main import Reply, Task

CONSTS.term_timeout = 0.2  # s between SIGTERM and SIGKILL: a solver that hangs never sees the former

RETRY_AFTER = "1"
"""s, suggested to those whom a full queue turns away."""

log = structlog.get_logger()


class WorkerPool:
    """Runs tasks in worker processes, one at a time each.

    Spawned, not forked: a forked worker would inherit the server's sockets and signal handlers. A worker that
    overruns a deadline is killed, and one that dies is replaced. Should the pool as a whole break (pebble's
    does when an idle worker dies), it is replaced too and the tasks that it held run once more: they have no
    side effects.
    """

    def __init__(self, settings: Settings) -> None:
        self._workers = settings.workers
        self._capacity = settings.workers + settings.queue_size
        self._max_tasks = settings.worker_max_tasks
        self._caps = Caps(
            max_deadline=settings.max_deadline,
            max_waypoints=settings.max_waypoints,
            max_samples=settings.max_samples,
            memory_mib=settings.worker_memory_mib,
        )
        self._in_flight = 0
        self._been_ready = False
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._board = context.Array("i", self._workers)
        self._pool = ProcessPool(
            max_workers=self._workers,
            max_tasks=self._max_tasks,
            initializer=initialize,
            initargs=(self._caps, self._board),
            context=context,
        )
        self._pool.active  # noqa: B018 - asking is what makes pebble start its workers

    @property
    def warm_workers(self) -> int:
        """How many workers have solved their first problems and are alive."""
        return sum(is_alive(pid) for pid in self._board[:])

    @property
    def ready(self) -> bool:
        """All workers have been warm, and at least one is.

        One that was killed or recycled is back within a second: no reason to send the others' requests away.
        """
        warm = self.warm_workers
        self._been_ready = self._been_ready or warm == self._workers
        return self._been_ready and warm > 0

    async def run(self, task: Task) -> Reply:
        """Run a task in a worker.

        Raises:
            Overloaded: The queue is full.
            DeadlineExceeded: No reply came in time; the worker, if one had begun, is killed.
            InternalError: The worker died of the task.
        """
        if self._in_flight >= self._capacity:
            raise Overloaded("the queue is full; try again later", headers={"Retry-After": RETRY_AFTER})
        self._in_flight += 1
        try:
            async with asyncio.timeout(task.deadline - time.monotonic()):
                try:
                    return await self._attempt(task)
                except BrokenProcessPool:
                    return await self._attempt(task)
        except TimeoutError:
            raise DeadlineExceeded("the deadline passed before there was an answer") from None
        except (ProcessExpired, BrokenProcessPool):
            log.error("worker_died", operation=task.operation)
            raise InternalError("the service failed on this request") from None
        finally:
            self._in_flight -= 1

    async def _attempt(self, task: Task) -> Reply:
        """Schedule the task once; cancelling the awaiting cancels it, and so kills its worker."""
        if not self._pool.active:
            log.warning("pool_replaced")
            broken = self._pool
            self._start()
            Thread(target=_dispose, args=(broken,), daemon=True).start()
        future: Future[Reply] = self._pool.schedule(execute, args=(task,))
        return await asyncio.wrap_future(future)

    def stop(self) -> None:
        """Stop all workers."""
        _dispose(self._pool)


def _dispose(pool: ProcessPool) -> None:
    pool.stop()  # type: ignore[no-untyped-call]
    pool.join()
