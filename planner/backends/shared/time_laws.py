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
from planner.tolerances import NEGLIGIBLE_SHARE

if TYPE_CHECKING:
    from planner.paths import JointPath, Run
    from planner.spatial import FloatArray

PROBES = np.array([0.25, 0.5, 0.75])
"""Where a piece is compared with the curve that it follows."""

MOST_HALVINGS = 12
"""Times that pieces are halved until they follow the curve."""

BISECTIONS = 55
"""Steps until a point of time is as exact as a floating-point number."""

SPEED_SAMPLES = 17
"""On each piece of a curve, of the tool's speed."""


def split_at_knots(law: PiecewisePolynomial, places: FloatArray, segments: np.ndarray) -> SegmentedPolynomial:
    """A law over several segments, with a breakpoint wherever one ends.

    Args:
        law: s(t), ascending.
        places: (segments - 1,), values of s where the segments meet.
        segments: (segments,), their indices.
    """
    lengths, coefficients, owners = [], [], []
    ends = law.evaluate(law.breakpoints, [0])[0][:, 0]
    for piece, own in enumerate(law.coefficients):
        times = _times(law, piece, places, ends[piece], ends[piece + 1])
        lengths += np.diff(times).tolist()
        coefficients += [shifted(own, float(t)) for t in times[:-1]]
        middles = law.breakpoints[piece] + (times[:-1] + times[1:]) / 2.0
        owners += segments[np.searchsorted(places, law.evaluate(middles, [0])[0][:, 0])].tolist()
    return SegmentedPolynomial(np.array(lengths), np.array(coefficients), np.array(owners))


def follow_curve(run: Run, law: SegmentedPolynomial) -> SegmentedPolynomial:
    """The pieces q(s(t)): quintics in time that meet the curve, its velocity and acceleration at both of their ends.

    They are halved until they keep to the curve within the run's tolerance. Between the pieces of the law the
    acceleration may jump, as the law's does.
    """
    curve = run.curve
    at = law.evaluate(law.breakpoints, [0])[0][:, 0]
    at[-1] = curve.breakpoints[-1]
    pieces, starts, ends = [], [], []
    for piece in range(len(law.lengths)):
        times = _times(law, piece, curve.breakpoints, at[piece], at[piece + 1])
        pieces += [piece] * (len(times) - 1)
        starts += times[:-1].tolist()
        ends += times[1:].tolist()
    where, start, end = np.array(pieces), np.array(starts), np.array(ends)
    for _ in range(MOST_HALVINGS):
        coefficients = _quintics(law, curve, where, start, end)
        rough = np.zeros(len(where), dtype=bool)
        for probe in PROBES:
            t = probe * (end - start)
            due = _state(law, curve, where, start + t)[0]
            rough |= np.abs(horner(coefficients, t[:, None]) - due).max(axis=1) > run.tolerance
        if not rough.any():
            break
        middle = (start + end) / 2.0
        halves = np.repeat(np.arange(len(where)), 1 + rough)
        second = np.append(False, np.diff(halves) == 0)
        first = np.append(second[1:], False)
        where, start, end = where[halves], start[halves], end[halves]
        start, end = np.where(second, middle[halves], start), np.where(first, middle[halves], end)
    return SegmentedPolynomial(end - start, coefficients, law.segments[where])


def _times(law: PiecewisePolynomial, piece: int, places: FloatArray, start: float, end: float) -> FloatArray:
    """Local times on a piece of the law, from s = `start` to `end`: its ends, and when it passes the places between.

    By bisection, as the law ascends.
    """
    margin = NEGLIGIBLE_SHARE * (end - start)
    inner = places[(places > start + margin) & (places < end - margin)]
    length = law.lengths[piece]
    low, high = np.zeros(len(inner)), np.full(len(inner), length)
    for _ in range(BISECTIONS if len(inner) else 0):
        middle = (low + high) / 2.0
        before = horner(law.coefficients[piece, 0], middle) < inner
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return np.concatenate([[0.0], high, [length]])


def _quintics(
    law: PiecewisePolynomial, curve: PiecewisePolynomial, where: np.ndarray, start: FloatArray, end: FloatArray
) -> FloatArray:
    return quintic_hermite(end - start, _state(law, curve, where, start), _state(law, curve, where, end))


def _state(
    law: PiecewisePolynomial, curve: PiecewisePolynomial, where: np.ndarray, t: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position, velocity and acceleration (N, joints) at local times t (N,) of the law's pieces `where` (N,)."""
    own = law.coefficients[where, 0]
    s, ds, dds = (horner(differentiate(own, k), t) for k in range(3))
    q, dq, ddq = curve.evaluate(np.clip(s, 0.0, curve.breakpoints[-1]))
    return q, dq * ds[:, None], ddq * ds[:, None] ** 2 + dq * dds[:, None]


class ToolSpeeds:
    """How much of its limits the tool's speed uses along a curve, by its speed on the curve."""

    def __init__(self, path: JointPath, run: Run) -> None:
        curve, limits = run.curve, path.limits
        linear, angular = limits.tcp_linear_velocity[curve.segments], limits.tcp_angular_velocity[curve.segments]
        self.places = np.zeros(1)
        self.use = np.zeros(1)
        if np.isfinite(linear).any() or np.isfinite(angular).any():
            unit = (np.arange(SPEED_SAMPLES) + 0.5) / SPEED_SAMPLES
            self.places = (curve.breakpoints[:-1, None] + unit * curve.lengths[:, None]).ravel()
            speeds = tool_speeds(path.robot, *curve.evaluate(self.places, [0, 1]))
            limit = np.repeat(linear, SPEED_SAMPLES), np.repeat(angular, SPEED_SAMPLES)
            self.use = np.maximum(speeds[0] / limit[0], speeds[1] / limit[1])

    def excess(self, places: FloatArray) -> FloatArray:
        """1/s: the ratio of tool speed to limit at unit speed along the curve."""
        use: FloatArray = np.interp(places, self.places, self.use)
        return use
