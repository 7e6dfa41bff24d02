"""Clients that follow a batch share one database query, and an unchanged batch is not summed up again."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from api.base.errors import DatabaseUnavailable, UnknownBatch
from api.batches import looks as looks_module
from api.batches.looks import Looks
from api.store.batches import BatchRecord, Outcomes, find_batch

FOLLOWERS = 60
RUNNING = BatchRecord(1, "b", "running", 4, 0.0, None, None, None)


class MadeUpDatabase:
    """A database with one batch, which counts the reads."""

    def __init__(self) -> None:
        self.batch: BatchRecord | None = RUNNING
        self.finds = self.sums = 0
        self.refusals: list[Exception] = []

    async def read(self, work: Any, *_arguments: Any) -> Any:
        await asyncio.sleep(0.0)
        if self.refusals:
            raise self.refusals.pop()
        if work is find_batch:
            self.finds += 1
            return self.batch
        self.sums += 1
        return [Outcomes(None, 4, None, None, None, None)], [], {}


async def followed(looks: Looks) -> list[Any]:
    return await asyncio.gather(*(looks.follow("b") for _ in range(FOLLOWERS)), return_exceptions=True)


def test_followers_of_a_batch_share_one_look(monkeypatch: pytest.MonkeyPatch) -> None:
    """60 followers slowed the requests of other clients by a factor of 60, from 33 ms to 1,960."""
    monkeypatch.setattr(looks_module, "LOOK", 0.0)

    async def test() -> None:
        database: Any = MadeUpDatabase()
        looks = Looks(database)
        first = await followed(looks)
        assert {id(look) for look in first} == {id(first[0])}
        assert (database.finds, database.sums) == (1, 1)
        assert first[0].description["counts"]["waiting"] == 4
        await asyncio.sleep(0.01)
        await followed(looks)
        assert (database.finds, database.sums) == (2, 1)  # nothing has been written since
        database.batch = RUNNING._replace(settled=1.0)
        await asyncio.sleep(0.01)
        await followed(looks)
        assert (database.finds, database.sums) == (3, 2)
        await looks.describe(database.batch)  # as GET does
        assert database.sums == 2

    asyncio.run(test())


def test_who_hangs_up_takes_nothing_from_other_followers() -> None:
    async def test() -> None:
        database: Any = MadeUpDatabase()
        looks = Looks(database)
        follows = [asyncio.create_task(looks.follow("b")) for _ in range(2)]
        await asyncio.sleep(0.0)
        follows[0].cancel()
        assert (await follows[1]).batch == RUNNING

    asyncio.run(test())


def test_a_look_that_failed_is_not_kept() -> None:
    async def test() -> None:
        database: Any = MadeUpDatabase()
        looks = Looks(database)
        database.refusals = [DatabaseUnavailable("gone")]
        assert {type(look) for look in await followed(looks)} == {DatabaseUnavailable}
        assert (await looks.follow("b")).batch == RUNNING
        forgotten = Looks(database)
        database.batch = None
        with pytest.raises(UnknownBatch):
            await forgotten.follow("b")

    asyncio.run(test())
