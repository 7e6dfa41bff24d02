"""Piecewise polynomials on unit time: derivatives, values, exact extrema, and how many samples they take."""

from __future__ import annotations

import numpy as np

from planner.kernels.library import call, doubles, indices
from planner.spatial import FloatArray


def unit_derivatives(lengths: FloatArray, coefficients: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Differentiate polynomials of time (pieces, joints, order) and scale them to unit time.

    Returns:
        Powers and Bernstein coefficients of derivatives 0 to `count` - 1, both (count, pieces, joints, order).
    """
    pieces, joints, order = coefficients.shape
    given = doubles(lengths, pieces), doubles(coefficients, pieces, joints, order)
    unit, bernstein = np.empty((2, count, pieces, joints, order))
    call("derivatives", pieces, joints, order, count, *given, unit, bernstein)
    return unit, bernstein


def evaluate(coefficients: FloatArray, pieces: np.ndarray, units: FloatArray) -> FloatArray:
    """Compute the values (count, N, joints) of polynomials (count, pieces, joints, order) at unit times of pieces."""
    count, of_pieces, joints, order = coefficients.shape
    given = doubles(coefficients, *coefficients.shape)
    at = indices(pieces, of_pieces, *pieces.shape), doubles(units, *pieces.shape)
    values = np.empty((count, len(pieces), joints))
    call("evaluate", count, of_pieces, joints, order, given, len(pieces), *at, values)
    return values


def extrema(
    bernstein: FloatArray, measure: FloatArray, groups: np.ndarray, directions: FloatArray | None, rounding: float
) -> tuple[np.ndarray, FloatArray]:
    """Find where |p| / measure is largest over the polynomials of each group, exactly.

    Args:
        bernstein: Bernstein coefficients (rows, order).
        measure: (rows,), positive.
        groups: (rows,), from 0 on without gaps.
        directions: (2, rows), factors on the magnitudes of negative and of positive values; None: all are 1.
        rounding: Share of the peak by which a bound may exceed it.

    Returns:
        Row and unit time of each group.
    """
    rows, order = bernstein.shape
    count = int(groups.max()) + 1
    at_row, at_unit, best = np.zeros(count, dtype=np.int64), np.zeros(count), np.full(count, -1.0)
    given = doubles(bernstein, rows, order), doubles(measure, rows), indices(groups, count, rows)
    weights = None if directions is None else doubles(directions, 2, rows)
    call("extrema", rows, order, *given, weights, rounding, at_row, at_unit, best)
    return at_row, at_unit


def count_parts(bernstein: FloatArray, lengths: FloatArray, density: FloatArray) -> np.ndarray:
    """Count the parts (pieces,) of pieces on which velocities and accelerations are about parabolas.

    Args:
        bernstein: Bernstein coefficients (6, pieces, joints, order) of a motion and its derivatives.
        lengths: (pieces,), s.
        density: The numbers of the structure `Density` of the kernels.
    """
    pieces, joints, order = bernstein.shape[1:]
    parts = np.empty(pieces, dtype=np.int64)
    given = doubles(bernstein, 6, pieces, joints, order), doubles(lengths, pieces), doubles(density, 5)
    call("parts", pieces, joints, order, *given, parts)
    return parts


def states_on_pieces(lengths: FloatArray, coefficients: FloatArray, shares: FloatArray) -> FloatArray:
    """Compute values and two derivatives (3, points, pieces, joints) at shares (points,) of pieces.

    Args:
        lengths: (pieces,).
        coefficients: (pieces, joints, order), ascending powers of the coordinate from the start of the piece.
        shares: (points,), from 0 to 1.
    """
    pieces, joints, order = coefficients.shape
    given = doubles(lengths, pieces), doubles(coefficients, pieces, joints, order)
    values = np.empty((3, len(shares), pieces, joints))
    call("states", pieces, joints, order, *given, len(shares), doubles(shares, len(shares)), values)
    return values


def shift(coefficients: FloatArray, by: FloatArray) -> FloatArray:
    """Compute the coefficients (rows, order) of p(x + by), by (rows,), from the coefficients of p(x)."""
    rows, order = coefficients.shape
    shifted = np.empty((rows, order))
    call("shift", rows, order, doubles(coefficients, rows, order), doubles(by, rows), shifted)
    return shifted


def times_of_arrival(coefficients: FloatArray, lengths: FloatArray, values: FloatArray, bisections: int) -> FloatArray:
    """Find the local times (N,) at which ascending polynomials (N, order) reach values (N,), within lengths (N,)."""
    count, order = coefficients.shape
    times = np.empty(count)
    given = doubles(coefficients, count, order), doubles(lengths, count), doubles(values, count)
    call("arrivals", count, order, *given, bisections, times)
    return times


def follow_scaling(
    curve: tuple[FloatArray, FloatArray, FloatArray],
    scaling: FloatArray,
    of: np.ndarray,
    on: np.ndarray,
    t: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute the motion q(s(t)) and its derivatives at N points.

    Args:
        curve: Lengths (pieces,), breakpoints (pieces + 1,) and coefficients (pieces, joints, order) of q(s).
        scaling: Coefficients (parts, order) of s(t), ascending powers of local time.
        of: The parts (N,) of the scaling.
        on: The pieces (N,) of the curve.
        t: Local times (N,) on the parts.

    Returns:
        s and its first two derivatives (3, N), q and its first three (4, N, joints), and q' and q'' by s (2, N,
        joints).
    """
    lengths, breakpoints, coefficients = curve
    (pieces, joints, order), points = coefficients.shape, len(t)
    s, q, slopes = np.empty((3, points)), np.empty((4, points, joints)), np.empty((2, points, joints))
    known = doubles(lengths, pieces), doubles(breakpoints, pieces + 1), doubles(coefficients, pieces, joints, order)
    at = indices(of, len(scaling), points), indices(on, pieces, points), doubles(t, points)
    orders = order, scaling.shape[1]
    call("follow_scaling", joints, *orders, *known, doubles(scaling, *scaling.shape), points, *at, s, q, slopes)
    return s, q, slopes
