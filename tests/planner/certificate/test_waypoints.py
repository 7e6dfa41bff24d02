"""Every waypoint of a delivered trajectory is at its requested position, by Pinocchio and the request alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.certificate.waypoints import certify_waypoints
from planner.problems.motion_around import FreeMotion, as_requested
from planner.problems.regions import Region

FAR = planner.Scene([planner.SceneObject("far", [planner.Sphere(0.1)], planner.Pose([9.0, 9.0, 9.0]))])
ENDS = {
    "ur10e": [-1.0, -1.0, -0.9, 1.2, -1.6, 0.4],
    "ur5e": [-1.0, -1.0, -0.9, 1.2, -1.6, 0.4],
    "panda": [0.5, 0.2, 0.0, -1.5, 0.0, 1.8, 0.3],
    "kuka_kr16_2": [0.6, -1.2, 1.3, 0.2, 0.5, 0.1],
}
REACHES = {"ur10e": 0.8, "ur5e": 0.55, "panda": 0.5, "kuka_kr16_2": 1.1}


def delivered(plan: planner.Plan, index: int, tool: pin.SE3) -> pin.SE3:
    """Return the pose of a tool at the arrival at a waypoint, by Pinocchio's own forward kinematics."""
    vias = [isinstance(waypoint, planner.ViaWaypoint) for waypoint in plan.problem.waypoints]
    row = [k for k, via in enumerate(vias) if not via][index]
    (q,) = plan.trajectory.evaluate(plan.trajectory.arrivals[row], [0])
    model = plan.problem.robot.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[plan.problem.robot.tip_frame_id] * tool


def open_then_relative(robot_id: str, seed: int, **relative: Any) -> planner.PlanningProblem:
    """Return a problem with an open first pose, then a tool move, then a free motion."""
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=3)
    direction[2] = abs(direction[2]) + 0.3
    position = direction / np.linalg.norm(direction) * REACHES[robot_id]
    shift = rng.normal(size=3)
    shift *= rng.uniform(0.02, 0.15) / np.linalg.norm(shift)
    robot = planner.load_robot(robot_id)
    return planner.PlanningProblem(
        robot,
        [
            planner.PoseWaypoint(planner.Pose(position)),
            planner.RelativeWaypoint(planner.CartesianMove(tuple(shift.tolist())), **relative),
            planner.JointWaypoint(ENDS[robot_id], motion=FreeMotion()),
        ],
        scene=FAR,
        self_collision=False,
    )


def off_target(plan: planner.Plan, index: int, shift: np.ndarray) -> float:
    """Return the distance of a relative waypoint from the end of its move in tool axes, m."""
    before, after = (delivered(plan, k, pin.SE3.Identity()) for k in (index - 1, index))
    return float(np.linalg.norm(after.translation - (before.translation + before.rotation @ shift)))


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
@pytest.mark.parametrize("robot_id", ["ur10e", "ur5e", "panda", "kuka_kr16_2"])
def test_a_tool_move_from_an_open_orientation_before_a_free_motion_is_kept(robot_id: str, seed: int) -> None:
    problem = open_then_relative(robot_id, seed)
    plan = planner.plan(problem)
    move = problem.waypoints[1]
    assert isinstance(move, planner.RelativeWaypoint)
    assert isinstance(move.move, planner.CartesianMove)
    assert off_target(plan, 1, np.array(move.move.translation)) < 2e-6
    errors = [waypoint.position_error for waypoint in plan.path.waypoints[:2]]
    assert max(errors) < 1e-6


def test_a_chain_of_moves_with_another_tool_before_a_free_motion_is_kept() -> None:
    tool = planner.Pose.from_rpy([0.02, 0.01, 0.15], [0.3, 0.2, -0.4])
    problem = open_then_relative("ur10e", 0, tool=tool)
    first, move, goal = problem.waypoints
    back = planner.RelativeWaypoint(planner.CartesianMove((0.0, 0.03, -0.02)), motion=planner.LinearMotion())
    plan = planner.plan(replace(problem, waypoints=[first, move, back, goal]))
    held = pin.SE3(np.asarray(tool.rotation), tool.position)
    poses = [delivered(plan, k, held) for k in range(3)]
    for before, after, waypoint in zip(poses, poses[1:], [move, back], strict=False):
        assert isinstance(waypoint, planner.RelativeWaypoint)
        assert isinstance(waypoint.move, planner.CartesianMove)
        shift = np.array(waypoint.move.translation)
        assert np.linalg.norm(before.rotation.T @ (after.translation - before.translation) - shift) < 4e-6


