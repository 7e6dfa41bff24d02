"""Remedies of durations that are too short all work; for a time scaling of fixed shape they are the smallest."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planner.backends import BACKENDS, Auto, Ruckig
from planner.backends.min_effort.program import Program
from planner.errors import InfeasibleDuration, JointPositionLimit, PlanningError, Remedy
from planner.limits import Limits
from planner.planning import plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint, RelativeWaypoint
from planner.problems.transitions import StopTransition, ThroughTransition
from planner.robots import Robot, load_robot
from planner.robots.payload import Payload
from tests.planner.problems_of_tests import backend_of, problem_of
from tests.planner.tool_problems import JOINTS, ROBOT

START, END = (0.0, -1.2, 1.2, 0.0, 0.5, 0.0), (1.0, -0.4, 0.9, 0.3, 0.4, 0.2)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return replace(load_robot("kuka_kr16_l6_2"), rated_payload=None)


def hurried(robot: Robot, duration: float, **changes: Any) -> PlanningProblem:
    waypoints = (JointWaypoint(position=START), JointWaypoint(position=END, duration=duration))
    return PlanningProblem(robot, waypoints, **changes)


def refused(problem: PlanningProblem, kind: str) -> dict[str, list[Remedy]]:
    """Return the remedies by their kind: duration, limits or payload."""
    with pytest.raises(InfeasibleDuration) as refusal:
        plan(problem, backend_of(kind))
    ways = defaultdict(list)
    for remedy in refusal.value.remedies:
        ways[str(remedy.field[2 if remedy.field[0] == "waypoints" else 0])].append(remedy)
    return ways


def applied(problem: PlanningProblem, remedies: list[Remedy], share: float = 1.0) -> PlanningProblem:
    """Return the problem with the remedies, or with a share of their values."""
    for remedy in remedies:
        problem = replace(remedy, value=remedy.value and share * remedy.value).applied_to(problem)
    return problem


@pytest.mark.long_table
@pytest.mark.parametrize("kind", sorted(BACKENDS))
def test_a_scale_is_raised_or_the_duration_is_longer(robot: Robot, kind: str) -> None:
    own = plan(hurried(robot, 60.0), backend_of(kind))
    assert own.trajectory.duration == pytest.approx(60.0)
    slow = hurried(robot, 1.9, limits=Limits(velocity_scale=0.2))
    ways = refused(slow, kind)
    assert [remedy.field for remedy in ways["limits"]] == [("limits", "velocity_scale")]
    for remedies in ways.values():
        assert plan(applied(slow, remedies), backend_of(kind)).certificate.satisfied
    assert plan(applied(slow, ways["limits"]), backend_of(kind)).trajectory.duration == pytest.approx(1.9)


@pytest.mark.parametrize(("kind", "peak"), [("cubic", 1.5), ("quintic", 1.875)])
def test_the_higher_velocity_is_the_peak_of_the_law(robot: Robot, kind: str, peak: float) -> None:
    slow = hurried(robot, 1.9, limits=Limits(velocity_scale=0.2))
    (remedy,) = refused(slow, kind)["limits"]
    travel = np.abs(np.subtract(END, START))
    assert remedy.value == pytest.approx((peak * travel / 1.9 / robot.limit("velocity")).max(), rel=1e-8)


def test_one_joint_s_limit_is_raised_and_one_at_a_waypoint(robot: Robot) -> None:
    velocity = robot.limit("velocity").tolist()
    velocity[0] = 0.5
    narrow = Limits(velocity=tuple(velocity))
    problem = hurried(robot, 1.9, limits=narrow)
    (remedy,) = refused(problem, "cubic")["limits"]
    assert remedy.field == ("limits", "velocity", 0)
    assert remedy.value == pytest.approx(1.5 / 1.9)
    waypoints = (problem.waypoints[0], replace(problem.waypoints[1], limits=narrow))
    at_waypoint = replace(problem, limits=Limits(), waypoints=waypoints)
    (remedy,) = refused(at_waypoint, "cubic")["limits"]
    assert remedy.field == ("waypoints", 1, "limits", "velocity", 0)
    assert plan(applied(at_waypoint, [remedy])).trajectory.duration == 1.9


def test_a_scale_goes_first_and_what_it_scales_after_it(robot: Robot) -> None:
    velocity = robot.limit("velocity").tolist()
    velocity[0] = 0.5
    problem = hurried(robot, 1.9, limits=Limits(velocity=tuple(velocity), velocity_scale=0.9))
    value, scale = refused(problem, "cubic")["limits"]
    assert (scale.field, scale.value) == (("limits", "velocity_scale"), 1.0)
    assert (value.field, value.value) == (("limits", "velocity", 0), pytest.approx(1.5 / 1.9))


def test_where_the_robot_s_own_limits_are_at_fault_only_the_duration_helps(robot: Robot) -> None:
    for kind in ("cubic", "ruckig", "toppra"):
        assert set(refused(hurried(robot, 0.3), kind)) == {"duration"}


def test_auto_says_what_the_nearest_of_its_back_ends_needs(robot: Robot) -> None:
    auto, quintic, ruckig = (
        refused(hurried(robot, 1.9, limits=Limits(velocity_scale=0.2)), kind)["duration"][0].value
        for kind in ("auto", "quintic", "ruckig")
    )
    assert auto == ruckig < quintic


@pytest.mark.large_only
def test_a_tool_speed_on_a_line(robot: Robot) -> None:
    start = plan(hurried(robot, 3.0)).path.waypoints[0].pose
    end = PoseWaypoint(pose=replace(start, position=start.position + np.array([0.0, 0.3, 0.0])), motion=LinearMotion())
    first = JointWaypoint(position=START)
    for kind in ("quintic", "ruckig", "toppra"):
        problem = PlanningProblem(robot, (first, replace(end, duration=2.0)), limits=Limits(tcp_linear_velocity=0.1))
        ways = refused(problem, kind)
        (remedy,) = ways["limits"]
        assert remedy.field == ("limits", "tcp_linear_velocity")
        # 0.3 m in 2 s take 0.15 m/s on average, and no more than the quintic's peak.
        assert 0.15 < remedy.value <= 1.01 * 0.15 * 1.875
        assert plan(applied(problem, [remedy]), backend_of(kind)).trajectory.duration == pytest.approx(2.0)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", sorted(set(BACKENDS) - {"auto"}))
def test_what_stands_against_a_duration_is_named(robot: Robot, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """One search at most, remedies included: least effort took up to 32 s, as it searched in each proof."""
    searches: list[Program] = []
    solve = Program.solve
    monkeypatch.setattr(Program, "solve", lambda self, *rest: searches.append(self) or solve(self, *rest))
    weak = robot.limit("torque") * [0.02, 1.0, 1.0, 1.0, 1.0, 1.0]
    for limits, cause in (
        (Limits(tcp_linear_velocity=0.1), "the limit of the tool's speed"),
        (Limits(tcp_angular_velocity=0.1), "the limit of the tool's angular speed"),
        (Limits(torque=tuple(weak.tolist())), "the torque limit of joint_a1"),
        (Limits(velocity_scale=0.1), "(the velocity limit of|the limits of) joint_a1"),
    ):
        searches.clear()
        with pytest.raises(InfeasibleDuration, match=cause) as refusal:
            plan(hurried(robot, 1.2, limits=limits), backend_of(kind))
        assert len(searches) <= 1
        assert refusal.value.segment == 0
        joint = re.search("joint_a.", cause)
        assert refusal.value.joint == (joint and joint.group())


@pytest.mark.parametrize("kind", ["cubic", "quintic", "trapezoidal"])
def test_a_payload_too_heavy_for_the_haste(robot: Robot, kind: str) -> None:
    torque = (0.4 * robot.limit("torque")).tolist()
    problem = hurried(robot, 1.1, limits=Limits(torque=tuple(torque)), payload=Payload(30.0, (0.0, 0.0, 0.1)))
    light = replace(problem, payload=Payload(0.1, (0.0, 0.0, 0.1)))
    assert plan(light, backend_of(kind)).certificate.satisfied
    ways = refused(problem, kind)
    (remedy,) = ways["payload"]
    assert 0.1 < remedy.value < 30.0
    for remedies in ways.values():
        assert plan(applied(problem, remedies), backend_of(kind)).certificate.satisfied
    with pytest.raises(InfeasibleDuration):
        plan(applied(problem, [remedy], 1.02), backend_of(kind))


FIXED = {"cubic", "quintic"}
TIMES_SEGMENTS_PASSED = {"cubic", "quintic", "ruckig"}


@pytest.mark.long_table
@pytest.mark.parametrize("kind", ["cubic", "quintic", "trapezoidal", "ruckig", "toppra"])
@settings(max_examples=max(15, settings.default.max_examples // 40))
@given(data=st.data())
def test_every_remedy_works(kind: str, data: st.DataObject) -> None:
    """Random joint lists have scaled limits and durations, some too short, also when passed without stopping."""
    robot_id = data.draw(st.sampled_from(["kuka_kr16_l6_2", "date_sorting_arm", "three_dof_arm"]))
    problem = problem_of(robot_id, data.draw(st.integers(0, 2**32)), data.draw(st.integers(2, 5)))
    scales = Limits(velocity_scale=data.draw(st.floats(0.05, 1.0)), acceleration_scale=data.draw(st.floats(0.05, 1.0)))
    waypoints = list(problem.waypoints)
    if kind in TIMES_SEGMENTS_PASSED:
        for k in range(1, len(waypoints) - 1):
            transition = data.draw(st.sampled_from([StopTransition(), ThroughTransition()]))
            waypoints[k] = replace(waypoints[k], transition=transition)
    problem = replace(problem, limits=scales, waypoints=tuple(waypoints))
    try:
        took = np.diff(plan(problem, backend_of(kind)).trajectory.arrivals)
    except JointPositionLimit:
        assume(False)
    for k, seconds in enumerate(took, 1):
        hurry = data.draw(st.sampled_from([None, 0.5, 0.9, 1.5]))
        if hurry is not None:
            waypoints[k] = replace(waypoints[k], duration=hurry * float(seconds))
    problem = replace(problem, waypoints=tuple(waypoints))
    try:
        plan(problem, backend_of(kind))
    except InfeasibleDuration:
        ways = refused(problem, kind)
    except JointPositionLimit:
        return
    else:
        return
    assert "duration" in ways
    for remedies in ways.values():
        assert plan(applied(problem, remedies), backend_of(kind)).certificate.satisfied
    at_rest = all(isinstance(waypoint.transition, StopTransition) for waypoint in waypoints)
    if kind in FIXED and at_rest and "limits" in ways:
        for omitted in range(len(ways["limits"])):
            others = ways["limits"][:omitted] + ways["limits"][omitted + 1 :]
            with pytest.raises(PlanningError):
                plan(applied(applied(problem, others), [ways["limits"][omitted]], 1.0 - 1e-3), backend_of(kind))


def test_durations_that_leave_no_time_for_a_segment_are_refused_without_limits_that_would_do() -> None:
    """The whole must take as long as its first segment alone: no limit is high enough for the second."""
    waypoints = [JOINTS[0], replace(JOINTS[2], duration=0.15), JointWaypoint(JOINTS[1].position)]
    with pytest.raises(InfeasibleDuration) as refusal:
        plan(PlanningProblem(ROBOT, waypoints, duration=0.15), Ruckig())
    assert not any("limits" in remedy.field for remedy in refusal.value.remedies)


def test_splines_whose_free_durations_would_grow_without_end_are_refused() -> None:
    """Beside a duration of 0.16 s that its limits do not allow, the other duration overflowed."""
    robot = load_robot("three_dof_arm")
    start = JointWaypoint((0.31953069095795916, 0.03688619503611301, 1.1314518954641293))
    step = CartesianMove((-0.011159561774841509, 0.005470352103030239, -0.04318230500155012))
    passed = RelativeWaypoint(step, "base", transition=ThroughTransition(), duration=0.15590580163346132)
    end = JointWaypoint((0.3235434349890596, 0.04178959256154402, 1.1321295645753966))
    limits = Limits(
        velocity=(2.005080322938322, 1.5974414823152285, 2.868386814322588),
        jerk=(101.31918647878649, 102.65299667527043, 143.14415791380762),
        tcp_linear_velocity=0.05864771024737503,
    )
    with pytest.raises(InfeasibleDuration):
        plan(PlanningProblem(robot, (start, passed, end), limits), Auto())
