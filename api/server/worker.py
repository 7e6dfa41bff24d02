"""A worker process, as the server sees it: the process, and the channel to it."""

from __future__ import annotations

import asyncio
import multiprocessing
import signal
import socket
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING

from api.errors import Overloaded
from api.messages import HEADER, pack, unpack
from api.worker_main import work

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.messages import Caps, Reply, Task
    from api.server.jobs import Job

READ_AHEAD = 2**22
"""The bytes of an answer that the event loop takes in before it makes the worker wait; most answers have less."""

SIGNALS_OF_THE_SERVER = {signal.SIGTERM, signal.SIGINT}
"""The signals that reach the whole process group and are for the server alone: it drains, then ends the workers."""


class Worker:
    """A worker process, started at once, and the channel to it, connected once there is an event loop.

    Attributes:
        pid: The id of its process.
        only_cheap: Whether it takes cheap work only.
        tasks: The number of tasks that it has been given.
        warm: Whether it has said that it is ready for tasks.
        job: What it is working on.
        offer: Where it waits for the next job, while it is idle; a None says that it ended.
        ended: An event that is set when the process has ended.
        exit_code: The exit code of the process, once it has ended.
    """

    def __init__(self, caps: Caps, only_cheap: bool = False) -> None:
        context = multiprocessing.get_context("spawn")
        self._channel, its_channel = socket.socketpair()
        self._process = context.Process(target=work, args=(its_channel, caps), name="worker", daemon=True)
        resource_tracker.ensure_running()  # by itself, as it lets the signals through that are blocked here
        before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS_OF_THE_SERVER)  # the process inherits it
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        its_channel.close()
        self.pid = self._process.pid
        self.only_cheap = only_cheap
        self.exit_code: int | None = None
        self.tasks = 0
        self.warm = False
        self.job: Job | None = None
        self.offer: asyncio.Future[Job | None] | None = None
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
        if self.offer is not None and not self.offer.done():
            self.offer.set_result(None)

    async def warm_up(self) -> None:
        """Wait until the worker says that it is ready, or has ended without."""
        try:
            await self._receive(_count_nothing)
        except (EOFError, OSError):
            await self.ended.wait()
        else:
            self.warm = True

    async def run(self, task: Task, hold: Callable[[int], None]) -> Reply:
        """Run a task to its end.

        Args:
            task: The task.
            hold: What counts the bytes of the answer, before they are taken in.

        Raises:
            EOFError, OSError: The worker died.
            Overloaded: There is no room for the bytes of the answer.
        """
        self.tasks += 1
        for part in pack(task):
            self._writer.write(part)
        await self._writer.drain()
        return await self._receive(hold)

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

    def takes(self, job: Job) -> bool:
        """Tell whether it takes a job of this cost."""
        return job.is_cheap or not self.only_cheap

    def kill(self) -> None:
        """End the process at once, if it has not ended."""
        if not self.ended.is_set():
            self._process.kill()

    def stop(self) -> None:
        """End the process and wait until it has ended."""
        if not self.ended.is_set():
            self._process.kill()
            self._process.join()


def _count_nothing(_size: int) -> None:
    """Hold no bytes: a worker that says that it is ready sends no answer."""
