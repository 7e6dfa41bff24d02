"""Plans of the splines that pass waypoints with requested velocities, beside the plans of Ruckig."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.backends import Auto, Cubic, Quintic, Ruckig
from planner.errors import InfeasibleDuration, JointPositionLimit, LimitsUnsatisfiable
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import ThroughTransition
from planner.robots import Robot, load_robot
from tests.planner.backends.passing_problems import POSITIONS, ROBOT, VELOCITY, passing_at
from tests.planner.backends.ruckig.ruckig_problems import assert_within_limits, durations_of
from tests.planner.problems_of_tests import ARMS, problem_of

SPLINES = [Cubic(), Quintic()]
CONTINUITY = {"cubic": "C1", "quintic": "C2"}
each_spline = pytest.mark.parametrize("backend", SPLINES, ids=lambda backend: backend.kind)


def within_limits(made: Plan, backend: Cubic | Quintic) -> None:
    """Assert limits by dense samples; a cubic keeps no jerk limit."""
    if backend.kind == "quintic":
        assert_within_limits(made)
        return
    trajectory, limits = made.trajectory, made.path.limits
    times = np.linspace(0.0, trajectory.duration, 4000)
    q, v, a = trajectory.evaluate(times, [0, 1, 2])
    segments = trajectory.segments[np.searchsorted(trajectory.breakpoints[1:-1], times, side="right")]
    assert (np.abs(v) <= limits.velocity.narrower[segments] * (1.0 + 1e-9)).all()
    assert (np.abs(a) <= limits.acceleration.narrower[segments] * (1.0 + 1e-9)).all()
    assert ((q >= limits.position.lower - 1e-9) & (q <= limits.position.upper + 1e-9)).all()


def passes(made: Plan, waypoint: int, velocity: np.ndarray) -> None:
    """Assert the waypoint's position and, by differences of positions just before and after it, its velocity."""
    at, trajectory, step = made.trajectory.arrivals[waypoint], made.trajectory, 1e-6
    q = trajectory.evaluate(at + step * np.array([-1.0, 0.0, 1.0]), [0])[0]
    slack = 10.0 * step * made.path.limits.acceleration.narrower[waypoint - 1 : waypoint + 1].max(axis=0) + 1e-8
    assert (np.abs(np.diff(q, axis=0) / step - velocity) <= slack).all()
    before, exact = (trajectory.evaluate(np.array([time]), [1])[0][0] for time in (np.nextafter(at, 0.0), at))
    scale = max(float(np.abs(velocity).max()), 1e-3)
    assert np.abs([before - velocity, exact - velocity]).max() <= 1e-8 * scale


@each_spline
def test_it_is_passed_at_the_velocity_asked_as_smoothly_as_the_back_end_promises(backend: Cubic | Quintic) -> None:
    made = plan(passing_at(VELOCITY), backend)
    passes(made, 1, np.array(VELOCITY))
    within_limits(made, backend)
    assert made.certificate.continuity == CONTINUITY[backend.kind]
    (check,) = [check for check in made.certificate.checks if check.quantity == "passing_velocity_error"]
    assert check.enforced
    assert check.satisfied


def test_the_quintic_has_no_acceleration_there_and_is_no_faster_than_the_fastest_between_these_states() -> None:
    made = plan(passing_at(VELOCITY), Quintic())
    at = made.trajectory.arrivals[1]
    for time in (np.nextafter(at, 0.0), at):
        assert np.abs(made.trajectory.evaluate(np.array([time]), [2])[0]).max() <= 1e-6
    fastest = durations_of(plan(passing_at(VELOCITY), Ruckig()))
    assert (durations_of(made) >= fastest * (1.0 - 1e-9)).all()
    assert made.trajectory.duration <= 1.4 * fastest.sum()


