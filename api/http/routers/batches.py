"""Batches: created, described, read and cancelled; workers write their results in the requested form."""

from __future__ import annotations

import asyncio
import time
from dataclasses import replace
from http import HTTPStatus
from typing import TYPE_CHECKING, Annotated, Any

import orjson
from fastapi import Header, Query, Request, Response
from pydantic.json_schema import SkipJsonSchema
from sqlalchemy.exc import NoResultFound
from starlette.responses import StreamingResponse

from api.base.errors import Overloaded, UnknownBatch, UnsupportedMediaType, invalid_at
from api.base.pages import DEFAULT_ENTRIES
from api.batches.archive import zipped
from api.batches.arrival import Body, Refused
from api.batches.looks import FORGOTTEN, LOOK
from api.batches.status import finished, listed, tabulated
from api.contract import batches as schemas
from api.http.access.access import audit
from api.http.dependencies import BatchId, Cursor, FormOfPlans, Limit, client, is_json, media_type_of, needs, service_of
from api.http.described import BODY_CODES, DATABASE_CODES, returns, takes
from api.http.replies import get_reply, respond
from api.http.router import Router
from api.pool.costs import Kind
from api.pool.messages import Task
from api.store import batches, claims
from api.store.batch_reports import report_figures, shown_results
from api.store.items import RENDER_RESULTS, REPORT, Result

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Mapping, Sequence

    from api.http.service import Service
    from api.pool.messages import Reply
    from api.store.batches import BatchRecord

router = Router(tags=["batches"])

RESULTS_CODES = ("invalid_request", "not_acceptable", "unknown_batch", *DATABASE_CODES)
"""Codes of the problem documents that may be the answer in place of results."""

LINES = frozenset({"application/x-ndjson", "application/ndjson", "application/jsonl"})
"""The media types of bodies with one request a line."""

LONGEST_KEY = 200
"""The most characters of an `Idempotency-Key`."""

KEEP_ALIVE = 15.0
"""The time after which a stream of events without news sends a comment, s: proxies close a silent connection."""

RESULTS_AT_ONCE = 100
"""The number of results that are read for one piece of a stream."""

MOST_TRIES = 30
"""The number of times that a piece of a stream is tried, a second apart, while the service has too much to do."""


@router.post(
    "/v1/batches",
    summary="Plan many requests as a batch in the background.",
    description="The body is a list of plan requests, a grid of them, or NDJSON with one request per line. "
    "Requests that somebody waits for come first. Faults of single requests appear in the results.",
    status_code=202,
    dependencies=[needs("batches")],
    responses=returns(
        schemas.Batch,
        codes=(*BODY_CODES, "conflict", "too_many_batches"),
        status=202,
        leads_to=(
            "get_batch",
            "get_batch_results",
            "stream_batch_results",
            "stream_batch_events",
            "get_batch_report",
            "cancel_batch",
        ),
    ),
    openapi_extra=takes(schemas.BatchRequest, lines=True),
)
async def create_batch(
    request: Request,
    key: Annotated[
        str | SkipJsonSchema[None],
        Header(
            alias="Idempotency-Key",
            description="A text of your own. The same key and body again is answered with the same batch, another "
            "body with `conflict`.",
        ),
    ] = None,
) -> Response:
    """Answer POST /v1/batches."""
    media_type = media_type_of(request)
    is_lines = media_type in LINES
    if not is_lines and not is_json(media_type):
        raise UnsupportedMediaType(
            "`Content-Type` must be `application/json`, or `application/x-ndjson` for one request a line."
        )
    if key is not None and not 1 <= len(key) <= LONGEST_KEY:
        raise invalid_at("", f"The header `Idempotency-Key` must have 1 to {LONGEST_KEY} characters.")
    declared = request.headers.get("content-length", "")
    body = Body(request.stream(), is_lines, int(declared) if declared.isdecimal() else 0, request.state.share)
    try:
        batch_id = await service_of(request).intake.take_in(body, client(request), key, request.state.quota)
    except Refused as refused:
        return respond(replace(refused.reply, headers={"Connection": "close"}))
    audit(request, "batch_created", batch_id)
    batch = await _batch(request, batch_id)
    headers = {"Location": f"/v1/batches/{batch_id}"}
    return _json(await service_of(request).looks.describe(batch), HTTPStatus.ACCEPTED, headers)


