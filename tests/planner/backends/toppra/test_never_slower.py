"""On the same path, no other back end is faster, nor the plain package on a densely sampled path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import toppra
from hypothesis import assume
from hypothesis import strategies as st
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

from planner.backends import BackEnd, Cubic, Quintic, Ruckig, Toppra, Trapezoidal
from planner.errors import PlanningError
from planner.kinematics.forward import tool_pose
from planner.limits import Limits
from planner.paths import JointPath, solve_path
from planner.planning import plan
from planner.problems.check import check_problem
from planner.problems.problem import CircularMotion, JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.problems.transitions import BlendTransition, ThroughTransition
from planner.robots import load_robot
from planner.spatial import Pose, rotation_from_rpy
from tests.planner.problems_of_tests import (
    PARTS,
    REQUESTS,
    certified_plan,
    path_problems,
    problem_of,
    problems,
    try_on_random,
)

ON_EVERY_PATH: tuple[BackEnd, ...] = (Trapezoidal(), Toppra(jerk_limited=True))
"""Back ends that go through waypoints on one of the curves that `toppra` chooses from."""

OWN_WAY: tuple[BackEnd, ...] = (Cubic(), Quintic(), Ruckig())
"""Back ends with their own path through passed waypoints, and the same path as all others elsewhere."""

TOLERANCE = 1.001
"""Ratio of durations that counts as equal."""


def is_no_slower(problem: PlanningProblem) -> None:
    """Assert that toppra is no slower than every other back end that takes the same path and finds a plan."""
    try:
        own = plan(problem, Toppra())
    except PlanningError:
        assume(False)
    free = any(group.is_spline for group in own.path.groups)
    for backend in ON_EVERY_PATH if free else (*ON_EVERY_PATH, *OWN_WAY):
        try:
            check_problem(problem, backend)
            other = certified_plan(problem, backend, own.path)
        except PlanningError:
            continue
        assert own.trajectory.duration <= other.trajectory.duration * TOLERANCE, backend


@st.composite
def passing(draw: st.DrawFn) -> PlanningProblem:
    """Return joint waypoints passed without stopping, within the robot's limits or narrower ones."""
    robot_id = draw(st.sampled_from(("ngv_refuelling_arm", "date_sorting_arm", "three_dof_arm", "kuka_kr16_l6_2")))
    scale = 10.0 ** draw(st.floats(-3.0, 0.0))
    problem = problem_of(robot_id, draw(st.integers(0, 2**32)), draw(st.integers(3, 8)), scale)
    inner = (replace(waypoint, transition=ThroughTransition()) for waypoint in problem.waypoints[1:-1])
    speed = draw(st.sampled_from([None, None, 0.05, 0.5]))
    torque = None
    if problem.robot.has_dynamics and draw(st.booleans()):
        torque = tuple((0.6 * problem.robot.limit("torque")).tolist())
    limits = Limits(velocity_scale=draw(st.floats(0.05, 1.0)), tcp_linear_velocity=speed, torque=torque)
    return replace(problem, waypoints=(problem.waypoints[0], *inner, problem.waypoints[-1]), limits=limits)


