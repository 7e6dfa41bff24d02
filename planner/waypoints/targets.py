"""The poses that a waypoint list asks for, relative moves chained."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.errors import Remedy
from planner.kinematics.forward import tool_pose
from planner.problems.motion_around import as_requested
from planner.problems.moves import CartesianMove
from planner.problems.problem import AnyWaypoint, JointWaypoint, PoseWaypoint, RelativeWaypoint
from planner.robots import Robot
from planner.spatial import FloatArray, Pose


def wanted_poses(robots: Sequence[Robot], waypoints: Sequence[AnyWaypoint]) -> list[Pose | None]:
    """Return the requested pose of every waypoint, as far as the list alone defines it.

    A move starts from the requested pose before it, not from the reached one, so errors do not add up. After a joint
    position of an arm that cannot choose its orientation, the requested pose has no orientation. A waypoint fixed later
    keeps the pose of the request; its joint position determines the open coordinates.

    Args:
        robots: The robot with the tool of each waypoint.
        waypoints: The first is not relative.

    Returns:
        None: the move is in the axes of a tool whose orientation was left open, turns it, or starts from such a pose.
        `moved_pose` gives the pose once the joint position before is chosen.
    """
    wanted: list[Pose | None] = []
    before: Pose | None = None
    axes: FloatArray | None = None
    for k, (robot, waypoint) in enumerate(zip(robots, waypoints, strict=True)):
        if k and robot is not robots[k - 1]:
            seen = None if before is None else of_other_tool(Pose(before.position, axes), robots[k - 1], robot)
            is_open = before is None or before.rotation is None
            before = Pose(seen.position) if seen is not None and is_open else seen
            axes = None if seen is None else seen.rotation
        requested = as_requested(waypoint)
        if isinstance(requested, PoseWaypoint) and not requested.free:
            before = requested.pose_in_base
        elif (
            isinstance(requested, RelativeWaypoint)
            and before is not None
            and (axes is not None or not (requested.frame == "tool" or requested.turns_tool))
        ):
            before = moved_pose(before, axes, requested)
        else:
            before = None
        axes = None if before is None else before.rotation
        if isinstance(waypoint, JointWaypoint) and axes is None:
            there = tool_pose(robot, np.array(waypoint.position))
            axes = there.rotation
            if before is None:
                before = Pose(there.position) if robot.is_position_only else there
        wanted.append(before)
    return wanted


def first_fixing(robots: Sequence[Robot], waypoints: Sequence[AnyWaypoint], index: int) -> int:
    """Return the index of the first waypoint whose joint position decides the pose requested at another.

    Args:
        robots: The robot with the tool of each waypoint.
        waypoints: The first is not relative.
        index: Index of the other; it is the answer itself where the list alone says its pose.
    """
    if wanted_poses(robots[: index + 1], waypoints[: index + 1])[-1] is None:
        while isinstance(waypoints[index], RelativeWaypoint):
            index -= 1
    return index


def of_other_tool(pose: Pose | None, robot: Robot, other: Robot) -> Pose | None:
    """Return the pose of another tool where a tool has a pose.

    Args:
        pose: Of the tool of `robot`; None: it is not known.
        robot: The robot with the one tool.
        other: The robot with the other tool.

    Returns:
        None: it is not known, for it depends on an orientation that is left open.
    """
    if pose is None or robot is other:
        return pose
    if pose.rotation is None:
        return None
    shift = robot.tool_in_tip.actInv(other.tool_in_tip)
    return Pose(pose.position + pose.rotation @ shift.translation, pose.rotation @ shift.rotation)


def moved_pose(before: Pose, axes: FloatArray | None, waypoint: RelativeWaypoint) -> Pose:
    """Move the pose before; without an orientation, the result has none unless the tool turns.

    Args:
        before: The requested pose at the waypoint before.
        axes: (3, 3), of the tool there; not needed by a move in the base's axes that does not turn it.
        waypoint: The move.
    """
    turn, shift = waypoint.move.transform()
    rotation = axes if before.rotation is None and waypoint.turns_tool else before.rotation
    if waypoint.frame == "base":
        return Pose(before.position + shift, None if rotation is None else turn @ rotation)
    assert axes is not None  # noqa: S101 - wanted_poses leaves out what needs them and has none
    return Pose(before.position + axes @ shift, None if rotation is None else rotation @ turn)


def move_to(goal: Pose, before: Pose, axes: FloatArray | None, waypoint: RelativeWaypoint) -> CartesianMove | None:
    """Return the move of a relative waypoint to another pose; None: its axes are unknown.

    Args:
        goal: The pose to which the move is to lead.
        before: The requested pose at the waypoint before.
        axes: (3, 3), of the tool there; not needed by a move in the base's axes.
        waypoint: Whose frame the move is in.
    """
    shift, start = goal.position - before.position, axes if before.rotation is None else before.rotation
    if start is None and waypoint.turns_tool:
        return None
    if waypoint.frame == "base":
        turn = None if start is None or goal.rotation is None else goal.rotation @ start.T
    else:
        if axes is None:
            return None
        shift = axes.T @ shift
        turn = None if start is None or goal.rotation is None else start.T @ goal.rotation
    x, y, z = shift.tolist()
    return CartesianMove((x, y, z), turn)


def pose_remedy(
    index: int, waypoint: AnyWaypoint, goal: Pose, before: Pose | None, axes: FloatArray | None, explanation: str
) -> list[Remedy]:
    """Return the remedy that moves a waypoint to another pose; none if the list cannot express it.

    Args:
        index: Index of the waypoint.
        waypoint: A pose, or relative to one.
        goal: The pose at which it is to be, in the base frame.
        before: The requested pose at the waypoint before, if any.
        axes: (3, 3), of the tool there, if they are known.
        explanation: For a person.
    """
    if isinstance(waypoint, PoseWaypoint):
        in_its_frame = goal if waypoint.frame is None else goal.to_frame(waypoint.frame)
        return [Remedy(("waypoints", index, "pose"), in_its_frame, explanation)]
    if not isinstance(waypoint, RelativeWaypoint) or before is None:
        return []
    move = move_to(goal, before, axes, waypoint)
    if move is None:
        return []
    return [Remedy(("waypoints", index, "move"), move, explanation)]
