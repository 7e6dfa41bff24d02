"""Interpolating splines in time, at rest at both ends: C2 of degree 3, C4 of degree 5; and their sensitivities.

Where a velocity is given, the spline is two that meet there: with the velocity alone in degree 3, C1, and with no
acceleration in degree 5, C2, as at the ends.

On each segment the spline is the Hermite polynomial of the derivatives at its ends. Those at the inner waypoints
(velocity for degree 3, velocity and acceleration for degree 5) are the unknowns; that the next derivatives are
continuous as well gives a block-tridiagonal system for them, the same for all joints: Biagiotti and Melchiorri,
Trajectory Planning for Automatic Machines and Robots (2008), ch. 4.4 for degree 3; de Boor, A Practical Guide to
Splines (2001), ch. IV and IX in general. Each unknown and each equation is scaled by the shorter segment beside its
waypoint, so that durations of very different lengths do no harm.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import perm
from typing import TYPE_CHECKING, Literal

import numpy as np

from planner.trajectories.polynomials import PiecewisePolynomial, stretched

if TYPE_CHECKING:
    from planner.spatial import FloatArray

Degree = Literal[3, 5]


@dataclass(frozen=True, eq=False)
class _Banded:
    """A square matrix (n, n) that is zero but near its diagonal.

    Attributes:
        diagonals: Element (r, c) at row `width` + r - c and column c; (2 width + 1, n).
    """

    diagonals: FloatArray

    @classmethod
    def block_tridiagonal(cls, below: FloatArray, diagonal: FloatArray, above: FloatArray) -> _Banded:
        """Make it of blocks (N - 1, k, k), (N, k, k) and (N - 1, k, k)."""
        count, k = diagonal.shape[:2]
        width = 2 * k - 1
        diagonals = np.zeros((2 * width + 1, count * k))
        row, column = np.arange(k)[:, None], np.arange(k)
        for blocks, first, offset in ((below, 0, 1), (diagonal, 0, 0), (above, 1, -1)):
            columns = k * np.arange(first, first + len(blocks))[:, None, None] + column
            diagonals[width + k * offset + row - column, columns] = blocks
        return cls(diagonals)

    def solve(self, right: FloatArray) -> FloatArray:
        """Return the solution (n, m) for right sides (n, m), by elimination within the band."""
        from scipy.linalg import solve_banded  # loaded by the first spline: importing the library stays quick

        if not len(right):
            return right
        width = len(self.diagonals) // 2
        return np.asarray(solve_banded((width, width), self.diagonals, right, check_finite=False), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class InterpolatingSpline:
    """A spline, on unit time in each segment, and the system that it solves.

    Below, k = (degree - 1) / 2 is the number of derivatives that are known at an end, or unknown at a waypoint.

    Attributes:
        degree: The degree, 3 or 5.
        durations: Durations (segments,), s.
        unit: Coefficients (segments, joints, degree + 1), ascending powers of unit time.
        ends: Travel, then derivatives 1 to k at the start, then at the end, by unit time; (segments, joints, degree).
        scales: Duration (segments - 1,), s, of the shorter segment beside each inner waypoint.
        given: Whether (segments - 1,) the velocity is given at each inner waypoint.
        system: Jumps of derivatives k + 1 to 2 k at each inner waypoint by its and its neighbours' derivatives 1 to k,
            all by time in units of `scales`; where the velocity is given, these derivatives themselves.
    """

    degree: Degree
    durations: FloatArray
    unit: FloatArray
    ends: FloatArray
    scales: FloatArray
    given: np.ndarray
    system: _Banded

    @property
    def curve(self) -> PiecewisePolynomial:
        """The spline in time, one piece a segment."""
        return PiecewisePolynomial(self.durations, stretched(self.unit, self.durations[:, None]))

    @cached_property
    def _inverse(self) -> FloatArray:
        return self.system.solve(np.eye(self.system.diagonals.shape[1]))

    def sensitivities(self, segment: np.ndarray, joint: np.ndarray, order: np.ndarray, u: FloatArray) -> FloatArray:
        """Differentiate derivatives by time at fixed unit times by the logarithm of each duration.

        The solution x of the system A x = b changes by -A^-1 times the change of A x - b at fixed x.

        Args:
            segment: Index (points,) of the segment.
            joint: Index (points,) of the joint.
            order: Order (points,) of the derivative.
            u: Unit time (points,) on the segment.

        Returns:
            The slopes (points, segments).
        """
        h, (hermite, orders), k = self.durations, _hermite(self.degree), (self.degree - 1) // 2
        points, segments = np.arange(len(u)), len(h)
        weights = _monomials(self.degree, order, u) @ hermite / (h[segment] ** order)[:, None]
        slopes = np.zeros((len(u), segments))
        slopes[points, segment] = (weights * self.ends[segment, joint] * (orders - order[:, None])).sum(axis=1)
        if segments == 1:
            return slopes
        # By the unknowns at the waypoints before and after, then by the equations there; none at the outer ends.
        scales = np.concatenate([[1.0], self.scales, [1.0]])
        known, by_unknown = np.arange(1, k + 1), np.zeros((len(u), segments + 1, k))
        before, after = h[segment] / scales[segment], h[segment] / scales[segment + 1]
        by_unknown[points, segment] = weights[:, 1 : k + 1] * before[:, None] ** known
        by_unknown[points, segment + 1] = weights[:, k + 1 :] * after[:, None] ** known
        by_jump = np.zeros_like(by_unknown)
        inner = by_unknown[:, 1:-1].reshape(len(u), -1) @ self._inverse
        by_jump[:, 1:-1] = np.where(self.given[:, None], 0.0, inner.reshape(len(u), segments - 1, k))
        # The jumps by the logarithm of the duration of the segment before them, and of the one after.
        matched = np.arange(k + 1, 2 * k + 1)
        at_start, at_end = _matched_derivatives(self.degree)
        changes = self.ends[:, :, None, :] * (orders - matched[:, None])
        jump_after = (changes * at_start).sum(axis=3) * ((scales[:-1] / h)[:, None] ** matched)[:, None]
        jump_before = (changes * at_end).sum(axis=3) * ((scales[1:] / h)[:, None] ** matched)[:, None]
        for row in range(k):
            slopes -= by_jump[:, 1:, row] * jump_before[:, :, row].T[joint]
            slopes += by_jump[:, :-1, row] * jump_after[:, :, row].T[joint]
        return slopes


def interpolating_spline(positions: FloatArray, durations: FloatArray, degree: Degree) -> PiecewisePolynomial:
    """Interpolate `positions` by the spline of `degree`, at rest at both ends, one piece a segment: `interpolate`."""
    return interpolate(positions, durations, degree).curve


def interpolate(
    positions: FloatArray, durations: FloatArray, degree: Degree, velocities: FloatArray | None = None
) -> InterpolatingSpline:
    """Interpolate `positions` by the spline of `degree` that is at rest at both ends.

    Args:
        positions: Positions (segments + 1, joints), rad or m.
        durations: Durations (segments,), s, positive.
        degree: 3: velocity 0 at both ends, C2. 5: velocity and acceleration 0 at both ends, C4.
        velocities: Velocities (segments - 1, joints) at the inner waypoints, rad/s or m/s; NaN: that of a smooth
            spline. Where they are given, only the velocity is continuous in degree 3, and the acceleration, 0, as well
            in degree 5.
    """
    h, k = durations, (degree - 1) // 2
    travels = np.diff(positions, axis=0)
    inner, joints = len(h) - 1, positions.shape[1]
    scales = np.minimum(h[:-1], h[1:])
    before, after = h[:-1], h[1:]
    at_start, at_end = _matched_derivatives(degree)
    known, matched = np.arange(1, k + 1), np.arange(k + 1, 2 * k + 1)

    def block(weights: FloatArray, h: FloatArray, row_scale: FloatArray, column_scale: FloatArray) -> FloatArray:
        """Scale the blocks (inner, k, k) of the system that go with segments of durations h."""
        rows: FloatArray = (row_scale / h)[:, None, None] ** matched[:, None]
        return weights * rows * (h / column_scale)[:, None, None] ** known

    start, end = slice(1, k + 1), slice(k + 1, None)
    diagonal = block(at_end[:, end], before, scales, scales) - block(at_start[:, start], after, scales, scales)
    below = block(at_end[:, start], before[1:], scales[1:], scales[:-1])
    above = -block(at_start[:, end], after[:-1], scales[:-1], scales[1:])
    given = np.zeros(inner, dtype=bool) if velocities is None else np.isfinite(velocities[:, 0])
    diagonal[given], below[given[1:]], above[given[:-1]] = np.eye(k), 0.0, 0.0
    system = _Banded.block_tridiagonal(below, diagonal, above)
    jumps = (at_end[:, 0] * (scales / before)[:, None] ** matched)[..., None] * travels[:-1, None]
    jumps -= (at_start[:, 0] * (scales / after)[:, None] ** matched)[..., None] * travels[1:, None]
    if velocities is not None:
        jumps[given] = 0.0
        jumps[given, 0] = -velocities[given] * scales[given, None]
    unknowns = system.solve(-jumps.reshape(inner * k, joints)).reshape(inner, k, joints)

    at_waypoints = np.zeros((inner + 2, k, joints))
    at_waypoints[1:-1] = unknowns / scales[:, None, None] ** known[:, None]
    powers = h[:, None, None] ** known[:, None]
    ends = np.concatenate([travels[:, None], at_waypoints[:-1] * powers, at_waypoints[1:] * powers], axis=1)
    ends = ends.transpose(0, 2, 1)
    unit = ends @ _hermite(degree)[0].T
    unit[:, :, 0] = positions[:-1]
    return InterpolatingSpline(degree, durations, unit, ends, scales, given, system)


@lru_cache
def _hermite(degree: Degree) -> tuple[FloatArray, np.ndarray]:
    """Return the matrix (degree + 1, degree) from `ends` to powers of unit time, and their orders (degree,)."""
    known = range(1, (degree + 1) // 2)
    orders = np.array([0, *known, *known])
    conditions = np.zeros((degree, degree))
    conditions[0] = 1.0
    times = np.repeat([0.0, 1.0], len(known))
    conditions[1:] = _monomials(degree, orders[1:], times)[:, 1:]
    hermite = np.zeros((degree + 1, degree))
    # Whole numbers and halves, but for the rounding of the inverse.
    hermite[1:] = np.round(2.0 * np.linalg.inv(conditions)) / 2.0
    return hermite, orders


@lru_cache
def _matched_derivatives(degree: Degree) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives that have to match at a waypoint, by `ends`, at unit times 0 and 1; each (k, degree)."""
    matched = np.arange((degree + 1) // 2, degree)
    hermite = _hermite(degree)[0]
    zeros = np.zeros(len(matched))
    return _monomials(degree, matched, zeros) @ hermite, _monomials(degree, matched, zeros + 1.0) @ hermite


@lru_cache
def _falling_factorials(degree: Degree) -> FloatArray:
    """Return the factors (degree + 1, degree + 1) of the power k (column) when it is differentiated r (row) times."""
    return np.array([[float(perm(power, order)) for power in range(degree + 1)] for order in range(degree + 1)])


def _monomials(degree: Degree, order: np.ndarray, u: FloatArray) -> FloatArray:
    """Return the derivatives (points, degree + 1) of the powers 0 to `degree` of orders (points,) at u (points,)."""
    exponents = np.maximum(np.arange(degree + 1) - order[:, None], 0)
    values: FloatArray = _falling_factorials(degree)[order] * u[:, None] ** exponents
    return values
