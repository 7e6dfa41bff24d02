"""Claims of services on items of batches, and outcomes.

A service claims items, and says every second that it is alive. Items that a dead one had claimed are free again. What
comes of an item is written once: who comes second, since it was taken for dead, changes nothing.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any, NamedTuple

from sqlalchemy import bindparam, delete, func, insert, or_, select, union_all, update

from api.store.batches import ENGINE_TIMEOUT
from api.store.items import Result
from api.store.tables import batches, engines, items, roadmap_contents, robot_contents, scene_contents

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from sqlalchemy import Connection

RATE_MEMORY = 10.0
"""The time over which the rate of a batch is averaged, s: long enough for items of some seconds."""

MOST_BATCHES_AT_ONCE = 32
"""The most batches that share one claim; the others are next."""

MOST_BYTES = 8 * 2**20
"""The most bytes of results that are read at once: some hundred plans, or a few of the longest."""


class Claimed(NamedTuple):
    """An item to plan.

    Attributes:
        batch: The number of its batch.
        batch_id: The id of its batch.
        position: Its position there.
        request: The request as JSON, compressed.
        robot: The digest of the added robot that it names; None: a robot of the catalogue, or none.
        scene: The digest of the scene that it names; None: none.
        deadline: The deadline that it asks, s.
        roadmap: The digest of the roadmap on which its free motions are searched; None: there is none.
    """

    batch: int
    batch_id: str
    position: int
    request: bytes
    robot: str | None
    scene: str | None
    deadline: float
    roadmap: str | None = None


class Outcome(NamedTuple):
    """What came of an item.

    Attributes:
        batch: The number of its batch.
        position: Its position there.
        outcome: `planned`, or the code of a problem.
        result: The saved plan, or the problem document, compressed.
        duration: The duration of the trajectory, s.
        ratio: The largest share of a limit that is used.
        seconds: The time that a worker took, s; None: it did not come to an end.
    """

    batch: int
    position: int
    outcome: str
    result: bytes
    duration: float | None = None
    ratio: float | None = None
    seconds: float | None = None


def beat(connection: Connection, engine: str) -> None:
    """Say that a service is alive."""
    seen = update(engines).where(engines.c.id == engine).values(seen=time.time())
    if not connection.execute(seen).rowcount:
        connection.execute(insert(engines).values(id=engine, seen=time.time()))


def is_work_left(connection: Connection) -> bool:
    """Tell whether a batch is running."""
    running = select(batches.c.number).where(batches.c.status == "running").limit(1)
    return connection.execute(running).first() is not None


def claim(connection: Connection, engine: str, limit: int, turns: Mapping[int, int] | None = None) -> list[Claimed]:
    """Take items of running batches to work on: of each client as many, and of each of its batches.

    Args:
        connection: The transaction.
        engine: The service that takes them.
        limit: The number of items to take, about.
        turns: When items of a batch were taken last, by the number of the batch: batches without a turn come first.
    """
    dead = items.c.engine.not_in(select(engines.c.id).where(engines.c.seen > time.time() - ENGINE_TIMEOUT))
    is_free = items.c.outcome.is_(None) & or_(items.c.engine.is_(None), dead)
    has_work = select(items.c.position).where(items.c.batch == batches.c.number, is_free).exists()
    waiting = select(batches.c.number, batches.c.id, batches.c.owner).where(batches.c.status == "running", has_work)
    chosen = _shares(connection.execute(waiting.order_by(batches.c.number)).all(), limit, turns or {})
    if not chosen:
        return []
    beat(connection, engine)
    claimed: list[Claimed] = []
    for batch, share in chosen:
        free = select(items.c.position).where(items.c.batch == batch.number, is_free)
        # PostgreSQL may run a subquery for each row, and then takes other items each time; a CTE it runs once
        next_items = free.order_by(items.c.position).limit(share).with_for_update(skip_locked=True).cte("chosen")
        is_chosen = items.c.position.in_(select(next_items.c.position))
        taken = update(items).where(items.c.batch == batch.number, is_chosen).values(engine=engine)
        columns = (items.c[name] for name in Claimed._fields[2:])
        rows = connection.execute(taken.returning(*columns))
        claimed += [Claimed(batch.number, batch.id, *row) for row in sorted(rows, key=lambda row: row.position)]
    return claimed


def _shares(waiting: Sequence[Any], limit: int, turns: Mapping[int, int]) -> list[tuple[Any, int]]:
    """Divide a claim among clients, and each share among its batches, the longest without a turn first."""
    of_client: dict[str, list[Any]] = {}
    for batch in sorted(waiting, key=lambda batch: turns.get(batch.number, 0)):
        of_client.setdefault(batch.owner, []).append(batch)
    last_turns = {owner: max(turns.get(batch.number, 0) for batch in own) for owner, own in of_client.items()}
    clients = sorted(of_client, key=lambda owner: last_turns[owner])[: min(limit, MOST_BATCHES_AT_ONCE)]
    shares = []
    for owner in clients:
        share = math.ceil(limit / len(clients))
        own = of_client[owner][: max(1, min(share, MOST_BATCHES_AT_ONCE // len(clients)))]
        shares += [(batch, math.ceil(share / len(own))) for batch in own]
    return shares


def definition_of(connection: Connection, digest: str) -> bytes:
    """Read the definition of an added robot or of a scene, or the bytes of a roadmap."""
    tables = (robot_contents, scene_contents, roadmap_contents)
    found = union_all(*(select(table.c.definition).where(table.c.digest == digest) for table in tables))
    definition: bytes = connection.execute(found.limit(1)).scalar_one()
    return definition


def settle(connection: Connection, outcomes: Sequence[Outcome]) -> None:
    """Write the outcomes of items, except for batches that have ended since."""
    touched = select(batches).where(batches.c.number.in_({outcome.batch for outcome in outcomes}))
    locked = connection.execute(touched.order_by(batches.c.number).with_for_update())
    running = {row.number: row for row in locked if row.status == "running"}
    written = [outcome for outcome in outcomes if outcome.batch in running]
    if not written:
        return
    of_item = (items.c.batch == bindparam("of_batch")) & (items.c.position == bindparam("at"))
    columns: dict[str, Any] = {name: bindparam(f"new_{name}") for name in Outcome._fields[2:]}
    connection.execute(
        update(items).where(of_item, items.c.outcome.is_(None)).values(columns),
        [
            {"of_batch": done.batch, "at": done.position, **{f"new_{name}": getattr(done, name) for name in columns}}
            for done in written
        ],
    )
    for number, batch in running.items():
        _tell(connection, batch, [outcome for outcome in written if outcome.batch == number])


def _tell(connection: Connection, batch: Any, written: Sequence[Outcome]) -> None:
    """Note in its batch that results have been written."""
    now = time.time()
    seconds = max(now - (batch.settled or batch.created), 1e-3)
    rate, weight = len(written) / seconds, -math.expm1(-seconds / RATE_MEMORY)
    left = select(items.c.position).where(items.c.batch == batch.number, items.c.outcome.is_(None)).limit(1)
    is_done = connection.execute(left).first() is None
    values = {
        "settled": now,
        "rate": None if is_done else rate if batch.rate is None else batch.rate + weight * (rate - batch.rate),
        "size": batch.size + sum(len(outcome.result) for outcome in written),
        **({"status": "completed", "ended": now} if is_done else {}),
    }
    connection.execute(update(batches).where(batches.c.number == batch.number).values(values))


def ended(connection: Connection, numbers: Collection[int]) -> set[int]:
    """Tell which of these batches are not running any more."""
    running = select(batches.c.number).where(batches.c.number.in_(numbers), batches.c.status == "running")
    return set(numbers) - set(connection.scalars(running))


def give_back(connection: Connection, engine: str, claimed: Sequence[Claimed]) -> None:
    """Free items that a service has claimed and not begun."""
    for number in {item.batch for item in claimed}:
        positions = [item.position for item in claimed if item.batch == number]
        of_batch = (items.c.batch == number) & items.c.position.in_(positions)
        connection.execute(update(items).where(of_batch, items.c.engine == engine).values(engine=None))


def leave(connection: Connection, engine: str) -> None:
    """Release the claims of a service that stops."""
    connection.execute(update(items).where(items.c.engine == engine, items.c.outcome.is_(None)).values(engine=None))
    connection.execute(delete(engines).where(engines.c.id == engine))


def results_behind(
    connection: Connection, number: int, position: int, limit: int, ended: bool
) -> tuple[list[Result], bool]:
    """Read what came of items behind a position, in order, and tell whether there is more to be read now.

    Of a batch that has not ended that is up to the first item that is not done, so that who reads on misses none. No
    more is read than `MOST_BYTES`, but for the first: some plans have a few kB, others a hundred times that.
    """
    behind = (items.c.batch == number) & (items.c.position > position)
    if ended:
        behind &= items.c.outcome.is_not(None)
    sizes = select(items.c.position, items.c.outcome, func.length(items.c.result).label("size")).where(behind)
    last, count, size, has_more = position, 0, 0, False
    for row in connection.execute(sizes.order_by(items.c.position).limit(limit + 1)):
        if row.outcome is None:
            break
        size += row.size
        has_more = count == limit or (count > 0 and size > MOST_BYTES)
        if has_more:
            break
        last, count = row.position, count + 1
    columns = (items.c[name] for name in Result._fields)
    found = select(*columns).where(behind, items.c.position <= last).order_by(items.c.position)
    return [Result(*row) for row in connection.execute(found)], has_more
