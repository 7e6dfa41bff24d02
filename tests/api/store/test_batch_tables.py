"""Batches in SQLite and PostgreSQL: items claimed by one service, planned once, and batches visible as a whole."""

from __future__ import annotations

import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import pytest
from sqlalchemy import delete, func, select, update

from api.store.batches import (
    BATCH_BYTES,
    Arrival,
    BatchBounds,
    append_items,
    batches_before,
    begin_batch,
    cancel_batch,
    clean_up,
    discard_batches,
    find_batch,
    histogram_of,
    one_with,
    open_batch,
    outcomes_of,
)
from api.store.claims import MOST_BYTES, Outcome, beat, claim, definition_of, ended, leave, results_behind, settle
from api.store.contents.robots import RobotContent
from api.store.items import PLANNED, NewItem
from api.store.named_contents import ROBOTS, Bounds
from api.store.tables import batches, engines, items, robot_contents, robots
from tests.api.store.databases import engine, postgres

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Connection, Engine

__all__ = ["engine", "postgres"]
WIDE = BatchBounds(batches=100, batches_of_owner=100, size=10**9)
ME, OTHER = "me", "other"


@pytest.fixture
def connection(engine: Engine) -> Iterator[Connection]:
    """A transaction that is undone, in which both services are alive."""
    with engine.connect() as connection:
        beat(connection, ME)
        beat(connection, OTHER)
        yield connection
        connection.rollback()


def arrived(
    connection: Connection, count: int, key: str | None = None, robot: str | None = None, client: str = "client"
) -> Arrival:
    arrival = begin_batch(connection, client, key, ME, WIDE)
    assert isinstance(arrival, Arrival)
    append_items(connection, arrival.number, 0, [NewItem(b"%d" % k, robot, None, 10.0) for k in range(count)], "")
    open_batch(connection, arrival.number, "digest")
    return arrival


def done(arrival: Arrival, *positions: int, result: bytes = b"result", outcome: str = PLANNED) -> list[Outcome]:
    return [Outcome(arrival.number, position, outcome, result, 2.0 + position, 0.5) for position in positions]


def test_an_item_is_claimed_by_one_until_that_one_is_dead(connection: Connection) -> None:
    arrival = arrived(connection, 5)
    assert [(item.position, item.request, item.batch_id) for item in claim(connection, ME, 3)] == [
        (0, b"0", arrival.id),
        (1, b"1", arrival.id),
        (2, b"2", arrival.id),
    ]
    assert [item.position for item in claim(connection, OTHER, 3)] == [3, 4]
    assert claim(connection, OTHER, 3) == []
    settle(connection, done(arrival, 0))
    connection.execute(update(engines).where(engines.c.id == ME).values(seen=time.time() - 60.0))
    assert [item.position for item in claim(connection, OTHER, 3)] == [1, 2]


def test_what_a_service_gives_back_is_free_at_once(connection: Connection) -> None:
    arrived(connection, 2)
    claim(connection, ME, 2)
    leave(connection, ME)
    assert len(claim(connection, OTHER, 2)) == 2


def test_several_batches_share_what_is_claimed(connection: Connection) -> None:
    first, second = arrived(connection, 10), arrived(connection, 10)
    claimed = claim(connection, ME, 6)
    assert [item.batch for item in claimed] == [first.number] * 3 + [second.number] * 3


def test_what_came_of_an_item_is_written_once(connection: Connection) -> None:
    arrival = arrived(connection, 2)
    settle(connection, done(arrival, 1, result=b"first"))
    settle(connection, done(arrival, 0, 1, result=b"second"))
    results, _ = results_behind(connection, arrival.number, -1, 10, ended=False)
    assert [(result.position, result.result) for result in results] == [(0, b"second"), (1, b"first")]


def test_results_of_a_running_batch_end_before_the_first_that_is_missing(connection: Connection) -> None:
    arrival = arrived(connection, 4)

    def positions(behind: int = -1) -> list[int]:
        batch = find_batch(connection, arrival.id)
        assert batch is not None
        found, has_more = results_behind(connection, arrival.number, behind, 10, ended=batch.status != "running")
        assert not has_more
        return [result.position for result in found]

    settle(connection, done(arrival, 0, 1, 3))
    assert positions() == [0, 1]
    assert positions(1) == []
    cancel_batch(connection, arrival.number)
    settle(connection, done(arrival, 2))  # too late
    assert positions() == [0, 1, 3]


