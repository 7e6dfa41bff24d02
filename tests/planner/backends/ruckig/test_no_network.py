"""No process of ours opens a connection, though Ruckig sends waypoints to a server if it gets any (pitfall 9)."""

from __future__ import annotations

import ast
import signal

import pytest

from tests.locations import ROOT
from tests.planner.backends.ruckig.network_free import SOCKET, run_without_sockets

known_machine = pytest.mark.skipif(SOCKET is None, reason="the number of the system call is not known here")


@known_machine
@pytest.mark.parametrize(
    "code",
    [
        "import socket; socket.socket()",
        """
import ruckig
target = ruckig.InputParameter(1)
target.target_position = target.max_velocity = target.max_acceleration = target.max_jerk = [1.0]
target.intermediate_positions = [[0.5]]
ruckig.Ruckig(1, 0.01, 1).calculate(target, ruckig.Trajectory(1))
""",
    ],
    ids=["python", "ruckig with intermediate positions"],
)
def test_a_socket_would_be_noticed(code: str) -> None:
    assert run_without_sockets(code).returncode == -signal.SIGSYS


@pytest.mark.large_only
@known_machine
def test_planning_opens_no_socket() -> None:
    code = """
from dataclasses import replace
from planner.backends import BACKENDS
from planner.planning import plan
from planner.problems.transitions import ThroughTransition
from tests.planner.problems_of_tests import backend_of, problem_of
for kind in BACKENDS:
    problem = problem_of("kuka_kr16_l6_2", 3, 5, 0.3)
    first, *inner, last = problem.waypoints
    inner = [replace(waypoint, transition=ThroughTransition()) for waypoint in inner]
    for waypoints in (problem.waypoints, (first, *inner, last)):
        assert plan(replace(problem, waypoints=waypoints), backend_of(kind)).certificate.satisfied
print("planned")
"""
    result = run_without_sockets(code)
    assert (result.returncode, result.stdout) == (0, "planned\n"), result.stderr


@pytest.mark.long_table
@pytest.mark.parametrize("folder", ["planner", "api", "cli", "benchmarks"])
def test_no_waypoints_are_handed_to_the_library(folder: str) -> None:
    for file in (ROOT / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            name = getattr(node, "attr", None) or getattr(node, "value", None)
            assert name != "intermediate_positions", file
