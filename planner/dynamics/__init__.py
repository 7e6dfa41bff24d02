"""Torques."""

from planner.dynamics.heaviest_payload import heaviest_mass
from planner.dynamics.inverse import inverse_dynamics, torques_by_pace
from planner.dynamics.path_dynamics import PathDynamics, path_dynamics
from planner.dynamics.segments import SegmentDynamics

__all__ = ["PathDynamics", "SegmentDynamics", "heaviest_mass", "inverse_dynamics", "path_dynamics", "torques_by_pace"]