@router.get(
    "/v1/batches",
    summary="List the stored batches, in pages.",
    description="The newest batches come first.",
    dependencies=[needs("batches")],
    responses=returns(schemas.BatchesAnswer, codes=("invalid_request", *DATABASE_CODES)),
)
async def list_batches(request: Request, limit: Limit = DEFAULT_ENTRIES, cursor: Cursor = None) -> Response:
    """Answer GET /v1/batches: a page, the newest first."""
    number = None if cursor is None else _number(cursor)
    database, owner = service_of(request).database, client(request).batches_of
    found = await database.read(batches.batches_before, number, limit + 1, owner)
    next_cursor = str(found[limit - 1].number) if len(found) > limit else None
    return _json({"batches": [listed(batch) for batch in found[:limit]], "next_cursor": next_cursor})


@router.get(
    "/v1/batches/{id}",
    summary="Get the progress of a batch and a summary of its results.",
    description="The answer has the counts, the rate, an estimate of the remaining time, and a summary of plans "
    "and problems.",
    dependencies=[needs("batches")],
    responses=returns(schemas.Batch, codes=("unknown_batch", *DATABASE_CODES)),
)
async def get_batch(request: Request, batch_id: BatchId) -> Response:
    """Answer GET /v1/batches/{id}."""
    service = service_of(request)
    return _json(await service.looks.describe(await _batch(request, batch_id)))


@router.delete(
    "/v1/batches/{id}",
    summary="Cancel a batch and keep its finished results.",
    description="Requests under way are cancelled within a second; finished results can still be read. With "
    "`?forget=true` the batch and its results are deleted.",
    status_code=204,
    dependencies=[needs("batches")],
    responses=returns(None, codes=("unknown_batch", *DATABASE_CODES), status=204),
)
async def cancel_batch(
    request: Request, batch_id: BatchId, forget: Annotated[str, Query(include_in_schema=False)] = ""
) -> Response:
    """Answer DELETE /v1/batches/{id}."""
    service = service_of(request)
    batch = await _batch(request, batch_id)
    await service.database.write(batches.cancel_batch, batch.number)
    service.engine.forget(batch.number)
    audit(request, "batch_cancelled", batch.id)
    if forget == "true":
        await service.database.write(batches.discard_batches, [batch.number])
        audit(request, "batch_forgotten", batch.id)
    return Response(status_code=HTTPStatus.NO_CONTENT)


@router.get(
    "/v1/batches/{id}/results",
    summary="List the results of a batch, in pages.",
    description="The results have the order of the requests. The page of a running batch ends before the first "
    "unfinished request.",
    dependencies=[needs("batches")],
    responses=returns(schemas.BatchResultsAnswer, codes=RESULTS_CODES),
)
async def get_batch_results(
    request: Request, batch_id: BatchId, limit: Limit = DEFAULT_ENTRIES, cursor: Cursor = None, form: FormOfPlans = None
) -> Response:
    """Answer GET /v1/batches/{id}/results: a page, in the order of the requests."""
    service = service_of(request)
    behind = -1 if cursor is None else _number(cursor)
    batch = await _batch(request, batch_id)
    page, has_more = await _results(service, batch, behind, limit)
    is_last = batch.status != "running" and not has_more
    arguments: dict[str, Any] = {"results": page, "form": form, "shape": "page", "last": is_last, "behind": behind}
    arguments["definitions"] = await _definitions(service, page)
    return respond(await get_reply(request, RENDER_RESULTS, **arguments))


@router.get(
    "/v1/batches/{id}/results.ndjson",
    summary="Stream all results of a batch, one per line, until the batch ends.",
    description="The lines have the order of the requests.",
    dependencies=[needs("batches")],
    responses=returns(
        schemas.BatchResult,
        codes=RESULTS_CODES,
        media_type="application/x-ndjson",
    ),
)
async def stream_batch_results(request: Request, batch_id: BatchId, form: FormOfPlans = None) -> Response:
    """Answer GET /v1/batches/{id}/results.ndjson: all results, as they come, until the batch has ended."""
    batch, empty = await _first_look(request, batch_id, form, "lines")
    if empty.result is None:  # there is no such form
        return respond(empty)
    pieces = (reply.body async for reply in _pieces_of(request, batch, form, "lines"))
    return _streamed(request, pieces, empty.media_type)


