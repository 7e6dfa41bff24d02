"""Straight lines that a redundant arm can follow only with self-motions, against a traced truth."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from benchmarks.corpus.tracing import on_line, tool_at, trace
from planner.paths.joint_path import solve_path
from planner.problems.problem import AnyWaypoint, JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.robots import Robot, load_robot
from planner.spatial import FloatArray, Pose
from planner.tool_motions.follow import Lost, Track, follow
from planner.tool_motions.pose_paths import Line
from planner.tool_motions.position_limits import first_beyond
from planner.tool_motions.self_motions import follow_by_self_motions

TOLERANCE = (1e-4, 1e-3)
LINE = LinearMotion()

# The arm, the start, and the move; on the KUKA of the position alone. With a constant component in the null space, a
# joint leaves its limits, or the arm gets stuck at a position where that component and the tool fix every joint.
LINES: list[tuple[str, list[float], list[float]]] = [
    ("panda", [0.3, -0.8, 2.2, -2.8, 1.0, 3.2, -1.6], [0.2, 0.2, -0.3]),
    ("panda", [-2.5, -0.8, 1.9, -2.5, -0.3, 2.5, -0.5], [0.1, 0.0, -0.2]),
    ("panda", [0.5, -0.5, 0.4, -2.2, -1.2, 2.5, -0.4], [0.0, 0.2, -0.3]),
    ("panda", [-1.3, -0.1, 1.2, -1.9, -0.7, 0.7, 0.4], [0.1, -0.2, -0.1]),
    ("xarm7", [-2.7, -0.5, 0.7, 1.3, 0.4, 2.1, 2.0], [-0.2, -0.1, -0.2]),
    ("xarm7", [0.7, 0.2, 1.9, 0.9, -1.7, -0.4, -1.4], [0.1, 0.1, -0.2]),
    ("kuka_kr16_l6_2", [2.7, -1.4, -0.8, -0.8, 0.6, 3.0], [-0.2, -0.1, 0.1]),
    ("kuka_kr16_l6_2", [-2.2, 0.3, 2.4, 1.9, -1.2, -2.8], [-0.2, 0.2, -0.1]),
]


def keeps_to_line(robot: Robot, waypoints: list[AnyWaypoint], before: Pose, after: Pose) -> FloatArray:
    """Return the joint position at the end of the line, after a check of the whole line."""
    motion = solve_path(PlanningProblem(robot, tuple(waypoints))).waypoints[1].tool_motion
    assert motion is not None
    positions = motion.curve.evaluate(np.linspace(0.0, 1.0, 201), [0])[0]
    assert (positions >= robot.limit("lower") - 1e-9).all()
    assert (positions <= robot.limit("upper") + 1e-9).all()
    way = after.position - before.position
    for q in positions:
        tool = tool_at(robot, q)
        away = tool.position - before.position
        assert np.linalg.norm(away - (away @ way) / (way @ way) * way) < TOLERANCE[0]
        if before.rotation is not None and tool.rotation is not None:
            assert np.abs(tool.rotation - before.rotation).max() < TOLERANCE[1]
    end: FloatArray = positions[-1]
    return end


@pytest.mark.long_table
@pytest.mark.parametrize(("arm", "start", "move"), LINES)
def test_a_line_is_driven_by_self_motions(arm: str, start: list[float], move: list[float]) -> None:
    """It is infeasible with a constant component in the null space; and it can end at the traced end."""
    robot, q = load_robot(arm), np.array(start)
    tool = tool_at(robot, q)
    before = tool if robot.dof == 7 else Pose(tool.position)
    after = Pose(before.position + move, before.rotation)
    kept = follow(Track(robot, Line(before, after), q, None, TOLERANCE))
    assert isinstance(kept, Lost) or first_beyond(robot, kept) is not None
    chain = trace(robot, on_line(before, after, 0.002), q)
    assert chain is not None
    end = keeps_to_line(robot, [JointWaypoint(q), PoseWaypoint(pose=after, motion=LINE)], before, after)
    assert np.linalg.norm(tool_at(robot, end).position - after.position) < 1e-6
    if robot.dof == 7:
        given = keeps_to_line(robot, [JointWaypoint(q), JointWaypoint(chain[-1], motion=LINE)], before, after)
        assert given == pytest.approx(chain[-1], abs=1e-9)


def test_following_ends_where_a_joint_has_left_its_limits() -> None:
    """Later poses could be followed, at the cost of many steps, but without use."""
    robot, start = load_robot("panda"), np.array([0.0, -0.3, 0.0, -2.2, 0.0, 2.0, 0.8])
    before = tool_at(robot, start)
    path = Line(before, Pose(before.position + np.array([-0.9, 0.0, 0.1]), before.rotation))
    lost = follow_by_self_motions(Track(robot, path, start, None, TOLERANCE))
    assert isinstance(lost, Lost)
    beyond = first_beyond(robot, lost.curve)
    assert beyond is not None
    assert 0.5 < beyond[0] < lost.u < 0.7
    assert (lost.position < robot.limit("lower")).any() or (lost.position > robot.limit("upper")).any()


# Joint positions at the poses of lists of lines: of the solutions at the first pose, few lead through all of them.
LISTS: list[list[list[float]]] = [
    [
        [2.38, 1.54, -1.55, -0.89, -2.72, 2.79, -2.46],
        [2.26, 1.58, -1.53, -0.78, -2.65, 2.75, -2.52],
        [2.82, 1.69, -1.71, -1.3, -2.17, 3.2, -2.62],
    ],
    [
        [0.02, -1.51, -1.96, -2.89, 1.32, 0.16, 2.41],
        [0.68, -1.38, -1.29, -1.99, 2.19, 0.8, 2.27],
        [0.57, -1.36, -1.12, -2.0, 2.3, 0.94, 2.26],
        [0.18, -1.06, -1.26, -2.1, 2.11, 0.98, 1.74],
        [0.03, -0.9, -1.1, -2.9, 1.61, 0.63, 0.79],
    ],
]


@pytest.mark.parametrize("positions", LISTS)
def test_a_narrow_choice_of_starts_is_found(positions: list[list[float]]) -> None:
    robot = load_robot("panda")
    poses, q = [tool_at(robot, np.array(position)) for position in positions], np.array(positions[0])
    for before, after in pairwise(poses):
        chain = trace(robot, on_line(before, after, 0.005), q)
        assert chain is not None
        q = chain[-1]
    ways = [PoseWaypoint(pose=pose, motion=LINE) for pose in poses[1:]]
    solve_path(PlanningProblem(robot, (PoseWaypoint(pose=poses[0]), *ways)))
