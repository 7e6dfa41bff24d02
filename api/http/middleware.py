"""Every request gets an id, a line in the log, timings in a header, and a problem document for what nobody caught."""

from __future__ import annotations

import logging
import time
from functools import lru_cache
from http import HTTPStatus
from typing import TYPE_CHECKING

import structlog
from starlette.requests import ClientDisconnect
from starlette.responses import Response

from api.base.content_policies import security_headers
from api.base.errors import InternalError, ServiceError
from api.base.logs import where_from
from api.base.problem_documents import MEDIA_TYPE, problem_document
from api.http.access.access import client_by_address
from api.http.transport.senders import request_id
from api.telemetry.traces import trace_id_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fastapi.routing import APIRoute
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

    from api.base.byte_budget import Traffic
    from api.http.access.sites import Sites
    from api.telemetry.metrics import Metrics
    from api.telemetry.traces import Traces

TIMINGS = ("queue", "validate", "plan", "serialise")
"""The stages of a task in the order of the `Server-Timing` header."""

FAILED = InternalError()
"""The answer to a request that raised an unexpected exception."""

RawHeaders = list[tuple[bytes, bytes]]
"""Headers as ASGI has them."""

log = structlog.get_logger()


class RequestContext:
    """The outermost layer of the application. It is pure ASGI, so that it costs microseconds."""

    def __init__(self, app: ASGIApp, sites: Sites, traffic: Traffic, metrics: Metrics, traces: Traces) -> None:
        self.app = app
        self._sites = sites
        self._traffic = traffic
        self._metrics = metrics
        self._traces = traces

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See the ASGI specification."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        arrived = time.monotonic()
        state = scope.setdefault("state", {})
        client = client_by_address(scope)
        share = self._traffic.share(client.name)
        state |= {"arrived": arrived, "timings": {}, "request_id": request_id(scope["headers"]), "share": share}
        state |= {"submitted": None, "code": None, "client": client, "quota": None, "grants": []}
        until_answered = state["until_answered"] = [share.release]
        traceparent = dict(scope["headers"]).get(b"traceparent", b"").decode("latin-1")
        structlog.contextvars.bind_contextvars(trace_id=trace_id_of(traceparent))
        status, sent = 0, 0

        async def send_and_note(message: Message) -> None:
            nonlocal status, sent
            if message["type"] == "http.response.start":
                status = message["status"]
                own = {"x-request-id": state["request_id"]}
                so_far = time.monotonic() - arrived
                own["server-timing"] = _server_timing(state["timings"], so_far)
                self._traces.note(state["code"], state["timings"], so_far - (state["submitted"] or 0.0))
                if state["grants"]:
                    grants = (grant.headers() for grant in state["grants"])
                    own |= min(grants, key=lambda left: int(left["RateLimit-Remaining"]))
                message = {**message, "headers": _with_own(message["headers"], own)}
            else:
                sent += len(message.get("body", b""))
            await send(message)

        failure = None
        try:
            self._sites.check(scope)
            await self.app(scope, receive, send_and_note)
        except ServiceError as refusal:
            state["code"] = refusal.code
            await _answer(refusal, scope)(scope, receive, send_and_note)
        except ClientDisconnect:
            failure = "client_disconnected"
        except Exception as error:  # noqa: BLE001 - the outermost boundary: a problem, not a traceback
            failure = where_from(error)
            if status == 0:
                state["code"] = FAILED.code
                await _answer(FAILED, scope)(scope, receive, send_and_note)
        finally:
            for leave in until_answered:
                leave()
        seconds = time.monotonic() - arrived
        operation = _operation(scope, status)
        self._metrics.count_request("none" if operation is None else operation.name, status, seconds, state["code"])
        log.log(
            _level(status),
            "request",
            request_id=state["request_id"],
            method=scope["method"],
            path=scope["path"],
            status=status,
            duration_ms=round(seconds * 1e3, 3),
            bytes=sent,
            client=state["client"].name,
            **({"failure": failure} if failure else {}),
        )


def _level(status: int) -> int:
    """Choose the level: an unexpected error is an error; a deadline, a full queue and a slow start warn."""
    if status >= HTTPStatus.INTERNAL_SERVER_ERROR:
        return logging.ERROR if status == HTTPStatus.INTERNAL_SERVER_ERROR else logging.WARNING
    return logging.INFO


def _operation(scope: Scope, status: int) -> APIRoute | None:
    """Find the route that answered; None: it is no operation, or the router itself answered."""
    route: APIRoute | None = scope.get("route")
    return None if route is None or not route.tags or status == HTTPStatus.METHOD_NOT_ALLOWED else route


def _with_own(headers: RawHeaders, own: Mapping[str, str]) -> RawHeaders:
    """Add the headers that every answer has; a route may have a policy of its own."""
    given = dict(headers)
    every = [(name.lower().encode(), value.encode("latin-1")) for name, value in own.items()]
    return [*headers, *[each for each in (*_policies(given.get(b"content-type")), *every) if each[0] not in given]]


@lru_cache(maxsize=64)
def _policies(media_type: bytes | None) -> RawHeaders:
    """Write the security headers of an answer with this media type."""
    headers = security_headers(None if media_type is None else media_type.decode("latin-1"))
    return [(name.lower().encode(), value.encode()) for name, value in headers.items()]


def _server_timing(timings: dict[str, float], total: float) -> str:
    known = {name: timings[name] for name in TIMINGS if name in timings}
    known |= {name: seconds for name, seconds in timings.items() if name.startswith("backend_")}
    return ", ".join(f"{name};dur={seconds * 1e3:.3f}" for name, seconds in {**known, "total": total}.items())


def _answer(error: ServiceError, scope: Scope) -> Response:
    """Make the answer for an error that no route has caught."""
    status, body = problem_document(error, scope["path"])
    return Response(body, status, error.headers, MEDIA_TYPE)
