"""Time-optimal motions against an independent optimum and dense samples, and the faults of the plain library."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline
from scipy.optimize import linprog
from scipy.sparse import diags_array, vstack

from planner.backends import Toppra
from planner.limits import Limits
from planner.paths import solve_path
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import BlendTransition, StopTransition
from planner.robots import Robot, load_robot
from planner.robots.payload import Payload
from tests.planner.backends.toppra.toppra_problems import (
    KUKA,
    KUKA_START,
    middles,
    robot_limits,
    through,
    tool_problem,
    worst_ratio,
)


def independent_optimum(
    robot: Robot, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, step: float, limits: Limits, torque: bool
) -> float:
    """Return duration, s, by one linear program in x = s'^2: the largest x everywhere is the fastest motion.

    Args:
        robot: With its payload.
        q: (intervals, joints), at the middles of equal intervals of a path.
        dq: Its derivative by s.
        ddq: Its second.
        step: Length of an interval.
        limits: Velocity and acceleration, and torque if requested.
        torque: Whether torque is limited.
    """
    count = len(q)

    def rows(per_u: np.ndarray, per_x: np.ndarray) -> object:
        # u = (x1 - x0) / (2 step), x = (x0 + x1) / 2
        return diags_array(
            [per_x / 2.0 - per_u / (2.0 * step), per_x / 2.0 + per_u / (2.0 * step)],
            offsets=[0, 1],
            shape=(count, count + 1),
        )

    blocks, bounds = [], []

    def limit(per_u: np.ndarray, per_x: np.ndarray, rest: np.ndarray, bound: np.ndarray) -> None:
        for j in range(q.shape[1]):
            for sign in (1.0, -1.0):
                blocks.append(rows(sign * per_u[:, j] / bound[j], sign * per_x[:, j] / bound[j]))
                bounds.append(1.0 - sign * rest[:, j] / bound[j])

    limit(dq, ddq, np.zeros_like(q), np.array(limits.acceleration))
    if torque:
        gravity = np.array([pin.computeGeneralizedGravity(robot.model, robot.data, row) for row in q])
        inertia = np.array([pin.crba(robot.model, robot.data, row).copy() for row in q])
        inertia = np.triu(inertia) + np.triu(inertia, 1).transpose(0, 2, 1)
        bias = np.array([pin.nonLinearEffects(robot.model, robot.data, *row) for row in zip(q, dq, strict=True)])
        mass = np.einsum("nij,nj->ni", inertia, dq)
        limit(mass, np.einsum("nij,nj->ni", inertia, ddq) + bias - gravity, gravity, np.array(limits.torque))
    most = ((np.array(limits.velocity) / np.maximum(np.abs(dq), 1e-12)) ** 2).min(axis=1)
    upper = np.minimum(np.append(most, np.inf), np.insert(most, 0, np.inf))
    upper[[0, -1]] = 0.0
    # The unit in which x is about 1.
    unit = float(np.median(upper))
    matrix = vstack(blocks) * unit
    found = linprog(
        -np.ones(count + 1), A_ub=matrix, b_ub=np.concatenate(bounds), bounds=np.column_stack([0 * upper, upper / unit])
    )
    assert found.status == 0, found.message
    speeds = np.sqrt(np.maximum(found.x, 0.0) * unit)
    return float((2.0 * step / (speeds[1:] + speeds[:-1])).sum())


@pytest.mark.long_table
@pytest.mark.parametrize(
    ("robot_id", "seed", "count", "scale"),
    [
        ("ngv_refuelling_arm", 1, 6, 1.0),
        ("ngv_refuelling_arm", 2, 4, 0.03),
        ("date_sorting_arm", 3, 5, 0.5),
        ("three_dof_arm", 4, 7, 1.0),
    ],
)
def test_through_waypoints_as_fast_as_a_fine_linear_program(robot_id: str, seed: int, count: int, scale: float) -> None:
    """The path is the natural spline over the chords, by another library; the plan is at most 1 % slower."""
    problem = through(robot_id, seed, count, scale)
    positions = np.array([waypoint.position for waypoint in problem.waypoints])
    chords = (np.abs(np.diff(positions, axis=0)) / problem.robot.limit("velocity")).max(axis=1)
    spline = CubicSpline(np.concatenate([[0.0], np.cumsum(chords)]), positions, bc_type="natural")
    s, step = middles(chords.sum(), 800)
    best = independent_optimum(
        problem.robot, spline(s), spline(s, 1), spline(s, 2), step, robot_limits(problem.robot), torque=False
    )
    assert plan(problem, Toppra()).trajectory.duration <= 1.01 * best


@pytest.mark.long_table
@pytest.mark.parametrize("transition", [StopTransition(), BlendTransition(0.05)])
@pytest.mark.parametrize("torque_scale", [1.0, 0.45])
def test_motions_of_the_tool_as_fast_as_a_fine_linear_program(transition: object, torque_scale: float) -> None:
    """Lines, a circle and a blend, on their given curves: within 1 %, or 2 % with binding torque limits."""
    robot = load_robot(KUKA)
    limits = robot_limits(robot, torque_scale)
    problem = tool_problem(transition, limits=limits)
    best = 0.0
    for group in solve_path(problem).groups:
        s, step = middles(float(group.curve.breakpoints[-1]), 800)
        best += independent_optimum(robot, *group.curve.evaluate(s), step, limits, torque=True)
    found = plan(problem, Toppra()).trajectory.duration
    assert found <= (1.01 if torque_scale == 1.0 else 1.02) * best
    assert found >= 0.995 * best


def test_straight_motion_with_binding_torques_as_fast_as_a_fine_linear_program() -> None:
    unrated, payload = replace(load_robot(KUKA), rated_payload=None), Payload(20.0, (0.1, 0.0, 0.1))
    robot = unrated.with_payload(payload)
    limits = robot_limits(robot, 0.35)
    start, end = np.array(KUKA_START), np.array([-1.0, -0.6, 0.9, 1.0, -0.5, 1.0])
    waypoints = (JointWaypoint(position=tuple(start)), JointWaypoint(position=tuple(end)))
    problem = PlanningProblem(unrated, waypoints, limits=limits, payload=payload)
    s, step = middles(1.0, 800)
    dq = np.tile(end - start, (len(s), 1))
    path = start + s[:, None] * dq
    best = independent_optimum(robot, path, dq, np.zeros_like(dq), step, limits, torque=True)
    free = independent_optimum(robot, path, dq, np.zeros_like(dq), step, limits, torque=False)
    assert best > 1.05 * free  # or this test shows nothing
    assert 0.995 * best <= plan(problem, Toppra()).trajectory.duration <= 1.02 * best


@settings(max_examples=max(15, settings.default.max_examples // 10))
@given(
    robot_id=st.sampled_from(["ngv_refuelling_arm", "date_sorting_arm", KUKA]),
    seed=st.integers(0, 2**32),
    count=st.integers(2, 12),
    exponent=st.floats(-3.0, 0.0),
    passing=st.booleans(),
)
def test_no_limit_is_broken(robot_id: str, seed: int, count: int, exponent: float, passing: bool) -> None:
    problem = through(robot_id, seed, count, 10.0**exponent)
    if not passing:
        stops = tuple(replace(waypoint, transition=StopTransition()) for waypoint in problem.waypoints)
        problem = replace(problem, waypoints=stops)
    assert worst_ratio(plan(problem, Toppra())) <= 1.0 + 1e-6


@pytest.mark.parametrize(
    ("robot_id", "seed", "count", "scale"),
    [
        ("ngv_refuelling_arm", 3804007123, 3, 0.5603149591511387),
        (KUKA, 1446723851, 10, 0.4620499460707077),
    ],
)
def test_rest_stays_rest_where_intervals_are_halved_to_keep_to_the_curve(
    robot_id: str, seed: int, count: int, scale: float
) -> None:
    """The last speed came out as 2e-7 instead of 0, and the plan was refused."""
    assert plan(through(robot_id, seed, count, scale), Toppra()).certificate.continuity == "C1"


def test_fifty_waypoints_in_one_run() -> None:
    result = plan(through("ngv_refuelling_arm", 8, 50, 0.4), Toppra())
    assert worst_ratio(result) <= 1.0 + 1e-6
    assert result.certificate.waypoint_error <= 1e-9


@pytest.mark.parametrize("requested", [{"tcp_linear_velocity": 0.15}, {"tcp_angular_velocity": 0.3}])
def test_tool_speed_limits_bind_and_hold(requested: dict[str, float]) -> None:
    result = plan(replace(through(KUKA, 5, 5, 0.3), limits=Limits(**requested)), Toppra())  # type: ignore[arg-type]
    assert 0.99 <= worst_ratio(result) <= 1.0 + 1e-6
    check = next(check for check in result.certificate.checks if check.quantity in requested)
    assert check.ratio is not None
    assert check.ratio > 0.99


def test_limits_of_one_segment_bind_on_that_segment_only() -> None:
    problem = through("ngv_refuelling_arm", 5, 5, 0.5)
    waypoints = list(problem.waypoints)
    waypoints[2] = replace(waypoints[2], limits=Limits(velocity_scale=0.1))
    slow, fast = plan(replace(problem, waypoints=tuple(waypoints)), Toppra()), plan(problem, Toppra())
    assert worst_ratio(slow) <= 1.0 + 1e-6
    times, others = np.diff(slow.trajectory.arrivals), np.diff(fast.trajectory.arrivals)
    assert times[1] > 3.0 * others[1]
    assert times[3] < 1.1 * others[3]
