"""Time-optimal motions against an independent optimum, dense samples, and what the plain library does wrong."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline
from scipy.optimize import linprog
from scipy.sparse import diags_array, vstack

from planner.backends import TimeOptimal
from planner.backends.intervals import cut
from planner.backends.time_optimal import fastest_on
from planner.dynamics import inverse_dynamics
from planner.errors import InfeasibleDuration, InvalidProblem, LimitsUnsatisfiable
from planner.kinematics import tool_speeds
from planner.kinematics.forward import tool_pose
from planner.kinematics.poses import Pose
from planner.paths import solve_path
from planner.plan import Plan, plan
from planner.problem import (
    BlendTransition,
    CircularMotion,
    JointWaypoint,
    Limits,
    LinearMotion,
    Payload,
    PlanningProblem,
    PoseWaypoint,
    StopTransition,
    ThroughTransition,
)
from planner.robots import Robot, load_robot
from tests.planner.problems import problem_of

ROOT = Path(__file__).parents[2]
KUKA, KUKA_START = "kuka_kr16_l6_2", (0.2, -1.3, 1.6, 0.3, 0.9, 0.1)


def through(robot_id: str, seed: int, count: int, scale: float = 1.0, transition: object = None) -> PlanningProblem:
    """Random joint waypoints, all inner ones passed without stopping."""
    problem = problem_of(robot_id, "toppra", seed, count, scale)
    passing = transition or ThroughTransition()
    inner = tuple(replace(waypoint, transition=passing) for waypoint in problem.waypoints[1:-1])
    return replace(problem, waypoints=(problem.waypoints[0], *inner, problem.waypoints[-1]))


def joint_problem(
    robot_id: str, positions: list[list[float]], passing: bool = True, **fields: object
) -> PlanningProblem:
    last = len(positions) - 1
    waypoints = tuple(
        JointWaypoint(
            position=tuple(q), transition=ThroughTransition() if passing and 0 < k < last else StopTransition()
        )
        for k, q in enumerate(positions)
    )
    return PlanningProblem(load_robot(robot_id), waypoints, TimeOptimal(), **fields)  # type: ignore[arg-type]


def tool_problem(transition: object, **fields: object) -> PlanningProblem:
    """Two lines of the tool with a corner between them, and a circle."""
    robot = load_robot(KUKA)
    start = tool_pose(robot, np.array(KUKA_START))
    corner = start.position + np.array([0.0, 0.25, 0.0])
    end = corner + np.array([0.2, 0.05, 0.1])
    via = Pose(end + np.array([0.05, -0.1, 0.0]), None)
    last = Pose(end + np.array([0.0, -0.2, 0.0]), start.rotation)
    waypoints = (
        JointWaypoint(position=KUKA_START),
        PoseWaypoint(pose=Pose(corner, start.rotation), motion=LinearMotion(), transition=transition),  # type: ignore[arg-type]
        PoseWaypoint(pose=Pose(end, start.rotation), motion=LinearMotion()),
        PoseWaypoint(pose=last, motion=CircularMotion(via=via)),
    )
    return PlanningProblem(robot, waypoints, TimeOptimal(), **fields)  # type: ignore[arg-type]


def independent_optimum(
    robot: Robot, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, step: float, limits: Limits, torque: bool
) -> float:
    """Duration, s, by one linear program in x = s'^2: the largest x everywhere is the fastest motion.

    Args:
        robot: With its payload.
        q: (intervals, joints), at the middles of equal intervals of a path.
        dq: Its derivative by s.
        ddq: Its second.
        step: Length of an interval.
        limits: Velocity and acceleration, and torque if asked.
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


def middles(length: float, count: int) -> tuple[np.ndarray, float]:
    return (np.arange(count) + 0.5) * length / count, length / count


def robot_limits(robot: Robot, torque_scale: float = 1.0) -> Limits:
    torque = robot.limit("torque") * torque_scale
    asked = tuple(torque.tolist()) if robot.has_dynamics else None
    return Limits(tuple(robot.limit("velocity").tolist()), tuple(robot.limit("acceleration").tolist()), torque=asked)


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
    """On the natural spline over the chords, by another library; never more than 1 % slower."""
    problem = through(robot_id, seed, count, scale)
    positions = np.array([waypoint.position for waypoint in problem.waypoints])
    chords = (np.abs(np.diff(positions, axis=0)) / problem.robot.limit("velocity")).max(axis=1)
    spline = CubicSpline(np.concatenate([[0.0], np.cumsum(chords)]), positions, bc_type="natural")
    s, step = middles(chords.sum(), 2500)
    best = independent_optimum(
        problem.robot, spline(s), spline(s, 1), spline(s, 2), step, robot_limits(problem.robot), torque=False
    )
    assert plan(problem).trajectory.duration <= 1.01 * best


