"""Which request gets a worker, and when: on workers that are made up, so that nothing depends on the machine."""

from __future__ import annotations

import asyncio
import math
import signal
import time
from typing import TYPE_CHECKING, Any

import pytest

from api.errors import DeadlineExceeded, InternalError, Overloaded
from api.server import pool as pool_module
from api.server.costs import CHEAP, Cost, Costs, Kind, kind_of
from api.server.pool import WorkerPool
from api.settings import Settings
from api.workers.messages import Reply, Task
from tests.api.server.made_up_workers import MadeUpWorker

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine


SLOW, QUICK, NEW = (Kind((name,), 1) for name in ("slow", "quick", "new"))


class Running:
    """A pool of made-up workers that knows what slow and quick requests take."""

    def __init__(self, workers: int, express: int, queue_size: int) -> None:
        self.pool = WorkerPool(Settings(workers=workers, express_workers=express, queue_size=queue_size))
        self.pool._costs.learn(SLOW, 2.0)
        self.pool._costs.learn(QUICK, 0.01)
        self.pool.attach()

    def worker(self, place: int = 0) -> Any:
        return self.pool._workers[place]

    async def ask(self, name: str, kind: Kind = QUICK, deadline: float = 10.0) -> asyncio.Task[Reply]:
        """Send a request and let everything happen that happens at once."""
        now = time.monotonic()
        task = Task(name, "/", now, now + deadline)
        asked = asyncio.create_task(self.pool.run(task, kind, lambda size: None))
        await settle()
        return asked

    async def put_behind(self, name: str, seconds: float = 10.0) -> asyncio.Task[Reply]:
        """Give the pool something that stands back."""
        task = Task(name, "/", time.monotonic(), math.inf)
        asked = asyncio.create_task(self.pool.run_behind(task, NEW, seconds))
        await settle()
        return asked


async def settle() -> None:
    for _ in range(10):
        await asyncio.sleep(0.0)


def with_pool(test: Callable[[Running], Coroutine[Any, Any, None]], **settings: int) -> None:
    async def run() -> None:
        running = Running(**{"workers": 1, "express": 0, "queue_size": 10, **settings})
        await settle()
        await test(running)
        await running.pool.detach()

    asyncio.run(run())


@pytest.fixture(autouse=True)
def _made_up_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pool_module, "Worker", MadeUpWorker)


def test_who_came_first_is_served_first() -> None:
    """A newcomer took the worker that a waiter had been woken for: the oldest waited 9 s while others took 0.6."""

    async def test(running: Running) -> None:
        worker = running.worker()
        asked = [await running.ask(name) for name in "abc"]
        for i in range(3):
            worker.finish()
            asked.append(await running.ask(f"later {i}"))
        await settle()
        assert worker.begun == ["a", "b", "c", "later 0"]
        assert [request.done() for request in asked] == [True, True, True, False, False, False]
        for request in asked[3:]:
            request.cancel()

    with_pool(test)


def test_what_is_cheap_does_not_wait_for_what_is_slow() -> None:
    async def test(running: Running) -> None:
        ordinary, express = running.worker(0), running.worker(1)
        slow = [await running.ask("slow", SLOW), await running.ask("slow", SLOW)]
        new = await running.ask("new", NEW)  # it may be slow: nothing is known of it
        quick = await running.ask("quick", QUICK)
        assert (ordinary.begun, express.begun) == (["slow"], ["quick"])
        express.finish()
        await settle()
        assert quick.done()
        assert express.begun == ["quick"]
        for request in (*slow, new):
            request.cancel()

    with_pool(test, express=1)


def test_what_cannot_be_answered_in_time_is_refused_at_once() -> None:
    async def test(running: Running) -> None:
        worker = running.worker()
        first = await running.ask("first", SLOW, deadline=3.0)
        second = await running.ask("second", SLOW, deadline=3.0)
        with pytest.raises(Overloaded) as refused:
            await second
        assert int(refused.value.headers["Retry-After"]) == 2  # when the worker is expected to be free
        patient = await running.ask("patient", SLOW, deadline=8.0)
        quick = await running.ask("quick", QUICK, deadline=8.0)
        assert not patient.done()
        assert not quick.done()
        for _ in range(3):
            worker.finish()
            await settle()
        assert worker.begun == ["first", "patient", "quick"]
        assert all(request.done() for request in (first, patient, quick))

    with_pool(test)


