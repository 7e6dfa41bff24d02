"""Jerk-limited motions: S-curves in closed form, also along straight joint motions, and motions through waypoints."""

from __future__ import annotations

import numpy as np

from planner.backends.shared.rest_to_rest import time_straight_motions, unit_scalings
from planner.backends.shared.straight_lines import smoothed
from planner.guarantees import JOINT_DERIVATIVES
from planner.paths import JointPath, SegmentGroup, StraightMotions
from planner.spatial import FloatArray
from planner.time_scaling.fastest import time_group
from planner.tolerances import BISECTIONS, LIMIT_TOLERANCE, ROUNDING
from planner.trajectories.polynomials import SegmentedPolynomial


def s_curves(
    V: FloatArray, A: FloatArray, J: FloatArray, braking: FloatArray | None = None
) -> tuple[FloatArray, SegmentedPolynomial, list[np.ndarray]]:
    """Compute the fastest time scalings from 0 to 1 and their binding limits.

    There are four phases of jerk, each t_j long, two of constant acceleration (t_a) and a cruise (t_v). See Biagiotti
    and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), ch. 3.4. Ruckig computes the same, but
    not for limits of any size. The times alone determine the time scaling: v = 1 / (2 t_j + t_a + t_v), a = v / (t_j +
    t_a) and j = a / t_j.

    Args:
        V: Limits of velocity (rows,), 1/s; infinite: none.
        A: Limits of acceleration (rows,), 1/s^2; infinite: none.
        braking: Limits of deceleration (rows,), 1/s^2; None: the limits of acceleration.
        J: Limits of jerk (rows,), 1/s^3; infinite: the acceleration jumps.

    Returns:
        Durations (rows,), s, infinite without any limit; the time scalings; the rows (rows,) in which each limit
        binds.
    """
    if braking is not None:
        return _lopsided(V, A, J, braking)
    with np.errstate(divide="ignore", invalid="ignore"):
        ramp = np.where(np.isfinite(A), A / J, np.inf)
        t_j = np.where(np.isfinite(J), np.minimum.reduce([np.cbrt(0.5 / J), np.sqrt(V / J), ramp]), 0.0)
        braked = (np.sqrt(t_j**2 + 4.0 / A) - 3.0 * t_j) / 2.0
        steady = np.where(np.isfinite(A), np.minimum(V / A - t_j, braked), 0.0)
        t_a = np.where((t_j == ramp) | np.isinf(J), np.maximum(steady, 0.0), 0.0)
        v = np.where(np.isfinite(J), J * t_j, A) * np.where(np.isfinite(J), t_j + t_a, t_a)
        t_v = np.maximum(1.0 / v - 2.0 * t_j - t_a, 0.0)
    limited = np.isfinite(t_v) & (t_j + t_a > 0.0)
    t_j, t_a, t_v = np.where(limited, t_j, 1.0), np.where(limited, t_a, 0.0), np.where(limited, t_v, 0.0)
    least = ROUNDING * (4.0 * t_j + 2.0 * t_a + t_v)
    t_a, t_v = np.where(t_a > least, t_a, 0.0), np.where(t_v > least, t_v, 0.0)
    duration, v, (a, _), scalings = _of_times(t_v, (t_j, t_a), (t_j, t_a))
    at_limit = 1.0 - LIMIT_TOLERANCE
    reached = v / duration >= V * at_limit, a / duration**2 >= A * at_limit, t_j > 0.0
    return np.where(limited, duration, np.inf), scalings, [limited & bind for bind in reached]