@pytest.mark.parametrize("transition", [StopTransition(), BlendTransition(0.05)])
@pytest.mark.parametrize("torque_scale", [1.0, 0.45])
def test_motions_of_the_tool_as_fast_as_a_fine_linear_program(transition: object, torque_scale: float) -> None:
    """Lines, a circle and a blend, on their given curves: within 1 %, with torque limits that bind within 2 %."""
    robot = load_robot(KUKA)
    limits = robot_limits(robot, torque_scale)
    problem = tool_problem(transition, limits=limits)
    best = 0.0
    for run in solve_path(problem).runs:
        s, step = middles(float(run.curve.breakpoints[-1]), 2500)
        best += independent_optimum(robot, *run.curve.evaluate(s), step, limits, torque=True)
    found = plan(problem).trajectory.duration
    assert found <= (1.01 if torque_scale == 1.0 else 1.02) * best
    assert found >= 0.995 * best


def test_straight_motion_with_binding_torques_as_fast_as_a_fine_linear_program() -> None:
    robot = load_robot(KUKA).with_payload(Payload(20.0, (0.1, 0.0, 0.1)))
    limits = robot_limits(robot, 0.35)
    start, end = np.array(KUKA_START), np.array([-1.0, -0.6, 0.9, 1.0, -0.5, 1.0])
    waypoints = (JointWaypoint(position=tuple(start)), JointWaypoint(position=tuple(end)))
    problem = PlanningProblem(
        load_robot(KUKA), waypoints, TimeOptimal(), limits, payload=Payload(20.0, (0.1, 0.0, 0.1))
    )
    s, step = middles(1.0, 4000)
    dq = np.tile(end - start, (len(s), 1))
    path = start + s[:, None] * dq
    best = independent_optimum(robot, path, dq, np.zeros_like(dq), step, limits, torque=True)
    free = independent_optimum(robot, path, dq, np.zeros_like(dq), step, limits, torque=False)
    assert best > 1.05 * free  # or this test shows nothing
    assert 0.995 * best <= plan(problem).trajectory.duration <= 1.02 * best


def worst_ratio(result: Plan, count: int = 10_000) -> float:
    """Of every limited quantity, on samples evenly spaced in time."""
    trajectory, limits, robot = result.trajectory, result.path.limits, result.path.robot
    times = np.linspace(0.0, trajectory.duration, count)
    pieces, _ = trajectory.locate(times)
    rows = trajectory.segments[pieces]
    q, dq, ddq = trajectory.evaluate(times)
    ratios = [np.abs(dq) / limits.velocity[rows], np.abs(ddq) / limits.acceleration[rows]]
    if robot.has_dynamics and np.isfinite(limits.torque).any():
        ratios.append(np.abs(inverse_dynamics(robot, q, dq, ddq)) / limits.torque[rows])
    linear, angular = tool_speeds(robot, q, dq)
    tool = np.maximum(linear / limits.tcp_linear_velocity[rows], angular / limits.tcp_angular_velocity[rows])
    return max(float(np.max(ratio)) for ratio in (*ratios, tool))


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
    assert worst_ratio(plan(problem)) <= 1.0 + 1e-6


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
    assert plan(through(robot_id, seed, count, scale)).certificate.continuity == "C1"


def test_fifty_waypoints_in_one_run() -> None:
    result = plan(through("ngv_refuelling_arm", 8, 50, 0.4))
    assert worst_ratio(result) <= 1.0 + 1e-6
    assert result.certificate.waypoint_error <= 1e-9


@pytest.mark.parametrize("asked", [{"tcp_linear_velocity": 0.15}, {"tcp_angular_velocity": 0.3}])
def test_tool_speed_limits_bind_and_hold(asked: dict[str, float]) -> None:
    result = plan(replace(through(KUKA, 5, 5, 0.3), limits=Limits(**asked)))  # type: ignore[arg-type]
    assert 0.99 <= worst_ratio(result) <= 1.0 + 1e-6
    check = next(check for check in result.certificate.checks if check.quantity in asked)
    assert check.ratio is not None
    assert check.ratio > 0.99


def test_limits_of_one_segment_bind_on_that_segment_only() -> None:
    problem = through("ngv_refuelling_arm", 5, 5, 0.5)
    waypoints = list(problem.waypoints)
    waypoints[2] = replace(waypoints[2], limits=Limits(velocity_scale=0.1))
    slow, fast = plan(replace(problem, waypoints=tuple(waypoints))), plan(problem)
    assert worst_ratio(slow) <= 1.0 + 1e-6
    times, others = np.diff(slow.trajectory.arrivals), np.diff(fast.trajectory.arrivals)
    assert times[1] > 3.0 * others[1]
    assert times[3] < 1.1 * others[3]


