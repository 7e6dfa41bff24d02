"""Time-scaling functions s(t) along a curve q(s), and the motions q(s(t))."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.constraints.rows import path_speed_shares
from planner.kernels.polynomials import follow_scaling, times_of_arrival
from planner.kinematics.forward import JointStates
from planner.paths import JointPath, SegmentGroup
from planner.spatial import FloatArray
from planner.tolerances import BISECTIONS, ROUNDING
from planner.trajectories.polynomials import (
    PiecewisePolynomial,
    SegmentedPolynomial,
    horner,
    quintic_hermite,
    shifted,
)

PROBES = np.array([0.25, 0.5, 0.75])
"""Shares of the time of a piece at which it is compared with the curve that it follows; at its ends it is on it."""

MOST_PIECE_HALVINGS = 12
"""Number of times that pieces are halved, at most, until they follow the curve: errors shrink by 2^6 each time."""

SPEED_SAMPLES = 17
"""Gridpoints on each piece of a curve at which the tool's speed is computed."""


class ScaledCurve(NamedTuple):
    """The motion q(s(t)) along a curve q(s) under a time scaling s(t)."""

    curve: PiecewisePolynomial
    scaling: PiecewisePolynomial

    def derivatives(self, of: np.ndarray, on: np.ndarray, t: FloatArray, order: int) -> list[FloatArray]:
        """Return s and its first two derivatives (..., 1), then q and its derivatives (..., joints) up to an order.

        Args:
            of: The pieces (...) of the time scaling.
            on: The pieces (...) of the curve.
            t: Local times (...), s, on the pieces of the time scaling.
            order: The order: 0, 2 or 3.
        """
        of, on, t = np.broadcast_arrays(of, on, t)
        curve, scaling = self.curve, self.scaling.coefficients[:, 0]
        curve_parts = curve.lengths, curve.breakpoints, curve.coefficients
        by_s, by_q, _ = follow_scaling(curve_parts, scaling, *(values.ravel() for values in (of, on, t)))
        return [*by_s.reshape(3, *t.shape, 1), *by_q.reshape(4, *t.shape, -1)[: order + 1]]


def split_at_knots(scaling: PiecewisePolynomial, knots: FloatArray, segments: np.ndarray) -> SegmentedPolynomial:
    """Split a time-scaling function over several segments at the ends of the segments.

    Args:
        scaling: s(t), ascending.
        knots: (segments - 1,), path positions s where the segments meet.
        segments: (segments,), their indices.
    """
    pieces, starts, ends = _split_pieces(scaling, knots, scaling.evaluate(scaling.breakpoints, [0])[0][:, 0])
    middles = scaling.evaluate(scaling.breakpoints[pieces] + (starts + ends) / 2.0, [0])[0][:, 0]
    coefficients = shifted(scaling.coefficients[pieces], starts[:, None])
    return SegmentedPolynomial(ends - starts, coefficients, segments[np.searchsorted(knots, middles)])


def follow_curve(group: SegmentGroup, scaling: SegmentedPolynomial) -> SegmentedPolynomial:
    """Return the motion q(s(t)) along the curve of a segment group within its tolerance; see `compose`."""
    pieces, of = compose(group.curve, scaling, group.tolerance)
    return pieces.of_segments(scaling.segments[of])


