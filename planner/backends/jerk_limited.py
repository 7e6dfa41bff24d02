"""As fast as can be along a curve, the jerk limits kept as well."""

from __future__ import annotations

from math import factorial
from typing import TYPE_CHECKING

import numpy as np

from planner.backends.along_curve import (
    DURATION_TOLERANCE,
    CurveLaw,
    ToolSpeeds,
    broken_at,
    demands,
    follow_curve,
    stretched,
)
from planner.backends.base import QUANTITIES
from planner.backends.demands import SampledLimits, infeasible_duration, nothing_limits
from planner.backends.speed_program import PLACES, LinearLimits, QuadraticSpline, fastest_retiming
from planner.dynamics import inverse_dynamics
from planner.errors import InvalidProblem
from planner.polynomials import PiecewisePolynomial, differentiate, horner, quintic_hermite

if TYPE_CHECKING:
    from planner.backends.assembly import TimedPieces
    from planner.kinematics.poses import FloatArray
    from planner.paths import JointPath, Run

ROUNDS = ((20, 10, 1e-2), (40, 25, 2e-4))
"""Of the search: pieces of the law, those of each segment in addition, and how near to the optimum it is to come."""

GAUSS_POINTS = 5
"""On each piece, to integrate the time that it takes."""

ENFORCED = frozenset(QUANTITIES)


def time_run(path: JointPath, run: Run) -> TimedPieces:
    """The fastest law s(t) along the run's curve that keeps every limit, jerk included; C2, from rest to rest.

    The search begins with one quintic over the whole run. Each round splits its longest pieces and retimes it: where it
    may be faster, and by how much, is a smooth function of time even at the ends, where speed over place has a
    singularity. What is left between the places that the search looks at, one exact factor on all times sets right.

    Raises:
        InvalidProblem: A duration is asked of a segment that is not alone in its run.
        InfeasibleDuration: The asked duration is too short.
        LimitsUnsatisfiable: Nothing limits the duration, or gravity exceeds a torque limit.
    """
    asked = _asked(path, run)
    pieces = follow_curve(run, _fastest(path, run))
    needed = demands(path, pieces, ENFORCED)
    demand = max(needed.values())
    factor, own = demand.factor, float(pieces.lengths.sum())
    if not np.isnan(asked):
        if asked < factor * own * (1.0 - DURATION_TOLERANCE):
            raise infeasible_duration(asked, {run.first: factor * own}, demand.cause, demand.joint)
        factor = asked / own
    elif factor <= 0.0:
        raise nothing_limits(run.first)
    return stretched(pieces, factor)


def _asked(path: JointPath, run: Run) -> float:
    """The duration asked of the run, s, NaN if none."""
    asked = path.durations[run.segments]
    if len(asked) > 1 and not np.isnan(asked).all():
        message = (
            "the fastest jerk-limited law gives no duration to a segment that is passed without stopping; leave it out"
        )
        raise InvalidProblem([(f"/waypoints/{run.first + k + 1}/duration", message) for k in np.flatnonzero(asked > 0)])
    return float(asked[0])


def _fastest(path: JointPath, run: Run) -> CurveLaw:
    law, limits = _quintic(run), _LimitsOnCurve(path, run)
    for count, each, gap in ROUNDS:
        law = _split(law, count + each * len(run.segments))
        bounds = limits.along(law)
        if not np.isfinite(bounds.scale(np.tile([[1.0], [0.0], [0.0]], bounds.constant.shape[1]))):
            break  # nothing limits: any law will do
        law = _retimed(law, fastest_retiming(law.lengths, bounds, gap))
    return CurveLaw(law, run.owners[limits.pieces(law)])


def _quintic(run: Run) -> PiecewisePolynomial:
    """From rest to rest in 1 s, with a breakpoint where the curve has one."""
    places = run.curve.breakpoints
    whole = PiecewisePolynomial(np.ones(1), places[-1] * np.array([[[0.0, 0.0, 0.0, 10.0, -15.0, 6.0]]]))
    law = broken_at(whole, places[1:-1], run.owners).law
    law.coefficients[:, 0, 0] = places[:-1]
    return law


def _split(law: PiecewisePolynomial, count: int) -> PiecewisePolynomial:
    """The same law with its pieces in equal parts, none longer than the duration by `count`."""
    parts = np.ceil(law.lengths / law.lengths.sum() * count).astype(int)
    lengths = np.repeat(law.lengths / parts, parts)
    number = np.arange(len(lengths)) - np.repeat(np.cumsum(parts) - parts, parts)
    whole = np.repeat(law.coefficients[:, 0], parts, axis=0)
    terms = [horner(differentiate(whole, k), number * lengths) / factorial(k) for k in range(whole.shape[1])]
    return PiecewisePolynomial(lengths, np.stack(terms, axis=1)[:, None])


