"""Inverse kinematics, every solution checked by a plain product of matrices or by a second search."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.errors import JointPositionLimit, UnreachableWaypoint
from planner.kinematics import (
    Pose,
    all_solutions,
    forward_kinematics,
    inverse_kinematics,
    is_isolated,
    jacobian,
    tool_poses,
    tool_speeds,
)
from planner.kinematics.options import InverseKinematicsOptions
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem, PoseWaypoint
from planner.robots import DHJoint, Robot, load_robot
from planner.robots.description import JointKind
from planner.waypoints.solve import solve_waypoints
from tests.planner.kinematics.dh_arms import ngv_product, rot
from tests.planner.problems_of_tests import random_position

OPTIONS = InverseKinematicsOptions()
SIX_AXES = ("ngv_refuelling_arm", "welding_arm", "date_sorting_arm", "kuka_kr16_l6_2", "kuka_kr16_2")


@given(seed=st.integers(0, 2**32))
def test_a_solution_reaches_its_pose_by_a_plain_dh_product(seed: int) -> None:
    robot, rng = load_robot("ngv_refuelling_arm"), np.random.default_rng(seed)
    wanted = ngv_product(rng.uniform(-np.pi, np.pi, 6))
    result = inverse_kinematics(robot, Pose(wanted[:3, 3], wanted[:3, :3]), OPTIONS)
    if result.status == "solved":
        reached = ngv_product(result.position)
        assert np.linalg.norm(reached[:3, 3] - wanted[:3, 3]) <= 1e-6
        # |log R| <= 1e-6 rad means |R - R*|_F <= sqrt(2) 1e-6
        assert np.linalg.norm(reached[:3, :3] - wanted[:3, :3]) <= 1.5e-6


@pytest.mark.parametrize("robot_id", SIX_AXES)
def test_nearly_every_reachable_pose_is_solved_within_the_limits(robot_id: str) -> None:
    robot, rng = load_robot(robot_id), np.random.default_rng(4)
    solved = 0
    for _ in range(40):
        pose = forward_kinematics(robot, np.array([random_position(robot, rng)]))[0]
        result = inverse_kinematics(robot, pose, OPTIONS)
        if result.status == "solved":
            solved += 1
            assert (result.position >= robot.limit("lower")).all()
            assert (result.position <= robot.limit("upper")).all()
    assert solved >= 39


@pytest.mark.parametrize("robot_id", SIX_AXES)
def test_from_a_nearby_reference_the_solution_stays_on_its_branch(robot_id: str) -> None:
    robot, rng = load_robot(robot_id), np.random.default_rng(6)
    for _ in range(20):
        q = 0.8 * np.array(random_position(robot, rng)) + 0.2 * robot.middle
        if np.linalg.svd(jacobian(robot, q), compute_uv=False)[-1] < 0.05:
            continue  # near a singularity two branches meet
        pose = forward_kinematics(robot, q[None])[0]
        near = np.clip(q + rng.uniform(-0.02, 0.02, robot.dof), robot.limit("lower"), robot.limit("upper"))
        result = inverse_kinematics(robot, pose, OPTIONS, near)
        assert result.position == pytest.approx(q, abs=1e-5)


def test_a_small_move_of_a_redundant_arm_is_a_small_motion() -> None:
    """Of a continuum of solutions the one near the waypoint before is taken: here six joints, position only."""
    robot, rng = load_robot("kuka_kr16_l6_2"), np.random.default_rng(9)
    for _ in range(10):
        q = 0.6 * np.array(random_position(robot, rng)) + 0.4 * robot.middle
        if np.linalg.svd(jacobian(robot, q)[:3], compute_uv=False)[-1] < 0.1:
            continue
        above = Pose(forward_kinematics(robot, q[None])[0].position + np.array([0.0, 0.0, 0.002]))
        waypoints = (JointWaypoint(position=tuple(q.tolist())), PoseWaypoint(pose=above))
        moved = solve_waypoints(robot, waypoints, OPTIONS)[1]
        assert np.abs(moved.position - q).max() < 0.05
        assert moved.solutions is None


def test_the_turn_nearest_to_the_reference_is_taken() -> None:
    robot = load_robot("kuka_kr16_l6_2")  # joint 4 and 6 turn by 700 degrees
    q = np.array([0.3, -1.2, 1.1, 4.0, 0.7, -4.5])
    pose = forward_kinematics(robot, q[None])[0]
    assert inverse_kinematics(robot, pose, OPTIONS, q + 0.01).position == pytest.approx(q, abs=1e-6)


def test_a_pose_out_of_reach_comes_with_the_nearest_one() -> None:
    """Position only, on the KR 16's shoulder sphere: the nearest point lies on the line to the shoulder axis."""
    robot = load_robot("three_dof_arm")  # reach 270 mm about the origin
    wanted = np.array([0.3, 0.4, 0.0])
    result = inverse_kinematics(robot, Pose(wanted), OPTIONS)
    assert result.status == "unreachable_waypoint"
    assert result.position_error == pytest.approx(0.5 - 0.27, abs=1e-6)
    assert result.pose.position == pytest.approx(wanted / 0.5 * 0.27, abs=1e-4)


