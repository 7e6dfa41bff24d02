"""Jobs that cannot be done, each with a proof from outside the planner."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from benchmarks.corpus.degenerate import swing, with_ranges
from planner.limits import Limits
from planner.problems.problem import CircularMotion, JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.robots.payload import Payload
from planner.spatial import Pose

if TYPE_CHECKING:
    from benchmarks.corpus.arms import Place
    from planner.robots import Robot

Refused = tuple[PlanningProblem, str, tuple[str, ...]]
"""A problem, why it has no plan, and the codes that say so."""


def infeasible(place: Place, variant: int) -> Refused:
    """Make a job that is out of reach, too short in time, beyond a limit, or too heavy."""
    makers = (_far_pose, _far_circle, _short_duration, _beyond_limit, _too_heavy, _far_line)
    return makers[variant % 6](place, 1.0 + variant // 6)


def farthest(robot: Robot) -> float:
    """Return an upper bound on the tool's distance from the base, m: all links and strokes end to end."""
    lengths = [float(np.linalg.norm(placement.translation)) for placement in robot.model.jointPlacements]
    tool = robot.model.frames[robot.tool_frame_id].placement.translation
    strokes = np.maximum(np.abs(robot.limit("lower")), np.abs(robot.limit("upper")))[~robot.is_angle]
    return sum(lengths) + float(np.linalg.norm(tool)) + float(strokes.sum())


def _far_pose(place: Place, scale: float) -> Refused:
    position = place.pose.position / np.linalg.norm(place.pose.position) * farthest(place.robot) * (1.0 + 0.2 * scale)
    goal = PoseWaypoint(pose=Pose(position, place.pose.rotation))
    why = f"the pose is {0.2 * scale:.0%} further away than all links end to end"
    # With longer strokes an arm with sliding joints would reach it: that is as true.
    codes = (
        ("unreachable_waypoint",) if place.robot.is_angle.all() else ("unreachable_waypoint", "joint_position_limit")
    )
    return PlanningProblem(place.robot, (_start(place), goal)), why, codes


def _far_line(place: Place, scale: float) -> Refused:
    problem, why, codes = _far_pose(place, scale)
    goal = replace(problem.waypoints[1], motion=LinearMotion())
    return replace(problem, waypoints=(problem.waypoints[0], goal)), why, codes


def _far_circle(place: Place, scale: float) -> Refused:
    outwards = place.pose.position / np.linalg.norm(place.pose.position)
    via = Pose(outwards * farthest(place.robot) * (1.0 + 0.2 * scale))
    goal = PoseWaypoint(pose=place.at(0.0, 0.05, 0.0), motion=CircularMotion(via))
    why = "the circle goes further away than all links end to end"
    # On the way there a joint may meet its limit first: the test looks whether it does.
    return PlanningProblem(place.robot, (_start(place), goal)), why, ("unreachable_waypoint", "joint_position_limit")


def _short_duration(place: Place, scale: float) -> Refused:
    goal = swing(place, 1.0)
    least = float((np.abs(goal - place.position) / place.robot.limit("velocity")).max())
    waypoint = JointWaypoint(position=tuple(goal.tolist()), duration=least / (1.0 + scale))
    why = f"at its velocity limit a joint takes {least:g} s"
    return PlanningProblem(place.robot, (_start(place), waypoint)), why, ("infeasible_duration",)


def _beyond_limit(place: Place, scale: float) -> Refused:
    robot, goal = with_ranges(place), swing(place, 0.3)
    goal[0] = robot.limit("upper")[0] + 0.1 * scale
    problem = PlanningProblem(robot, (_start(place), JointWaypoint(position=tuple(goal.tolist()))))
    return problem, "the waypoint itself is beyond a position limit", ("joint_position_limit", "invalid_request")


def _too_heavy(place: Place, scale: float) -> Refused:
    unrated, payload = replace(place.robot, rated_payload=None), Payload(100.0 * scale)
    robot, rest = unrated.with_payload(payload), np.zeros(place.robot.dof)
    goal = swing(place, 0.5)
    held = np.abs([pin.rnea(robot.model, robot.model.createData(), q, rest, rest) for q in (place.position, goal)])
    worst = held.max(axis=0)
    limits = Limits(torque=tuple(np.minimum(np.maximum(0.5 * worst, 1e-3), place.robot.limit("torque")).tolist()))
    waypoint = JointWaypoint(position=tuple(goal.tolist()))
    problem = PlanningProblem(unrated, (_start(place), waypoint), limits=limits, payload=payload)
    why = f"at rest the weight takes {float((worst / np.array(limits.torque)).max()):.3g} times a torque limit"
    return problem, why, ("limits_unsatisfiable",)


def _start(place: Place) -> JointWaypoint:
    return JointWaypoint(position=tuple(place.position.tolist()))
