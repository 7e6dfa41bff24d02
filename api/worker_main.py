"""The process of a worker: its limits, and its channel to the server.

The server imports this, too, so what the work itself needs is imported by the running worker, after its limits are set.
"""

from __future__ import annotations

import gc
import os
import resource
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from api.messages import HEADER, pack, unpack

if TYPE_CHECKING:
    from io import BufferedRWPair
    from socket import socket

    from api.messages import Caps, Reply, Task

NUMERIC_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""The environment variables that limit numeric libraries to one thread: a worker plans one thing at a time."""


def work(channel: socket, caps: Caps) -> None:
    """Be a worker: get ready and say so with None, then answer tasks until the server is no more."""
    os.nice(caps.niceness)
    os.environ.update(dict.fromkeys(NUMERIC_THREADS, "1"))
    limit = caps.memory_mib * 1024 * 1024
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))

    from api.execution import execute, warm_up
    from api.logs import configure_logs

    configure_logs(caps.log_level)
    warm_up(caps)
    gc.collect()
    gc.freeze()
    with suppress(EOFError, ConnectionError), channel.makefile("rwb") as stream:  # until the server is no more
        _send(stream, None)
        while True:
            _send(stream, execute(_receive(stream), caps))


def hide_main_module() -> None:
    """Keep spawned workers from importing the program that started the service, as they would by default."""
    main = sys.modules["__main__"]
    main.__spec__ = None
    vars(main).pop("__file__", None)


def _send(stream: BufferedRWPair[Any, Any], message: Reply | None) -> None:
    for part in pack(message):
        stream.write(part)
    stream.flush()


def _receive(stream: BufferedRWPair[Any, Any]) -> Task:
    header = stream.read(HEADER.size)
    if len(header) < HEADER.size:
        raise EOFError
    payload, body = (stream.read(length) for length in HEADER.unpack(header))
    task: Task = unpack(payload, body)
    return task
