"""Reachability of waypoints, one by one."""

from __future__ import annotations

import numpy as np
import pytest

from planner.certificate.clearance import at_rest
from planner.errors import InvalidProblem, UnreachableWaypoint
from planner.fields import KIND
from planner.kinematics import Pose, all_solutions, forward_kinematics
from planner.kinematics.options import InverseKinematicsOptions
from planner.problems.moves import CartesianMove
from planner.problems.problem import JointWaypoint, PoseWaypoint, RelativeWaypoint
from planner.robots import DHJoint, Robot, load_robot
from planner.scene import Attach, CollisionChecker, Scene, SceneObject
from planner.shapes import Box, Sphere
from planner.spatial import FloatArray
from planner.waypoints.reachability import LimitMargin, reachability
from tests.planner.scene.brute_force import distances_over_time

OPTIONS = InverseKinematicsOptions()


def elbow_arm() -> Robot:
    """Return two links of 1 m in a plane; the elbow bends by 2.5 rad to either side."""
    joints = (DHJoint("revolute", a=1.0, lower=-3.0, upper=2.0), DHJoint("revolute", a=1.0, lower=-2.5, upper=2.5))
    return Robot.from_dh(joints)


def point(q1: float, q2: float) -> PoseWaypoint:
    """Compute the position of the arm's tip by hand."""
    return PoseWaypoint(pose=Pose(np.array([np.cos(q1) + np.cos(q1 + q2), np.sin(q1) + np.sin(q1 + q2), 0.0])))


def test_the_margin_is_that_of_the_solution_furthest_from_the_limits() -> None:
    # (1.9, -1.0) has 0.1 rad left in joint 1; its other elbow, (0.9, 1.0), 1.1 rad there and 1.5 rad in joint 2.
    (answer,) = reachability(elbow_arm(), [point(1.9, -1.0)], OPTIONS)
    assert answer.error is None
    assert answer.solutions == 2
    assert answer.best == pytest.approx([0.9, 1.0], abs=1e-6)
    assert answer.limit_margin == LimitMargin("joint_1", pytest.approx(1.1, abs=1e-6))
    assert answer.manipulability is not None
    # Yoshikawa (1985), of an arm with two links: l1 l2 |sin q2|.
    assert answer.manipulability == pytest.approx(np.sin(1.0), abs=1e-6)


def test_a_robot_without_limits_has_no_margin_and_a_continuum_no_count() -> None:
    free, bound = load_robot("ngv_refuelling_arm"), load_robot("kuka_kr16_l6_2")
    q = np.array([0.3, -1.2, 1.1, 0.4, 0.7, -0.5])
    waypoints = [PoseWaypoint(pose=Pose(forward_kinematics(robot, q[None])[0].position)) for robot in (free, bound)]
    (answer,) = reachability(free, waypoints[:1], OPTIONS)
    assert (answer.error, answer.solutions, answer.limit_margin) == (None, None, None)
    (answer,) = reachability(bound, waypoints[1:], OPTIONS)
    assert answer.solutions is None
    assert answer.limit_margin is not None


def test_one_bad_waypoint_does_not_keep_the_others_from_being_looked_at() -> None:
    robot = elbow_arm()
    far = PoseWaypoint(pose=Pose(np.array([3.0, 0.0, 0.0])))
    back = RelativeWaypoint(frame="base", move=CartesianMove((-1.5, 0.0, 0.0)))
    folded = PoseWaypoint(pose=Pose(np.array([0.1, 0.0, 0.0])))  # needs the elbow at 3.04 rad
    outside = JointWaypoint(position=(2.1, 0.0))
    answers = reachability(robot, [far, back, folded, outside, point(0.3, 0.4)], OPTIONS)
    codes = [None if answer.error is None else answer.error.code for answer in answers]
    assert codes == ["unreachable_waypoint", None, "joint_position_limit", "joint_position_limit", None]
    assert [answer.solutions for answer in answers] == [0, 2, 0, None, 2]
    assert answers[0].nearest is not None
    assert answers[0].nearest.position_error == pytest.approx(1.0, abs=1e-6)


def test_a_move_in_the_axes_of_an_open_orientation() -> None:
    """The move starts from the best solution, or without a solution from the nearest pose."""
    robot = elbow_arm()
    ahead = RelativeWaypoint(frame="tool", move=CartesianMove((0.2, 0.0, 0.0)))
    first, second = reachability(robot, [point(1.9, -1.0), ahead], OPTIONS)
    assert first.best is not None
    assert second.best is not None
    along = np.array([np.cos(1.9), np.sin(1.9), 0.0])  # the second link of (0.9, 1.0)
    expected = point(0.9, 1.0).pose.position + 0.2 * along
    assert forward_kinematics(robot, second.best[None])[0].position == pytest.approx(expected, abs=1e-6)
    far = PoseWaypoint(pose=Pose(np.array([0.0, 3.0, 0.0])))  # nearest when stretched along y
    beyond = reachability(robot, [far, ahead], OPTIONS)[1]
    assert isinstance(beyond.error, UnreachableWaypoint)
    assert beyond.nearest is not None
    assert beyond.nearest.position_error == pytest.approx(1.2, abs=1e-5)


def test_what_cannot_be_asked_is_refused() -> None:
    robot = elbow_arm()
    move = RelativeWaypoint(frame="base", move=CartesianMove((0.0, 0.0, 0.1)))
    with pytest.raises(InvalidProblem) as refusal:
        reachability(robot, [move, JointWaypoint(position=(0.1,))], InverseKinematicsOptions(reference=(0.0,)))
    assert [field for field, _ in refusal.value.faults] == [
        ("waypoints", 1, "position"),
        ("waypoints", 0, KIND),
        ("inverse_kinematics", "reference"),
    ]


