"""A failing solver of the package: no known path makes it fail, so a stand-in does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from toppra.exceptions import ToppraError

from planner.backends import Toppra
from planner.backends.toppra import reachability
from planner.errors import InfeasibleDuration
from planner.planning import plan
from planner.problems.problem import PlanningProblem
from planner.problems.transitions import StopTransition
from planner.robots import load_robot
from tests.planner.backends.toppra.toppra_problems import (
    KUKA,
    KUKA_START,
    joint_problem,
    robot_limits,
    through,
    tool_problem,
    worst_ratio,
)

PROBLEMS = {
    "through": through("ngv_refuelling_arm", 6, 4, 0.5),
    "tool": tool_problem(StopTransition()),
    "torque": joint_problem(
        KUKA, [list(KUKA_START), [-1.0, -0.6, 0.9, 1.0, -0.5, 1.0]], limits=robot_limits(load_robot(KUKA), 0.3)
    ),
}


class FindsNothing(reachability.seidelWrapper):  # type: ignore[misc] # the package has no types
    """A solver that finds the linear program of one gridpoint infeasible."""

    failing = 5

    def solve_stagewise_optim(self, i: int, *limits: object) -> list[float]:
        """Solve as the package does, except at one gridpoint."""
        found: list[float] = [np.nan, np.nan] if i == self.failing else super().solve_stagewise_optim(i, *limits)
        return found


class DividesByZero(FindsNothing):
    """A solver that meets a row without coefficients."""

    def solve_stagewise_optim(self, i: int, *limits: object) -> list[float]:
        """Divide by zero, as compiled code with checks does."""
        raise ZeroDivisionError("float division")


class Refuses(FindsNothing):
    """A solver that refuses the problem."""

    def solve_stagewise_optim(self, i: int, *limits: object) -> list[float]:
        """Raise the error of the package."""
        raise ToppraError("no")


@pytest.mark.long_table
@pytest.mark.parametrize("solver", [FindsNothing, DividesByZero, Refuses])
@pytest.mark.parametrize("kind", PROBLEMS)
def test_the_motion_with_limited_jerk_is_taken_where_the_solver_fails(
    kind: str, solver: type[FindsNothing], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The result was a FloatingPointError, and so the status 500."""
    problem = PROBLEMS[kind]
    fastest = plan(problem, Toppra())
    monkeypatch.setattr(reachability, "seidelWrapper", solver)
    result = plan(problem, Toppra(solver="package"))
    assert [warning.code for warning in result.warnings if warning.code == "solver_failed"] == ["solver_failed"]
    assert worst_ratio(result) <= 1.0 + 1e-6
    assert fastest.trajectory.duration < result.trajectory.duration
    assert result.trajectory.duration == plan(problem, Toppra(jerk_limited=True)).trajectory.duration


def test_a_duration_too_short_is_refused_where_the_solver_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reachability, "seidelWrapper", FindsNothing)
    problem: PlanningProblem = PROBLEMS["tool"]
    waypoints = [problem.waypoints[0], replace(problem.waypoints[1], duration=0.01), *problem.waypoints[2:]]
    with pytest.raises(InfeasibleDuration) as refusal:
        plan(replace(problem, waypoints=tuple(waypoints)), Toppra(solver="package"))
    (remedy,) = refusal.value.remedies
    waypoints[1] = replace(waypoints[1], duration=remedy.value)
    result = plan(replace(problem, waypoints=tuple(waypoints)), Toppra(solver="package"))
    assert result.trajectory.arrivals[1] == pytest.approx(remedy.value, rel=1e-9)
