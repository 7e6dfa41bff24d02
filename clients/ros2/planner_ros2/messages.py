"""Requests of MoveIt's services as requests to the planner service, and the way back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from planner_ros2.service import (
    FRAME_TRANSFORM_FAILURE,
    INVALID_GOAL_CONSTRAINTS,
    INVALID_LINK_NAME,
    INVALID_ROBOT_STATE,
    RefusedError,
)

Message = Mapping[str, Any]

FLANGE = {"position": [0.0, 0.0, 0.0], "orientation": {"kind": "quaternion", "xyzw": [0.0, 0.0, 0.0, 1.0]}}
"""The tool of requests: MoveIt's poses are about the tip link itself."""

UNTURNED = 1e-12
"""The largest distance of a quaternion's scalar part from 1 in a frame that is not turned."""

CONSTRAINT_LISTS = ("joint_constraints", "position_constraints", "orientation_constraints", "visibility_constraints")
"""The fields of `moveit_msgs/msg/Constraints`."""


def state_message(joints: Sequence[str], positions: Sequence[float]) -> dict[str, Any]:
    """Return a `moveit_msgs/msg/RobotState` with joint positions, rad or m."""
    return {"joint_state": {"name": list(joints), "position": list(positions)}}


def state_positions(joints: Sequence[str], state: Message, current: Mapping[str, float]) -> list[float]:
    """Return the joint positions in a `moveit_msgs/msg/RobotState`, rad or m.

    Args:
        joints: The names of the robot's joints.
        state: The message.
        current: The current positions by joint, for joints that the message lacks.

    Raises:
        RefusedError: A joint has a position in neither.
    """
    given = state.get("joint_state", {})
    names, values = given.get("name", []), given.get("position", [])
    if len(names) != len(values):
        raise RefusedError(INVALID_ROBOT_STATE, f"{len(names)} joint names have {len(values)} positions")
    known = {**current, **dict(zip(names, values, strict=True))}
    if missing := [joint for joint in joints if joint not in known]:
        raise RefusedError(INVALID_ROBOT_STATE, f"neither the request nor the joint states have {', '.join(missing)}")
    return [known[joint] for joint in joints]


def pose_waypoint(pose: Message, has_orientation: bool = True) -> dict[str, Any]:
    """Return a waypoint at a `geometry_msgs/msg/Pose` in the base frame."""
    place: dict[str, Any] = {"position": [pose["position"][axis] for axis in "xyz"]}
    if has_orientation:
        place["orientation"] = {"kind": "quaternion", "xyzw": [pose["orientation"][part] for part in "xyzw"]}
    return {"kind": "pose", "pose": place}


def goal_waypoint(request: Message, robot: Message, start: Sequence[float]) -> dict[str, Any]:
    """Return the waypoint of the goal in a `moveit_msgs/msg/MotionPlanRequest`.

    Args:
        request: The message.
        robot: The robot in the service's words.
        start: The joint positions at the start, rad or m, which joints without a constraint keep.

    Raises:
        RefusedError: The service cannot plan to such a goal.
    """
    if any(request.get("path_constraints", {}).get(kind) for kind in CONSTRAINT_LISTS):
        raise RefusedError(INVALID_GOAL_CONSTRAINTS, "path constraints are not supported")
    goals = request.get("goal_constraints", [])
    if len(goals) != 1:
        raise RefusedError(INVALID_GOAL_CONSTRAINTS, f"one goal is supported; got {len(goals)}")
    joints, positions, orientations, visible = (goals[0].get(kind, []) for kind in CONSTRAINT_LISTS)
    if visible or bool(joints) == bool(positions) or len(positions) > 1 or len(orientations) > len(positions):
        raise RefusedError(
            INVALID_GOAL_CONSTRAINTS, "the goal must have joint constraints, or a position with at most one orientation"
        )
    if joints:
        names = robot["joint_names"]
        if unknown := [each["joint_name"] for each in joints if each["joint_name"] not in names]:
            raise RefusedError(INVALID_GOAL_CONSTRAINTS, f"{robot['id']} has no joint {', '.join(unknown)}")
        goal = dict(zip(names, start, strict=True)) | {each["joint_name"]: each["position"] for each in joints}
        return {"kind": "joint", "position": list(goal.values())}
    (position,) = positions
    for constraint in (*positions, *orientations):
        check_frame(constraint, robot)
        check_link(constraint.get("link_name", ""), robot)
    if any(position.get("target_point_offset", {}).values()):
        raise RefusedError(INVALID_GOAL_CONSTRAINTS, "an offset of the target point is not supported")
    poses = position.get("constraint_region", {}).get("primitive_poses", [])
    if len(poses) != 1:
        raise RefusedError(INVALID_GOAL_CONSTRAINTS, f"the region of the goal must have one pose; got {len(poses)}")
    orientation = {"orientation": orientations[0]["orientation"]} if orientations else {}
    return pose_waypoint({"position": poses[0]["position"], **orientation}, bool(orientations))


def check_frame(message: Message, robot: Message) -> None:
    """Refuse poses in other frames than the base of the robot.

    Raises:
        RefusedError: The header names another frame.
    """
    frame = message.get("header", {}).get("frame_id", "")
    bases = base_frames(robot)
    if frame not in {"", *bases}:
        raise RefusedError(FRAME_TRANSFORM_FAILURE, f"the frame must be one of {', '.join(bases)}; got {frame}")


def base_frames(robot: Message) -> list[str]:
    """Return the names of all frames that are the robot's base frame."""
    still = (each for each in robot["placements"] if each["after"] == 0)
    return [
        each["frame"]
        for each in still
        if not any(each["position"]) and abs(each["quaternion_xyzw"][3]) > 1.0 - UNTURNED
    ]


def check_link(link: str, robot: Message) -> None:
    """Refuse poses of other links than the tip of the robot.

    Raises:
        RefusedError: It is another link.
    """
    if link not in {"", robot["tip_frame"]}:
        raise RefusedError(INVALID_LINK_NAME, f"the link must be {robot['tip_frame']}; got {link}")


def scaled_limits(request: Message) -> dict[str, Any]:
    """Return a message's scaling factors as limits of a plan request; 0 stands for 1, as in MoveIt."""
    factors = {f"{kind}_scale": request.get(f"max_{kind}_scaling_factor", 0.0) for kind in ("velocity", "acceleration")}
    return {name: factor for name, factor in factors.items() if factor}
