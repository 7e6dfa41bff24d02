"""What an ordinary operation does in the server: read the body, let a worker run the task, send its reply."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass, field, replace
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

import structlog
from fastapi import Response
from starlette.requests import ClientDisconnect

from api.database.named_contents import ROBOTS, SCENES
from api.errors import PayloadTooLarge, UnsupportedMediaType, invalid
from api.pages import DEFAULT_ENTRIES, MOST_ENTRIES
from api.pool.costs import kind_of
from api.pool.messages import Reply, Task
from api.schemas.common import DEFAULT_DEADLINE
from api.server.shedding import leave_place
from api.server.traffic import Answer
from api.size import has_too_many_rows, parse_json

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Coroutine, Mapping

    from fastapi import Request

    from api.access.access import Client
    from api.server.service import Service
    from api.tasks.operation import Operation

log = structlog.get_logger()


def ordinary(operation: Operation) -> Callable[[Request], Awaitable[Response]]:
    """Make the endpoint of an operation that a worker does as a whole."""

    async def endpoint(request: Request) -> Response:
        arguments: dict[str, Any] = {}
        if operation.formats or operation.file or operation.also_as:
            arguments["format"] = request.query_params.get("format")
            arguments["accept"] = request.headers.get("accept", "*/*")
        if operation.request is None:
            return respond(await run(request, operation.id, **arguments))
        return respond(await run_with_body(request, operation.id, **arguments))

    return endpoint


def service_of(request: Request) -> Service:
    """Find the service that the request came to."""
    service: Service = request.app.state.service
    return service


def client(request: Request) -> Client:
    """Find who sends the request."""
    sender: Client = request.state.client
    return sender


def page_limit(request: Request) -> int:
    """Read how many entries a page may have.

    Raises:
        InvalidRequest: No number of entries that a page may have.
    """
    asked = request.query_params.get("limit", str(DEFAULT_ENTRIES))
    limit = int(asked) if asked.isascii() and asked.isdecimal() and len(asked) < 5 else 0
    if not 1 <= limit <= MOST_ENTRIES:
        raise invalid([{"pointer": "", "message": f"the parameter limit is a number from 1 to {MOST_ENTRIES}"}])
    return limit


async def run_with_body(request: Request, operation: str, **arguments: Any) -> Reply:
    """Read the body and run the operation on it in a worker."""
    asked = await look_at_body(request)
    return await run(request, operation, asked, **arguments)


@dataclass(frozen=True)
class Asked:
    """What the server looks at of a request; the rest is the worker's.

    Attributes:
        body: The body as it came.
        document: The body as JSON, which need not follow any schema.
        deadline: The time that the answer may take from the arrival of the request, s.
        named: The id of the robot to use, or to derive another `from`; None: there is none.
        contents: What the worker needs of what the body names by an id: the `definition` of an added robot, the one to
            use, or to derive another `from`, and that of a `scene`.
    """

    body: bytes = b""
    document: Mapping[str, Any] = field(default_factory=dict)
    deadline: float = DEFAULT_DEADLINE
    named: str | None = None
    contents: Mapping[str, Any] = field(default_factory=dict)


async def look_at_body(request: Request) -> Asked:
    """Read the body and what of it the server needs."""
    service = service_of(request)
    body = await _read_body(request)
    document = _parse(body, service.settings.max_body_bytes)
    named = document.get("robot", document.get("from"))
    named = named if isinstance(named, str) else None
    contents: dict[str, Any] = {}
    namespace, scene_id = client(request).namespace, document.get("scene")
    if named is not None and named not in service.catalogue:
        robot = await service.database.read(ROBOTS.find, namespace, named)
        contents |= {} if robot is None else {"definition": robot.definition}
    if isinstance(scene_id, str):
        scene = await service.database.read(SCENES.find, namespace, scene_id)
        contents |= {} if scene is None else {"scene": scene.definition}
    deadline = document.get("deadline")
    if isinstance(deadline, bool) or not isinstance(deadline, int | float) or deadline <= 0.0:
        deadline = DEFAULT_DEADLINE  # it is omitted, or the worker will refuse it
    return Asked(body, document, min(deadline, service.settings.max_deadline), named, contents)


NOTHING_ASKED = Asked()
"""What a request without a body asks."""


async def run(request: Request, operation: str, asked: Asked = NOTHING_ASKED, **arguments: Any) -> Reply:
    """Run an operation in a worker, or give the answer that another request of the same content has got or gets.

    Raises:
        ClientDisconnect: The client has hung up; the work is given up, too, unless others wait for it.
    """
    service, share = service_of(request), request.state.share
    arrived: float = request.state.arrived
    task = Task(
        operation=operation,
        instance=request.url.path,
        submitted=time.monotonic(),
        deadline=arrived + asked.deadline,
        body=asked.body,
        arguments={**asked.contents, **arguments},
        client=client(request).name,
    )
    size = len(task.body) + sum(len(content) for content in asked.contents.values() if isinstance(content, bytes))
    kind = kind_of(operation, asked.document, arguments.get("index", 0), size)

    async def compute(hold: Callable[[int], None]) -> Reply:
        reply = await service.pool.run(task, kind, hold)
        if reply.plan is not None:
            service.metrics.count_plan(reply.plan, reply.timings)
        if reply.failure is not None:
            log.error("task_failed", request_id=request.state.request_id, operation=operation, failure=reply.failure)
        return reply

    if not is_shared(request):
        reply = await _unless_hung_up(request, compute(share.hold))
    else:
        tag = service.answers.tag(operation, task.body, task.arguments)
        if is_known(request, tag):
            return not_modified(tag)
        if service.answers.is_under_way(tag):
            leave_place(request.scope)
        reply = await _unless_hung_up(request, service.answers.answer(tag, task.deadline, task.client, compute))
        share.hold(len(reply.body))
        if reply.status == HTTPStatus.OK:
            reply = replace(reply, headers={**reply.headers, "ETag": tag})
    if asked.named is not None and "definition" not in asked.contents and reply.status < HTTPStatus.MULTIPLE_CHOICES:
        service.catalogue.add(asked.named)
    request.state.timings = dict(reply.timings)
    request.state.submitted, request.state.code = task.submitted - arrived, reply.code
    return reply


def is_shared(request: Request) -> bool:
    """Tell whether the answer may be that of another request: it is of such a kind, and not asked for afresh."""
    operation: Operation | None = request.state.operation
    asked = request.headers.get("cache-control", "").lower()
    return operation is not None and operation.shared and "no-cache" not in asked and "no-store" not in asked


def is_known(request: Request, tag: str) -> bool:
    """Tell whether the client has the answer with this tag already (`If-None-Match`)."""
    known = (one.strip() for one in request.headers.get("if-none-match", "").split(","))
    if not any(one.removeprefix("W/") == tag.removeprefix("W/") for one in known):
        return False
    service_of(request).metrics.count_shared("not_modified")
    return True


def not_modified(tag: str) -> Reply:
    """Make the reply to a client that has the answer with this tag already."""
    return Reply(HTTPStatus.NOT_MODIFIED, "", b"", headers={"ETag": tag})


async def _unless_hung_up(request: Request, answering: Coroutine[Any, Any, Reply]) -> Reply:
    """Wait for an answer, unless the client hangs up before."""
    work = asyncio.ensure_future(answering)
    hang_up = asyncio.ensure_future(_hang_up(request))
    try:
        await asyncio.wait((work, hang_up), return_when=asyncio.FIRST_COMPLETED)
        if not work.done():
            raise ClientDisconnect
        return await work
    finally:
        hang_up.cancel()
        work.cancel()


async def _hang_up(request: Request) -> None:
    """Wait until the client hangs up."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


