"""The pool of worker processes: bounded, warmed up, with deadlines that are kept by killing."""

from __future__ import annotations

import asyncio
import multiprocessing
import socket
import time
from typing import TYPE_CHECKING

import structlog

from api.errors import DeadlineExceeded, InternalError, MemoryExceeded, Overloaded, what_to_do
from api.messages import HEADER, Caps, pack, unpack
from api.worker_main import work

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.messages import Reply, Task
    from api.settings import Settings

RETRY_AFTER = "1"
"""The time after which a caller whom a full queue turns away may try again, s; a plan usually takes less."""

NO_MEMORY_FOR_A_LIBRARY = 127
"""The exit code of a process whose C library finds no memory for the thread-local data of a library that it loads."""

RESPAWN_DELAY = 1.0
"""The time before a worker that could not even start is started again, s; short, yet no busy loop."""

READ_AHEAD = 2**22
"""The bytes of an answer that the event loop takes in before it makes the worker wait; most answers have less."""

log = structlog.get_logger()


class Worker:
    """A worker process, started at once, and the channel to it, connected once there is an event loop.

    Attributes:
        pid: The id of its process.
        tasks: The number of tasks that it has been given.
        warm: Whether it has said that it is ready for tasks.
        ended: An event that is set when the process has ended.
        exit_code: The exit code of the process, once it has ended.
    """

    def __init__(self, caps: Caps) -> None:
        context = multiprocessing.get_context("spawn")
        self._channel, its_channel = socket.socketpair()
        self._process = context.Process(target=work, args=(its_channel, caps), name="worker", daemon=True)
        self._process.start()
        its_channel.close()
        self.pid = self._process.pid
        self.exit_code: int | None = None
        self.tasks = 0
        self.warm = False
        self.ended = asyncio.Event()

    async def connect(self) -> None:
        """Connect the channel to the running event loop and listen for the end of the process."""
        self._reader, self._writer = await asyncio.open_unix_connection(sock=self._channel, limit=READ_AHEAD)
        asyncio.get_running_loop().add_reader(self._process.sentinel, self._note_end)

    def _note_end(self) -> None:
        asyncio.get_running_loop().remove_reader(self._process.sentinel)
        self._writer.close()
        self._process.join()
        self.exit_code = self._process.exitcode
        self._process.close()
        self.ended.set()

    async def warm_up(self) -> None:
        """Wait until the worker says that it is ready, or has ended without."""
        try:
            await self._receive(_count_nothing)
        except (EOFError, OSError):
            await self.ended.wait()
        else:
            self.warm = True

    async def run(self, task: Task, hold: Callable[[int], None]) -> Reply:
        """Run a task to its end; cancelling kills the worker.

        Args:
            task: The task.
            hold: What counts the bytes of the answer, before they are taken in.

        Raises:
            EOFError, OSError: The worker died.
            Overloaded: There is no room for the bytes of the answer.
        """
        self.tasks += 1
        try:
            for part in pack(task):
                self._writer.write(part)
            await self._writer.drain()
            return await self._receive(hold)
        except asyncio.CancelledError:
            self.kill()
            raise

    async def _receive(self, hold: Callable[[int], None]) -> Reply:
        payload_length, body_length = HEADER.unpack(await self._reader.readexactly(HEADER.size))
        payload = await self._reader.readexactly(payload_length)
        try:
            hold(body_length)
        except Overloaded:
            for start in range(0, body_length, READ_AHEAD):
                await self._reader.readexactly(min(READ_AHEAD, body_length - start))
            raise
        reply: Reply = unpack(payload, await self._reader.readexactly(body_length))
        return reply

    def kill(self) -> None:
        """End the process at once, if it has not ended."""
        if not self.ended.is_set():
            self._process.kill()

    def stop(self) -> None:
        """End the process and wait until it has ended."""
        if not self.ended.is_set():
            self._process.kill()
            self._process.join()


