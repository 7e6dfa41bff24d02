"""Values at even parameters made smooth, and quintics through them."""

from __future__ import annotations

import numpy as np

from planner.spatial import FloatArray
from planner.trajectories.polynomials import PiecewisePolynomial, quintics_through
from planner.trajectories.splines import slopes_between

LOOKS = 201
"""Number of points at which a curve through few values is compared with their ranges."""

LOOKS_BETWEEN = 4
"""Number of such points from value to value, where there are many values."""

SMOOTHED_NODES = 10.0
"""Wave length, in nodes, of the finest waves that smoothing leaves: half of the amplitude."""

ROOM_OFF_LIMITS = 0.05
"""The share of its range by which a joint keeps off its limits where values are chosen: smooth curves pass beside."""

RAMP = 0.2
"""The part of the way at either end, in u, on which that room grows from nothing: the ends may be at a limit."""


def room_off_limits(u: FloatArray) -> FloatArray:
    """Return the shares (N,) of their ranges by which joints keep off limits at parameters (N,)."""
    room: FloatArray = ROOM_OFF_LIMITS * np.minimum(1.0, np.minimum(u, 1.0 - u) / RAMP)
    return room


def smoothed(values: FloatArray) -> FloatArray:
    """Return values (nodes, coordinates) at even parameters without their fine waves; the first and the last stay.

    They minimise |x - values|^2 + w |third differences of x|^2 (Whittaker 1923).
    """
    nodes = len(values)
    if nodes < 6:
        return values
    # Loaded by the first such motion: importing the library stays quick.
    from scipy.sparse import diags_array, eye_array
    from scipy.sparse.linalg import splu

    rows = diags_array([-1.0, 3.0, -3.0, 1.0], offsets=[0, 1, 2, 3], shape=(nodes - 3, nodes))
    weight = (SMOOTHED_NODES / (2.0 * np.pi)) ** 6
    system = (eye_array(nodes) + weight * rows.T @ rows).tocsc()
    found = values.copy()
    ends = system[1:-1][:, [0, nodes - 1]] @ values[[0, -1]]
    found[1:-1] = splu(system[1:-1, 1:-1].tocsc()).solve(values[1:-1] - ends)
    return found


def curve_through(values: FloatArray, lower: FloatArray, upper: FloatArray) -> PiecewisePolynomial:
    """Return quintics through values (nodes, coordinates) at even parameters from 0 to 1, within ranges (coordinates,).

    Their derivatives are differences. Where such a curve leaves the ranges, one without overshoot takes its place.
    """
    curve = _smooth(values)
    (seen,) = curve.evaluate(np.linspace(0.0, 1.0, max(LOOKS, LOOKS_BETWEEN * len(values))), [0])
    return curve if ((seen >= lower) & (seen <= upper)).all() else _without_overshoot(values)


def _smooth(values: FloatArray) -> PiecewisePolynomial:
    """Return quintics through values (nodes, coordinates) at even u, with derivatives by differences."""
    step = 1.0 / (len(values) - 1)
    slopes = np.gradient(values, step, axis=0, edge_order=2)
    bends = np.diff(values, 2, axis=0) / step**2
    bends = np.vstack([bends[:1], bends, bends[-1:]])
    return quintics_through(np.full(len(values) - 1, step), values, slopes, bends)


def _without_overshoot(values: FloatArray) -> PiecewisePolynomial:
    """Return quintics through values (nodes, coordinates) at even u, without curvature at the nodes.

    Their slopes there are the harmonic means of those beside them (Fritsch and Butland 1984).
    """
    lengths = np.full(len(values) - 1, 1.0 / (len(values) - 1))
    means = np.diff(values, axis=0) / lengths[:, None]
    slopes = np.vstack([means[:1], slopes_between(means[:-1], means[1:]), means[-1:]])
    return quintics_through(lengths, values, slopes, np.zeros_like(values))
