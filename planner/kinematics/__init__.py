"""Forward and inverse kinematics on Pinocchio."""

from planner.kinematics.forward import forward_kinematics, jacobian, manipulability, tool_speeds
from planner.kinematics.inverse import (
    InverseKinematicsResult,
    all_solutions,
    inverse_kinematics,
    is_isolated,
    pose_errors,
    with_whole_turns,
)
from planner.kinematics.poses import FloatArray, Pose, poses_as_dicts, quaternion

__all__ = [
    "FloatArray",
    "InverseKinematicsResult",
    "Pose",
    "all_solutions",
    "forward_kinematics",
    "inverse_kinematics",
    "is_isolated",
    "jacobian",
    "manipulability",
    "pose_errors",
    "poses_as_dicts",
    "quaternion",
    "tool_speeds",
    "with_whole_turns",
]
