"""Structured logs: one JSON object a line, on standard error."""

from __future__ import annotations

import logging
import sys
import warnings
from pathlib import PurePath
from typing import TYPE_CHECKING

import orjson
import structlog

if TYPE_CHECKING:
    from typing import TextIO


def configure_logs(level: str) -> None:
    """Set up structlog, the standard library's loggers (uvicorn's) and its warnings to write the same lines."""
    shared: list[structlog.typing.Processor] = [
        structlog.contextvars.merge_contextvars,
        structlog.stdlib.add_log_level,
        structlog.processors.TimeStamper(fmt="iso", utc=True),
    ]
    number = logging.getLevelNamesMapping()[level.upper()]
    structlog.configure(
        processors=[*shared, structlog.processors.JSONRenderer(serializer=orjson.dumps)],
        wrapper_class=structlog.make_filtering_bound_logger(number),
        logger_factory=structlog.BytesLoggerFactory(sys.stderr.buffer),
        cache_logger_on_first_use=True,
    )
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(
            foreign_pre_chain=shared,
            processors=[
                structlog.stdlib.ProcessorFormatter.remove_processors_meta,
                structlog.processors.JSONRenderer(),
            ],
        )
    )
    root = logging.getLogger()
    root.handlers = [handler]
    root.setLevel(max(number, logging.INFO))
    warnings.showwarning = _log_warning


def _log_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Log a warning of a library, without the path of its file: that is nobody's business but the host's."""
    where = f"{PurePath(filename).name}:{lineno}"
    structlog.get_logger().warning("library_warning", category=category.__name__, message=str(message), where=where)
