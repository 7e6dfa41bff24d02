"""The batch engine with a made-up pool: every item is planned once despite faults of the database."""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from typing import TYPE_CHECKING, Any

import pytest
from sqlalchemy import make_url

from api.base.errors import DatabaseUnavailable, DeadlineExceeded
from api.base.settings import Settings
from api.batches import engine as engine_module
from api.batches.engine import Engine
from api.batches.planners import PoolPlanners
from api.pool.messages import Reply, Task
from api.store.batches import (
    BatchBounds,
    append_items,
    begin_batch,
    cancel_batch,
    clean_up,
    find_batch,
    open_batch,
)
from api.store.claims import results_behind
from api.store.database import Database, sqlite_url
from api.store.items import NewItem
from api.telemetry.metrics import Metrics
from tests.api.store.databases import PostgresServer, postgres

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from pathlib import Path

__all__ = ["postgres"]
ITEMS = 60


@pytest.fixture(autouse=True)
def _often(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("BEAT", "IDLE"):
        monkeypatch.setattr(engine_module, name, 0.02)


class MadeUpPool:
    """A pool that returns each request as its answer after a delay, s."""

    most_behind = 2

    def __init__(self) -> None:
        self.begun: Counter[bytes] = Counter()
        self.asked: Counter[bytes] = Counter()
        self.seconds = 0.002

    async def run_behind(self, task: Task, kind: object, seconds: float) -> Reply:
        bodies = [body for body, _ in task.arguments["items"]]
        self.begun.update(bodies)
        await asyncio.sleep(self.seconds)
        self.asked.update(bodies)
        if b"late" in bodies:
            raise DeadlineExceeded("too late")
        return Reply(200, "", b"", result=[Reply(200, "", b"plan of " + body, result=(1.0, 0.5)) for body in bodies])


def planners_of(pool: MadeUpPool) -> PoolPlanners:
    return PoolPlanners(pool, Settings())  # type: ignore[arg-type]


async def batch_of(database: Database, *requests: bytes, client: str = "client") -> tuple[int, str]:
    arrival: Any = await database.write(begin_batch, client, None, "arriving", BatchBounds(10, 10, 10**9))
    await database.write(
        append_items, arrival.number, 0, [NewItem(request, None, None, 10.0) for request in requests], ""
    )
    await database.write(open_batch, arrival.number, "digest")
    return arrival.number, arrival.id


async def is_completed(database: Database, batch_id: str) -> bool:
    batch = await database.read(find_batch, batch_id)
    return batch is not None and batch.status == "completed"


async def is_gone(database: Database) -> bool:
    try:
        await database.read(find_batch, "")
    except DatabaseUnavailable:
        return True
    return False


async def until(condition: Callable[[], Awaitable[bool]]) -> None:
    async with asyncio.timeout(90.0):
        while not await condition():
            await asyncio.sleep(0.01)


@pytest.mark.large_only
def test_the_database_goes_away_in_the_middle(postgres: PostgresServer) -> None:
    url = make_url(postgres.new_database("goes_away")).set(drivername="postgresql+psycopg")

    async def run() -> None:
        database, pool = Database(url), MadeUpPool()
        database.open()
        engines = [Engine(database, planners_of(pool), Settings(), Metrics()) for _ in range(2)]
        requests = [b"%d" % k for k in range(ITEMS)]
        number, batch_id = await batch_of(database, *requests)
        for engine in engines:
            await engine.start()

        async def some() -> bool:
            return bool((await database.read(results_behind, number, -1, 10, ended=False))[0])

        async def completed() -> bool:
            try:
                return await is_completed(database, batch_id)
            except DatabaseUnavailable:
                return False

        await until(some)
        await asyncio.to_thread(postgres.stop)
        await until(lambda: is_gone(database))
        await asyncio.to_thread(postgres.start)
        await until(completed)
        for engine in engines:
            await engine.stop()
        results, _ = await database.read(results_behind, number, -1, 1000, ended=True)
        assert [result.position for result in results] == list(range(ITEMS))
        assert [result.result for result in results] == [b"plan of " + request for request in requests]
        assert set(pool.asked) == set(requests)
        database.close()

    asyncio.run(run())


def test_what_does_not_end_well_is_a_result_too_and_what_is_cancelled_is_given_up(tmp_path: Path) -> None:
    async def run() -> None:
        database, pool = Database(sqlite_url(tmp_path)), MadeUpPool()
        database.open()
        engine = Engine(database, planners_of(pool), Settings(), Metrics())
        number, batch_id = await batch_of(database, b"late", b"in time")
        other, _ = await batch_of(database, *[b"%d" % k for k in range(2000)])
        await engine.start()

        await until(lambda: is_completed(database, batch_id))
        (late, in_time), _ = await database.read(results_behind, number, -1, 10, ended=True)
        assert (late.outcome, in_time.outcome) == ("deadline_exceeded", "planned")
        await until(lambda: _true(sum(pool.asked.values()) > 100))
        pool.seconds = 60.0
        await database.write(cancel_batch, other)  # as another service would
        await until(lambda: _true(not engine._under_way and not engine._claimed))
        assert sum(pool.asked.values()) < 2000
        await engine.stop()
        database.close()

    asyncio.run(run())


def test_of_a_batch_that_is_cancelled_nothing_ends_and_nothing_begins(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Without a beat, which would find out later: each plan takes a minute, and more are claimed than are under way."""
    monkeypatch.setattr(engine_module, "BEAT", 60.0)

    async def run() -> None:
        database, pool = Database(sqlite_url(tmp_path)), MadeUpPool()
        database.open()
        planners = planners_of(pool)
        engine = Engine(database, planners, Settings(), Metrics())
        pool.seconds = 60.0
        number, _ = await batch_of(database, *[b"%d" % k for k in range(50)])
        await engine.start()
        await until(lambda: _true(sum(pool.begun.values()) == planners.at_once))
        assert engine._claimed
        await database.write(cancel_batch, number)
        engine.forget(number)
        begun = pool.begun.copy()
        pool.seconds = 0.002
        _, behind = await batch_of(database, b"behind")
        engine.wake()

        await until(lambda: is_completed(database, behind))
        assert pool.begun == begun + Counter([b"behind"])
        assert pool.asked == Counter([b"behind"])
        await engine.stop()
        database.close()

    asyncio.run(run())


def test_a_batch_is_planned_though_one_of_its_number_was_cancelled(tmp_path: Path) -> None:
    """SQLite gives the number of the newest batch again once that is forgotten; the next one stood still for good."""

    async def run() -> None:
        database, pool = Database(sqlite_url(tmp_path)), MadeUpPool()
        database.open()
        engine = Engine(database, planners_of(pool), Settings(), Metrics())

        first, first_id = await batch_of(database, b"1")
        await engine.start()
        await until(lambda: is_completed(database, first_id))
        engine.forget(first)  # somebody cancels it, too late
        await database.write(clean_up, time.time() + 1.0)
        second, second_id = await batch_of(database, b"2")
        assert second == first
        await until(lambda: is_completed(database, second_id))
        await engine.stop()
        database.close()

    asyncio.run(run())


def test_the_end_of_a_batch_does_not_wait_for_a_beat(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(engine_module, "BEAT", 60.0)

    async def run() -> None:
        database = Database(sqlite_url(tmp_path))
        database.open()
        engine = Engine(database, planners_of(MadeUpPool()), Settings(), Metrics())
        await engine.start()
        await until(lambda: _true(bool(engine._all_done._waiters)))  # for the second beat, a minute later
        _, batch_id = await batch_of(database, b"1", b"2", b"3")

        await until(lambda: is_completed(database, batch_id))
        await engine.stop()
        database.close()

    asyncio.run(run())


@pytest.mark.large_only
def test_a_batch_has_its_turn_though_items_of_another_were_claimed_while_all_were_quick(tmp_path: Path) -> None:
    """Five hundred slow items of one client were claimed at once and delayed all other clients."""

    async def run() -> None:
        database, pool = Database(sqlite_url(tmp_path)), MadeUpPool()
        database.open()
        engine = Engine(database, planners_of(pool), Settings(), Metrics())
        await batch_of(database, *[b"quick %d" % k for k in range(3000)], client="greedy")
        await engine.start()
        await until(lambda: _true(len(engine._claimed) > 300))

        pool.seconds = 0.5
        begun = sum(pool.begun.values())
        await until(lambda: _true(sum(pool.begun.values()) > begun + 5))
        _, batch_id = await batch_of(database, b"modest", client="modest")
        before = sum(pool.asked.values())
        await until(lambda: is_completed(database, batch_id))
        assert sum(pool.asked.values()) - before < 150
        await engine.stop()
        database.close()

    asyncio.run(run())


async def _true(value: bool) -> bool:
    return value
