"""The figures of the HTTP service beside another version: latency, requests a second, start, memory."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, closing
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import orjson
import psutil

from api.contract.requests import PlanRequest
from api.work.answers.formats import FORMATS
from api.work.answers.plans import AnswerOptions
from api.work.conversion.problems import to_backend, to_planning_problem
from benchmarks.checkouts import HERE, NAMES, checkout_of
from benchmarks.machine import machine
from benchmarks.service.clients import Connection
from benchmarks.service.processes import workers_of
from benchmarks.service.workload import ROBOT, ROWS, WAYPOINTS, bodies, http_request
from cli.local_service import local_service
from planner.planning import plan
from planner.robots import load_robot

if TYPE_CHECKING:
    from collections.abc import Mapping

WORKERS = 2
SIZES = (2, WAYPOINTS)
"""Numbers of waypoints of the requests."""

CONNECTIONS = (1, 2, 4, 8, 16)
WARM_UP = 100
STAGES = ("queue", "validate", "plan", "serialise")
"""Of the `Server-Timing` header, besides the total."""

MEGABYTE = 1e6


class Version:
    """The running service of one version.

    Attributes:
        port: Where it listens.
        process: Its server.
    """

    def __init__(self, checkout: Path, log: Path, stack: ExitStack) -> None:
        url, service = stack.enter_context(local_service(log, WORKERS, checkout))
        self.port = int(url.rpartition(":")[2])
        self.process = psutil.Process(service.pid)


def measure(beside: str, seconds: float, requests: int, starts: int) -> dict[str, Any]:
    """Return all figures of both versions; times in s, memory in bytes.

    The versions run side by side and work by turns, so that other programs slow both.

    Args:
        beside: The other version: the folder of a checkout, or a commit.
        seconds: Length of each load.
        requests: Requests of the latency measurement.
        starts: Starts of each service.
    """
    where = machine()
    requested = {size: bodies(load_robot(ROBOT).middle.tolist(), waypoints=size) for size in SIZES}
    with tempfile.TemporaryDirectory() as folder, checkout_of(beside) as other, ExitStack() as stack:
        log = Path(folder, "service.log")
        checkouts = dict(zip(NAMES, (other, HERE), strict=True))
        ready = [{name: _start_to_ready(log, checkout) for name, checkout in checkouts.items()} for _ in range(starts)]
        versions = {name: Version(checkout, Path(folder, name), stack) for name, checkout in checkouts.items()}
        idle = {name: _memory(version.process) for name, version in versions.items()}
        latency, loads = {}, {}
        for size, each in requested.items():
            wire, file = [http_request(body) for body in each], Path(folder, "bodies")
            file.write_bytes(b"\n".join(each))
            latency[size] = _latencies(versions, wire, requests)
            loads[size] = [
                {name: _load(version, connections, seconds, file) for name, version in versions.items()}
                for connections in CONNECTIONS
            ]
        loaded = {name: _memory(version.process) for name, version in versions.items()}
    return {
        "machine": where,
        "workers": WORKERS,
        "latency": latency,
        "throughput": loads,
        "in_process": _in_process(requested[WAYPOINTS]),
        "start_to_ready": {name: _distribution([start[name] for start in ready]) for name in NAMES},
        "memory": {"idle": idle, "after_load": loaded},
    }


def _start_to_ready(log: Path, checkout: Path) -> float:
    start = time.perf_counter()
    with local_service(log, WORKERS, checkout):
        return time.perf_counter() - start


def _latencies(versions: Mapping[str, Version], requests: list[bytes], count: int) -> dict[str, Any]:
    """Measure one client, which sends each request to both versions: the overhead beside the plan, by cause."""
    measured: dict[str, list[dict[str, float]]] = {name: [] for name in versions}
    with ExitStack() as stack:
        connections = {name: stack.enter_context(closing(Connection(each.port))) for name, each in versions.items()}
        for i in range(-WARM_UP, count):
            for name in sorted(versions, reverse=i % 2 == 0):
                times = _times_of(connections[name], requests[i % len(requests)])
                if i >= 0:
                    measured[name].append(times)
    return {
        name: {stage: _distribution([row[stage] for row in rows]) for stage in rows[0]}
        for name, rows in measured.items()
    }


def _times_of(connection: Connection, request: bytes) -> dict[str, float]:
    """Send a request, and return the time of each stage, s."""
    client_total, head, _ = connection.send(request)
    timings = _server_timing(head)
    return {
        **{name: timings[name] for name in STAGES},
        "hand_over": timings["total"] - sum(timings[name] for name in STAGES),
        "transport": client_total - timings["total"],
        "added": client_total - timings["plan"],
        "client_total": client_total,
    }


def _server_timing(head: bytes) -> dict[str, float]:
    """Return entries of the `Server-Timing` header, s."""
    if not head.startswith(b"HTTP/1.1 200"):
        raise RuntimeError(f"the service answered\n{head.decode()}")
    lines = head.decode().lower().split("\r\n")
    value = next(line for line in lines if line.startswith("server-timing: ")).partition(": ")[2]
    entries = (entry.split(";dur=") for entry in value.split(", "))
    return {name: float(milliseconds) / 1e3 for name, milliseconds in entries}


def _distribution(values: list[float]) -> dict[str, float]:
    ordered = sorted(values)
    return {"median": median(ordered), "p99": ordered[int(len(ordered) * 0.99)], "worst": ordered[-1]}


def _load(version: Version, connections: int, seconds: float, file: Path) -> dict[str, Any]:
    """Measure several clients at once, in a process of their own, and the whole processor time for a request."""
    arguments = [str(version.port), str(connections), str(seconds), str(file)]
    before = _cpu_seconds(version.process)
    command = [sys.executable, "-m", "benchmarks.service.clients", *arguments]
    output = subprocess.run(command, check=True, capture_output=True).stdout
    result: dict[str, Any] = orjson.loads(output)
    server, workers = (after - start for after, start in zip(_cpu_seconds(version.process), before, strict=True))
    return {**result, "server_cpu": server / result["requests"], "workers_cpu": workers / result["requests"]}


def _cpu_seconds(service: psutil.Process) -> tuple[float, float]:
    """Return processor times of a server and of its workers, s: recycled workers count through their parent."""
    times = [process.cpu_times() for process in (service, *service.children(recursive=True))]
    total = sum(each.user + each.system + each.children_user + each.children_system for each in times)
    server = times[0].user + times[0].system
    return server, total - server


def _memory(service: psutil.Process) -> dict[str, Any]:
    """Return memory of the largest worker and of the server: resident, proportional and unique, bytes."""
    workers = [_memory_of(worker) for worker in workers_of(service)]
    return {"worker": max(workers, key=lambda memory: memory["rss"]), "server": _memory_of(service)}


def _memory_of(process: psutil.Process) -> dict[str, int]:
    memory = process.memory_full_info()
    return {"rss": memory.rss, "pss": memory.pss, "uss": memory.uss}


def _in_process(requested: list[bytes]) -> dict[str, Any]:
    """Return the library alone, on one core: plans and renders to JSON, a second."""
    robot = load_robot(ROBOT)
    requests = [PlanRequest.model_validate_json(body) for body in requested]
    problems = [(to_planning_problem(request, robot), to_backend(request.backend)) for request in requests]
    form, options = FORMATS["json"], AnswerOptions()
    planning, rendering = [], []
    for i in range(-WARM_UP, 500):
        start = time.perf_counter()
        solved = plan(*problems[i % len(problems)])
        planned = time.perf_counter()
        form.render(solved, options)
        if i >= 0:
            planning.append(planned - start)
            rendering.append(time.perf_counter() - planned)
    return {
        "rows": ROWS,
        "plan": _distribution(planning),
        "render": _distribution(rendering),
        "plans_per_second": len(planning) / (sum(planning) + sum(rendering)),
    }