OVER_A_TABLE = load_robot("welding_arm")
TABLE = SceneObject("table", [Box([1.0, 2.0, 0.05])], Pose(np.array([1.4, 0.0, 0.55])))


def is_clear(scene: Scene, position: FloatArray) -> bool:
    """Tell whether joint positions are collision-free, by closed forms and Pinocchio's kinematics."""
    apart = distances_over_time(OVER_A_TABLE, scene, np.zeros(1), at_rest(position))
    return bool(np.nanmin(apart) > scene.margin)


def test_solutions_that_keep_clear_are_counted_and_the_best_is_one_of_them() -> None:
    scene = Scene([TABLE], margin=0.01)
    poses = [Pose.from_rpy([1.1, y, 0.8], [0.0, 2.5, 0.0]) for y in (-0.3, 0.1, 0.3)]
    answers = reachability(OVER_A_TABLE, [PoseWaypoint(pose) for pose in poses], OPTIONS, scene=scene)
    for pose, answer in zip(poses, answers, strict=True):
        known = all_solutions(OVER_A_TABLE, pose)
        clear = [position for position in known if is_clear(scene, position)]
        assert 0 < len(clear) < len(known)
        assert (answer.solutions, answer.free, answer.free_solutions) == (len(known), True, len(clear))
        assert answer.best is not None and is_clear(scene, answer.best) and answer.hindered_by == ()
    (plain, *_) = reachability(OVER_A_TABLE, [PoseWaypoint(poses[0])], OPTIONS)
    assert (plain.free, plain.free_solutions, plain.hindered_by) == (None, None, ())


def test_what_hinders_a_pose_without_a_free_solution_is_named() -> None:
    """A block at the tool blocks every solution; a lamp over the table only the solutions with the elbow up."""
    pose = Pose.from_rpy([1.1, 0.3, 0.8], [0.0, 2.5, 0.0])
    block = SceneObject("block", [Box([0.1, 0.1, 0.1])], Pose(pose.position))
    (answer,) = reachability(OVER_A_TABLE, [PoseWaypoint(pose)], OPTIONS, scene=Scene([block]))
    assert (answer.error, answer.free, answer.free_solutions) == (None, False, 0)
    assert answer.solutions == 4 and answer.best is not None
    assert {found.pair[1] for found in answer.hindered_by} == {"block"}
    up = next(q for q in all_solutions(OVER_A_TABLE, pose) if is_clear(Scene([TABLE]), q))
    elbow = CollisionChecker(OVER_A_TABLE).bodies.at(up[None]).origins[0, 3]
    lamp = SceneObject("lamp", [Sphere(0.05)], Pose(elbow))
    (answer,) = reachability(OVER_A_TABLE, [PoseWaypoint(pose)], OPTIONS, scene=Scene([TABLE, lamp]))
    assert answer.free is False
    assert {found.pair[1] for found in answer.hindered_by} == {"table", "lamp"}
    depths = [found.depth for found in answer.hindered_by]
    assert depths == sorted(depths) and depths[0] > 0.0


def test_joint_waypoints_and_poses_out_of_reach_are_held_against_a_scene_too() -> None:
    scene = Scene([TABLE])
    pose = Pose.from_rpy([1.1, 0.3, 0.8], [0.0, 2.5, 0.0])
    both = sorted(all_solutions(OVER_A_TABLE, pose), key=lambda q: is_clear(scene, q))
    waypoints = [
        JointWaypoint(position=tuple(both[0])),
        JointWaypoint(position=tuple(both[-1])),
        PoseWaypoint(Pose(np.array([5.0, 0.0, 0.0]))),
    ]
    answers = reachability(OVER_A_TABLE, waypoints, OPTIONS, scene=scene)
    assert [answer.free for answer in answers] == [False, True, False]
    assert [answer.free_solutions for answer in answers] == [None, None, 0]
    assert [len(answer.hindered_by) for answer in answers] == [1, 0, 0]


def test_what_is_taken_at_a_waypoint_may_touch_there() -> None:
    pose = Pose.from_rpy([1.1, 0.3, 0.8], [0.0, 2.5, 0.0])
    part = SceneObject("part", [Sphere(0.05)], Pose(pose.position))
    taken = PoseWaypoint(pose, attach=[Attach("part")])
    for waypoint, free in ((PoseWaypoint(pose), False), (taken, True)):
        (answer,) = reachability(OVER_A_TABLE, [waypoint], OPTIONS, scene=Scene([part]))
        assert answer.free is free
    with pytest.raises(InvalidProblem) as refusal:
        reachability(OVER_A_TABLE, [taken], OPTIONS, scene=Scene())
    assert refusal.value.faults[0].field == ("waypoints", 0, "attach", 0, "id")


def test_self_collision_alone_is_held_against_where_it_is_asked() -> None:
    """A planar arm has two links and a crossbar, whose end lies on its first link where the elbow is folded."""
    joints = [DHJoint("revolute", a=1.0, lower=-3.1, upper=3.1) for _ in range(4)]
    robot = Robot.from_dh(joints)
    square = tuple(
        np.array([0.0, 1.0, 1.0, 1.0]) * np.pi / 2.0
    )  # its four links close to a square: the tip is at the base
    straight = (0.0, 0.1, 0.1, 0.1)
    waypoints = [JointWaypoint(position=position) for position in (straight, square)]
    answers = reachability(robot, waypoints, OPTIONS, self_collision=True)
    assert [answer.free for answer in answers] == [True, False]
    assert set(answers[1].hindered_by[0].pair) == {"link_1", "link_4"}
    assert [answer.free for answer in reachability(robot, waypoints, OPTIONS)] == [None, None]
