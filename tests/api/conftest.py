"""A real service process on a free port of the loopback interface."""

from __future__ import annotations

import json
import os
import random
import re
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
import psutil
import pytest

from benchmarks.service.processes import workers_of
from tests.locations import ROOT

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

WORKER_MEMORY_MIB = 640
SETTINGS = {"workers": 2, "express_workers": 0, "worker_niceness": 0, "worker_memory_mib": WORKER_MEMORY_MIB}
"""The default settings of a service in tests, with as few processes as possible."""


PORTS = range(20_000, 32_000)
"""The ports of tests, below the kernel's range of ephemeral ports."""


@dataclass
class RunningService:
    """A service process, its client, and its log file."""

    process: subprocess.Popen[bytes]
    client: httpx.Client
    log: Path

    @property
    def url(self) -> str:
        return str(self.client.base_url)

    def workers(self) -> list[psutil.Process]:
        return workers_of(psutil.Process(self.process.pid))

    def busy_workers(self) -> int:
        """Return the number of busy workers."""
        found = re.findall(r'planner_workers{lane="\w+",state="busy"} (\d+)', self.client.get("/metrics").text)
        return sum(map(int, found))

    def post(self, path: str, body: Any, **options: Any) -> httpx.Response:
        return self.client.post(path, json=body, **options)

    def wait_ready(self, timeout: float = 180.0) -> None:
        def ready() -> bool:
            try:
                answer = self.client.get("/readyz")
            except httpx.TransportError:
                assert self.process.poll() is None, self.log.read_text()
                return False
            return answer.status_code == 200 and answer.json()["warm_workers"] == answer.json()["workers"]

        wait_until(ready, timeout)

    def line_of(self, request_id: str) -> dict[str, Any]:
        """Wait for the log line of a request, which appears soon after the answer."""

        def found() -> list[dict[str, Any]]:
            return [line for line in self.logged() if line.get("request_id") == request_id]

        wait_until(lambda: bool(found()))
        [line] = found()
        return line

    def logged(self) -> list[dict[str, Any]]:
        return [json.loads(line) for line in self.log.read_text().splitlines()]


def wait_until(condition: Callable[[], bool], timeout: float = 30.0) -> None:
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end, "the condition did not come true in time"
        time.sleep(0.05)


def free_port() -> int:
    """Return a port that no other test and no connection of the kernel gets until this process ends."""
    for port in random.sample(PORTS, len(PORTS)):
        lock = socket.socket(socket.AF_UNIX)
        with socket.socket() as probe, suppress(OSError):
            lock.bind(f"\0port {port} of the planner's tests")  # freed when the process ends, however it does
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(("127.0.0.1", port))
            lock.detach()
            return port
        lock.close()
    raise AssertionError("no port is free")


@contextmanager
def running_service(log: Path, **settings: Any) -> Iterator[RunningService]:
    port = free_port()
    settings = {**SETTINGS, **settings, "port": port}
    environment = {**os.environ, **{f"PLANNER_{name.upper()}": str(value) for name, value in settings.items()}}
    with log.open("wb") as stderr:
        process = subprocess.Popen([sys.executable, "-m", "api"], cwd=ROOT, env=environment, stderr=stderr)
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=60.0, trust_env=False) as client:
        service = RunningService(process, client, log)
        try:
            service.wait_ready()
            yield service
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
                process.wait(60.0)


def stored(running: RunningService) -> set[str]:
    """Return the paths of all robots and scenes of a service."""
    return {
        f"/v1/{kind}/{one['id']}"
        for kind in ("robots", "scenes")
        for one in running.client.get(f"/v1/{kind}").json()[kind]
    }


@pytest.fixture(scope="session")
def _one_worker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    settings = {"workers": 1, "queue_size": 3, "max_robots": 2, "worker_memory_mib": 448, "max_samples": 100_000_000}
    with running_service(tmp_path_factory.mktemp("one_worker") / "log.jsonl", **settings) as running:
        running.client.headers["Cache-Control"] = "no-cache"  # what is asked again is computed again
        yield running


@pytest.fixture
def one_worker(_one_worker: RunningService) -> Iterator[RunningService]:
    """A service whose only worker may be killed; another one is ready when the next test begins."""
    yield _one_worker
    _one_worker.wait_ready()


@pytest.fixture
def two_workers(service: RunningService) -> Iterator[RunningService]:
    """Lend the shared service to a test that kills workers; wait for new workers before the next test."""
    yield service
    service.wait_ready()
    wait_until(lambda: len(service.workers()) == 2)


@pytest.fixture
def start_service(tmp_path: Path) -> Iterator[Callable[..., RunningService]]:
    """Start a service of one's own, with settings."""
    stack: list[Any] = []

    def start(**settings: Any) -> RunningService:
        context = running_service(tmp_path / f"log{len(stack)}.jsonl", **settings)
        stack.append(context)
        running: RunningService = context.__enter__()
        return running

    yield start
    for context in reversed(stack):
        context.__exit__(None, None, None)
