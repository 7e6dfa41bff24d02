"""Batches in the database: their arrival, description and end."""

from __future__ import annotations

import time
import uuid
from typing import TYPE_CHECKING, Literal, NamedTuple

from sqlalchemy import delete, func, insert, select, update

from api.store.locks import BATCHES, CONTENTS, exclusively
from api.store.named_contents import ROBOTS, SCENES
from api.store.roadmaps import forget_of_items, keep_for_items
from api.store.tables import batches, engines, items

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from sqlalchemy import ColumnElement, Connection

    from api.store.items import NewItem

ENGINE_TIMEOUT = 5.0
"""The time after its last heartbeat at which a service is taken for dead, s: ten periods of the heartbeat. The clocks
of services that share a database have to agree within it."""


BATCH_BYTES = 2**16
"""The bytes that a batch counts besides its requests and results, so that there are not too many small ones."""


class BatchBounds(NamedTuple):
    """How many batches there may be. One client may have as many, and as many bytes, as it leaves free to others.

    Attributes:
        batches: The most batches that have not ended.
        batches_of_owner: The most of these of one client.
        size: The most bytes of requests and results, beyond which no more requests are taken.
    """

    batches: int
    batches_of_owner: int
    size: int


class Arrival(NamedTuple):
    """A batch that arrives.

    Attributes:
        number: The number of the batch.
        id: The id of the batch.
        body_digest: The digest of the body of an earlier request with the same key; None: it is a new batch.
    """

    number: int
    id: str
    body_digest: str | None = None


class Outcomes(NamedTuple):
    """The items of a batch that had the same outcome.

    Attributes:
        outcome: `planned`, the code of a problem, or None: nothing yet.
        items: The number of items.
        shortest: The shortest duration of a trajectory, s; None: there is none.
        longest: The longest, s.
        sum: The sum of all, s.
        ratio: The largest share of a limit that is used.
    """

    outcome: str | None
    items: int
    shortest: float | None
    longest: float | None
    sum: float | None
    ratio: float | None


class BatchRecord(NamedTuple):
    """A batch. See `api.store.tables.batches`."""

    number: int
    id: str
    status: Literal["running", "completed", "cancelled"]
    total: int
    created: float
    ended: float | None
    rate: float | None
    settled: float | None


HISTOGRAM_PARTS = 20
"""The number of parts of the histogram of durations: as many bars as a column of a page has room for."""

LEAST_PART = 1e-9
"""The least width of a part, s: durations that differ by less are the same."""

COLUMNS = tuple(batches.c[name] for name in BatchRecord._fields)
"""The columns of a `BatchRecord`."""


def begin_batch(
    connection: Connection, owner: str, key: str | None, engine: str, bounds: BatchBounds
) -> Arrival | Literal["arriving", "full", "too_many"]:
    """Begin with a batch, whose items follow; nobody sees it until `open_batch`.

    Returns:
        The batch, which may be one of an earlier request with the same key. `arriving`: such a request is still under
        way. `full`: there is no room for another one of this client, or for its bytes. `too_many`: the client has as
        many batches under way as one may have.
    """
    exclusively(connection, BATCHES)
    if key is not None:
        same = select(batches, _is_cut_off().label("is_cut_off"))
        same = same.where(batches.c.owner == owner, batches.c.idempotency_key == key)
        known = connection.execute(same).one_or_none()
        if known is not None and known.is_cut_off:
            discard_batches(connection, [known.number])
        elif known is not None:
            return "arriving" if known.status == "arriving" else Arrival(known.number, known.id, known.body_digest)
    not_ended = batches.c.status.in_(["arriving", "running"]) & ~_is_cut_off()
    size, own = batches.c.size + BATCH_BYTES, batches.c.owner == owner
    under_way, own_under_way, all_bytes, own_bytes = connection.execute(
        select(
            func.count().filter(not_ended),
            func.count().filter(not_ended & own),
            func.coalesce(func.sum(size), 0),
            func.coalesce(func.sum(size).filter(own), 0),
        )
    ).one()
    if own_under_way >= bounds.batches_of_owner:
        return "too_many"
    if own_under_way + under_way >= bounds.batches or own_bytes + all_bytes >= bounds.size:
        return "full"
    batch_id = uuid.uuid4().hex
    made = insert(batches).values(
        id=batch_id,
        owner=owner,
        idempotency_key=key,
        status="arriving",
        engine=engine,
        total=0,
        size=0,
        created=time.time(),
    )
    return Arrival(connection.execute(made.returning(batches.c.number)).scalar_one(), batch_id)


def append_items(connection: Connection, number: int, first: int, chunk: Sequence[NewItem], namespace: str) -> int:
    """Put requests into a batch that arrives, from position `first` on; give the number of all of them.

    Each keeps the current robot and scene of its ids, in a namespace or else for all, and the roadmap of both. The
    batch needs them, also when the ids change.
    """
    exclusively(connection, CONTENTS)
    robots = ROBOTS.digests(connection, namespace, {item.robot for item in chunk})
    scenes = SCENES.digests(connection, namespace, {item.scene for item in chunk})
    roadmaps = keep_for_items(connection, namespace, chunk, robots, scenes)
    rows = [
        {
            "batch": number,
            "position": position,
            "request": item.request,
            "robot": robots.get(item.robot or ""),
            "scene": scenes.get(item.scene or ""),
            "deadline": item.deadline,
            "roadmap": roadmap,
        }
        for position, (item, roadmap) in enumerate(zip(chunk, roadmaps, strict=True), first)
    ]
    connection.execute(insert(items), rows)
    size = sum(len(item.request) for item in chunk)
    connection.execute(
        update(batches).where(batches.c.number == number).values(size=batches.c.size + size, total=first + len(chunk))
    )
    return first + len(chunk)


