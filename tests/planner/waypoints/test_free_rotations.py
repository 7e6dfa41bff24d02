"""A free turn about the tool's axis: the axis by Pinocchio, the nearest joint position by a dense sweep."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.corpus.tracing import tool_at
from planner.backends import Trapezoidal
from planner.errors import InvalidProblem, UnreachableWaypoint
from planner.kinematics.inverse import solution_layers
from planner.kinematics.options import InverseKinematicsOptions
from planner.paths import solve_path
from planner.planning import plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import (
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
    SplineMotion,
)
from planner.problems.regions import Region
from planner.robots import Robot, load_robot
from planner.spatial import FloatArray, Pose, rotation_from_rpy, rotation_z
from planner.tool_motions.tool_motion import RefusedMotion, RequestedMotion, ToolMotion, follow_motion
from planner.waypoints import choice
from planner.waypoints.reachability import reachability
from planner.waypoints.solve import solve_waypoints

ARMS = {"kuka_kr16_l6_2": (0.3, -1.2, 1.4, 0.2, 0.6, 0.1), "ur5": (0.0, -1.5, 1.6, -1.6, -1.5, 0.2)}
PANDA = (0.1, -0.5, 0.2, -2.0, 0.1, 1.7, 0.5)


def robot_of(arm: str) -> Robot:
    return load_robot(arm)


def has_its_axis(robot: Robot, q: FloatArray, requested: Pose) -> None:
    tool = tool_at(robot, q)
    assert requested.rotation is not None
    assert tool.rotation is not None
    assert np.linalg.norm(tool.position - requested.position) < 2e-6
    assert np.linalg.norm(tool.rotation[:, 2] - requested.rotation[:, 2]) < 2e-6


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("arm", ARMS)
def test_no_turn_of_a_dense_sweep_leads_to_a_nearer_joint_position(arm: str, seed: int) -> None:
    robot, rng = robot_of(arm), np.random.default_rng(seed)
    start = np.array(ARMS[arm])
    before = tool_at(robot, start)
    turn = rotation_from_rpy(*rng.uniform(-0.4, 0.4, 2), rng.uniform(-3.0, 3.0))
    requested = Pose(before.position + rng.uniform(-0.15, 0.15, 3), before.rotation @ turn)
    goal = PoseWaypoint(requested, free="rotation_z")
    reached = solve_path(PlanningProblem(robot, [JointWaypoint(start), goal])).waypoints[1]
    has_its_axis(robot, reached.position, requested)
    sweep = [
        Pose(requested.position, requested.rotation @ rotation_z(angle)) for angle in np.linspace(0.0, 2.0 * np.pi, 361)
    ]
    layers = solution_layers(robot, sweep, InverseKinematicsOptions(), start)
    velocity = robot.limit("velocity")
    nearest = min(float((np.abs(q - start) / velocity).max()) for layer in layers for q in layer)
    taken = float((np.abs(reached.position - start) / velocity).max())
    assert taken <= 1.02 * nearest + 1e-6  # beside the slowest joint a hundredth of all others counts


def test_an_arm_with_seven_joints_and_a_pose_in_a_frame() -> None:
    robot, start = robot_of("panda"), np.array(PANDA)
    before = tool_at(robot, start)
    frame = Pose.from_rpy([0.2, -0.1, 0.3], [0.1, 0.2, 0.3])
    requested = Pose(before.position + np.array([0.0, 0.1, -0.05]), before.rotation @ rotation_from_rpy(0.1, 0.2, 2.0))
    goal = PoseWaypoint(requested.to_frame(frame), frame=frame, free="rotation_z")
    reached = solve_path(PlanningProblem(robot, [JointWaypoint(start), goal])).waypoints[1].position
    has_its_axis(robot, reached, requested)
    assert np.abs(reached - start).max() < 0.5  # and not two radians for the turn


def test_lines_go_to_a_free_pose_and_on_from_it() -> None:
    """A seam of a round tool has poses with arbitrary turns: the wrist hardly moves."""
    robot = robot_of("kuka_kr16_l6_2")
    start = np.array(ARMS["kuka_kr16_l6_2"])
    before = tool_at(robot, start)
    requested = [
        Pose(before.position - np.array([0.0, 0.1 * k, 0.0]), before.rotation @ rotation_z(turn))
        for k, turn in enumerate((2.0, -1.5, 3.0), 1)
    ]
    seam = [PoseWaypoint(pose, free="rotation_z", motion=LinearMotion()) for pose in requested]
    up = RelativeWaypoint(CartesianMove((0.0, 0.0, 0.05)), "base", motion=LinearMotion())
    made = plan(PlanningProblem(robot, [JointWaypoint(start), *seam, up]), Trapezoidal())
    assert made.certificate.satisfied
    for pose, q in zip(requested, made.path.positions[1:], strict=False):
        has_its_axis(robot, q, pose)
    assert np.ptp(made.path.positions[:, 5]) < 0.5
    turned = plan(
        PlanningProblem(robot, [JointWaypoint(start), *(PoseWaypoint(pose) for pose in requested)]), Trapezoidal()
    )
    assert made.problem.waypoints[1].free == "rotation_z"
    assert np.ptp(turned.path.positions[:, 5]) > 2.0


def test_what_cannot_be_reached_at_any_turn_and_what_has_no_axis() -> None:
    robot = robot_of("kuka_kr16_l6_2")
    far = PoseWaypoint(Pose([5.0, 0.0, 0.5], np.eye(3)), free="rotation_z")
    with pytest.raises(UnreachableWaypoint):
        plan(PlanningProblem(robot, [JointWaypoint(ARMS["kuka_kr16_l6_2"]), far]))
    (found,) = reachability(robot, [far], InverseKinematicsOptions())
    assert found.error is not None
    with pytest.raises(InvalidProblem, match="needs a pose with an orientation"):
        plan(PlanningProblem(robot, [PoseWaypoint(Pose([1.0, 0.0, 0.5]), free="rotation_z")]))


@pytest.mark.large_only
def test_a_motion_with_freedom_is_given_up_after_some_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    """A spline at the edge of reach, from a pose without orientation, was followed in vain from 300 joint positions."""
    robot = load_robot("kuka_kr16_2")
    edge = (
        [1.055356102, 0.386695648, 1.895810967],
        [1.055356102, 0.386695648, 1.895810967],
        [1.071034767, 0.373292965, 1.896415609],
    )
    turns = Region(rotation_x=(0.0, 0.022815136), rotation_y=(0.0, 0.36524093), rotation_z=(-0.009715595, 0.001246626))
    motion = SplineMotion(poses=tuple(Pose(np.array(position)) for position in edge), free=turns)
    nearest = Pose.from_quaternion(
        [1.0744632066684923, 0.3864388282844488, 1.8864546487449585],
        [0.2397293730833502, 0.03807418680378853, 0.8824844282782317, 0.4028665012466743],
    )
    waypoints = [
        JointWaypoint(np.array([-0.401026228, -1.040170439, 0.148666294, -0.837902011, -0.410554339, -1.148958744])),
        PoseWaypoint(Pose(np.array([1.039675764, 0.39033718, 1.899993305]))),
        PoseWaypoint(nearest, motion=motion),
    ]
    monkeypatch.setattr(choice, "MOST_REFUSED", 3)
    starts = []

    def follow(requested: RequestedMotion, start: FloatArray) -> ToolMotion | RefusedMotion:
        starts.append(start)
        return follow_motion(requested, start)

    monkeypatch.setattr(choice, "follow_motion", follow)
    with pytest.raises(UnreachableWaypoint):
        solve_waypoints(robot, waypoints, InverseKinematicsOptions())
    assert 3 <= len(starts) <= 6  # once more with a wider choice of joint positions
