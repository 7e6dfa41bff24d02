"""Extrema of polynomials, found and not sampled.

Bernstein coefficients bound a polynomial on each of a few subintervals, and their first and last are values of
it. Only where that bound could beat the best value seen are the roots of the derivative computed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import comb, copysign, sqrt
from typing import TYPE_CHECKING

import numpy as np

from planner.polynomials import bernstein_matrix, differentiate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.kinematics.poses import FloatArray

SUBINTERVALS = 8
"""Parts of [0, 1] on which a polynomial is bounded by its Bernstein coefficients."""

ROUNDING = 1e-12
"""Relative difference of a bound from a value that is not worth looking into."""

NEARLY_REAL = 1e-6
"""Imaginary part, on unit time, up to which a computed root is taken for a real one: a double root splits."""


@dataclass(frozen=True, eq=False)
class UnitPolynomials:
    """Polynomials of time, scaled to unit time: their values are those of the originals.

    Attributes:
        coefficients: (..., pieces, joints, order), ascending powers on [0, 1].
        bernstein: (..., pieces, joints, SUBINTERVALS, order): Bernstein coefficients on each subinterval.
    """

    coefficients: FloatArray
    bernstein: FloatArray

    def __getitem__(self, index: int) -> UnitPolynomials:
        return UnitPolynomials(self.coefficients[index], self.bernstein[index])

    def of(self, pieces: np.ndarray) -> UnitPolynomials:
        """Some of the pieces."""
        return UnitPolynomials(self.coefficients[..., pieces, :, :], self.bernstein[..., pieces, :, :, :])

    def minus(self, constants: FloatArray) -> UnitPolynomials:
        """The same polynomials less a constant (joints,) each."""
        coefficients = self.coefficients.copy()
        coefficients[..., 0] -= constants
        return UnitPolynomials(coefficients, self.bernstein - constants[:, None, None])

    @property
    def starts(self) -> FloatArray:
        """(..., pieces, joints): values at the start of each piece."""
        return self.bernstein[..., 0, 0]

    @property
    def ends(self) -> FloatArray:
        """(..., pieces, joints): values at the end of each piece."""
        return self.bernstein[..., -1, -1]


def derivatives_on_unit_time(coefficients: FloatArray, lengths: FloatArray, count: int) -> UnitPolynomials:
    """The polynomials and their first derivatives by time, `count` in all, stacked on a new first axis.

    Args:
        coefficients: (pieces, joints, order), ascending, in local time.
        lengths: (pieces,), the ends of local time.
        count: Of derivatives, the polynomials themselves included.
    """
    order = coefficients.shape[2]
    unit = np.zeros((count, *coefficients.shape))
    powers = lengths[:, None, None] ** np.arange(order)
    for k in range(count):
        terms = coefficients.shape[2]
        unit[k, :, :, :terms] = coefficients * powers[:, :, :terms]
        coefficients = differentiate(coefficients)
    bernstein = unit.reshape(-1, order) @ _bernstein_on_subintervals(order)
    return UnitPolynomials(unit, bernstein.reshape(*unit.shape[:-1], SUBINTERVALS, order))


def largest_magnitude(polynomials: UnitPolynomials, measure: FloatArray) -> tuple[int, int, float, float]:
    """Where |p| / measure is largest over all polynomials (pieces, joints), exactly.

    Args:
        polynomials: Of every piece and joint.
        measure: (pieces, joints), positive; infinite entries never win against finite ones.

    Returns:
        Piece, joint, unit time and value of p there.
    """
    pieces, joints, parts, order = polynomials.bernstein.shape
    weight = measure.reshape(-1)
    ratios = np.abs(polynomials.bernstein).reshape(pieces * joints, parts * order) / weight[:, None]
    # Values at the starts of the subintervals, then at the end of the last.
    values = np.column_stack([ratios[:, ::order], ratios[:, -1]])
    best, at = divmod(int(np.argmax(values)), parts + 1)
    u, ratio = at / parts, float(values[best, at])
    for i in np.flatnonzero(ratios.max(axis=1) > ratio * (1.0 + ROUNDING)).tolist():
        polynomial = polynomials.coefficients[divmod(i, joints)].tolist()
        bounds = ratios[i].reshape(parts, order).max(axis=1).tolist()
        for part, bound in enumerate(bounds):
            if bound <= ratio * (1.0 + ROUNDING):
                continue
            for root in _roots_of_derivative(polynomial, part / parts, (part + 1) / parts):
                there = abs(_value(polynomial, root)) / float(weight[i])
                if there > ratio:
                    best, u, ratio = i, root, there
    piece, joint = divmod(best, joints)
    return piece, joint, u, _value(polynomials.coefficients[piece, joint].tolist(), u)


def _value(polynomial: Sequence[float], u: float) -> float:
    value = 0.0
    for coefficient in reversed(polynomial):
        value = value * u + coefficient
    return value


def _roots_of_derivative(polynomial: Sequence[float], start: float, end: float) -> list[float]:
    """Real roots in [start, end] of the derivative of a polynomial; ascending powers."""
    slope = [k * coefficient for k, coefficient in enumerate(polynomial)][1:]
    while slope and slope[-1] == 0.0:
        slope.pop()
    if len(slope) < 2:
        return []
    if len(slope) == 2:
        roots = [-slope[0] / slope[1]]
    elif len(slope) == 3:
        roots = _quadratic_roots(*slope)
    else:
        complex_roots = np.polynomial.polynomial.polyroots(slope)
        roots = complex_roots.real[np.abs(complex_roots.imag) < NEARLY_REAL].tolist()
    return [root for root in roots if start <= root <= end]


def _quadratic_roots(c: float, b: float, a: float) -> list[float]:
    """Real roots of a x^2 + b x + c, without cancellation; a != 0."""
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return []
    q = -0.5 * (b + copysign(sqrt(discriminant), b))
    return [q / a, c / q] if q != 0.0 else [0.0]


@lru_cache(maxsize=16)
def _bernstein_on_subintervals(order: int) -> FloatArray:
    """(order, SUBINTERVALS * order): power coefficients on [0, 1] to Bernstein coefficients on each subinterval."""
    blocks = []
    for part in range(SUBINTERVALS):
        start, width = part / SUBINTERVALS, 1.0 / SUBINTERVALS
        # p(start + width v) in powers of v
        shift = np.array(
            [[comb(k, m) * start ** (k - m) * width**m if m <= k else 0.0 for m in range(order)] for k in range(order)]
        )
        blocks.append(shift @ bernstein_matrix(order))
    return np.hstack(blocks)
