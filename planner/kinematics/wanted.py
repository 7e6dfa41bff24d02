"""The poses that a waypoint list asks for, relative moves chained."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.kinematics.forward import tool_pose
from planner.kinematics.poses import FloatArray, Pose
from planner.problem import JointWaypoint, PoseWaypoint

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.problem import AnyWaypoint, RelativeWaypoint
    from planner.robots import Robot

POSITION_ONLY_DOF = 3
"""An arm with so few joints cannot choose its orientation: a move relative to a joint position asks for none."""


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
