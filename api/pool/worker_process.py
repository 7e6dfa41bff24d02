"""The process of a worker: its limits, and its channel to the server.

The server imports this, too, so what the work itself needs is imported by the running worker.
"""

from __future__ import annotations

import os
import resource
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from api.pool.messages import HEADER, pack, unpack

if TYPE_CHECKING:
    from io import BufferedRWPair
    from socket import socket

    from api.pool.messages import Caps, Reply, Task


def work(channel: socket, caps: Caps) -> None:
    """Be a worker: set its limits and say with None that it is ready, then answer tasks until the server is no more."""
    from api.base.logs import configure_logs
    from api.pool.memory import Memory
    from api.work.execution import execute

    os.nice(caps.niceness)
    limit = caps.memory_mib * 1024 * 1024
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
    configure_logs(caps.log_level)
    with suppress(EOFError, ConnectionError), channel.makefile("rwb") as stream:  # until the server is no more
        _send(stream, None)
        memory = Memory()
        while True:
            _send(stream, execute(_receive(stream), caps))
            memory.give_back()


def hide_main_module() -> None:
    """Keep workers from importing the program that started the service, as they would by default."""
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
