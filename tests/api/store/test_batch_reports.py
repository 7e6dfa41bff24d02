"""Data for reports of batches, on SQLite and PostgreSQL: equal to sums over all items, in constant memory."""

from __future__ import annotations

import tracemalloc
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from sqlalchemy import insert

from api.store.batch_reports import BARS, EXAMPLES, LARGEST, WORST, report_figures, shown_results
from api.store.items import PLANNED
from api.store.tables import batches, items
from tests.api.store.databases import engine, postgres

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Connection, Engine

__all__ = ["engine", "postgres"]
CODES = ("collision", "unreachable_waypoint")


@pytest.fixture
def connection(engine: Engine) -> Iterator[Connection]:
    with engine.connect() as connection:
        yield connection
        connection.rollback()


def batch_of(connection: Connection, batch_id: str, rows: list[dict[str, Any]]) -> int:
    made = {"id": batch_id, "owner": "me", "status": "running", "total": len(rows), "size": 0, "created": 0.0}
    number: int = connection.execute(insert(batches).values(**made).returning(batches.c.number)).scalar_one()
    common = {"batch": number, "request": b"request", "deadline": 1.0}
    connection.execute(insert(items), [common | row for row in rows])
    return number


def rows_of(count: int, seed: int = 1) -> list[dict[str, Any]]:
    """Return items of all kinds: planned, refused, aborted, and not answered yet."""
    random = np.random.default_rng(seed)
    rows = []
    for position in range(count):
        row: dict[str, Any] = dict.fromkeys(("outcome", "duration", "ratio", "seconds", "result"))
        kind = random.choice(["planned", "planned", "planned", *CODES, "waiting"])
        if kind != "waiting":
            row |= {"outcome": str(kind), "result": b"result", "seconds": float(random.lognormal(-4.0))}
        if kind == PLANNED:
            row |= {"duration": float(random.uniform(1.0, 9.0)), "ratio": float(min(1.0, random.uniform(0.0, 1.3)))}
        if kind == "collision" and random.random() < 0.3:
            row["seconds"] = None
        rows.append(row | {"position": position})
    return rows


def values(rows: list[dict[str, Any]], name: str) -> list[float]:
    return [row[name] for row in rows if row[name] is not None]


def test_figures_are_those_of_all_items_of_a_batch(connection: Connection) -> None:
    rows = rows_of(400)
    batch_of(connection, "another", rows_of(50, seed=2))
    figures = report_figures(connection, batch_of(connection, "one", rows), CODES)
    edges = {
        "duration": np.linspace(min(values(rows, "duration")), max(values(rows, "duration")), BARS + 1),
        "ratio": np.linspace(0.0, 1.0, BARS + 1),
        "seconds": np.geomspace(min(values(rows, "seconds")), max(values(rows, "seconds")), BARS + 1),
    }
    for name, expected in edges.items():
        spread, found = getattr(figures, name), values(rows, name)
        assert (spread.least, spread.most) == (min(found), max(found))
        assert spread.mean == pytest.approx(np.mean(found))
        assert spread.edges == pytest.approx(expected)
        assert spread.counts == np.histogram(found, expected)[0].tolist()


def test_the_worst_come_first_and_examples_by_their_index(connection: Connection) -> None:
    rows = rows_of(400)
    figures = report_figures(connection, batch_of(connection, "one", rows), CODES)
    for kind, name in (("longest", "duration"), ("nearest", "ratio"), ("slowest", "seconds")):
        ordered = sorted((row for row in rows if row[name] is not None), key=lambda row: (-row[name], row["position"]))
        assert [item.position for item in figures.worst[kind]] == [row["position"] for row in ordered[:WORST]]
        assert [getattr(item, name) for item in figures.worst[kind]] == [row[name] for row in ordered[:WORST]]
    for code in CODES:
        first = [row["position"] for row in rows if row["outcome"] == code][:EXAMPLES]
        assert [item.position for item in figures.examples[code]] == first


def test_a_batch_without_answers_has_no_figures(connection: Connection) -> None:
    rows = [dict.fromkeys(("outcome", "duration", "ratio", "seconds", "result")) | {"position": 0}]
    figures = report_figures(connection, batch_of(connection, "one", rows), ())
    assert figures.duration is figures.ratio is figures.seconds is None
    assert figures.positions() == []


def test_durations_that_are_the_same_are_counted(connection: Connection) -> None:
    same = {"outcome": PLANNED, "duration": 2.0, "ratio": 1.0, "seconds": 0.5, "result": b"result"}
    figures = report_figures(connection, batch_of(connection, "one", [same | {"position": k} for k in range(3)]), ())
    for spread in (figures.duration, figures.ratio, figures.seconds):
        assert spread is not None and sum(spread.counts) == 3


def test_what_is_large_is_not_read(connection: Connection) -> None:
    done = {"outcome": PLANNED, "duration": 2.0, "ratio": 1.0, "seconds": 0.5}
    sizes = [10, LARGEST, 10]
    rows = [done | {"position": k, "result": bytes(size)} for k, size in enumerate(sizes)]
    number = batch_of(connection, "one", rows)
    assert [result.position for result in shown_results(connection, number, [2, 1, 0])] == [2, 0]


@pytest.mark.large_only
def test_the_figures_of_many_items_take_no_more_memory(connection: Connection) -> None:
    """The results have 200 MB; the index alone is read, and sums come back."""
    rows = [row | {"result": row["result"] and bytes(2000)} for row in rows_of(100_000)]
    number = batch_of(connection, "one", rows)
    del rows
    tracemalloc.start()
    report_figures(connection, number, CODES)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2e6
