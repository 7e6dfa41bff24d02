"""Limits of the tool's acceleration: checked against finite differences of its path, and against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.backends import BACKENDS, BackEnd, Quintic, Toppra, Trapezoidal
from planner.certificate import certify, certify_samples
from planner.errors import InfeasibleDuration
from planner.kinematics import forward_kinematics, tool_accelerations
from planner.kinematics.forward import TIGHTEST_BEND, tool_velocities
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import (
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.problems.transitions import ThroughTransition
from planner.robots import load_robot
from planner.spatial import FloatArray, Pose
from planner.trajectories.trajectory import Trajectory
from tests.planner.problems_of_tests import backend_of
from tests.planner.tool_problems import CORNER, JOINTS, LINE, ROBOT, START

LIMITS = Limits(tcp_linear_acceleration=1.5, tcp_angular_acceleration=2.0, tcp_centripetal_acceleration=0.8)
ALL: list[BackEnd] = [*(backend_of(kind) for kind in sorted(BACKENDS) if kind != "auto"), Toppra(jerk_limited=True)]


def differences(result: Plan, count: int = 500, step: float = 1e-4) -> dict[str, FloatArray]:
    """Return differences of tool positions and rotations at three times each, within one piece of the trajectory."""
    trajectory = result.trajectory
    middles = np.linspace(0.0, trajectory.duration, count + 2)[1:-1]
    pieces = trajectory.locate(np.array([middles - step, middles + step]).ravel())[0].reshape(2, -1)
    middles = middles[pieces[0] == pieces[1]]
    before, here, after = (
        forward_kinematics(result.path.robot, trajectory.evaluate(middles + shift, [0])[0])
        for shift in (-step, 0.0, step)
    )
    p = [np.array([pose.position for pose in poses]) for poses in (before, here, after)]
    velocity, acceleration = (p[2] - p[0]) / (2.0 * step), (p[2] - 2.0 * p[1] + p[0]) / step**2
    speed = np.linalg.norm(velocity, axis=1)
    moving = speed > 1e-3
    across = np.linalg.norm(np.cross(velocity, acceleration), axis=1)[moving] / speed[moving]
    return {
        "tcp_linear_acceleration": np.linalg.norm(acceleration, axis=1),
        "tcp_centripetal_acceleration": across,
        "tcp_angular_acceleration": np.linalg.norm(_turns(here, after) - _turns(before, here), axis=1) / step**2,
    }


def _turns(poses: list[Pose], others: list[Pose]) -> FloatArray:
    """Return the rotation vectors, for small angles, in the base's axes."""
    turns = [after.rotation @ before.rotation.T for before, after in zip(poses, others, strict=True)]
    return np.array([[r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]] for r in turns]) / 2.0


@pytest.mark.long_table
@pytest.mark.parametrize("waypoints", [JOINTS, CORNER], ids=["joints", "corner"])
@pytest.mark.parametrize("backend", ALL, ids=repr)
def test_finite_differences_are_within_the_limits(backend: BackEnd, waypoints: list[JointWaypoint]) -> None:
    result = plan(PlanningProblem(ROBOT, waypoints, LIMITS), backend)
    found = differences(result)
    checks = {check.quantity: check for check in result.certificate.checks}
    for quantity, values in found.items():
        assert values.max() <= getattr(LIMITS, quantity) * 1.001
        assert checks[quantity].peak == pytest.approx(values.max(), rel=0.02, abs=0.01)
        assert checks[quantity].enforced
    assert max(checks[quantity].ratio or 0.0 for quantity in found) > 0.97


@pytest.mark.parametrize(("backend", "loses"), [(Toppra(), 0.005), (Trapezoidal(), 0.1)], ids=repr)
def test_a_straight_line_is_driven_by_the_acceleration_of_the_tool(backend: BackEnd, loses: float) -> None:
    """Over 0.3 m at 1.5 m/s^2, without a binding speed limit: T = 2 sqrt(d / a), or more with ramps of joints."""
    result = plan(PlanningProblem(ROBOT, LINE, Limits(tcp_linear_acceleration=1.5)), backend)
    assert 1.0 - 1e-6 < result.trajectory.duration / (2.0 * np.sqrt(0.3 / 1.5)) < 1.0 + loses


