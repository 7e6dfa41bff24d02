"""Messages between the server and its workers. Light to import: both sides do."""

from __future__ import annotations

import pickle
import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from api.base.codings import IDENTITY

if TYPE_CHECKING:
    from collections.abc import Mapping

    from api.base.codings import Coding

HEADER = struct.Struct("!QQ")
"""The lengths in bytes ahead of a message on the channel between server and worker. They are the length of the pickled
message without its body, and the length of its body, which follow."""


JOINED_BYTES = 2**16
"""The largest body that goes over a channel in one piece with the part ahead of it, bytes. To copy it takes less time
than to wake the other side twice."""


@dataclass(frozen=True)
class Caps:
    """The bounds on one request to a worker.

    Attributes:
        max_deadline: The longest deadline, s.
        max_waypoints: The most waypoints or poses of a request.
        max_samples: The most values of an answer, and the most rows of a request.
        memory_mib: The private memory that a worker may allocate, MiB.
        log_level: The least severe event that a worker logs.
        niceness: The niceness of a worker, which lets the server go first (`nice(2)`).
    """

    max_deadline: float
    max_waypoints: int
    max_samples: int
    memory_mib: int
    log_level: str = "info"
    niceness: int = 0


@dataclass(frozen=True)
class Task:
    """One request for a worker, its body as bytes.

    Attributes:
        operation: The id of the operation.
        instance: The path of the request, for problem documents.
        submitted: When it was given to the pool, s on the monotonic clock that all processes share.
        deadline: When the answer must be there, s on the same clock.
        body: The body as it came.
        arguments: The arguments of the operation besides the body.
        client: The client that asks, with whom others take turns; empty: the service itself.
        coding: The coding of the answer, unless that is a refusal.
    """

    operation: str
    instance: str
    submitted: float
    deadline: float
    body: bytes = b""
    arguments: Mapping[str, Any] = field(default_factory=dict)
    client: str = ""
    coding: Coding = IDENTITY


class PlanFigures(NamedTuple):
    """The figures of a plan for the metrics.

    Attributes:
        backend: The kind of its back end.
        ratios: The largest share of an enforced limit that it uses, without unit, by quantity.
    """

    backend: str
    ratios: Mapping[str, float]


@dataclass(frozen=True)
class Reply:
    """What to send back to the caller, its body as bytes.

    Attributes:
        status: The HTTP status.
        media_type: The media type of the body.
        body: The body, to be sent as it is.
        timings: The seconds that each stage took, for the `Server-Timing` header.
        headers: Further HTTP headers.
        result: A value for the server, not for the caller.
        code: The code of the problem document that the body is; None: it is none.
        plan: What there is to say of the plan, if there is one.
        failure: Where an unexpected exception came from, for the log. It holds no values of the caller.
        worker_is_fit: Whether the worker may take another task. After an error that nobody foresaw it may not: one that
            met its memory cap inside a C++ library keeps failing.
    """

    status: int
    media_type: str
    body: bytes
    timings: Mapping[str, float] = field(default_factory=dict)
    headers: Mapping[str, str] = field(default_factory=dict)
    result: Any = None
    code: str | None = None
    plan: PlanFigures | None = None
    failure: str | None = None
    worker_is_fit: bool = True


def pack(message: Task | Reply | None) -> list[bytes]:
    """Write a message as the pieces that go over a channel: the part ahead of the body, and the body."""
    fields = {} if message is None else {**vars(message)}
    body: bytes = fields.pop("body", b"")
    kind = None if message is None else type(message)
    payload = pickle.dumps((kind, fields), pickle.HIGHEST_PROTOCOL)
    pieces = [HEADER.pack(len(payload), len(body)) + payload, body]
    return pieces if len(body) > JOINED_BYTES else [b"".join(pieces)]


def unpack(payload: bytes, body: bytes) -> Any:
    """Read a message that `pack` wrote, from the other side's pickle and body."""
    kind, fields = pickle.loads(payload)  # noqa: S301 - from our own process
    return None if kind is None else kind(body=body, **fields)
