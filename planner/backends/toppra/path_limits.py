"""The limits of joints and tool as limits of the path velocity s' and the path acceleration s''.

With x = s'^2 and u = s'' the acceleration of a joint is q'(s) u + q''(s) x, its torque m(s) u + h(s) x + g(s), and its
velocity limit is a bound on x: all of them linear in (x, u). On an interval of length d, u is linear in s, from
u - bend to u + bend; so x at the share p of the interval is x + 2 u d p + 2 bend d (p^2 - p).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.backends.toppra.intervals import PROBES
from planner.constraints.rows import path_speed_shares
from planner.kernels.profile import PARALLEL
from planner.kinematics.forward import JointStates
from planner.time_scaling.refusals import refuse_what_gravity_exceeds
from planner.tolerances import ROUNDING

if TYPE_CHECKING:
    from planner.backends.toppra.intervals import Intervals
    from planner.dynamics import SegmentDynamics
    from planner.limits import SegmentLimits
    from planner.robots import Robot
    from planner.spatial import FloatArray

POINTS = np.array([0.0, 0.5, 1.0])
"""Points, as shares of an interval, where accelerations and torques are computed; they are about quadratic between."""

QUADRATIC_TO_BERNSTEIN = np.array([[1.0, -0.5, 0.0], [0.0, 2.0, 0.0], [0.0, -0.5, 1.0]])
"""Matrix from the values of a quadratic at these points to its Bernstein coefficients, which bound it."""

AT_PROBES = np.column_stack(
    [(1.0 - PROBES) * (1.0 - 2.0 * PROBES), 4.0 * PROBES * (1.0 - PROBES), PROBES * (2.0 * PROBES - 1.0)]
)
"""Weights (probes, points) of the values at these points in the quadratic through them, at the probes."""

MOST_GRAVITY = 0.9999
"""Largest share of a torque limit that gravity is taken to need; more at a point between the probes is left to the
certificate."""

MOST_SQUARE = 1e12
"""Bound on x, 1/s^2 of a curve about as long as it takes in s, where nothing limits it."""

STEEP = 4.0
"""Largest ratio of the bounds on x within an interval; above the least of them by more, x would overshoot between the
probes."""

MOST_BEND = 0.9
"""Share of the bend with which x would touch 0 within an interval, that a bend may have."""

NEARLY = 1e-9
"""Share of a limit within which what can be reached at most counts as reaching it."""

CLOSE = 0.95
"""Share of its bound above which x is close to it."""


class LinearRows(NamedTuple):
    """Limits on x at an interval's start and the mean u on it: a u + b x + c <= 0.

    Attributes:
        a: (intervals, limits).
        b: (intervals, limits).
        c: (intervals, limits), negative.
    """

    a: FloatArray
    b: FloatArray
    c: FloatArray

    def with_new(self, rows: np.ndarray, new: np.ndarray, limits: LinearRows) -> LinearRows:
        """Return the limits on rows (N,) of these intervals, but where they are new (N,) those given."""
        width = max(self.a.shape[1], limits.a.shape[1])
        merged = []
        for own, fresh, nothing in zip(self, limits, (0.0, 0.0, -1.0), strict=True):
            values = np.full((len(rows), width), nothing)
            values[~new, : own.shape[1]] = own[rows[~new]]
            values[new, : fresh.shape[1]] = fresh
            merged.append(values)
        return LinearRows(*merged)

    def that_bind(self, highest: FloatArray) -> LinearRows:
        """Return those of the limits that some (x, u) within the others can reach.

        Args:
            highest: (intervals,), the bound on x.
        """
        a, b, c = self
        binds_u = np.abs(a) > PARALLEL * np.abs(a).max(axis=1, keepdims=True)
        least = c + np.minimum(b, 0.0) * highest[:, None]
        reach = np.divide(-least, a, out=np.zeros_like(a), where=binds_u)
        upper = np.where(binds_u & (a > 0.0), reach, MOST_SQUARE).min(axis=1)[:, None]
        lower = np.where(binds_u & (a < 0.0), reach, -MOST_SQUARE).max(axis=1)[:, None]
        farthest = np.maximum(a * upper, a * lower) + np.maximum(b, 0.0) * highest[:, None]
        binding = farthest >= -c * (1.0 - NEARLY)
        width = max(int(binding.sum(axis=1).max(initial=0)), 1)
        order = np.argsort(~binding, axis=1, kind="stable")[:, :width]
        kept = np.take_along_axis(binding, order, axis=1)
        parts = zip(self, (0.0, 0.0, -1.0), strict=True)
        return LinearRows(*(np.where(kept, np.take_along_axis(part, order, axis=1), none) for part, none in parts))


@dataclass(frozen=True, eq=False)
class PathLimits:
    """The limits on intervals, |per_u u + per_x x + rest| <= 1 at each point, and x <= bound at each probe.

    Attributes:
        lengths: (intervals,).
        per_u: (points, intervals, limits).
        per_x: (points, intervals, limits).
        rest: (points, intervals, limits), between -1 and 1.
        bounds: (probes, intervals).
    """

    lengths: FloatArray
    per_u: FloatArray
    per_x: FloatArray
    rest: FloatArray
    bounds: FloatArray

    def of(self, rows: np.ndarray) -> PathLimits:
        """Take some of the intervals."""
        parts = (self.per_u, self.per_x, self.rest, self.bounds)
        return PathLimits(self.lengths[rows], *(part[:, rows] for part in parts))

    def with_new(self, rows: np.ndarray, new: np.ndarray, limits: PathLimits) -> PathLimits:
        """Return the limits on rows (N,) of these intervals, but where they are new (N,) those given."""
        merged = []
        for field in ("lengths", "per_u", "per_x", "rest", "bounds"):
            axis = 1 if field in ("per_u", "per_x", "rest", "bounds") else 0
            values = np.take(getattr(self, field), rows, axis=axis)
            values[(slice(None), new) if axis else new] = getattr(limits, field)
            merged.append(values)
        return PathLimits(*merged)

    @property
    def at_gridpoints(self) -> FloatArray:
        """The bound (intervals + 1,) on x at each gridpoint."""
        bounds: FloatArray = np.minimum(np.append(self.bounds[0], np.inf), np.insert(self.bounds[-1], 0, np.inf))
        return bounds

    def rows(self, throughout: np.ndarray) -> LinearRows:
        """Return what has to hold of x at the start of each interval and of the mean u on it.

        Where u follows a limit along an interval, it is enough that the mean keeps the limit in the middle
        (collocation), and x may follow a bound that dips below the straight line between those at the ends. Elsewhere a
        constant u has to keep the limits all over the interval (interpolation).

        Args:
            throughout: (intervals,), where the limits have to be kept by a constant u.
        """
        middle = self.per_u[1] + self.lengths[:, None] * self.per_x[1], self.per_x[1], self.rest[1]
        straight = self.bounds[:1] + (self.bounds[-1:] - self.bounds[:1]) * PROBES[1:-1, None]
        rows = self._with_speeds(*middle, np.maximum(self.bounds[1:-1], straight))
        if not throughout.any():
            return rows
        part = self.of(throughout)
        grows = 2.0 * part.lengths[:, None]
        by_point = part.per_u + POINTS[:, None, None] * grows * part.per_x, part.per_x, part.rest
        bounding = (np.moveaxis(values, 0, 2) @ QUADRATIC_TO_BERNSTEIN for values in by_point)
        a, b, c = (values.reshape(len(part.lengths), -1) for values in bounding)
        everywhere = part._with_speeds(a, b, c, part.bounds[1:-1])
        everywhere = everywhere.that_bind(part.bounds[0])
        return rows.with_new(np.arange(len(throughout)), throughout, everywhere)

    def _with_speeds(self, a: FloatArray, b: FloatArray, c: FloatArray, bounds: FloatArray) -> LinearRows:
        """Return |a u + b x + c| <= 1, each (intervals, limits), and bounds (inner probes, intervals) on x, as rows."""
        bound = bounds.T
        speeds = 2.0 * self.lengths[:, None] * PROBES[1:-1] / bound, 1.0 / bound, np.full_like(bound, -1.0)
        signed = (a, b, c - 1.0), (-a, -b, -c - 1.0), speeds
        return LinearRows(*(np.hstack(parts) for parts in zip(*signed, strict=True)))

    def dips(self, x_at_ends: FloatArray) -> FloatArray:
        """Return by how much (intervals,) x may exceed its bound between probes, relative to the bound.

        Where x is far below the bound, that is 0.

        Args:
            x_at_ends: (intervals, 2), at the start and the end of each.
        """
        x0, x1 = x_at_ends.T
        linear = x0 + (x1 - x0) * PROBES[:, None]
        close = linear > CLOSE * self.bounds
        between = np.diff(self.bounds, n=2, axis=0) / self.bounds[1:-1] / 8.0
        dips: FloatArray = np.where(close[:-2] | close[1:-1] | close[2:], between, 0.0).max(axis=0)
        return dips

    def range_of_u(self, point: int, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the least and the largest u, each (intervals,), at one of the points, where x is given."""
        a, b, c = self.per_u[point], self.per_x[point], self.rest[point]
        size = np.abs(a)
        binds = size > PARALLEL * size.max(axis=1, keepdims=True)
        middle = np.divide(-(b * x[:, None] + c), a, out=np.zeros_like(a), where=binds)
        reach = np.divide(1.0, size, out=np.full_like(a, np.inf), where=binds)
        return (middle - reach).max(axis=1), (middle + reach).min(axis=1)

    def bend(self, x_at_ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the bend (intervals,) that keeps the limits at the ends of intervals, and how well it does.

        Args:
            x_at_ends: (intervals, 2), at the start and the end of each.

        Returns:
            A bend that keeps the limits, near 0 and with room at both ends, or one that breaks them the least; and the
            largest share of a limit that is used then.
        """
        x0, x1 = x_at_ends.T
        u = (x1 - x0) / (2.0 * self.lengths)
        low0, high0 = self.range_of_u(0, x0)
        low1, high1 = self.range_of_u(-1, x1)
        inner = PROBES[1:-1, None]
        over = x0 + (x1 - x0) * inner - self.bounds[1:-1]
        for_speed = (over / (2.0 * self.lengths * (inner - inner**2))).max(axis=0)
        least, most = np.maximum(u - high0, low1 - u), np.minimum(u - low0, high1 - u)
        middle, nearest = (least + most) / 2.0, np.clip(0.0, least, most)
        bend = np.where(
            least > most,
            middle,
            np.clip(middle, np.minimum(2.0 * nearest, 0.0), np.maximum(2.0 * nearest, 0.0)),
        )
        # No more than the bounds on x ask for, as it costs time; and so that x stays positive in between.
        bend = np.minimum(
            np.maximum(bend, for_speed), MOST_BEND * (np.sqrt(x0) + np.sqrt(x1)) ** 2 / (2.0 * self.lengths)
        )
        speeds = (over + self.bounds[1:-1] - 2.0 * bend * self.lengths * (inner - inner**2)) / self.bounds[1:-1]
        return bend, np.maximum(self._used(x_at_ends, bend), speeds.max(axis=0)).max(axis=0)

    def unused(self, x_at_ends: FloatArray) -> FloatArray:
        """Return the share (intervals,) of the tightest limit that a constant u leaves unused, on average.

        Args:
            x_at_ends: (intervals, 2), at the start and the end of each.
        """
        x0, x1 = x_at_ends.T
        speeds = (x0 + (x1 - x0) * PROBES[:, None]) / self.bounds
        used = np.maximum(self._used(x_at_ends, np.zeros_like(self.lengths)), speeds)
        unused: FloatArray = np.maximum(1.0 - used, 0.0).mean(axis=0)
        return unused

    def _used(self, x_at_ends: FloatArray, bend: FloatArray) -> FloatArray:
        """Return the largest share (probes, intervals) that the motion takes of what gravity leaves of a limit.

        Args:
            x_at_ends: (intervals, 2), at the start and the end of each.
            bend: (intervals,).
        """
        p, d, (x0, x1) = PROBES[:, None], self.lengths, x_at_ends.T
        u_at = (x1 - x0) / (2.0 * d) + bend * (2.0 * p - 1.0)
        x_at = x0 + (x1 - x0) * p - 2.0 * bend * d * (p - p**2)
        per_u, per_x = (_at_probes(part) for part in (self.per_u, self.per_x))
        moved = per_u * u_at[..., None] + per_x * x_at[..., None]
        if self.rest.any():
            moved /= 1.0 - np.sign(moved) * _at_probes(self.rest)
        used: FloatArray = np.abs(moved).max(axis=2)
        return used


def _at_probes(values: FloatArray) -> FloatArray:
    """Interpolate values (points, intervals, limits) at the probes: (probes, intervals, limits)."""
    found: FloatArray = (AT_PROBES @ values.reshape(len(POINTS), -1)).reshape(len(PROBES), *values.shape[1:])
    return found


def path_limits(
    dynamics: SegmentDynamics, limits: SegmentLimits, intervals: Intervals, factors: FloatArray
) -> PathLimits:
    """Compute the limits on x and u.

    Args:
        dynamics: The robot, with its payloads.
        limits: The limits of the segments.
        intervals: The intervals of the curves.
        factors: (segments,), on all times, beyond what the limits ask.

    Raises:
        LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
    """
    squares = factors[intervals.segments] ** 2
    q, first, second = intervals.at(POINTS)
    middle, half = (values[intervals.segments] for values in limits.acceleration.centred)
    parts: list[tuple[FloatArray, ...]] = [(first / half, second / half, np.broadcast_to(-middle / half, q.shape))]
    parts += _sampled(dynamics, limits, intervals, (q, first, second))
    per_u, per_x, rest = (np.concatenate(values, axis=2) for values in zip(*parts, strict=True))
    slower = squares[:, None]
    return PathLimits(
        intervals.lengths,
        per_u * slower,
        per_x * slower,
        rest,
        _bounds(dynamics, limits, intervals) / squares,
    )


def _sampled(
    dynamics: SegmentDynamics, limits: SegmentLimits, intervals: Intervals, states: tuple[FloatArray, ...]
) -> list[tuple[FloatArray, ...]]:
    """Return the rows of each sampled constraint, as shares of its limits: per u, per x and without motion.

    Each is (points, intervals, rows).
    """
    # The same for all intervals, also where only others are limited: their rows are put beside each other.
    limited = [own for own in limits.constraints if own[0].has_rows and any(map(own[0].is_known, dynamics.robots))]
    if not limited:
        return []
    q, first, second = states
    segments = np.broadcast_to(intervals.segments, q.shape[:2])
    # Where a run goes on, the end of an interval is the start of the next.
    own = np.ones(q.shape[:2], dtype=bool)
    own[-1, :-1] = intervals.rests[1:-1] | ~np.all([_equal(rows[-1, :-1], rows[0, 1:]) for rows in states], axis=0)

    def of(robot: Robot, *path: FloatArray) -> tuple[FloatArray, ...]:
        at = JointStates(robot, *path)
        return tuple(part for constraint, _ in limited for part in constraint.rows(at))

    found = [
        _at_all_points(rows, own) for rows in dynamics.by_robot(of, segments[own], q[own], first[own], second[own])
    ]
    parts: list[tuple[FloatArray, ...]] = []
    for k, (constraint, bounds) in enumerate(limited):
        by_u, by_x, rest = found[3 * k : 3 * k + 3]
        middle, half = (values[segments] for values in bounds.centred)
        if constraint.counts_at_rest:
            refuse_what_gravity_exceeds(dynamics.robots[0], segments, rest, middle, half)
        middle, half = (np.repeat(values, by_u.shape[2] // values.shape[2], axis=2) for values in (middle, half))
        parts.append((by_u / half, by_x / half, np.clip((rest - middle) / half, -MOST_GRAVITY, MOST_GRAVITY)))
    return parts


def _equal(ends: FloatArray, starts: FloatArray) -> np.ndarray:
    """Return whether (rows,) a curve goes on from the ends (rows, joints) of intervals to the starts of the next."""
    equal: np.ndarray = (np.abs(ends - starts) <= ROUNDING * np.abs(starts).max(initial=0.0)).all(axis=1)
    return equal


def _at_all_points(values: FloatArray, own: np.ndarray) -> FloatArray:
    """Put values (N, joints) to points (points, intervals, joints).

    Args:
        values: The values at the points that are not the start of the next interval.
        own: (points, intervals), which these are.
    """
    rows = np.empty((*own.shape, values.shape[1]))
    rows[own] = values
    shared = np.flatnonzero(~own[-1])
    rows[-1, shared] = rows[0, shared + 1]
    return rows


def _bounds(dynamics: SegmentDynamics, limits: SegmentLimits, intervals: Intervals) -> FloatArray:
    """Bounds on x (probes, intervals) by the speed limits of joints and tool."""
    q, first, second = intervals.at(PROBES)
    segments = intervals.segments
    used = limits.velocity.used(segments, first).max(axis=2)
    constraints = [own for own in limits.constraints if own[0].follows_path_speed]
    if constraints:
        at = np.tile(segments, len(PROBES))

        def shares(robot: Robot, *states: FloatArray) -> tuple[FloatArray]:
            return (path_speed_shares(constraints, JointStates(robot, *states[:3]), states[3].astype(int)),)

        states = (values.reshape(-1, q.shape[2]) for values in (q, first, second))
        (by_constraints,) = dynamics.by_robot(shares, at, *states, at.astype(np.float64))
        used = np.maximum(used, by_constraints.reshape(used.shape))
    bounds = 1.0 / np.maximum(used, MOST_SQUARE**-0.5) ** 2
    limited: FloatArray = np.minimum(bounds, STEEP * bounds.min(axis=0))
    return limited