# What the plain library does wrong (version 0.6.10), each with the same input here.


def test_trap_accelerations_are_kept_where_the_plain_library_breaks_them() -> None:
    """Trap 1: on 100 grid points its spline runs over the acceleration limit. It has a process of its own."""
    code = """
import json, sys
import numpy as np
import toppra
from toppra.algorithm import TOPPRA
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint
s, positions, velocity, acceleration = (np.array(value) for value in json.load(sys.stdin))
limits = [np.column_stack([-bound, bound]) for bound in (velocity, acceleration)]
path = toppra.SplineInterpolator(s, positions, "natural")
constraints = [JointVelocityConstraint(limits[0]), JointAccelerationConstraint(limits[1])]
law = TOPPRA(constraints, path, gridpoints=np.linspace(0, s[-1], 100)).compute_trajectory()
times = np.linspace(0, law.duration, 10000)
print((np.abs(law(times, 2)) / acceleration).max())
"""
    problem = through("ngv_refuelling_arm", 1, 6)
    positions = np.array([waypoint.position for waypoint in problem.waypoints])
    chords = (np.abs(np.diff(positions, axis=0)) / problem.robot.limit("velocity")).max(axis=1)
    values = [np.concatenate([[0.0], np.cumsum(chords)]), positions]
    values += [problem.robot.limit("velocity"), problem.robot.limit("acceleration")]
    given = json.dumps([value.tolist() for value in values])
    command = [sys.executable, "-W", "ignore", "-c", code]
    plain = subprocess.run(command, input=given, capture_output=True, text=True, check=True, cwd=ROOT)
    assert float(plain.stdout) > 1.05
    assert worst_ratio(plan(problem)) <= 1.0 + 1e-6


def test_trap_no_pause_where_the_path_hardly_moves() -> None:
    """Trap 2: five seconds were put in wherever the speed is about 0. Here the arm turns back at a waypoint."""
    there, back = [0.0, 0.3, 0.1, 0.0, 0.0, 0.0], [0.5, 0.1, 0.1, 0.2, 0.0, 0.0]
    passing = plan(joint_problem("ngv_refuelling_arm", [there, back, there]))
    stopping = plan(joint_problem("ngv_refuelling_arm", [there, back, there], passing=False))
    assert passing.trajectory.duration <= 1.005 * stopping.trajectory.duration


@pytest.mark.parametrize("apart", [1e-3, 1e-6, 1e-8])
def test_trap_waypoints_that_are_nearly_the_same(apart: float) -> None:
    """Trap 3: it gave up, without a reason."""
    first, middle, last = (np.array(w.position) for w in through("ngv_refuelling_arm", 3, 3, 0.3).waypoints)
    twin = middle + apart * np.array([1.0, -1.0, 0.5, 0.0, 0.3, -0.2])
    result = plan(joint_problem("ngv_refuelling_arm", [first.tolist(), middle.tolist(), twin.tolist(), last.tolist()]))
    assert worst_ratio(result) <= 1.0 + 1e-6
    three = [first.tolist(), middle.tolist(), last.tolist()]
    stopping = plan(joint_problem("ngv_refuelling_arm", three, passing=False))
    assert result.trajectory.duration <= 1.04 * stopping.trajectory.duration


def test_trap_waypoints_that_are_the_same_are_refused() -> None:
    """Trap 3: it answered Ok, with a duration of 0.2 ms."""
    with pytest.raises(InvalidProblem, match="the same joint position"):
        plan(joint_problem("ngv_refuelling_arm", [[0.1] * 6, [0.1] * 6, [0.1] * 6]))


@pytest.mark.parametrize("factor", [1.0, 1.7, 50.0])
@pytest.mark.parametrize("torque_scale", [None, 0.35])
def test_trap_asked_durations_are_met(factor: float, torque_scale: float | None) -> None:
    """Trap 4: it answered Ok with another duration, twice as long."""
    limits = Limits() if torque_scale is None else robot_limits(load_robot(KUKA), torque_scale)
    problem = joint_problem(KUKA, [list(KUKA_START), [-1.0, -0.6, 0.9, 1.0, -0.5, 1.0]], limits=limits)
    asked = plan(problem).trajectory.duration * factor
    waypoints = (problem.waypoints[0], replace(problem.waypoints[1], duration=asked))
    result = plan(replace(problem, waypoints=waypoints))
    assert result.trajectory.duration == pytest.approx(asked, rel=1e-12)
    assert worst_ratio(result) <= 1.0 + 1e-6


