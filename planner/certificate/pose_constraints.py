"""The checks of constraints on the pose of the tool: each value stays within its limit at all times."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.certificate.checks import Check
from planner.constraints.kept_poses import KeptPoses
from planner.problems.motion_around import KeptMotion
from planner.problems.problem import AnyWaypoint
from planner.robots import Robot
from planner.trajectories.polynomials import PiecewisePolynomial
from planner.trajectories.trajectory import Trajectory


def certify_pose_constraints(
    trajectory: Trajectory, robots: Sequence[Robot], waypoints: Sequence[AnyWaypoint]
) -> list[Check]:
    """Bound the values of the constraints on the segments that keep them.

    Args:
        trajectory: The trajectory to be checked.
        robots: The robot with the tool of each waypoint.
        waypoints: The requested waypoints, with the corners of detours.

    Returns:
        One check for each kind of constraint, of the value that uses the largest share of its limit.
    """
    worst: dict[str, Check] = {}
    for index, waypoint in enumerate(waypoints):
        pieces = np.flatnonzero(trajectory.segments == index - 1)
        if not isinstance(waypoint.motion, KeptMotion) or not len(pieces):
            continue
        motion = PiecewisePolynomial(trajectory.lengths[pieces], trajectory.coefficients[pieces])
        keep = waypoint.motion.keep
        for own, found in zip(keep, KeptPoses(robots[index], keep).largest_values(motion), strict=True):
            check = Check(
                quantity=own.quantity,
                joint=None,
                peak=found.bound,
                limit=own.limit,
                ratio=own.ratio(found.bound),
                time=float(trajectory.breakpoints[pieces[0]]) + found.time,
                method="bounded",
                enforced=True,
                bounded=True,
                lower=found.reached,
            )
            before = worst.get(own.quantity)
            if before is None or (check.ratio or 0.0) > (before.ratio or 0.0):
                worst[own.quantity] = check
    return list(worst.values())
