"""Workers keep freed memory within a task and give it back after a large one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from api.pool.memory import KEEPING
from tests.locations import ROOT

TASK = """
from pathlib import Path
from api.pool.memory import Memory
def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4 // 1024
memory = Memory()
before = resident()
arrays = [bytearray(2**20) for _ in range(200)]
del arrays
kept = resident() - before
memory.give_back()
print(kept, resident() - before)
"""

TEMPLATE = """
from multiprocessing import forkserver
from pathlib import Path
from time import sleep
from api.pool.worker import start_template, stop_template
start_template("api.work.template")
environment = Path("/proc", str(forkserver._forkserver._forkserver_pid), "environ")
while not environment.read_bytes():  # the process has yet to become another program
    sleep(0.01)
print(environment.read_text().replace(chr(0), " "))
stop_template()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="settings of the GNU C library")
def test_memory_is_kept_within_a_task_and_given_back_after_it() -> None:
    """Retained memory of 200 freed MiB, before and after the end of the task."""
    environment = os.environ | KEEPING | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", TASK], capture_output=True, text=True, check=True, env=environment)
    kept, left = map(int, done.stdout.split())
    assert kept > 150
    assert left < 50


def test_the_settings_reach_the_process_that_workers_are_forked_from() -> None:
    if not Path("/proc/self/environ").exists():
        pytest.skip("no /proc")
    done = subprocess.run([sys.executable, "-c", TEMPLATE], capture_output=True, text=True, check=True, cwd=ROOT)
    for name, value in KEEPING.items():
        assert f"{name}={value}" in done.stdout
