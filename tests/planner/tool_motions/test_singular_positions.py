"""Lines and circles of the tool that start at, end at or go through a singular joint position.

The truth is an independent chain of joint positions along the path (damped Newton steps from Pinocchio's Jacobians).
Where the wrist is stretched and the path in the plane of the arm, it is known: axes 4 and 6 stand still.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from benchmarks.corpus.corpus import job
from benchmarks.corpus.tracing import on_circle, on_line, reach, tool_at, trace
from planner.backends import Cubic
from planner.errors import SingularPath, UnreachableWaypoint
from planner.planning import plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import (
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.robots import catalogue_ids, load_robot
from planner.spatial import FloatArray, Pose, rotation_from_rpy
from tests.documents.published import document

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.problems.problem import AnyWaypoint, Frame
    from planner.robots import Robot
    from planner.tool_motions.tool_motion import ToolMotion

HOMES = {
    "kuka_kr16_l6_2": (0.3, -1.2, 1.4, 0.0, 0.0, 0.0),
    "kuka_kr16_2": (-0.7, -1.3, 1.2, 0.0, 0.0, 0.0),
    "ngv_refuelling_arm": (0.3, -0.4, 1.0, 0.0, 0.0, 0.0),
}
"""Stretched wrists: with axis 5 at zero, axes 4 and 6 coincide."""

SHIFTS = {
    "down": (0.0, 0.0, -0.07),
    "up": (0.0, 0.0, 0.06),
    "in": (-0.1, 0.0, 0.0),
    "out": (0.06, 0.0, 0.0),
    "aslant": (-0.06, 0.0, -0.08),
}
"""Shifts outwards, aside and up, m."""


def shifted(pose: Pose, shift: Sequence[float]) -> Pose:
    """Return the pose moved outwards, aside and up, in the plane of the arm unless aside."""
    outwards = pose.position * [1.0, 1.0, 0.0] / np.hypot(*pose.position[:2])
    axes = np.column_stack([outwards, np.cross([0.0, 0.0, 1.0], outwards), [0.0, 0.0, 1.0]])
    return Pose(pose.position + axes @ np.array(shift), pose.rotation)


def joints(q: Sequence[float] | FloatArray, motion: LinearMotion | None = None) -> JointWaypoint:
    position = tuple(float(value) for value in q)
    return JointWaypoint(position=position) if motion is None else JointWaypoint(position=position, motion=motion)


def line(pose: Pose) -> PoseWaypoint:
    return PoseWaypoint(pose=pose, motion=LinearMotion())


def motions(robot: Robot, waypoints: Sequence[AnyWaypoint]) -> list[ToolMotion]:
    """Return the motions of a certified plan."""
    made = plan(PlanningProblem(robot, tuple(waypoints)), Cubic())
    assert made.certificate.satisfied
    return [waypoint.tool_motion for waypoint in made.path.waypoints if waypoint.tool_motion is not None]


def is_traced(robot: Robot, motion: ToolMotion, poses: Sequence[Pose], start: FloatArray) -> None:
    """Assert that the joint path is the traced chain of joint positions, with bounded derivatives."""
    chain = trace(robot, poses, start)
    assert chain is not None
    u = np.linspace(0.0, 1.0, len(poses) + 1)
    q, first, second = motion.curve.evaluate(u, [0, 1, 2])
    assert np.abs(q[1:] - chain).max() < 1e-4
    assert np.abs(first).max() < 10.0
    assert np.abs(second).max() < 100.0


@pytest.mark.long_table
@pytest.mark.parametrize("way", SHIFTS)
@pytest.mark.parametrize("name", HOMES)
def test_a_line_out_of_a_stretched_wrist_and_back(name: str, way: str) -> None:
    robot, home = load_robot(name), np.array(HOMES[name])
    start = tool_at(robot, home)
    away = shifted(start, SHIFTS[way])
    out, back = motions(robot, [joints(home), line(away), joints(home, LinearMotion())])
    is_traced(robot, out, on_line(start, away), home)
    is_traced(robot, back, on_line(away, start), out.end)
    for motion in (out, back):
        q = motion.curve.evaluate(np.linspace(0.0, 1.0, 200), [0])[0]
        assert np.abs(q[:, [0, 3, 5]] - home[[0, 3, 5]]).max() < 1e-7


@pytest.mark.parametrize(("frame", "translation"), [("tool", (0.0, 0.0, -0.1)), ("base", (0.0, 0.0, -0.1))])
def test_100_mm_of_retreat_and_100_mm_down_from_home(frame: Frame, translation: tuple[float, float, float]) -> None:
    """At the home position of most machines, axes 4 and 6 stand still."""
    robot, home = load_robot("kuka_kr16_l6_2"), np.array(HOMES["kuka_kr16_l6_2"])
    start = tool_at(robot, home)
    move = start.rotation @ translation if frame == "tool" and start.rotation is not None else translation
    (motion,) = motions(
        robot,
        [joints(home), RelativeWaypoint(frame=frame, move=CartesianMove(translation), motion=LinearMotion())],
    )
    is_traced(robot, motion, on_line(start, Pose(start.position + move, start.rotation)), home)
    assert np.abs(motion.end[[3, 5]]).max() < 1e-7


@pytest.mark.skipif("ur5" not in catalogue_ids(), reason="example-robot-data is not installed")
@pytest.mark.parametrize("way", [*SHIFTS, "aside"])
def test_a_line_out_of_a_straight_wrist_of_a_ur5(way: str) -> None:
    """Lines in the plane of the arm keep the wrist straight, with four axes for three directions; others leave it."""
    robot, home = load_robot("ur5"), np.array((0.3, -1.2, 1.4, -0.2, 0.0, 0.0))
    start = tool_at(robot, home)
    away = shifted(start, SHIFTS.get(way, (0.0, 0.03, 0.0)))
    assert trace(robot, on_line(start, away, 0.002), home) is not None
    out, back = motions(robot, [joints(home), line(away), joints(home, LinearMotion())])
    for motion in (out, back):
        _, first, second = motion.curve.evaluate(np.linspace(0.0, 1.0, 200), [0, 1, 2])
        assert np.abs(first).max() < 10.0
        assert np.abs(second).max() < 100.0


@pytest.mark.long_table
@pytest.mark.parametrize("way", SHIFTS)
def test_a_line_from_the_pose_of_a_stretched_wrist(way: str) -> None:
    """The pose has a continuum of solutions, and few of them lead along the line."""
    robot, home = load_robot("kuka_kr16_l6_2"), np.array(HOMES["kuka_kr16_l6_2"])
    start = tool_at(robot, home)
    away = shifted(start, SHIFTS[way])
    motions(robot, [PoseWaypoint(pose=start), line(away)])
    motions(robot, [PoseWaypoint(pose=away), line(start)])


@pytest.mark.parametrize("end", [(0.3, -1.2, 1.4, 0.0, -0.3, 0.0), (0.3, -1.1, 1.3, 0.0, -0.2, 0.0)])
@pytest.mark.parametrize("aside", [0.0, 1e-12, 1e-7])
def test_a_line_right_through_a_stretched_wrist(end: tuple[float, ...], aside: float) -> None:
    """Axis 5 changes its sign and axes 4 and 6 stand still, to the tolerance of poses."""
    robot, start = load_robot("kuka_kr16_l6_2"), np.array((0.3, -1.2, 1.4, 0.0, 0.3, 0.0))
    turn = rotation_from_rpy(0.0, 0.0, aside)
    poses = [tool_at(robot, q) for q in (start, np.array(end))]
    turned = [Pose(pose.position, turn @ pose.rotation) for pose in poses]
    (motion,) = motions(robot, [joints(start), line(turned[1])])
    is_traced(robot, motion, on_line(poses[0], poses[1]), start)
    assert motion.end == pytest.approx(np.array(end), abs=1e-4)


@pytest.mark.parametrize("name", HOMES)
def test_a_circle_out_of_a_stretched_wrist(name: str) -> None:
    """The circle is in the plane of the arm."""
    robot, home = load_robot(name), np.array(HOMES[name])
    start = tool_at(robot, home)
    via, end = shifted(start, (-0.04, 0.0, -0.02)), shifted(start, (-0.05, 0.0, -0.08))
    goal = PoseWaypoint(pose=end, motion=CircularMotion(Pose(via.position)))
    (motion,) = motions(robot, [joints(home), goal])
    is_traced(robot, motion, on_circle(start, via.position, end), home)


def test_a_circle_that_leaves_the_plane_of_the_arm_smoothly() -> None:
    """The circle touches the plane of the arm at its start.

    Only the second derivative of the circle decides the rate of axis 4 from there on. Solved backwards from a regular
    joint position, joint positions tend to the same rate.
    """
    robot, home = load_robot("kuka_kr16_l6_2"), np.array(HOMES["kuka_kr16_l6_2"])
    start = tool_at(robot, home)
    via, end = (shifted(start, (-0.2 * np.sin(a), 0.2 * (1.0 - np.cos(a)), 0.0)) for a in (0.2, 0.4))
    goal = PoseWaypoint(pose=end, motion=CircularMotion(Pose(via.position)))
    (motion,) = motions(robot, [joints(home), goal])
    q = motion.curve.evaluate(np.array([0.0, 1e-3, 0.5, 1.0]), [0, 1])
    assert np.abs(q[1]).max() < 10.0
    assert np.abs(q[1][0, 3] - q[1][1, 3]) < 0.05 * np.abs(q[1][0, 3])
    assert np.abs(q[1][0, 3]) > 0.05
    poses = on_circle(start, via.position, end, 0.001)
    chain = trace(robot, poses[::-1][1:], motion.end)
    assert chain is not None
    regular = len(poses) // 2
    exact = motion.curve.evaluate(np.arange(len(poses) - 1, regular, -1) / len(poses), [0])[0]
    assert np.abs(exact - chain[: len(exact)]).max() < 1e-3


@pytest.mark.parametrize("name", HOMES)
def test_a_line_out_of_the_plane_of_a_stretched_wrist_is_singular(name: str) -> None:
    """Axis 4 would have to jump to a right angle."""
    robot, home = load_robot(name), np.array(HOMES[name])
    away = shifted(tool_at(robot, home), (0.0, 0.1, 0.0))
    with pytest.raises(SingularPath) as refusal:
        motions(robot, [joints(home), line(away)])
    assert refusal.value.path_point is not None
    assert refusal.value.path_point.fraction == 0.0
    assert refusal.value.joint in {robot.joint_names[3], robot.joint_names[5]}


@pytest.mark.skipif("panda" not in catalogue_ids(), reason="example-robot-data is not installed")
def test_a_circle_out_of_the_work_space_is_unreachable() -> None:
    """It passes a point 20 % beyond all links end to end; the arm is singular before."""
    requested = job("infeasible-01-panda")
    with pytest.raises(UnreachableWaypoint):
        plan(requested.problem, Cubic())


def test_a_line_out_of_a_stretched_elbow_is_singular() -> None:
    """Inwards from the farthest point the elbow follows a square root, whose derivative is unbounded."""
    robot = load_robot("three_dof_arm")
    home = np.array((0.3, -0.9, 0.0))
    start = tool_at(robot, home)
    with pytest.raises(SingularPath) as refusal:
        motions(robot, [joints(home), line(Pose(0.9 * start.position))])
    assert refusal.value.path_point is not None
    assert refusal.value.path_point.fraction == 0.0


@pytest.mark.long_table
@pytest.mark.parametrize("pair", [(3, 4), (4, 3), (3, 5), (5, 3), (4, 5), (5, 4)])
def test_lines_between_the_test_points_of_the_date_sorting_arm(pair: tuple[int, int]) -> None:
    """Table 2 of document 004 has the test points.

    In points 3 and 5 theta3 is zero, so that theta2 and theta4 are one. To and from point 4 theta1 has to be -180
    degrees, as a chain traced along the line shows.
    """
    robot = load_robot("date_sorting_arm")
    start, end = (tool_at(robot, table_2(k)) for k in pair)
    (motion,) = motions(robot, [PoseWaypoint(pose=start), line(end)])
    if 4 in pair:
        regular, other = (end, start) if pair[1] == 4 else (start, end)
        (first,) = motion.curve.evaluate(np.array([float(pair[1] == 4)]), [0])[0]
        assert first[0] == pytest.approx(-np.pi, abs=1e-6)
        poses = on_line(regular, other)[:-1]
        chain_at_limits(robot, poses, first)
    else:
        q = motion.curve.evaluate(np.linspace(0.0, 1.0, 101), [0])[0]
        chain = chain_at_limits(robot, on_line(start, end), q[0])
        assert np.abs(q[-1] - chain[-1]).max() < 1e-4


def chain_at_limits(robot: Robot, poses: Sequence[Pose], start: FloatArray) -> FloatArray:
    """Return the chain of joint positions along poses; unlike a traced one it may come near the limits."""
    chain = [start]
    for pose in poses:
        q = reach(robot, pose, chain[-1])
        assert q is not None
        chain.append(q)
    found = np.array(chain[1:])
    assert (found >= robot.limit("lower") - 1e-6).all()
    assert (found <= robot.limit("upper") + 1e-6).all()
    return found


def table_2(k: int) -> FloatArray:
    """Return joint positions (joints,) of a row of Table 2, rad and m."""
    point = next(row for row in document("date_sorting")["test_points"]["points"] if row["point"] == k)
    angles = np.radians([point[f"theta{i}_deg"] for i in (1, 2, 3, 4)])
    return np.array([angles[0], point["l1_mm"] / 1e3, point["l2_mm"] / 1e3, *angles[1:]])


@pytest.mark.parametrize("by_joints", [True, False])
def test_transition_2_of_the_date_sorting_arm_with_a_radial_gripper(by_joints: bool) -> None:
    """Section 8.5 of document 004: theta2 and theta4 stand still, theta3 goes from 0 to 1.82 degrees and back."""
    robot = load_robot("date_sorting_arm")
    radii, turns, heights = (np.hypot(0.5, 0.5), 0.786), (-np.pi / 4.0, -np.pi / 2.0), (0.2, 0.222)
    ends = [np.array([turns[i], heights[i], radii[i] - 0.3, 0.0, 0.0, 0.0]) for i in (0, 1)]
    poses = [tool_at(robot, q) for q in ends]
    assert poses[0].position == pytest.approx([0.5, 0.5, 1.0])
    assert poses[1].position == pytest.approx([0.786, 0.0, 1.022])
    (motion,) = motions(robot, [joints(ends[0]) if by_joints else PoseWaypoint(pose=poses[0]), line(poses[1])])
    if not by_joints:
        return
    chain = chain_at_limits(robot, on_line(*poses), ends[0])
    exact = motion.curve.evaluate(np.linspace(0.0, 1.0, len(chain) + 1), [0])[0]
    assert np.abs(exact[1:] - chain).max() < 1e-4
    q = motion.curve.evaluate(np.linspace(0.0, 1.0, 400), [0])[0]
    assert np.abs(q[:, [3, 5]]).max() < 1e-7
    assert np.degrees(np.abs(q[:, 4]).max()) == pytest.approx(1.82, abs=0.01)
    assert motion.end == pytest.approx(ends[1], abs=1e-6)
