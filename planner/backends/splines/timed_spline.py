"""Splines in time through waypoints: C2 of degree 3 and C4 of degree 5, at given durations or the shortest."""

from __future__ import annotations

import numpy as np

from planner.backends.splines.interpolation import Degree, interpolate
from planner.backends.splines.shortest_durations import search_durations
from planner.backends.splines.spline_limits import (
    SplineAgainstLimits,
    hold_against_limits,
)
from planner.guarantees import JOINT_DERIVATIVES
from planner.limits import SegmentLimits
from planner.spatial import FloatArray
from planner.tolerances import DURATION_TOLERANCE
from planner.trajectories.polynomials import PiecewisePolynomial


class NothingLimits(Exception):
    """Durations are free, and there is no limit, or no travel, that would set one."""


def timed_spline(
    positions: FloatArray, limits: SegmentLimits, requested: FloatArray, degree: Degree
) -> PiecewisePolynomial:
    """Find the spline that keeps the limits, at the requested durations, and at the shortest for the others.

    The shortest is a local minimum. Between waypoints within the position limits the spline may overshoot them;
    only other ratios of the durations help against that.

    Args:
        positions: Positions (segments + 1, joints), rad or m, within the position limits.
        limits: The limits of each segment and joint.
        requested: Requested durations (segments,), s, positive; NaN: the shortest.
        degree: 3 or 5.

    Raises:
        DurationsTooShort: The requested durations break a limit.
        PositionOvershoot: Position limits are left between waypoints.
        NothingLimits: Nothing sets the free durations.
    """
    free = np.isnan(requested)

    def assess(durations: FloatArray) -> SplineAgainstLimits:
        return hold_against_limits(interpolate(positions, durations, degree), positions, limits)

    start = np.where(free, _first_guess(positions, limits, degree), requested)
    if free.any() and not (start[free] > 0.0).any():
        raise NothingLimits
    # A segment that nothing limits, or without travel, has a duration only for its neighbours' sake.
    start = np.where(start > 0.0, start, 0.2 * start.max())
    motion = search_durations(assess, start, free) if free.any() else assess(start)
    motion.refuse_overshoot()
    factor = float(motion.ratios.max())
    if free.all():
        motion = assess(motion.durations * factor)
    elif factor > 1.0 + DURATION_TOLERANCE:
        raise motion.too_short_error()
    return motion.spline.curve


def _first_guess(positions: FloatArray, limits: SegmentLimits, degree: Degree) -> FloatArray:
    """Guess the durations (segments,), s, that the segments would need in a smooth motion."""
    travels = np.abs(np.diff(positions, axis=0))
    velocity, acceleration, jerk = (limits.magnitudes(quantity) for quantity in JOINT_DERIVATIVES[1:])
    needed = np.maximum(travels / velocity, 2.0 * np.sqrt(travels / acceleration))
    if degree == 5:
        needed = np.maximum(needed, 3.0 * np.cbrt(travels / jerk))
    guess: FloatArray = needed.max(axis=1)
    return guess