def test_no_more_than_so_many_bytes_are_read_at_once(connection: Connection) -> None:
    arrival = arrived(connection, 5)
    settle(connection, done(arrival, 0, result=b"x" * (MOST_BYTES + 1)) + done(arrival, 1, 2, 3, 4, result=b"xxx"))
    pages = [results_behind(connection, arrival.number, behind, 2, ended=True) for behind in (-1, 0, 2, 3)]
    assert [([result.position for result in page], has_more) for page, has_more in pages] == [
        ([0], True),
        ([1, 2], True),
        ([3, 4], False),
        ([4], False),
    ]


def test_a_batch_counts_its_outcomes_and_is_completed_by_the_last(connection: Connection) -> None:
    arrival = arrived(connection, 4)
    settle(connection, done(arrival, 0, 2) + done(arrival, 3, outcome="unknown_robot"))
    assert ended(connection, {arrival.number}) == set()
    counted = {found.outcome: found for found in outcomes_of(connection, arrival.number)}
    assert {outcome: found.items for outcome, found in counted.items()} == {None: 1, PLANNED: 2, "unknown_robot": 1}
    assert counted[PLANNED][2:] == (2.0, 4.0, 6.0, 0.5)
    assert histogram_of(connection, arrival.number, PLANNED, 2.0, 4.0) == [1, *[0] * 18, 1]
    assert histogram_of(connection, arrival.number, PLANNED, 4.0, 4.0)[0] == 2
    assert one_with(connection, arrival.number, "unknown_robot") == 3
    batch = find_batch(connection, arrival.id)
    assert batch is not None and batch.status == "running" and (batch.rate or 0.0) > 0.0
    settle(connection, done(arrival, 1))
    batch = find_batch(connection, arrival.id)
    assert batch is not None and batch.status == "completed" and batch.ended is not None
    assert ended(connection, {arrival.number}) == {arrival.number}
    cancel_batch(connection, arrival.number)  # which is too late
    assert find_batch(connection, arrival.id) == batch


def test_a_batch_is_seen_when_it_has_arrived(connection: Connection) -> None:
    arrival = begin_batch(connection, "client", "key", ME, WIDE)
    assert isinstance(arrival, Arrival)
    append_items(connection, arrival.number, 0, [NewItem(b"0", None, None, 10.0)], "")
    assert find_batch(connection, arrival.id) is None
    assert claim(connection, ME, 10) == []
    assert begin_batch(connection, "client", "key", ME, WIDE) == "arriving"
    open_batch(connection, arrival.number, "digest")
    assert begin_batch(connection, "client", "key", ME, WIDE) == arrival._replace(body_digest="digest")
    assert begin_batch(connection, "another", "key", ME, WIDE) != arrival._replace(body_digest="digest")
    newer = arrived(connection, 1)
    assert [batch.id for batch in batches_before(connection, None, 10)] == [newer.id, arrival.id]
    assert [batch.id for batch in batches_before(connection, newer.number, 10)] == [arrival.id]


def test_there_is_room_for_so_many_batches(connection: Connection) -> None:
    arrived(connection, 3)
    assert begin_batch(connection, "client", None, ME, WIDE._replace(batches=1)) == "full"
    assert begin_batch(connection, "client", None, ME, WIDE._replace(size=3)) == "full"
    assert begin_batch(connection, "client", None, ME, WIDE._replace(batches_of_owner=1)) == "too_many"
    assert isinstance(begin_batch(connection, "another", None, ME, WIDE._replace(batches_of_owner=1)), Arrival)


def test_a_batch_keeps_the_robot_that_its_id_stood_for(connection: Connection) -> None:
    content = RobotContent("sha256:x", b"definition", b"{}", b"{}")
    ROBOTS.add(connection, "", "arm", content, "client", Bounds(10, 10, 1000, 1000))
    arrival = arrived(connection, 1, robot="arm")
    assert ROBOTS.delete(connection, "", "arm", "client") == "deleted"
    (item,) = claim(connection, ME, 1)
    assert item.robot is not None and definition_of(connection, item.robot) == b"definition"
    settle(connection, done(arrival, 0))
    clean_up(connection, time.time() + 1.0)
    for table in (batches, items, robots, robot_contents):
        assert connection.scalar(select(func.count()).select_from(table)) == 0


