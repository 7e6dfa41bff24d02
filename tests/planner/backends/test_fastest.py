"""The back end `auto` is the fastest of its candidates; `ruckig` is no slower than one time scaling along a curve."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from planner.backends import Auto, Quintic, Ruckig, Toppra
from planner.backends.shared.straight_lines import smoothed
from planner.limits import Limits
from planner.paths import solve_path
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.robots import load_robot
from planner.spatial import FloatArray
from planner.time_scaling.fastest import time_group
from tests.planner.backends.ruckig.ruckig_problems import passing

SLOWER = 1.001
"""Factor by which a duration may exceed the duration that bounds it."""

Shape = Callable[[np.random.Generator, int], FloatArray]


def through(robot_id: str, positions: FloatArray, limits: Limits = Limits()) -> PlanningProblem:
    """Return the problem of passing all positions."""
    waypoints = tuple(JointWaypoint(tuple(position)) for position in positions.tolist())
    return passing(PlanningProblem(load_robot(robot_id), waypoints, limits=limits))


def retime(count: int) -> PlanningProblem:
    """Return the dense list of the case auto_retime.json, which has 51 waypoints, with `count` waypoints."""
    t = np.linspace(0.0, 50.0, count)
    rest = np.full_like(t, -1.5)
    lift = 1.5 + 0.2 * (1.0 - np.cos(0.08 * t))
    joints = [0.8 * np.sin(0.08 * t), -1.5 + 0.3 * np.sin(0.052 * t), lift, rest, rest, 0.04 * t]
    return through("ur5", np.column_stack(joints))


@pytest.mark.long_table
@pytest.mark.parametrize("count", [51, 201])
def test_case_auto_retime(count: int) -> None:
    """`auto` took 2.35 s, and 9.04 s for more of the same points; a time scaling along their curve takes 1.31 s."""
    found = plan(retime(count), Auto())
    assert found.trajectory.duration < 1.33
    (choice,) = [warning.message for warning in found.warnings if warning.code == "auto_choice"]
    assert choice.startswith("ruckig: the fastest back end that keeps all limits, jerk included: ruckig 1.31")


@pytest.mark.parametrize("count", [3, 10, 40])
def test_waypoints_on_a_line_cost_no_time(count: int) -> None:
    """Through waypoints on one straight line in joint space, the motion took twice as long as without them."""
    start, end = np.array([0.0, -1.5, 1.5, -1.5, -1.5, 0.0]), np.array([0.5, -1.1, 1.2, -1.0, -1.8, 0.7])
    shares = np.linspace(0.0, 1.0, count)[:, None] ** 1.3
    direct, passed = (
        plan(through("ur5", start + s * (end - start)), Ruckig()).trajectory.duration for s in (shares[[0, -1]], shares)
    )
    assert passed <= 1.02 * direct


@pytest.mark.parametrize("joints", [2, 3, 6])
def test_ruckig_is_no_slower_than_one_law_along_a_curve_where_that_is_not_tried(joints: int) -> None:
    """Random walks turn sharply at their waypoints, less so with fewer joints."""
    rng, home = np.random.default_rng(joints), np.array([0.0, -1.2, 1.8, -0.6, 1.6, 0.3])
    for _ in range(3):
        steps = rng.uniform(-0.3, 0.3, (5, 6)) * (np.arange(6) < joints)
        path = solve_path(through("ur5", home + np.cumsum(steps, axis=0)))
        (group,) = path.groups
        along_curve = float(time_group(path, smoothed(path, group)).lengths.sum())
        assert Ruckig().parametrize(path).duration <= SLOWER * along_curve


def scattered(rng: np.random.Generator, joints: int) -> FloatArray:
    return rng.uniform(-1.0, 1.0, (int(rng.integers(3, 9)), joints))


def dense(rng: np.random.Generator, joints: int) -> FloatArray:
    angles = np.linspace(0.0, rng.uniform(0.5, 3.0), int(rng.integers(8, 40)))[:, None]
    return 0.6 * np.sin(angles * rng.uniform(0.2, 1.5, joints) + rng.uniform(-3.0, 3.0, joints))


def on_a_line(rng: np.random.Generator, joints: int) -> FloatArray:
    shares = np.sort(rng.uniform(0.0, 1.0, (int(rng.integers(3, 30)), 1)), axis=0)
    return rng.uniform(-0.5, 0.5, joints) + shares * rng.uniform(-0.8, 0.8, joints)


def of_one_joint(rng: np.random.Generator, joints: int) -> FloatArray:
    positions = np.zeros((int(rng.integers(3, 9)), joints))
    positions[:, rng.integers(joints)] = rng.uniform(-1.0, 1.0, len(positions))
    return positions


LIMITS = (Limits(), Limits(tcp_linear_velocity=0.2))
SHAPES = (scattered, dense, on_a_line, of_one_joint)


@pytest.mark.long_table
@pytest.mark.parametrize("limits", LIMITS)
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("robot_id", ["ur5", "welding_arm"])
def test_auto_is_no_slower_than_what_keeps_all_limits(robot_id: str, shape: Shape, limits: Limits) -> None:
    robot, rng = load_robot(robot_id), np.random.default_rng([len(robot_id), len(shape.__name__)])
    for _ in range(2):
        away = shape(rng, robot.dof)
        lower, upper = np.maximum(robot.limit("lower"), -2.0), np.minimum(robot.limit("upper"), 2.0)
        problem = through(robot_id, (lower + upper) / 2.0 + away * (upper - lower) / 2.0 * 0.8, limits)
        own, *others = (
            plan(problem, backend).trajectory.duration
            for backend in (Auto(), Ruckig(), Quintic(), Toppra(jerk_limited=True))
        )
        assert own <= SLOWER * min(others)
