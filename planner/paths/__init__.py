"""Geometry of motion in joint space, without time."""

from planner.paths.joint_path import JointPath, StraightMotions, dynamics_of, solve_path, solved_waypoints
from planner.paths.segment_groups import SegmentGroup

__all__ = ["JointPath", "SegmentGroup", "StraightMotions", "dynamics_of", "solve_path", "solved_waypoints"]