def test_an_unreachable_waypoint_is_refused_with_a_remedy_that_works() -> None:
    robot = load_robot("ngv_refuelling_arm")
    start = JointWaypoint(position=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6))
    far = PoseWaypoint(pose=Pose(np.array([3.0, 0.0, 0.0]), np.eye(3)))
    problem = PlanningProblem(robot, (start, far))
    with pytest.raises(UnreachableWaypoint) as refusal:
        plan(problem)
    error = refusal.value
    assert error.waypoint == 1
    (remedy,) = error.remedies
    assert remedy.field == ("waypoints", 1, "pose")
    assert plan(remedy.applied_to(problem)).certificate.satisfied


def test_a_pose_beyond_a_joint_limit_names_the_joint() -> None:
    robot = load_robot("date_sorting_arm")
    # l1 = 0.6 m: 0.1 m above its range, everything else in the middle of it.
    pose = forward_kinematics(robot, np.array([[0.3, 0.6, 0.2, 0.5, 1.0, 0.4]]))[0]
    with pytest.raises(JointPositionLimit) as refusal:
        plan(PlanningProblem(robot, (JointWaypoint(position=(0.0, 0.2, 0.2, 0.0, 1.0, 0.0)), PoseWaypoint(pose=pose))))
    error = refusal.value
    assert (error.waypoint, error.joint, error.limit) == (1, "l1", 0.5)
    assert error.value == pytest.approx(0.6, abs=1e-6)


@pytest.mark.parametrize("axis", range(6))
def test_a_joint_waypoint_beyond_its_limit_names_the_joint(axis: int) -> None:
    robot = load_robot("date_sorting_arm")
    position = robot.middle.copy()
    position[axis] = robot.limit("upper")[axis] + 0.001
    waypoints = (JointWaypoint(position=tuple(robot.middle + 0.01)), JointWaypoint(position=tuple(position)))
    with pytest.raises(JointPositionLimit) as refusal:
        plan(PlanningProblem(robot, waypoints))
    assert (refusal.value.waypoint, refusal.value.joint) == (1, robot.joint_names[axis])
    assert refusal.value.remedies[0].value == robot.limit("upper")[axis]


@pytest.mark.parametrize("kind", ["revolute", "continuous", "prismatic"])
def test_an_arm_of_one_joint(kind: JointKind) -> None:
    """Pinocchio gives its Jacobian as a vector, which once broke the service with a 500."""
    row = DHJoint(kind, a=0.5) if kind == "continuous" else DHJoint(kind, a=0.5, lower=-1.0, upper=1.0)
    robot = Robot.from_dh([row])
    pose = forward_kinematics(robot, np.array([[0.3]]))[0]
    for wanted in (pose, Pose(pose.position)):
        result = inverse_kinematics(robot, wanted, OPTIONS)
        assert result.status == "solved"
        assert len(all_solutions(robot, wanted, OPTIONS)) == 1
        assert result.position == pytest.approx([0.3], abs=1e-9)
    off = inverse_kinematics(robot, Pose(pose.position + np.array([0.0, 0.3, 0.4])), OPTIONS)
    assert off.status == "unreachable_waypoint"
    waypoints = (JointWaypoint(position=(-0.5,)), PoseWaypoint(pose=pose))
    assert plan(PlanningProblem(robot, waypoints)).trajectory.evaluate(np.zeros(1), [0])[0] == pytest.approx(-0.5)


