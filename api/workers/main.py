"""The process of a worker: its limits, and its channel to the server.

The server imports this, too, so what the work itself needs is imported by the running worker.
"""

from __future__ import annotations

import os
import resource
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from api.workers.messages import HEADER, pack, unpack

if TYPE_CHECKING:
    from io import BufferedRWPair
    from socket import socket

    from api.workers.messages import Caps, Reply, Task


def work(channel: socket, caps: Caps) -> None:
    """Be a worker: set its limits and say with None that it is ready, then answer tasks until the server is no more.

    A thread that stands back may not come forward again without rights, so tasks that do have a thread of their own.
    """
    from api.logs import configure_logs
    from api.workers.execution import execute

    os.nice(caps.niceness)
    limit = caps.memory_mib * 1024 * 1024
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
    configure_logs(caps.log_level)
    with (
        suppress(EOFError, ConnectionError),  # until the server is no more
        channel.makefile("rwb") as stream,
        ThreadPoolExecutor(1, "behind", _stand_back) as behind,
    ):
        _send(stream, None)
        while True:
            task = _receive(stream)
            _send(stream, behind.submit(execute, task, caps).result() if task.stands_back else execute(task, caps))


def _stand_back() -> None:
    """Leave the processor, from this thread on, to whatever else wants it, at once.

    A greater `nice` has that effect on the average only: what wakes waits some milliseconds until it gets its turn.
    """
    with suppress(OSError):  # a sandbox may not have it
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


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
