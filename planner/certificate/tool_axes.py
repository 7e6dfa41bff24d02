"""The check of axes of the tool: each stays within the requested angle of its direction at all times."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.certificate.checks import Check
from planner.problems.motion_around import KeptMotion
from planner.trajectories.polynomials import PiecewisePolynomial

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.problems.problem import AnyWaypoint
    from planner.robots import Robot
    from planner.trajectories.trajectory import Trajectory


def certify_tool_axes(trajectory: Trajectory, robots: Sequence[Robot], waypoints: Sequence[AnyWaypoint]) -> list[Check]:
    """Bound the angles of axes of the tool on the segments that keep them.

    Args:
        trajectory: The trajectory to be checked.
        robots: The robot with the tool of each waypoint.
        waypoints: The requested waypoints, with the corners of detours.

    Returns:
        The check of the largest share of an allowed angle; none without such a constraint.
    """
    checks = []
    for index, waypoint in enumerate(waypoints):
        pieces = np.flatnonzero(trajectory.segments == index - 1)
        if not isinstance(waypoint.motion, KeptMotion) or not len(pieces):
            continue
        motion = PiecewisePolynomial(trajectory.lengths[pieces], trajectory.coefficients[pieces])
        for axis in waypoint.motion.keep:
            found = axis.largest_angle(robots[index], motion)
            check = Check(
                quantity="tool_axis_angle",
                joint=None,
                peak=found.bound,
                limit=axis.angle,
                ratio=found.bound / axis.angle,
                time=float(trajectory.breakpoints[pieces[0]]) + found.time,
                method="bounded",
                enforced=True,
                bounded=True,
                lower=found.reached,
            )
            checks.append(check)
    return [max(checks, key=lambda check: check.ratio or 0.0)] if checks else []