def test_the_key_of_a_batch_whose_arrival_was_cut_off_is_free(connection: Connection) -> None:
    """A service that was killed while a batch arrived left the key, and the client's place, taken for an hour."""
    one_each = WIDE._replace(batches_of_owner=1)
    first = begin_batch(connection, "client", "key", OTHER, one_each)
    assert isinstance(first, Arrival)
    append_items(connection, first.number, 0, [NewItem(b"0", None, None, 10.0)], "")
    assert begin_batch(connection, "client", "key", ME, one_each) == "arriving"
    assert begin_batch(connection, "client", "another", ME, one_each) == "too_many"
    connection.execute(update(engines).where(engines.c.id == OTHER).values(seen=time.time() - 60.0))
    again = begin_batch(connection, "client", "key", ME, one_each)
    assert isinstance(again, Arrival) and again.body_digest is None and again.id != first.id
    assert connection.execute(select(func.count()).select_from(items)).scalar_one() == 0
    assert begin_batch(connection, "client", "another", ME, one_each) == "too_many"


def test_a_batch_whose_arrival_was_cut_off_is_forgotten(connection: Connection) -> None:
    arrival = begin_batch(connection, "client", None, ME, WIDE)
    assert isinstance(arrival, Arrival)
    append_items(connection, arrival.number, 0, [NewItem(b"0", None, None, 10.0)], "")
    clean_up(connection, 0.0)
    assert connection.scalar(select(func.count()).select_from(items)) == 1
    connection.execute(update(engines).where(engines.c.id == ME).values(seen=time.time() - 60.0))
    clean_up(connection, 0.0)
    assert connection.scalar(select(func.count()).select_from(items)) == 0


def test_services_that_work_at_once_do_every_item_once(engine: Engine) -> None:
    """Four of them; what each claims is its own."""
    with engine.begin() as connection:
        arrival = arrived(connection, 200)

    def work(name: str) -> list[int]:
        claimed = []
        while True:
            with engine.begin() as connection:
                beat(connection, name)
            with engine.begin() as connection:
                found = claim(connection, name, 7)
            if not found:
                return claimed
            claimed += [item.position for item in found]
            with engine.begin() as connection:
                settle(connection, done(arrival, *(item.position for item in found), result=name.encode()))

    with ThreadPoolExecutor(4) as threads:
        claimed = list(threads.map(work, "abcd"))
    assert sorted(position for positions in claimed for position in positions) == list(range(200))
    with engine.begin() as connection:
        results, _ = results_behind(connection, arrival.number, -1, 1000, ended=True)
        assert [result.position for result in results] == list(range(200))
        batch = find_batch(connection, arrival.id)
        assert batch is not None and batch.status == "completed"
        for table in (items, batches, engines):
            connection.execute(delete(table))


def test_no_client_takes_all_places_and_ended_batches_take_none(connection: Connection) -> None:
    """One key took all places for seven days within 38 s."""
    bounds = BatchBounds(batches=8, batches_of_owner=100, size=10**9)
    made = []
    while isinstance(arrival := begin_batch(connection, "greedy", None, ME, bounds), Arrival):
        made.append(arrival)
    assert (arrival, len(made)) == ("full", 4)
    assert isinstance(begin_batch(connection, "another", None, ME, bounds), Arrival)
    for arrival in made:
        open_batch(connection, arrival.number, "digest")
        cancel_batch(connection, arrival.number)
    assert isinstance(begin_batch(connection, "greedy", None, ME, bounds), Arrival)


def test_no_client_takes_all_bytes_and_a_deleted_batch_takes_none(connection: Connection) -> None:
    bounds = WIDE._replace(size=8 * BATCH_BYTES)
    made = []
    while isinstance(arrival := begin_batch(connection, "greedy", None, ME, bounds), Arrival):
        open_batch(connection, arrival.number, "digest")
        cancel_batch(connection, arrival.number)
        made.append(arrival)
    assert (arrival, len(made)) == ("full", 4)
    assert isinstance(begin_batch(connection, "another", None, ME, bounds), Arrival)
    discard_batches(connection, [made[0].number, made[1].number])
    assert isinstance(begin_batch(connection, "greedy", None, ME, bounds), Arrival)


def test_clients_take_turns_whatever_number_of_batches_they_have(connection: Connection) -> None:
    """Eight running batches of one client delayed the batches of all other clients until one of the eight ended."""
    greedy = [arrived(connection, 100).number for _ in range(40)]
    others = [arrived(connection, 5, client=name).number for name in "abc"]
    turns: dict[int, int] = {}
    counts: Counter[int] = Counter()
    for turn in range(1, 11):
        found = claim(connection, ME, 2, turns)
        counts.update(item.batch for item in found)
        turns |= dict.fromkeys((item.batch for item in found), turn)
    assert [counts[number] for number in others] == [5, 5, 5]
    assert [counts[number] for number in greedy] == [1] * 5 + [0] * 35
    assert {item.batch for item in claim(connection, ME, 100, turns)} == set(greedy[5:37])  # those without a turn
