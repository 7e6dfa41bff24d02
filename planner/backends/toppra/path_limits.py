"""The limits of joints and tool as limits of the path velocity s' and the path acceleration s''.

With x = s'^2 and u = s'' the acceleration of a joint is q'(s) u + q''(s) x. Its torque is m(s) u + h(s) x + g(s), and
its velocity limit is a bound on x. All of them are linear in (x, u). On an interval of length d, u is linear in s, from
u - bend to u + bend. So x at the share p of the interval is x + 2 u d p + 2 bend d (p^2 - p).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.backends.toppra.intervals import PROBES, Intervals
from planner.constraints import OF_FRICTION
from planner.constraints.rows import path_speed_shares
from planner.dynamics import SegmentDynamics
from planner.kernels.profile import LimitRows, PathLimits, limits_on_intervals
from planner.kinematics.forward import JointStates
from planner.limits import SegmentLimits
from planner.robots import Robot
from planner.robots.description import LEAST_FRICTION
from planner.spatial import FloatArray
from planner.time_scaling.refusals import refuse_what_gravity_exceeds

MOST_GRAVITY = 0.9999
"""Largest share of a torque limit that gravity is taken to need; more at a point between the probes is left to the
certificate."""

MOST_SQUARE = 1e12
"""Bound on x, 1/s^2 of a curve about as long as it takes in s, where nothing limits it."""

MOST_BOUND_RATIO = 4.0
"""Largest ratio of the bounds on x within an interval; above the least of them by more, x would overshoot between the
probes."""

ROOT_OF_SHARE = 0.125
"""Constant of the line p + 1/8, which is at most 1/8 from the square root of p for shares p from 0 to 1."""


OF_REST_AND_BOUNDS = np.array([MOST_GRAVITY, MOST_SQUARE**-0.5, MOST_BOUND_RATIO])
"""These numbers as the kernel reads them."""


def path_limits(
    dynamics: SegmentDynamics, limits: SegmentLimits, intervals: Intervals, factors: FloatArray
) -> PathLimits:
    """Compute the limits on x and u.

    `factors` (segments,) are on all times, in addition to the limits.

    Raises:
        LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
    """
    at_probes = intervals.at(PROBES)
    _, first, second = at_probes
    return limits_on_intervals(
        intervals.lengths,
        intervals.segments,
        (first, second),
        (*limits.acceleration.centred, *limits.velocity),
        _sampled(dynamics, limits, intervals, at_probes),
        _used_by_path_speed(dynamics, limits, intervals, at_probes),
        factors[intervals.segments] ** 2,
        OF_REST_AND_BOUNDS,
    )


def _sampled(
    dynamics: SegmentDynamics, limits: SegmentLimits, intervals: Intervals, at_probes: Sequence[FloatArray]
) -> LimitRows:
    """Return the rows of all sampled constraints."""
    # The same for all intervals, also where only others are limited: their rows are put beside each other.
    limited = [own for own in limits.constraints if own[0].has_rows and any(map(own[0].is_known, dynamics.robots))]
    # Accelerations and torques are about quadratic along an interval: three points tell them.
    states = [values[::2] for values in at_probes]
    points, count, joints = states[0].shape
    if not limited:
        return LimitRows(*np.empty((3, points, count, 0)), *np.empty((2, len(limits.velocity.upper), 0)))
    segments = np.tile(intervals.segments, points)

    def of(robot: Robot, *path: FloatArray) -> tuple[FloatArray, ...]:
        at = JointStates(robot, *path)
        return tuple(part for constraint, _ in limited for part in constraint.rows(at))

    found = dynamics.by_robot(of, segments, *(values.reshape(-1, joints) for values in states))
    friction, first = dynamics.robots[0].friction, states[1]
    parts: list[LimitRows] = []
    for k, (constraint, bounds) in enumerate(limited):
        by_u, by_x, rest = (rows.reshape(points, count, -1) for rows in found[3 * k : 3 * k + 3])
        sides = [np.repeat(side, by_u.shape[2] // side.shape[1], axis=1) for side in bounds.centred]
        middle, half = (np.broadcast_to(side[intervals.segments], by_u.shape) for side in sides)
        resists = friction is not None and constraint in OF_FRICTION
        if friction is not None and resists:
            constant, linear = friction.along(first, by_u.shape[2])
            rest = rest + constant
        if constraint.counts_at_rest:
            refuse_what_gravity_exceeds(dynamics, segments.reshape(points, count), rest, middle, half)
        if resists:
            fastest = 1.0 / np.maximum(limits.velocity.used(intervals.segments, first).max(axis=2), MOST_SQUARE**-0.5)
            # Up to the velocity at which viscous friction takes twice what is left of the limit.
            room = 2.0 * (half - np.abs(rest - middle)) / np.maximum(np.abs(linear), LEAST_FRICTION)
            speed = np.minimum(fastest[..., None], room)
            by_x, rest = by_x + linear / speed, rest + ROOT_OF_SHARE * linear * speed
        parts.append(LimitRows(by_u, by_x, rest, *sides))
    return (
        parts[0]
        if len(parts) == 1
        else LimitRows(*(np.concatenate(values, axis=-1) for values in zip(*parts, strict=True)))
    )


def _used_by_path_speed(
    dynamics: SegmentDynamics, limits: SegmentLimits, intervals: Intervals, at_probes: Sequence[FloatArray]
) -> FloatArray | None:
    """Return the shares (probes, intervals) that s' = 1 uses of limits of the path velocity; None: it has none."""
    constraints = [own for own in limits.constraints if own[0].follows_path_speed]
    if not constraints:
        return None
    at, shape = np.tile(intervals.segments, len(PROBES)), at_probes[0].shape

    def shares(robot: Robot, *states: FloatArray) -> tuple[FloatArray]:
        return (path_speed_shares(constraints, JointStates(robot, *states[:3]), states[3].astype(int)),)

    states = (values.reshape(-1, shape[2]) for values in at_probes)
    (used,) = dynamics.by_robot(shares, at, *states, at.astype(np.float64))
    return used.reshape(shape[:2])
