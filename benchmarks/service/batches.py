"""Batches: plans a second on the service's own workers and on a Dask cluster, against the bare library loop."""

from __future__ import annotations

import random
import statistics
import tempfile
import threading
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import httpx
import orjson
import psutil
import uvloop
from rich.console import Console

from benchmarks.machine import machine
from benchmarks.service.load import arrivals, summary
from benchmarks.service.machines import cluster, has_namespaces
from benchmarks.service.workload import ROBOT as CHEAP_ROBOT
from benchmarks.service.workload import bodies, http_request
from cli.local_service import local_service
from cli.work.terminal import plain_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

ROBOT, WAYPOINTS, SPREAD = "kuka_kr16_2", 3, 0.5
"""Of the requests; rad, of the waypoints about the middle of every joint."""

BACKENDS = ("cubic", "quintic", "trapezoidal", "ruckig", "toppra")
"""The back ends, one after the other; they take 1 to 10 ms a plan each."""

BARE_SHARE = 10
"""Of how many requests one is planned by the bare loop."""

LOOK = 0.05
"""Time between two looks at the memory, or at a batch without results, s."""

FOLLOW = 0.5
"""Time between two looks at a batch, s: as often as its results are written; each costs the service some ms."""

INTERACTIVE_RATE, INTERACTIVE_SECONDS = 20.0, 30.0
"""Requests a second that somebody waits for, alone and beside a batch; s, of each measurement, if the batch lasts."""


class Machines(NamedTuple):
    """Where a batch is planned: by so many workers of the service, or machines of a cluster with a process each."""

    name: str
    workers: int = 1
    machines: int = 0


PLACES = (
    Machines("local pool, 1 worker"),
    Machines("local pool, 2 workers", workers=2),
    Machines("cluster, 1 machine", machines=1),
    Machines("cluster, 2 machines", machines=2),
)
"""Number of machines of a cluster: each has a core of its own, and for root a network; at most the number of cores."""


def measure(items: int, only: Sequence[str] = ()) -> dict[str, Any]:
    """Return all figures, of the places whose names have these words; times in s, rates in 1/s, memory in MB.

    The bare loop runs before and after each batch, which is compared with the mean of the two. The speed of a machine
    that others use, too, changes by a third within minutes.
    """
    requests = _requests(items)
    loops = [_bare_loop(requests[::BARE_SHARE])]
    batches = []
    for place in (place for place in PLACES if all(word in place.name for word in only)):
        found = _measured(place, requests)
        loops.append(_bare_loop(requests[::BARE_SHARE]))
        bare = statistics.mean(loops[-2:])
        overhead = max(place.workers, place.machines) * found["seconds"] / items / bare - 1.0
        batches.append(found | {"bare_loop": bare, "overhead": overhead})
    return {
        "machine": machine(),
        "networks": has_namespaces(),
        "items": items,
        "bare_loop": statistics.median(loops),
        "batches": batches,
        "interactive": _interactive(requests, min(INTERACTIVE_SECONDS, items * loops[-1] / 4.0)),
    }


def _requests(items: int) -> list[dict[str, Any]]:
    from planner.robots import load_robot

    middle = load_robot(ROBOT).middle.tolist()
    rng = random.Random(0)  # noqa: S311 - no secret
    made = []
    for k in range(items):
        positions = [[q + rng.uniform(-SPREAD, SPREAD) for q in middle] for _ in range(WAYPOINTS)]
        waypoints = [{"kind": "joint", "position": position} for position in positions]
        made.append({"robot": ROBOT, "waypoints": waypoints, "backend": {"kind": BACKENDS[k % len(BACKENDS)]}})
    return made


def _bare_loop(requests: list[dict[str, Any]]) -> float:
    """Time of a plan by the library alone, s."""
    from api.contract.requests import PlanRequest
    from api.work.conversion.problems import to_backend, to_planning_problem
    from planner.planning import plan
    from planner.robots import load_robot

    robot = load_robot(ROBOT)
    parsed = [PlanRequest.model_validate(request) for request in requests]
    asked = [(to_planning_problem(request, robot), to_backend(request.backend)) for request in parsed]
    for problem, backend in asked[: len(BACKENDS)]:  # what is done once
        plan(problem, backend)
    started = time.perf_counter()
    for problem, backend in asked:
        plan(problem, backend)
    return (time.perf_counter() - started) / len(asked)


