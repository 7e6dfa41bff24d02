"""Geometry of motion in joint space, without time."""

from planner.paths.joint_path import JointPath, solve_path

__all__ = ["JointPath", "solve_path"]
