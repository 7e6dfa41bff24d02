"""Geometry of motion in joint space, without time."""

from planner.paths.joint_path import JointPath, StraightMotions, dynamics_of, solve_path, solved_waypoints
from planner.paths.runs import Run

__all__ = ["JointPath", "Run", "StraightMotions", "dynamics_of", "solve_path", "solved_waypoints"]
