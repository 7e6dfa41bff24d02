"""Geometry of motion in joint space, without time."""

from planner.paths.joint_path import JointPath, SolvedWaypoint, solve_path

__all__ = ["JointPath", "SolvedWaypoint", "solve_path"]
