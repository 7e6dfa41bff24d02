"""From waypoints to a joint path: every waypoint solved, straight joint motions between them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import InvalidProblem
from planner.kinematics.sequence import SolvedWaypoint, solve_waypoints
from planner.limits import SegmentLimits, segment_limits

if TYPE_CHECKING:
    from planner.kinematics.poses import FloatArray
    from planner.problem import PlanningProblem
    from planner.robots import Robot

SAME_POSITION = 1e-9
"""Waypoints closer than this in every joint (rad, m) are one and the same."""


@dataclass(frozen=True, eq=False)
class JointPath:
    """Straight joint motions from waypoint to waypoint, at rest at each. Its existence means: all are solved.

    Attributes:
        robot: With tool and payload.
        waypoints: Solved, in order; segment i goes from waypoint i to waypoint i + 1.
        limits: In force on each segment.
        durations: (segments,), s; NaN: as fast as the limits allow.
        dwells: (waypoints,), s.
    """

    robot: Robot
    waypoints: tuple[SolvedWaypoint, ...]
    limits: SegmentLimits = field(repr=False)
    durations: FloatArray
    dwells: FloatArray

    @cached_property
    def positions(self) -> FloatArray:
        """(waypoints, joints), rad or m."""
        return np.array([waypoint.position for waypoint in self.waypoints])

    @cached_property
    def travels(self) -> FloatArray:
        """(segments, joints): from the start of each segment to its end."""
        return np.diff(self.positions, axis=0)


def solve_path(problem: PlanningProblem) -> JointPath:
    """Solve the waypoints and lay straight joint motions between them.

    Raises:
        InvalidProblem: Two neighbouring waypoints are the same joint position.
        UnreachableWaypoint: A pose has no solution.
        JointPositionLimit: A waypoint lies beyond a joint's position limits.
    """
    robot = problem.robot if problem.payload is None else problem.robot.with_payload(problem.payload)
    own = tuple(waypoint.limits for waypoint in problem.waypoints[1:])
    durations = [np.nan if waypoint.duration is None else waypoint.duration for waypoint in problem.waypoints[1:]]
    path = JointPath(
        robot=robot,
        waypoints=solve_waypoints(robot, problem.waypoints, problem.inverse_kinematics),
        limits=segment_limits(robot, problem.limits, own),
        durations=np.array(durations),
        dwells=np.array([waypoint.dwell for waypoint in problem.waypoints]),
    )
    still = np.flatnonzero(np.abs(path.travels).max(axis=1) < SAME_POSITION)
    if len(still):
        message = "the same joint position as the waypoint before; to rest there, use that waypoint's dwell"
        raise InvalidProblem([(f"/waypoints/{i + 1}", message) for i in still])
    return path
