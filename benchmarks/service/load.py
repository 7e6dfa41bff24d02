"""Overload: requests that arrive at a rate of their own, whatever becomes of those before them (an open loop)."""

from __future__ import annotations

import asyncio
import random
import tempfile
import time
from collections import Counter, deque
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

import orjson
import uvloop

from benchmarks.machine import machine
from benchmarks.service.clients import HOST
from benchmarks.service.workload import ROBOT, bodies, http_get, http_request
from cli.local_service import local_service
from planner.robots import load_robot

RATES = (0.5, 1.0, 2.0, 5.0, 10.0)
"""Arrivals, as multiples of the capacity."""

CHEAP_RATE = 5.0
"""Cheap requests a second beside the others: next to nothing of the capacity, and enough for a p99 in half a minute."""

LIVENESS_RATE = 10.0
"""Requests of the liveness a second."""

COSTLY_ROBOT, WAYPOINTS, SPREAD, VARIANTS = "kuka_kr16_2", 3, 0.5, 64
"""Of the `min_effort` requests; rad, of the waypoints about the middle of every joint. They take 0.3 to 2 s each."""

RETRYING = (250, 750)
"""Connections that repeat a refused request at once."""

CONNECTIONS_OF_AN_ADDRESS = 200
"""Fewer than the service allows one address by default."""

ADDRESSES = tuple(f"127.0.1.{number}" for number in range(1, 9))
"""The clients' addresses."""

LATE = 30.0
"""s, after the last arrival: every answer is there by then."""


class Outcome(NamedTuple):
    """The result of a request: times in s. `late` is the delay of sending, caused by the machine. `finished` counts
    from the start of the load."""

    status: int
    latency: float
    late: float
    finished: float
    may_retry: bool


def measure(seconds: float) -> dict[str, Any]:
    """Return all figures; times in s, rates in 1/s. Each load lasts that long."""
    where = machine()
    cheap = [http_request(body) for body in bodies(load_robot(ROBOT).middle.tolist())]
    costly = [http_request(body) for body in _costly_bodies()]
    with tempfile.TemporaryDirectory() as folder, local_service(Path(folder, "service.log")) as (url, _):
        port = int(url.rpartition(":")[2])
        return {"machine": where, "seconds": seconds, **uvloop.run(_measure(port, cheap, costly, seconds))}


def _costly_bodies() -> list[bytes]:
    middle = load_robot(COSTLY_ROBOT).middle.tolist()
    rng = random.Random(0)  # noqa: S311 - no secret
    requests = []
    for _ in range(VARIANTS):
        positions = [[q + rng.uniform(-SPREAD, SPREAD) for q in middle] for _ in range(WAYPOINTS)]
        waypoints = [{"kind": "joint", "position": position} for position in positions]
        requests.append({"robot": COSTLY_ROBOT, "waypoints": waypoints, "backend": {"kind": "min_effort"}})
    return [orjson.dumps(request) for request in requests]


async def _measure(port: int, cheap: list[bytes], costly: list[bytes], seconds: float) -> dict[str, Any]:
    figures: dict[str, Any] = {"loads": []}
    await _closed_loop(port, cheap, seconds / 2.0)  # the service learns what they take
    alone = summary(await arrivals(port, cheap, CHEAP_RATE, seconds), seconds)
    for name, requests in (("min_effort", costly), ("cubic", cheap)):
        capacity = await _closed_loop(port, requests, seconds)
        for rate in RATES:
            offered = asyncio.create_task(arrivals(port, requests, rate * capacity, seconds))
            beside = asyncio.create_task(arrivals(port, cheap, CHEAP_RATE, seconds))
            load: dict[str, Any] = {"requests": name, "capacity": capacity, "rate": rate}
            load |= summary(await offered, seconds)
            load["goodput"] = load["answered_in_time"] / seconds / (min(rate, 1.0) * capacity)
            load["cheap_beside"] = summary(await beside, seconds)
            figures["loads"].append(load)
    capacity = await _closed_loop(port, cheap, seconds)
    figures["retrying"] = [await _retrying(port, cheap, count, capacity, seconds) for count in RETRYING]
    return figures | {"cheap_alone": alone}