def test_the_rank_5_arm_is_solved_on_its_surface_and_survives_off_it() -> None:
    robot = load_robot("ngv_refuelling_arm_published")
    J = jacobian(robot, np.array([0.4, 0.5, 0.6, 0.7, 0.8, 0.9]))
    assert np.linalg.matrix_rank(J, tol=1e-9) == 5
    pose = forward_kinematics(robot, np.array([[0.4, 0.5, 0.6, 0.7, 0.8, 0.9]]))[0]
    on = inverse_kinematics(robot, pose, OPTIONS)
    assert (on.status, is_isolated(robot, pose, on.position)) == ("solved", False)  # joint 3 is free: a continuum
    off = inverse_kinematics(robot, Pose(pose.position + np.array([0.0, 0.0, 0.1]), pose.rotation), OPTIONS)
    assert off.status == "unreachable_waypoint"


def test_the_same_seed_gives_the_same_answer() -> None:
    robot = load_robot("kuka_kr16_2")
    pose = forward_kinematics(robot, np.array([[0.4, -0.9, 0.8, 0.7, 0.8, 0.9]]))[0]
    first, second = (inverse_kinematics(robot, pose, OPTIONS).position for _ in range(2))
    assert first.tobytes() == second.tobytes()


@pytest.mark.parametrize("robot_id", [*SIX_AXES, "three_dof_arm"])
def test_jacobians_and_tool_speeds_are_the_difference_quotients_of_the_poses(robot_id: str) -> None:
    robot, rng = load_robot(robot_id), np.random.default_rng(8)
    q, v = np.array(random_position(robot, rng)), rng.normal(size=robot.dof)
    J = jacobian(robot, q)
    columns = np.array([difference_twist(robot, q, direction) for direction in np.eye(robot.dof)]).T
    assert pytest.approx(columns, abs=1e-7) == J
    twist = difference_twist(robot, q, v)
    linear, angular = tool_speeds(robot, q[None], v[None])
    assert linear[0] == pytest.approx(np.linalg.norm(twist[:3]), abs=1e-6)
    assert angular[0] == pytest.approx(np.linalg.norm(twist[3:]), abs=1e-6)


def difference_twist(robot: Robot, q: np.ndarray, direction: np.ndarray, h: float = 1e-5) -> np.ndarray:
    before, after = forward_kinematics(robot, np.array([q - h * direction, q + h * direction]))
    assert before.rotation is not None
    assert after.rotation is not None
    skew = (after.rotation @ before.rotation.T - before.rotation @ after.rotation.T) / 2.0
    angular = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    return np.concatenate([after.position - before.position, angular]) / (2.0 * h)


@pytest.mark.parametrize("robot_id", [*SIX_AXES, "three_dof_arm"])
def test_poses_of_many_joint_positions_at_once_are_those_of_pinocchio(robot_id: str) -> None:
    tool = Pose(np.array([0.1, -0.2, 0.3]), rot(0, 0.7)[:3, :3] @ rot(2, -1.1)[:3, :3])
    robot, rng = load_robot(robot_id).with_tool(tool), np.random.default_rng(5)
    q = np.array([random_position(robot, rng) for _ in range(20)])
    positions, rotations = tool_poses(robot, q)
    for pose, position, rotation in zip(forward_kinematics(robot, q), positions, rotations, strict=True):
        assert position == pytest.approx(pose.position, abs=1e-12)
        assert rotation == pytest.approx(pose.rotation, abs=1e-12)
