"""Restarts under load: the service gets SIGTERM repeatedly, and loses no request of its clients."""

from __future__ import annotations

import asyncio
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import uvloop

from benchmarks.machine import machine, print_machine
from benchmarks.service.clients import HOST
from benchmarks.service.workload import ROBOT, bodies, http_request
from cli.local_service import local_service
from cli.work.terminal import plain_table, terminal
from planner.robots import load_robot

CLIENTS = 8
"""More than there are workers: some requests wait when the signal comes."""

LOAD = 1.0
"""s, of load before the signal."""


def measure(times: int) -> dict[str, Any]:
    """Return the results of the requests of all restarts, and the times of starts and stops, s."""
    requests = [_asking_first(body) for body in bodies(load_robot(ROBOT).middle.tolist())]
    tally: Counter[str] = Counter()
    starts, stops = [], []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(times):
            begun = time.perf_counter()
            with local_service(Path(folder, "service.log")) as (url, process):
                starts.append(time.perf_counter() - begun)
                port = int(url.rpartition(":")[2])
                stops.append(uvloop.run(_one_restart(port, process, requests, tally)))
                tally["unclean"] += process.wait(20.0) != 0
    return {"machine": machine(), "restarts": times, "start": max(starts), "stop": max(stops), **_totals(tally)}


def _totals(tally: Counter[str]) -> dict[str, int]:
    names = ("answered", "refused", "not_accepted", "lost", "unclean")
    return {name: tally[name] for name in names}


def _asking_first(body: bytes) -> tuple[bytes, bytes]:
    """Send a request whose body waits until the service reads it (100 Continue): then it is accepted."""
    head, _, body = http_request(body).partition(b"\r\n\r\n")
    return head + b"\r\nExpect: 100-continue\r\nConnection: close\r\n\r\n", body


async def _one_restart(port: int, process: Any, requests: list[tuple[bytes, bytes]], tally: Counter[str]) -> float:
    """Send requests until nobody listens, with the signal in the middle; return the duration of the stop, s."""
    clients = [asyncio.create_task(_ask_until_refused(port, requests[k:], tally)) for k in range(CLIENTS)]
    await asyncio.sleep(LOAD)
    told = time.perf_counter()
    process.terminate()
    await asyncio.gather(*clients)
    await asyncio.to_thread(process.wait)
    return time.perf_counter() - told


async def _ask_until_refused(port: int, requests: list[tuple[bytes, bytes]], tally: Counter[str]) -> None:
    for k in range(1_000_000):
        try:
            reader, writer = await asyncio.open_connection(HOST, port)
        except OSError:
            return
        try:
            tally[await _asked(*requests[k % len(requests)], reader, writer)] += 1
        finally:
            writer.close()


async def _asked(head: bytes, body: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> str:
    """Send a request; what became of it."""
    try:
        writer.write(head)
        told = await reader.readuntil(b"\r\n\r\n")
    except (asyncio.IncompleteReadError, OSError):
        return "not_accepted"
    if not told.startswith(b"HTTP/1.1 100"):
        return "refused"
    try:
        writer.write(body)
        answer = (await reader.readuntil(b"\r\n\r\n")).lower()
        await reader.readexactly(int(answer.partition(b"content-length: ")[2].partition(b"\r\n")[0]))
    except (asyncio.IncompleteReadError, OSError):
        return "lost"
    return "answered" if answer.startswith(b"http/1.1 200") else "refused"


def print_table(figures: dict[str, Any]) -> None:
    """Show the figures."""
    console = terminal()
    print_machine(console, figures["machine"])
    slowest = f"the slowest start {figures['start']:.1f} s, stop {figures['stop']:.1f} s"
    title = f"{figures['restarts']} restarts by SIGTERM under load; {slowest}"
    names = ("answered", "refused", "not_accepted", "lost", "unclean")
    meanings = (
        "accepted and answered with 200",
        "answered otherwise: the service ends, or has too much to do",
        "ended before the service read the request: may be sent again",
        "accepted, and never answered (aim: 0)",
        "processes that did not end with 0 (aim: 0)",
    )
    table = plain_table("requests", "number", "what", right=["number"], title=title)
    for name, meaning in zip(names, meanings, strict=True):
        table.add_row(name.replace("_", " "), str(figures[name]), meaning)
    console.print(table, "")
