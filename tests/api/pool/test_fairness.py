"""Clients take turns: one that sends a thousand requests does not keep another's waiting."""

from __future__ import annotations

import asyncio
import random
import time
from typing import TYPE_CHECKING

import pytest

from api.base.errors import Overloaded
from api.pool.costs import Cost, Kind
from api.pool.jobs import Job, JobQueue
from api.pool.messages import Task

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture(autouse=True)
def _loop() -> Iterator[None]:
    """Jobs have replies, which belong to an event loop."""
    with asyncio.Runner() as runner:
        runner.run(_nothing())
        asyncio.set_event_loop(runner.get_loop())
        yield


async def _nothing() -> None: ...


def job(client: str, name: str = "", seconds: float = 1.0) -> Job:
    async def made() -> Job:
        task = Task(name, "", 0.0, time.monotonic() + 1e6, client=client)
        return Job(task, Kind((name,), 1), Cost(seconds, 0.0), lambda _size: None)

    return asyncio.get_event_loop().run_until_complete(made())


def filled(capacity: int, *jobs: Job) -> JobQueue:
    queue = JobQueue(capacity)
    for each in jobs:
        queue.put(each)
    return queue


def taken(queue: JobQueue) -> list[str]:
    names = []
    while (found := queue.take(only_cheap=False)) is not None:
        names.append(found.task.client + found.task.operation)
    return names


def test_one_client_alone_has_all_of_the_queue_in_the_order_of_arrival() -> None:
    queue = filled(10, *(job("a", str(k)) for k in range(10)))
    assert not queue.has_room("a")
    assert taken(queue) == [f"a{k}" for k in range(10)]


def test_clients_take_turns_whatever_they_have_in_the_queue() -> None:
    queue = filled(20, *(job("a", str(k)) for k in range(6)), job("b", "0"), job("b", "1"), job("c", "0"))
    assert taken(queue) == ["a0", "b0", "c0", "a1", "b1", "a2", "a3", "a4", "a5"]


def test_who_was_served_last_waits_for_those_that_were_not() -> None:
    queue = filled(20, job("a", "0"), job("a", "1"))
    assert queue.take(only_cheap=False) is not None
    queue.put(job("b", "0"))
    assert taken(queue) == ["b0", "a1"]


def test_what_was_put_back_comes_first() -> None:
    queue = filled(20, job("a", "0"), job("b", "0"))
    queue.put_back(job("b", "again"))
    assert taken(queue) == ["bagain", "a0", "b0"]


def test_a_client_that_fills_the_queue_makes_room_for_others() -> None:
    greedy = [job("a", str(k)) for k in range(4)]
    queue = filled(4, *greedy)
    assert queue.has_room("b") and not queue.has_room("a")
    with pytest.raises(Overloaded):
        queue.put(job("a", "more"))
    queue.put(job("b", "0"))
    assert isinstance(greedy[3].reply.exception(), Overloaded)
    assert [each.reply.done() for each in greedy] == [False, False, False, True]
    queue.put(job("b", "1"))
    assert not queue.has_room("b")  # both have half of it
    assert taken(queue) == ["a0", "b0", "a1", "b1"]


def test_a_wait_is_what_comes_before_and_not_all_that_waits() -> None:
    queue = filled(100, *(job("a", seconds=10.0) for _ in range(20)), job("b", seconds=3.0))
    assert queue.work(only_cheap=False, client="a") == pytest.approx(203.0)
    assert queue.work(only_cheap=False, client="c") == pytest.approx(13.0)  # one of each
    assert queue.work(only_cheap=False, client="b") == pytest.approx(23.0)


def test_no_client_waits_for_more_than_a_round_whatever_arrives() -> None:
    """Random arrivals of five clients: between two jobs of one that always waits, each other one has at most one."""
    rng = random.Random(0)  # noqa: S311 - no secret
    queue = filled(1000, job("steady", "0"))
    since: list[str] = []
    for k in range(1, 300):
        for _ in range(rng.randrange(4)):
            queue.put(job(rng.choice("abcd")))
        found = queue.take(only_cheap=False)
        assert found is not None
        if found.task.client == "steady":
            assert all(since.count(client) <= 1 for client in since)
            since = []
            queue.put(job("steady", str(k)))
        else:
            since.append(found.task.client)
