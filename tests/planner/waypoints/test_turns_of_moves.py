"""A move that turns the tool is planned with its turn, or refused, but never planned without it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
import pinocchio as pin
import pytest

import planner

if TYPE_CHECKING:
    from planner.problems.problem import Motion, Move

START = [0.3, 0.6, 1.4]
TURN = planner.Pose.from_rpy([0.0, 0.0, 0.0], [0.0, 0.0, 0.9]).rotation
TURNING: list[Move] = [
    planner.CartesianMove((0.02, 0.0, 0.0), TURN),
    planner.CartesianMove((0.0, 0.0, 0.0), TURN),
    planner.CylindricalMove(0.02, 0.9, 0.0),
    planner.SphericalMove(0.02, 0.9, 0.0),
    planner.SphericalMove(0.02, 0.0, 0.9),
]
SHIFTING: list[Move] = [
    planner.CartesianMove((0.02, 0.0, 0.0)),
    planner.CylindricalMove(0.02, 0.0, -0.01),
    planner.CylindricalMove(0.02, 2.0 * np.pi, -0.01),
    planner.SphericalMove(0.02, 0.0, 0.0),
]


@pytest.mark.parametrize("motion", [planner.JointMotion(), planner.LinearMotion()])
@pytest.mark.parametrize("frame", ["tool", "base"])
@pytest.mark.parametrize("move", TURNING)
def test_an_arm_with_three_joints_refuses_a_move_that_turns_the_tool(
    move: Move, frame: Literal["tool", "base"], motion: Motion
) -> None:
    robot = planner.load_robot("three_dof_arm")
    relative = planner.RelativeWaypoint(move, frame, motion=motion)
    with pytest.raises(planner.UnreachableWaypoint):
        planner.plan(planner.PlanningProblem(robot, [planner.JointWaypoint(START), relative]))


@pytest.mark.parametrize("frame", ["tool", "base"])
@pytest.mark.parametrize("move", SHIFTING)
def test_an_arm_with_three_joints_keeps_a_move_that_does_not(move: Move, frame: Literal["tool", "base"]) -> None:
    robot = planner.load_robot("three_dof_arm")
    relative = planner.RelativeWaypoint(move, frame, motion=planner.LinearMotion())
    plan = planner.plan(planner.PlanningProblem(robot, [planner.JointWaypoint(START), relative]))
    before, after = (planner.tool_pose(robot, waypoint.position) for waypoint in plan.path.waypoints)
    _, shift = move.transform()
    assert before.rotation is not None
    wanted = before.position + (before.rotation @ shift if frame == "tool" else shift)
    assert after.position == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize("frame", ["tool", "base"])
@pytest.mark.parametrize("move", TURNING)
def test_a_move_turns_the_tool_from_the_orientation_reached_at_an_open_pose(
    move: Move, frame: Literal["tool", "base"]
) -> None:
    robot = planner.load_robot("ur5e")
    first = planner.PoseWaypoint(planner.Pose([0.3, 0.2, 0.4]))
    relative = planner.RelativeWaypoint(move, frame)
    plan = planner.plan(planner.PlanningProblem(robot, [first, relative]))
    before, after = (planner.tool_pose(robot, waypoint.position) for waypoint in plan.path.waypoints)
    turn, _ = move.transform()
    assert before.rotation is not None
    assert after.rotation is not None
    wanted = before.rotation @ turn if frame == "tool" else turn @ before.rotation
    assert np.linalg.norm(pin.log3(wanted.T @ after.rotation)) < 1e-6
    assert plan.path.waypoints[1].orientation_error == pytest.approx(0.0, abs=1e-6)


def test_an_orientation_on_a_circle_to_an_open_pose_is_refused() -> None:
    robot = planner.load_robot("ur5e")
    via = planner.Pose([0.3, 0.3, 0.4], TURN)
    circle = planner.PoseWaypoint(planner.Pose([0.2, 0.3, 0.5]), motion=planner.CircularMotion(via=via))
    first = planner.PoseWaypoint(planner.Pose([0.3, 0.2, 0.4]))
    with pytest.raises(planner.InvalidProblem, match="a waypoint without one"):
        planner.plan(planner.PlanningProblem(robot, [first, circle]))
