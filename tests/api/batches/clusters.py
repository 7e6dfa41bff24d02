"""A real Dask cluster on the loopback interface: a scheduler, and machines that have joined it by `planner worker`."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

import psutil

from tests.api.conftest import free_port, wait_until
from tests.locations import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


class Cluster:
    """Its processes, each of which may be killed and started again."""

    def __init__(self, folder: Path) -> None:
        self.port = free_port()
        self.folder = folder
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.processes: dict[str, subprocess.Popen[bytes]] = {}

    def start_scheduler(self) -> None:
        options = ["--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard"]
        self._start("scheduler", "distributed.cli.dask_scheduler", *options)

    def start_worker(self, name: str) -> None:
        self._start(name, "cli", "worker", self.address, "--workers", "1")

    def _start(self, name: str, module: str, *options: str) -> None:
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "PLANNER_WORKER_MEMORY_MIB": "512"}
        with (self.folder / f"{name}.log").open("ab") as log:
            command = [sys.executable, "-m", module, *options]
            self.processes[name] = subprocess.Popen(command, cwd=self.folder, env=environment, stderr=log, stdout=log)

    def planning_processes(self, name: str) -> list[psutil.Process]:
        """Return the processes of a machine that have no child processes."""
        found = psutil.Process(self.processes[name].pid).children(recursive=True)
        return [process for process in found if not process.children() and "forkserver" in " ".join(process.cmdline())]

    def kill(self, name: str) -> None:
        """Kill a process at once, as a power failure would."""
        self.processes[name].kill()
        self.processes[name].wait()

    def wait_joined(self, name: str, times: int = 1) -> None:
        log = self.folder / f"{name}.log"
        wait_until(lambda: log.read_text().count('"event":"joined"') >= times, 60.0)


@contextmanager
def running_cluster(folder: Path, workers: int) -> Iterator[Cluster]:
    cluster = Cluster(folder)
    cluster.start_scheduler()
    names = [f"worker_{k}" for k in range(workers)]
    for name in names:
        cluster.start_worker(name)
    try:
        for name in names:
            cluster.wait_joined(name)
        yield cluster
    finally:
        for process in cluster.processes.values():
            process.terminate()
        for process in cluster.processes.values():
            process.wait(20.0)
