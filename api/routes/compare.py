"""A comparison is one task a back end, so that as many run at once as there are workers."""

from __future__ import annotations

import asyncio
from http import HTTPStatus

import orjson
from fastapi import Request, Response

from api.errors import MEDIA_TYPE, DeadlineExceeded, InternalError, MemoryExceeded, problem
from api.messages import Reply
from api.routes.ordinary import look_at_body, respond, run, service_of
from api.schemas.answers import ComparedBackend
from api.schemas.requests import MOST_BACKENDS

OF_ONE_BACKEND = frozenset({"deadline_exceeded", "memory_exceeded", "internal_error"})
"""Codes of what befalls one back end in a comparison and says nothing of the others."""


async def compare_backends(request: Request) -> Response:
    """POST /v1/trajectories/compare: read the body and plan with each of its back ends."""
    body, document, deadline, robot = await look_at_body(request)
    backends = document.get("backends")
    count = len(backends) if isinstance(backends, list) and 1 <= len(backends) <= MOST_BACKENDS else 1
    workers = asyncio.Semaphore(service_of(request).settings.workers)

    async def compare(index: int) -> Reply:
        async with workers:
            try:
                return await run(request, "compare_backends", deadline, body, index=index, **robot)
            except (DeadlineExceeded, MemoryExceeded, InternalError) as error:
                status, refusal = problem(error, request.url.path)
                return Reply(status, MEDIA_TYPE, refusal)

    replies = await asyncio.gather(*(compare(index) for index in range(count)))
    entries = []
    request.state.timings = {}
    for index, reply in enumerate(replies):
        request.state.timings[f"backend_{index}"] = sum(s for name, s in reply.timings.items() if name != "queue")
        if reply.status == HTTPStatus.OK:
            entries.append(reply.body)
            continue
        refusal = orjson.loads(reply.body)
        if refusal["code"] not in OF_ONE_BACKEND:
            return respond(reply)  # the request itself is bad, whatever the back end
        entry = dict.fromkeys(ComparedBackend.model_fields)
        kind = backends[index]["kind"] if isinstance(backends, list) else None
        entries.append(orjson.dumps(entry | {"backend": kind, "status": refusal["code"], "problem": refusal}))
    return Response(b'{"results":[' + b",".join(entries) + b"]}", media_type="application/json")
