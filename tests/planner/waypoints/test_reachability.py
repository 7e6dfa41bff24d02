"""Which waypoints can be reached, each by itself."""

from __future__ import annotations

import numpy as np
import pytest

from planner.errors import InvalidProblem, UnreachableWaypoint
from planner.fields import KIND
from planner.kinematics import Pose, forward_kinematics
from planner.kinematics.options import InverseKinematicsOptions
from planner.problem import CartesianMove, JointWaypoint, PoseWaypoint, RelativeWaypoint
from planner.robots import DHJoint, Robot, load_robot
from planner.waypoints.reachability import LimitMargin, reachability

OPTIONS = InverseKinematicsOptions()


def elbow_arm() -> Robot:
    """Two links of 1 m in a plane; the elbow bends by 2.5 rad to either side."""
    joints = (DHJoint("revolute", a=1.0, lower=-3.0, upper=2.0), DHJoint("revolute", a=1.0, lower=-2.5, upper=2.5))
    return Robot.from_dh(joints)


def point(q1: float, q2: float) -> PoseWaypoint:
    """Where the arm's tip is, by hand."""
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
    """From the best solution where there is one; from the nearest pose where there is none."""
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
