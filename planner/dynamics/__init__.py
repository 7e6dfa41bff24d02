"""Torques."""

from planner.dynamics.inverse import inverse_dynamics
from planner.dynamics.path_dynamics import PathDynamics, path_dynamics
from planner.dynamics.segments import SegmentDynamics

__all__ = ["PathDynamics", "SegmentDynamics", "inverse_dynamics", "path_dynamics"]
