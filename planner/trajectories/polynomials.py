"""Piecewise polynomials of one variable, one per joint, on common breakpoints: paths and trajectories alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import comb
from typing import Self, TypeVar

import numpy as np

from planner.kernels.polynomials import shift
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING

P = TypeVar("P", bound="PiecewisePolynomial")
"""A piecewise polynomial of any kind."""


@dataclass(frozen=True, eq=False)
class PiecewisePolynomial:
    """One polynomial per piece and joint, in local coordinates.

    On piece i, of length `lengths[i]`, joint j is at sum_k coefficients[i, j, k] * x^k for the local coordinate
    x in [0, lengths[i]]. Local coordinates keep the coefficients exact however late the piece is.

    Attributes:
        lengths: (pieces,), all positive.
        coefficients: (pieces, joints, order), ascending powers of the local coordinate, unrounded.
    """

    lengths: FloatArray
    coefficients: FloatArray

    @cached_property
    def breakpoints(self) -> FloatArray:
        """The breakpoints (pieces + 1,) between which the pieces lie, from 0 to the whole length."""
        return cumulative_sums(self.lengths)

    def derivative_coefficients(self, order: int) -> FloatArray:
        """Differentiate the curve so many times: coefficients (pieces, joints, ...), never none."""
        return differentiate(self.coefficients, order)

    def locate(self, at: FloatArray) -> tuple[np.ndarray, FloatArray]:
        """Find the piece (N,) and the local coordinate (N,) of points (N,); at a breakpoint the later piece."""
        pieces = np.searchsorted(self.breakpoints[1:-1], at, side="right")
        return pieces, np.minimum(at - self.breakpoints[pieces], self.lengths[pieces])

    def evaluate(self, at: FloatArray, derivatives: Sequence[int] = (0, 1, 2)) -> list[FloatArray]:
        """Evaluate the curve or its derivatives at points (N,); one array (N, joints) for each order.

        Args:
            at: (N,), within [0, whole length].
            derivatives: Orders of the derivatives; 0 is the curve itself.
        """
        return self.evaluate_on(*self.locate(at), derivatives)

    def evaluate_on(
        self, pieces: np.ndarray, x: FloatArray, derivatives: Sequence[int] = (0, 1, 2)
    ) -> list[FloatArray]:
        """Evaluate like `evaluate`, at local coordinates x (...) of pieces (...)."""
        column = x[..., None]
        found = []
        for order in derivatives:
            # Row by row of one power, which lie one behind the other: twice as fast as pieces with all of their powers.
            by_power = np.ascontiguousarray(self.derivative_coefficients(order).transpose(2, 0, 1))
            value = by_power[-1].take(pieces, axis=0)
            for coefficients in by_power[-2::-1]:
                value *= column
                value += coefficients.take(pieces, axis=0)
            found.append(value)
        return found

    def stretched(self, factors: FloatArray | float) -> Self:
        """Stretch the pieces to `factors` times their lengths: one factor for all of them, or (pieces,)."""
        coefficients = stretched(self.coefficients, np.reshape(factors, (-1, 1)))
        return replace(self, lengths=self.lengths * factors, coefficients=coefficients)

    def padded(self, order: int) -> Self:
        """Write the same curve with `order` coefficients a piece, the highest of them zero."""
        *shape, own = self.coefficients.shape
        if own == order:
            return self
        coefficients = np.concatenate([self.coefficients, np.zeros((*shape, order - own))], axis=2)
        return replace(self, coefficients=coefficients)

    def split(self, parts: np.ndarray) -> Self:
        """Return the same curve with each piece cut into a number (pieces,) of equal parts."""
        rows = np.repeat(np.arange(len(parts)), parts)
        lengths = (self.lengths / parts)[rows]
        offsets = (np.arange(len(rows)) - (np.cumsum(parts) - parts)[rows]) * lengths
        return replace(self, lengths=lengths, coefficients=shifted(self.coefficients[rows], offsets[:, None]))

    def of_segments(self, segments: np.ndarray) -> SegmentedPolynomial:
        """Mark the pieces with the segments (pieces,) that they belong to."""
        return SegmentedPolynomial(self.lengths, self.coefficients, segments)

    def followed_by(self, *others: Self) -> Self:
        """Return this curve and then the others, with as many coefficients a piece as the longest of them has."""
        order = max(curve.coefficients.shape[2] for curve in (self, *others))
        curves = [curve.padded(order) for curve in (self, *others)]
        coefficients = np.concatenate([curve.coefficients for curve in curves])
        return replace(self, lengths=np.concatenate([curve.lengths for curve in curves]), coefficients=coefficients)

    def between(self, start: float, end: float) -> PiecewisePolynomial:
        """Return the part of the curve from `start` to `end`, without pieces at its ends that are due to rounding."""
        shortest = ROUNDING * self.breakpoints[-1]
        (first, last), (low, _) = self.locate(np.array([start, end]))
        if first < last and self.breakpoints[first + 1] - start <= shortest:
            first, low = first + 1, start - self.breakpoints[first + 1]
        if last > first and end - self.breakpoints[last] <= shortest:
            last -= 1
        lengths, coefficients = self.lengths[first : last + 1].copy(), self.coefficients[first : last + 1].copy()
        lengths[-1] = end - self.breakpoints[last]
        coefficients[0] = shifted(coefficients[0], float(low))
        lengths[0] -= low
        return PiecewisePolynomial(lengths, coefficients)


@dataclass(frozen=True, eq=False)
class SegmentedPolynomial(PiecewisePolynomial):
    """A piecewise polynomial each piece of which belongs to a segment of a path.

    It is a curve through waypoints, a time-scaling function s(t) along such a curve (one joint), or the motion of some
    segments in time. The pieces of one segment are in order. The segments are in order only in a trajectory.

    Attributes:
        segments: (pieces,), index of the segment of each.
    """

    segments: np.ndarray

    def of(self, rows: np.ndarray) -> SegmentedPolynomial:
        """Return some of the pieces, by index or mask."""
        return SegmentedPolynomial(self.lengths[rows], self.coefficients[rows], self.segments[rows])

    def split(self, parts: np.ndarray) -> Self:
        """Return the same curve with each piece cut into a number (pieces,) of equal parts."""
        return replace(super().split(parts), segments=np.repeat(self.segments, parts))

    def followed_by(self, *others: Self) -> Self:
        """Return this curve and then the others, with as many coefficients a piece as the longest of them has."""
        segments = np.concatenate([curve.segments for curve in (self, *others)])
        return replace(super().followed_by(*others), segments=segments)


def joined(curves: Sequence[P]) -> P:
    """Join curves of one kind, one after the other."""
    return curves[0].followed_by(*curves[1:])


def stretched(coefficients: FloatArray, factors: FloatArray | float) -> FloatArray:
    """Return coefficients (..., order) of p(x / factor); `factors` broadcasts against (...)."""
    return coefficients / powers(factors, coefficients.shape[-1])


def powers(x: FloatArray | float, count: int) -> FloatArray:
    """Return the powers 0 to `count` - 1 of `x`, on a new last axis."""
    return np.asarray(x)[..., None] ** np.arange(count)


def shifted(coefficients: FloatArray, by: FloatArray | float) -> FloatArray:
    """Return coefficients (..., order) of p(x + by), by Taylor's formula; `by` broadcasts against (...)."""
    *shape, order = np.broadcast_shapes(coefficients.shape, (*np.shape(by), 1))
    rows = np.broadcast_to(coefficients, (*shape, order)).reshape(-1, order)
    return shift(rows, np.broadcast_to(by, shape).ravel()).reshape(*shape, order)


