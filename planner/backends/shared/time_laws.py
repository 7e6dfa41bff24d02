"""Time laws s(t) along a curve q(s), and the motions q(s(t)) that follow from them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.kinematics.forward import tool_speeds
from planner.polynomials import (
    PiecewisePolynomial,
    SegmentedPolynomial,
    differentiate,
    horner,
    quintic_hermite,
    shifted,
)
from planner.tolerances import ROUNDING

if TYPE_CHECKING:
    from planner.paths import JointPath, Run
    from planner.spatial import FloatArray

PROBES = np.array([0.25, 0.5, 0.75])
"""Shares of the time of a piece at which it is compared with the curve that it follows; at its ends it is on it."""

MOST_HALVINGS = 12
"""Number of times that pieces are halved, at most, until they follow the curve: errors shrink by 2^6 each time."""

BISECTIONS = 55
"""Steps of bisection until a time is as exact as a floating-point number of 53 bits."""

SPEED_SAMPLES = 17
"""Gridpoints on each piece of a curve at which the tool's speed is computed."""


def split_at_knots(law: PiecewisePolynomial, knots: FloatArray, segments: np.ndarray) -> SegmentedPolynomial:
    """A time law over several segments, with a breakpoint wherever one ends.

    Args:
        law: s(t), ascending.
        knots: (segments - 1,), path positions s where the segments meet.
        segments: (segments,), their indices.
    """
    lengths, coefficients, piece_segments = [], [], []
    ends = law.evaluate(law.breakpoints, [0])[0][:, 0]
    for piece, own in enumerate(law.coefficients):
        times = _times_at(knots, law, piece, ends[piece], ends[piece + 1])
        lengths += np.diff(times).tolist()
        coefficients += [shifted(own, float(t)) for t in times[:-1]]
        middles = law.breakpoints[piece] + (times[:-1] + times[1:]) / 2.0
        piece_segments += segments[np.searchsorted(knots, law.evaluate(middles, [0])[0][:, 0])].tolist()
    return SegmentedPolynomial(np.array(lengths), np.array(coefficients), np.array(piece_segments))


def follow_curve(run: Run, law: SegmentedPolynomial) -> SegmentedPolynomial:
    """The motion q(s(t)): quintics in time that meet its position, velocity and acceleration at both of their ends.

    They are halved until they keep to the curve within the run's tolerance. Between the pieces of the law the
    acceleration may jump, as the law's does.

    Args:
        run: The run, with the curve q(s).
        law: s(t), ascending from 0 to the length of the curve.
    """
    curve = run.curve
    s = law.evaluate(law.breakpoints, [0])[0][:, 0]
    s[-1] = curve.breakpoints[-1]
    pieces, starts, ends = [], [], []
    # The ends of the curve are no knots: a law whose rounding begins behind them would get a piece of no length there.
    knots = curve.breakpoints[1:-1]
    for piece in range(len(law.lengths)):
        times = _times_at(knots, law, piece, s[piece], s[piece + 1])
        pieces += [piece] * (len(times) - 1)
        starts += times[:-1].tolist()
        ends += times[1:].tolist()
    own, start, end = np.array(pieces), np.array(starts), np.array(ends)
    for _ in range(MOST_HALVINGS):
        states = (_joint_state(law, curve, own, t) for t in (start, end))
        coefficients = quintic_hermite(end - start, *states)
        rough = np.zeros(len(own), dtype=bool)
        for probe in PROBES:
            t = probe * (end - start)
            exact = _joint_state(law, curve, own, start + t)[0]
            rough |= np.abs(horner(coefficients, t[:, None]) - exact).max(axis=1) > run.tolerance
        if not rough.any():
            break
        middle = (start + end) / 2.0
        halves = np.repeat(np.arange(len(own)), 1 + rough)
        second = np.append(False, np.diff(halves) == 0)
        first = np.append(second[1:], False)
        own, start, end = own[halves], start[halves], end[halves]
        start, end = np.where(second, middle[halves], start), np.where(first, middle[halves], end)
    return SegmentedPolynomial(end - start, coefficients, law.segments[own])


def _times_at(knots: FloatArray, law: PiecewisePolynomial, piece: int, start: float, end: float) -> FloatArray:
    """Local times on a piece of the law, from s = `start` to `end`: its ends, and when it passes the knots between.

    These are found by bisection, as the law ascends. A knot that only rounding tells from an end is that end; two knots
    may be as near to each other as waypoints are, 1e-10 of the curve.
    """
    margin = ROUNDING * end
    inner = knots[(knots > start + margin) & (knots < end - margin)]
    length = law.lengths[piece]
    low, high = np.zeros(len(inner)), np.full(len(inner), length)
    for _ in range(BISECTIONS if len(inner) else 0):
        middle = (low + high) / 2.0
        before = horner(law.coefficients[piece, 0], middle) < inner
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return np.concatenate([[0.0], high, [length]])


def _joint_state(
    law: PiecewisePolynomial, curve: PiecewisePolynomial, pieces: np.ndarray, t: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position, velocity and acceleration (N, joints) at local times t (N,) of the law's pieces (N,)."""
    s, ds, dds = (horner(differentiate(law.coefficients[pieces, 0], k), t) for k in range(3))
    q, dq, ddq = curve.evaluate(np.clip(s, 0.0, curve.breakpoints[-1]))
    return q, dq * ds[:, None], ddq * ds[:, None] ** 2 + dq * dds[:, None]


class ToolSpeeds:
    """The tool's speed along a curve at a path velocity of 1, as a share of its limit.

    Attributes:
        gridpoints: (N,), path positions at which it is computed.
        shares: (N,), of the linear or the angular speed, whichever is more of its limit.
    """

    def __init__(self, path: JointPath, run: Run) -> None:
        curve, limits = run.curve, path.limits
        linear, angular = limits.tcp_linear_velocity[curve.segments], limits.tcp_angular_velocity[curve.segments]
        self.gridpoints = np.zeros(1)
        self.shares = np.zeros(1)
        if np.isfinite(linear).any() or np.isfinite(angular).any():
            unit = (np.arange(SPEED_SAMPLES) + 0.5) / SPEED_SAMPLES
            self.gridpoints = (curve.breakpoints[:-1, None] + unit * curve.lengths[:, None]).ravel()
            speeds = tool_speeds(path.robot, *curve.evaluate(self.gridpoints, [0, 1]))
            limit = np.repeat(linear, SPEED_SAMPLES), np.repeat(angular, SPEED_SAMPLES)
            self.shares = np.maximum(speeds[0] / limit[0], speeds[1] / limit[1])

    def shares_at(self, s: FloatArray) -> FloatArray:
        """The shares at path positions of any shape, by linear interpolation."""
        shares: FloatArray = np.interp(s, self.gridpoints, self.shares)
        return shares