@router.get(
    "/v1/batches/{id}/results.zip",
    summary="Download all results of a batch as a zip archive, one file for each plan.",
    description="Files are named after the index of their request; a request without a plan has its problem "
    "document, `INDEX.problem.json`. The archive is streamed and ends with the batch.",
    dependencies=[needs("batches")],
    responses=returns(
        bytes,
        codes=RESULTS_CODES,
        file=True,
        media_type="application/zip",
    ),
)
async def download_batch_results(request: Request, batch_id: BatchId, form: FormOfPlans = None) -> Response:
    """Answer GET /v1/batches/{id}/results.zip: an archive of all results, until the batch has ended."""
    batch, empty = await _first_look(request, batch_id, form, "files")
    if empty.result is None:
        return respond(empty)
    name = {"Content-Disposition": f'attachment; filename="{batch.id}.zip"'}
    return _streamed(request, zipped(_pieces_of(request, batch, form, "files")), empty.media_type, name)


async def _first_look(request: Request, batch_id: str, form: str | None, shape: str) -> tuple[BatchRecord, Reply]:
    """Find the batch of the requested results, and check that the requested form exists."""
    batch = await _batch(request, batch_id)
    return batch, await _rendered(request, [], form, shape)


async def _pieces_of(request: Request, batch: BatchRecord, form: str | None, shape: str) -> AsyncIterator[Reply]:
    """Have all results written, some at a time, as they come."""
    service, behind = service_of(request), -1
    while not request.scope["state"].get("stopping"):
        batch = await _batch(request, batch.id)
        found, _ = await _results(service, batch, behind, RESULTS_AT_ONCE)
        while found:
            reply = await _rendered(request, found, form, shape)
            yield reply
            request.state.share.release()
            behind, found = found[reply.result - 1].position, found[reply.result :]
            if not found:
                found, _ = await _results(service, batch, behind, RESULTS_AT_ONCE)
        if batch.status != "running":
            return
        await asyncio.sleep(LOOK)


async def _rendered(request: Request, results: Sequence[Result], form: str | None, shape: str) -> Reply:
    """Have a part of a stream written; while there is too much to do, or to hold, later."""
    service, path = service_of(request), request.url.path
    definitions = await _definitions(service, results)
    arguments = {"results": results, "form": form, "shape": shape, "definitions": definitions}
    kind = Kind((RENDER_RESULTS,), len(results).bit_length())
    for tries in range(1, MOST_TRIES + 1):
        now = time.monotonic()
        deadline = now + service.settings.max_deadline
        task = Task(RENDER_RESULTS, path, now, deadline, b"", arguments, client(request).name)
        try:
            return await service.pool.run(task, kind, request.state.share.hold)
        except Overloaded:
            if tries == MOST_TRIES:
                raise
            await asyncio.sleep(1.0)
    raise AssertionError  # the last try has returned or raised


@router.get(
    "/v1/batches/{id}/report",
    summary="Download a report of a batch: one file that opens without a network.",
    description="The report has the counts, histograms of durations, use of limits and planning times, the "
    "refusals with examples, and the worst plans, each with the index of its request and, if small "
    "enough, its graphs and playback. Its size does not grow with the number of requests. For a "
    "running batch it shows the results so far.",
    dependencies=[needs("batches")],
    responses=returns(str, codes=("not_acceptable", "unknown_batch", *DATABASE_CODES), media_type="text/html"),
)
async def get_batch_report(request: Request, batch_id: BatchId) -> Response:
    """Answer GET /v1/batches/{id}/report: the database sums up, a worker writes."""
    service = service_of(request)
    batch = await _batch(request, batch_id)
    description = await service.looks.describe(batch)
    codes = [refusal["code"] for refusal in description["summary"]["refusals"]]
    figures = await service.database.read(report_figures, batch.number, codes)
    results = await service.database.read(shown_results, batch.number, figures.positions())
    arguments: dict[str, Any] = {"batch": description, "figures": tabulated(figures), "results": results}
    reply = await get_reply(request, REPORT, **arguments, definitions=await _definitions(service, results))
    return respond(replace(reply, headers={**reply.headers, "Cache-Control": "no-store"}))


