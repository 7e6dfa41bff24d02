"""Joint positions outside a limit by the errors of encoders and rounding."""

from __future__ import annotations

import re

import numpy as np
import pytest

from planner.errors import InvalidProblem, JointPositionLimit, distinct
from planner.kinematics.options import InverseKinematicsOptions
from planner.planning import plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, RelativeWaypoint
from planner.robots import load_robot
from planner.waypoints.reachability import reachability
from tests.planner.problems_of_tests import ARMS

ROBOT = load_robot("kuka_kr16_2")
GOAL = (0.3, -1.0, 1.2, 0.1, 0.5, 0.2)


def start(beyond: float, joint: int = 0) -> tuple[float, ...]:
    position = np.array([0.1, -1.2, 1.4, 0.2, 0.6, -0.3])
    position[joint] = ROBOT.joints[joint].upper + beyond
    return tuple(position.tolist())


@pytest.mark.parametrize("beyond", [1e-15, 1e-12, 1e-9, 1e-6, 0.99e-4])
@pytest.mark.parametrize("arm", ARMS)
def test_a_start_beyond_a_limit_by_less_than_the_tolerance_is_at_the_limit(arm: str, beyond: float) -> None:
    robot = load_robot(arm)
    lower, upper = robot.limit("lower"), robot.limit("upper")
    limited = np.isfinite(upper - lower)
    outside = np.where(limited, upper * (1.0 + np.finfo(float).eps) + beyond, robot.middle)
    found = plan(PlanningProblem(robot, [JointWaypoint(position=outside), JointWaypoint(position=robot.middle)]))
    begin = found.trajectory.evaluate(0.0, [0])[0]
    assert (begin[limited] == upper[limited]).all()
    moved = np.flatnonzero(outside > upper)
    assert [warning.code for warning in found.warnings].count("position_snapped") == len(moved)
    assert found.certificate.satisfied


def test_any_joint_waypoint_is_snapped_and_a_line_goes_on_from_there() -> None:
    move = RelativeWaypoint(move=CartesianMove((0.0, 0.0, -0.05)), motion=LinearMotion())
    waypoints = [JointWaypoint(position=GOAL), JointWaypoint(position=start(1e-9)), move]
    found = plan(PlanningProblem(ROBOT, waypoints))
    assert found.path.positions[1][0] == ROBOT.joints[0].upper
    (warning,) = (warning for warning in found.warnings if warning.code == "position_snapped")
    values = re.findall(r"-?\d+\.\d+", warning.message)
    assert float(values[0]) != float(values[1])


def test_beyond_the_tolerance_it_is_refused_with_digits_that_differ() -> None:
    for tolerance, beyond in ((1e-4, 1.01e-4), (0.0, 1e-9), (1e-12, 1e-11)):
        waypoints = [JointWaypoint(position=start(beyond)), JointWaypoint(position=GOAL)]
        problem = PlanningProblem(ROBOT, waypoints, start_tolerance=tolerance)
        with pytest.raises(JointPositionLimit) as refusal:
            plan(problem)
        value, limit = re.findall(r"at (\S+), its limit is (\S+)", refusal.value.message)[0]
        assert float(value) > float(limit)
        (remedy,) = refusal.value.remedies
        assert plan(remedy.applied_to(problem)).certificate.satisfied


def test_a_negative_tolerance_is_refused() -> None:
    waypoints = [JointWaypoint(position=start(0.0)), JointWaypoint(position=GOAL)]
    with pytest.raises(InvalidProblem, match="start_tolerance"):
        plan(PlanningProblem(ROBOT, waypoints, start_tolerance=-1.0))


def test_reachability_agrees_with_plans() -> None:
    (answer,) = reachability(ROBOT, [JointWaypoint(position=start(1e-9))], InverseKinematicsOptions())
    assert answer.error is None


@pytest.mark.parametrize(("a", "b"), [(1.0, 1.0 + 1e-15), (3.14159265, 3.14159266), (1.0, 2.0), (-1e-300, 1e-300)])
def test_numbers_that_differ_are_told_apart(a: float, b: float) -> None:
    texts = distinct(a, b)
    assert texts[0] != texts[1]
    assert [float(text) for text in texts] == pytest.approx([a, b], rel=1e-5)
