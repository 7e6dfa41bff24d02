"""The pool of worker processes: bounded, warmed up, with deadlines that are kept by killing."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import structlog

from api.errors import DeadlineExceeded, InternalError, Overloaded
from api.worker_main import Caps, work

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.context import SpawnProcess

    from api.settings import Settings
    from api.worker_main import Reply, Task

RETRY_AFTER = "1"
"""s, suggested to those whom a full queue turns away."""

RESPAWN_DELAY = 1.0
"""s, before a worker that could not even start is tried again."""

log = structlog.get_logger()


@dataclass(eq=False)
class Worker:
    """A worker process, the pipe to it, and what it is doing.

    Attributes:
        process: The process.
        pipe: Tasks go in, replies come out; first comes None, once the worker is warm.
        warm: Whether it has come.
        tasks: How many it has been given.
        reply: Awaited by whoever gave it the present task; None: it is idle.
    """

    process: SpawnProcess
    pipe: Connection
    warm: bool = False
    tasks: int = 0
    reply: asyncio.Future[Reply] | None = None


class WorkerPool:
    """Runs tasks in worker processes, one at a time each, all from the event loop.

    Each worker has a pipe of its own, so that one can be killed at any moment without harm to the others: one
    that overruns a deadline is, and whichever ends is replaced. (A pool with a queue that its workers share
    breaks when one dies with a hand on it.) Spawned, not forked: a forked worker would inherit the server's
    sockets and signal handlers.
    """

    def __init__(self, settings: Settings) -> None:
        self._size = settings.workers
        self._capacity = settings.workers + settings.queue_size
        self._max_tasks = settings.worker_max_tasks
        self._caps = Caps(
            max_deadline=settings.max_deadline,
            max_waypoints=settings.max_waypoints,
            max_samples=settings.max_samples,
            memory_mib=settings.worker_memory_mib,
        )
        self._idle: asyncio.Queue[Worker] = asyncio.Queue()
        self._in_flight = 0
        self._been_ready = False
        self._workers = {self._spawn() for _ in range(self._size)}

    def attach(self) -> None:
        """Listen to the workers from the running event loop."""
        for worker in self._workers:
            self._listen(worker)

    def stop(self) -> None:
        """End all workers."""
        for worker in self._workers:
            worker.process.kill()
            worker.process.join()
            worker.pipe.close()
        self._workers.clear()

    def detach(self) -> None:
        """Stop listening to the workers."""
        for worker in self._workers:
            asyncio.get_running_loop().remove_reader(worker.pipe.fileno())

    @property
    def warm_workers(self) -> int:
        """How many workers have solved their first problems."""
        return sum(worker.warm for worker in self._workers)

    @property
    def ready(self) -> bool:
        """All workers have been warm, and at least one is.

        One that was killed or recycled is back within a second: no reason to send the others' requests away.
        """
        warm = self.warm_workers
        self._been_ready = self._been_ready or warm == self._size
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
                return await self._run_when_idle(task)
        except TimeoutError:
            raise DeadlineExceeded("the deadline passed before there was an answer") from None
        finally:
            self._in_flight -= 1

    async def _run_when_idle(self, task: Task) -> Reply:
        if time.monotonic() >= task.deadline:
            raise TimeoutError
        worker = await self._idle.get()
        while worker not in self._workers:  # it died while it was idle
            worker = await self._idle.get()
        worker.reply = asyncio.get_running_loop().create_future()
        worker.tasks += 1
        try:
            worker.pipe.send(task)
            return await worker.reply
        except OSError:  # it has just died, and the event loop has not heard of it yet
            return await self._run_when_idle(task)
        except asyncio.CancelledError:
            worker.process.kill()
            raise

    def _spawn(self) -> Worker:
        context = multiprocessing.get_context("spawn")
        pipe, its_pipe = context.Pipe()
        process = context.Process(target=work, args=(its_pipe, self._caps), name="worker", daemon=True)
        process.start()
        its_pipe.close()
        return Worker(process, pipe)

    def _listen(self, worker: Worker) -> None:
        asyncio.get_running_loop().add_reader(worker.pipe.fileno(), self._receive, worker)
        os.set_blocking(worker.pipe.fileno(), True)  # uvloop turns it off; messages are read and written whole

    def _receive(self, worker: Worker) -> None:
        """Called by the event loop when the worker has sent something, or has ended."""
        try:
            message: Reply | None = worker.pipe.recv()
        except (EOFError, OSError):
            self._bury(worker)
            return
        if message is None:
            worker.warm = True
        elif worker.reply is not None and not worker.reply.done():
            worker.reply.set_result(message)
        worker.reply = None
        if worker.tasks >= self._max_tasks:
            worker.process.kill()
        else:
            self._idle.put_nowait(worker)

    def _bury(self, worker: Worker) -> None:
        """Put another worker in the place of one that has ended."""
        loop = asyncio.get_running_loop()
        loop.remove_reader(worker.pipe.fileno())
        worker.pipe.close()
        worker.process.join()
        self._workers.discard(worker)
        log.info("worker_ended", pid=worker.process.pid, exit_code=worker.process.exitcode, tasks=worker.tasks)
        if worker.reply is not None and not worker.reply.done():
            worker.reply.set_exception(InternalError("the service failed on this request"))
        if worker.warm:
            self._replace()
        else:
            loop.call_later(RESPAWN_DELAY, self._replace)

    def _replace(self) -> None:
        worker = self._spawn()
        self._workers.add(worker)
        self._listen(worker)