@lru_cache(maxsize=16)
def bernstein_matrix(order: int) -> FloatArray:
    """Give the matrix (order, order) from rows of ascending power coefficients on [0, 1] to Bernstein coefficients."""
    degree = order - 1
    return np.array([[comb(i, k) / comb(degree, k) if k <= i else 0.0 for i in range(order)] for k in range(order)])


def cumulative_sums(lengths: FloatArray) -> FloatArray:
    """Sum up `lengths` from 0 on, in extended precision and rounded once; one value more than there are lengths."""
    sums = np.cumsum(lengths, dtype=np.longdouble).astype(np.float64)
    return np.concatenate([[0.0], sums])


def summing_to(lengths: FloatArray, groups: np.ndarray, totals: FloatArray) -> FloatArray:
    """Adjust lengths (pieces,) so that they sum to the totals of their groups, except for the last rounding.

    The longest piece of each group takes the remainder. Rounding all pieces to the floating-point grid of the total
    would change very short ones by more than the limits allow.

    Args:
        lengths: (pieces,).
        groups: (pieces,), ascending: index of the total that each piece is a part of.
        totals: (groups,); NaN: the lengths stay.
    """
    first = np.flatnonzero(np.diff(groups, prepend=-1))
    longest = np.lexsort((-lengths, groups))[first]
    missing = totals[groups[first]] - np.add.reduceat(lengths, first, dtype=np.longdouble)
    result = lengths.copy()
    result[longest] += np.where(np.isnan(missing), 0.0, missing)
    return result


def differentiate(coefficients: FloatArray, order: int = 1) -> FloatArray:
    """Return coefficients of the derivative; ascending powers on the last axis, never empty."""
    for _ in range(order):
        if coefficients.shape[-1] == 1:
            return np.zeros_like(coefficients)
        coefficients = coefficients[..., 1:] * np.arange(1, coefficients.shape[-1])
    return coefficients


def horner(coefficients: FloatArray, x: FloatArray) -> FloatArray:
    """Evaluate the polynomials (..., order) at `x`, which broadcasts against (...)."""
    value: FloatArray = coefficients[..., -1] + np.zeros_like(x)
    for k in range(coefficients.shape[-1] - 2, -1, -1):
        value *= x
        value += coefficients[..., k]
    return value


def quintic_hermite(lengths: FloatArray, starts: tuple[FloatArray, ...], ends: tuple[FloatArray, ...]) -> FloatArray:
    """Return coefficients (pieces, joints, 6) of quintics with given values, first and second derivatives at both ends.

    Args:
        lengths: (pieces,).
        starts: Value, first and second derivative at the start of each piece; each (pieces, joints).
        ends: Value, first and second derivative at its end; each (pieces, joints).
    """
    h = lengths[:, None]
    p0, v0, a0 = starts[0], starts[1] * h, starts[2] * h**2
    v1, a1 = ends[1] * h, ends[2] * h**2
    rise = ends[0] - p0
    unit = [
        p0,
        v0,
        a0 / 2.0,
        10.0 * rise - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1,
        -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1,
        6.0 * rise - 3.0 * (v0 + v1) - 0.5 * (a0 - a1),
    ]
    return stretched(np.stack(unit, axis=-1), h)


def quintics_through(lengths: FloatArray, *states: FloatArray) -> PiecewisePolynomial:
    """Return quintics through values, first and second derivatives at their ends, each (pieces + 1, joints)."""
    starts, ends = tuple(rows[:-1] for rows in states), tuple(rows[1:] for rows in states)
    return PiecewisePolynomial(lengths, quintic_hermite(lengths, starts, ends))