def _measured(place: Machines, requests: list[dict[str, Any]]) -> dict[str, Any]:
    body = b"\n".join(orjson.dumps(request) for request in requests)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        settings = {"PLANNER_DATA_DIRECTORY": str(folder), "PLANNER_BATCH_WORKERS": str(place.workers)}
        if place.machines:
            settings["PLANNER_SCHEDULER"] = stack.enter_context(cluster(folder, place.machines))
        service = local_service(folder / "service.log", place.workers, settings=settings)
        url, process = stack.enter_context(service)
        client = stack.enter_context(httpx.Client(base_url=url, timeout=600.0, trust_env=False))
        memory = stack.enter_context(_largest_memory(process.pid))
        _planned(client, b"\n".join(body.split(b"\n")[: 20 * max(1, place.machines)]))  # everybody is there
        return {"name": place.name, **_planned(client, body), "memory": memory[0] / 1e6}


def _planned(client: httpx.Client, body: bytes) -> dict[str, Any]:
    """Send a batch and wait for its end."""
    started = time.perf_counter()
    made = client.post("/v1/batches", content=body, headers={"Content-Type": "application/x-ndjson"})
    made.raise_for_status()
    taken_in, first = time.perf_counter(), 0.0
    while (batch := client.get(made.headers["Location"]).json())["status"] == "running":
        if not first and batch["counts"]["waiting"] < batch["counts"]["total"]:
            first = time.perf_counter()
        time.sleep(FOLLOW if first else LOOK)
    ended = time.perf_counter()
    counts = batch["counts"]
    return {
        "taken_in": taken_in - started,
        "first_result": (first or ended) - started,
        "seconds": ended - taken_in,
        "rate": counts["total"] / (ended - taken_in),
        "planned": counts["planned"],
    }


def _interactive(requests: list[dict[str, Any]], seconds: float) -> dict[str, Any]:
    """Measure latencies of cheap requests, s: alone, and beside a batch that runs throughout."""
    from planner.robots import load_robot

    cheap = [http_request(body) for body in bodies(load_robot(CHEAP_ROBOT).middle.tolist())]
    with tempfile.TemporaryDirectory() as folder, local_service(Path(folder, "service.log")) as (url, _):
        port = int(url.rpartition(":")[2])
        uvloop.run(arrivals(port, cheap, INTERACTIVE_RATE, 5.0))  # the service learns what they take
        alone = summary(uvloop.run(arrivals(port, cheap, INTERACTIVE_RATE, seconds)), seconds)
        with httpx.Client(base_url=url, timeout=600.0, trust_env=False) as client:
            made = client.post("/v1/batches", json={"requests": requests})
            location = made.raise_for_status().headers["Location"]
            beside = summary(uvloop.run(arrivals(port, cheap, INTERACTIVE_RATE, seconds)), seconds)
            was_running = client.get(location).json()["status"] == "running"
            client.delete(location)
    return {"alone": alone["latency"], "beside": beside["latency"], "was_running": was_running}


@contextmanager
def _largest_memory(pid: int) -> Iterator[list[int]]:
    """Watch the memory of the server process, bytes; the only element is the largest so far."""
    largest, stopped = [0], threading.Event()

    def watch() -> None:
        while not stopped.wait(LOOK):
            largest[0] = max(largest[0], psutil.Process(pid).memory_info().rss)

    thread = threading.Thread(target=watch)
    thread.start()
    try:
        yield largest
    finally:
        stopped.set()
        thread.join()


def print_table(figures: dict[str, Any]) -> None:
    """Show the figures."""
    console = Console(width=110)
    columns = ("where", "plans/s", "overhead", "first result s", "taken in s", "service MB")
    table = plain_table(*columns, right=columns[1:])
    for found in figures["batches"]:
        rate, overhead = f"{found['rate']:.1f}", f"{100.0 * found['overhead']:.0f} %"
        times = (f"{found['first_result']:.2f}", f"{found['taken_in']:.2f}")
        table.add_row(found["name"], rate, overhead, *times, f"{found['memory']:.0f}")
    console.print(f"{figures['items']} plans; the bare loop takes {1e3 * figures['bare_loop']:.2f} ms a plan")
    console.print(table)
    alone, beside = (1e3 * figures["interactive"][name]["p99"] for name in ("alone", "beside"))
    console.print(f"p99 of cheap requests alone {alone:.1f} ms, beside a batch {beside:.1f} ms")
    rates = {found["name"]: found["rate"] for found in figures["batches"]}
    if len(rates) == len(PLACES):
        one, two, first, second = rates.values()
        console.print(f"two workers are {two / one:.2f} times one, two machines {second / first:.2f} times one")
