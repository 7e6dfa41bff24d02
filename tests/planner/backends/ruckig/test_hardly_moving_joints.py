"""Joints that hardly move, or only by rounding, while others travel cause no refusal and no slower motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from planner.backends import Ruckig
from planner.errors import UnreachableWaypoint
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem, PoseWaypoint
from planner.robots import Robot, load_robot
from planner.spatial import Pose, rotation_from_rpy
from tests.planner.backends.ruckig.ruckig_problems import assert_within_limits, passing
from tests.sizes import SIZE

TOOL_DOWN = rotation_from_rpy(0.0, np.pi, 0.0)


def through_joints(robot: Robot, positions: Sequence[np.ndarray]) -> PlanningProblem:
    waypoints = tuple(JointWaypoint(position=tuple(np.asarray(q, dtype=float).tolist())) for q in positions)
    return passing(PlanningProblem(robot, waypoints))


def through_poses(robot: Robot, places: Sequence[Sequence[float]]) -> PlanningProblem:
    """Return a problem through positions of the tool, m, pointing down."""
    waypoints = tuple(PoseWaypoint(pose=Pose(np.array(place), TOOL_DOWN)) for place in places)
    return passing(PlanningProblem(robot, waypoints))


def assert_planned(problem: PlanningProblem) -> float:
    """Assert all limits and a duration no longer than with stops; return the duration, s."""
    result = plan(problem, Ruckig())
    assert_within_limits(result)
    stops = replace(problem, waypoints=tuple(JointWaypoint(position=tuple(q)) for q in result.path.positions.tolist()))
    assert result.trajectory.duration <= plan(stops, Ruckig()).trajectory.duration * (1.0 + 1e-9)
    return result.trajectory.duration


def test_case_ruckig_tool_down() -> None:
    """Three poses of the KUKA whose wrist hardly moves were refused for limits that were not requested."""
    robot = load_robot("kuka_kr16_2")
    assert assert_planned(through_poses(robot, [(0.9, -0.3, 0.6), (1.0, 0.0, 0.7), (0.9, 0.3, 0.6)])) < 0.73


def test_case_ruckig_1e_15() -> None:
    """One joint differs by 1e-15: the motion is as fast as without that difference."""
    robot = load_robot("ur5")
    positions = [
        [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
        [0.5, -1.2, 1.2, -1.5, -1.500000000000001, 0.2],
        [1.0, -1.5, 1.3, -1.4, -1.5, 0.1],
    ]
    duration = assert_planned(through_joints(robot, np.array(positions)))
    positions[1][4] = -1.5
    assert duration == pytest.approx(assert_planned(through_joints(robot, np.array(positions))), rel=1e-6)


@pytest.mark.sized
@pytest.mark.parametrize("robot_id", ["kuka_kr16_2", "ur5"])
@pytest.mark.parametrize("part", range(4))
def test_tool_down_lists_are_planned(robot_id: str, part: int) -> None:
    """Random places above a table, at one height or at several."""
    robot, rng = load_robot(robot_id), np.random.default_rng(part)
    reach = 1.0 if robot_id == "kuka_kr16_2" else 0.45
    planned = 0
    while planned < max(1, SIZE.examples // 25):
        count = int(rng.integers(3, 7))
        places = rng.uniform([0.6 * reach, -0.5 * reach, 0.3], [1.1 * reach, 0.5 * reach, 0.7], (count, 3))
        if planned % 2:
            places[:, 2] = places[0, 2]
        try:
            assert_planned(through_poses(robot, places.tolist()))
        except UnreachableWaypoint:
            continue
        planned += 1


TRAVELS = (1e-16, 1e-15, 1e-12, 1e-9, 1e-7, 1e-5)


@pytest.mark.long_table
@pytest.mark.parametrize("travel", TRAVELS)
@pytest.mark.parametrize("still", ["one", "half", "all but one"])
def test_how_little_a_joint_moves_does_not_matter(still: str, travel: float) -> None:
    """Some joints move by about `travel`, the others by any distance."""
    for seed, robot_id in enumerate(("ur5", "kuka_kr16_2", "three_dof_arm")):
        robot, rng = load_robot(robot_id), np.random.default_rng(seed)
        lower, upper = np.maximum(robot.limit("lower"), -2.0), np.minimum(robot.limit("upper"), 2.0)
        count = {"one": 1, "half": robot.dof // 2, "all but one": robot.dof - 1}[still]
        positions = rng.uniform(0.8 * lower, 0.8 * upper, (int(rng.integers(3, 6)), robot.dof))
        joints = rng.permutation(robot.dof)[:count]
        positions[:, joints] = positions[0, joints]
        at_rest = assert_planned(through_joints(robot, positions))
        positions[:, joints] += travel * rng.normal(size=(len(positions), count))
        assert assert_planned(through_joints(robot, positions)) <= at_rest * 1.02


@pytest.mark.long_table
@pytest.mark.parametrize("robot_id", ["ur5", "kuka_kr16_2", "three_dof_arm"])
@pytest.mark.parametrize("kind", ["mirrored", "equal travels", "the same travel of all", "grid", "tiny"])
def test_structured_waypoints_are_planned(kind: str, robot_id: str) -> None:
    robot = load_robot(robot_id)
    lower, upper = np.maximum(robot.limit("lower"), -2.0), np.minimum(robot.limit("upper"), 2.0)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        count = int(rng.integers(3, 6))
        positions = rng.uniform(0.8 * lower, 0.8 * upper, (count, robot.dof))
        first, steps = 0.3 * positions[0], np.arange(count)[:, None]
        if kind == "mirrored":
            positions = positions[np.arange(count) % 2]
        elif kind == "equal travels":
            positions = first + rng.uniform(-0.2, 0.2, robot.dof) * steps
        elif kind == "the same travel of all":
            positions = first + 0.1 * steps
        elif kind == "grid":
            positions = np.round(positions / 0.25) * 0.25
        else:
            positions = first + 1e-7 * rng.normal(size=positions.shape)
        assert_planned(through_joints(robot, positions))
