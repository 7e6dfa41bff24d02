"""Forward and inverse kinematics on Pinocchio."""

from planner.kinematics.forward import forward_kinematics, jacobian, manipulability, tool_speeds
from planner.kinematics.inverse import InverseKinematicsResult, inverse_kinematics
from planner.kinematics.poses import FloatArray, Pose, poses_as_dicts, quaternion

__all__ = [
    "FloatArray",
    "InverseKinematicsResult",
    "Pose",
    "forward_kinematics",
    "inverse_kinematics",
    "jacobian",
    "manipulability",
    "poses_as_dicts",
    "quaternion",
    "tool_speeds",
]