def _retimed(law: PiecewisePolynomial, unknowns: FloatArray) -> PiecewisePolynomial:
    """The law after retiming: quintics between its nodes, whose speed and acceleration are exact there."""
    b, a, _ = QuadraticSpline(law.lengths).states(unknowns).reshape(3, len(PLACES), -1)
    u, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    u, weights = (u[:, None] + 1.0) / 2.0, weights / 2.0
    inside = b[0] * (1.0 - u) ** 2 + 2.0 * u * (1.0 - u) * unknowns[1:-1] + b[-1] * u**2
    lengths = weights @ (1.0 / np.sqrt(inside)) * law.lengths
    s, speed, gain = law.coefficients[:, 0, :3].T * [[1.0], [1.0], [2.0]]
    end = horner(law.coefficients[-1, 0], law.lengths[-1])
    speed, gain = speed * np.sqrt(b[0]), gain * b[0] + speed * a[0]
    nodes = [np.append(s, end)[:, None], np.append(speed, 0.0)[:, None], np.append(gain, 0.0)[:, None]]
    starts, ends = tuple(x[:-1] for x in nodes), tuple(x[1:] for x in nodes)
    return PiecewisePolynomial(lengths, quintic_hermite(lengths, starts, ends))


class _LimitsOnCurve:
    """What the limits say about retiming a law along the run's curve."""

    def __init__(self, path: JointPath, run: Run) -> None:
        self.path, self.run, self.speeds = path, run, ToolSpeeds(path, run)
        self.robot = path.robot
        torque = path.limits.torque[run.segments]
        self.has_torque = self.robot.has_dynamics and bool(np.isfinite(torque).any())

    def pieces(self, law: PiecewisePolynomial) -> np.ndarray:
        """(pieces of the law,): the piece of the curve that each is on."""
        middles = horner(law.coefficients[:, 0], law.lengths / 2.0)
        return self.run.curve.locate(middles)[0]

    def along(self, law: PiecewisePolynomial) -> LinearLimits:
        """All of them, at the places of the law's pieces."""
        curve, on = self.run.curve, self.pieces(law)
        t = PLACES[:, None] * law.lengths
        s, *rates = (horner(differentiate(law.coefficients[:, 0], k), t) for k in range(4))
        ds, dds, ddds = (rate[..., None] for rate in rates)
        x = np.clip(s - curve.breakpoints[on], 0.0, curve.lengths[on])[..., None]
        q, dq, ddq, dddq = (horner(curve.derivative_coefficients(k)[on], x) for k in range(4))
        first, second = dq * ds, ddq * ds**2 + dq * dds
        third = dddq * ds**3 + 3.0 * ddq * ds * dds + dq * ddds
        owners = self.run.owners[on]
        limits = self.path.limits
        velocity, acceleration, jerk = limits.velocity[owners], limits.acceleration[owners], limits.jerk[owners]
        speed = np.maximum((np.abs(first) / velocity).max(axis=2), self.speeds.excess(s.ravel()).reshape(s.shape) * rates[0])
        none = np.zeros_like(first)
        one, no = np.ones_like(first), none
        groups = [
            (speed[..., None] ** 2, none[..., :1], none[..., :1], none[..., :1], one[..., :1], none[..., :1]),
            (second / acceleration, first / acceleration, none, none, one, none),
            (third / jerk, 3.0 * second / jerk, first / jerk, none, none, one),
        ]
        if self.has_torque:
            groups.append(self._torques(owners, q, first, second))
        rows = [np.concatenate([group[k] for group in groups], axis=2).reshape(s.size, -1).T for k in range(6)]
        return LinearLimits(*rows)

    def _torques(
        self, owners: np.ndarray, q: FloatArray, first: FloatArray, second: FloatArray
    ) -> tuple[FloatArray, ...]:
        """Relative to the limits. At a node the end of one piece is the start of the next."""

        def once(x: FloatArray) -> FloatArray:
            return np.concatenate([x[:2].reshape(-1, x.shape[2]), x[2, -1:]])

        def everywhere(x: FloatArray) -> FloatArray:
            start, middle = x[:-1].reshape(2, len(owners), -1)
            return np.stack([start, middle, np.concatenate([start[1:], x[-1:]])]) / self.path.limits.torque[owners]

        positions, still = once(q), np.zeros_like(once(q))
        sampled = SampledLimits(self.robot, self.path.limits)
        for segment in self.run.segments.tolist():
            own = np.flatnonzero(owners == segment)
            at = q[:, own].reshape(-1, q.shape[2])
            sampled.stretch(segment, segment, at, np.zeros_like(at), np.zeros_like(at))  # refuses too much gravity
        gravity = inverse_dynamics(self.robot, positions, still, still)
        by_b = inverse_dynamics(self.robot, positions, once(first), once(second)) - gravity
        by_a = inverse_dynamics(self.robot, positions, still, once(first)) - gravity
        none = np.zeros_like(q)
        return everywhere(by_b), everywhere(by_a), none, everywhere(gravity), none + 1.0, none
