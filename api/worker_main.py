"""What a worker process runs. Light to import: the parent does, and so does every worker before its first breath."""

from __future__ import annotations

import gc
import os
import pickle
import resource
import signal
import struct
import sys
import time
import traceback
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping
    from io import BufferedRWPair
    from socket import socket

HEADER = struct.Struct("!I")
"""Length of a pickled message, ahead of it on the channel between server and worker."""

NUMERIC_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Caps:
    """What one request may ask of a worker."""

    max_deadline: float
    max_waypoints: int
    max_samples: int
    memory_mib: int


@dataclass(frozen=True)
class Task:
    """One request, as bytes, for a worker.

    Attributes:
        operation: Id of the operation.
        instance: Path of the request, for problem documents.
        body: As it came.
        submitted: When, on the monotonic clock that all processes share, s.
        deadline: On the same clock, s.
        arguments: What the operation needs besides the body.
    """

    operation: str
    instance: str
    submitted: float
    deadline: float
    body: bytes = b""
    arguments: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Reply:
    """What to send back, as bytes.

    Attributes:
        status: HTTP status.
        media_type: Of the body.
        body: To be sent as it is.
        timings: For the `Server-Timing` header: name to s.
        headers: Further headers.
        result: For the parent, not for the caller.
        failure: For the log: where an unexpected exception came from. It holds no values.
    """

    status: int
    media_type: str
    body: bytes
    timings: Mapping[str, float] = field(default_factory=dict)
    headers: Mapping[str, str] = field(default_factory=dict)
    result: Any = None
    failure: str | None = None


def work(channel: socket, caps: Caps) -> None:
    """Be a worker: get ready and say so with None, then answer tasks until the parent is no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group: the parent drains, then ends us
    os.environ.update(dict.fromkeys(NUMERIC_THREADS, "1"))
    limit = caps.memory_mib * 1024 * 1024
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))

    from api.tasks import warm_up

    warm_up(caps)
    gc.collect()
    gc.freeze()
    with suppress(EOFError, ConnectionError), channel.makefile("rwb") as stream:  # until the parent is no more
        _send(stream, None)
        while True:
            _send(stream, execute(_receive(stream), caps))


def pack(message: Task | Reply | None) -> bytes:
    """A message as it goes over a channel: the length of its pickle, then the pickle."""
    payload = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
    return HEADER.pack(len(payload)) + payload


def _send(stream: BufferedRWPair[Any, Any], message: Reply | None) -> None:
    stream.write(pack(message))
    stream.flush()


def _receive(stream: BufferedRWPair[Any, Any]) -> Task:
    header = stream.read(HEADER.size)
    if len(header) < HEADER.size:
        raise EOFError
    task: Task = pickle.loads(stream.read(*HEADER.unpack(header)))  # noqa: S301 - from the parent
    return task


def execute(task: Task, caps: Caps) -> Reply:
    """Run one task; whatever happens, a reply comes back."""
    from api import errors
    from api.tasks import RUN
    from planner.errors import PlanningError

    started = time.monotonic()
    queue = {"queue": started - task.submitted}
    failure = None
    try:
        if started >= task.deadline:
            raise errors.DeadlineExceeded("the deadline passed while the request waited for a worker")
        reply = RUN[task.operation](task, caps)
        return replace(reply, timings=queue | dict(reply.timings))
    except (PlanningError, errors.ServiceError) as error:
        refusal: PlanningError | errors.ServiceError = error
    except MemoryError:
        refusal = errors.MemoryExceeded("the request needs more memory than a worker may use")
    except Exception as error:  # noqa: BLE001 - the boundary of the process: nothing may leave it but a reply
        refusal = errors.InternalError("the service failed on this request")
        failure = where_from(error)
    status, body = errors.problem(refusal, task.instance)
    return Reply(status, errors.MEDIA_TYPE, body, timings=queue, failure=failure)


def where_from(error: BaseException) -> str:
    """Type and place of an exception, without its text, which may hold a caller's values."""
    frames = traceback.extract_tb(error.__traceback__)
    return type(error).__name__ + "".join(f" < {f.name} ({f.filename}:{f.lineno})" for f in reversed(frames))


def hide_main_module() -> None:
    """Keep spawned workers from importing the program that started the service, as they would by default."""
    main = sys.modules["__main__"]
    main.__spec__ = None
    vars(main).pop("__file__", None)
