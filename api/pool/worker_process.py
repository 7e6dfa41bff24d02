"""The process of a worker: its limits, and its channel to the server."""

from __future__ import annotations

import os
import resource
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

from api.base.logs import configure_logs
from api.pool.memory import Memory
from api.pool.messages import HEADER, pack, unpack

if TYPE_CHECKING:
    from collections.abc import Callable
    from io import BufferedRWPair
    from socket import socket

    from api.pool.messages import Caps, Reply, Task


class Entry(NamedTuple):
    """The entry of workers to their work. The server hands it to the pool, and loads none of the work.

    Attributes:
        template: The module that is imported once, by the process that workers are forked from.
        load: Imports the function that executes a task, in the worker.
    """

    template: str
    load: Callable[[], Callable[[Task, Caps], Reply]]


def work(channel: socket, caps: Caps, load: Callable[[], Callable[[Task, Caps], Reply]]) -> None:
    """Run a worker: set its limits, send None once it is ready, then answer tasks until the server ends."""
    execute = load()
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
