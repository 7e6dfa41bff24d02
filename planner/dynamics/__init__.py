"""Torques."""

from planner.dynamics.inverse import inverse_dynamics
from planner.dynamics.path_dynamics import PathDynamics, path_dynamics

__all__ = ["PathDynamics", "inverse_dynamics", "path_dynamics"]
