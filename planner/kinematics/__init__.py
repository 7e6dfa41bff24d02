"""Forward and inverse kinematics and the workspace, on Pinocchio."""

from planner.kinematics.forward import forward_kinematics, jacobian, manipulability, singular_values, tool_speeds
from planner.kinematics.inverse import InverseKinematicsResult, inverse_kinematics
from planner.kinematics.poses import FloatArray, Pose, poses_as_dicts, quaternion
from planner.kinematics.workspace import Extreme, Workspace, workspace

__all__ = [
    "Extreme",
    "FloatArray",
    "InverseKinematicsResult",
    "Pose",
    "Workspace",
    "forward_kinematics",
    "inverse_kinematics",
    "jacobian",
    "manipulability",
    "poses_as_dicts",
    "quaternion",
    "singular_values",
    "tool_speeds",
    "workspace",
]
