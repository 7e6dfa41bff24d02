"""Assignment of requests to workers, with made-up workers that make it independent of the machine."""

from __future__ import annotations

import asyncio
import math
import signal
import time
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from api.base.errors import DeadlineExceeded, InternalError, Overloaded
from api.base.settings import Settings
from api.pool import jobs as jobs_module
from api.pool import pool as pool_module
from api.pool.costs import Kind
from api.pool.messages import Reply, Task
from api.pool.pool import WorkerPool
from tests.api.pool.made_up_workers import ENTRY, MadeUpWorker

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine


SLOW, QUICK, NEW = (Kind((name,), 1) for name in ("slow", "quick", "new"))


class Running:
    """A pool of made-up workers that knows what slow and quick requests take."""

    def __init__(self, workers: int, express: int, queue_size: int) -> None:
        self.pool = WorkerPool(Settings(workers=workers, express_workers=express, queue_size=queue_size), ENTRY)
        self.pool._costs.learn(SLOW, 2.0)
        self.pool._costs.learn(QUICK, 0.01)
        self.pool.attach()

    def worker(self, place: int = 0) -> Any:
        return self.pool._workers[place]

    async def ask(self, name: str, kind: Kind = QUICK, deadline: float = 10.0) -> asyncio.Task[Reply]:
        """Send a request and run all events that are due at once."""
        now = pool_module.time.monotonic()
        task = Task(name, "/", now, now + deadline)
        asked = asyncio.create_task(self.pool.run(task, kind, lambda size: None))
        await settle()
        return asked

    async def put_behind(self, name: str, seconds: float = 10.0) -> asyncio.Task[Reply]:
        """Submit a background request to the pool."""
        task = Task(name, "/", pool_module.time.monotonic(), math.inf)
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


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """The pool's clock, which stands still unless a test moves its `now` on, s."""
    made = SimpleNamespace(now=time.monotonic())
    made.monotonic = lambda: made.now
    for module in (pool_module, jobs_module):
        monkeypatch.setattr(module, "time", made)
    return made


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


def test_an_idle_worker_tries_whatever_comes() -> None:
    """One slow request caused the refusal of all quick ones of its kind, 316 of 316, with idle workers."""

    async def test(running: Running) -> None:
        asked = [await running.ask(name, SLOW, deadline=1.0) for name in ("first", "second")]
        assert sorted(running.worker(0).begun + running.worker(1).begun) == ["first", "second"]
        for place in range(2):
            running.worker(place).finish()
        assert [(await request).status for request in asked] == [200, 200]

    with_pool(test, workers=2)


def test_a_client_that_is_alone_is_never_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that sent a request after the other was refused while the worker of its last one, too late, was killed."""
    monkeypatch.setattr(pool_module, "GRACE", 60.0)

    async def test(running: Running) -> None:
        late = await running.ask("late", SLOW, deadline=0.01)
        with pytest.raises(DeadlineExceeded):
            await late
        other = await running.ask("other", SLOW, deadline=1.0)
        running.worker().finish()
        await settle()
        assert running.worker().begun == ["late", "other"]
        running.worker().finish()
        assert (await other).status == 200
        behind = await running.put_behind("behind")
        beside = await running.ask("beside a batch", SLOW, deadline=1.0)
        running.worker().finish()
        await settle()
        running.worker().finish()
        assert ((await behind).status, (await beside).status) == (200, 200)

    with_pool(test)


def test_what_its_estimate_alone_would_refuse_is_tried_now_and_then(clock: SimpleNamespace) -> None:
    """Refused requests teach nothing: without a trial a wrong estimate would last for as long as workers are busy."""

    async def test(running: Running) -> None:
        running.pool._costs.learn(NEW, 60.0)
        busy = await running.ask("busy")
        trial = await running.ask("trial", NEW)
        with pytest.raises(Overloaded):
            await (await running.ask("refused", NEW))
        clock.now += 0.01
        for _ in range(2):
            running.worker().finish()
            await settle()
        assert ((await busy).status, (await trial).status) == (200, 200)
        busy = await running.ask("busy")
        again = await running.ask("again", NEW)  # the trial has corrected the estimate
        for _ in range(2):
            running.worker().finish()
            await settle()
        assert (await again).status == 200

    with_pool(test)


def test_what_became_hopeless_while_it_waited_makes_room_for_others(clock: SimpleNamespace) -> None:
    async def test(running: Running) -> None:
        worker = running.worker()
        first = await running.ask("first", QUICK)  # it takes longer than expected
        late, other = await running.ask("late", SLOW, deadline=4.1), await running.ask("other")
        clock.now += 0.15
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
    """A request that crashes its worker is not repeated, since it would crash the next worker."""

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