def open_batch(connection: Connection, number: int, body_digest: str) -> None:
    """Let the work on a batch begin: all its items have arrived."""
    values = {"status": "running", "engine": None, "body_digest": body_digest, "created": time.time()}
    connection.execute(update(batches).where(batches.c.number == number).values(**values))


def discard_batches(connection: Connection, numbers: Iterable[int]) -> None:
    """Forget batches, their items, and contents of robots, scenes and roadmaps that nothing else needs."""
    chosen = list(numbers)
    if not chosen:
        return
    exclusively(connection, CONTENTS)
    used = {
        kind: connection.scalars(select(needed).where(items.c.batch.in_(chosen)).distinct()).all()
        for kind, needed in ((ROBOTS, items.c.robot), (SCENES, items.c.scene))
    }
    of_roadmaps = connection.scalars(select(items.c.roadmap).where(items.c.batch.in_(chosen)).distinct()).all()
    connection.execute(delete(items).where(items.c.batch.in_(chosen)))
    connection.execute(delete(batches).where(batches.c.number.in_(chosen)))
    for kind, digests in used.items():
        kind.forget(connection, digests)
    forget_of_items(connection, of_roadmaps)


def find_batch(connection: Connection, batch_id: str, owner: str | None = None) -> BatchRecord | None:
    """Find a batch that has arrived, of one client or (None) of any."""
    query = select(*COLUMNS).where(batches.c.id == batch_id, batches.c.status != "arriving")
    if owner is not None:
        query = query.where(batches.c.owner == owner)
    row = connection.execute(query).one_or_none()
    return None if row is None else BatchRecord(*row)


def batches_before(
    connection: Connection, number: int | None, limit: int, owner: str | None = None
) -> list[BatchRecord]:
    """List batches that have arrived, the newest first, those before a number, of one client or (None) of all."""
    query = select(*COLUMNS).where(batches.c.status != "arriving").order_by(batches.c.number.desc()).limit(limit)
    if owner is not None:
        query = query.where(batches.c.owner == owner)
    if number is not None:
        query = query.where(batches.c.number < number)
    return [BatchRecord(*row) for row in connection.execute(query)]


def outcomes_of(connection: Connection, number: int) -> list[Outcomes]:
    """Count the items of a batch by their outcome; an index has all that it takes."""
    duration = items.c.duration
    query = select(
        items.c.outcome,
        func.count(),
        func.min(duration),
        func.max(duration),
        func.sum(duration),
        func.max(items.c.ratio),
    )
    rows = connection.execute(query.where(items.c.batch == number).group_by(items.c.outcome))
    return sorted((Outcomes(*row) for row in rows), key=lambda found: found.outcome or "")


def one_with(connection: Connection, number: int, outcome: str) -> int:
    """Find the position of an item of a batch that had an outcome: whichever comes first to hand."""
    found = select(items.c.position).where(items.c.batch == number, items.c.outcome == outcome).limit(1)
    return int(connection.execute(found).scalar_one())


def histogram_of(connection: Connection, number: int, outcome: str, shortest: float, longest: float) -> list[int]:
    """Count the items of a batch with an outcome in equal parts from the shortest duration to the longest, s."""
    width = max((longest - shortest) / HISTOGRAM_PARTS, LEAST_PART)
    part = func.round((items.c.duration - shortest) / width - 0.5)
    query = select(part, func.count()).where(items.c.batch == number, items.c.outcome == outcome).group_by(part)
    counts = [0] * HISTOGRAM_PARTS
    for found, count in connection.execute(query):
        counts[min(max(int(found), 0), HISTOGRAM_PARTS - 1)] += count
    return counts


def left_to_plan(connection: Connection) -> tuple[int, int]:
    """Count the batches that have work left, and their requests that are to be planned."""
    running = select(batches.c.number).where(batches.c.status == "running")
    left = select(func.count()).where(items.c.batch.in_(running), items.c.outcome.is_(None))
    count = connection.execute(select(func.count()).select_from(running.subquery())).scalar_one()
    return count, connection.execute(left).scalar_one()


def cancel_batch(connection: Connection, number: int) -> None:
    """End a batch early; finished items are kept, and no more are added."""
    running = (batches.c.number == number) & (batches.c.status == "running")
    connection.execute(update(batches).where(running).values(status="cancelled", ended=time.time(), rate=None))


def _is_cut_off() -> ColumnElement[bool]:
    """Make the condition that the service which took a batch in died before all of it had arrived."""
    alive = select(engines.c.id).where(engines.c.seen > time.time() - ENGINE_TIMEOUT)
    return (batches.c.status == "arriving") & batches.c.engine.not_in(alive)


def clean_up(connection: Connection, ended_before: float) -> None:
    """Forget batches that ended before a time, s since 1970, and those whose arrival was cut off; and dead services."""
    old = connection.scalars(select(batches.c.number).where((batches.c.ended < ended_before) | _is_cut_off()))
    discard_batches(connection, old.all())
    connection.execute(delete(engines).where(engines.c.seen < time.time() - 10.0 * ENGINE_TIMEOUT))
