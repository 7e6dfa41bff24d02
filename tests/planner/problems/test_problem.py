"""Problems made by people: lists and arrays are accepted, and stored values cannot change."""

from __future__ import annotations

import numpy as np
import pytest

from planner.errors import ConfigurationChange, InvalidProblem
from planner.kinematics import Configuration, all_solutions, forward_kinematics, manipulability, tool_pose
from planner.kinematics.options import InverseKinematicsOptions
from planner.planning import plan
from planner.problems.motion_around import FreeMotion
from planner.problems.moves import CartesianMove
from planner.problems.problem import (
    AnyWaypoint,
    JointMotion,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.robots import load_robot
from planner.spatial import Pose, quaternion

HOME, PICK = (0.0, -1.5, 1.5, 0.0, 0.5, 0.0), (1.0, -1.2, 1.2, 0.0, 0.5, 0.5)


def test_a_joint_position_is_kept_as_numbers() -> None:
    row = np.array(PICK)
    waypoints = [JointWaypoint(row), JointWaypoint(list(PICK)), JointWaypoint(position=PICK)]
    row[:] = 0.0
    assert [waypoint.position for waypoint in waypoints] == [PICK] * 3
    assert len(set(waypoints)) == 1


def test_a_named_position_is_a_joint_waypoint() -> None:
    robot = load_robot("kuka_kr16_2").derived(named_positions={"home": HOME})
    waypoint = JointWaypoint.named(robot, "home", dwell=2.0)
    assert waypoint == JointWaypoint(HOME, "home", dwell=2.0)
    with pytest.raises(InvalidProblem, match="no position called 'rest'; it has home"):
        JointWaypoint.named(robot, "rest")


def test_a_named_position_is_not_moved_by_a_remedy() -> None:
    """A line leads to another configuration, whose end has a name or numbers."""
    robot = load_robot("kuka_kr16_2")
    start = tool_pose(robot, HOME)
    above = Pose(start.position + np.array([0.0, 0.0, 0.1]), start.rotation)
    end = next(q for q in all_solutions(robot, above) if abs(q[2] - HOME[2]) > 1.0)
    named = robot.derived(named_positions={"above": end})
    changes = []
    for waypoint in (
        JointWaypoint(end, motion=LinearMotion()),
        JointWaypoint.named(named, "above", motion=LinearMotion()),
    ):
        with pytest.raises(ConfigurationChange) as refused:
            plan(PlanningProblem(named, [JointWaypoint(HOME), waypoint]))
        offered = (*refused.value.remedies, *refused.value.hints)
        changes.append({remedy.field for remedy in offered})
    assert ("waypoints", 1, "position") in changes[0]
    assert ("waypoints", 1, "position") not in changes[1]


def test_a_list_of_waypoints_is_kept_as_it_was() -> None:
    waypoints = [JointWaypoint(HOME), JointWaypoint(PICK)]
    problem = PlanningProblem(load_robot("kuka_kr16_2"), waypoints)
    waypoints.clear()
    assert problem.waypoints == (JointWaypoint(HOME), JointWaypoint(PICK))


def test_poses_of_lists_and_arrays_are_the_same() -> None:
    robot = load_robot("kuka_kr16_2")
    there = tool_pose(robot, PICK)
    assert there.rotation is not None
    written = [
        Pose(there.position, there.rotation),
        Pose(there.position.tolist(), there.rotation.tolist()),
        Pose.from_quaternion(there.position.tolist(), (2.0 * quaternion(there.rotation)).tolist()),
    ]
    ends = [plan(PlanningProblem(robot, [JointWaypoint(HOME), PoseWaypoint(pose)])).path.positions for pose in written]
    assert np.allclose(ends[0], ends[1:], atol=1e-9)


def test_angles_about_the_fixed_axes() -> None:
    """The convention is URDF's: roll about x first, yaw about z last."""
    R = Pose.from_rpy([0.0, 0.0, 0.0], [np.pi / 2.0, 0.0, np.pi / 2.0]).rotation
    assert R is not None
    assert np.allclose(R @ [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    assert np.allclose(R @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])


def test_one_position_is_a_row_of_many() -> None:
    robot = load_robot("kuka_kr16_2")
    measures = manipulability(robot, [HOME, PICK])
    assert measures.shape == (2,)
    assert manipulability(robot, PICK) == measures[1]
    assert np.array_equal(forward_kinematics(robot, [HOME, PICK])[1].position, tool_pose(robot, PICK).position)


def test_positions_and_poses_that_are_no_numbers_are_refused() -> None:
    """Their faults name the waypoint, before any back end is called."""
    robot = load_robot("kuka_kr16_2")
    no_number = [JointWaypoint((np.nan, *HOME[1:])), JointWaypoint((np.inf, *HOME[1:]))]
    nowhere = [PoseWaypoint(Pose([np.nan, 0.0, 1.0])), PoseWaypoint(Pose([1.0, 0.0, 1.0], np.full((3, 3), np.nan)))]
    for waypoint in (*no_number, *nowhere):
        with pytest.raises(InvalidProblem) as refused:
            plan(PlanningProblem(robot, [JointWaypoint(HOME), waypoint]))
        field = "position" if isinstance(waypoint, JointWaypoint) else "pose"
        assert [fault.field for fault in refused.value.faults] == [("waypoints", 1, field)]


@pytest.mark.parametrize(
    ("waypoint", "field"),
    [
        (JointWaypoint(PICK, motion=FreeMotion(optimise="foo")), ("motion", "optimise")),  # type: ignore[arg-type]
        (JointWaypoint(PICK, motion=JointMotion("shortest")), ("motion", "turns")),  # type: ignore[arg-type]
        (JointWaypoint(PICK, motion=LinearMotion(singularity="avoid")), ("motion", "singularity")),  # type: ignore[arg-type]
        (JointWaypoint(PICK, motion=LinearMotion(free="rotation_x")), ("motion", "free")),  # type: ignore[arg-type]
        (PoseWaypoint(Pose([1.0, 0.0, 1.0], np.eye(3)), free="all"), ("free",)),  # type: ignore[arg-type]
        (RelativeWaypoint(CartesianMove((0.0, 0.0, 0.1)), frame="world"), ("frame",)),  # type: ignore[arg-type]
        (
            PoseWaypoint(Pose([1.0, 0.0, 1.0]), Configuration(elbow="left")),  # type: ignore[arg-type]
            ("configuration", "elbow"),
        ),
    ],
    ids=lambda value: ".".join(value) if isinstance(value, tuple) else "",
)
def test_what_is_none_of_the_names_is_refused_and_not_taken_for_one(
    waypoint: AnyWaypoint, field: tuple[str, ...]
) -> None:
    """An unknown objective was taken for effort, and unknown axes for the axes of the base."""
    with pytest.raises(InvalidProblem) as refused:
        plan(PlanningProblem(load_robot("kuka_kr16_2"), [JointWaypoint(HOME), waypoint]))
    assert [fault.field for fault in refused.value.faults] == [("waypoints", 1, *field)]


def test_a_preference_that_there_is_not_is_refused() -> None:
    options = InverseKinematicsOptions(prefer="beauty")  # type: ignore[arg-type]
    with pytest.raises(InvalidProblem) as refused:
        plan(PlanningProblem(load_robot("kuka_kr16_2"), [JointWaypoint(HOME)], inverse_kinematics=options))
    (fault,) = refused.value.faults
    assert fault.field == ("inverse_kinematics", "prefer")
    assert "manipulability" in fault.message
