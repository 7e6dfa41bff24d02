"""Overload in simulated time: pretended work, random arrivals, and minutes simulated in a moment."""

from __future__ import annotations

import asyncio
import math
import selectors
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest

from api.base.errors import ServiceError
from api.base.settings import Settings
from api.pool import jobs as jobs_module
from api.pool import pool as pool_module
from api.pool.costs import Kind
from api.pool.messages import Reply, Task
from api.pool.pool import WorkerPool
from tests.api.pool.made_up_workers import ENTRY, MadeUpWorker

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

WORKERS = 2
SLOW, CHEAP = Kind(("min_effort",), 2), Kind(("cubic",), 2)
START = 3.0
"""The time that a worker takes to start, s."""

PAUSE = 0.05
"""The time between an answer and the next request of a client that ignores refusals, s."""


class SimulatedTime(asyncio.SelectorEventLoop):
    """An event loop whose clock jumps to the next event."""

    def __init__(self) -> None:
        self._now = 0.0
        selector = selectors.DefaultSelector()
        wait = selector.select

        def select(timeout: float | None = None) -> Any:
            self._now += timeout or 0.0
            return wait(0.0)

        selector.select = select  # type: ignore[method-assign]
        super().__init__(selector)

    def time(self) -> float:
        return self._now


class PretendingWorker(MadeUpWorker):
    """A worker that takes as long as the body of its task says, s."""

    async def get_ready(self) -> None:
        await asyncio.sleep(START)
        await super().get_ready()

    async def run(self, task: Task, hold: Callable[[int], None]) -> Reply:
        work = super().run(task, hold)
        assert asyncio.get_running_loop().call_later(float(task.body), self.finish)
        return await work

    def finish(self, status: int = 200) -> None:
        if self.work is not None and not self.work.done():
            super().finish(status)


class Outcome(NamedTuple):
    """The outcome of a request, its arrival time and its duration, s."""

    arrived: float
    name: str
    latency: float


@pytest.fixture
def simulate(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[WorkerPool], Awaitable[Any]]], Any]:
    def run(test: Callable[[WorkerPool], Awaitable[Any]]) -> Any:
        loop = SimulatedTime()
        for module in (jobs_module, pool_module):
            monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=loop.time))
        monkeypatch.setattr(pool_module, "Worker", PretendingWorker)

        async def with_pool() -> Any:
            pool = WorkerPool(Settings(workers=WORKERS, express_workers=1), ENTRY)
            pool.attach()
            await asyncio.sleep(2.0 * START)
            result = await test(pool)
            await pool.detach()
            return result

        try:
            return loop.run_until_complete(with_pool())
        finally:
            loop.close()

    return run


async def arrivals(
    pool: WorkerPool,
    kind: Kind,
    rate: float,
    seconds: float,
    takes: Callable[[np.random.Generator], float],
    client: str = "",
) -> list[Outcome]:
    """Send requests at random times with a given mean rate."""
    rng, loop = np.random.default_rng(0), asyncio.get_running_loop()
    end, tasks = loop.time() + seconds, []
    while loop.time() < end:
        tasks.append(asyncio.create_task(ask(pool, kind, takes(rng), client)))
        await asyncio.sleep(rng.exponential(1.0 / rate))
    return list(await asyncio.gather(*tasks))


async def again_and_again(
    pool: WorkerPool,
    kind: Kind,
    seconds: float,
    takes: Callable[[np.random.Generator], float],
    client: str = "",
    deadline: float = 10.0,
) -> list[Outcome]:
    """Send one request after the other, like a client that ignores refusals."""
    rng, loop = np.random.default_rng(0), asyncio.get_running_loop()
    end, outcomes = loop.time() + seconds, []
    while loop.time() < end:
        outcomes.append(await ask(pool, kind, takes(rng), client, deadline))
        await asyncio.sleep(PAUSE)
    return outcomes


async def ask(pool: WorkerPool, kind: Kind, takes: float, client: str, deadline: float = 10.0) -> Outcome:
    """Send one request with a deadline and return its outcome."""
    loop = asyncio.get_running_loop()
    now = loop.time()
    task = Task("plan", "/", now, now + deadline, str(takes).encode(), client=client)
    try:
        await pool.run(task, kind, lambda size: None)
    except ServiceError as error:
        return Outcome(now, error.code, loop.time() - now)
    return Outcome(now, "answered", loop.time() - now)


def latencies(outcomes: list[Outcome], name: str) -> Any:
    return np.array([outcome.latency for outcome in outcomes if outcome.name == name])


def lognormal(mean: float, spread: float = 0.5) -> Callable[[np.random.Generator], float]:
    return lambda rng: rng.lognormal(math.log(mean) - spread**2 / 2.0, spread)


