"""The warm-up of a worker before its first request."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.locations import ROOT


@pytest.mark.large_only
def test_a_worker_has_loaded_the_default_solvers_before_its_first_request() -> None:
    code = """
import sys

import pytest
from api.work.execution import warm_up
from api.pool.messages import Caps
warm_up(Caps(max_deadline=60.0, max_waypoints=100, max_samples=1000, memory_mib=1024))
print(*sorted(sys.modules))
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    loaded = set(result.stdout.split())
    assert {"casadi", "pinocchio", "ruckig", "scipy.linalg"} <= loaded
    assert not {"toppra", "matplotlib", "scipy.optimize"} & loaded  # for few requests, which can wait for them