def test_a_circle_is_driven_at_the_speed_that_its_radius_allows() -> None:
    """v^2 / r is 0.8 m/s^2 at most on a radius of 0.1 m: the tool cruises at 0.283 m/s."""
    start = forward_kinematics(ROBOT, np.array([START]))[0]
    via, end = (Pose(start.position + np.array(step)) for step in ([0.1, -0.1, 0.0], [0.0, -0.2, 0.0]))
    arc = [JointWaypoint(START), PoseWaypoint(Pose(end.position, start.rotation), motion=CircularMotion(via))]
    limits = Limits(tcp_centripetal_acceleration=0.8)
    for backend in (Toppra(), Toppra(jerk_limited=True), Trapezoidal()):
        trajectory = plan(PlanningProblem(ROBOT, arc, limits), backend).trajectory
        times = np.linspace(0.0, trajectory.duration, 501)
        tool = forward_kinematics(ROBOT, trajectory.evaluate(times, [0])[0])
        steps = np.linalg.norm(np.diff([pose.position for pose in tool], axis=0), axis=1)
        speeds = steps / np.diff(times)
        assert speeds.max() <= np.sqrt(0.8 * 0.1) * 1.001
        assert np.median(speeds) > 0.98 * np.sqrt(0.8 * 0.1)


@pytest.mark.large_only
def test_a_tool_that_almost_rests_keeps_its_centripetal_limit() -> None:
    """Samples missed the corner where the tightest bend begins to bound it: a plan was refused for 0.006 %."""
    robot, rng = load_robot("kuka_kr16_2"), np.random.default_rng(64)
    count, _, turn = int(rng.integers(8, 40)), rng.integers(3), rng.uniform(0.5, 6.0)
    angles = np.linspace(0.0, turn, count)[:, None] * rng.uniform(0.2, 1.5, 6) + rng.uniform(-3.0, 3.0, 6)
    noise = rng.normal(size=(count, 6)) * rng.uniform(1e-4, 1e-2)
    positions = np.array([0.0, -1.5, 1.5, 0.0, 0.8, 0.0]) + 0.4 * np.sin(angles) + noise
    first, *inner, last = (JointWaypoint(tuple(q)) for q in positions.tolist())
    limits = Limits(
        tcp_centripetal_acceleration=0.15372293068811327,
        tcp_linear_acceleration=1.4599063797315348,
        tcp_angular_acceleration=2.497811448284956,
    )
    passed = [replace(waypoint, transition=ThroughTransition()) for waypoint in inner]
    result = plan(PlanningProblem(robot, [first, *passed, last], limits), Toppra(jerk_limited=True))
    assert result.certificate.satisfied
    states = result.trajectory.evaluate(np.linspace(0.0, result.trajectory.duration, 300_000))
    (v, _), (a, _) = tool_velocities(robot, *states[:2]), tool_accelerations(robot, *states)
    speed, across = np.linalg.norm(v, axis=1), np.linalg.norm(np.cross(v, a), axis=1)
    bounded = np.minimum(across, speed**3 / TIGHTEST_BEND)
    assert (bounded <= limits.tcp_centripetal_acceleration * speed * (1.0 + 1e-6)).all()


def test_time_optimal_plans_are_no_slower_than_the_polygon_makes_them() -> None:
    """The same path with a limit 2 % wider is faster by no more than 1.2 %: unused limits would make it gain more."""
    times = []
    for factor in (1.0, 1.02):
        limits = replace(LIMITS, tcp_linear_acceleration=1.5 * factor, tcp_angular_acceleration=2.0 * factor)
        limits = replace(limits, tcp_centripetal_acceleration=None)
        times.append(plan(PlanningProblem(ROBOT, CORNER, limits), Toppra()).trajectory.duration)
    assert 1.0 < times[0] / times[1] < 1.012


def test_the_certificate_agrees_with_the_states_of_the_tool() -> None:
    result = plan(PlanningProblem(ROBOT, JOINTS, LIMITS), Quintic())
    q, v, a = result.trajectory.evaluate(np.linspace(0.0, result.trajectory.duration, 5000))
    linear, angular = (np.linalg.norm(values, axis=1).max() for values in tool_accelerations(ROBOT, q, v, a))
    peaks = {check.quantity: check.peak for check in result.certificate.checks}
    assert peaks["tcp_linear_acceleration"] == pytest.approx(linear, rel=1e-4)
    assert peaks["tcp_angular_acceleration"] == pytest.approx(angular, rel=1e-4)


