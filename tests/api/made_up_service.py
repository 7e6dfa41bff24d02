"""The service over HTTP in a thread, with a real database; its tasks run in the same process, so it starts quickly.

Each task may take as much memory as in a worker: one that wants more is refused, and ends no process of tests.
"""

from __future__ import annotations

import re
import resource
import threading
from collections import Counter
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
import uvicorn

from api.app import create_app
from api.base.settings import Settings
from api.pool.messages import Caps, Reply, Task
from api.work.execution import execute
from tests.api.conftest import wait_until

if TYPE_CHECKING:
    from collections.abc import Iterator


MEMORY_MIB = 1024
"""The private memory that a task may take, MiB, equal to a worker's memory in the service's own settings."""


@contextmanager
def limited_memory(mib: int) -> Iterator[None]:
    """Limit the additional private memory of the process."""
    [taken_kib] = re.findall(r"VmData:\s+(\d+) kB", Path("/proc/self/status").read_text())
    before = resource.getrlimit(resource.RLIMIT_DATA)
    resource.setrlimit(resource.RLIMIT_DATA, (int(taken_kib) * 1024 + mib * 2**20, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


class WorkersInTheProcess:
    """Runs tasks at once, like a worker."""

    size = warm_workers = most_behind = 1
    ready, ended = True, 0

    def __init__(self, settings: Settings) -> None:
        self._caps = Caps(settings.max_deadline, settings.max_waypoints, settings.max_samples, MEMORY_MIB)

    def is_full(self, client: str) -> bool:
        return False

    def states(self) -> Counter[tuple[str, str]]:
        return Counter({("all", "idle"): 1})

    def waiting(self) -> dict[str, int]:
        return {"requests": 0, "batches": 0}

    def attach(self) -> None: ...

    async def detach(self) -> None: ...

    def stop(self) -> None: ...

    async def run(self, task: Task, kind: object, hold: object) -> Reply:
        with limited_memory(MEMORY_MIB):
            return execute(task, self._caps)

    async def run_behind(self, task: Task, kind: object, seconds: float) -> Reply:
        with limited_memory(MEMORY_MIB):
            return execute(task, self._caps)


@contextmanager
def made_up_service(**settings: Any) -> Iterator[httpx.Client]:
    asked = Settings(**settings)
    app = create_app(asked, WorkersInTheProcess(asked))  # type: ignore[arg-type]
    server = uvicorn.Server(uvicorn.Config(app, port=0, log_config=None, access_log=False, ws="none"))
    thread = threading.Thread(target=server.run)
    thread.start()
    wait_until(lambda: server.started)
    port = server.servers[0].sockets[0].getsockname()[1]
    try:
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=60.0, trust_env=False) as client:
            yield client
    finally:
        server.should_exit = True
        thread.join()
