"""Batches that are deleted while a client reads them: their id is unknown from then on."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from fastapi import Request

from api.base.errors import UnknownBatch
from api.batches.looks import Looks
from api.http.routers.batches import get_batch, get_batch_report, get_batch_results
from api.store import batches, claims
from api.store.batches import (
    Arrival,
    BatchBounds,
    append_items,
    begin_batch,
    cancel_batch,
    discard_batches,
    open_batch,
)
from api.store.claims import Outcome, settle
from api.store.clients import Client
from api.store.contents.robots import RobotContent
from api.store.database import Database, sqlite_url
from api.store.items import PLANNED, NewItem
from api.store.named_contents import ROBOTS, Bounds

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from pathlib import Path

    from sqlalchemy import Connection


def ended_batch(connection: Connection) -> str:
    """Return the id of a batch with a plan and a refusal, which is the last to need a robot."""
    bounds = Bounds(ids=1, ids_of_owner=1, size=1000, size_of_owner=1000)
    ROBOTS.add(connection, "", "arm", RobotContent("x", b"definition", b"{}", b"{}"), "me", bounds)
    arrival = begin_batch(connection, "me", None, "service", BatchBounds(1, 1, 1000))
    assert isinstance(arrival, Arrival)
    append_items(connection, arrival.number, 0, [NewItem(b"", "arm", None, 10.0)] * 2, "")
    open_batch(connection, arrival.number, "digest")
    outcomes = [(0, PLANNED, 2.0), (1, "unreachable_waypoint", None)]
    settle(connection, [Outcome(arrival.number, k, outcome, b"", length, length) for k, outcome, length in outcomes])
    cancel_batch(connection, arrival.number)
    ROBOTS.delete(connection, "", "arm", "me")
    return arrival.id


@pytest.mark.parametrize(
    ("read", "module", "before"),
    [
        (get_batch, batches, "outcomes_of"),
        (get_batch_report, batches, "outcomes_of"),
        (get_batch_results, claims, "results_behind"),
    ],
)
def test_who_reads_a_batch_that_is_forgotten_meanwhile_is_told_so(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    read: Callable[[Request, str], Awaitable[Any]],
    module: Any,
    before: str,
) -> None:
    """PostgreSQL lets a reader see what others have done since its last statement."""
    database = Database(sqlite_url(tmp_path))
    database.open()
    original = getattr(module, before)

    def then_forget(connection: Connection, number: int, *others: Any, **options: Any) -> Any:
        found = original(connection, number, *others, **options)
        discard_batches(connection, [number])
        return found

    monkeypatch.setattr(module, before, then_forget)

    async def run() -> None:
        batch_id = await database.write(ended_batch)
        service = SimpleNamespace(database=database, looks=Looks(database))
        app = SimpleNamespace(state=SimpleNamespace(service=service))
        scope = {"type": "http", "method": "GET", "path": "/", "headers": [], "query_string": b"", "app": app}
        scope |= {"state": {"client": Client("127.0.0.1")}}
        with pytest.raises(UnknownBatch, match="No stored batch has this id"):
            await read(Request(scope), batch_id)

    asyncio.run(run())
    database.close()
