"""Made-up workers that make tests of the pool independent of the machine."""

from __future__ import annotations

import asyncio
import signal
from typing import TYPE_CHECKING

from api.pool.messages import Reply, Task
from api.pool.worker_process import Entry

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.pool.jobs import Job
    from api.pool.messages import Caps


def _load() -> Callable[[Task, Caps], Reply]:
    raise AssertionError("a made-up worker has no process")


ENTRY = Entry("api.pool.messages", _load)
"""The entry of workers that are never started."""


class MadeUpWorker:
    """A worker whose tasks take until the test says so."""

    def __init__(self, caps: Caps, entry: Entry, only_cheap: bool = False) -> None:
        self.only_cheap = only_cheap
        self.pid = self.tasks = 0
        self.warm = self.alive = False
        self.exit_code: int | None = None
        self.job: Job | None = None
        self.offer: asyncio.Future[Job | None] | None = None
        self.ended = asyncio.Event()
        self.begun: list[str] = []
        self.work: asyncio.Future[Reply] | None = None

    async def get_ready(self) -> None:
        self.warm = self.alive = True

    async def run(self, task: Task, hold: Callable[[int], None]) -> Reply:
        self.begun.append(task.operation)
        self.work = asyncio.get_running_loop().create_future()
        return await self.work

    def takes(self, job: Job) -> bool:
        return job.is_cheap or not self.only_cheap

    def finish(self, status: int = 200) -> None:
        assert self.work is not None
        self.work.set_result(Reply(status, "text/plain", b"", code=None if status < 300 else "collision"))

    def die(self, exit_code: int) -> None:
        self.exit_code, self.alive = exit_code, False
        self.ended.set()
        if self.work is not None and not self.work.done():
            self.work.set_exception(EOFError())

    def kill(self) -> None:
        if not self.ended.is_set():
            self.die(-signal.SIGKILL)

    stop = kill
