"""Quick requests of a batch go to a worker several at a time; a failure affects only its own request."""

from __future__ import annotations

import asyncio
import math
import time
from typing import TYPE_CHECKING

import orjson
import pytest

from api.base.errors import DeadlineExceeded
from api.base.settings import Settings
from api.batches.planners import Chunk, PoolPlanners
from api.pool.messages import Caps, Reply, Task
from api.store.claims import Claimed
from api.store.items import CHUNK_BYTES, PLAN_ITEMS, compressed
from api.work import execution
from api.work.execution import execute
from tests.api.requests import joint, plan_request

if TYPE_CHECKING:
    from collections.abc import Generator

    from api.work.tasks.context import TaskContext


class MadeUpPool:
    """Plans in no time what takes as long as its body says, s; `b"late"` never ends, `b"unfit"` spoils the worker."""

    most_behind = 1

    def __init__(self) -> None:
        self.asked: list[list[bytes]] = []
        self.limits: list[float] = []

    async def run_behind(self, task: Task, kind: object, seconds: float) -> Reply:
        bodies = [body for body, _ in task.arguments["items"]]
        self.asked.append(bodies)
        self.limits.append(seconds)
        if b"late" in bodies:
            raise DeadlineExceeded("too late")
        if b"unfit" in bodies:
            return Reply(500, "", b"a problem", code="internal_error", worker_is_fit=False)
        return Reply(200, "", b"", result=[planned(body) for body in bodies])


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
    """Plan all items, and submit unfinished items again."""
    replies: list[Reply] = []
    while len(replies) < len(items):
        replies += await planners.plan(Chunk(items[len(replies) :], {}))
    return replies


def test_what_is_quick_goes_together_and_what_is_slow_does_not() -> None:
    pool, replies = plan([b"0.005"] * 13)
    assert [len(bodies) for bodies in pool.asked] == [1, 10, 2]  # 50 ms of work
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
        assert reply.code == {b"late": "deadline_exceeded", b"unfit": "internal_error"}.get(bodies[k])
        assert reply.body == b"plan of " + bodies[k] or k == where
    assert sum(bodies.count(bad) > 0 and bad in asked for asked in pool.asked) <= 2


def test_several_together_keep_the_deadline_of_each() -> None:
    pool, _ = plan([b"0.005"] * 3, at_once=3, deadlines=[10.0, 0.25, 1000.0])
    assert pool.limits == [0.25]
    pool, _ = plan([b"0.005"], deadlines=[1000.0])
    assert pool.limits == [Settings().max_deadline]


def test_a_worker_answers_each_as_if_it_were_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(execution, "CHUNK_SECONDS", 60.0)
    asked = [plan_request(), plan_request(robot="nobody"), plan_request(waypoints=[]), plan_request(seed=1)]
    hurried = [joint(0.1, 0.2, 0.3), joint(0.3, 0.1, 0.5, duration=1.0)]
    asked.append(plan_request(waypoints=hurried, backend={"kind": "trapezoidal", "acceleration_time": 2.0}))
    bodies = [orjson.dumps(request) for request in asked]
    replies = answer(*bodies).result
    codes = [None, "unknown_robot", "invalid_request", None, "infeasible_duration"]
    assert [reply.code for reply in replies] == codes
    for body, reply in zip(bodies, replies, strict=True):
        [alone] = answer(body).result
        assert (reply.status, reply.code, reply.body) == (alone.status, alone.code, alone.body)
        assert (reply.result, reply.plan) == (alone.result, alone.plan)
        assert reply.timings.keys() == alone.timings.keys()


def answer(*bodies: bytes, scene: bytes | None = None) -> Reply:
    """Let a worker plan requests together."""
    arguments = {} if scene is None else {"scene": scene}
    items = [(compressed(body), arguments) for body in bodies]
    return execute(Task(PLAN_ITEMS, "/", 0.0, math.inf, b"", {"items": items}), Caps(60.0, 1000, 500_000, 1024))


class MadeUpSteps:
    """Takes as long to read, plan and write a request as the words of its body say, s; `fails` does."""

    def __init__(self) -> None:
        self.done: list[tuple[bytes, int]] = []

    def __call__(self, context: TaskContext) -> Generator[None, None, Reply]:
        for step, word in enumerate(context.task.body.split()):
            if step:
                yield
            self.done.append((context.task.body, step))
            if word == b"fails":
                raise ValueError("nobody foresaw it")
            time.sleep(float(word))
        return Reply(200, "", b"")


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> MadeUpSteps:
    made_up = MadeUpSteps()
    monkeypatch.setattr(execution, "item_steps", made_up)
    monkeypatch.setattr(execution, "CHUNK_SECONDS", 0.5)
    return made_up


def test_all_are_read_then_planned_then_written(steps: MadeUpSteps) -> None:
    bodies = (b"0 0 0", b"0 0.01 0", b"0.01 0 0")
    assert len(answer(*bodies).result) == 3
    assert steps.done == [(body, step) for step in range(3) for body in bodies]


@pytest.mark.parametrize(("slow", "done"), [(b"0.6 0 0", 1), (b"0 0.6 0", 2), (b"0 0 0.6", 3)])
def test_what_is_slow_among_what_is_quick_holds_up_nothing_behind_it(
    steps: MadeUpSteps, slow: bytes, done: int
) -> None:
    reply = answer(b"0 0 0", slow, b"0 0 0 ")
    assert len(reply.result) == done and reply.worker_is_fit
    assert ((b"0 0 0 ", 1) in steps.done) == (done == 3)


def test_a_worker_that_is_not_fit_any_more_does_no_more(steps: MadeUpSteps) -> None:
    for step in range(3):
        words = [b"0"] * 3
        words[step] = b"fails"
        steps.done.clear()
        reply = answer(b"0 0 0", b" ".join(words), b"0 0  0")
        assert (reply.code, reply.result, reply.worker_is_fit) == ("internal_error", None, False)
        assert steps.done[-1] == (b" ".join(words), step)
        assert "MadeUpSteps" not in str(reply.body) and "ValueError" in str(reply.failure)


def test_no_more_is_read_at_once_than_fits(steps: MadeUpSteps) -> None:
    half = b"0 0 0".ljust(CHUNK_BYTES // 2)
    assert len(answer(half, half, b"0 0 0").result) == 2
    assert len(answer(half, half + b" ", half).result) == 1
    assert len(answer(half.ljust(3 * CHUNK_BYTES), b"0 0 0").result) == 1
    assert len(answer(*[b"0 0 0"] * 4, scene=bytes(CHUNK_BYTES // 3)).result) == 2
    assert len(answer(*[b"0 0 0"] * 20).result) == 20
