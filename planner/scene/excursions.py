"""How far the joints of a piecewise polynomial go from a position within intervals, bounded exactly."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.tolerances import ROUNDING
from planner.trajectories.polynomials import bernstein_matrix, powers, shifted

if TYPE_CHECKING:
    from planner.spatial import FloatArray
    from planner.trajectories.polynomials import PiecewisePolynomial


def excursions(curve: PiecewisePolynomial, starts: FloatArray, ends: FloatArray, positions: FloatArray) -> FloatArray:
    """Bound |q_j(t) - positions_j| for all t of intervals, by the Bernstein coefficients of the pieces in them.

    Args:
        curve: What the joints do.
        starts: (N,), where the intervals begin.
        ends: (N,), where they end.
        positions: (N, joints).

    Returns:
        (N, joints), rounding included.
    """
    breakpoints, lengths = curve.breakpoints, curve.lengths
    first = np.searchsorted(breakpoints[1:-1], starts, side="right")
    last = np.maximum(np.searchsorted(breakpoints[1:-1], ends, side="left"), first)
    count = last - first + 1
    rows = np.repeat(np.arange(len(starts)), count)
    offsets = np.cumsum(count) - count
    pieces = np.arange(len(rows)) - offsets[rows] + first[rows]
    begin = np.maximum(starts[rows] - breakpoints[pieces], 0.0)
    stop = np.maximum(np.minimum(ends[rows] - breakpoints[pieces], lengths[pieces]), begin)
    order = curve.coefficients.shape[2]
    coefficients = curve.coefficients[pieces]
    sizes = np.abs(coefficients) @ np.ascontiguousarray(powers(stop, order)[..., None])
    local = shifted(coefficients, begin[:, None]) * powers(stop - begin, order)[:, None]
    away = np.abs(local @ bernstein_matrix(order) - positions[rows][..., None]).max(axis=-1)
    away += ROUNDING * (sizes[..., 0] + np.abs(positions[rows]))
    return np.asarray(np.maximum.reduceat(away, offsets, axis=0), dtype=np.float64)