def test_a_relative_move_from_where_a_free_motion_ends_goes_on_from_there() -> None:
    problem = open_then_relative("ur10e", 0)
    first, move, goal = problem.waypoints
    waypoints = [
        replace(goal, motion=planner.JointMotion()),
        replace(first, motion=FreeMotion()),
        move,
        replace(first, motion=FreeMotion()),
        move,
        goal,
    ]
    plan = planner.plan(replace(problem, waypoints=waypoints))
    assert isinstance(move, planner.RelativeWaypoint)
    assert isinstance(move.move, planner.CartesianMove)
    for index in (2, 4):
        assert off_target(plan, index, np.array(move.move.translation)) < 2e-6


def test_the_certificate_refuses_a_first_joint_position_that_differs_from_the_start_of_the_move() -> None:
    """The same plan is refused with another joint position at the first waypoint, all else unchanged."""
    problem = open_then_relative("ur10e", 0)
    plan = planner.plan(problem)
    trajectory, positions = plan.trajectory, plan.path.positions
    first = problem.waypoints[0]
    assert isinstance(first, planner.PoseWaypoint)
    robot = problem.robot
    other = next(
        solution for solution in planner.all_solutions(robot, first.pose) if np.abs(solution - positions[0]).max() > 0.3
    )
    moved = replace(trajectory, coefficients=trajectory.coefficients.copy())
    moved.coefficients[: int((trajectory.segments == 0).sum()), :, 0] += other - positions[0]
    met = certify_waypoints(moved, plan.problem, positions, ())
    (check,) = [check for check in met.checks if check.quantity == "waypoint_position_error"]
    assert not check.satisfied
    assert check.peak > 1e-3
    assert met.errors[1][0] == check.peak


@pytest.mark.parametrize("joint", [0, 3])
def test_a_trajectory_that_misses_a_joint_waypoint_is_not_satisfied(joint: int) -> None:
    robot = planner.load_robot("ur5e")
    trajectory = planner.plan(
        planner.PlanningProblem(robot, [planner.JointWaypoint([0.0] * 6), planner.JointWaypoint([0.5] * 6)])
    ).trajectory
    wanted = np.array([[0.0] * 6, [0.5] * 6])
    assert planner.certify(robot, trajectory, positions=wanted, enforced=["velocity"]).satisfied
    wanted[1, joint] += 1e-3
    assert not planner.certify(robot, trajectory, positions=wanted, enforced=["velocity"]).satisfied


def test_errors_are_measured_against_the_region_that_was_requested() -> None:
    robot = planner.load_robot("ur5e")
    region = Region(x=(-0.05, 0.05), rotation_z=(-1.5, 1.5), rotation_x=(-0.5, 0.5))
    pose = planner.Pose.from_rpy([0.3, 0.2, 0.4], [3.0, 0.1, 0.2])
    first = planner.PoseWaypoint(pose, free=region)
    goal = planner.JointWaypoint(ENDS["ur5e"], motion=FreeMotion())
    move = planner.RelativeWaypoint(planner.CartesianMove((0.02, -0.03, -0.05)))
    plan = planner.plan(planner.PlanningProblem(robot, [first, move, goal], scene=FAR))
    assert as_requested(plan.problem.waypoints[1]) is plan.problem.waypoints[1].requested  # type: ignore[union-attr]
    reached = delivered(plan, 0, pin.SE3.Identity())
    offsets = region.offsets(pose, planner.Pose(reached.translation, reached.rotation))
    for name, (lower, upper) in region.ranges.items():
        assert lower - 1e-6 <= offsets[name] <= upper + 1e-6
    assert plan.path.waypoints[0].position_error < 1e-6
    assert off_target(plan, 1, np.array([0.02, -0.03, -0.05])) < 2e-6
