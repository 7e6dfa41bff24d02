"""The back end that accelerates, cruises and brakes: trapezoids of the path velocity."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from planner.backends.base import enforced
from planner.backends.shared.assembly import assemble
from planner.backends.shared.rest_to_rest import time_straight_motions, unit_scalings
from planner.backends.shared.straight_lines import time_lines
from planner.guarantees import ALL_BUT_JERK, Capabilities, Guarantee
from planner.paths import JointPath, SegmentGroup, StraightMotions
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
from planner.tolerances import DURATION_TOLERANCE, NEGLIGIBLE_SHARE, ROUNDING
from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial
from planner.trajectories.trajectory import Trajectory

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
        _on_intervals(lengths, np.minimum(plain, np.sqrt(share * curved)), (1.0 - share) * straight, segments)
        for share in CURVATURE_SHARES
    ]
    return min(scalings, key=lambda scaling: float(scaling.lengths.sum()))


def _on_intervals(lengths: FloatArray, most: FloatArray, gain: FloatArray, segments: np.ndarray) -> SegmentedPolynomial:
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


@dataclass(frozen=True)
class Trapezoidal:
    """The fastest time scaling from rest to rest without a jerk limit: accelerate, cruise, brake.

    See document 004, Section 7.

    Without times, each segment is as fast as the limits allow: triangular if it is too short to reach full speed. A
    longer duration stretches that profile evenly. Times t1 and t3 are the document's t1 and T - t2. With them the peak
    of s' is 1 / (T - t1 / 2 - t3 / 2). That is the document's profile for t1 = t3 and its correction (E33) otherwise.

    Attributes:
        acceleration_time: Time t1 of acceleration on every segment, s; None: like `deceleration_time`.
        deceleration_time: Time t3 of braking on every segment, s; None: like `acceleration_time`.
    """

    kind: ClassVar[str] = "trapezoidal"
    summary: ClassVar[str] = (
        "Accelerate, cruise, brake: the fastest time scaling from rest to rest without a jerk limit, C1."
    )
    guarantees: ClassVar[Mapping[str, Guarantee]] = ALL_BUT_JERK
    capabilities: ClassVar[Capabilities] = Capabilities()

    acceleration_time: float | None = field(
        default=None,
        metadata={"description": "Time of acceleration on every segment, s; omitted: as the limits ask.", "gt": 0.0},
    )
    deceleration_time: float | None = field(
        default=None,
        metadata={"description": "Time of braking on every segment, s; omitted: the same as accelerating.", "gt": 0.0},
    )

    def __post_init__(self) -> None:
        """Let given ramps stay as they are in more time."""
        if self._times() is not None:
            object.__setattr__(self, "capabilities", Capabilities(is_shaped_by_duration=True))

    def parametrize(self, path: JointPath) -> Trajectory:
        """Put the trapezoid on each segment, at the requested durations or the shortest."""
        times = self._times()
        kept = enforced(self)
        path = path.keeping(kept)
        if times is None:
            lines = time_lines(path, path.straight, fastest_trapezoids, lambda group: time_group(path, group, kept))
            return assemble(path, [*lines, *(time_group(path, group, kept) for group in path.groups)])
        t1, t3 = times
        groups = [
            time_group_with_ramps(path, group, lambda T: _scaling(t1, t3, T), t1 + t3, kept) for group in path.groups
        ]
        return assemble(path, [_with_times(path.straight, t1, t3), *groups])

    def _times(self) -> tuple[float, float] | None:
        """Return the times of acceleration and of braking, s; None: the limits set them."""
        t1, t3 = self.acceleration_time, self.deceleration_time
        if t1 is None:
            return None if t3 is None else (t3, t3)
        return t1, t1 if t3 is None else t3


def fastest_trapezoids(motions: StraightMotions) -> SegmentedPolynomial:
    """Run straight lines at path velocity V and path acceleration A: T = 1/V + V/A, or 2/sqrt(A) without a cruise.

    Each joint binds V by its velocity and A by its acceleration; the slowest of each counts. Where joints brake with
    another acceleration than they gain speed with, 1/A is the mean of both reciprocals.
    """
    inverse_v = np.abs(motions.travels) / motions.limits.velocity.upper
    gaining, braking = reciprocal_accelerations(motions)
    slowness = inverse_v.max(axis=1)
    by_ramp = gaining.max(axis=1), braking.max(axis=1)
    sluggishness = (by_ramp[0] + by_ramp[1]) / 2.0
    cruises = slowness**2 > sluggishness * (1.0 + ROUNDING)
    with np.errstate(divide="ignore", invalid="ignore"):
        shortest = np.where(cruises, slowness + sluggishness / slowness, 2.0 * np.sqrt(sluggishness))
        ramps = [np.where(cruises, (own / slowness) / shortest, own / (2.0 * sluggishness)) for own in by_ramp]
    # Without an acceleration limit the fastest time scaling is a jump; the document's thirds stand in for it.
    jump = sluggishness == 0.0
    t1, t3 = (np.where(jump, 1.0 / 3.0, ramp) for ramp in ramps)
    shortest = np.where(jump, slowness * 1.5, shortest)
    velocity_binds = (cruises | jump)[:, None] & (inverse_v == slowness[:, None])
    bounds = {
        "velocity": np.where(velocity_binds, shortest[:, None], 0.0),
        "acceleration": np.where(
            (gaining == by_ramp[0][:, None]) | (braking == by_ramp[1][:, None]), shortest[:, None], 0.0
        ),
    }
    scalings = _trapezoids(t1, t3)
    return time_straight_motions(motions, bounds, lambda _durations: scalings)


def reciprocal_accelerations(motions: StraightMotions) -> tuple[FloatArray, FloatArray]:
    """Return 1/A, each (rows, joints), s^2, that each joint would need by itself, gaining speed and braking."""
    travels, (braking, gaining) = np.abs(motions.travels), motions.limits.acceleration
    return travels / gaining, travels / -braking


def _with_times(motions: StraightMotions, t1: float, t3: float) -> SegmentedPolynomial:
    """Run straight lines with given ramps: cruise at 1 / (T - t1/2 - t3/2), reached in t1 and left in t3."""
    travels, ramps = np.abs(motions.travels), (t1 + t3) / 2.0
    gaining, braking = reciprocal_accelerations(motions)
    bounds = {
        "velocity": travels / motions.limits.velocity.upper + ramps,
        "acceleration": np.maximum(gaining / t1, braking / t3) + ramps,
        RAMPS: np.full_like(travels, t1 + t3),
    }
    return time_straight_motions(motions, bounds, lambda durations: _trapezoids(t1 / durations, t3 / durations))


def _scaling(t1: float, t3: float, duration: float) -> PiecewisePolynomial:
    """Return the time scaling s(t) from 0 to 1 in `duration`, which the ramps t1 and t3 fit into."""
    return _trapezoids(np.array([t1 / duration]), np.array([t3 / duration])).stretched(duration)


def _trapezoids(t1: FloatArray, t3: FloatArray) -> SegmentedPolynomial:
    """Return time scalings on unit time that accelerate for t1 (segments,), cruise, and brake for t3."""
    peak = 1.0 / (1.0 - t1 / 2.0 - t3 / 2.0)
    cruise = 1.0 - t1 - t3
    cruise = np.where(cruise > ROUNDING, cruise, 0.0)
    coefficients = np.zeros((len(t1), 3, 3))
    coefficients[:, 0, 2] = peak / t1 / 2.0
    coefficients[:, 1, 0] = peak * t1 / 2.0
    coefficients[:, 1:, 1] = peak[:, None]
    coefficients[:, 2, 0] = 1.0 - peak * t3 / 2.0
    coefficients[:, 2, 2] = -peak / t3 / 2.0
    return unit_scalings(np.column_stack([t1, cruise, t3]), coefficients)
