"""A soak: hours of all operations at a low rate; memory, open files and temporary files must not grow."""

from __future__ import annotations

import asyncio
import os
import random
import tempfile
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import httpx
import psutil
import uvloop

from benchmarks.machine import machine, print_machine
from benchmarks.service.processes import workers_of
from cli.local_service import local_service
from cli.work.terminal import plain_table, terminal
from planner.robots import load_robot

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

ROBOT, SPREAD = "kuka_kr16_2", 0.5
"""Of the requests; rad, of their waypoints about the middle of every joint."""

CLIENTS = 4
"""At once, each with one thing after the other."""

SAMPLES = 100
"""Looks at the processes, evenly over the time."""

WARM = 0.2
"""Share of the time after which nothing is done for the first time any more."""

GROWTH = 0.1
"""Allowed growth of a quantity from the first third after warming up to the last: noise of the allocator."""

QUANTITIES = {
    "server_mb": "memory of the server process (RSS), MB",
    "workers_mb": "memory of all workers of their own (USS), MB",
    "descriptors": "open files of the server process",
    "temporary_files": "files in the folder for temporary ones",
}


def measure(seconds: float) -> dict[str, Any]:
    """Return the requests, and each quantity: first third after warming up, last third, and maximum."""
    with tempfile.TemporaryDirectory() as folder:
        temporary = Path(folder, "temporary")
        temporary.mkdir()
        settings = {"PLANNER_DATA_DIRECTORY": folder, "TMPDIR": str(temporary), "PLANNER_MAX_BATCHES": "1000000"}
        with local_service(Path(folder, "service.log"), settings=settings) as (url, process):
            asked, samples = uvloop.run(_soak(url, psutil.Process(process.pid), temporary, seconds))
    quiet = samples[int(WARM * len(samples)) :]
    third = max(1, len(quiet) // 3)
    quantities = {
        name: {
            "first": median(sample[name] for sample in quiet[:third]),
            "last": median(sample[name] for sample in quiet[-third:]),
            "most": max(sample[name] for sample in samples),
        }
        for name in QUANTITIES
    }
    return {"machine": machine(), "seconds": seconds, "asked": dict(asked), "quantities": quantities}


async def _soak(
    url: str, process: psutil.Process, temporary: Path, seconds: float
) -> tuple[Counter[str], list[dict[str, float]]]:
    asked: Counter[str] = Counter()
    samples: list[dict[str, float]] = []
    end = time.monotonic() + seconds
    async with httpx.AsyncClient(base_url=url, timeout=60.0, trust_env=False) as client:
        clients = [asyncio.create_task(_use(client, k, end, asked)) for k in range(CLIENTS)]
        while time.monotonic() < end:
            samples.append(_sample(process, temporary))
            await asyncio.sleep(seconds / SAMPLES)
        await asyncio.gather(*clients)
    return asked, samples


def _sample(process: psutil.Process, temporary: Path) -> dict[str, float]:
    workers = 0.0
    for worker in workers_of(process):
        with suppress(psutil.Error):  # it is being replaced
            workers += worker.memory_full_info().uss
    return {
        "server_mb": process.memory_info().rss / 1e6,
        "workers_mb": workers / 1e6,
        "descriptors": process.num_fds(),
        "temporary_files": sum(len(files) for _, _, files in os.walk(temporary)),
    }


async def _use(client: httpx.AsyncClient, number: int, end: float, asked: Counter[str]) -> None:
    rng = random.Random(number)  # noqa: S311 - no secret
    uses: tuple[Callable[[httpx.AsyncClient, random.Random], Awaitable[Any]], ...]
    uses = (_plan, _plan, _plan, _plan_again, _ask_wrongly, _hang_up, _come_and_go, _send_a_batch)
    while time.monotonic() < end:
        use = rng.choice(uses)
        await use(client, rng)
        asked[use.__name__.strip("_")] += 1


def _request(rng: random.Random, **more: Any) -> dict[str, Any]:
    middle = load_robot(ROBOT).middle.tolist()
    positions = [[q + rng.uniform(-SPREAD, SPREAD) for q in middle] for _ in range(3)]
    waypoints = [{"kind": "joint", "position": position} for position in positions]
    kind = rng.choice(["cubic", "quintic", "trapezoidal", "ruckig", "toppra", "auto"])
    return {"robot": ROBOT, "waypoints": waypoints, "backend": {"kind": kind}, **more}


async def _plan(client: httpx.AsyncClient, rng: random.Random) -> None:
    form = rng.choice(["json", "csv", "msgpack", "npz"])
    await client.post("/v1/trajectories", params={"format": form}, json=_request(rng))


async def _plan_again(client: httpx.AsyncClient, rng: random.Random) -> None:
    request = _request(rng)
    for _ in range(5):
        await client.post("/v1/trajectories", json=request)


async def _ask_wrongly(client: httpx.AsyncClient, rng: random.Random) -> None:
    await client.post("/v1/trajectories", json=_request(rng, seed=-1))
    headers = {"Content-Type": "application/json"}
    await client.post("/v1/trajectories", content=b"{" * rng.randrange(100_000), headers=headers)


async def _hang_up(client: httpx.AsyncClient, rng: random.Random) -> None:
    request = _request(rng) | {"backend": {"kind": "min_effort"}}
    with suppress(httpx.TimeoutException):
        await client.post("/v1/trajectories", json=request, timeout=rng.uniform(0.01, 1.0))


async def _come_and_go(client: httpx.AsyncClient, rng: random.Random) -> None:
    robot_id = f"arm_{rng.randrange(10**9)}"
    rows = [{"kind": "revolute", "theta": 0.0, "d": 0.0, "a": rng.uniform(0.1, 1.0), "alpha": 0.0} for _ in range(3)]
    await client.post("/v1/robots", json={"kind": "dh", "id": robot_id, "convention": "standard", "joints": rows})
    await client.post("/v1/kinematics/forward", json={"robot": robot_id, "positions": [[0.1, 0.2, 0.3]]})
    await client.delete(f"/v1/robots/{robot_id}")


async def _send_a_batch(client: httpx.AsyncClient, rng: random.Random) -> None:
    made = await client.post("/v1/batches", json={"requests": [_request(rng) for _ in range(20)]})
    location = made.headers.get("Location")
    if location is None:
        return
    await client.get(f"{location}/events")
    await client.get(f"{location}/results.zip", params={"format": "csv"})


def is_flat(quantity: dict[str, float]) -> bool:
    """Tell whether a quantity did not grow."""
    return quantity["last"] <= (1.0 + GROWTH) * quantity["first"] + 2.0


def print_table(figures: dict[str, Any]) -> None:
    """Show the figures."""
    console = terminal()
    print_machine(console, figures["machine"])
    done = ", ".join(f"{count} x {name.replace('_', ' ')}" for name, count in sorted(figures["asked"].items()))
    title = f"{figures['seconds']:g} s of {CLIENTS} clients: {done}"
    numbers = ["first third", "last third", "most"]
    table = plain_table("quantity", *numbers, "flat", right=numbers, title=title)
    for name, quantity in figures["quantities"].items():
        values = (f"{quantity[key]:.0f}" for key in ("first", "last", "most"))
        table.add_row(QUANTITIES[name], *values, "yes" if is_flat(quantity) else "NO")
    console.print(table, "")
