"""A machine of the cluster: a Dask worker whose work is done by planning processes, as in the service.

Each has a cap on its memory and is killed at its deadline. So a hung solver costs its own request, not the Dask
worker. Robots and solvers stay built in the processes, by content.
"""

from __future__ import annotations

import asyncio
import signal
import tempfile
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import structlog
from distributed import Worker, WorkerPlugin, get_worker

from api.base.version import service_version
from api.batches.planners import PoolPlanners
from api.pool.pool import WorkerPool
from api.work.entry import ENTRY

if TYPE_CHECKING:
    from api.base.settings import Settings
    from api.batches.planners import Chunk
    from api.pool.messages import Reply

REJOINING = 1.0
"""The time before a worker whose scheduler is gone joins again, s."""

PLUGIN = "planners"
"""The name under which the planning processes of a Dask worker are found."""

log = structlog.get_logger()


class OtherVersion(Exception):
    """The service that sent the work has another version."""


class _Planners(WorkerPlugin):  # type: ignore[misc]
    """The planning processes of a Dask worker."""

    name = PLUGIN

    def __init__(self, planners: PoolPlanners) -> None:
        self.planners = planners


async def plan_chunk(version: str, chunk: Chunk) -> tuple[float, list[Reply]]:
    """Plan the requests of a chunk in the processes of this machine, and return the time, s, too.

    Raises:
        OtherVersion: This machine has another version than the service, and would plan otherwise.
    """
    if version != service_version():
        raise OtherVersion(f"the service has version {version}, this machine {service_version()}")
    planners: PoolPlanners = get_worker().plugins[PLUGIN].planners
    started = time.monotonic()
    replies: list[Reply] = []
    while len(replies) < len(chunk.items):
        replies += await planners.plan(chunk._replace(items=chunk.items[len(replies) :]))
    return time.monotonic() - started, replies


async def join(scheduler: str, settings: Settings) -> None:
    """Join the cluster until SIGTERM or SIGINT, and again each time the scheduler was away."""
    everything = settings.model_copy(update={"express_workers": 0, "batch_workers": settings.workers})
    pool = WorkerPool(everything, ENTRY)
    pool.attach()
    stopped = asyncio.Event()
    for stop_signal in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(stop_signal, stopped.set)
    working = asyncio.create_task(_work_again_and_again(scheduler, pool, everything))
    await stopped.wait()
    working.cancel()
    await asyncio.gather(working, return_exceptions=True)
    await pool.detach()
    pool.stop()


async def _work_again_and_again(scheduler: str, pool: WorkerPool, settings: Settings) -> None:
    options: dict[str, Any] = {"nthreads": settings.workers, "memory_limit": 0, "dashboard": False}
    options["local_directory"] = tempfile.gettempdir()  # the folder that it runs in may be read-only
    while True:
        plugin = _Planners(PoolPlanners(pool, settings))
        worker: Any = Worker(scheduler, plugins=(plugin,), silence_logs=30, **options)
        try:
            with suppress(OSError):  # the scheduler is not there yet
                await worker
                log.info("joined", scheduler=scheduler, workers=settings.workers)
                await worker.finished()
        finally:
            await worker.close(reason="planner-worker-ends")
        log.warning("cluster_unreachable", scheduler=scheduler)
        await asyncio.sleep(REJOINING)
