"""Errors that paths and splines make alike."""

from __future__ import annotations

from collections.abc import Sequence

from planner.errors import JointPositionLimit, Remedy
from planner.problems.transitions import StopTransition


def passing_error(waypoints: Sequence[int], segment: int, joint: str, value: float, limit: float) -> JointPositionLimit:
    """Return the error where passing one of some waypoints without stopping takes a joint beyond its limit.

    Args:
        waypoints: Indices of the waypoints at the ends of the segment that are passed without stopping.
        segment: Index of the segment.
        joint: Name of the joint.
        value: The position at which the joint would be, rad or m.
        limit: The position limit that it breaks, rad or m.
    """
    return JointPositionLimit(
        f"passing waypoint {{waypoint}} without stopping would take {joint} beyond its limit {limit:.6g}",
        waypoint=waypoints[0],
        segment=segment,
        joint=joint,
        value=value,
        limit=limit,
        remedies=[Remedy(("waypoints", k, "transition"), StopTransition(), "come to rest there") for k in waypoints],
    )
