"""What an operation is. Its route, its OpenAPI entry and its row in the worker's table follow from one declaration."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from api.access.keys import Scope
    from api.pool.messages import Reply
    from api.tasks.work import Work

CONNECTION_CODES = (
    "malformed_request",
    "request_timeout",
    "foreign_origin",
    "misdirected_request",
    "too_many_requests",
    "header_too_large",
)
"""Codes of the problem documents that may be the answer to anything that arrives on a connection."""

ACCESS_CODES = ("unauthorized", "forbidden", "database_unavailable")
"""Codes of the problem documents that may be the answer to anything that needs a key, where keys are asked for."""

WORKER_CODES = ("overloaded", "deadline_exceeded", "internal_error")
"""Codes of the problem documents that may be the answer to anything a worker runs."""

DATABASE_CODES = ("database_unavailable", *WORKER_CODES)
"""Codes of the problem documents that may be the answer to anything that the database is asked for."""

BODY_CODES = ("invalid_request", "payload_too_large", "unsupported_media_type", "memory_exceeded", *DATABASE_CODES)
"""Codes of the problem documents that may be the answer to anything with a body."""


@dataclass(frozen=True)
class Operation:
    """One operation of the service.

    Attributes:
        id: Its `operationId`.
        method: Its HTTP method.
        path: Its path, with parameters in braces.
        tag: Its group in the documentation.
        summary: What it does, in one sentence.
        description: What there is to know besides.
        answer: The schema of its answer, `bytes` for a file; None: the answer has no body.
        run: The function that runs it in a worker; None: the server answers by itself (`api/routes/`).
        request: The schema of the request's body; None: the request has no body.
        scope: What a key has to allow, where keys are asked for; None: anybody may use it.
        status: The HTTP status of success.
        also: Other statuses with the same schema, and what they mean.
        codes: Codes of the problem documents that may be the answer instead, besides `CONNECTION_CODES`
            and `ACCESS_CODES`.
        examples: Request bodies by name.
        pages: Whether the answer is a page of a list, which `limit` and `cursor` choose.
        formats: Whether `Accept` chooses the form of the answer; so does `?format=`, which is in the description only:
            generated clients read the one form that they know.
        file: Whether the answer is a file in the form that `?format=` names, which is required.
        formats_of_plans: Whether `?format=` chooses the form of the plans in the answer.
        headers: The headers that are read, and what each is for.
        media_type: The media type of the answer.
        also_as: Media types of files that `Accept` or `?format=` chooses in place of it.
        shared: Whether the answer follows from the request, the robot that it names and the version of the service
            alone. It is computed once for all who ask the same, kept for a while, and has an `ETag`.
        leads_to: The ids of operations whose path has the `id` of the answer.
        lines: Whether the body may also be newline-delimited JSON, an entry of its only list a line.
    """

    id: str
    method: str
    path: str
    tag: str
    summary: str
    description: str
    answer: Any
    run: Callable[[Work], Reply] | None = None
    request: Any = None
    scope: Scope | None = "plan"
    status: int = 200
    also: Mapping[int, str] = field(default_factory=dict)
    codes: tuple[str, ...] = ()
    examples: Mapping[str, Any] = field(default_factory=dict)
    pages: bool = False
    formats: bool = False
    file: bool = False
    formats_of_plans: bool = False
    headers: Mapping[str, str] = field(default_factory=dict)
    media_type: str = "application/json"
    also_as: tuple[str, ...] = ()
    shared: bool = False
    leads_to: tuple[str, ...] = ()
    lines: bool = False
