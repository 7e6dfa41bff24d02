"""Curves cut into intervals, and what the limits ask of a law on each: linear in x = s'^2 and u = s''."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.backends.shared.refusals import refuse_what_gravity_exceeds
from planner.dynamics import inverse_dynamics
from planner.kinematics.forward import tool_speeds
from planner.limits import counted_velocity
from planner.polynomials import bernstein_matrix, differentiate, horner, shifted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.limits import SegmentLimits
    from planner.paths import Run
    from planner.polynomials import PiecewisePolynomial
    from planner.robots import Robot
    from planner.spatial import FloatArray

TURN, FEWEST, MOST = 0.12, 32, 40
"""A piece of a curve is cut wherever its direction turns by this (rad, joints measured by their velocity limits); the
fewest intervals between two waypoints, and the most on one piece."""

PROBES = np.linspace(0.0, 1.0, 5)
"""Where on an interval speed is limited."""

TORQUE_PROBES = np.array([0.0, 0.5, 1.0])
"""Where on an interval torques are computed; between them they are about quadratic."""

QUADRATIC_TO_BERNSTEIN = np.array([[1.0, -0.5, 0.0], [0.0, 2.0, 0.0], [0.0, -0.5, 1.0]])
"""Values there, of a quadratic, to its Bernstein coefficients."""

MOST_GRAVITY = 0.9999
"""Share of a torque limit that gravity is taken to need at most between the probes; at them it is checked."""

MOST_SQUARE = 1e12
"""Bound on x, 1/s^2 of a curve about as long as it takes in s, where nothing limits it."""

STEEP = 4.0
"""Ratio of the bounds on x within an interval up to which a straight line is put below them; else the least counts."""


@dataclass(frozen=True, eq=False)
class Intervals:
    """Curves, one after the other, cut into intervals.

    Attributes:
        lengths: (intervals,).
        coefficients: (intervals, joints, order), ascending powers of the local coordinate.
        segments: (intervals,), index of the segment of each.
        runs: (intervals,), index of the curve of each, ascending.
    """

    lengths: FloatArray
    coefficients: FloatArray
    segments: np.ndarray
    runs: np.ndarray

    @property
    def rests(self) -> np.ndarray:
        """(intervals + 1,): the breakpoints where the robot rests, between one curve and the next."""
        return np.concatenate([[True], np.diff(self.runs) > 0, [True]])

    def split(self, parts: np.ndarray) -> Intervals:
        """Each interval in a number (intervals,) of equal parts."""
        rows = np.repeat(np.arange(len(parts)), parts)
        lengths = (self.lengths / parts)[rows]
        offsets = (np.arange(len(rows)) - (np.cumsum(parts) - parts)[rows]) * lengths
        coefficients = shifted(self.coefficients[rows], offsets[:, None])
        return Intervals(lengths, coefficients, self.segments[rows], self.runs[rows])

    def at(self, places: FloatArray) -> list[FloatArray]:
        """Positions and their first two derivatives, each (places, intervals, joints), at shares of every interval."""
        s = (places[:, None] * self.lengths)[..., None]
        return [horner(differentiate(self.coefficients, k), s) for k in range(3)]


def cut(
    runs: Sequence[Run], curves: Sequence[PiecewisePolynomial], velocity: FloatArray, fewest: int = FEWEST
) -> Intervals:
    """Cut curves of runs into intervals, more where they turn.

    Args:
        runs: One a curve.
        curves: Each with the pieces of its run's curve.
        velocity: (segments, joints), limits.
        fewest: Intervals between two waypoints.
    """
    order = max(curve.coefficients.shape[2] for curve in curves)
    padded = [np.pad(c.coefficients, ((0, 0), (0, 0), (0, order - c.coefficients.shape[2]))) for c in curves]
    whole = Intervals(
        lengths=np.concatenate([curve.lengths for curve in curves]),
        coefficients=np.concatenate(padded),
        segments=np.concatenate([run.curve.segments for run in runs]),
        runs=np.repeat(np.arange(len(runs)), [len(run.curve.segments) for run in runs]),
    )
    limit = velocity[whole.segments]
    _, first, second = (rows / counted_velocity(limit) for rows in whole.at(PROBES))
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = np.linalg.norm(second, axis=2) / np.linalg.norm(first, axis=2)
    turns = np.nan_to_num(rates, posinf=np.inf).mean(axis=0) * whole.lengths
    spans = np.bincount(whole.segments, whole.lengths)[whole.segments]
    parts = np.ceil(fewest * np.maximum(turns / (TURN * FEWEST), whole.lengths / spans))
    return whole.split(np.minimum(parts, MOST).astype(int))


class Rows(NamedTuple):
    """Limits on a law, |a u + b x + c| <= 1, with x at the start of each interval.

    Attributes:
        a: (intervals, places, limits).
        b: The same shape.
        c: The same shape.
    """

    a: FloatArray
    b: FloatArray
    c: FloatArray


@dataclass(frozen=True, eq=False)
class LawLimits:
    """What limits a law on the intervals.

    Attributes:
        blocks: Of accelerations, and of torques where they are limited.
        most: (intervals + 1,), of x at the breakpoints.
    """

    blocks: tuple[Rows, ...]
    most: FloatArray

    @cached_property
    def rows(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """a, b and c of all blocks, each (intervals, limits)."""
        count = len(self.most) - 1
        a, b, c = (np.hstack([part.reshape(count, -1) for part in parts]) for parts in zip(*self.blocks, strict=True))
        return a, b, c

    def looseness(self, x: FloatArray, u: FloatArray) -> FloatArray:
        """(intervals,): how much of the tightest limit is unused, on average; 0: throughout, some limit is reached."""
        speed = x / self.most
        used = [np.array([speed[:-1], (speed[:-1] + speed[1:]) / 2.0, speed[1:]])]
        for a, b, c in self.blocks:
            ends_and_middle = [0, a.shape[1] // 2, -1]
            values = np.abs(a * u[:, None, None] + b * x[:-1, None, None] + c)
            used.append(values[:, ends_and_middle].max(axis=2).T)
        loose: FloatArray = np.maximum(1.0 - np.max(used, axis=0), 0.0).mean(axis=0)
        return loose


def law_limits(robot: Robot, limits: SegmentLimits, intervals: Intervals, factors: FloatArray) -> LawLimits:
    """The limits on x and u.

    Args:
        robot: With its payload.
        limits: Of the segments.
        intervals: Of the curves.
        factors: (segments,), on all times, beyond what the limits ask.

    Raises:
        LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
    """
    squares = factors[intervals.segments] ** 2
    blocks = [_acceleration_rows(limits, intervals)]
    if robot.has_dynamics and np.isfinite(limits.torque[intervals.segments]).any():
        blocks.append(_torque_rows(robot, limits, intervals))
    slower = tuple(Rows(a * squares[:, None, None], b * squares[:, None, None], c) for a, b, c in blocks)
    return LawLimits(slower, _most(robot, limits, intervals, squares))


def _acceleration_rows(limits: SegmentLimits, intervals: Intervals) -> Rows:
    """Bound q' u + q'' (x + 2 u s), a polynomial in s, everywhere by its Bernstein coefficients."""
    limit = limits.acceleration[intervals.segments]
    first, second = (differentiate(intervals.coefficients, k) for k in (1, 2))
    a, b = first.copy(), np.zeros_like(first)
    if first.shape[2] > 1:
        a[..., 1:] += 2.0 * second
        b[..., :-1] = second
    powers = intervals.lengths[:, None, None] ** np.arange(first.shape[2])
    a, b = (part * powers @ bernstein_matrix(first.shape[2]) / limit[..., None] for part in (a, b))
    return Rows(*(part.transpose(0, 2, 1) for part in (a, b, np.zeros_like(a))))


