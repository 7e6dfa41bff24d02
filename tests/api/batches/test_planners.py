"""Requests of a batch go to a worker several at a time where they are quick; what goes wrong costs only itself."""

from __future__ import annotations

import asyncio
import math
import time
from typing import TYPE_CHECKING, Any

import orjson
import pytest

from api import execution
from api.batches import planners as planners_module
from api.batches.items import PLAN_ITEM, PLAN_ITEMS, compressed
from api.batches.planners import Chunk, PoolPlanners
from api.database.claims import Claimed
from api.errors import DeadlineExceeded
from api.execution import RUN, execute
from api.messages import Caps, Reply, Task
from api.settings import Settings
from tests.api.requests import plan_request

if TYPE_CHECKING:
    from api.tasks.work import Work


class MadeUpPool:
    """Plans in no time what takes as long as its body says, s; `b"late"` never ends, `b"unfit"` spoils the worker."""

    most_behind = 1

    def __init__(self) -> None:
        self.asked: list[list[bytes]] = []
        self.limits: list[float] = []

    async def run_behind(self, task: Task, kind: object, seconds: float) -> Reply:
        bodies = [body for body, _ in task.arguments["items"]] if task.operation == PLAN_ITEMS else [task.body]
        self.asked.append(bodies)
        self.limits.append(seconds)
        if b"late" in bodies:
            raise DeadlineExceeded("too late")
        fit = [body != b"unfit" for body in bodies]
        done = bodies[: fit.index(False) + 1] if False in fit else bodies
        replies = [planned(body) for body in done]
        return Reply(200, "", b"", result=replies) if task.operation == PLAN_ITEMS else replies[0]


def planned(body: bytes) -> Reply:
    seconds = 0.005 if not body[:1].isdigit() else float(body)
    return Reply(200, "", b"plan of " + body, timings={"queue": 9.0, "plan": seconds}, result=(1.0, 0.5))


def plan(bodies: list[bytes], at_once: int = 1, deadlines: list[float] | None = None) -> tuple[MadeUpPool, list[Reply]]:
    pool = MadeUpPool()
    planners = PoolPlanners(pool, Settings())  # type: ignore[arg-type]
    planners.chunk_size = at_once
    asked = zip(bodies, deadlines or [10.0] * len(bodies), strict=True)
    items = [Claimed(1, "1", k, body, None, None, deadline) for k, (body, deadline) in enumerate(asked)]
    return pool, asyncio.run(plan_all(planners, items))


async def plan_all(planners: PoolPlanners, items: list[Claimed]) -> list[Reply]:
    """What is left comes again."""
    replies: list[Reply] = []
    while len(replies) < len(items):
        replies += await planners.plan(Chunk(items[len(replies) :], {}))
    return replies


def test_what_is_quick_goes_together_and_what_is_slow_does_not() -> None:
    pool, replies = plan([b"0.005"] * 13)
    assert [len(bodies) for bodies in pool.asked] == [1, 6, 6]  # 30 ms of work
    assert len(replies) == 13
    pool, _ = plan([b"1e-6"] * 50)
    assert [len(bodies) for bodies in pool.asked] == [1, 20, 20, 9]
    pool, _ = plan([b"0.5"] * 4, at_once=3)
    assert [len(bodies) for bodies in pool.asked] == [3, 1]


@pytest.mark.parametrize("bad", [b"late", b"unfit"])
@pytest.mark.parametrize("where", [0, 2, 4])
def test_what_goes_wrong_costs_only_itself(bad: bytes, where: int) -> None:
    bodies = [b"0.005" for _ in range(5)]
    bodies[where] = bad
    pool, replies = plan(bodies, at_once=5)
    assert len(replies) == 5
    for k, reply in enumerate(replies):
        assert reply.code == ("deadline_exceeded" if bodies[k] == b"late" else None)
        assert reply.body == b"plan of " + bodies[k] or bodies[k] == b"late"
    assert sum(bodies.count(bad) > 0 and bad in asked for asked in pool.asked) <= 2


def test_several_together_keep_the_deadline_of_each() -> None:
    pool, _ = plan([b"0.005"] * 3, at_once=3, deadlines=[10.0, 0.25, 1000.0])
    assert pool.limits == [0.25]
    pool, _ = plan([b"0.005"], deadlines=[1000.0])
    assert pool.limits == [Settings().max_deadline]


def test_a_worker_answers_each_as_if_it_were_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(execution, "CHUNK_SECONDS", 60.0)
    asked = [plan_request(), plan_request(robot="nobody"), plan_request(seed=1)]
    bodies = [compressed(orjson.dumps(request)) for request in asked]
    together, *alone = (
        answers([(PLAN_ITEMS, b"", {"items": [(body, {}) for body in bodies]})]),
        *(answers([(PLAN_ITEM, body, {})]) for body in bodies),
    )
    replies = together[0].result
    assert [reply.code for reply in replies] == [None, "unknown_robot", None]
    assert [reply.body for reply in replies] == [answer[0].body for answer in alone]
    assert [reply.result for reply in replies] == [answer[0].result for answer in alone]


def test_what_is_slow_among_what_is_quick_holds_up_nothing_behind_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(RUN, PLAN_ITEM, lambda work: time.sleep(float(work.task.body)) or Reply(200, "", b""))
    items = [(body, {}) for body in (b"0.001", b"0.05", b"0.001")]
    [reply] = answers([(PLAN_ITEMS, b"", {"items": items})])
    assert len(reply.result) == 2 and reply.worker_is_fit


def answers(tasks: list[tuple[str, bytes, dict[str, Any]]]) -> list[Reply]:
    caps = Caps(60.0, 1000, 500_000, 1024)
    return [execute(Task(name, "/", 0.0, math.inf, body, arguments), caps) for name, body, arguments in tasks]


def test_a_worker_that_is_not_fit_any_more_does_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    done = []

    def fail_at_second(work: Work) -> Reply:
        done.append(work.task.body)
        if work.task.body == b"second":
            raise ValueError("nobody foresaw it")
        return Reply(200, "", b"")

    monkeypatch.setitem(RUN, PLAN_ITEM, fail_at_second)
    items = [(body, {}) for body in (b"first", b"second", b"third")]
    [reply] = answers([(PLAN_ITEMS, b"", {"items": items})])
    assert done == [b"first", b"second"]
    assert [part.worker_is_fit for part in reply.result] == [True, False] and not reply.worker_is_fit
    assert planners_module.MOST_CHUNKED > 1
