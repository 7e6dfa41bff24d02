"""A path of the tool followed while the axes of a positioner go evenly to their given positions at its end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tolerances import SAME_CONFIGURATION
from planner.tool_motions.follow import Lost, Track
from planner.tool_motions.follow_many import follow_any
from planner.tool_motions.pose_paths import PosePath
from planner.tool_motions.position_limits import first_beyond
from planner.trajectories.polynomials import PiecewisePolynomial


def follow_evenly(
    robot: Robot, path: PosePath, start: FloatArray, ends: Sequence[FloatArray], tolerance: tuple[float, float]
) -> PiecewisePolynomial | None:
    """Follow a path within the position limits to one of the given ends; None: the arm cannot.

    The positions of the arm's joints follow from the path and from the axes, so one attempt for each end of the axes
    suffices.

    Args:
        robot: An arm beside a positioner, whose axes are its first joints.
        path: The path of the tool.
        start: (joints,), rad or m.
        ends: Joint positions (joints,) at which the path may end.
        tolerance: m and rad.
    """
    count, tried = len(robot.positioner) if robot.external_axes else 0, list[FloatArray]()
    if not count or robot.dof <= len(path.twist(0.0)):
        return None
    for end in ends:
        if any(np.array_equal(end[:count], other) for other in tried):
            continue
        tried.append(end[:count])
        curve = follow_any(Track(robot, path, start, end, tolerance), robot.positioner)
        if isinstance(curve, Lost) or first_beyond(robot, curve) is not None:
            continue
        (reached,) = curve.evaluate(curve.breakpoints[-1:], [0])[0]
        if any(np.abs(other - reached).max() <= SAME_CONFIGURATION for other in ends):
            return curve
    return None