def compose(
    curve: PiecewisePolynomial, scaling: PiecewisePolynomial, tolerance: float
) -> tuple[PiecewisePolynomial, np.ndarray]:
    """Return q(s(t)) in quintics of time, and the piece (pieces,) of s(t) that each belongs to.

    The quintics meet position, velocity and acceleration at both of their ends. They are halved until they keep to the
    curve within the tolerance. Where the acceleration of the curve or of s(t) jumps, so does theirs.

    Args:
        curve: q(s).
        scaling: s(t), ascending from 0 to the length of the curve.
        tolerance: The largest distance of a joint from the curve, rad or m.
    """
    s = scaling.evaluate(scaling.breakpoints, [0])[0][:, 0]
    s[-1] = curve.breakpoints[-1]
    # The ends of the curve are no knots: rounding at the start of a time scaling would make a piece of length zero.
    of, start, end = _split_pieces(scaling, curve.breakpoints[1:-1], s)
    motion, on = ScaledCurve(curve, scaling), curve.locate(horner(scaling.coefficients[of, 0], (start + end) / 2.0))[0]
    for halvings in range(MOST_PIECE_HALVINGS + 1):
        states = [tuple(motion.derivatives(of, on, t, 2)[3:]) for t in (start, end)]
        coefficients = quintic_hermite(end - start, *states)
        rough = np.zeros(len(of), dtype=bool)
        for probe in PROBES:
            t = probe * (end - start)
            exact = motion.derivatives(of, on, start + t, 0)[3]
            rough |= np.abs(horner(coefficients, t[:, None]) - exact).max(axis=1) > tolerance
        if not rough.any() or halvings == MOST_PIECE_HALVINGS:
            break
        middle = (start + end) / 2.0
        halves = np.repeat(np.arange(len(of)), 1 + rough)
        second = np.append(False, np.diff(halves) == 0)
        first = np.append(second[1:], False)
        of, on, start, end = of[halves], on[halves], start[halves], end[halves]
        start, end = np.where(second, middle[halves], start), np.where(first, middle[halves], end)
    return PiecewisePolynomial(end - start, coefficients), of


def _split_pieces(
    scaling: PiecewisePolynomial, knots: FloatArray, s: FloatArray
) -> tuple[np.ndarray, FloatArray, FloatArray]:
    """Cut the pieces of s(t) at knots; return the index and the local ends of each part, all (N,).

    The function finds these times by bisection, as s(t) ascends. A knot within rounding of an end of a piece is that
    end. Two knots may be as close as waypoints, 1e-10 of the curve.

    Args:
        scaling: The time-scaling function s(t).
        knots: Path positions (knots,), ascending.
        s: Path positions (pieces + 1,) at the breakpoints of s(t).
    """
    margins = ROUNDING * s[1:]
    first = np.searchsorted(knots, s[:-1] + margins, side="right")
    counts = np.maximum(np.searchsorted(knots, s[1:] - margins) - first, 0)
    passing = np.repeat(np.arange(len(counts)), counts)
    passed = knots[np.arange(len(passing)) + np.repeat(first - (np.cumsum(counts) - counts), counts)]
    arrivals = times_of_arrival(scaling.coefficients[passing, 0], scaling.lengths[passing], passed, BISECTIONS)
    pieces = np.repeat(np.arange(len(counts)), counts + 1)
    starts, ends = np.zeros(len(pieces)), scaling.lengths[pieces]
    later = np.flatnonzero(np.diff(pieces) == 0) + 1
    starts[later] = ends[later - 1] = arrivals
    return pieces, starts, ends


class ToolSpeeds:
    """A path velocity of 1 along a curve, as a share of the highest that limits of the tool allow.

    Attributes:
        gridpoints: (N,), path positions at which it is computed.
        shares: (N,), by the constraints that follow the path speed alone.
    """

    def __init__(self, path: JointPath, group: SegmentGroup) -> None:
        curve, limited = group.curve, path.limits.constraints
        self.gridpoints = np.zeros(1)
        self.shares = np.zeros(1)
        if any(constraint.follows_path_speed for constraint, _ in limited):
            unit = (np.arange(SPEED_SAMPLES) + 0.5) / SPEED_SAMPLES
            self.gridpoints = (curve.breakpoints[:-1, None] + unit * curve.lengths[:, None]).ravel()
            states = JointStates(path.dynamics.robot_on(group.first), *curve.evaluate(self.gridpoints))
            self.shares = path_speed_shares(limited, states, np.repeat(curve.segments, SPEED_SAMPLES))

    def shares_at(self, s: FloatArray) -> FloatArray:
        """Return the shares at path positions of any shape, by linear interpolation."""
        return np.interp(s, self.gridpoints, self.shares)
