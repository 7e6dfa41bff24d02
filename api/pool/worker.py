"""A worker process, as the server sees it: the process, and the channel to it."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import signal
import socket
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import forkserver, resource_tracker
from typing import TYPE_CHECKING

from api.base.errors import Overloaded
from api.pool.memory import KEEPING
from api.pool.messages import HEADER, pack, unpack
from api.pool.worker_process import work

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from api.pool.jobs import Job
    from api.pool.messages import Caps, Reply, Task
    from api.pool.worker_process import Entry

READ_AHEAD = 2**22
"""The bytes of an answer that the event loop takes in before it makes the worker wait; most answers have less."""

SIGNALS_OF_THE_SERVER = {signal.SIGTERM, signal.SIGINT}
"""The signals that reach the whole process group and are for the server alone: it drains, then ends the workers."""

NUMERIC_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""The environment variables that limit numeric libraries to one thread: a worker plans one thing at a time.
A process with several threads must not be forked."""

PROCESSES = ThreadPoolExecutor(1, "processes")
"""The thread that starts processes and notes their ends. The first start waits until the template is warm. The books of
`multiprocessing` about its processes are for one thread."""


def start_template(module: str) -> None:
    """Start the process that workers are forked from; it imports a module, while this process goes on."""
    os.environ.update(dict.fromkeys(NUMERIC_THREADS, "1") | KEEPING)  # it inherits them
    multiprocessing.set_forkserver_preload([module])
    with _signals_of_the_server_blocked():
        forkserver.ensure_running()


def stop_template() -> None:
    """End the process that workers are forked from, even while it gets warm, which who ends would wait for."""
    pid = forkserver._forkserver._forkserver_pid  # type: ignore[attr-defined]  # there is no other way to it
    if pid is not None:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


class Worker:
    """A worker process, and the channel to it; both are there once it gets ready.

    Attributes:
        pid: The id of its process.
        only_cheap: Whether it takes cheap work only.
        tasks: The number of tasks that it has been given.
        alive: Whether its process runs, as far as is known.
        warm: Whether it has said that it is ready for tasks.
        job: Its job under way.
        offer: Where it waits for the next job, while it is idle; a None says that it ended.
        ended: An event that is set when the process has ended.
        exit_code: The exit code of the process, once it has ended.
    """

    def __init__(self, caps: Caps, entry: Entry, only_cheap: bool = False) -> None:
        self._args = caps, entry.load
        self._unwanted = False
        self.pid: int | None = None
        self.only_cheap = only_cheap
        self.exit_code: int | None = None
        self.tasks = 0
        self.alive = False
        self.warm = False
        self.job: Job | None = None
        self.offer: asyncio.Future[Job | None] | None = None
        self.ended = asyncio.Event()

    async def get_ready(self) -> None:
        """Start the process and wait until it says that it is ready, or has ended without."""
        try:
            await self._connect()
            await self._receive(_count_nothing)
        except (EOFError, OSError):
            if self.pid is None:  # there is no template
                self.ended.set()
            await self.ended.wait()
        else:
            self.warm = True

    async def _connect(self) -> None:
        """Start the process, connect the channel to the running event loop, and listen for the process's end."""
        loop = asyncio.get_running_loop()
        channel = await loop.run_in_executor(PROCESSES, self._start)
        try:
            self._reader, self._writer = await asyncio.open_unix_connection(sock=channel, limit=READ_AHEAD)
        except OSError:  # no more files may be opened: nobody can reach the process
            channel.close()
            self._process.kill()
            self._join()
            raise
        loop.add_reader(self._process.sentinel, self._note_end)
        self.alive = True

    def _start(self) -> socket.socket:
        if self._unwanted:
            raise OSError("nobody wants it any more")
        channel, its_channel = socket.socketpair()
        context = multiprocessing.get_context("forkserver")
        self._process = context.Process(target=work, args=(its_channel, *self._args), name="worker", daemon=True)
        with its_channel, _signals_of_the_server_blocked():
            self._process.start()
        self.pid = self._process.pid
        if self._unwanted:
            self._process.kill()
        return channel

    def _note_end(self) -> None:
        loop = asyncio.get_running_loop()
        loop.remove_reader(self._process.sentinel)
        self.alive = False
        self._writer.close()
        self._join()

    def _join(self) -> None:
        joining = asyncio.get_running_loop().run_in_executor(PROCESSES, self._process.join)
        joining.add_done_callback(self._ended)

    def _ended(self, _joined: asyncio.Future[None]) -> None:
        self.exit_code = self._process.exitcode
        self._process.close()
        self.ended.set()
        if self.offer is not None and not self.offer.done():
            self.offer.set_result(None)

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
        length = payload_length + body_length
        try:
            hold(length)
        except Overloaded:
            for start in range(0, length, READ_AHEAD):
                await self._reader.readexactly(min(READ_AHEAD, length - start))
            raise
        payload = await self._reader.readexactly(payload_length)
        reply: Reply = unpack(payload, await self._reader.readexactly(body_length))
        return reply

    def takes(self, job: Job) -> bool:
        """Tell whether it takes a job of this cost."""
        return job.is_cheap or not self.only_cheap

    def kill(self) -> None:
        """End the process at once, if it has not ended, or as soon as it has started."""
        self._unwanted = True
        if self.alive:
            self._process.kill()

    def stop(self) -> None:
        """End the process and wait until it has ended."""
        self.kill()
        if self.alive:
            self._process.join()


@contextmanager
def _signals_of_the_server_blocked() -> Iterator[None]:
    """Let a process that is started inherit that it gets no signals that are for the server alone."""
    resource_tracker.ensure_running()  # by itself, as it lets the signals through that are blocked here
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS_OF_THE_SERVER)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _count_nothing(_size: int) -> None:
    """Hold no bytes: a worker that says that it is ready sends no answer."""
