"""Extrema of polynomials, found and not sampled.

Bernstein coefficients bound a polynomial on an interval, and their first and last are values of it. Where that bound
could beat the best value seen, the interval is cut into parts; with each cut the gap between bound and value shrinks by
the square of their number (Lane and Riesenfeld, Bounds on a polynomial, BIT 21, 1981).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import comb
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.tolerances import ROUNDING
from planner.trajectories.polynomials import bernstein_matrix, differentiate, horner, powers

if TYPE_CHECKING:
    from planner.spatial import FloatArray
    from planner.trajectories.polynomials import PiecewisePolynomial

PARTS = 8
"""Parts that an interval is cut into at once: fewer need more rounds, more need larger ones."""

MOST_CUTS = 16
"""Number of times that intervals are cut, at most: 8^-16 of a piece is less than the spacing of numbers."""


@dataclass(frozen=True, eq=False)
class UnitPolynomials:
    """Polynomials of time, scaled to unit time: their values are those of the originals.

    Attributes:
        coefficients: (..., pieces, joints, order), ascending powers on [0, 1].
        bernstein: Bernstein coefficients of the same shape, on [0, 1].
    """

    coefficients: FloatArray
    bernstein: FloatArray

    def __getitem__(self, index: int | slice | list[int]) -> UnitPolynomials:
        """One of the derivatives, or some of them, where they are stacked on the first axis."""
        return UnitPolynomials(self.coefficients[index], self.bernstein[index])

    def minus(self, constants: FloatArray) -> UnitPolynomials:
        """Subtract constants, which broadcast against (..., pieces, joints)."""
        coefficients = self.coefficients.copy()
        coefficients[..., 0] -= constants
        return UnitPolynomials(coefficients, self.bernstein - constants[..., None])

    def evaluate(self, pieces: np.ndarray, units: FloatArray) -> FloatArray:
        """Return the values (..., N, joints) at unit times (N,) of pieces (N,)."""
        return horner(self.coefficients[..., pieces, :, :], units[:, None])

    @property
    def starts(self) -> FloatArray:
        """The values (..., pieces, joints) at the start of each piece."""
        return self.bernstein[..., 0]

    @property
    def ends(self) -> FloatArray:
        """The values (..., pieces, joints) at the end of each piece."""
        return self.bernstein[..., -1]


def derivatives_on_unit_time(curve: PiecewisePolynomial, count: int) -> UnitPolynomials:
    """Return the polynomials and their first derivatives by time, `count` in all, stacked on a new first axis.

    Args:
        curve: The polynomials of time.
        count: Number of derivatives, the polynomials themselves included.
    """
    coefficients, order = curve.coefficients, curve.coefficients.shape[2]
    unit, scales = np.zeros((count, *coefficients.shape)), powers(curve.lengths[:, None], order)
    for k in range(count):
        terms = coefficients.shape[2]
        unit[k, :, :, :terms] = coefficients * scales[:, :, :terms]
        coefficients = differentiate(coefficients)
    return UnitPolynomials(unit, (unit.reshape(-1, order) @ bernstein_matrix(order)).reshape(unit.shape))


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
        directions: (2, ..., pieces, joints), factors from 0 to 1 on the magnitudes of negative and of positive values,
            of which one of each pair is 1; None: all are 1.
    """
    joints, order = polynomials.bernstein.shape[-2:]
    group_of_row = np.repeat(groups, joints)
    best = np.full(int(groups.max()) + 1, -1.0)
    at_row, at_unit = np.zeros(len(best), dtype=int), np.zeros(len(best))
    rows, starts, width = np.arange(measure.size), np.zeros(measure.size), 1.0
    signed = polynomials.bernstein.reshape(-1, order) / measure.reshape(-1, 1)
    weights = None if directions is None else directions.reshape(2, -1, 1)
    for _ in range(MOST_CUTS):
        own = group_of_row[rows]
        # Also with weights this is convex, so that no value exceeds the largest of its Bernstein coefficients.
        ratios = (
            np.abs(signed) if weights is None else np.maximum(-signed * weights[0, rows], signed * weights[1, rows])
        )
        values = np.maximum(ratios[:, 0], ratios[:, -1])
        reached = best.copy()
        np.maximum.at(reached, own, values)
        # Of equal ones the first, which is written last.
        better = np.flatnonzero((values == reached[own]) & (values > best[own]))[::-1]
        at_row[own[better]] = rows[better]
        at_unit[own[better]] = starts[better] + np.where(ratios[better, 0] == values[better], 0.0, width)
        best = reached
        open_ones = np.flatnonzero(ratios.max(axis=1) > best[own] * (1.0 + ROUNDING))
        if not len(open_ones):
            break
        width /= PARTS
        starts = (starts[open_ones, None] + width * np.arange(PARTS)).ravel()
        rows = np.repeat(rows[open_ones], PARTS)
        signed = (signed[open_ones] @ _cut(order)).reshape(-1, order)
    values = horner(polynomials.coefficients.reshape(-1, order)[at_row], at_unit)
    return Extrema(*np.divmod(at_row, joints), at_unit, values)


def peaks_on_pieces(polynomials: UnitPolynomials) -> FloatArray:
    """Return bounds (..., pieces, joints) of the magnitudes on each piece, hardly larger than these: by its parts.

    The Bernstein coefficients of the whole piece bound the velocity of a quintic by 2.7 times its peak.
    """
    bounds: FloatArray = np.abs(polynomials.bernstein @ _cut(polynomials.bernstein.shape[-1])).max(axis=-1)
    return bounds


@lru_cache(maxsize=16)
def _cut(order: int) -> FloatArray:
    """Return the matrix (order, PARTS * order) from Bernstein coefficients on [0, 1] to those on each of its parts."""
    to_powers = np.linalg.inv(bernstein_matrix(order))
    blocks = []
    for part in range(PARTS):
        start, width = part / PARTS, 1.0 / PARTS
        # p(start + width v) in powers of v
        shift = np.array(
            [[comb(k, m) * start ** (k - m) * width**m if m <= k else 0.0 for m in range(order)] for k in range(order)]
        )
        blocks.append(to_powers @ shift @ bernstein_matrix(order))
    return np.hstack(blocks)