class WorkerPool:
    """Runs tasks in worker processes, one at a time each, all from the event loop, which never waits for one.

    Each worker has a channel of its own, so that one can be killed at any moment without harm to the others: one
    that overruns a deadline is, and one whose task ended in an unexpected error; whichever ends is replaced. (A pool
    with a queue that its workers share, as pebble's, breaks as a whole when one dies while idle.) Spawned, not forked:
    a forked worker would inherit the server's sockets and signal handlers.
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
            log_level=settings.log_level,
        )
        self._idle: asyncio.Queue[Worker] = asyncio.Queue()
        self._in_flight = 0
        self._been_ready = False
        self._keepers: list[asyncio.Task[None]] = []
        self._workers = [Worker(self._caps) for _ in range(self._size)]

    def attach(self) -> None:
        """Look after the workers from the running event loop."""
        self._keepers = [asyncio.create_task(self._keep(place)) for place in range(self._size)]

    async def detach(self) -> None:
        """Look after the workers no longer."""
        for keeper in self._keepers:
            keeper.cancel()
        await asyncio.gather(*self._keepers, return_exceptions=True)

    def stop(self) -> None:
        """End all workers."""
        for worker in self._workers:
            worker.stop()

    @property
    def warm_workers(self) -> int:
        """The number of workers that are ready for tasks and alive."""
        return sum(worker.warm and not worker.ended.is_set() for worker in self._workers)

    @property
    def ready(self) -> bool:
        """Whether all workers have been warm, and at least one is.

        One that was killed or recycled is back within a second: no reason to send the others' requests away.
        """
        warm = self.warm_workers
        self._been_ready = self._been_ready or warm == self._size
        return self._been_ready and warm > 0

    async def run(self, task: Task, hold: Callable[[int], None]) -> Reply:
        """Run a task in a worker.

        Args:
            task: The task.
            hold: What counts the bytes of the answer, before they are taken in; it may raise Overloaded.

        Raises:
            Overloaded: The queue is full, or there is no room for the answer.
            DeadlineExceeded: No reply came in time; the worker, if one had begun, is killed.
            MemoryExceeded: The worker died because there was no memory left for it.
            InternalError: The worker died of the task.
        """
        if self._in_flight >= self._capacity:
            raise Overloaded("the queue is full; try again later", headers={"Retry-After": RETRY_AFTER})
        self._in_flight += 1
        try:
            async with asyncio.timeout(task.deadline - time.monotonic()):
                return await self._run_when_idle(task, hold)
        except TimeoutError:
            raise DeadlineExceeded(
                f"the deadline passed before there was an answer; {what_to_do(self._caps.max_deadline)}"
            ) from None
        finally:
            self._in_flight -= 1

    async def _run_when_idle(self, task: Task, hold: Callable[[int], None]) -> Reply:
        if time.monotonic() >= task.deadline:
            raise TimeoutError
        worker = await self._idle.get()
        while worker.ended.is_set():  # it died while it was idle
            worker = await self._idle.get()
        try:
            reply = await worker.run(task, hold)
        except Overloaded:
            self._idle.put_nowait(worker)
            raise
        except (EOFError, OSError):
            await worker.ended.wait()
            if worker.exit_code == NO_MEMORY_FOR_A_LIBRARY:
                raise MemoryExceeded("the request needs more memory than a worker may use") from None
            raise InternalError("the service failed on this request") from None
        if worker.tasks >= self._max_tasks or not reply.worker_is_fit:
            worker.kill()
        else:
            self._idle.put_nowait(worker)
        return reply

    async def _keep(self, place: int) -> None:
        """Keep a place in the pool filled: warm its worker up, and put another there when it has ended."""
        while True:
            worker = self._workers[place]
            await worker.connect()
            await worker.warm_up()
            if worker.warm:
                self._idle.put_nowait(worker)
            await worker.ended.wait()
            log.info("worker_ended", pid=worker.pid, exit_code=worker.exit_code, tasks=worker.tasks)
            if not worker.warm:
                await asyncio.sleep(RESPAWN_DELAY)
            self._workers[place] = Worker(self._caps)


def _count_nothing(_size: int) -> None:
    """Hold no bytes: a worker that says that it is ready sends no answer."""
