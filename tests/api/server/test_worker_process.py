"""A worker process that starts, or does not."""

from __future__ import annotations

import asyncio
import errno
import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import time
from typing import Any

import psutil
import pytest

from api.server.worker import Worker
from api.workers.messages import Caps
from tests.api.conftest import free_port
from tests.locations import ROOT

CAPS = Caps(60.0, 1000, 500_000, 512)


def test_a_process_that_nobody_can_reach_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its place in the pool stayed empty for ever: the channel needed a file when there were no more."""
    process = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(60.0,), daemon=True)

    def start(worker: Any) -> socket.socket:
        worker._process = process
        process.start()
        worker.pid = process.pid
        ours, its = socket.socketpair()
        its.close()
        return ours

    async def no_more_files(**_: Any) -> None:
        raise OSError(errno.EMFILE, "too many open files")

    async def get_ready() -> Worker:
        worker = Worker(CAPS)
        await asyncio.wait_for(worker.get_ready(), 10.0)
        return worker

    monkeypatch.setattr(Worker, "_start", start)
    monkeypatch.setattr(asyncio, "open_unix_connection", no_more_files)
    worker = asyncio.run(get_ready())
    assert worker.ended.is_set() and worker.exit_code == -signal.SIGKILL
    assert not worker.warm and not worker.alive


def test_what_nobody_wants_is_not_started() -> None:
    async def get_ready() -> Worker:
        worker = Worker(CAPS)
        worker.kill()
        await asyncio.wait_for(worker.get_ready(), 1.0)
        return worker

    worker = asyncio.run(get_ready())
    assert worker.ended.is_set() and worker.pid is None


WORKER_THAT_TELLS = """
import os, socket
import api.workers.execution
from api.workers.messages import HEADER, Caps, Reply, Task, pack, unpack
from api.workers.main import work

api.workers.execution.execute = lambda task, caps: Reply(200, "", b"", result=os.sched_getscheduler(0))
server, worker = socket.socketpair()
for stands_back in (True, False, True):
    server.sendall(b"".join(pack(Task("", "", 0.0, 0.0, stands_back=stands_back))))
server.shutdown(socket.SHUT_WR)
work(worker, Caps(60.0, 10, 10, 1024))
replies = server.makefile("rb")
for _ in range(4):
    payload, body = HEADER.unpack(replies.read(HEADER.size))
    reply = unpack(replies.read(payload), replies.read(body))
    print(None if reply is None else reply.result)
"""


def test_only_what_stands_back_leaves_the_processor_to_all_else() -> None:
    command = [sys.executable, "-c", WORKER_THAT_TELLS]
    ran = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    assert ran.stdout.split() == ["None", *map(str, (os.SCHED_IDLE, os.sched_getscheduler(0), os.SCHED_IDLE))]


@pytest.mark.large_only
def test_what_a_worker_computes_is_known_and_whether_it_would_go_on() -> None:
    """Beside one that wants the same processor all the time, one of idle priority hardly gets on; a third one rests."""
    processor = min(os.sched_getaffinity(0))
    on_one = f"import os, time; os.sched_setaffinity(0, [{processor}])"
    endless, idle = "\nwhile True: pass", "; os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))"
    programs = [on_one + endless, on_one + idle + endless, on_one + "; time.sleep(60.0)"]
    processes = [subprocess.Popen([sys.executable, "-c", program]) for program in programs]
    worker = Worker(CAPS)
    computed, wants = [], []
    try:
        time.sleep(3.0)
        for process in processes:
            worker.pid = process.pid
            before, by_psutil = worker.computed(), psutil.Process(process.pid).cpu_times()
            time.sleep(1.0)
            computed.append(worker.computed() - before)
            assert computed[-1] == pytest.approx(
                psutil.Process(process.pid).cpu_times().user - by_psutil.user, abs=0.05
            )
            wants.append(worker.wants_processor())
    finally:
        for process in processes:
            process.kill()
            process.wait()
    assert computed[1] < 0.1 < computed[0] and computed[2] < 0.01
    assert wants == [True, True, False]
    assert worker.computed() == 0.0 and not worker.wants_processor()  # it has ended


@pytest.mark.large_only
@pytest.mark.parametrize("seconds", [0.3, 0.8, 1.5])
def test_a_service_that_is_stopped_before_it_is_ready_ends_at_once(seconds: float) -> None:
    """It waited until everything was imported and warm."""
    command = [sys.executable, "-m", "api.cli", "serve", "--port", str(free_port())]
    with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as process:
        time.sleep(seconds)
        process.terminate()
        told = time.monotonic()
        assert process.wait(20.0) in (0, -signal.SIGTERM)  # the latter where its handler is not there yet
    assert time.monotonic() - told < 2.0
