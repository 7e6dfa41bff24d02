"""Waypoints passed with requested velocities, against the package's own motions from state to state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ruckig
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.backends import BACKENDS, Auto, Ruckig
from planner.errors import InfeasibleDuration, InvalidProblem, JointPositionLimit, LimitsUnsatisfiable
from planner.fields import FieldPath
from planner.limits import Limits
from planner.planning import plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, RelativeWaypoint
from planner.problems.transitions import ThroughTransition
from planner.robots import Robot
from tests.planner.backends.passing_problems import POSITIONS, ROBOT, VELOCITY, passing_at
from tests.planner.backends.ruckig.ruckig_problems import assert_within_limits, durations_of
from tests.planner.problems_of_tests import ARMS, problem_of


def least_time(robot: Robot, start: tuple[float, ...], end: tuple[float, ...], velocities: np.ndarray) -> float:
    """Return the least time between two states without acceleration, by the package ruckig in SI units."""
    target, output = ruckig.InputParameter(robot.dof), ruckig.Trajectory(robot.dof)
    target.current_position, target.target_position = list(start), list(end)
    target.current_velocity, target.target_velocity = velocities.tolist()
    target.max_velocity, target.max_acceleration = (robot.limit(q).tolist() for q in ("velocity", "acceleration"))
    target.max_jerk = robot.limit("jerk").tolist()
    ruckig.Ruckig(robot.dof).calculate(target, output)
    return float(output.duration)


@pytest.mark.parametrize("backend", [Ruckig(), Ruckig(synchronization="time"), Auto()], ids=repr)
def test_it_is_passed_at_the_velocity_asked_in_the_least_time_between_the_states(backend: Ruckig | Auto) -> None:
    result = plan(passing_at(VELOCITY), backend)
    before, after = (result.trajectory.arrivals[1] + shift for shift in (-1e-9, 1e-9))
    for time in (before, after):
        q, v = result.trajectory.evaluate(np.array([time]), [0, 1])
        assert q[0] == pytest.approx(np.array(POSITIONS[1]), abs=1e-8)
        assert v[0] == pytest.approx(np.array(VELOCITY), abs=1e-6)
    states = np.array([[0.0] * 6, VELOCITY, [0.0] * 6])
    least = [least_time(ROBOT, *POSITIONS[k : k + 2], states[k : k + 2]) for k in (0, 1)]
    assert durations_of(result) == pytest.approx(np.array(least), rel=1e-6)
    assert_within_limits(result)
    (check,) = [check for check in result.certificate.checks if check.quantity == "passing_velocity_error"]
    assert check.enforced
    assert check.satisfied


@settings(max_examples=settings.default.max_examples // 4)
@given(seed=st.integers(0, 2**32), data=st.data())
def test_any_velocity_is_kept_or_refused_for_what_is_in_its_way(seed: int, data: st.DataObject) -> None:
    """Segments and the tool have limits, two waypoints share a position, and durations are given."""
    count = data.draw(st.integers(3, 5))
    problem = problem_of(data.draw(st.sampled_from(ARMS)), seed, count, 10.0 ** data.draw(st.floats(-4.0, 0.0)))
    robot, waypoints, requested = problem.robot, list(problem.waypoints), {}
    for k in range(1, count - 1):
        velocity = None
        if data.draw(st.booleans()):
            shares = data.draw(st.lists(st.floats(-0.2, 0.2), min_size=robot.dof, max_size=robot.dof))
            velocity = np.array(shares) * robot.limit("velocity") * 10.0 ** data.draw(st.floats(-2.0, 0.0))
        if velocity is not None and velocity.any():
            requested[k] = velocity
        waypoints[k] = replace(waypoints[k], transition=ThroughTransition(requested.get(k)))
    if data.draw(st.booleans()):
        waypoints[1] = replace(waypoints[1], duration=data.draw(st.sampled_from([0.5, 3.0, 30.0])))
    speed = data.draw(st.sampled_from([None, None, None, 0.3]))
    problem = replace(problem, waypoints=tuple(waypoints), limits=Limits(tcp_linear_velocity=speed))
    try:
        result = plan(problem, Ruckig())
    except (JointPositionLimit, InfeasibleDuration, LimitsUnsatisfiable) as refusal:
        assert requested or (isinstance(refusal, InfeasibleDuration) and refusal.remedies)
        return
    assert_within_limits(result)
    for k, velocity in requested.items():
        (found,) = result.trajectory.evaluate(result.trajectory.arrivals[[k]], [1])
        assert found[0] == pytest.approx(velocity, abs=1e-6 * np.abs(velocity).max() + 1e-12)


@pytest.mark.parametrize("kind", sorted(BACKENDS.keys() - {"cubic", "quintic", "ruckig", "auto"}))
def test_other_back_ends_refuse_it_and_name_those_that_keep_it(kind: str) -> None:
    with pytest.raises(InvalidProblem, match="use ruckig, quintic or cubic to set them") as refusal:
        plan(passing_at(VELOCITY), BACKENDS[kind]())
    assert refusal.value.faults[0].field == ("waypoints", 1, "transition", "velocity")


def test_a_duration_of_the_whole_keeps_the_velocity() -> None:
    """The remaining time is spent before and after the waypoint, not by stretching the whole."""
    problem = passing_at(VELOCITY)
    fastest = plan(problem, Ruckig()).trajectory.duration
    trajectory = plan(replace(problem, duration=1.2 * fastest), Ruckig()).trajectory
    assert trajectory.duration == pytest.approx(1.2 * fastest)
    assert trajectory.evaluate(trajectory.arrivals[[1]], [1])[0][0] == pytest.approx(np.array(VELOCITY), abs=1e-6)


def test_a_velocity_beyond_a_limit_is_refused_with_one_that_is_kept() -> None:
    limit = ROBOT.limit("velocity")[1]
    problem = passing_at((0.0, 1.01 * limit, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(LimitsUnsatisfiable, match="joint_2 at waypoint 1") as refusal:
        plan(problem, Ruckig())
    (remedy,) = refusal.value.remedies
    assert remedy.field == ("waypoints", 1, "transition", "velocity")
    assert plan(remedy.applied_to(problem), Ruckig()).certificate.satisfied


def faults_of(problem: PlanningProblem) -> list[FieldPath]:
    with pytest.raises(InvalidProblem) as refusal:
        plan(problem, Ruckig())
    return [fault.field for fault in refusal.value.faults]


def test_what_cannot_be_passed_at_a_velocity_is_a_fault_of_its_field() -> None:
    field = ("waypoints", 1, "transition", "velocity")
    assert faults_of(passing_at((0.1, 0.2))) == [field]
    assert faults_of(passing_at((0.0,) * 6)) == [field]
    assert faults_of(passing_at((np.nan,) * 6)) == [field]
    start, middle, _ = passing_at(VELOCITY).waypoints
    line = RelativeWaypoint(CartesianMove((0.0, 0.05, 0.0)), "base", motion=LinearMotion())
    assert faults_of(PlanningProblem(ROBOT, [start, middle, line])) == [field]
    stop = JointWaypoint(POSITIONS[1])
    assert faults_of(PlanningProblem(ROBOT, [start, middle, stop, JointWaypoint(POSITIONS[2])])) == [field]
