"""Parts of a route's declaration that FastAPI cannot find out: schemas that workers validate, and problems."""

from __future__ import annotations

from http import HTTPStatus
from typing import TYPE_CHECKING, Any

from api.base.errors import STATUS_OF_CODE
from api.base.problem_documents import MEDIA_TYPE

if TYPE_CHECKING:
    from collections.abc import Mapping

JSON = "application/json"
"""The media type of requests and of ordinary answers."""

LINES = "application/x-ndjson"
"""The media type of newline-delimited JSON."""

CONNECTION_CODES = (
    "malformed_request",
    "request_timeout",
    "foreign_origin",
    "misdirected_request",
    "too_many_requests",
    "header_too_large",
)
"""Codes of the problem documents that may answer any request."""

ACCESS_CODES = ("unauthorized", "forbidden", "database_unavailable")
"""Codes of the problem documents that may answer a request that needs a key, where the service requires keys."""

WORKER_CODES = ("overloaded", "deadline_exceeded", "internal_error")
"""Codes of the problem documents that may answer a request that a worker runs."""

DATABASE_CODES = ("database_unavailable", *WORKER_CODES)
"""Codes of the problem documents that may answer a request that reads the database."""

BODY_CODES = ("invalid_request", "payload_too_large", "unsupported_media_type", "memory_exceeded", *DATABASE_CODES)
"""Codes of the problem documents that may answer a request with a body."""

RATE_HEADERS = {
    "RateLimit-Limit": "The most requests in a minute.",
    "RateLimit-Remaining": "The requests that are left now.",
    "RateLimit-Reset": "All requests are back after that long, s.",
}
"""The headers with the allowance that is left to a key, where the service requires keys."""

SCHEMA = "#/components/schemas/{name}"
"""The place of a schema in the OpenAPI document."""

PROBLEM_EXAMPLE = "#/components/examples/{code}"
"""The place of the example of a problem document in the OpenAPI document."""

NOT_MODIFIED: dict[int | str, dict[str, Any]] = {
    304: {"description": "The answer is the one that `If-None-Match` quotes."}
}
"""The answer to GET that a client has already, besides what `returns` describes."""

BYTES = {"type": "string", "format": "binary"}
"""The schema of a file."""


def takes(schema: Any, *, lines: bool = False) -> dict[str, Any]:
    """Describe the body of a request, which a worker validates (`openapi_extra` of a route).

    Args:
        schema: The schema of the body.
        lines: Whether the body may also be newline-delimited JSON, an entry of its only list a line.
    """
    forms = {JSON: {"schema": reference(schema)}} | ({LINES: {"schema": BYTES}} if lines else {})
    return {"requestBody": {"required": True, "content": forms}}


def returns(
    schema: Any,
    *,
    codes: tuple[str, ...] = (),
    status: int = HTTPStatus.OK,
    also: Mapping[int, str] | None = None,
    media_type: str = JSON,
    shared: bool = False,
    file: bool = False,
    leads_to: tuple[str, ...] = (),
    open_to_all: bool = False,
) -> dict[int | str, dict[str, Any]]:
    """Describe the answers of a route by their status (`responses` of a route).

    Args:
        schema: The schema of the answer; None: it has no body.
        codes: Codes of the problem documents that may be the answer, besides `CONNECTION_CODES` and `ACCESS_CODES`.
        status: The status of success.
        also: Other statuses of success with the same schema, and their meaning.
        media_type: The media type of the answer.
        shared: Whether the answer has an `ETag`, since equal requests have equal answers.
        file: Whether the answer is a file with a name.
        leads_to: The ids of operations whose path has the `id` of the answer.
        open_to_all: Whether no key is needed where the service requires keys.
    """
    success: dict[str, Any] = {"description": "Done."}
    if schema is not None:
        text = BYTES if file else {"type": "string"}
        content = {"schema": reference(schema) if media_type == JSON else text}
        success = {"description": "Success.", "content": {media_type: content}}
    if leads_to:
        links = {name: {"operationId": name, "parameters": {"id": "$response.body#/id"}} for name in leads_to}
        success["links"] = links
    if status in {HTTPStatus.CREATED, HTTPStatus.ACCEPTED}:
        success["headers"] = {"Location": _header("Where it is.")}
    if file:
        success["headers"] = {"Content-Disposition": _header("The name of the file.")}
    responses: dict[int | str, dict[str, Any]] = {status: success}
    for other, meaning in (also or {}).items():
        responses[other] = success | {"description": meaning}
    if shared:
        responses[status] = success | {"headers": success.get("headers", {}) | {"ETag": _header("Names the answer.")}}
    access_codes = () if open_to_all else ACCESS_CODES
    return responses | _problems(dict.fromkeys((*CONNECTION_CODES, *access_codes, *codes)), open_to_all)


def reference(schema: Any) -> dict[str, Any]:
    """Refer to a schema by its name."""
    return {"$ref": SCHEMA.format(name=schema.__name__)}


def _problems(codes: Mapping[str, None], open_to_all: bool) -> dict[int | str, dict[str, Any]]:
    """Describe the problem documents with these codes, by status."""
    by_status: dict[int, list[str]] = {}
    for code in codes:
        by_status.setdefault(STATUS_OF_CODE[code], []).append(code)
    responses: dict[int | str, dict[str, Any]] = {}
    for status, of_status in sorted(by_status.items()):
        content = {
            "schema": {"$ref": SCHEMA.format(name="ProblemDocument")},
            "examples": {code: {"$ref": PROBLEM_EXAMPLE.format(code=code)} for code in of_status},
        }
        description = f"{HTTPStatus(status).phrase}: " + ", ".join(f"`{code}`" for code in of_status)
        responses[status] = {"description": description, "content": {MEDIA_TYPE: content}}
        headers = {"Retry-After": "Wait that long, s."} if {"overloaded", "too_many_requests"} & {*of_status} else {}
        if status == HTTPStatus.TOO_MANY_REQUESTS and not open_to_all:
            headers |= RATE_HEADERS
        if headers:
            responses[status]["headers"] = {name: _header(text, "integer") for name, text in headers.items()}
    return responses


def _header(description: str, kind: str = "string") -> dict[str, Any]:
    return {"description": description, "schema": {"type": kind}}
