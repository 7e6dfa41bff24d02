"""Refusals become problem documents (RFC 9457)."""

from __future__ import annotations

from http import HTTPStatus
from typing import TYPE_CHECKING, Any, Protocol
from urllib.parse import quote

import orjson

from api.base.errors import STATUS_OF_CODE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from api.base.errors import ServiceError

MEDIA_TYPE = "application/problem+json"
"""The media type of problem documents (RFC 9457)."""


class Refusal(Protocol):
    """An error that callers distinguish by its code."""

    @property
    def code(self) -> str:
        """The code, which no other kind of error has."""

    @property
    def title(self) -> str:
        """The kind of the error in words."""


def problem_document(error: ServiceError, instance: str) -> tuple[int, bytes]:
    """Give the HTTP status and the problem document of an error; `instance` is the path of the request, decoded."""
    return write_problem(error, error.message, error.details, instance)


def write_problem(error: Refusal, detail: str, fields: Mapping[str, Any], instance: str) -> tuple[int, bytes]:
    """Give the HTTP status and the problem document of an error with this text and these further fields."""
    status = STATUS_OF_CODE.get(error.code, HTTPStatus.UNPROCESSABLE_ENTITY)
    document = {
        "type": f"urn:trajectory-planner:problem:{error.code}",
        "title": error.title,
        "status": int(status),
        "detail": detail,
        "instance": quote(instance),
        "code": error.code,
        **fields,
    }
    return status, orjson.dumps(document, option=orjson.OPT_SERIALIZE_NUMPY)
