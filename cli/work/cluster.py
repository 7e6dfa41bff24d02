"""This machine as a part of a cluster: the work of `planner worker`."""

from __future__ import annotations

import asyncio

from api.base.logs import configure_logs
from api.base.settings import Settings
from api.batches.cluster_worker import join
from api.pool.worker_process import hide_main_module


def join_cluster(scheduler: str, workers: int | None) -> None:
    """Plan batches for a cluster until SIGINT or SIGTERM; see `planner worker`."""
    settings = Settings(access="open", **({} if workers is None else {"workers": workers}))  # type: ignore[arg-type]
    configure_logs(settings.log_level)
    hide_main_module()
    asyncio.run(join(scheduler, settings))
