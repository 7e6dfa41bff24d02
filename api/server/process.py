"""The server process: workers first, then the application, until SIGTERM."""

from __future__ import annotations

import signal
import sys
from typing import TYPE_CHECKING, NoReturn

from api.logs import configure_logs
from api.server.workers import WorkerPool
from api.settings import Settings
from api.worker_main import hide_main_module

if TYPE_CHECKING:
    from types import FrameType

DRAIN_GRACE = 5
"""The time that requests in flight have to finish once the server is told to stop, s on top of the longest deadline."""


def serve(settings: Settings | None = None) -> NoReturn:
    """Run the service until SIGTERM or SIGINT; requests in flight are finished first. Exits with 0."""
    settings = settings or Settings()
    configure_logs(settings.log_level)
    # uvicorn raises the signal that stopped it once more, for the handler that was there before it.
    for stop_signal in (signal.SIGTERM, signal.SIGINT):
        signal.signal(stop_signal, _exit_cleanly)
    hide_main_module()
    pool = WorkerPool(settings)  # the workers import and warm up while this process imports the rest
    try:
        import uvicorn

        from api.server.app import create_app

        uvicorn.run(
            create_app(settings, pool),
            host=settings.host,
            port=settings.port,
            loop="uvloop",
            http="httptools",
            ws="none",
            access_log=False,
            log_config=None,
            server_header=False,
            timeout_graceful_shutdown=int(settings.max_deadline) + DRAIN_GRACE,
        )
    finally:
        pool.stop()
    sys.exit(0)


def _exit_cleanly(_signal: int, _frame: FrameType | None) -> NoReturn:
    sys.exit(0)
