"""The server process: workers first, then the application, until SIGTERM."""

from __future__ import annotations

import resource
import signal
import sys
from typing import TYPE_CHECKING, NoReturn

from api.base.logs import configure_logs
from api.base.settings import Settings
from api.pool.pool import WorkerPool
from api.pool.worker_process import hide_main_module
from api.work.entry import ENTRY

if TYPE_CHECKING:
    from types import FrameType

DRAIN_GRACE = 5
"""The time that requests in flight have to finish once the server begins to stop, s on top of the longest deadline."""

RESERVED_FILES = 64
"""The open files that the process needs besides clients and workers: libraries, sockets, the event loop."""

FILES_OF_A_WORKER = 4
"""The open files that the process needs for a worker: its channel and its end, twice while it is replaced."""


def serve(settings: Settings | None = None) -> NoReturn:
    """Run the service until SIGTERM or SIGINT; requests in flight are finished first. Exits with 0."""
    settings = settings or Settings()
    configure_logs(settings.log_level)
    settings = within_open_files(settings)
    # uvicorn raises the signal that stopped it once more, for the handler that was there before it.
    for stop_signal in (signal.SIGTERM, signal.SIGINT):
        signal.signal(stop_signal, _exit_cleanly)
    hide_main_module()
    pool = WorkerPool(settings, ENTRY)  # the workers import and warm up while this process imports the rest
    try:
        import uvicorn

        from api.app import create_app
        from api.http.transport.connections import bounded_connections

        app = create_app(settings, pool)
        uvicorn.run(
            app,
            host=settings.host,
            port=settings.port,
            loop="uvloop",
            http=bounded_connections(settings, app.state.service.metrics, app.state.service.shedding),
            proxy_headers=bool(settings.trusted_proxies),
            forwarded_allow_ips=list(settings.trusted_proxies),
            timeout_keep_alive=settings.keep_alive_timeout,
            ws="none",
            access_log=False,
            log_config=None,
            server_header=False,
            timeout_graceful_shutdown=int(settings.max_deadline) + DRAIN_GRACE,
        )
    finally:
        pool.stop()
    sys.exit(0)


def within_open_files(settings: Settings) -> Settings:
    """Ask for as many open files as the connections need, and take no more connections than the process is given."""
    besides = RESERVED_FILES + FILES_OF_A_WORKER * (settings.workers + settings.express_workers)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if 0 <= soft < settings.max_connections + besides:  # negative: there is no limit
        soft = settings.max_connections + besides if hard < 0 else min(settings.max_connections + besides, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    given = settings.max_connections if soft < 0 else max(1, soft - besides)
    return settings.model_copy(update={"max_connections": min(settings.max_connections, given)})


def _exit_cleanly(_signal: int, _frame: FrameType | None) -> NoReturn:
    sys.exit(0)