def test_a_duration_that_asks_for_too_much_is_refused_with_remedies() -> None:
    line = [
        JointWaypoint(START),
        RelativeWaypoint(CartesianMove((0.0, -0.3, 0.0)), "base", motion=LinearMotion(), duration=0.5),
    ]
    problem = PlanningProblem(ROBOT, line, Limits(tcp_linear_acceleration=1.5))
    with pytest.raises(InfeasibleDuration, match="the limit of the tool's acceleration") as refusal:
        plan(problem, Toppra())
    changed = {remedy.field: remedy for remedy in refusal.value.remedies}
    assert changed["waypoints", 1, "duration"].value == pytest.approx(2.0 * np.sqrt(0.3 / 1.5), rel=5e-3)
    wider = changed["limits", "tcp_linear_acceleration"]
    assert plan(wider.applied_to(problem), Toppra()).trajectory.duration == pytest.approx(0.5)


def test_samples_whose_velocity_jumps_have_no_bounded_acceleration_of_the_tool() -> None:
    limits = Limits(tcp_linear_acceleration=100.0)
    times, positions = np.array([0.0, 1.0, 2.0]), np.array([START, START, np.array(START) + 0.01])
    (check,) = [
        check
        for check in certify_samples(ROBOT, times, positions, limits=limits).checks
        if check.quantity == "tcp_linear_acceleration"
    ]
    assert not check.bounded
    assert not check.enforced


@pytest.mark.parametrize("turn", [0.15, 0.1137, 0.0289])
@pytest.mark.parametrize("sideways", [0.0, 1e-6, 1e-4, 3e-3, 0.011, 0.03, 0.2])
def test_a_tool_that_turns_almost_at_rest_is_no_matter_of_luck(sideways: float, turn: float) -> None:
    """One slide reverses at time `turn` at 1 m/s^2, while the other one moves at the speed `sideways`."""
    robot = load_robot("date_sorting_arm")
    coefficients = np.zeros((1, robot.dof, 3))
    coefficients[0, :, 0] = robot.limit("lower") + 0.4 * (robot.limit("upper") - robot.limit("lower"))
    coefficients[0, 1, 1], coefficients[0, 2, 1:] = sideways, (-turn, 0.5)
    ends = np.array([0.0, 0.3])
    trajectory = Trajectory(np.array([0.3]), coefficients, np.zeros(1, dtype=int), ends, ends)
    limits = Limits(tcp_centripetal_acceleration=10.0)
    found = certify(robot, trajectory, limits=limits, enforced=["position"])
    (peak,) = [check.peak for check in found.checks if check.quantity == "tcp_centripetal_acceleration"]
    time = np.linspace(-turn, 0.3 - turn, 300_001)
    speed = np.hypot(sideways, time)
    across = np.divide(sideways, speed, out=np.zeros_like(speed), where=speed > 0.0)
    assert peak == pytest.approx(np.minimum(across, speed**2 / 1e-4).max(), rel=1e-2, abs=1e-6)


@pytest.mark.parametrize("turn", [0.15, 0.1137, 0.0289, 0.28])
@pytest.mark.parametrize("sideways", [0.0101, 0.03, 0.2])
def test_a_turn_between_samples_is_seen_where_another_one_is_larger_than_it_seems(sideways: float, turn: float) -> None:
    """The tool first moves fast with 0.6 m/s^2 across its path, then reverses at 1 m/s^2."""
    robot = load_robot("date_sorting_arm")
    coefficients = np.zeros((2, robot.dof, 3))
    coefficients[:, :, 0] = robot.limit("lower") + 0.4 * (robot.limit("upper") - robot.limit("lower"))
    coefficients[0, 1, 1], coefficients[0, 2, 2] = 2.0, 0.3
    coefficients[1, 1, 1], coefficients[1, 2, 1:] = sideways, (-turn, 0.5)
    ends, lengths = np.array([0.0, 0.6]), np.array([0.3, 0.3])
    trajectory = Trajectory(lengths, coefficients, np.zeros(2, dtype=int), ends, ends)
    for limit in (10.0, 0.8):
        limits = Limits(tcp_centripetal_acceleration=limit)
        found = certify(robot, trajectory, limits=limits, enforced=["tcp_centripetal_acceleration"])
        (peak,) = [check.peak for check in found.checks if check.quantity == "tcp_centripetal_acceleration"]
        assert peak == pytest.approx(1.0, rel=1e-3)
