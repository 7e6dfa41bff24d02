"""Tool speed limits of the whole trajectory and of a waypoint: the smaller one applies."""

from __future__ import annotations

import pytest

import planner


@pytest.mark.parametrize(("whole", "own"), [(0.25, 0.1), (0.1, 0.25)])
def test_the_smaller_of_two_limits_of_the_tool_speed_holds(whole: float, own: float) -> None:
    robot = planner.load_robot("ur5e")
    limited = planner.Limits(tcp_linear_velocity=own)
    points = [planner.JointWaypoint([0.0, -1.5, 1.0, 0.0, 0.5, 0.0]), planner.JointWaypoint([1.0] * 6, limits=limited)]
    plan = planner.plan(planner.PlanningProblem(robot, points, limits=planner.Limits(tcp_linear_velocity=whole)))
    (check,) = [check for check in plan.certificate.checks if check.quantity == "tcp_linear_velocity"]
    assert check.limit == min(whole, own)
    assert check.peak <= min(whole, own) * (1.0 + 1e-9)
