"""How a batch arrives: piece by piece out of a body into the database, so that no part of the service holds it whole.

A worker takes the requests out of each piece. A body that is one JSON document is one piece, of a bounded size.
A body with a request a line may have any length.
"""

from __future__ import annotations

import hashlib
import math
import pickle
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from api.base.errors import Conflict, InternalError, PayloadTooLarge, TooManyBatches, invalid_at
from api.pool.costs import Kind
from api.pool.messages import Task
from api.store.batches import BatchBounds, append_items, begin_batch, discard_batches, open_batch
from api.store.claims import beat
from api.store.items import READ_ITEMS

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from sqlalchemy import Connection

    from api.base.byte_budget import Share
    from api.base.settings import Settings
    from api.batches.engine import Engine
    from api.pool.messages import Reply
    from api.pool.pool import WorkerPool
    from api.store.batches import Arrival
    from api.store.clients import Client
    from api.store.database import Database
    from api.store.quota import Quota

PIECE = 2**20
"""The bytes of lines that a worker gets at once: some thousand requests, a tenth of a second of its time."""

PATH = "/v1/batches"
"""Where batches are sent to, for problem documents."""


class Refused(Exception):
    """A worker refused the body; `reply` says why."""

    def __init__(self, reply: Reply) -> None:
        super().__init__()
        self.reply = reply


class Body(NamedTuple):
    """The body of a request that makes a batch.

    Attributes:
        chunks: The bytes, as they arrive.
        is_lines: Whether it has one request a line.
        declared: The number of its bytes (`Content-Length`); 0: it is not declared.
        share: What counts the bytes that are held.
    """

    chunks: AsyncIterator[bytes]
    is_lines: bool
    declared: int
    share: Share


@dataclass(frozen=True)
class Intake:
    """The way of batches into the database of one service.

    Attributes:
        settings: The operator's settings.
        database: The store of batches.
        pool: The workers that take the requests out of bodies.
        engine: The engine that plans the batches.
    """

    settings: Settings
    database: Database
    pool: WorkerPool
    engine: Engine

    async def take_in(self, body: Body, client: Client, key: str | None, quota: Quota | None) -> str:
        """Take a batch in, or find the one of an earlier request with the same key; give its id.

        Args:
            body: The requests.
            client: Who sends it.
            key: The `Idempotency-Key`; None: there is none.
            quota: The client's quota; None: it has none.

        Raises:
            Conflict: The key came with another body before, or that request is still under way.
            TooManyBatches: There is no room.
            TooManyRequests: There are more requests than the client may still ask today.
            PayloadTooLarge: The body is too long.
            InvalidRequest: There are too many requests, or none.
            Refused: A worker found something else wrong.
        """
        settings, database, engine = self.settings, self.database, self.engine
        bounds = BatchBounds(settings.max_batches, settings.max_batches_per_client, settings.max_batches_bytes)
        engine.arriving += 1
        try:
            await database.write(beat, engine.id)
            match await database.write(begin_batch, client.name, key, engine.id, bounds):
                case "arriving":
                    raise Conflict(
                        "An earlier request with this `Idempotency-Key` is still under way. Retry after 1 s.",
                        headers={"Retry-After": "1"},
                    )
                case "full":
                    raise TooManyBatches(
                        "The service stores no more batches of this client now. Wait for one to end, cancel one, or "
                        "delete one: DELETE /v1/batches/{id}?forget=true."
                    )
                case "too_many":
                    raise TooManyBatches(
                        "This client has too many unfinished batches. Wait for one to end, or cancel one."
                    )
                case arrival:
                    pass
            if arrival.body_digest is not None:
                return await _same(body, arrival)
            try:
                digest, total = await self._fill(body, arrival, client.namespace)
                if quota is not None:
                    await quota.take(total)
            except BaseException:  # whatever ended it, nobody may see half a batch
                await database.write(discard_batches, [arrival.number])
                raise
            await database.write(open_batch, arrival.number, digest)
        finally:
            engine.arriving -= 1
        engine.wake()
        return arrival.id

    async def _fill(self, body: Body, arrival: Arrival, namespace: str) -> tuple[str, int]:
        """Put the requests of a body into a batch, and give the body's digest and their number."""
        digest, total = hashlib.sha256(), 0
        async for piece in pieces(self.settings, body, digest):
            reply = await self._requests_of(body, piece, total)
            for chunk in reply.result:
                total = await self.database.write(_append, arrival.number, total, chunk, namespace)
            body.share.release()
        if not total:
            raise invalid_at("/requests", "must have at least one request")
        return digest.hexdigest(), total

    async def _requests_of(self, body: Body, piece: bytes, first: int) -> Reply:
        """Let a worker take the requests out of a piece."""
        settings = self.settings
        arguments = {
            "lines": body.is_lines,
            "first": first,
            "most_items": settings.max_batch_items,
            "most_bytes": settings.max_batch_bytes,
            "most_bytes_of_one": settings.max_body_bytes,
            "most_bytes_of_all": settings.max_batch_expanded_bytes,
        }
        now = time.monotonic()
        task = Task(READ_ITEMS, PATH, now, now + settings.max_deadline, piece, arguments)
        size = math.ceil(len(piece) / PIECE).bit_length()
        reply = await self.pool.run(task, Kind((READ_ITEMS,), size), body.share.hold)
        if reply.failure is not None:
            raise InternalError()
        if reply.result is None:
            raise Refused(reply)
        return reply


async def _same(body: Body, arrival: Arrival) -> str:
    """Make sure that the body is the one that the batch came with."""
    digest = hashlib.sha256()
    async for chunk in body.chunks:
        digest.update(chunk)
    if digest.hexdigest() != arrival.body_digest:
        raise Conflict("An earlier request had this `Idempotency-Key` and another body. Choose another key.")
    return arrival.id


def _append(connection: Connection, number: int, first: int, chunk: bytes, namespace: str) -> int:
    """Put requests into a batch that a worker has pickled."""
    requests = pickle.loads(chunk)  # noqa: S301 - from our own process
    return append_items(connection, number, first, requests, namespace)


async def pieces(settings: Settings, body: Body, digest: hashlib._Hash) -> AsyncIterator[bytes]:
    """Cut a body into pieces of whole lines, or give it as a whole.

    Raises:
        PayloadTooLarge: A line, or the whole, is too long.
    """
    most = settings.max_body_bytes if body.is_lines else settings.max_batch_bytes
    what = "A line of the body" if body.is_lines else "The body"
    held, arrived = bytearray(), 0
    async for chunk in body.chunks:
        arrived += len(chunk)
        if (size := max(arrived, body.declared)) > settings.max_batch_expanded_bytes:
            most_of_all = settings.max_batch_expanded_bytes
            message = f"The requests of a batch must have at most {most_of_all} bytes; got {size} or more."
            raise PayloadTooLarge(f"{message} Send them as several batches.", headers={"Connection": "close"})
        body.share.hold(len(chunk))
        digest.update(chunk)
        held += chunk
        if body.is_lines and len(held) >= PIECE and (end := held.rfind(b"\n") + 1):
            yield bytes(held[:end])
            del held[:end]
        if len(held) > most:
            raise PayloadTooLarge(f"{what} must have at most {most} bytes.", headers={"Connection": "close"})
    if held:
        yield bytes(held)
