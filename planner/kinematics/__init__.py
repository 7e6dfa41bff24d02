"""Forward and inverse kinematics and the workspace, on Pinocchio."""

from planner.kinematics.forward import forward_kinematics, jacobian, manipulability, singular_values, tool_speeds
from planner.kinematics.inverse import (
    InverseKinematicsResult,
    all_solutions,
    inverse_kinematics,
    is_isolated,
    pose_errors,
    solution_layers,
    solutions_or_failure,
    with_whole_turns,
)
from planner.kinematics.poses import FloatArray, Pose, poses_as_dicts, quaternion
from planner.kinematics.workspace import Extreme, Workspace, workspace

__all__ = [
    "Extreme",
    "FloatArray",
    "InverseKinematicsResult",
    "Pose",
    "Workspace",
    "all_solutions",
    "forward_kinematics",
    "inverse_kinematics",
    "is_isolated",
    "jacobian",
    "manipulability",
    "pose_errors",
    "poses_as_dicts",
    "quaternion",
    "singular_values",
    "solution_layers",
    "solutions_or_failure",
    "tool_speeds",
    "with_whole_turns",
    "workspace",
]
