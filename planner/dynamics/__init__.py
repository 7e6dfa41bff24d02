"""Torques."""

from planner.dynamics.inverse import inverse_dynamics

__all__ = ["inverse_dynamics"]
