"""A worker process: successful and failed starts."""

from __future__ import annotations

import asyncio
import errno
import multiprocessing
import signal
import socket
import subprocess
import sys
import time
from typing import Any

import psutil
import pytest

from api.pool.messages import Caps
from api.pool.worker import Worker
from tests.api.conftest import free_port, wait_until
from tests.api.pool.made_up_workers import ENTRY
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
        worker = Worker(CAPS, ENTRY)
        await asyncio.wait_for(worker.get_ready(), 10.0)
        return worker

    monkeypatch.setattr(Worker, "_start", start)
    monkeypatch.setattr(asyncio, "open_unix_connection", no_more_files)
    worker = asyncio.run(get_ready())
    assert worker.ended.is_set() and worker.exit_code == -signal.SIGKILL
    assert not worker.warm and not worker.alive


def test_what_nobody_wants_is_not_started() -> None:
    async def get_ready() -> Worker:
        worker = Worker(CAPS, ENTRY)
        worker.kill()
        await asyncio.wait_for(worker.get_ready(), 10.0)
        return worker

    worker = asyncio.run(get_ready())
    assert worker.ended.is_set() and worker.pid is None


@pytest.mark.large_only
def test_a_service_that_is_stopped_before_it_is_ready_waits_for_no_worker() -> None:
    """It waited for the end of imports and warm-up, which never comes here."""
    command = [sys.executable, "-m", "cli", "serve", "--port", str(free_port())]
    with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as process:
        starting = psutil.Process(process.pid)
        wait_until(lambda: bool(starting.children()))
        for child in starting.children():
            child.suspend()
        process.terminate()
        try:
            assert process.wait(60.0) in (0, -signal.SIGTERM)  # the latter where its handler is not there yet
        finally:
            process.kill()
