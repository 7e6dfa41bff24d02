"""Extrema of polynomials, exact instead of sampled.

Bernstein coefficients bound a polynomial on an interval, and their first and last are values of it. Where that bound
could exceed the best value seen, the search halves the interval. With each cut the gap between bound and value shrinks
to a quarter (Lane and Riesenfeld, Bounds on a polynomial, BIT 21, 1981).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.kernels import polynomials as kernels
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING
from planner.trajectories.polynomials import PiecewisePolynomial, horner


@dataclass(frozen=True, eq=False)
class UnitPolynomials:
    """Polynomials of time, scaled to unit time, with the values of the originals.

    Attributes:
        coefficients: (..., pieces, joints, order), ascending powers on [0, 1].
        bernstein: Bernstein coefficients of the same shape, on [0, 1].
    """

    coefficients: FloatArray
    bernstein: FloatArray

    def __getitem__(self, index: int | slice | list[int]) -> UnitPolynomials:
        """Return one of the derivatives, or several, if they are stacked on the first axis."""
        return UnitPolynomials(self.coefficients[index], self.bernstein[index])

    def minus(self, constants: FloatArray) -> UnitPolynomials:
        """Subtract constants, which broadcast against (..., pieces, joints)."""
        coefficients = self.coefficients.copy()
        coefficients[..., 0] -= constants
        return UnitPolynomials(coefficients, self.bernstein - constants[..., None])

    def evaluate(self, pieces: np.ndarray, units: FloatArray) -> FloatArray:
        """Return the values (derivatives, N, joints) at unit times (N,) of pieces (N,)."""
        return kernels.evaluate(self.coefficients, pieces, units)

    @property
    def starts(self) -> FloatArray:
        """The values (..., pieces, joints) at the start of each piece."""
        return self.bernstein[..., 0]

    @property
    def ends(self) -> FloatArray:
        """The values (..., pieces, joints) at the end of each piece."""
        return self.bernstein[..., -1]


def derivatives_on_unit_time(curve: PiecewisePolynomial, count: int) -> UnitPolynomials:
    """Return the polynomials and their first derivatives by time, `count` in all, stacked on a new first axis."""
    return UnitPolynomials(*kernels.unit_derivatives(curve.lengths, curve.coefficients, count))


class Extrema(NamedTuple):
    """The extremum of each group of pieces.

    Attributes:
        pieces: (groups,), index of the piece; of derivatives that are stacked the index among all their pieces.
        joints: (groups,), index of the joint.
        units: (groups,), unit time on the piece.
        values: (groups,), value of the polynomial there.
    """

    pieces: np.ndarray
    joints: np.ndarray
    units: FloatArray
    values: FloatArray


def largest_magnitude(polynomials: UnitPolynomials, measure: FloatArray) -> tuple[int, int, float, float]:
    """Find where |p| / measure is largest over all polynomials (pieces, joints), exactly.

    Args:
        polynomials: The polynomials of every piece and joint.
        measure: (pieces, joints), positive; infinite entries never win against finite ones.

    Returns:
        Piece, joint, unit time and value of p there.
    """
    found = largest_magnitudes(polynomials, measure, np.zeros(len(measure), dtype=int))
    return int(found.pieces[0]), int(found.joints[0]), float(found.units[0]), float(found.values[0])


def largest_magnitudes(
    polynomials: UnitPolynomials, measure: FloatArray, groups: np.ndarray, directions: FloatArray | None = None
) -> Extrema:
    """Find where |p| / measure is largest over the pieces and joints of each group, exactly.

    Many groups at once, such as each derivative of a motion, cost little more than one.

    Args:
        polynomials: The polynomials of every piece and joint, or derivatives of them, stacked.
        measure: (..., pieces, joints), positive; infinite entries never win against finite ones.
        groups: (..., pieces), from 0 on without gaps.
        directions: (2, ..., pieces, joints), factors from 0 to 1 on the magnitudes of negative and of positive values.
            One of each pair is 1; None: all are 1.
    """
    joints, order = polynomials.bernstein.shape[-2:]
    at_row, at_unit = kernels.extrema(
        polynomials.bernstein.reshape(-1, order),
        measure.reshape(-1),
        np.repeat(groups.reshape(-1), joints),
        None if directions is None else directions.reshape(2, -1),
        ROUNDING,
    )
    values = horner(polynomials.coefficients.reshape(-1, order)[at_row], at_unit)
    return Extrema(*np.divmod(at_row, joints), at_unit, values)
