"""A comparison is one task a back end, so that as many run at once as there are workers."""

from __future__ import annotations

import asyncio
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

import orjson

from api.base.codings import IDENTITY
from api.base.errors import DeadlineExceeded, InternalError, MemoryExceeded
from api.base.problem_documents import MEDIA_TYPE, problem_document
from api.contract.comparisons import ComparedBackend
from api.contract.requests import MOST_BACKENDS
from api.http.cost_keys import by_plan_of
from api.http.dependencies import Body, service_of
from api.http.replies import coding_of, get_reply, respond, respond_with_json
from api.pool.messages import Reply

if TYPE_CHECKING:
    from fastapi import Request, Response

OF_ONE_BACKEND = frozenset({"deadline_exceeded", "memory_exceeded", "internal_error"})
"""Codes of what befalls one back end in a comparison and says nothing of the others."""


async def compare(request: Request, body: Body) -> Response:
    """Plan with each back end of a comparison."""
    tag = service_of(request).answers.tag("compare_backends", body.content, body.contents, coding_of(request))
    kinds = _kinds(body.document.get("backends"))
    workers = asyncio.Semaphore(service_of(request).settings.workers)

    async def plan_with(index: int) -> Reply:
        async with workers:
            try:
                return await get_reply(
                    request,
                    "compare_backends",
                    body,
                    shared=True,
                    cost_key=by_plan_of(index),
                    coding=IDENTITY,
                    index=index,
                )
            except (DeadlineExceeded, MemoryExceeded, InternalError) as error:
                status, refusal = problem_document(error, request.url.path)
                return Reply(status, MEDIA_TYPE, refusal)

    if kinds is None:  # a worker says what is wrong
        return respond(await plan_with(0))
    try:
        async with asyncio.TaskGroup() as group:
            tasks = [group.create_task(plan_with(index)) for index in range(len(kinds))]
    except ExceptionGroup as errors:  # the others have been cancelled
        raise errors.exceptions[0] from None
    replies = [task.result() for task in tasks]
    entries = []
    request.state.timings = {}
    headers = {"ETag": tag}
    for index, (kind, reply) in enumerate(zip(kinds, replies, strict=True)):
        request.state.timings[f"backend_{index}"] = sum(s for name, s in reply.timings.items() if name != "queue")
        if reply.status == HTTPStatus.OK:
            entries.append(reply.body)
            continue
        refusal = orjson.loads(reply.body)
        if refusal["code"] not in OF_ONE_BACKEND:
            return respond(reply)  # the request itself is bad, whatever the back end
        headers = {}  # it may go well another time
        entry = dict.fromkeys(ComparedBackend.model_fields)
        entries.append(orjson.dumps(entry | {"backend": kind, "status": refusal["code"], "problem": refusal}))
    return await respond_with_json(request, b'{"results":[%b]}' % b",".join(entries), headers)


def _kinds(backends: Any) -> list[str] | None:
    """Read the kinds of the requested back ends; None: they do not follow the schema."""
    if not isinstance(backends, list) or not 1 <= len(backends) <= MOST_BACKENDS:
        return None
    kinds = [backend["kind"] for backend in backends if isinstance(backend, dict) and "kind" in backend]
    return kinds if len(kinds) == len(backends) and all(isinstance(kind, str) for kind in kinds) else None