def test_a_request_that_takes_longer_than_its_deadline_is_tried_when_nobody_minds() -> None:
    """What is known may be wrong; but no two workers are killed over such requests at the same time."""

    async def test(running: Running) -> None:
        hopeless = await running.ask("hopeless", SLOW, deadline=1.0)
        assert running.worker(1).begun == ["hopeless"]
        another = await running.ask("another", SLOW, deadline=1.0)
        with pytest.raises(Overloaded):
            await another
        hopeless.cancel()

    with_pool(test, workers=2)


def test_what_became_hopeless_while_it_waited_makes_room_for_others() -> None:
    async def test(running: Running) -> None:
        worker = running.worker()
        first = await running.ask("first", QUICK)  # it takes longer than expected
        late, other = await running.ask("late", SLOW, deadline=4.1), await running.ask("other")
        await asyncio.sleep(0.15)
        worker.finish()
        await settle()
        assert worker.begun == ["first", "other"]
        with pytest.raises(Overloaded):
            await late
        worker.finish()
        await asyncio.gather(first, other)

    with_pool(test)


def test_a_full_queue_refuses() -> None:
    async def test(running: Running) -> None:
        asked = [await running.ask(str(i)) for i in range(4)]
        with pytest.raises(Overloaded):
            await asked[3]
        assert not any(request.done() for request in asked[:3])
        assert running.pool.is_full("")
        asked[1].cancel()  # it hangs up, and makes room
        await settle()
        assert not running.pool.is_full("")
        assert not (await running.ask("another")).done()
        for request in asyncio.all_tasks() - {asyncio.current_task()}:
            request.cancel()

    with_pool(test, queue_size=2)


def test_a_queue_that_is_full_of_slow_requests_lets_cheap_ones_through() -> None:
    async def test(running: Running) -> None:
        slow = [await running.ask("slow", SLOW, deadline=60.0) for _ in range(3)]
        assert not running.pool.is_full("")  # the express worker has nothing to do
        quick = await running.ask("quick")
        assert running.worker(1).begun == ["quick"]
        assert running.pool.is_full("")
        running.worker(1).finish()
        await quick
        for request in slow:
            request.cancel()

    with_pool(test, express=1, queue_size=2)


@pytest.mark.parametrize(
    ("exit_codes", "is_answered"),
    [([-signal.SIGKILL], True), ([-signal.SIGKILL] * 2, False), ([-signal.SIGSEGV], False)],
    ids=["killed", "killed twice", "crashed"],
)
def test_the_work_of_a_killed_worker_is_repeated_once(exit_codes: list[int], is_answered: bool) -> None:
    """What crashes its worker by itself is not: it would only crash the next one."""

    async def test(running: Running) -> None:
        asked = await running.ask("asked")
        behind = await running.ask("behind")
        for exit_code in exit_codes:
            running.worker().die(exit_code)
            await settle()
        if is_answered:
            assert running.worker().begun == ["asked"]  # before those that came later
            running.worker().finish()
            assert (await asked).status == 200
        else:
            with pytest.raises(InternalError):
                await asked
        await settle()
        assert running.worker().begun[-1] == "behind"
        behind.cancel()

    with_pool(test)


def test_work_that_nobody_waits_for_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """After a moment, in which it may finish: to start a worker takes longer than most requests."""
    monkeypatch.setattr(pool_module, "GRACE", 1.0)

    async def test(running: Running) -> None:
        worker = running.worker()
        brief = await running.ask("brief")
        brief.cancel()
        await settle()
        worker.finish()
        late = await running.ask("late", deadline=0.01)
        with pytest.raises(DeadlineExceeded):
            await late
        assert not worker.ended.is_set()
        await worker.ended.wait()
        await settle()
        assert worker.exit_code == -signal.SIGKILL
        assert running.worker() is not worker
        assert running.worker().begun == []

    with_pool(test)


