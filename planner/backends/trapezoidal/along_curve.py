"""Trapezoids along the curve of a segment group: on each interval as fast as the limits there allow."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planner.paths import JointPath, SegmentGroup
from planner.spatial import FloatArray
from planner.time_scaling.compose import ToolSpeeds, follow_curve, split_at_knots
from planner.time_scaling.refusals import (
    RAMPS,
    BindingLimit,
    duration_of_group,
    infeasible_duration_error,
    ramps_error,
)
from planner.time_scaling.uniform import TimeScaling, scaled_to_duration, slowest, time_scalings
from planner.tolerances import DURATION_TOLERANCE, NEGLIGIBLE_SHARE
from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial

CURVE_GRIDPOINTS = 64
"""Number of gridpoints on each interval of the curve at which speed and acceleration along it are limited."""

CURVATURE_SHARES = np.linspace(0.05, 0.95, 19)
"""Shares of the acceleration limits for the curvature, the rest being for gaining speed; the best one is taken."""

LEAST_RAMP_RATIO = 1.001
"""Least ratio of the speeds that a ramp leads between."""

MOST_RAMP_LENGTHENINGS = 60
"""Number of times that a segment group with given ramps is lengthened, at most, until it keeps its limits."""

LENGTHENING_EXCESS = 1.0 + 1e-6
"""Factor by which such a group is lengthened beyond its need, so that the search ends."""


def time_group(path: JointPath, group: SegmentGroup, enforced: frozenset[str]) -> SegmentedPolynomial:
    """Accelerate, cruise and brake on each interval between waypoints and ends of blends.

    On each interval the speed along the curve is limited to V and its change to A, such that
    |q'' V^2| + |q' A| keeps the acceleration limits. The speeds at the ends of the intervals are the highest from which
    the next can be reached and the last be braked (a forward and a backward pass).

    Raises:
        InvalidProblem: A duration is requested of a segment that is not alone in its group.
        InfeasibleDuration: The requested duration is too short.
        LimitsUnsatisfiable: Nothing limits the duration, or gravity exceeds a torque limit.
    """
    requested = duration_of_group(path, group)
    return scaled_to_duration(path, group, requested, follow_curve(group, _fastest(path, group)), enforced)


def time_group_with_ramps(
    path: JointPath,
    group: SegmentGroup,
    scaling_of: Callable[[float], PiecewisePolynomial],
    ramps: float,
    enforced: frozenset[str],
) -> SegmentedPolynomial:
    """Put one trapezoid over the whole group, with given times of acceleration and braking.

    Args:
        path: The path, with limits and durations.
        group: A segment group of the path.
        scaling_of: The time scaling s(t) from 0 to 1 in a given time, s.
        ramps: The time of both ramps, s: the least duration there is.
        enforced: The quantities whose limits are kept.

    Raises:
        InvalidProblem: A duration is requested of a segment that is not alone in its group.
        InfeasibleDuration: The requested duration is too short.
        LimitsUnsatisfiable: Gravity exceeds a torque limit, or the limits cannot be kept with these ramps.
    """
    requested = duration_of_group(path, group)
    knots = group.curve.breakpoints[group.waypoint_knots[1:-1]]

    def at(duration: float) -> tuple[SegmentedPolynomial, TimeScaling]:
        """Return the motion in a duration, s, and how it has to be scaled in time to keep its limits."""
        scaling = scaling_of(duration)
        whole = PiecewisePolynomial(scaling.lengths, scaling.coefficients * group.curve.breakpoints[-1])
        pieces = follow_curve(group, split_at_knots(whole, knots, group.segments))
        return pieces, slowest(time_scalings(path, pieces, enforced).values())

    duration = ramps if np.isnan(requested) else max(requested, ramps)
    binding = BindingLimit(RAMPS)
    for _ in range(MOST_RAMP_LENGTHENINGS):
        pieces, now = at(duration)
        if now.factor <= 1.0 + DURATION_TOLERANCE:
            break
        duration, binding = duration * now.factor * LENGTHENING_EXCESS, now.binding
    else:
        raise ramps_error(binding)
    if requested < duration * (1.0 - DURATION_TOLERANCE):
        raise infeasible_duration_error(requested, {group.first: duration}, binding)
    return pieces


def _fastest(path: JointPath, group: SegmentGroup) -> SegmentedPolynomial:
    """Return the fastest time scaling over all `CURVATURE_SHARES` of the acceleration limits for the curvature."""
    knots, segments = group.curve.breakpoints[group.knots], group.curve.segments[group.knots[:-1]]
    lengths = np.diff(knots)
    unit = (np.arange(CURVE_GRIDPOINTS) + 0.5) / CURVE_GRIDPOINTS
    at = (knots[:-1, None] + unit * lengths[:, None]).ravel()
    first, second = (np.abs(x).reshape(len(lengths), CURVE_GRIDPOINTS, -1) for x in group.curve.evaluate(at, [1, 2]))
    velocity, acceleration = (path.limits.magnitudes(name)[segments][:, None] for name in ("velocity", "acceleration"))
    with np.errstate(divide="ignore"):
        plain = 1.0 / np.max(first / velocity, axis=(1, 2))
        plain = np.minimum(
            plain, 1.0 / ToolSpeeds(path, group).shares_at(at).reshape(len(lengths), CURVE_GRIDPOINTS).max(axis=1)
        )
        curved = 1.0 / np.max(second / acceleration, axis=(1, 2))
        straight = 1.0 / np.max(first / acceleration, axis=(1, 2))
    scalings = [
        _trapezoids(lengths, np.minimum(plain, np.sqrt(share * curved)), (1.0 - share) * straight, segments)
        for share in CURVATURE_SHARES
    ]
    return min(scalings, key=lambda scaling: float(scaling.lengths.sum()))


def _trapezoids(lengths: FloatArray, most: FloatArray, gain: FloatArray, segments: np.ndarray) -> SegmentedPolynomial:
    """Compute the fastest time scaling with speeds up to `most` and accelerations up to `gain`."""
    most = np.where(np.isfinite(most) | np.isfinite(gain), most, 1.0)  # nothing limits: any shape serves, stretched
    # Speeds that hardly differ are made the same: a ramp between them would be too short to be put on the curve.
    most = LEAST_RAMP_RATIO ** np.floor(np.log(most) / np.log(LEAST_RAMP_RATIO))
    # Without an acceleration limit the fastest time scaling jumps; ramps of a third of each interval replace it.
    gain = np.where(np.isfinite(gain), gain, 1.5 * most**2 / lengths)
    ends = np.minimum(np.append(most, 0.0), np.insert(most, 0, 0.0))
    ends[0] = ends[-1] = 0.0
    for k, length in enumerate(lengths):
        ends[k + 1] = min(ends[k + 1], np.sqrt(ends[k] ** 2 + 2.0 * gain[k] * length))
    for k in range(len(lengths) - 1, -1, -1):
        ends[k] = min(ends[k], np.sqrt(ends[k + 1] ** 2 + 2.0 * gain[k] * lengths[k]))
    slow, fast = ends[:-1], ends[1:]
    peak = np.minimum(most, np.sqrt(gain * lengths + (slow**2 + fast**2) / 2.0))
    up, down = (peak - slow) / gain, (peak - fast) / gain
    distance_up, distance_down = (peak + slow) / 2.0 * up, (peak + fast) / 2.0 * down
    cruise = np.maximum(lengths - distance_up - distance_down, 0.0) / peak
    start = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    end = start + lengths
    zero = np.zeros_like(peak)
    coefficients = np.array(
        [
            [start, slow, gain / 2.0],
            [start + distance_up, peak, zero],
            [end - distance_down, peak, -gain / 2.0],
        ]
    ).transpose(2, 0, 1)
    times = np.column_stack([up, cruise, down])
    there = times > NEGLIGIBLE_SHARE * times.sum(axis=1, keepdims=True)
    segments_of_pieces = np.repeat(segments[:, None], 3, axis=1)[there]
    return SegmentedPolynomial(times[there], coefficients[there][:, None, :], segments_of_pieces)
