"""Cubic splines without curvature at their ends, and slopes that make no curve overshoot."""

from __future__ import annotations

import numpy as np

from planner.spatial import FloatArray

STEEPEST_SLOPE = 1.25
"""Largest ratio of the slope at a point to the smaller mean slope beside it.

Up to it, quintics without curvature at their ends are monotone.
"""


def natural_spline(lengths: FloatArray, values: FloatArray) -> FloatArray:
    """Return the coefficients (pieces, columns, 4) of the C2 cubics through values (pieces + 1, columns).

    The second derivatives solve a tridiagonal system: de Boor, A Practical Guide to Splines (2001), ch. IV.

    Args:
        lengths: Lengths (pieces,) between the values.
        values: Values (pieces + 1, columns) at the breakpoints.
    """
    from scipy.linalg import solve_banded  # loaded by the first spline: importing the library stays quick

    bends = np.zeros_like(values)
    if len(lengths) > 1:
        bands = np.zeros((3, len(lengths) - 1))
        bands[0, 1:], bands[1], bands[2, :-1] = lengths[1:-1], 2.0 * (lengths[:-1] + lengths[1:]), lengths[1:-1]
        bends[1:-1] = solve_banded((1, 1), bands, 6.0 * np.diff(np.diff(values, axis=0) / lengths[:, None], axis=0))
    return cubics(lengths, values, bends)


def cubics(lengths: FloatArray, values: FloatArray, bends: FloatArray) -> FloatArray:
    """Return the coefficients (pieces, columns, 4) of the cubics with given values and second derivatives.

    Args:
        lengths: Lengths (pieces,) of the cubics.
        values: Values (pieces + 1, columns) at the breakpoints.
        bends: Second derivatives (pieces + 1, columns) at the breakpoints.
    """
    h = lengths[:, None]
    first = np.diff(values, axis=0) / h - h * (2.0 * bends[:-1] + bends[1:]) / 6.0
    return np.stack([values[:-1], first, bends[:-1] / 2.0, np.diff(bends, axis=0) / (6.0 * h)], axis=-1)


def slopes_between(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return the slopes (points, columns) between pieces of these mean slopes: 0 where the direction changes.

    They are harmonic means, with which no curve overshoots (Fritsch and Butland 1984).
    """
    same = before * after > 0.0
    harmonic = np.where(same, 2.0 * before * after / np.where(same, before + after, 1.0), 0.0)
    steepest = STEEPEST_SLOPE * np.minimum(np.abs(before), np.abs(after))
    return np.clip(harmonic, -steepest, steepest)
