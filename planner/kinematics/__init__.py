"""Forward and inverse kinematics and the workspace, on Pinocchio."""

from planner.kinematics.configurations import Configuration, configurations, in_configuration, named_parts
from planner.kinematics.forward import (
    forward_kinematics,
    frame_poses,
    jacobian,
    manipulability,
    singular_values,
    tool_accelerations,
    tool_jerks,
    tool_pose,
    tool_poses,
    tool_speeds,
    tool_velocities,
)
from planner.kinematics.inverse import (
    InverseKinematicsResult,
    IsFree,
    all_solutions,
    free_first,
    inverse_kinematics,
    inverse_kinematics_many,
    solution_layers,
    solutions_or_failure,
    with_free_ones,
)
from planner.kinematics.search import is_isolated, pose_errors
from planner.kinematics.turns import with_whole_turns
from planner.kinematics.workspace import Extreme, Workspace, workspace
from planner.spatial import FloatArray, Pose, quaternion

__all__ = [
    "Configuration",
    "Extreme",
    "FloatArray",
    "InverseKinematicsResult",
    "IsFree",
    "Pose",
    "Workspace",
    "all_solutions",
    "configurations",
    "forward_kinematics",
    "frame_poses",
    "free_first",
    "in_configuration",
    "inverse_kinematics",
    "inverse_kinematics_many",
    "is_isolated",
    "jacobian",
    "manipulability",
    "named_parts",
    "pose_errors",
    "quaternion",
    "singular_values",
    "solution_layers",
    "solutions_or_failure",
    "tool_accelerations",
    "tool_jerks",
    "tool_pose",
    "tool_poses",
    "tool_speeds",
    "tool_velocities",
    "with_free_ones",
    "with_whole_turns",
    "workspace",
]
