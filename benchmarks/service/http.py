"""The figures of the HTTP service: overhead for a plan, requests a second, start, memory."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

import orjson
import psutil

from api.contract.requests import PlanRequest
from api.work.answers.formats import FORMATS
from api.work.answers.plans import AnswerOptions
from api.work.conversion.problems import to_backend, to_planning_problem
from benchmarks.machine import machine
from benchmarks.service.clients import Connection
from benchmarks.service.processes import workers_of
from benchmarks.service.workload import ROBOT, ROWS, bodies, http_request
from cli.local_service import local_service
from planner.planning import plan
from planner.robots import load_robot

WORKERS = 2
CONNECTIONS = (1, 2, 4, 8, 16)
WARM_UP = 100
STAGES = ("queue", "validate", "plan", "serialise")
"""Of the `Server-Timing` header, besides the total."""

MEGABYTE = 1e6


def measure(seconds: float, requests: int, starts: int) -> dict[str, Any]:
    """Return all figures; times in s, memory in bytes.

    Args:
        seconds: Length of each load.
        requests: Requests of the latency measurement.
        starts: Starts of the service.
    """
    where = machine()
    requested = bodies(load_robot(ROBOT).middle.tolist())
    wire = [http_request(body) for body in requested]
    with tempfile.TemporaryDirectory() as folder:
        log, file = Path(folder, "service.log"), Path(folder, "bodies")
        file.write_bytes(b"\n".join(requested))
        ready = [_start_to_ready(log) for _ in range(starts)]
        with local_service(log, WORKERS) as (url, service):
            port = int(url.rpartition(":")[2])
            process = psutil.Process(service.pid)
            idle = _memory(process)
            latency = _latency(port, wire, requests)
            loads = [_load(port, connections, seconds, file, process) for connections in CONNECTIONS]
            loaded = _memory(process)
    return {
        "machine": where,
        "workers": WORKERS,
        "latency": latency,
        "throughput": loads,
        "in_process": _in_process(requested),
        "start_to_ready": {"median": median(ready), "worst": max(ready), "starts": starts},
        "memory": {"idle": idle, "after_load": loaded},
    }


def _start_to_ready(log: Path) -> float:
    start = time.perf_counter()
    with local_service(log, WORKERS):
        return time.perf_counter() - start


def _latency(port: int, requests: list[bytes], count: int) -> dict[str, Any]:
    """Measure one client, one request at a time: the overhead beside the plan, by cause."""
    connection = Connection(port)
    stages: dict[str, list[float]] = {name: [] for name in (*STAGES, "hand_over", "transport", "added", "client_total")}
    size = 0
    for i in range(-WARM_UP, count):
        client_total, head, size = connection.send(requests[i % len(requests)])
        timings = _server_timing(head)
        if i < 0:
            continue
        for name in STAGES:
            stages[name].append(timings[name])
        stages["hand_over"].append(timings["total"] - sum(timings[name] for name in STAGES))
        stages["transport"].append(client_total - timings["total"])
        stages["added"].append(client_total - timings["plan"])
        stages["client_total"].append(client_total)
    return {
        "requests": count,
        "response_bytes": size,
        **{name: _distribution(values) for name, values in stages.items()},
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


def _load(port: int, connections: int, seconds: float, file: Path, service: psutil.Process) -> dict[str, Any]:
    """Measure several clients at once, in a process of their own, and the whole processor time for a request."""
    command = [sys.executable, "-m", "benchmarks.service.clients", str(port), str(connections), str(seconds), str(file)]
    workers = workers_of(service)
    before = _cpu_seconds([service]), _cpu_seconds(workers)
    output = subprocess.run(command, check=True, capture_output=True).stdout
    result: dict[str, Any] = orjson.loads(output)
    result["server_cpu"] = (_cpu_seconds([service]) - before[0]) / result["requests"]
    result["workers_cpu"] = (_cpu_seconds(workers) - before[1]) / result["requests"]
    return result


def _cpu_seconds(processes: list[psutil.Process]) -> float:
    times = [process.cpu_times() for process in processes]
    return float(sum(spent.user + spent.system for spent in times))


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
