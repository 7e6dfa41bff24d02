"""Waypoints fixed at joint positions that the planner chose, and the problem with such waypoints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace

from planner.problems.motion_around import FixedWaypoint, FreeMotion, KeptMotion, as_requested
from planner.problems.problem import AnyWaypoint, JointMotion, JointWaypoint, PlanningProblem, Waypoint
from planner.problems.rides import RideMotion
from planner.spatial import FloatArray

AS_GIVEN = JointMotion("as_given")
"""The motion to a found joint position, without a change by whole turns of a joint."""


def fixed_motion(waypoint: AnyWaypoint) -> JointMotion:
    """Return the motion to a found joint position in place of the motion to a waypoint, with its constraints.

    A motion of a ride stays as it is.
    """
    motion = waypoint.motion
    if isinstance(motion, RideMotion):
        return motion
    return KeptMotion("as_given", keep=motion.keep) if isinstance(motion, KeptMotion) and motion.keep else AS_GIVEN


def fixed_at(waypoint: AnyWaypoint, position: FloatArray) -> FixedWaypoint:
    """Return a waypoint fixed at its solved joint position (joints,)."""
    motion = fixed_motion(waypoint) if isinstance(waypoint.motion, JointMotion) else waypoint.motion
    kept = {field.name: getattr(waypoint, field.name) for field in fields(Waypoint)} | {"motion": motion}
    name = waypoint.position_name if isinstance(waypoint, JointWaypoint) else None
    return FixedWaypoint(position.tolist(), name, requested=as_requested(waypoint), **kept)


def with_fixed(problem: PlanningProblem, positions: Mapping[int, FloatArray]) -> PlanningProblem:
    """Return the problem with waypoints fixed at joint positions (joints,), by their indices; free motions stay."""
    if not positions:
        return problem
    waypoints = list(problem.waypoints)
    for k, position in positions.items():
        fixed, motion = fixed_at(waypoints[k], position), waypoints[k].motion
        waypoints[k] = replace(fixed, motion=motion) if isinstance(motion, FreeMotion) else fixed
    return replace(problem, waypoints=tuple(waypoints))
