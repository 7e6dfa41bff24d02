"""The replies to operations: a worker runs the task, equal answers are shared, the reply is sent."""

from __future__ import annotations

import asyncio
import time
from dataclasses import replace
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

import structlog
from fastapi import Response
from starlette.requests import ClientDisconnect

from api.base.codings import IDENTITY, NAMES, VARY, compress, negotiate_coding
from api.http.cost_keys import CostKey, by_size, kind_of
from api.http.dependencies import Body, client, service_of
from api.http.described import JSON
from api.http.transport.answer import Answer
from api.http.transport.shedding import leave_place
from api.pool.messages import Reply, Task

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Mapping

    from fastapi import Request

    from api.base.codings import Coding

log = structlog.get_logger()


NO_BODY = Body()
"""The body of a request that has none."""


async def get_reply(
    request: Request,
    operation: str,
    body: Body = NO_BODY,
    *,
    shared: bool = False,
    cost_key: CostKey = by_size,
    coding: Coding | None = None,
    **arguments: Any,
) -> Reply:
    """Run a task in a worker, or share the answer to an equal request.

    Args:
        request: The request.
        operation: The id of the operation, which is the name of the task.
        body: The body of the request.
        shared: Whether equal requests have equal answers.
        cost_key: The parts of the body that decide the duration of the operation.
        coding: The coding of the answer; None: the one that the client takes.
        arguments: Further arguments of the task.

    Raises:
        ClientDisconnect: The client has hung up; the work is given up, too, unless others wait for it.
    """
    service, state = service_of(request), request.state
    arrived: float = state.arrived
    task = Task(
        operation=operation,
        instance=request.scope["path"],
        submitted=time.monotonic(),
        deadline=arrived + body.deadline,
        body=body.content,
        arguments={**body.contents, **arguments},
        client=client(request).name,
        coding=coding_of(request) if coding is None else coding,
    )
    contents = [*body.contents.values(), *body.contents.get("definitions", {}).values()]
    size = len(task.body) + sum(len(content) for content in contents if isinstance(content, bytes))
    kind = kind_of(operation, body.document, cost_key, size)

    async def compute(hold: Callable[[int], None]) -> Reply:
        reply = await service.pool.run(task, kind, hold)
        if reply.plan is not None:
            service.metrics.count_plan(reply.plan, reply.timings)
        if reply.failure is not None:
            log.error("task_failed", request_id=state.request_id, operation=operation, failure=reply.failure)
        return reply

    if not (shared and may_be_shared(request)):
        reply = await _unless_hung_up(request, compute(state.share.hold))
    else:
        tag = service.answers.tag(operation, task.body, task.arguments, task.coding)
        if is_known(request, tag):
            return not_modified(tag)
        if service.answers.is_under_way(tag, task.client):
            leave_place(request.scope)
        reply = await _unless_hung_up(request, service.answers.answer(tag, task.deadline, task.client, compute))
        state.share.hold(len(reply.body))
        if reply.status == HTTPStatus.OK:
            reply = replace(reply, headers={**reply.headers, "ETag": tag})
    if reply.status < HTTPStatus.MULTIPLE_CHOICES:
        service.catalogue.update(body.named)
    state.timings = dict(reply.timings)
    state.submitted, state.code = task.submitted - arrived, reply.code
    return reply


def coding_of(request: Request, names: tuple[str, ...] = NAMES) -> Coding:
    """Choose the coding of the answer to a request among these names."""
    return negotiate_coding(", ".join(request.headers.getlist("accept-encoding")), names)


def may_be_shared(request: Request) -> bool:
    """Tell whether the client takes an answer that was computed for another request."""
    asked = request.headers.get("cache-control", "").lower()
    return "no-cache" not in asked and "no-store" not in asked


def is_named(tag: str, header: str) -> bool:
    """Tell whether a list of tags has a tag; a weak tag counts as the strong one (RFC 9110, 8.8.3.2)."""
    return tag.removeprefix("W/") in {one.strip().removeprefix("W/") for one in header.split(",")}


def is_known(request: Request, tag: str) -> bool:
    """Tell whether the client has the answer to its GET with this tag already (`If-None-Match`)."""
    if request.method not in {"GET", "HEAD"}:
        return False
    if not is_named(tag, request.headers.get("if-none-match", "")):
        return False
    service_of(request).metrics.count_shared("not_modified")
    return True


def not_modified(tag: str) -> Reply:
    """Make the reply to a client that has the answer with this tag already."""
    return Reply(HTTPStatus.NOT_MODIFIED, "", b"", headers={"ETag": tag})


async def _unless_hung_up(request: Request, answering: Coroutine[Any, Any, Reply]) -> Reply:
    """Wait for an answer, unless the client hangs up before."""
    try:
        async with asyncio.timeout(None) as patience:
            hang_up = asyncio.create_task(_end_when_hung_up(patience, request))
            try:
                return await answering
            finally:
                hang_up.cancel()
    except TimeoutError:
        if not patience.expired():
            raise
        raise ClientDisconnect from None


async def _end_when_hung_up(patience: asyncio.Timeout, request: Request) -> None:
    """Let the patience end as soon as the client hangs up."""
    while (await request.receive())["type"] != "http.disconnect":
        pass
    patience.reschedule(0.0)


def respond(reply: Reply) -> Response:
    """Make the reply of a worker the response; its body goes out as it is."""
    headers = {**reply.headers, **VARY}
    if reply.status == HTTPStatus.NOT_MODIFIED:
        return Response(None, reply.status, headers)
    return Answer([reply.body], reply.status, reply.media_type, headers)


async def respond_with_json(request: Request, content: bytes, headers: Mapping[str, str]) -> Response:
    """Respond with JSON that the server has put together; a thread compresses it, not the event loop."""
    coding = coding_of(request)
    compressed = None if coding == IDENTITY else await asyncio.to_thread(compress, content, coding)
    if compressed is None:
        return Answer([content], HTTPStatus.OK, JSON, {**headers, **VARY})
    return Answer([compressed], HTTPStatus.OK, JSON, {**headers, **VARY, "Content-Encoding": coding.name})
