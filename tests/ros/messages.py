"""Fields of ROS 2 messages, from the definitions of common_interfaces, control_msgs and moveit_msgs."""

from __future__ import annotations

from typing import Any

FIELDS: dict[str, dict[str, str]] = {
    "Time": {"sec": "int32", "nanosec": "uint32"},
    "Header": {"stamp": "Time", "frame_id": "string"},
    "JointState": {
        "header": "Header",
        "name": "string[]",
        "position": "float64[]",
        "velocity": "float64[]",
        "effort": "float64[]",
    },
    "JointTrajectoryPoint": {
        "positions": "float64[]",
        "velocities": "float64[]",
        "accelerations": "float64[]",
        "effort": "float64[]",
        "time_from_start": "Time",
    },
    "JointTrajectory": {"header": "Header", "joint_names": "string[]", "points": "JointTrajectoryPoint[]"},
    "FollowJointTrajectoryGoal": {"trajectory": "JointTrajectory", "goal_time_tolerance": "Time"},
    "Point": {"x": "float64", "y": "float64", "z": "float64"},
    "Quaternion": {"x": "float64", "y": "float64", "z": "float64", "w": "float64"},
    "Pose": {"position": "Point", "orientation": "Quaternion"},
    "PoseStamped": {"header": "Header", "pose": "Pose"},
    "RobotState": {"joint_state": "JointState", "is_diff": "bool"},
    "RobotTrajectory": {"joint_trajectory": "JointTrajectory"},
    "MoveItErrorCodes": {"val": "int32"},
    "MotionPlanResponse": {
        "trajectory_start": "RobotState",
        "group_name": "string",
        "trajectory": "RobotTrajectory",
        "planning_time": "float64",
        "error_code": "MoveItErrorCodes",
    },
    "GetMotionPlanResponse": {"motion_plan_response": "MotionPlanResponse"},
    "GetCartesianPathResponse": {
        "start_state": "RobotState",
        "solution": "RobotTrajectory",
        "fraction": "float64",
        "error_code": "MoveItErrorCodes",
    },
    "GetPositionIKResponse": {"solution": "RobotState", "error_code": "MoveItErrorCodes"},
    "GetPositionFKResponse": {
        "pose_stamped": "PoseStamped[]",
        "fk_link_names": "string[]",
        "error_code": "MoveItErrorCodes",
    },
}
"""The fields of each message that a test sends or receives, with their types; `[]` marks a list."""

INTEGERS = {"int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1)}
"""The ranges of integer types."""


def check(message: Any, kind: str) -> None:
    """Raise a `ValueError` when a message has a field or a value that rosbridge would not convert."""
    if kind.endswith("[]"):
        for entry in message:
            check(entry, kind[:-2])
    elif kind in FIELDS:
        for name, value in message.items():
            if name not in FIELDS[kind]:
                raise ValueError(f"{kind} has no field {name}")
            check(value, FIELDS[kind][name])
    elif kind in INTEGERS:
        low, high = INTEGERS[kind]
        if type(message) is not int or not low <= message <= high:
            raise ValueError(f"{message!r} is no {kind}")
    elif not isinstance(message, {"string": str, "bool": bool, "float64": int | float}[kind]):
        raise ValueError(f"{message!r} is no {kind}")
