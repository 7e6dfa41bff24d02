"""Poses requested in a named configuration: plans end in it, and refusals are true and name the available ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.backends import Cubic
from planner.errors import (
    ConfigurationChange,
    InvalidProblem,
    JointPositionLimit,
    PlanningError,
    UnreachableWaypoint,
)
from planner.kinematics import Configuration, FloatArray, Pose, all_solutions, configurations, forward_kinematics
from planner.kinematics.options import InverseKinematicsOptions
from planner.planning import plan
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.robots import Robot, load_robot
from planner.waypoints.reachability import reachability
from tests.planner.problems_of_tests import random_position

OPTIONS = InverseKinematicsOptions()
KUKA = load_robot("kuka_kr16_l6_2")
HOME = (0.3, -1.2, 1.4, 0.2, 0.6, -0.1)


def pose_at(robot: Robot, q: FloatArray) -> Pose:
    (pose,) = forward_kinematics(robot, np.array([q]))
    return pose if robot.dof > 3 else Pose(pose.position)


def planned(robot: Robot, start: FloatArray, goal: PoseWaypoint) -> FloatArray:
    made = plan(PlanningProblem(robot, [JointWaypoint(start), goal]), Cubic())
    assert made.certificate.satisfied
    end: FloatArray = made.trajectory.evaluate(made.trajectory.duration)[0]
    return end


def some_of(full: Configuration, rng: np.random.Generator) -> Configuration:
    return full.of_parts([part for part in full.names if rng.random() < 0.6])


@pytest.mark.long_table
@pytest.mark.parametrize("robot_id", ["kuka_kr16_2", "ngv_refuelling_arm", "date_sorting_arm", "three_dof_arm", "ur5"])
def test_random_plans_end_in_the_configuration_asked(robot_id: str) -> None:
    robot, rng = load_robot(robot_id), np.random.default_rng(11)
    for _ in range(25):
        start, goal = (np.array(random_position(robot, rng)) for _ in range(2))
        (full,) = configurations(robot, [goal])
        wanted = some_of(full, rng)
        pose = pose_at(robot, goal)
        end = planned(robot, start, PoseWaypoint(pose, wanted))
        (reached,) = configurations(robot, [end])
        assert reached.of_parts(wanted.names) == wanted
        assert pose_at(robot, end).position == pytest.approx(pose.position, abs=1e-6)


@pytest.mark.parametrize("robot_id", ["kuka_kr16_l6_2", "date_sorting_arm"])
def test_what_is_refused_has_no_solution_and_what_is_offered_has_one(robot_id: str) -> None:
    """The truth is the solutions of the same arm without limits."""
    robot, rng = load_robot(robot_id), np.random.default_rng(12)
    refused = 0
    for _ in range(12):
        start, goal = (np.array(random_position(robot, rng)) for _ in range(2))
        pose, (full,) = pose_at(robot, goal), configurations(robot, [goal])
        opposite = "left" if full.shoulder == "right" else "right"
        solutions = configurations(robot, all_solutions(robot, pose, OPTIONS))
        wanted = Configuration(shoulder=opposite, wrist=full.wrist)
        try:
            planned(robot, start, PoseWaypoint(pose, wanted))
        except (JointPositionLimit, UnreachableWaypoint) as refusal:
            refused += 1
            assert not any(wanted.allows(found) for found in solutions)
            for found in solutions:
                assert str(found) in refusal.message
            assert refusal.waypoint == 1
            assert refusal.remedies
            for remedy in refusal.remedies:
                assert remedy.field == ("waypoints", 1, "configuration")
                end = planned(robot, start, PoseWaypoint(pose, remedy.value))
                assert remedy.value.allows(configurations(robot, [end])[0])
            if isinstance(refusal, JointPositionLimit):
                assert refusal.limit is not None
                assert refusal.value is not None
                index = robot.joint_names.index(str(refusal.joint))
                assert refusal.limit in {robot.limit("lower")[index], robot.limit("upper")[index]}
        else:
            assert any(wanted.allows(found) for found in solutions)
    assert refused > 3


def test_a_configuration_beyond_the_limits_names_the_joint() -> None:
    """The reversed wrist needs a half turn of joint 4, beyond its narrow limits."""
    joints = list(KUKA.joints)
    joints[3] = replace(joints[3], lower=-1.0, upper=1.0)
    robot = replace(KUKA, joints=tuple(joints))
    goal = PoseWaypoint(pose_at(robot, np.array(HOME)), Configuration(wrist="flip"))
    with pytest.raises(JointPositionLimit, match=r"with wrist flip waypoint 1 .* joint_a4 .* wrist no_flip") as refusal:
        planned(robot, np.array(HOME), goal)
    assert refusal.value.joint == "joint_a4"
    assert abs(abs(refusal.value.value or 0.0) - (np.pi - 0.2)) < 1e-6
    assert [remedy.value for remedy in refusal.value.remedies] == [Configuration(wrist="no_flip")]


@pytest.mark.parametrize(
    ("robot_id", "wanted", "part"),
    [
        ("panda", Configuration(elbow="up"), "elbow"),
        ("xarm7", Configuration(shoulder="left"), "shoulder"),
        ("three_dof_arm", Configuration(elbow="up", wrist="flip"), "wrist"),
        ("date_sorting_arm", Configuration(elbow="up"), "elbow"),
    ],
)
def test_a_part_that_an_arm_has_not_is_a_fault_of_that_field(robot_id: str, wanted: Configuration, part: str) -> None:
    robot = load_robot(robot_id)
    start = robot.middle
    with pytest.raises(InvalidProblem) as refusal:
        planned(robot, start, PoseWaypoint(pose_at(robot, start), wanted))
    (fault,) = refusal.value.faults
    assert fault.field == ("waypoints", 1, "configuration", part)
    assert f"not by the {part}" in fault.message


@pytest.mark.parametrize("wrist", ["flip", "no_flip"])
def test_a_straight_wrist_is_both(wrist: str) -> None:
    straight = np.array((0.3, -1.2, 1.4, 0.0, 0.0, 0.0))
    wanted = Configuration(elbow="up", wrist=wrist)  # type: ignore[arg-type] # one of two
    end = planned(KUKA, np.array(HOME), PoseWaypoint(pose_at(KUKA, straight), wanted))
    assert configurations(KUKA, [end])[0].wrist is None
    with pytest.raises(PlanningError):
        planned(KUKA, np.array(HOME), PoseWaypoint(pose_at(KUKA, straight), Configuration("left")))


@pytest.mark.parametrize("names", [("right", "up", "flip"), ("right", "up", "no_flip"), ("left", "down", "flip")])
def test_a_position_alone_is_reached_in_a_configuration(names: tuple[str, str, str]) -> None:
    """The position has a continuum of solutions, some in each configuration."""
    wanted = Configuration(*names)  # type: ignore[arg-type] # in the order of the fields
    robot = load_robot("ngv_refuelling_arm")
    goal = PoseWaypoint(Pose(np.array([-0.4, 0.5, 0.3])), wanted)
    end = planned(robot, np.array((0.1, -0.4, 0.2, 0.1, 0.3, 0.1)), goal)
    assert configurations(robot, [end]) == [wanted]


def test_a_line_ends_in_the_configuration_asked_or_is_refused_with_that_in_which_it_ends() -> None:
    robot = KUKA
    start = np.array(HOME)
    pose = pose_at(robot, start)
    away = Pose(pose.position + np.array([-0.1, 0.05, -0.1]), pose.rotation)
    kept, other = (
        PoseWaypoint(away, Configuration(wrist=wrist), motion=LinearMotion()) for wrist in ("no_flip", "flip")
    )
    assert configurations(robot, [planned(robot, start, kept)])[0].wrist == "no_flip"
    with pytest.raises(ConfigurationChange, match=r"ends with .* wrist no_flip, not with wrist flip") as refusal:
        planned(robot, start, other)
    by_field = {remedy.field: remedy.value for remedy in refusal.value.remedies}
    assert by_field[("waypoints", 1, "configuration")] == Configuration(wrist="no_flip")
    # From a pose the start is chosen so that the line ends as requested.
    made = plan(PlanningProblem(robot, [PoseWaypoint(pose), other]), Cubic())
    assert [found.wrist for found in configurations(robot, made.path.positions)] == ["flip", "flip"]


def test_reachability_counts_solutions_in_the_configuration() -> None:
    robot = load_robot("ngv_refuelling_arm")
    pose = forward_kinematics(robot, np.array([[0.3, 0.4, -1.0, 0.5, 0.8, -0.4]]))[0]
    requested = [
        Configuration(),
        Configuration("left"),
        Configuration("left", "up"),
        Configuration("left", "up", "flip"),
    ]
    found = reachability(robot, [PoseWaypoint(pose, wanted) for wanted in requested], OPTIONS)
    assert [one.solutions for one in found] == [8, 4, 2, 1]
    beyond = pose_at(KUKA, np.array(HOME))
    (one,) = reachability(KUKA, [PoseWaypoint(beyond, Configuration("left"))], OPTIONS)
    assert one.error is not None
    assert one.solutions == 0