async def _retrying(
    port: int, requests: list[bytes], connections: int, capacity: float, seconds: float
) -> dict[str, Any]:
    """Let connections send one request after the other, whatever the answer, and request the liveness meanwhile."""
    end, statuses = time.perf_counter() + seconds, Counter[int]()
    liveness = http_get("/livez")

    async def repeat(first: int) -> None:
        clients = Clients(port, ADDRESSES[first // CONNECTIONS_OF_AN_ADDRESS])
        for i in range(first, 1_000_000):
            status, _ = await clients.send(requests[i % len(requests)])
            if time.perf_counter() > end:
                break
            statuses[status] += 1
        clients.close()

    async def watch() -> list[Outcome]:
        return await arrivals(port, [liveness], LIVENESS_RATE, seconds)

    _, seen = await asyncio.gather(asyncio.gather(*map(repeat, range(connections))), watch())
    return {
        "connections": connections,
        "capacity": capacity,
        "goodput": statuses[200] / seconds / capacity,
        "refused": statuses[429] + statuses[503],
        "otherwise": statuses.total() - statuses[200] - statuses[429] - statuses[503],
        "liveness": summary(seen, seconds),
    }


def summary(outcomes: list[Outcome], seconds: float) -> dict[str, Any]:
    """Return the results of the requests of a load of so many seconds."""
    answered = [outcome for outcome in outcomes if outcome.status == 200]
    refused = [outcome for outcome in outcomes if outcome.status in (429, 503)]
    return {
        "asked": len(outcomes),
        "answered": len(answered),
        "answered_in_time": sum(outcome.finished <= seconds for outcome in answered),
        "refused": len(refused),
        "refused_without_retry_after": sum(not outcome.may_retry for outcome in refused),
        "otherwise": len(outcomes) - len(answered) - len(refused),
        "latency": _percentiles([outcome.latency for outcome in answered]),
        "sent_late": _percentiles([outcome.late for outcome in outcomes]),
        "refusal": _percentiles([outcome.latency for outcome in refused]),
    }


def _percentiles(values: list[float]) -> dict[str, float] | None:
    if not values:
        return None
    ordered = sorted(values)
    return {"median": ordered[len(ordered) // 2], "p99": ordered[int(len(ordered) * 0.99)], "worst": ordered[-1]}


async def _closed_loop(port: int, requests: list[bytes], seconds: float) -> float:
    """Measure answers a second when every client waits for its answer before its next request."""
    clients, end, done = Clients(port), time.perf_counter() + seconds, 0

    async def ask_again_and_again(first: int) -> None:
        nonlocal done
        for i in range(first, 1_000_000):
            status, _ = await clients.send(requests[i % len(requests)])
            if time.perf_counter() > end:
                break
            done += status == 200

    await asyncio.gather(*(ask_again_and_again(i) for i in range(machine()["cores"])))  # as many as workers
    clients.close()
    return done / seconds


async def arrivals(port: int, requests: list[bytes], rate: float, seconds: float) -> list[Outcome]:
    """Send requests at random times, so many a second (a Poisson process), and wait for what becomes of each."""
    clients, rng = Clients(port, *ADDRESSES), random.Random(1)  # noqa: S311 - no secret
    tasks: list[asyncio.Task[Outcome]] = []
    start, arrival = time.perf_counter(), 0.0

    async def ask(request: bytes, arrival: float) -> Outcome:
        late = time.perf_counter() - start - arrival
        status, may_retry = await clients.send(request)
        finished = time.perf_counter() - start
        return Outcome(status, finished - arrival, late, finished, may_retry)

    while (arrival := arrival + rng.expovariate(rate)) < seconds:
        await asyncio.sleep(max(0.0, start + arrival - time.perf_counter()))
        tasks.append(asyncio.create_task(ask(requests[len(tasks) % len(requests)], arrival)))
    await asyncio.wait(tasks, timeout=LATE)
    clients.close()
    return [task.result() for task in tasks]


class Clients:
    """As many connections as there are requests under way, each used again once its request is answered."""

    def __init__(self, port: int, *addresses: str) -> None:
        self._port = port
        self._addresses = cycle(addresses or (HOST,))
        self._idle: deque[tuple[asyncio.StreamReader, asyncio.StreamWriter]] = deque()

    async def send(self, request: bytes) -> tuple[int, bool]:
        """Send a request; its status, 0 where the connection was ended, and whether it says when to try again."""
        while self._idle and self._idle[-1][1].is_closing():  # the service ends idle ones
            self._idle.pop()
        reader, writer = (
            self._idle.pop()
            if self._idle
            else await asyncio.open_connection(HOST, self._port, local_addr=(next(self._addresses), 0))
        )
        try:
            writer.write(request)
            head = (await reader.readuntil(b"\r\n\r\n")).lower()
            length = head.partition(b"content-length: ")[2].partition(b"\r\n")[0]
            await reader.readexactly(int(length))
        except (asyncio.IncompleteReadError, OSError):
            writer.close()
            return 0, False
        self._idle.append((reader, writer))
        return int(head.split(b" ", 2)[1]), b"retry-after: " in head

    def close(self) -> None:
        """Close the connections that are not in use."""
        for _, writer in self._idle:
            writer.close()