@pytest.mark.parametrize("kind", ["straight", "line"])
def test_trap_a_duration_too_short_is_refused_and_the_remedy_works(kind: str) -> None:
    """Trap 4, the other side."""
    problem = tool_problem(StopTransition(), limits=robot_limits(load_robot(KUKA), 0.45))
    if kind == "straight":
        problem = joint_problem(KUKA, [list(KUKA_START), [-1.0, -0.6, 0.9, 1.0, -0.5, 1.0]], limits=problem.limits)
    waypoints = [problem.waypoints[0], replace(problem.waypoints[1], duration=0.01), *problem.waypoints[2:]]
    with pytest.raises(InfeasibleDuration) as refusal:
        plan(replace(problem, waypoints=tuple(waypoints)))
    (remedy,) = refusal.value.remedies
    assert remedy.change == "/waypoints/1/duration"
    waypoints[1] = replace(waypoints[1], duration=remedy.value)
    result = plan(replace(problem, waypoints=tuple(waypoints)))
    assert result.trajectory.arrivals[1] == pytest.approx(remedy.value, rel=1e-9)


def test_a_duration_between_waypoints_passed_is_refused() -> None:
    problem = through("ngv_refuelling_arm", 4, 4, 0.3)
    waypoints = list(problem.waypoints)
    waypoints[2] = replace(waypoints[2], duration=9.0)
    with pytest.raises(InvalidProblem) as refusal:
        plan(replace(problem, waypoints=tuple(waypoints)))
    assert [pointer for pointer, _ in refusal.value.faults] == ["/waypoints/2/duration"]


def test_trap_jumps_of_the_acceleration_are_told() -> None:
    """Trap 5: its acceleration jumps without a word; the certificate says that the jerk has no bound."""
    certificate = plan(through("ngv_refuelling_arm", 4, 4, 0.3)).certificate
    jerk = next(check for check in certificate.checks if check.quantity == "jerk")
    assert certificate.continuity == "C1"
    assert not jerk.bounded
    assert not jerk.enforced


@pytest.mark.parametrize("unit", [1e-3, 100.0])
def test_trap_the_grid_does_not_depend_on_the_unit_of_the_path(unit: float) -> None:
    """Trap 6: the same path over another length had four times the points."""
    path = solve_path(through("ngv_refuelling_arm", 6, 4, 0.5))
    factors = np.ones(len(path.durations))
    durations, counts = [], []
    for curve in (path.runs[0].curve, path.runs[0].curve.stretched(unit)):
        intervals, x, _ = fastest_on(path, cut(path.runs, [curve], path.limits.velocity), factors)
        durations.append((2.0 * intervals.lengths / (np.sqrt(x[1:]) + np.sqrt(x[:-1]))).sum())
        counts.append(len(intervals.lengths))
    assert counts[0] == counts[1]
    assert durations[1] == pytest.approx(durations[0], rel=1e-6)


def test_trap_no_overshoot_of_a_position_limit() -> None:
    """Trap 7: a spline through a waypoint at a limit went 0.1 rad beyond it."""
    robot = load_robot("date_sorting_arm")
    lower, upper = np.maximum(robot.limit("lower"), -2.0), np.minimum(robot.limit("upper"), 2.0)
    middle = (lower + upper) / 2.0
    near, at = 0.9 * upper + 0.1 * middle, upper
    positions = [middle, at, near, at, lower]
    result = plan(joint_problem(robot.id, [q.tolist() for q in positions]))
    sampled = result.trajectory.evaluate(np.linspace(0.0, result.trajectory.duration, 20_000), [0])[0]
    assert (sampled <= robot.limit("upper") + 1e-9).all()
    assert (sampled >= robot.limit("lower") - 1e-9).all()
    assert worst_ratio(result) <= 1.0 + 1e-6


def test_trap_neither_scipy_nor_matplotlib_is_imported() -> None:
    """Trap 8: the package takes a second and a half and 84 MB; and what is left of it does not get in its own way."""
    code = """
import sys
from planner.backends import TimeOptimal
from planner.plan import plan
from planner.problem import JointWaypoint, PlanningProblem, ThroughTransition
from planner.robots import load_robot
ends = [JointWaypoint(position=(q,) * 6) for q in (0.0, 0.5)]
passed = JointWaypoint(position=(0.3,) * 6, transition=ThroughTransition())
plan(PlanningProblem(load_robot("ngv_refuelling_arm"), (ends[0], passed, ends[1]), TimeOptimal()))
print(*sorted(set(sys.modules) & {"toppra", "scipy", "matplotlib"}))
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert result.stdout.split() == []


def test_gravity_beyond_a_torque_limit_is_refused() -> None:
    problem = joint_problem(KUKA, [list(KUKA_START), [-1.0, -0.6, 0.9, 1.0, -0.5, 1.0]])
    weak = robot_limits(problem.robot, 0.01)
    with pytest.raises(LimitsUnsatisfiable, match="gravity alone"):
        plan(replace(problem, limits=weak))