def test_costs_are_learnt_by_kind_and_size() -> None:
    costs = Costs()
    kind = Kind(("plan", "cubic"), 4)
    assert costs.expected(kind) is None
    costs.learn(kind, 0.02)
    assert costs.expected(kind) == Cost(0.02, 0.01)
    assert costs.expected(kind._replace(size=6)) == Cost(0.08, 0.04)  # four times as many waypoints
    assert costs.expected(Kind(("plan", "min_effort"), 4)) is None
    for _ in range(100):
        costs.learn(kind, 0.05)
    learnt = costs.expected(kind)
    assert learnt is not None
    assert learnt.mean == pytest.approx(0.05, rel=1e-3)
    assert learnt.is_cheap
    costs.learn_at_least(kind, 0.001)  # a refusal says nothing of what a plan takes
    assert costs.expected(kind) == learnt
    costs.learn_at_least(kind, 100.0 * CHEAP)
    raised = costs.expected(kind)
    assert raised is not None
    assert not raised.is_cheap


def test_no_more_is_kept_than_a_client_cannot_overflow() -> None:
    costs = Costs()
    for i in range(2000):
        costs.learn(Kind((str(i),), 1), 1.0)
    assert len(costs._families) < 1000
    assert costs.expected(Kind(("1999",), 1)) is not None


@pytest.mark.parametrize(
    "document",
    [
        {},
        {"backend": 7, "waypoints": 3, "poses": {}},
        {"backend": {"kind": [1]}, "waypoints": [1, {"motion": 2}, {"motion": {"kind": []}}]},
        {"backends": [], "positions": [[]]},
        {"backends": [{"kind": {}}], "backend": None},
    ],
)
def test_the_kind_of_what_follows_no_schema(document: dict[str, Any]) -> None:
    assert hash(kind_of("plan_trajectory", document)) is not None


def test_the_kind_says_what_makes_a_request_long() -> None:
    def kind(**document: Any) -> Kind:
        return kind_of("plan_trajectory", {"backend": {"kind": "toppra"}, "waypoints": [{}] * 5, **document})

    kinds = {
        kind(),
        kind(backend={"kind": "cubic"}),
        kind(backend={"kind": "toppra", "jerk_limited": True}),
        kind(waypoints=[{}] * 50),
        kind(waypoints=[{}] * 4 + [{"motion": {"kind": "linear"}}]),
    }
    assert len(kinds) == 5
    assert kind(waypoints=[{}] * 6, seed=3) == kind()


def test_what_stands_back_gets_what_nobody_wants_and_never_the_last_worker() -> None:
    async def test(running: Running) -> None:
        behind = [await running.put_behind(name) for name in ("b1", "b2")]
        assert [running.worker(place).begun for place in range(2)] in ([["b1"], []], [[], ["b1"]])
        at_it, idle = sorted((running.worker(place) for place in range(2)), key=lambda worker: not worker.begun)
        asked = [await running.ask(name) for name in ("r1", "r2")]
        assert idle.begun == ["r1"]
        at_it.finish()
        await settle()
        assert at_it.begun == ["b1", "r2"]  # before what stands back
        idle.finish()
        await settle()
        assert idle.begun == ["r1", "b2"]
        for worker in (at_it, idle):
            worker.finish()
        await asyncio.gather(*behind, *asked)

    with_pool(test, workers=2)


def test_what_stands_back_has_its_deadline_from_when_it_begins_and_can_be_cancelled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pool_module, "GRACE", 0.0)

    async def test(running: Running) -> None:
        first = await running.ask("r1")
        late, cancelled = await running.put_behind("late", 0.05), await running.put_behind("cancelled")
        cancelled.cancel()
        await asyncio.sleep(0.1)
        assert not late.done()
        running.worker().finish()
        with pytest.raises(DeadlineExceeded):
            await late
        await settle()
        assert "cancelled" not in running.worker().begun
        assert (await first).status == 200

    with_pool(test)


def test_what_stands_back_is_repeated_when_its_worker_is_killed() -> None:
    async def test(running: Running) -> None:
        behind = await running.put_behind("b1")
        running.worker().die(-signal.SIGKILL)
        await settle()
        assert running.worker().begun == ["b1"]
        running.worker().finish()
        assert (await behind).status == 200

    with_pool(test)
