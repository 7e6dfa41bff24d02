"""Structured logs: one JSON object a line, on standard error."""

from __future__ import annotations

import logging
import sys
import traceback
import warnings
from pathlib import PurePath
from typing import TYPE_CHECKING, cast

import orjson
import structlog

if TYPE_CHECKING:
    from typing import BinaryIO, TextIO


class _StandardError:
    """The standard error of the moment: a caller may replace and close it."""

    def write(self, line: str | bytes) -> None:
        """Write text, or bytes without a copy."""
        if isinstance(line, bytes):
            sys.stderr.buffer.write(line)
        else:
            sys.stderr.write(line)

    def flush(self) -> None:
        """Flush text and bytes."""
        sys.stderr.flush()


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
        logger_factory=structlog.BytesLoggerFactory(cast("BinaryIO", _StandardError())),
        cache_logger_on_first_use=True,
    )
    handler = logging.StreamHandler(_StandardError())
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


def where_from(error: BaseException) -> str:
    """Name the type of an exception and the lines it passed, without paths, and without its text: a caller's values."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [f"{f.name} ({PurePath(f.filename).name}:{f.lineno})" for f in reversed(frames)]
    return " < ".join([type(error).__name__, *lines])