@pytest.mark.long_table
@pytest.mark.parametrize(
    ("times", "goodput"),
    [(0.5, 0.9), (1.0, 0.8), (2.0, 0.9), (5.0, 0.9), (10.0, 0.9)],
    ids=lambda value: str(value),
)
def test_workers_do_what_can_be_done_and_the_rest_is_refused_at_once(
    simulate: Any, times: float, goodput: float
) -> None:
    """20 clients of `min_effort` used half of the workers' capacity, and a cheap client beside them got nothing.

    Random arrivals at exactly the capacity sometimes leave workers idle and sometimes cause refusals. The deadline
    limits the queue to two workers and nine places, which serve at most 92 % of the requests.
    """
    mean, seconds, cheap_takes = 1.8, 200.0, 0.004
    capacity = WORKERS / mean

    async def test(pool: WorkerPool) -> Any:
        await arrivals(pool, CHEAP, 5.0, 10.0, lambda _: cheap_takes)
        return await asyncio.gather(
            arrivals(pool, SLOW, times * capacity, seconds, lognormal(mean)),
            arrivals(pool, CHEAP, 5.0, seconds, lambda _: cheap_takes),
        )

    slow, cheap = simulate(test)
    assert len(latencies(slow, "answered")) >= goodput * min(len(slow), capacity * seconds)
    assert len(latencies(slow, "deadline_exceeded")) <= 0.01 * len(slow)
    refused = latencies(slow, "overloaded")
    if times > 1.0:
        assert np.percentile(refused, 99) < 0.01
    assert len(latencies(cheap, "answered")) == len(cheap)
    assert np.percentile(latencies(cheap, "answered"), 99) <= 5.0 * cheap_takes


def test_plans_that_take_longer_than_their_deadline_do_not_keep_the_workers_from_others(simulate: Any) -> None:
    """Every worker was killed in the middle of its work, again and again, and nobody got an answer."""
    seconds = 200.0

    async def test(pool: WorkerPool) -> Any:
        await arrivals(pool, CHEAP, 5.0, 10.0, lambda _: 0.004, "quick")
        return await asyncio.gather(
            arrivals(pool, Kind(("toppra",), 8), 1.0, seconds, lognormal(13.7, 0.1), "hopeless"),
            arrivals(pool, SLOW, 0.5 * WORKERS / 1.8, seconds, lognormal(1.8), "slow"),
            arrivals(pool, CHEAP, 5.0, seconds, lambda _: 0.004, "quick"),
        )

    hopeless, slow, cheap = simulate(test)
    assert not len(latencies(hopeless, "answered"))
    assert len(latencies(slow, "answered")) >= 0.6 * len(slow)
    assert len(latencies(cheap, "answered")) == len(cheap)


def test_one_slow_request_does_not_have_the_quick_ones_of_its_kind_refused(simulate: Any) -> None:
    """After one time-out 316 of 316 cubic plans of another client were refused, as long as a worker was busy."""

    async def test(pool: WorkerPool) -> Any:
        slow = await ask(pool, CHEAP, 100.0, "attacker", 60.0)
        assert slow.name == "deadline_exceeded"
        busy = [again_and_again(pool, SLOW, 100.0, lambda _: 2.0, name) for name in ("attacker", "another")]
        return (await asyncio.gather(*busy, again_and_again(pool, CHEAP, 100.0, lambda _: 0.02, "victim")))[-1]

    outcomes = simulate(test)
    assert {outcome.name for outcome in outcomes} == {"answered"}
    assert len(outcomes) >= 0.8 * 100.0 / (0.02 + PAUSE)


@pytest.mark.parametrize("takes", [5.0, 9.0, 12.0])
def test_one_client_that_sends_one_request_after_the_other_is_never_refused(simulate: Any, takes: float) -> None:
    """Free motions with `optimise` and the default deadline were, after the first that took too long."""

    async def test(pool: WorkerPool) -> Any:
        return await again_and_again(pool, SLOW, 300.0, lognormal(takes, 0.3))

    assert {outcome.name for outcome in simulate(test)} <= {"answered", "deadline_exceeded"}


@pytest.mark.parametrize("connections", [1, 4])
def test_clients_of_long_plans_get_answers(simulate: Any, connections: int) -> None:
    """Two clients of plans of 5 s got 9,192 refusals and no answer, after the first ones had taken too long."""

    async def test(pool: WorkerPool) -> Any:
        await asyncio.gather(*(ask(pool, SLOW, 100.0, client) for client in "abab"))
        clients = [again_and_again(pool, SLOW, 300.0, lognormal(5.0, 0.2), c) for c in "ab" for _ in range(connections)]
        return await asyncio.gather(*clients)

    answered = sum(len(latencies(outcomes, "answered")) for outcomes in simulate(test))
    assert answered >= 0.8 * WORKERS * 300.0 / 5.0
