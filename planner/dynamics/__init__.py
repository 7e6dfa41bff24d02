"""Torques."""

from planner.dynamics.inverse import PathDynamics, heaviest_mass, inverse_dynamics, path_dynamics, torques_by_pace
from planner.dynamics.segments import SegmentDynamics

__all__ = ["PathDynamics", "SegmentDynamics", "heaviest_mass", "inverse_dynamics", "path_dynamics", "torques_by_pace"]