def _lopsided(
    V: FloatArray, A: FloatArray, J: FloatArray, braking: FloatArray
) -> tuple[FloatArray, SegmentedPolynomial, list[np.ndarray]]:
    """Compute the fastest time scalings if braking has limits of its own, by bisection for the peak velocity.

    The time to reach a velocity v is v / A + A / J, or 2 sqrt(v / J) if the acceleration does not reach its limit A.
    The mean velocity meanwhile is v / 2.
    """

    def ramp(v: FloatArray, limit: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the times of each phase of jerk, and of constant acceleration."""
        t_j = np.where(v * J >= limit**2, limit / J, np.sqrt(v / J))
        return t_j, np.where(v * J >= limit**2, v / limit - t_j, 0.0)

    def way(v: FloatArray) -> FloatArray:
        """Return the distance from rest to velocity v and back to rest."""
        return sum((v * (t_j + t_a / 2.0) for t_j, t_a in (ramp(v, A), ramp(v, braking))), np.zeros_like(v))

    with np.errstate(divide="ignore", invalid="ignore"):
        limited = np.isfinite(J) | (np.isfinite(A) & np.isfinite(braking))
        J, A, braking = (np.where(limited, limit, 1.0) for limit in (J, A, braking))
        # Ramps of constant jerk, and of constant acceleration, each take less time than both.
        steady = np.sqrt(2.0 / (1.0 / A + 1.0 / braking))
        low, high = np.zeros_like(V), np.minimum.reduce([V, np.cbrt(J / 4.0), steady])
        low = np.where(way(high) <= 1.0, high, low)
        for _ in range(BISECTIONS):
            middle = (low + high) / 2.0
            within = way(middle) <= 1.0
            low, high = np.where(within, middle, low), np.where(within, high, middle)
        rise, fall = ramp(low, A), ramp(low, braking)
        t_v = np.maximum(1.0 - way(low), 0.0) / low
    least = ROUNDING * (t_v + 2.0 * (rise[0] + fall[0]) + rise[1] + fall[1])
    t_v = np.where(t_v > least, t_v, 0.0)
    rise, fall = ((t_j, np.where(t_a > least, t_a, 0.0)) for t_j, t_a in (rise, fall))
    duration, v, gains, scalings = _of_times(t_v, rise, fall)
    at_limit = 1.0 - LIMIT_TOLERANCE
    steep = (gains[0] / duration**2 >= A * at_limit) | (gains[1] / duration**2 >= braking * at_limit)
    reached = v / duration >= V * at_limit, steep, rise[0] + fall[0] > 0.0
    return np.where(limited, duration, np.inf), scalings, [limited & bind for bind in reached]


def _of_times(
    t_v: FloatArray, rise: tuple[FloatArray, FloatArray], fall: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray, tuple[FloatArray, FloatArray], SegmentedPolynomial]:
    """Return the durations, velocities, accelerations, decelerations and pieces of time scalings.

    Everything except the durations is on unit time.

    Args:
        t_v: Times (rows,), s, of the cruise.
        rise: Times (rows,), s, of each phase of jerk and of constant acceleration on the way to it.
        fall: The same on the way from it to rest.
    """
    (j_1, a_1), (j_2, a_2) = rise, fall
    phases = np.stack([j_1, a_1, j_1, t_v, j_2, a_2, j_2], axis=1)
    duration = phases.sum(axis=1)
    phases /= duration[:, None]
    v = 1.0 / (phases[:, 2:5].sum(axis=1) + (phases[:, 1] + phases[:, 5]) / 2.0)
    first, last = phases[:, 0], phases[:, 6]
    a, d = v / (first + phases[:, 1]), v / (last + phases[:, 5])
    with np.errstate(divide="ignore", invalid="ignore"):
        j, k = np.where(j_1 > 0.0, a / first, 0.0), np.where(j_2 > 0.0, d / last, 0.0)
    zero = np.zeros_like(v)
    jerks = np.stack([j, zero, -j, zero, -k, zero, k], axis=1)
    accelerations = np.stack([zero, a, a, zero, zero, -d, -d], axis=1)
    velocities = np.stack(
        [zero, a * first / 2.0, v - a * first / 2.0, v, v, v - d * last / 2.0, d * last / 2.0], axis=1
    )
    ways = phases * (velocities + phases * (accelerations / 2.0 + phases * jerks / 6.0))
    positions = np.cumsum(ways, axis=1) - ways
    scalings = unit_scalings(phases, np.stack([positions, velocities, accelerations / 2.0, jerks / 6.0], axis=-1))
    return duration, v, (a, d), scalings


def with_ramps(
    travels: FloatArray, velocity: FloatArray, acceleration: FloatArray, jerk: FloatArray, requested: FloatArray
) -> FloatArray:
    """Return the jerk limits, with one added where neither acceleration nor jerk is limited.

    Without it the fastest motion would be a jump. The added limit makes four equal phases of jerk: T = 2 d / v and
    j = 32 d / T^3. A joint with only a velocity limit then reaches it in the middle of its travel. A joint without any
    limit takes as long as the others, or the requested duration.

    Args:
        travels: Travels (rows, joints), rad or m, of any sign.
        velocity: Velocity limits (rows, joints); infinite: none.
        acceleration: Acceleration limits (rows, joints); infinite: none.
        jerk: Jerk limits (rows, joints); infinite: none.
        requested: Requested durations (rows,), s; NaN: the shortest.
    """
    d = np.abs(travels)
    bare = np.isinf(acceleration) & np.isinf(jerk)
    if not bare.any():
        return jerk
    times = np.where(bare, 2.0 * d / velocity, least_times(travels, velocity, acceleration, jerk))
    longest = np.fmax(times.max(axis=1, keepdims=True), requested[:, None])
    times = np.where(times > 0.0, times, longest)
    d = np.where(d > 0.0, d, d.max(axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        ramps = np.where((times > 0.0) & (d > 0.0), 32.0 * d / times**3, np.inf)
    return np.where(bare, ramps, jerk)


def least_times(travels: FloatArray, velocity: FloatArray, acceleration: FloatArray, jerk: FloatArray) -> FloatArray:
    """Return the times (rows, joints), s, from rest to rest that the tightest limit (rows, joints) alone takes.

    They are most of the shortest times. Travels (rows, joints), rad or m, may have any sign.
    """
    d = np.abs(travels)
    bounds = (d / velocity, 2.0 * np.sqrt(d / acceleration), np.cbrt(32.0 * d / jerk))
    longest: FloatArray = np.maximum.reduce(bounds)
    return longest


ROUNDED_UP = 1.0 + 1e-10
"""Factor on durations, for what rounding may add to an acceleration where phases of jerk are very short."""


def along_lines(motions: StraightMotions) -> SegmentedPolynomial:
    """Time straight lines from rest to rest: the path position moves like a joint with the tightest limits.

    A longer duration stretches the time scaling evenly.
    """
    travels, limits = np.abs(motions.travels), motions.limits
    with np.errstate(divide="ignore"):
        by_joint = [limits.bounds(quantity).upper / travels for quantity in JOINT_DERIVATIVES[1:]]
        braking = None if limits.acceleration.is_symmetric else (-limits.acceleration.lower / travels).min(axis=1)
    velocity, acceleration, jerk = (limit.min(axis=1, keepdims=True) for limit in by_joint)
    jerk = with_ramps(np.ones_like(jerk), velocity, acceleration, jerk, motions.durations)
    line = velocity[:, 0], acceleration[:, 0], jerk[:, 0]
    shortest, scalings, binds = s_curves(*line, braking)
    bounds = {
        quantity: np.where(bind[:, None] & (own <= limit[:, None]), shortest[:, None] * ROUNDED_UP, 0.0)
        for quantity, own, limit, bind in zip(JOINT_DERIVATIVES[1:], by_joint, line, binds, strict=True)
    }
    return time_straight_motions(motions, bounds, lambda _durations: scalings)


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
    motions, duration = path.straight_motions(group.segments), float(passing.lengths.sum())
    velocity, acceleration, jerk = (np.abs(motions.limits.bounds(own)).max(axis=0) for own in JOINT_DERIVATIVES[1:])
    if least_times(motions.travels, velocity, acceleration, jerk).max(axis=1).sum() >= duration:
        return passing
    stopping = along_lines(motions)
    return stopping if stopping.lengths.sum() < duration else passing
