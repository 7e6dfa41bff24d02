"""The closed-form back ends against the boundary conditions, bisection, Ruckig and dense samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ruckig

from planner.backends import BACKENDS, Cubic, Quintic, Trapezoidal
from planner.dynamics import inverse_dynamics
from planner.errors import InfeasibleDuration, LimitsUnsatisfiable, MissingDynamics
from planner.kinematics import tool_speeds
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.robots import Joint, load_robot
from planner.robots.payload import Payload
from planner.trajectories.trajectory import Trajectory
from tests.planner.problems_of_tests import ARMS, problem_of

KINDS = ("cubic", "quintic", "trapezoidal")


def boundary_polynomial(order: int, duration: float, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Solve the boundary conditions, all derivatives 0 at both ends, for ascending coefficients (order, joints)."""
    rows, values = [], []
    for k in range(order // 2):
        for time, position in ((0.0, start), (duration, end)):
            powers = np.array(
                [np.prod(np.arange(n, n - k, -1)) * time ** (n - k) if n >= k else 0.0 for n in range(order)]
            )
            rows.append(powers)
            values.append(position if k == 0 else np.zeros_like(position))
    return np.linalg.solve(np.array(rows), np.array(values))


@pytest.mark.parametrize(("backend", "order"), [(Cubic(), 4), (Quintic(), 6)])
@pytest.mark.parametrize("robot_id", ARMS)
def test_polynomials_solve_the_boundary_conditions(backend: Cubic | Quintic, order: int, robot_id: str) -> None:
    problem = problem_of(robot_id, 3, 6)
    result = plan(problem, backend)
    for i, duration in enumerate(result.trajectory.lengths):
        start, end = (np.array(w.position) for w in problem.waypoints[i : i + 2])
        expected = boundary_polynomial(order, duration, start, end)
        assert pytest.approx(expected, rel=1e-8, abs=1e-9) == result.trajectory.coefficients[i].T


def shape_peaks(kind: str, duration: float) -> tuple[float, float, float]:
    """Return peak velocity, acceleration and jerk of unit travel in `duration`, from numpy's own polynomials."""
    order = {"cubic": 4, "quintic": 6}[kind]
    coefficients = boundary_polynomial(order, 1.0, np.zeros(1), np.ones(1))[:, 0]
    law = np.polynomial.Polynomial(coefficients)
    tau = np.linspace(0.0, 1.0, 20001)
    peaks = [np.abs(law.deriv(k)(tau)).max() / duration**k for k in (1, 2, 3)]
    return peaks[0], peaks[1], peaks[2]


@pytest.mark.long_table
@pytest.mark.parametrize("kind", ["cubic", "quintic"])
@pytest.mark.parametrize("robot_id", ["ngv_refuelling_arm", "three_dof_arm"])
@pytest.mark.parametrize("scale", [1e-4, 1e-2, 1.0])
def test_shortest_duration_is_what_bisection_finds(kind: str, robot_id: str, scale: float) -> None:
    problem = problem_of(robot_id, 11, 4, scale)
    robot = problem.robot
    lengths = plan(problem, BACKENDS[kind]()).trajectory.lengths
    for i, found in enumerate(lengths):
        travel = np.abs(np.subtract(problem.waypoints[i + 1].position, problem.waypoints[i].position))

        def keeps(duration: float, travel: np.ndarray = travel) -> bool:
            velocity, acceleration, jerk = shape_peaks(kind, duration)
            kept = (travel * velocity <= robot.limit("velocity")).all()
            kept = kept and (travel * acceleration <= robot.limit("acceleration")).all()
            return bool(kept and (kind == "cubic" or (travel * jerk <= robot.limit("jerk")).all()))

        low, high = 1e-9, 1e4
        for _ in range(80):
            middle = np.sqrt(low * high)
            low, high = (low, middle) if keeps(middle) else (middle, high)
        assert found == pytest.approx(high, rel=1e-6)


@pytest.mark.parametrize("scale", [1e-4, 1e-2, 0.3, 1.0])
def test_fastest_trapezoid_is_as_fast_as_ruckig_without_a_jerk_limit(scale: float) -> None:
    problem = problem_of("ngv_refuelling_arm", 5, 6, scale)
    robot = problem.robot
    for i, found in enumerate(segment_durations(plan(problem, Trapezoidal()).trajectory)):
        travel = np.subtract(problem.waypoints[i + 1].position, problem.waypoints[i].position)
        # One degree of freedom along the segment: a straight joint motion.
        target = ruckig.InputParameter(1)
        target.current_position, target.target_position = [0.0], [1.0]
        target.max_velocity = [float((robot.limit("velocity") / np.abs(travel)).min())]
        target.max_acceleration = [float((robot.limit("acceleration") / np.abs(travel)).min())]
        target.max_jerk = [float("inf")]
        peer = ruckig.Trajectory(1)
        assert ruckig.Ruckig(1).calculate(target, peer) == ruckig.Result.Working
        assert found == pytest.approx(peer.duration, rel=1e-6)


def segment_durations(trajectory: Trajectory) -> np.ndarray:
    return trajectory.arrivals[1:] - trajectory.departures[:-1]


@pytest.mark.parametrize(("t1", "t3"), [(0.4, 0.4), (0.2, 0.7), (1.0, 0.1)])
def test_trapezoid_with_times_integrates_its_accelerations(t1: float, t3: float) -> None:
    """Constant a1 for t1, zero, then constant -a3 for t3, integrated by hand, must end at rest."""
    problem = problem_of("ngv_refuelling_arm", 7, 2, 0.1)
    waypoints = (problem.waypoints[0], replace(problem.waypoints[1], duration=2.5))
    result = plan(replace(problem, waypoints=waypoints), Trapezoidal(t1, t3))
    start, end = (np.array(w.position) for w in waypoints)
    velocity = (end - start) / (2.5 - t1 / 2 - t3 / 2)
    for t in np.linspace(0.0, 2.5, 101):
        ramp_up = min(t, t1)
        cruise = min(max(t - t1, 0.0), 2.5 - t1 - t3)
        ramp_down = max(t - (2.5 - t3), 0.0)
        expected = start + velocity * (ramp_up**2 / (2 * t1) + cruise + ramp_down - ramp_down**2 / (2 * t3))
        assert result.trajectory.evaluate(np.array([t]), [0])[0][0] == pytest.approx(expected, abs=1e-12)


def test_trapezoid_times_choose_the_shortest_cruise() -> None:
    """With fixed ramps, the shortest duration just reaches a velocity or acceleration limit."""
    problem = problem_of("ngv_refuelling_arm", 7, 5)
    result = plan(problem, Trapezoidal(acceleration_time=0.3))
    ratios = {check.quantity: check.ratio for check in result.certificate.checks}
    assert max(ratios["velocity"] or 0.0, ratios["acceleration"] or 0.0) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_given_durations_are_kept_exactly_and_dwells_rest(kind: str) -> None:
    problem = problem_of("ngv_refuelling_arm", 9, 4, 0.2)
    durations, dwells = [3.7, 4.45, 6.1], [1.5, 0.0, 10.0, 2.0]
    waypoints = tuple(
        replace(waypoint, duration=([None, *durations])[i], dwell=dwells[i])
        for i, waypoint in enumerate(problem.waypoints)
    )
    trajectory = plan(replace(problem, waypoints=waypoints), BACKENDS[kind]()).trajectory
    assert trajectory.duration == pytest.approx(sum(durations) + sum(dwells), abs=1e-12)
    assert segment_durations(trajectory) == pytest.approx(durations, abs=1e-12)
    assert trajectory.departures - trajectory.arrivals == pytest.approx(dwells, abs=1e-12)
    for i, waypoint in enumerate(waypoints):
        resting = np.linspace(trajectory.arrivals[i], trajectory.departures[i], 7)
        position, velocity = trajectory.evaluate(resting, [0, 1])
        assert position == pytest.approx(np.tile(waypoint.position, (7, 1)), abs=1e-12)
        assert velocity == pytest.approx(np.zeros((7, 6)), abs=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_a_duration_too_short_is_refused_with_a_remedy_that_works(kind: str) -> None:
    problem = problem_of("ngv_refuelling_arm", 13, 4)
    hurried = tuple(replace(w, duration=0.05) if i in (1, 3) else w for i, w in enumerate(problem.waypoints))
    with pytest.raises(InfeasibleDuration) as refusal:
        plan(replace(problem, waypoints=hurried), BACKENDS[kind]())
    error = refusal.value
    assert (error.waypoint, error.segment, error.value) == (1, 0, 0.05)
    assert error.joint in problem.robot.joint_names
    assert [remedy.field for remedy in error.remedies] == [("waypoints", 1, "duration"), ("waypoints", 3, "duration")]
    mended = list(hurried)
    for remedy, i in zip(error.remedies, (1, 3), strict=True):
        mended[i] = replace(mended[i], duration=remedy.value)
    assert plan(replace(problem, waypoints=tuple(mended)), BACKENDS[kind]()).certificate.satisfied
    mended[1] = replace(mended[1], duration=error.remedies[0].value * (1.0 - 1e-6))
    with pytest.raises(InfeasibleDuration):
        plan(replace(problem, waypoints=tuple(mended)), BACKENDS[kind]())


def worst_on_dense_samples(result: Plan, quantity: str) -> float:
    """Return the largest value over its limit on 4,000 samples, without the certificate."""
    times = np.linspace(0.0, result.trajectory.duration, 4001)
    position, velocity, acceleration = result.trajectory.evaluate(times)
    if quantity == "torque":
        torque = np.abs(inverse_dynamics(result.path.robot, position, velocity, acceleration))
        return float((torque / result.path.limits.torque.narrower[0]).max())
    linear, angular = tool_speeds(result.path.robot, position, velocity)
    speeds = linear if quantity == "tcp_linear_velocity" else angular
    return float(speeds.max() / result.path.limits.magnitudes(quantity)[0, 0])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("quantity", ["tcp_linear_velocity", "tcp_angular_velocity"])
def test_tool_speed_limits_are_kept_and_used(kind: str, quantity: str) -> None:
    problem = replace(problem_of("ngv_refuelling_arm", 17, 4), limits=Limits(**{quantity: 0.25}))
    result = plan(problem, BACKENDS[kind]())
    assert 0.99 < worst_on_dense_samples(result, quantity) <= 1.0


@pytest.mark.parametrize("kind", KINDS)
def test_torque_limits_are_kept_and_used(kind: str) -> None:
    problem = replace(problem_of("kuka_kr16_l6_2", 19, 3), payload=Payload(6.0, (0.0, 0.0, 0.1)))
    free = plan(problem, BACKENDS[kind]())
    # The limit is slightly above the torque of gravity alone: the motion must become slow.
    still = np.zeros((2001, 6))
    times = np.linspace(0.0, free.trajectory.duration, 2001)
    gravity = np.abs(inverse_dynamics(free.path.robot, free.trajectory.evaluate(times, [0])[0], still, still)).max(0)
    torque = tuple(np.minimum(1.05 * gravity + 5.0, problem.robot.limit("torque")).tolist())
    result = plan(replace(problem, limits=Limits(torque=torque)), BACKENDS[kind]())
    assert 0.98 < worst_on_dense_samples(result, "torque") <= 1.0
    assert result.trajectory.duration > free.trajectory.duration


def test_gravity_beyond_the_torque_limit_is_refused() -> None:
    problem = problem_of("kuka_kr16_l6_2", 19, 3)
    with pytest.raises(LimitsUnsatisfiable) as refusal:
        plan(replace(problem, limits=Limits(torque=(1.0,) * 6)))
    assert refusal.value.joint is not None
    assert refusal.value.value > refusal.value.limit == 1.0


def test_a_torque_limit_that_nobody_can_check_is_refused() -> None:
    problem = problem_of("ngv_refuelling_arm", 19, 3)
    requested = Limits(torque=(100.0,) * 6)
    with pytest.raises(MissingDynamics):
        plan(replace(problem, limits=requested))
    own = (*problem.waypoints[:-1], replace(problem.waypoints[-1], limits=requested))
    with pytest.raises(MissingDynamics):
        plan(replace(problem, waypoints=own))
    carrying = plan(replace(problem, limits=requested, payload=Payload(1.0)))
    assert worst_on_dense_samples(carrying, "torque") <= 1.0


def test_a_limit_asked_that_the_back_end_only_reports_comes_with_a_warning() -> None:
    problem = problem_of("ngv_refuelling_arm", 19, 3)
    requested = replace(problem, limits=Limits(jerk=(1.0,) * 6))
    assert [warning.code for warning in plan(requested).warnings] == ["position_unchecked", "jerk_not_enforced"]
    assert [warning.code for warning in plan(problem).warnings] == ["position_unchecked"]
    assert plan(problem).warnings == plan(requested, Quintic()).warnings


@pytest.mark.parametrize("kind", KINDS)
def test_a_duration_too_short_for_the_tool_speed_is_refused_with_a_remedy_that_works(kind: str) -> None:
    problem = replace(problem_of("ngv_refuelling_arm", 17, 3), limits=Limits(tcp_linear_velocity=0.25))
    hurried = (problem.waypoints[0], replace(problem.waypoints[1], duration=4.0), problem.waypoints[2])
    assert plan(problem, BACKENDS[kind]()).trajectory.arrivals[1] > 4.0
    with pytest.raises(InfeasibleDuration) as refusal:
        plan(replace(problem, waypoints=hurried), BACKENDS[kind]())
    assert refusal.value.joint is None
    remedy, *_ = refusal.value.remedies
    mended = (hurried[0], replace(hurried[1], duration=remedy.value), hurried[2])
    assert plan(replace(problem, waypoints=mended), BACKENDS[kind]()).certificate.satisfied


def test_a_segment_that_nothing_limits_needs_a_duration() -> None:
    robot = load_robot("three_dof_arm")
    unlimited = replace(robot, joints=tuple(Joint(joint.name, joint.kind) for joint in robot.joints))
    waypoints = (JointWaypoint(position=(0.0, 0.0, 0.0)), JointWaypoint(position=(1.0, 0.0, 0.0)))
    for backend in (Cubic(), Quintic(), Trapezoidal()):
        with pytest.raises(LimitsUnsatisfiable) as refusal:
            plan(PlanningProblem(unlimited, waypoints), backend)
        assert refusal.value.remedies[0].field == ("waypoints", 1, "duration")
        timed = (waypoints[0], replace(waypoints[1], duration=refusal.value.remedies[0].value))
        assert plan(PlanningProblem(unlimited, timed), backend).trajectory.duration == 1.0


def test_a_ramp_of_a_millisecond_in_a_motion_of_an_hour_keeps_its_limits() -> None:
    """Its length must not be rounded as coarsely as the hour."""
    waypoints = (
        JointWaypoint(position=(0.8605556614246863, 0.13489335688, 0.02048676196, -3.03774645687452, 1.476, 2.593)),
        JointWaypoint(position=(0.6700123395200417, 0.36474828049, 0.27181249571, 2.7336406607023154, 1.488, -3.124)),
    )
    for scale in (0.01, 1e-3, 1e-4):
        for duration in (None, 1e6):
            timed = (waypoints[0], replace(waypoints[1], duration=duration))
            arm, limits = load_robot("date_sorting_arm"), Limits(velocity_scale=scale)
            result = plan(PlanningProblem(arm, timed, limits=limits), Trapezoidal())
            assert duration is None or result.trajectory.duration == duration


def test_a_trapezoid_under_a_limit_of_the_tools_speed_cruises_at_it() -> None:
    """The whole was stretched, ramps included: twice the time where it is mostly ramps."""
    problem = problem_of("kuka_kr16_l6_2", 0, 2, 0.3)
    free, slow = (
        plan(problem, Trapezoidal()),
        plan(replace(problem, limits=Limits(tcp_linear_velocity=0.1)), Trapezoidal()),
    )
    ratio = worst_on_dense_samples(replace_limits(free, slow), "tcp_linear_velocity")
    assert worst_on_dense_samples(slow, "tcp_linear_velocity") <= 1.0
    assert slow.trajectory.duration < 0.6 * ratio * free.trajectory.duration


def replace_limits(result: Plan, of: Plan) -> Plan:
    """Return the motion of one plan under the limits of another."""
    return replace(result, path=replace(result.path, limits=of.path.limits))