@router.get(
    "/v1/batches/{id}/events",
    summary="Follow the progress of a batch as server-sent events: progress, and last the end.",
    description="A client that reconnects with `Last-Event-ID` receives the changes since then.",
    dependencies=[needs("batches")],
    responses=returns(schemas.Batch, codes=("unknown_batch", *DATABASE_CODES), media_type="text/event-stream"),
)
async def stream_batch_events(
    request: Request,
    batch_id: BatchId,
    last: Annotated[
        str | SkipJsonSchema[None],
        Header(alias="Last-Event-ID", description="The id of the last event that was received; omitted: none was."),
    ] = None,
) -> Response:
    """Answer GET /v1/batches/{id}/events.

    The id of an event is the number of requests that have been answered: a client that returns with
    `Last-Event-ID` gets the changes since then.
    """
    service = service_of(request)
    batch = await _batch(request, batch_id)
    seen = int(last) if last and last.isascii() and last.isdecimal() and len(last) < 10 else -1
    return _streamed(request, _events(request, service, batch, seen), "text/event-stream")


def _streamed(
    request: Request, pieces: AsyncIterator[bytes], media_type: str, more: Mapping[str, str] | None = None
) -> Response:
    """Send pieces as they come, with further headers."""
    headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no", **(more or {})}
    if request.method == "HEAD":
        return Response(None, HTTPStatus.OK, headers, media_type)
    return StreamingResponse(pieces, HTTPStatus.OK, headers, media_type)


async def _events(request: Request, service: Service, batch: BatchRecord, seen: int) -> AsyncIterator[bytes]:
    sent = time.monotonic()
    while not request.scope["state"].get("stopping"):
        await _check_key(request)
        batch, description = await service.looks.follow(batch.id)
        number = finished(description)
        has_ended = batch.status != "running"
        if has_ended or number > seen:
            name = b"end" if has_ended else b"progress"
            yield b"id: %d\nevent: %s\ndata: %s\n\n" % (number, name, orjson.dumps(description))
            seen, sent = number, time.monotonic()
        elif time.monotonic() - sent > KEEP_ALIVE:
            yield b": nothing new\n\n"
            sent = time.monotonic()
        if has_ended:
            return
        await asyncio.sleep(LOOK)


async def _batch(request: Request, batch_id: str) -> BatchRecord:
    """Find a batch that the client may see."""
    await _check_key(request)
    return await service_of(request).looks.find(batch_id, client(request).batches_of)


async def _check_key(request: Request) -> None:
    """Look the key up again; a stream does so on each turn, and ends where its key was revoked.

    Raises:
        Unauthorized, Forbidden: The key may not do this any more.
    """
    if client(request).has_key:
        await service_of(request).access.key_of(request.headers, request.state.scope)


async def _results(service: Service, batch: BatchRecord, behind: int, limit: int) -> tuple[list[Result], bool]:
    return await service.database.read(
        claims.results_behind, batch.number, behind, limit, ended=batch.status != "running"
    )


async def _definitions(service: Service, results: Sequence[Result]) -> Mapping[str, bytes]:
    """Find the added robots, scenes and roadmaps that results need, by their digests.

    Raises:
        UnknownBatch: One is gone: the batch has been forgotten since its results were read.
    """
    of_results = (digest for one in results for digest in (one.robot, one.scene, one.roadmap))
    digests = {digest for digest in of_results if digest is not None}
    try:
        return {digest: await service.database.read(claims.definition_of, digest) for digest in digests}
    except NoResultFound as error:
        raise UnknownBatch(FORGOTTEN) from error


def _number(cursor: str) -> int:
    if not (cursor.isascii() and cursor.removeprefix("-").isdecimal() and len(cursor) < 10):
        raise invalid_at("", "The parameter `cursor` must be the `next_cursor` of a page.")
    return int(cursor)


def _json(value: Any, status: int = HTTPStatus.OK, headers: Mapping[str, str] | None = None) -> Response:
    return Response(orjson.dumps(value), status, headers, media_type="application/json")
