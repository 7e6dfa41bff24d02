"""Lists of waypoints: their poses, their candidate joint positions, and the choice among these."""

from planner.waypoints.solve import SolvedWaypoint

__all__ = ["SolvedWaypoint"]
