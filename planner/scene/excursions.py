"""Exact bounds on the excursions of a piecewise polynomial from a position within intervals."""

from __future__ import annotations

import numpy as np

from planner.spatial import FloatArray
from planner.tolerances import ROUNDING
from planner.trajectories.polynomials import PiecewisePolynomial, bernstein_matrix, powers, shifted


def excursions(
    curve: PiecewisePolynomial,
    starts: FloatArray,
    ends: FloatArray,
    positions: FloatArray,
    velocities: FloatArray | None = None,
) -> FloatArray:
    """Bound |q_j(t) - positions_j| for all t of intervals, by the Bernstein coefficients of the pieces in them.

    With velocities v it is |q_j(t) - positions_j - v_j (t - middle of the interval)|.

    Args:
        curve: The motion of the joints.
        starts: (N,), where the intervals begin.
        ends: (N,), where they end.
        positions: (N, joints).
        velocities: (N, joints); None: 0.

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
    from_positions = local @ bernstein_matrix(order) - positions[rows][..., None]
    away = ROUNDING * (sizes[..., 0] + np.abs(positions[rows]))
    if velocities is not None:
        since = breakpoints[pieces] + begin - ((starts + ends) / 2.0)[rows]
        times = since[:, None] + (stop - begin)[:, None] * np.linspace(0.0, 1.0, order)
        from_positions -= velocities[rows][..., None] * times[:, None]
        away += ROUNDING * np.abs(velocities[rows]) * breakpoints[-1]
    away += np.abs(from_positions).max(axis=-1)
    return np.asarray(np.maximum.reduceat(away, offsets, axis=0), dtype=np.float64)