@pytest.mark.sized
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("kind", ["straight", "passing", "tool"])
def test_no_slower_than_any_other_on_the_same_path(kind: str, part: int) -> None:
    drawn = {"straight": problems("toppra"), "passing": passing(), "tool": path_problems("toppra")}[kind]
    try_on_random(max(1, REQUESTS // 20 // len(PARTS)), part, drawn, is_no_slower)


KUKA, HOME = "kuka_kr16_l6_2", (0.2, -1.3, 1.6, 0.3, 0.9, 0.1)


def line(robot_id: str, home: tuple[float, ...], step: tuple[float, ...], limits: Limits) -> PlanningProblem:
    """Return a straight line of the tool, its orientation kept."""
    robot = load_robot(robot_id)
    start = tool_pose(robot, np.array(home))
    end = Pose(start.position + np.array(step), start.rotation)
    waypoints = (JointWaypoint(position=home), PoseWaypoint(pose=end, motion=LinearMotion()))
    return PlanningProblem(robot, waypoints, limits)


@pytest.mark.long_table
@pytest.mark.parametrize("speed", [0.005, 0.02, 0.1, 0.25, 0.5, 1.0, None])
@pytest.mark.parametrize("length", [0.01, 0.1, 0.34])
def test_no_slower_on_lines_at_any_speed_of_the_tool(length: float, speed: float | None) -> None:
    """0.34 m at 0.02 m/s took 17.265 s, by `trapezoidal` 17.011 s."""
    is_no_slower(line(KUKA, HOME, (0.0, length, 0.0), Limits(tcp_linear_velocity=speed)))


@pytest.mark.parametrize("speed", [0.02, 0.5])
def test_no_slower_where_torques_bind(speed: float) -> None:
    torque = tuple((0.4 * load_robot(KUKA).limit("torque")).tolist())
    is_no_slower(line(KUKA, HOME, (0.0, 0.3, 0.1), Limits(tcp_linear_velocity=speed, torque=torque)))


def test_no_slower_where_coarse_intervals_take_little_time() -> None:
    """Coarse intervals slowed the intervals beside them: 0.3 % slower than with limited jerk, found by a soak."""
    robot = load_robot("date_sorting_arm")
    start = JointWaypoint((-0.4939217587, 0.2835207215, 0.2548301908, 0.8554200715, 0.503036802, 1.5970711225))
    first = Pose(np.array([0.213949, 0.495104, 1.142596]), rotation_from_rpy(2.635191, 1.209765, 3.089237))
    second = Pose(np.array([0.212057, 0.492606, 1.132813]), rotation_from_rpy(2.419331, 0.44058, 2.551652))
    end = Pose(np.array([0.21643, 0.491419, 1.130189]), rotation_from_rpy(2.985024, 0.576312, 2.783918))
    passed = (PoseWaypoint(pose=pose, transition=ThroughTransition()) for pose in (first, second))
    limits = Limits(tcp_linear_velocity=0.05, velocity_scale=0.05, acceleration_scale=0.05)
    is_no_slower(PlanningProblem(robot, (start, *passed, PoseWaypoint(pose=end, motion=LinearMotion())), limits))


def test_no_slower_where_the_bound_on_the_speed_dips() -> None:
    """Between gridpoints the path velocity stayed below the bound: 0.2 % slower than with limited jerk."""
    start = JointWaypoint((-0.9014794783266478, 1.5086313925861181, -2.0302319721008897))
    via = Pose(np.array([-0.10346864, 0.1543315, -0.00126512]))
    circle = PoseWaypoint(
        Pose(np.array([-0.12193026, 0.09653188, -0.00687642])), motion=CircularMotion(via, singularity="slow")
    )
    limits = Limits(velocity_scale=0.05, acceleration_scale=0.05)
    is_no_slower(PlanningProblem(load_robot("three_dof_arm"), (start, circle), limits))


def densely(path: JointPath) -> float:
    """Compute the duration, s, by the plain package on each group's curve, within velocity and acceleration.

    Each curve has 3,000 gridpoints.
    """
    total = 0.0
    for group in path.groups:
        length = float(group.curve.breakpoints[-1])
        grid = np.linspace(0.0, length, 3001)
        curve = toppra.SplineInterpolator(grid, group.curve.evaluate(grid, [0])[0])
        segment = group.segments[0]
        limits = [
            np.column_stack([-x[segment], x[segment]])
            for x in (path.limits.velocity.narrower, path.limits.acceleration.narrower)
        ]
        kept = [JointVelocityConstraint(limits[0]), JointAccelerationConstraint(limits[1])]
        search = toppra.algorithm.TOPPRA(kept, curve, gridpoints=grid, solver_wrapper="seidel")
        _, speeds, _ = search.compute_parameterization(0.0, 0.0)
        total += float((2.0 * np.diff(grid) / (speeds[:-1] + speeds[1:])).sum())
    return total


HOMES = {
    "ngv_refuelling_arm": (1.6, 1.0, -0.3, 0.0, 2.4, 0.0),
    "kuka_kr16_2": HOME,
    KUKA: HOME,
    "panda": (0.3, -0.5, 0.2, -2.0, 0.1, 1.7, 0.5),
}


@pytest.mark.long_table
@pytest.mark.parametrize("step", [(0.0, 0.05, 0.0), (0.0, 0.2, 0.1), (0.05, -0.15, -0.1)])
@pytest.mark.parametrize("robot_id", HOMES)
def test_no_slower_than_the_plain_package_on_a_densely_sampled_line(robot_id: str, step: tuple[float, ...]) -> None:
    """The plain package was faster by 0.5 to 1.1 %."""
    problem = line(robot_id, HOMES[robot_id], step, Limits())
    assert plan(problem, Toppra()).trajectory.duration <= densely(solve_path(problem)) * TOLERANCE


@pytest.mark.large_only
def test_no_slower_where_a_least_duration_slows_a_motion_whose_acceleration_jumps() -> None:
    """Rows of the tool's limits were interpolated over the jumps: 8 % slower than `trapezoidal`."""
    start = JointWaypoint((0.6023889629772804, -1.012530916317465, -2.018903887007366))
    corner = PoseWaypoint(
        Pose(np.array([0.119651, 0.080142, -0.058126])), transition=BlendTransition(0.0015), minimum_duration=2.0
    )
    end = PoseWaypoint(Pose(np.array([0.120071, 0.082983, -0.058258])))
    limits = Limits(tcp_angular_acceleration=0.5)
    is_no_slower(PlanningProblem(load_robot("three_dof_arm"), (start, corner, end), limits))