def respond(reply: Reply) -> Response:
    """Make the reply of a worker the response; its body goes out as it is."""
    if reply.status == HTTPStatus.NOT_MODIFIED:
        return Response(None, reply.status, reply.headers)
    return Answer([reply.body], reply.status, reply.media_type, reply.headers)


def media_type_of(request: Request) -> str:
    """Read the media type of the body; no header is no media type, as a page of any site may send that."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


def is_json(media_type: str) -> bool:
    """Tell whether a media type is that of JSON (RFC 6839)."""
    return media_type == "application/json" or (media_type.startswith("application/") and media_type.endswith("+json"))


async def _read_body(request: Request) -> bytes:
    """Read the whole body, of no more than the allowed size, declared or not.

    Raises:
        UnsupportedMediaType: It is not declared to be JSON.
        PayloadTooLarge: It is larger than the service reads.
        Overloaded: There is no room for it now.
    """
    if not is_json(media_type_of(request)):
        raise UnsupportedMediaType("send the body with the header `Content-Type: application/json`")
    settings = service_of(request).settings
    too_large = PayloadTooLarge(f"the body may have {settings.max_body_bytes} bytes", headers={"Connection": "close"})
    declared = request.headers.get("content-length", "0")
    if declared.isdecimal() and int(declared) > settings.max_body_bytes:
        raise too_large
    body = bytearray()
    async for chunk in request.stream():
        request.state.share.hold(len(chunk))
        body += chunk
        if len(body) > settings.max_body_bytes:
            raise too_large
    return bytes(body)


def _parse(body: bytes, max_body_bytes: int) -> dict[str, Any]:
    if has_too_many_rows(body, max_body_bytes):
        raise invalid([{"pointer": "", "message": "it has too many lists and objects, most of them all but empty"}])
    document = parse_json(body)
    if not isinstance(document, dict):
        raise invalid([{"pointer": "", "message": "the body must be a JSON object"}])
    return document
