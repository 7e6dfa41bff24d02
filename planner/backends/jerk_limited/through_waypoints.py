"""Jerk-limited motions through waypoints between which the path is free."""

from __future__ import annotations

from planner.backends.jerk_limited.straight_lines import along_lines
from planner.backends.shared.smooth_curve import smoothed
from planner.paths import JointPath, SegmentGroup
from planner.time_scaling.fastest import time_group
from planner.trajectories.polynomials import SegmentedPolynomial


def time_through_waypoints(path: JointPath, group: SegmentGroup) -> SegmentedPolynomial:
    """Return the fastest jerk-limited motion through the waypoints of a group, or stop at each if that is faster.

    A stop is faster at waypoints that almost coincide. A smooth curve through two that are 1e-9 rad apart turns
    sharply. A jerk-limited motion almost stops there, and its time scaling is hard to find.

    Raises:
        InvalidProblem: A segment that is not alone in its group has a duration.
        InfeasibleDuration: The requested duration is too short.
        LimitsUnsatisfiable: Nothing limits the duration, or gravity exceeds a torque limit.
    """
    passing = time_group(path, smoothed(path, group))
    if not group.is_spline or len(group.segments) == 1:
        return passing
    stopping = along_lines(path.straight_motions(group.segments))
    return min(passing, stopping, key=lambda motion: float(motion.lengths.sum()))
