"""The parameters of a followed path of the tool at which the samples of a trajectory are: by their joint positions.

Whatever they are, the distance of the tool from the path at a parameter is no less than that from the whole path.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.spatial import FloatArray
    from planner.trajectories.polynomials import PiecewisePolynomial

CURVE_CHORDS = 64
"""Number of chords that stand for each piece of a curve until the parameters are refined."""

GAUSS_NEWTON_STEPS = 6
"""Number of Gauss-Newton steps towards the nearest point on the curve: its pieces hardly bend."""

SECTIONS = 20
"""Number of times that a part of the curve is cut by a third before Gauss-Newton steps go on: to 3e-4 of it."""

ON_CURVE = 1e-5
"""Distance of a sample from the curve, rad or m, up to which its parameter is found: time takes joints 1e-6 off it."""

COMPARED_SAMPLES = 256
"""Number of samples that are compared with the whole curve at once, which bounds the memory that it takes."""

LEAST_SQUARE = 1e-300
"""Square of a slope, rad^2 or m^2, by which nothing is divided: there the curve stands still."""


def parameters_on(curve: PiecewisePolynomial, samples: FloatArray) -> FloatArray:
    """Find the parameters (N,) of samples (N, joints) on a curve.

    The first guess comes from the travel of the joints, as if the samples covered the whole curve. If they do not,
    because an end of the curve is blended, the nearest point of the whole curve is used.

    Args:
        curve: Joint positions over u from 0 to 1.
        samples: Joint positions, in order.
    """
    u = np.append(
        (curve.breakpoints[:-1, None] + curve.lengths[:, None] * np.arange(CURVE_CHORDS) / CURVE_CHORDS).ravel(),
        1.0,
    )
    (positions,) = curve.evaluate(u, [0])
    gone, travel = (
        np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))]) for q in (samples, positions)
    )
    found, away = _refined(curve, samples, np.interp(gone / max(float(gone[-1]), LEAST_SQUARE) * travel[-1], travel, u))
    missed = np.flatnonzero(away > ON_CURVE)
    for rows in np.split(missed, range(COMPARED_SAMPLES, len(missed), COMPARED_SAMPLES)):
        nearest = _nearest_chords(samples[rows], positions)
        first, last = u[np.maximum(nearest - 1, 0)], u[np.minimum(nearest + 2, len(u) - 1)]
        found[rows] = _refined(curve, samples[rows], _between(curve, samples[rows], first, last))[0]
    return found


def _refined(curve: PiecewisePolynomial, samples: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return parameters (N,) nearest to samples (N, joints) from guesses (N,) on, and the distances (N,) from there."""
    for _ in range(GAUSS_NEWTON_STEPS):
        q, slope = curve.evaluate(u, [0, 1])
        squares = np.maximum((slope * slope).sum(axis=1), LEAST_SQUARE)
        u = np.clip(u + ((samples - q) * slope).sum(axis=1) / squares, 0.0, 1.0)
    away: FloatArray = np.linalg.norm(samples - curve.evaluate(u, [0])[0], axis=1)
    return u, away


def _nearest_chords(samples: FloatArray, corners: FloatArray) -> np.ndarray:
    """Return the chord (N,) of the polygon through corners (M, joints) that is nearest to each sample (N, joints)."""
    chords = np.diff(corners, axis=0)
    squares = np.maximum((chords**2).sum(axis=1), LEAST_SQUARE)
    # Of s - a and a chord w: |s - a|^2 and (s - a) w, without an array of samples by chords by joints.
    products = samples @ chords.T - (corners[:-1] * chords).sum(axis=1)
    shares = np.clip(products / squares, 0.0, 1.0)
    away = (
        (corners[:-1] ** 2).sum(axis=1) - 2.0 * samples @ corners[:-1].T - shares * (2.0 * products - shares * squares)
    )
    nearest: np.ndarray = away.argmin(axis=1)
    return nearest


def _between(curve: PiecewisePolynomial, samples: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray:
    """Find the parameters (N,) nearest to samples (N, joints) between two others (N,), by thirds."""
    for _ in range(SECTIONS):
        third = (last - first) / 3.0
        left, right = first + third, last - third
        away = [np.linalg.norm(samples - curve.evaluate(u, [0])[0], axis=1) for u in (left, right)]
        nearer = away[0] <= away[1]
        first, last = np.where(nearer, first, left), np.where(nearer, right, last)
    return (first + last) / 2.0
