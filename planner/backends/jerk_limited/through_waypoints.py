"""Jerk-limited motions through waypoints between which the path is free."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.backends.jerk_limited.straight_lines import along_lines
from planner.backends.shared.smooth_curve import smoothed
from planner.time_scaling.fastest import time_run

if TYPE_CHECKING:
    from planner.paths import JointPath, Run
    from planner.trajectories.polynomials import SegmentedPolynomial


def time_through_waypoints(path: JointPath, run: Run) -> SegmentedPolynomial:
    """Give the fastest law found along a smooth curve through the waypoints of a run, never slower than a stop at each.

    A stop is the better way past waypoints that are next to each other: a smooth curve through two that are 1e-9 rad
    apart turns so sharply that a jerk-limited law along it all but stops there, and is hard to find.

    Raises:
        InvalidProblem: A duration is asked of a segment that is not alone in its run.
        InfeasibleDuration: The asked duration is too short.
        LimitsUnsatisfiable: Nothing limits the duration, or gravity exceeds a torque limit.
    """
    passing = time_run(path, smoothed(path, run))
    if not run.is_spline or len(run.segments) == 1:
        return passing
    stopping = along_lines(path.straight_motions(run.segments))
    return min(passing, stopping, key=lambda motion: float(motion.lengths.sum()))
