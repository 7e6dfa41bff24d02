"""The log: one JSON object a line, without paths of the host."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from api.base.logs import where_from
from tests.locations import ROOT

WARNS = """
from api.base.logs import configure_logs
configure_logs("info")
import numpy as np
np.array([1.0]) / np.array([0.0])
"""


def test_warnings_of_numpy_are_lines_of_the_log_without_paths() -> None:
    """As workers log them: numpy's warnings came as plain text with the path of the file."""
    ran = subprocess.run([sys.executable, "-c", WARNS], cwd=ROOT, check=True, capture_output=True, text=True)
    [line] = ran.stderr.splitlines()
    logged = json.loads(line)
    assert (logged["event"], logged["level"], logged["category"]) == ("library_warning", "warning", "RuntimeWarning")
    assert "divide by zero" in logged["message"]
    assert "/" not in logged["where"]
    assert ran.stdout == ""


REPLACED_AND_CLOSED = """
import io, logging, sys
import structlog
from api.base.logs import configure_logs
real, sys.stderr = sys.stderr, io.TextIOWrapper(io.BytesIO())
configure_logs("info")
structlog.get_logger().info("first")
sys.stderr.close()
sys.stderr = real
logging.getLogger("httpx").info("of a library")
structlog.get_logger().info("of the service")
"""


def test_logs_go_to_the_standard_error_of_the_moment() -> None:
    """A command that runs inside of a test logs to a stream that is closed after it."""
    ran = subprocess.run([sys.executable, "-c", REPLACED_AND_CLOSED], cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    lines = ran.stderr.splitlines()
    assert [json.loads(line)["event"] for line in lines] == ["of a library", "of the service"]


WORKER_THAT_WARNS = """
import socket, sys, warnings
from api.pool.messages import Caps, Task, pack
from api.pool.worker_process import work

server, worker = socket.socketpair()
server.sendall(b"".join(pack(Task("plan_trajectory", "", 0.0, 0.0))))
server.shutdown(socket.SHUT_WR)
work(worker, Caps(60.0, 10, 10, 1024, sys.argv[1]), lambda: lambda task, caps: warnings.warn("of a library"))
"""


@pytest.mark.parametrize(("level", "lines"), [("info", 1), ("error", 0)])
def test_workers_log_at_the_level_that_is_set(level: str, lines: int) -> None:
    command = [sys.executable, "-c", WORKER_THAT_WARNS, level]
    ran = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    assert len(ran.stderr.splitlines()) == lines


def test_a_failure_is_told_without_paths_and_values() -> None:
    with pytest.raises(json.JSONDecodeError) as caught:
        json.loads("a caller's value")
    told = where_from(caught.value)
    assert told.startswith("JSONDecodeError < raw_decode (decoder.py:")
    assert "/" not in told
    assert "caller" not in told
