"""The joint positions at open waypoints to which another trajectory leads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.kinematics.forward import tool_poses
from planner.planning.off_path.descent import Points
from planner.planning.off_path.open_waypoints import OpenWaypoint
from planner.spatial import FloatArray
from planner.trajectories.trajectory import Trajectory

SAMPLED_ROWS = 2000
"""The number of samples of a trajectory among which the waypoints are found."""


def points_on(trajectory: Trajectory, points: Points) -> Points | None:
    """Return the points with the open waypoints near a trajectory; None: it comes near no other solution.

    The waypoints are where the trajectory comes nearest to them, one after the other. The sum of the distances is
    least: of the tool at open waypoints, m, and of the joints at other ones, rad or m. The step to the next sample,
    rad or m, counts too, so that stops are preferred.

    Args:
        trajectory: A trajectory of the same joints, of any origin.
        points: The points of a path with its waypoints.
    """
    samples = trajectory(np.linspace(0.0, trajectory.duration, SAMPLED_ROWS))
    steps = np.abs(np.diff(samples, axis=0, append=samples[-1:])).max(axis=1)
    away = np.array([np.abs(samples - position).max(axis=1) for position in points.positions]) + steps
    for waypoint, row in points.rows:
        away[row] = _distances(waypoint, samples) + steps
    chosen = samples[_nearest_in_order(away)]
    found, positions = list(points.coordinates), points.positions.copy()
    for k, (waypoint, row) in enumerate(points.rows):
        solved = waypoint.returned(waypoint.coordinates(chosen[row]))
        if solved is not None:
            found[k] = solved
            positions[row] = waypoint.position(solved)
    if np.array_equal(positions, points.positions):
        return None
    return replace(points, coordinates=tuple(found), positions=positions)


def _distances(waypoint: OpenWaypoint, samples: FloatArray) -> FloatArray:
    """Return the distances (samples,), m, of the tool from the pose of a waypoint, or from its region."""
    away = tool_poses(waypoint.robot, samples)[0] - waypoint.pose.position
    if waypoint.region is not None and waypoint.pose.rotation is not None:
        ranges = np.array([waypoint.region.ranges.get(axis, (0.0, 0.0)) for axis in "xyz"])
        away = away @ waypoint.pose.rotation
        away -= np.clip(away, *ranges.T)
    return np.asarray(np.linalg.norm(away, axis=1), dtype=np.float64)


def _nearest_in_order(away: FloatArray) -> list[int]:
    """Return a sample for each row (rows, samples), none before that of the row before, of the least sum."""
    sums = away[0]
    befores = []
    for row in away[1:]:
        least = np.minimum.accumulate(sums)
        befores.append(np.maximum.accumulate(np.where(sums == least, np.arange(len(sums)), 0)))
        sums = row + least
    chosen = [int(sums.argmin())]
    for before in reversed(befores):
        chosen.append(int(before[chosen[-1]]))
    return chosen[::-1]