def _torque_rows(robot: Robot, limits: SegmentLimits, intervals: Intervals) -> Rows:
    """(M q') u + (M q'' + C(q, q') q') x + g, taken for quadratic in s between the ends and the middle."""
    limit = limits.torque[intervals.segments]
    per_u, per_x, gravity = _torques_along(robot, intervals)
    segment_rows = np.broadcast_to(intervals.segments, gravity.shape[:2])
    refuse_what_gravity_exceeds(robot, segment_rows, gravity, np.broadcast_to(limit, gravity.shape))
    per_u += 2.0 * (TORQUE_PROBES[:, None] * intervals.lengths)[..., None] * per_x
    a, b, c = (np.moveaxis(part / limit, 0, 2) @ QUADRATIC_TO_BERNSTEIN for part in (per_u, per_x, gravity))
    return Rows(*(part.transpose(0, 2, 1) for part in (a, b, np.clip(c, -MOST_GRAVITY, MOST_GRAVITY))))


def _torques_along(robot: Robot, intervals: Intervals) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Torque per u, per x and without motion, each (probes, intervals, joints).

    Where the curve goes on, the end of an interval is the start of the next.
    """
    states = intervals.at(TORQUE_PROBES)
    own = np.ones(states[0].shape[:2], dtype=bool)
    own[-1] = intervals.rests[1:]
    q, first, second = (rows[own] for rows in states)
    still = np.zeros_like(q)
    gravity = inverse_dynamics(robot, q, still, still)
    by_probe = []
    for torques in (
        inverse_dynamics(robot, q, still, first) - gravity,
        inverse_dynamics(robot, q, first, second) - gravity,
        gravity,
    ):
        rows = np.empty_like(states[0])
        rows[own] = torques
        rows[-1, ~own[-1]] = np.roll(rows[0], -1, axis=0)[~own[-1]]
        by_probe.append(rows)
    return by_probe[0], by_probe[1], by_probe[2]


def _most(robot: Robot, limits: SegmentLimits, intervals: Intervals, squares: FloatArray) -> FloatArray:
    """Bounds on x at the breakpoints, such that straight lines between them keep the speed limits."""
    q, first, _ = intervals.at(PROBES)
    segments = intervals.segments
    with np.errstate(divide="ignore"):
        bound = 1.0 / (np.abs(first) / limits.velocity[segments]).max(axis=2) ** 2 / squares
        of_tool = limits.tcp_linear_velocity[segments], limits.tcp_angular_velocity[segments]
        if np.isfinite(of_tool).any():
            joints = q.shape[2]
            speeds = tool_speeds(robot, q.reshape(-1, joints), first.reshape(-1, joints))
            used = np.max([s.reshape(bound.shape) / limit for s, limit in zip(speeds, of_tool, strict=True)], axis=0)
            bound = np.minimum(bound, 1.0 / used**2 / squares)
    bound = np.minimum(bound, MOST_SQUARE)
    bound = np.minimum(bound, STEEP * bound.min(axis=0))
    most: FloatArray = np.minimum(np.append(bound[0], np.inf), np.insert(bound[-1], 0, np.inf))
    line = most[:-1] + PROBES[:, None] * np.diff(most)
    share = np.minimum((bound / line).min(axis=0), 1.0)
    most[:-1] *= share
    most[1:] *= share
    return most