@settings(max_examples=settings.default.max_examples // 4)
@given(seed=st.integers(0, 2**32), backend=st.sampled_from(SPLINES), data=st.data())
def test_any_velocity_is_kept_or_refused_for_what_is_in_its_way(
    seed: int, backend: Cubic | Quintic, data: st.DataObject
) -> None:
    count = data.draw(st.integers(3, 5))
    problem = problem_of(data.draw(st.sampled_from(ARMS)), seed, count, 10.0 ** data.draw(st.floats(-4.0, 0.0)))
    robot, waypoints, requested = problem.robot, list(problem.waypoints), {}
    for k in range(1, count - 1):
        shares = data.draw(st.lists(st.floats(-0.2, 0.2), min_size=robot.dof, max_size=robot.dof))
        velocity = np.array(shares) * robot.limit("velocity") * 10.0 ** data.draw(st.floats(-2.0, 0.0))
        if data.draw(st.booleans()) and velocity.any():
            requested[k] = velocity
        waypoints[k] = replace(waypoints[k], transition=ThroughTransition(requested.get(k)))
    is_timed = data.draw(st.booleans())
    if is_timed:
        waypoints[1] = replace(waypoints[1], duration=data.draw(st.sampled_from([0.5, 3.0, 30.0])))
    speed = data.draw(st.sampled_from([None, None, None, 0.3]))
    problem = replace(problem, waypoints=tuple(waypoints), limits=Limits(tcp_linear_velocity=speed))
    try:
        made = plan(problem, backend)
    except (JointPositionLimit, InfeasibleDuration, LimitsUnsatisfiable) as refusal:
        # Without velocities and durations a smooth spline can still swing beyond a position limit.
        assert requested or is_timed or isinstance(refusal, JointPositionLimit)
        assert requested or isinstance(refusal, JointPositionLimit) or refusal.remedies
        return
    within_limits(made, backend)
    for k, velocity in requested.items():
        passes(made, k, velocity)


def test_slow_velocities_that_ruckig_passes_are_passed() -> None:
    """Velocities are up to a tenth of the limits between random positions, where no spline reaches a position limit."""
    rng = np.random.default_rng(4)
    for arm in sorted(ARMS):
        problem = problem_of(arm, int(rng.integers(2**32)), 4, 0.3)
        velocities = rng.uniform(-0.1, 0.1, (2, problem.robot.dof)) * problem.robot.limit("velocity")
        inner = [
            replace(waypoint, transition=ThroughTransition(tuple(velocity)))
            for waypoint, velocity in zip(problem.waypoints[1:-1], velocities, strict=True)
        ]
        problem = replace(problem, waypoints=(problem.waypoints[0], *inner, problem.waypoints[-1]))
        for backend in (*SPLINES, Ruckig()):
            made = plan(problem, backend)
            for k, velocity in enumerate(velocities, 1):
                passes(made, k, velocity)


@each_spline
def test_waypoints_at_one_position_are_passed_as_one(backend: Cubic | Quintic) -> None:
    start, middle, end = passing_at(VELOCITY).waypoints
    made = plan(PlanningProblem(ROBOT, [start, middle, middle, end]), backend)
    passes(made, 1, np.array(VELOCITY))
    passes(made, 2, np.array(VELOCITY))
    once = plan(passing_at(VELOCITY), backend)
    assert made.trajectory.duration == pytest.approx(once.trajectory.duration)


@each_spline
def test_after_a_stop_velocities_are_asked_again(backend: Cubic | Quintic) -> None:
    """Two segment groups with velocities and a straight motion between them."""
    start, middle, end = passing_at(VELOCITY).waypoints
    back = replace(middle, transition=ThroughTransition(tuple(-x for x in VELOCITY)))
    far = JointWaypoint(tuple(np.array(POSITIONS[2]) + 0.1))
    made = plan(PlanningProblem(ROBOT, [start, middle, end, far, back, start]), backend)
    passes(made, 1, np.array(VELOCITY))
    passes(made, 4, -np.array(VELOCITY))
    within_limits(made, backend)


@each_spline
@pytest.mark.parametrize("share", [1.0, -1.0])
def test_a_velocity_at_its_limit_is_had_with_and_against_the_motion(backend: Cubic | Quintic, share: float) -> None:
    velocity = tuple((share * ROBOT.limit("velocity") * np.eye(6)[0]).tolist())
    made = plan(passing_at(velocity), backend)
    passes(made, 1, np.array(velocity))
    within_limits(made, backend)


def along_a_wave(robot: Robot, count: int) -> PlanningProblem:
    """Return points on a smooth curve, all of them passed with its direction."""
    u = np.linspace(0.0, 2.0 * np.pi, count)[:, None]
    phases = np.arange(robot.dof)
    q, dq = robot.middle + 0.4 * np.sin(u + phases), 0.4 * np.cos(u + phases)
    speed = 0.2 * robot.limit("velocity").min() / 0.4
    passed = [
        JointWaypoint(tuple(p), transition=ThroughTransition(tuple(speed * d))) for p, d in zip(q, dq, strict=True)
    ]
    return PlanningProblem(robot, [JointWaypoint(tuple(q[0])), *passed[1:-1], JointWaypoint(tuple(q[-1]))])


@each_spline
def test_300_points_are_passed_with_velocities(backend: Cubic | Quintic) -> None:
    problem = along_a_wave(ROBOT, 300)
    made = plan(problem, backend)
    for k in (1, 57, 150, 298):
        passes(made, k, np.array(problem.waypoints[k].transition.velocity))
    within_limits(made, backend)


@each_spline
def test_a_duration_of_the_whole_and_least_ones_keep_the_velocity(backend: Cubic | Quintic) -> None:
    problem = passing_at(VELOCITY)
    fastest = plan(problem, backend).trajectory.duration
    whole = plan(replace(problem, duration=1.2 * fastest), backend)
    assert whole.trajectory.duration == pytest.approx(1.2 * fastest)
    passes(whole, 1, np.array(VELOCITY))
    start, middle, end = problem.waypoints
    least = plan(replace(problem, waypoints=(start, replace(middle, minimum_duration=0.9), end)), backend)
    assert durations_of(least)[0] == pytest.approx(0.9)
    passes(least, 1, np.array(VELOCITY))


@each_spline
def test_a_duration_that_is_too_short_is_refused_with_the_shortest(backend: Cubic | Quintic) -> None:
    start, middle, end = passing_at(VELOCITY).waypoints
    problem = PlanningProblem(ROBOT, [start, replace(middle, duration=0.3), end])
    with pytest.raises(InfeasibleDuration, match=r"segment 0 cannot be done in 0\.3 s") as refusal:
        plan(problem, backend)
    (remedy,) = [remedy for remedy in refusal.value.remedies if remedy.field == ("waypoints", 1, "duration")]
    assert remedy.value == pytest.approx(durations_of(plan(passing_at(VELOCITY), backend))[0], rel=1e-3)
    assert plan(remedy.applied_to(problem), backend).certificate.satisfied


@each_spline
def test_a_tool_speed_that_the_velocity_exceeds_is_named(backend: Cubic | Quintic) -> None:
    problem = passing_at(VELOCITY, limits=Limits(tcp_linear_velocity=0.1))
    with pytest.raises(
        LimitsUnsatisfiable, match=r"waypoint 1 with the requested velocity .* the tool's speed"
    ) as refusal:
        plan(problem, backend)
    (remedy,) = refusal.value.remedies
    assert remedy.field == ("waypoints", 1, "transition", "velocity")
    assert plan(remedy.applied_to(problem), backend).certificate.satisfied


@each_spline
def test_a_velocity_towards_a_limit_that_is_too_near_is_refused_for_it(backend: Cubic | Quintic) -> None:
    robot = load_robot("kuka_kr16_2")
    near = robot.middle.copy()
    near[0] = robot.joints[0].upper - 1e-3
    velocity = tuple((0.9 * robot.limit("velocity") * np.eye(6)[0]).tolist())
    start, passed = (
        JointWaypoint(tuple(robot.middle)),
        JointWaypoint(tuple(near), transition=ThroughTransition(velocity)),
    )
    problem = PlanningProblem(robot, [start, passed, start])
    with pytest.raises((JointPositionLimit, LimitsUnsatisfiable), match="waypoint 1 with the requested") as refusal:
        plan(problem, backend)
    assert refusal.value.joint == robot.joint_names[0]
    assert refusal.value.segment == 1
    (remedy,) = refusal.value.remedies
    assert plan(remedy.applied_to(problem), backend).certificate.satisfied


def test_auto_takes_the_quintic_where_ruckig_refuses(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise LimitsUnsatisfiable("not today")

    monkeypatch.setattr(Ruckig, "parametrize", refuse)
    made = plan(passing_at(VELOCITY), Auto())
    assert made.trajectory.warnings[-1].message.startswith("quintic: it passes waypoints with the requested velocities")
    passes(made, 1, np.array(VELOCITY))


def test_a_duration_too_short_beside_longer_segments_is_refused_for_itself() -> None:
    """Longer neighbours made the spline swing ever further, until it was refused as too far to check."""
    positions = (
        (0.8606, -1.4465, -2.8841, -3.0377, 1.9683, 2.5934),
        (0.8415, -1.1576, -2.5683, -2.4606, 1.97, 2.0216),
        (0.9991, -1.5949, -2.4514, -2.9378, 1.9997, 2.3601),
        (0.6487, -1.3504, -2.8921, -2.97, 1.8787, 2.4266),
        (0.847, -1.3749, -2.2833, -2.4319, 1.8881, 2.4286),
    )
    start, first, *others, end = map(JointWaypoint, positions)
    passed = [replace(first, duration=0.5), *others]
    waypoints = (start, *(replace(waypoint, transition=ThroughTransition()) for waypoint in passed), end)
    problem = PlanningProblem(load_robot("ngv_refuelling_arm"), waypoints, Limits(tcp_linear_velocity=0.3))
    with pytest.raises(InfeasibleDuration) as refused:
        plan(problem, Cubic())
    assert refused.value.value == 0.5
