"""The poses that a waypoint list asks for, relative moves chained."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.kinematics.forward import tool_pose
from planner.kinematics.poses import FloatArray, Pose
from planner.problem import JointWaypoint, PoseWaypoint, RelativeWaypoint

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.problem import AnyWaypoint, InverseKinematicsOptions
    from planner.robots import Robot

POSITION_ONLY_DOF = 3
"""An arm with so few joints cannot choose its orientation: a move relative to a joint position asks for none."""


def waypoint_faults(
    robot: Robot, waypoints: Sequence[AnyWaypoint], options: InverseKinematicsOptions
) -> Iterator[tuple[str, str]]:
    """What keeps the list from saying where the robot is to go: JSON pointers and messages."""
    for i, waypoint in enumerate(waypoints):
        if isinstance(waypoint, JointWaypoint) and len(waypoint.position) != robot.dof:
            count = len(waypoint.position)
            yield f"/waypoints/{i}/position", f"{count} values for the {robot.dof} joints of {robot.id}"
    if waypoints and isinstance(waypoints[0], RelativeWaypoint):
        yield "/waypoints/0/kind", "the first waypoint cannot be relative: there is none before it"
    if options.reference is not None and len(options.reference) != robot.dof:
        yield "/ik/reference", f"{len(options.reference)} values for the {robot.dof} joints of {robot.id}"


def wanted_poses(robot: Robot, waypoints: Sequence[AnyWaypoint]) -> list[Pose | None]:
    """The pose asked at every waypoint, as far as the list alone says it.

    A move starts from the pose asked before it, not from the one reached: errors do not add up.

    Args:
        robot: With its tool.
        waypoints: The first is not relative.

    Returns:
        None: the move is in the axes of a tool whose orientation was left open, or starts from such a pose.
        `moved_pose` gives the pose once the joint position before is chosen.
    """
    wanted: list[Pose | None] = []
    before: Pose | None = None
    axes: FloatArray | None = None
    for waypoint in waypoints:
        if isinstance(waypoint, JointWaypoint):
            before = tool_pose(robot, np.array(waypoint.position))
            axes = before.rotation
            if robot.dof <= POSITION_ONLY_DOF:
                before = Pose(before.position)
        else:
            if isinstance(waypoint, PoseWaypoint):
                before = waypoint.pose
            elif before is not None and (axes is not None or waypoint.frame == "base"):
                before = moved_pose(before, axes, waypoint)
            else:
                before = None
            axes = None if before is None else before.rotation
        wanted.append(before)
    return wanted


def moved_pose(before: Pose, axes: FloatArray | None, waypoint: RelativeWaypoint) -> Pose:
    """The pose before, moved. Where the pose before left its orientation open, so does this one.

    Args:
        before: The pose asked at the waypoint before.
        axes: (3, 3), of the tool there; not needed by a move in the base's axes.
        waypoint: The move.
    """
    turn, shift = waypoint.move.transform()
    rotation = before.rotation
    if waypoint.frame == "base":
        return Pose(before.position + shift, None if rotation is None else turn @ rotation)
    assert axes is not None  # noqa: S101 - wanted_poses leaves out what needs them and has none
    return Pose(before.position + axes @ shift, None if rotation is None else rotation @ turn)
